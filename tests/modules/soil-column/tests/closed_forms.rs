//! The column soil against its closed forms: static sinkage, unloading, friction, derivatives, state.
#![allow(missing_docs)]

use soil_column::{ColumnLaw, Ground, SoilColumns};
use terraglue_subsystem::*;

const LAW: ColumnLaw = ColumnLaw { k: 8340.0, n: 1.1, k_u: 2e5, k_t: 1e5, mu: 0.6 };
const WEIGHT: f64 = 5.0 * 9.81;

/// A foot of one port.
struct Foot {
    soil: SoilColumns,
    /// Height of the foot, m.
    z: f64,
    t: f64,
}

type Answer = ([f64; 3], [f64; 3], [f64; 9]);

impl Foot {
    fn new(z: f64) -> Self {
        Self { soil: SoilColumns::new(LAW, Ground::default(), 2), z, t: 0.0 }
    }

    fn port(&self) -> [Port; 1] {
        [Port {
            key: 77,
            kind: PortKind::Contact as u32,
            side: -1,
            mask: component::FORCE,
            first: 0,
            body: 0,
            shape: u32::MAX,
            first_node: 0,
            node_count: 0,
            origin: [0.0, 0.0, self.z],
            frame: [0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0],
            extent: [0.0; 2],
            law: Law::UNILATERAL,
        }]
    }

    fn call(
        &mut self,
        f: impl FnOnce(&mut SoilColumns, &Step, &mut Response) -> Result,
    ) -> ([f64; 3], [f64; 3]) {
        let ports = self.port();
        let step = Step { n: 3, ports: &ports, ..Step::free(self.t, 1e-3, 0) };
        let [mut x, mut v, mut a, mut t] = [[f64::NAN; 3]; 4];
        let mut out = Response { x: &mut x, v: &mut v, a: &mut a, t: &mut t, reached: 0.0, flags: 0 };
        f(&mut self.soil, &step, &mut out).expect("answers");
        assert_eq!((v, a), ([0.0; 3], [0.0; 3]));
        (x, t)
    }

    /// The surface and the wrench of the law now.
    fn now(&mut self) -> ([f64; 3], [f64; 3]) {
        self.call(|s, step, out| s.set_ports(step, &mut [Law::UNILATERAL], out))
    }

    fn advance(&mut self, input: Input) -> Answer {
        let mut g = [f64::NAN; 9];
        let (x, t) = self.call(|s, step, out| {
            s.advance(step, &input, out)?;
            s.interface_jacobian(step, Level::Position, &mut g)
        });
        (x, t, g)
    }

    fn force(&mut self, t: [f64; 3]) -> Answer {
        self.advance(Input::Force { t: &t, motion: None })
    }

    fn motion(&mut self, x: [f64; 3]) -> Answer {
        self.advance(Input::Motion(Motion { x: &x, v: &[0.0; 3] }))
    }

    /// The foot moves by x.
    fn commit(&mut self, t: [f64; 3], x: [f64; 3]) {
        let ports = self.port();
        let step = Step { n: 3, ports: &ports, ..Step::free(self.t, 1e-3, 0) };
        self.soil.commit(&step, &t, &Motion { x: &x, v: &[0.0; 3] }).expect("commit");
        self.z += x[0];
        self.t += 1e-3;
    }
}

#[test]
fn a_weight_sinks_to_its_static_depth_and_stays() {
    let mut foot = Foot::new(0.0);
    let expected = (WEIGHT / LAW.k).powf(1.0 / LAW.n);
    for step in 0..1000 {
        foot.now();
        let (x, t, _) = foot.force([WEIGHT, 0.0, 0.0]);
        assert_eq!(t[0], WEIGHT);
        foot.commit(t, x);
        assert!((-foot.z - expected).abs() < 1e-12, "{step}: {} {expected}", foot.z);
    }
    let (x, t) = foot.now();
    assert!(x[0] == 0.0 && (t[0] / WEIGHT - 1.0).abs() < 1e-9, "{x:?} {t:?}");
}

#[test]
fn unloading_leaves_a_footprint_of_the_closed_depth() {
    let mut foot = Foot::new(0.0);
    foot.now();
    let (x, t, _) = foot.force([WEIGHT, 0.0, 0.0]);
    foot.commit(t, x);
    // Half the weight comes off: straight line of slope k_u.
    foot.now();
    let (x, t, g) = foot.force([WEIGHT / 2.0, 0.0, 0.0]);
    assert!((x[0] - WEIGHT / 2.0 / LAW.k_u).abs() < 1e-12 && (g[0] * LAW.k_u - 1.0).abs() < 1e-12);
    foot.commit(t, x);
    // Lifted by 1 cm: the surface stays at the plastic depth.
    let plastic = (WEIGHT / LAW.k).powf(1.0 / LAW.n) - WEIGHT / LAW.k_u;
    foot.z = -plastic + 0.01;
    let (x, t) = foot.now();
    assert!((x[0] + 0.01).abs() < 1e-12 && t[0] == 0.0, "{x:?}");
}

#[test]
fn first_touch_carries_nothing() {
    let mut foot = Foot::new(0.0);
    let (x, t) = foot.now();
    assert_eq!((x, t), ([0.0; 3], [0.0; 3]));
}

#[test]
fn pressing_down_and_along_gives_both_laws() {
    let mut foot = Foot::new(0.0);
    foot.now();
    let (_, t, k) = foot.motion([-0.01, 1e-5, 0.0]);
    let force = LAW.k * 0.01_f64.powf(LAW.n);
    assert!((t[0] - force).abs() < 1e-9 && (t[1] + LAW.k_t * 1e-5).abs() < 1e-9);
    assert!((k[0] - LAW.n * force / 0.01).abs() < 1e-6 && (k[4] - LAW.k_t).abs() < 1e-6);
    let (_, t, k) = foot.motion([-0.01, 3e-3, 4e-3]);
    assert!((t[1] + LAW.mu * force * 0.6).abs() < 1e-9 && (t[2] + LAW.mu * force * 0.8).abs() < 1e-9);
    // Sliding: stiff across the slip only, and coupled to the depth.
    assert!(k[1] < 0.0 && k[2] < 0.0 && k[3] == 0.0, "{k:?}");
    assert!((0.6 * k[4] + 0.8 * k[7]).abs() < 1e-9 * LAW.k_t, "{k:?}");
}

#[test]
fn derivatives_are_those_of_the_answers() {
    let mut foot = Foot::new(-0.004);
    foot.now();
    for x in [[-0.002, 1e-6, -2e-6], [-0.002, 2e-3, 1e-3], [0.001, 0.0, 3e-3]] {
        let (_, t0, k) = foot.motion(x);
        for column in 0..3 {
            let (mut moved, d) = (x, 1e-8);
            moved[column] += d;
            let (_, t1, _) = foot.motion(moved);
            for row in 0..3 {
                let (own, numeric) = (k[3 * column + row], -(t1[row] - t0[row]) / d);
                assert!((own - numeric).abs() < 1e-4 * LAW.k_t, "{x:?} {row} {column}: {own} {numeric}");
            }
        }
    }
}

#[test]
fn energy_balances_over_a_slow_cycle() {
    let mut foot = Foot::new(0.0);
    let steps = 2000;
    for k in 1..=2 * steps {
        let load = if k <= steps { k } else { 2 * steps - k };
        foot.now();
        let (x, t, _) = foot.force([WEIGHT * f64::from(load) / f64::from(steps), 0.0, 0.0]);
        foot.commit(t, x);
    }
    // ∫ K zⁿ dz = F z/(n + 1) on the way down, F²/(2 k_u) back.
    let depth = (WEIGHT / LAW.k).powf(1.0 / LAW.n);
    let expected = WEIGHT * depth / (LAW.n + 1.0) - WEIGHT * WEIGHT / (2.0 * LAW.k_u);
    let e = foot.soil.energy();
    assert!((e.dissipated / expected - 1.0).abs() < 2e-3 && e.potential < 1e-9, "{e:?} {expected}");
}

#[test]
fn states_return_exactly_from_slots_and_bytes() {
    let mut foot = Foot::new(0.0);
    foot.now();
    let (_, t, _) = foot.motion([-0.01, 1e-5, 2e-5]);
    foot.commit(t, [-0.01, 1e-5, 2e-5]);
    foot.soil.save_state(1).expect("slot");
    let z = foot.z;
    let (bytes, here) = (foot.soil.serialize().expect("bytes"), foot.now());
    assert!(here.1[1] != 0.0);
    foot.commit([0.0; 3], [-0.02, 0.0, 0.0]);
    foot.z = z;
    assert_ne!(foot.now(), here);
    foot.soil.restore_state(1).expect("slot");
    assert_eq!(foot.now(), here);
    foot.commit([0.0; 3], [-0.02, 0.0, 0.0]);
    foot.z = z;
    foot.soil.deserialize(&bytes).expect("state");
    assert_eq!(foot.now(), here);
    assert!(foot.soil.restore_state(0).is_err() && foot.soil.save_state(2).is_err());
    assert!(foot.soil.deserialize(&bytes[1..]).is_err());
}
