//! Properties of every soil on a height field, called by the tests of each.
#![allow(dead_code, clippy::unwrap_used)]

use super::support::*;
use std::sync::Arc;
use terraglue_numerics::extremes::larger;
use terraglue_subsystem::{
    Error, Geometry, Module, NodeLaw, PressureAnswer, PressureNodes, Result, ShearAnswer, ShearNodes,
};

/// The tests of a soil of type `$soil`; `$stays`: material stays where it is pressed.
macro_rules! contact_tests {
    ($soil:ty, $stays:expr) => {
        #[test]
        fn a_ball_rests_in_the_plain_pass() {
            for soil in [support::LUNAR, support::LETE, support::DRY_SAND] {
                bars::ball_rests::<$soil>(soil, false);
            }
        }

        #[test]
        fn a_ball_rests_under_the_iteration() {
            for soil in [support::LUNAR, support::LETE, support::DRY_SAND] {
                bars::ball_rests::<$soil>(soil, true);
            }
        }

        #[test]
        fn plates_follow_the_pressure_law() {
            bars::plates_follow_bekker::<$soil>(support::LUNAR, [1.0, 1400.0, 820e3], $stays);
            bars::plates_follow_bekker::<$soil>(support::LETE, [0.793, 102e3, 5301e3], $stays);
            bars::plates_follow_bekker::<$soil>(support::DRY_SAND, [1.1, 990.0, 1_528_430.0], $stays);
        }

        #[test]
        fn a_disc_sticks_below_its_limit_and_slides_above() {
            for share in [0.3, 0.9] {
                bars::disc_sticks::<$soil>(share);
            }
        }

        #[test]
        fn a_plate_shears_after_janosi_and_hanamoto() {
            bars::plate_shears::<$soil>();
        }

        #[test]
        fn derivatives_are_those_of_the_answers() {
            for soil in [support::LUNAR, support::LETE, support::DRY_SAND] {
                bars::derivatives_are_exact::<$soil>(soil);
            }
        }

        #[test]
        fn the_inverse_of_the_normal_law_is_exact() {
            for soil in [support::LUNAR, support::LETE, support::DRY_SAND] {
                bars::normal_inverse_is_exact::<$soil>(soil);
            }
        }

        #[test]
        fn a_gap_is_reported_from_the_unrounded_state() {
            bars::gap_is_reported::<$soil>();
        }

        #[test]
        fn saved_states_come_back_exactly() {
            bars::states_are_exact::<$soil>();
        }

        #[test]
        fn energy_goes_into_storage_or_heat() {
            for soil in [support::LUNAR, support::LETE, support::DRY_SAND] {
                bars::energy_balances::<$soil>(soil);
            }
        }

        #[test]
        fn regions_of_a_mask_have_their_laws() {
            bars::regions_have_their_laws::<$soil>();
            bars::derivatives_are_exact::<$soil>(&bars::two_soils());
            bars::normal_inverse_is_exact::<$soil>(&bars::two_soils());
        }

        #[test]
        fn adhesion_pulls_only_where_it_is_set_and_lets_go() {
            bars::adhesion_holds_until_it_lets_go::<$soil>($stays);
        }

        #[test]
        fn no_law_yields_energy_in_cycles() {
            bars::cycles_yield_no_energy::<$soil>($stays);
        }
    };
}
pub(crate) use contact_tests;

/// The same soil with a stiff elastic line, under which feet come to rest at once, and with the laws of level plates alone.
fn stiff(config: &str) -> String {
    config.replacen(
        '{',
        r#"{"elastic_stiffness_pa_m":4e8,"load_inclination":false,"passive_pressure":false,"#,
        1,
    )
}

/// b of the pressure law: radius of the disc of equal area.
fn size(area: f64) -> f64 {
    (area / std::f64::consts::PI).sqrt()
}

const FOOT: Geometry = Geometry::Sphere { radius: 0.03 };

/// A ball of 5 kg comes to rest: T1 = m·g, no drift, at a depth where the law carries it.
pub fn ball_rests<M: Module>(config: &str, iterative: bool) {
    let mut fixture = Fixture::new(soil::<M>(&stiff(config), 65, 0.01, flat), FOOT, 5.0, 0.031);
    let step =
        |fixture: &mut Fixture| if iterative { fixture.iterative_step() } else { fixture.cooperative_step() };
    // gravity grows slowly: released at once, the ball would sink twice as deep
    for k in 0..2000 {
        fixture.gravity = 9.81 * (f64::from(k) / 1500.0).min(1.0);
        step(&mut fixture);
    }
    let (start, weight) = (fixture.position, 5.0 * 9.81);
    for _ in 0..1000 {
        step(&mut fixture);
        assert!((fixture.t[0] - weight).abs() < 1e-8 * weight, "T1 = {} at {}", fixture.t[0], fixture.index);
    }
    let drift = (0..3).map(|k| (fixture.position[k] - start[k]).abs()).fold(0.0, larger);
    assert!(drift <= 1e-9, "drift {drift}");
    // the depth is the law's own: it carries the weight there, hardly more, and nothing a millimetre higher
    fixture.set_ports();
    let here = fixture.under_motion(&[0.0; 6])[0];
    let higher = fixture.under_motion(&[1e-3, 0.0, 0.0, 0.0, 0.0, 0.0])[0];
    assert!(here >= weight * (1.0 - 1e-8) && here < 1.1 * weight && higher == 0.0, "{here} {higher}");
    assert!((read(&*fixture.soil, "max_sinkage") - fixture.sunk()).abs() < 2e-4, "sunk {}", fixture.sunk());
    println!("sunk {:.3} mm, F {here:.2} N, evaluations {}", 1e3 * fixture.sunk(), fixture.evaluations);
}

/// Soil that clings holds a disc back with adhesion times area, once; without a contact before it never pulls. Where material
/// `stays`, the disc meets level soil again after it was lifted; on uneven soil the nodes let go one after the other.
pub fn adhesion_holds_until_it_lets_go<M: Module>(stays: bool) {
    let (adhesion, radius) = (800.0, 0.0537);
    let area = std::f64::consts::PI * radius * radius;
    let config = stiff(LUNAR).replacen('{', &format!("{{\"adhesion_pa\":{adhesion},"), 1);
    let geometry = Geometry::Cylinder { half_length: 0.1, radius };
    let mut fixture = Fixture::new(soil::<M>(&config, 65, 0.01, flat), geometry, 1.0, 0.1);
    fixture.position[0] = 0.0031;
    let still = [0.0; 6];
    let up = |by: f64| [by, 0.0, 0.0, 0.0, 0.0, 0.0];
    let (mut work, mut turned) = (0.0, 0.0);
    for cycle in 0..if stays { 3 } else { 1 } {
        let mut least = 0.0_f64;
        let mut lift = |fixture: &mut Fixture, by: f64, steps: u32, least: &mut f64| {
            for _ in 0..steps {
                fixture.set_ports();
                let before = fixture.under_motion(&still)[0];
                let after = fixture.prescribed_step(&up(by))[0];
                *least = least.min(after);
                work -= 0.5 * by * (before + after);
                turned += (by * after).abs();
            }
        };
        fixture.set_ports();
        assert_eq!(fixture.ports[0].law.t_min, 0.0, "nothing clings before the touch");
        // down by a centimetre from a little above, then up by less than 4e8 Pa/m give per 800 Pa
        lift(&mut fixture, -1e-4, if cycle == 0 { 100 } else { 110 }, &mut least);
        assert!(least >= 0.0, "it pulled on the way down: {least} N");
        fixture.set_ports();
        assert!(
            (fixture.ports[0].law.t_min / (-adhesion * area) - 1.0).abs() < 1e-3,
            "{:?}",
            fixture.ports[0].law
        );
        // the inverse of the law where it pulls
        let (x, t) = fixture.under_force(&[-0.5 * adhesion * area, 0.0, 0.0, 0.0, 0.0, 0.0], &still);
        assert!((fixture.under_motion(&x)[0] / t[0] - 1.0).abs() < 1e-6 && t[0] < 0.0, "{x:?} {t:?}");
        lift(&mut fixture, 1e-7, 700, &mut least);
        assert!(
            (least / (-adhesion * area) - 1.0).abs() < 0.06,
            "cycle {cycle}: {least} N of {}",
            adhesion * area
        );
        let mut gone = 0.0;
        lift(&mut fixture, 1e-4, 10, &mut gone);
        assert_eq!(gone, 0.0, "cycle {cycle}");
    }
    assert!(work > -1e-6 * turned, "the soil gave out {:e} J of {turned:e} J", -work);
}

/// Lunar soil where x < −5 mm, the soil of LETE beyond.
pub fn two_soils() -> String {
    let runs: Vec<String> = (0..65).map(|_| "32,0,33,1".into()).collect();
    let mask = format!(r#","mask":{{"soils":[{LETE}],"runs":[{}]}}}}"#, runs.join(","));
    LUNAR.trim_end().strip_suffix('}').unwrap().to_owned() + &mask
}

/// A plate presses each soil of a mask with its own law; on the border each node answers for its soil.
pub fn regions_have_their_laws<M: Module>() {
    let (b, area) = (size(0.06 * 0.1), 0.06 * 0.1);
    let law = |[n, k_c, k_phi]: [f64; 3], z: f64| (k_c / b + k_phi) * libm::pow(z, n);
    let (moon, lete) = ([1.0, 1400.0, 820e3], [0.793, 102e3, 5301e3]);
    for (x, share) in [(-0.15, 1.0), (0.15, 0.0), (-0.005, 0.5), (-0.015, 2.0 / 3.0)] {
        let geometry = Geometry::Box { half_extents: [0.03, 0.05, 0.1] };
        let mut fixture = Fixture::new(soil::<M>(&stiff(&two_soils()), 65, 0.01, flat), geometry, 1.0, 0.1);
        fixture.position[0] = x;
        for k in 1..=200 {
            let force = fixture.prescribed_step(&[-1e-4, 0.0, 0.0, 0.0, 0.0, 0.0])[0];
            let z = 1e-4 * f64::from(k);
            let expected = area * (share * law(moon, z) + (1.0 - share) * law(lete, z));
            assert!(
                k < 50 || (force / expected - 1.0).abs() < 1e-6,
                "x = {x}, z = {z}: {force} N, {expected} N"
            );
        }
        // dragged far, the weaker of both strengths does not decide: each node has its own
        let pressure = |own: [f64; 3]| law(own, 0.02);
        let strength = |c: f64, phi: f64, own| c + pressure(own) * phi.tan();
        let limit = area
            * (share * strength(170.0, 0.610865238198, moon)
                + (1.0 - share) * strength(1300.0, 0.542797397, lete));
        let mut x = [0.0, 0.3, 0.0, 0.0, 0.0, 0.0];
        fixture.set_ports();
        let dragged = -fixture.under_motion(&x)[1];
        assert!((dragged / limit - 1.0).abs() < 1e-3, "{dragged} N, {limit} N");
        x[1] = -0.3;
        assert!((fixture.under_motion(&x)[1] / limit - 1.0).abs() < 1e-3);
    }
}

/// Plates under prescribed motion follow the closed form p = (k_c/b + k_φ)·zⁿ.
/// If material `stays`, the plate meets the same soil again after it was lifted.
pub fn plates_follow_bekker<M: Module>(config: &str, [n, k_c, k_phi]: [f64; 3], stays: bool) {
    for (geometry, b, area) in [
        (
            Geometry::Cylinder { half_length: 0.1, radius: 0.0537 },
            0.0537,
            std::f64::consts::PI * 0.0537 * 0.0537,
        ),
        (Geometry::Box { half_extents: [0.03, 0.05, 0.1] }, size(0.06 * 0.1), 0.06 * 0.1),
    ] {
        let mut fixture = Fixture::new(soil::<M>(&stiff(config), 65, 0.01, flat), geometry, 1.0, 0.1);
        fixture.position[0] = 0.0031;
        for k in 1..=500 {
            let force = fixture.prescribed_step(&[-1e-4, 0.0, 0.0, 0.0, 0.0, 0.0])[0];
            let z = 1e-4 * f64::from(k);
            if k >= 50 {
                let expected = (k_c / b + k_phi) * z.powf(n) * area;
                assert!((force / expected - 1.0).abs() < 0.01, "z = {z}: {force} N, {expected} N");
            }
        }
        // unloading is elastic: 4e8 Pa/m, then nothing
        fixture.set_ports();
        let (top, back) = (fixture.under_motion(&[0.0; 6])[0], 1e-6);
        let less = fixture.prescribed_step(&[back, 0.0, 0.0, 0.0, 0.0, 0.0])[0];
        assert!((less - (top - 4e8 * area * back)).abs() < 1e-6 * top, "{top} {less}");
        assert_eq!(fixture.prescribed_step(&[0.002, 0.0, 0.0, 0.0, 0.0, 0.0])[0], 0.0);
        // reloading comes back to the same force at the same depth, up to the memory of a node without a foot
        let again = fixture.prescribed_step(&[-0.002 - back, 0.0, 0.0, 0.0, 0.0, 0.0])[0];
        assert!(!stays || (again / top - 1.0).abs() < 1e-6, "{again} {top}");
    }
}

/// A disc under a lateral force of a share of its limit stays where it is.
pub fn disc_sticks<M: Module>(share: f64) {
    let geometry = Geometry::Cylinder { half_length: 0.02, radius: 0.05 };
    let mass = 50.0 / 9.81;
    let mut fixture = Fixture::new(soil::<M>(&stiff(LUNAR), 65, 0.01, flat), geometry, mass, 0.02);
    let limit = 170.0 * std::f64::consts::PI * 0.0025 + 50.0 * 0.610865238198f64.tan();
    for k in 0..1000 {
        fixture.gravity = 9.81 * (f64::from(k) / 500.0).min(1.0);
        fixture.iterative_step();
    }
    for k in 0..1500 {
        fixture.force[0] = share * limit * (f64::from(k) / 500.0).min(1.0);
        fixture.iterative_step();
    }
    let start = fixture.position;
    for _ in 0..1000 {
        fixture.iterative_step();
    }
    let drift = (fixture.position[0] - start[0]).hypot(fixture.position[1] - start[1]);
    assert!(drift < 1e-9, "drift {drift} at {share}");
    assert!((fixture.t[1] + share * limit).abs() < 1e-6 * limit, "{} {}", fixture.t[1], share * limit);
    // pushed beyond the limit it slides, and dissipates
    let before = fixture.soil.energy().dissipated;
    fixture.force[0] = 1.2 * limit;
    for _ in 0..200 {
        fixture.iterative_step();
    }
    assert!(fixture.position[0] - start[0] > 1e-3 && fixture.soil.energy().dissipated > before + 0.01);
}

/// Shear of a plate at constant depth: Janosi and Hanamoto.
pub fn plate_shears<M: Module>() {
    let geometry = Geometry::Box { half_extents: [0.05, 0.05, 0.1] };
    let mut fixture = Fixture::new(soil::<M>(&stiff(LUNAR), 65, 0.01, flat), geometry, 1.0, 0.1);
    for _ in 0..100 {
        fixture.prescribed_step(&[-1e-4, 0.0, 0.0, 0.0, 0.0, 0.0]);
    }
    let (mut last, mut j) = (0.0, 0.0);
    for _ in 0..40 {
        // one trial, not committed: the plate's edge does not travel over fresh ground
        j += 1e-3;
        fixture.set_ports();
        let t = fixture.under_motion(&[0.0, j, 0.0, 0.0, 0.0, 0.0]);
        let strength = 170.0 * 0.01 + t[0] * 0.610865238198f64.tan();
        let expected = strength * (1.0 - (-j / 0.018f64).exp());
        assert!((-t[1] / expected - 1.0).abs() < 2e-3, "{j}: {} {expected}", t[1]);
        assert!(-t[1] > last);
        last = -t[1];
    }
}

/// Derivatives after motion and after force against finite differences, for a tilted, sliding, turning box.
pub fn derivatives_are_exact<M: Module>(config: &str) {
    let geometry = Geometry::Box { half_extents: [0.04, 0.03, 0.02] };
    let mut fixture = Fixture::new(soil::<M>(config, 65, 0.01, hump), geometry, 1.0, 0.012);
    fixture.normal = [0.1, -0.05, (1.0f64 - 0.0125).sqrt()];
    for _ in 0..20 {
        fixture.prescribed_step(&[-1e-4, 2e-5, 1e-5, 0.0, 0.0, 0.0]);
    }
    fixture.set_ports();
    let x = [-3e-4, 4e-4, -2e-4, 0.002, -0.001, 0.0015];
    let n = x.len();
    fixture.under_motion(&x);
    let k = fixture.jacobian();
    let d = 1e-8;
    for c in 0..n {
        let at = |fixture: &mut Fixture, s: f64| {
            let mut y = x;
            y[c] += s;
            fixture.under_motion(&y)
        };
        let (plus, minus) = (at(&mut fixture, d), at(&mut fixture, -d));
        for r in 0..n {
            let numeric = -(plus[r] - minus[r]) / (2.0 * d);
            let scale = (k[r * n + r].abs() * k[c * n + c].abs()).sqrt();
            assert!((numeric - k[c * n + r]).abs() < 1e-4 * scale, "K[{r},{c}] {} {numeric}", k[c * n + r]);
        }
    }
    hybrid_derivatives_are_exact(&mut fixture, &x);
}

fn hybrid_derivatives_are_exact(fixture: &mut Fixture, x: &[f64; 6]) {
    let n = x.len();
    let force = fixture.under_motion(x);
    let (surface, wrench) = fixture.under_force(&force, x);
    assert!((surface[0] - x[0]).abs() < 1e-12, "{} {}", surface[0], x[0]);
    assert!((0..n).all(|c| (wrench[c] - force[c]).abs() < 1e-6 * force[0]));
    let block = fixture.jacobian();
    for c in 0..n {
        let d = if c == 0 { 1e-3 } else { 1e-8 };
        let at = |fixture: &mut Fixture, s: f64| {
            let (mut t, mut y) = (force.clone(), *x);
            if c == 0 {
                t[0] -= s
            } else {
                y[c] += s
            }
            fixture.under_force(&t, &y)
        };
        let ((xp, tp), (xm, tm)) = (at(fixture, d), at(fixture, -d));
        for r in 0..n {
            let numeric = if r == 0 { (xp[0] - xm[0]) / (2.0 * d) } else { -(tp[r] - tm[r]) / (2.0 * d) };
            let exact = block[c * n + r];
            let column = (0..n).map(|r| block[c * n + r].abs()).fold(0.0, larger);
            let scale = if r == 0 { exact.abs() + 1e-6 * column } else { column };
            assert!((numeric - exact).abs() < 1e-3 * scale, "G[{r},{c}] {exact} {numeric}");
        }
    }
}

fn hump(x: f64, y: f64) -> f64 {
    -0.1 * x + 0.05 * y - 0.3 * (x * x + y * y)
}

/// The inverse of the normal law is exact, and without force the surface is where the foot leaves the soil.
pub fn normal_inverse_is_exact<M: Module>(config: &str) {
    let mut fixture = Fixture::new(soil::<M>(config, 65, 0.01, flat), FOOT, 5.0, 0.03);
    for _ in 0..50 {
        fixture.prescribed_step(&[-1e-4, 0.0, 0.0, 0.0, 0.0, 0.0]);
    }
    fixture.set_ports();
    for force in [1e-6, 1e-3, 0.1, 1.0, 5.0, 20.0, 200.0, 3000.0] {
        let (x, _) = fixture.under_force(&[force, 0.0, 0.0, 0.0, 0.0, 0.0], &[0.0; 6]);
        let back = fixture.under_motion(&x)[0];
        assert!((back - force).abs() <= 1e-12 * force + 1e-9, "{force}: {back}");
    }
    let (free, _) = fixture.under_force(&[0.0; 6], &[0.0; 6]);
    assert_eq!(fixture.under_motion(&[free[0] + 1e-12, 0.0, 0.0, 0.0, 0.0, 0.0])[0], 0.0);
    assert!(fixture.under_motion(&[free[0] - 1e-9, 0.0, 0.0, 0.0, 0.0, 0.0])[0] > 0.0);
}

/// Above the ground the answer is the gap along n, and no force.
pub fn gap_is_reported<M: Module>() {
    let mut fixture = Fixture::new(soil::<M>(LUNAR, 65, 0.01, flat), FOOT, 5.0, 0.0345);
    let (x, t) = fixture.set_ports();
    assert!((x[0] + 0.0045).abs() < 1e-15 && t.iter().all(|t| *t == 0.0), "{x:?} {t:?}");
    assert!((fixture.ports[0].law.mu - 0.610865238198f64.tan()).abs() < 1e-15);
}

/// Saved in the middle, restored after something else happened: the same bytes again.
pub fn states_are_exact<M: Module>() {
    let mut fixture = Fixture::new(soil::<M>(LUNAR, 65, 0.01, flat), FOOT, 5.0, 0.031);
    let run = |fixture: &mut Fixture, steps: u32| {
        (0..steps)
            .map(|_| {
                fixture.force[0] = 3.0;
                fixture.cooperative_step();
                (
                    fixture.position.map(f64::to_bits),
                    fixture.t.iter().map(|t| t.to_bits()).collect::<Vec<_>>(),
                )
            })
            .collect::<Vec<_>>()
    };
    run(&mut fixture, 120);
    fixture.soil.save_state(1).unwrap();
    let body = (fixture.position, fixture.velocity, fixture.time, fixture.index);
    let first = run(&mut fixture, 200);
    let energy = fixture.soil.energy();
    run(&mut fixture, 100);
    fixture.soil.restore_state(1).unwrap();
    (fixture.position, fixture.velocity, fixture.time, fixture.index) = body;
    assert!(run(&mut fixture, 200) == first);
    assert_eq!(fixture.soil.energy(), energy);
    assert!(fixture.soil.restore_state(2).is_err() && fixture.soil.save_state(99).is_err());
}

/// Work of the foot is stored or dissipated, except for the elastic energy still in the soil.
pub fn energy_balances<M: Module>(config: &str) {
    let mut fixture = Fixture::new(soil::<M>(config, 65, 0.01, flat), FOOT, 5.0, 0.03);
    for k in 0..1000 {
        let slide = if k > 500 { 1e-6 } else { 0.0 };
        fixture.prescribed_step(&[if k < 500 { -2e-5 } else { 0.0 }, slide, 0.0, 0.0, 0.0, 0.0]);
    }
    let e = fixture.soil.energy();
    let stored = e.potential + e.dissipated;
    assert!((stored / e.port_work - 1.0).abs() < 1e-5, "{e:?}");
    assert!(e.potential > 0.0 && e.dissipated > 0.0);
}

/// A law that is a module: p = a·z + c·z², stiffer than unloading from some depth on.
struct Stiffening {
    a: f64,
    c: f64,
}

impl NodeLaw for Stiffening {
    fn name(&self) -> &str {
        "stiffening"
    }
    fn has_pressure(&self) -> bool {
        true
    }
    fn has_shear(&self) -> bool {
        false
    }
    fn pressure(&self, nodes: &PressureNodes, out: &mut PressureAnswer) -> Result {
        for (k, z) in nodes.depth.iter().enumerate() {
            out.pressure[k] = (self.a + self.c * z) * z;
            out.slope[k] = self.a + 2.0 * self.c * z;
        }
        Ok(())
    }
    fn shear(&self, _: &ShearNodes, _: &mut ShearAnswer) -> Result {
        Err(Error::Unsupported)
    }
    fn as_any(&self) -> &dyn std::any::Any {
        self
    }
}

/// Pressed and released again and again, ever deeper, a stiff convex law yields no energy, whoever wrote it: built in, as text,
/// as a module. Where it is softer than unloading it is untouched. Where material `stays`, all work becomes heat that is booked.
pub fn cycles_yield_no_energy<M: Module>(stays: bool) {
    let text = r#""law":{"pressure":"a*z + q*z^2","parameters":{"a":"2e5 Pa/m","q":"1e8 Pa/m^2"}},"#;
    let module = r#""law":{"plugin":"stiffening"},"#;
    let power = r#""n":2.0,"k_c":0,"k_phi":1e8,"#;
    for stiffness in [1e6, 5e6, 4e8] {
        let soft = format!("\"elastic_stiffness_pa_m\":{stiffness:e},\"compacted_fraction\":1.0,");
        let mut forces = Vec::new();
        for keys in [text, module, power] {
            let config = match keys == power {
                true => LUNAR.replacen(r#""n":1.0,"k_c":1400,"k_phi":820000,"#, power, 1),
                false => LUNAR.replacen('{', &format!("{{{keys}"), 1),
            };
            let config = config.replacen('{', &format!("{{{soft}"), 1);
            let config = if M::schema().parameters.iter().any(|p| p.name == "compacted_fraction") {
                config
            } else {
                config.replace("\"compacted_fraction\":1.0,", "")
            };
            let law: Arc<dyn NodeLaw> = Arc::new(Stiffening { a: 2e5, c: 1e8 });
            let terrain = Shaped { size: [65; 2], spacing: 0.01, height: flat };
            let (soil, host) = hosted::<M>(&config, terrain, (keys == module).then_some(law));
            let said = host.said.lock().unwrap().join(" ");
            assert_eq!(
                said.contains("`elastic_stiffness_pa_m`"),
                keys == module && stiffness < 1e8,
                "{said}"
            );
            let geometry = Geometry::Cylinder { half_length: 0.1, radius: 0.0537 };
            forces.push(cycle(Fixture::new(soil, geometry, 1.0, 0.1), stays));
        }
        // text and module are the same law
        let [text, module] = [&forces[0], &forces[1]];
        assert!(text.iter().zip(module).all(|(a, b)| (a - b).abs() <= 1e-9 * b.abs()), "{text:?} {module:?}");
        if stiffness > 1e8 {
            let area = std::f64::consts::PI * 0.0537 * 0.0537;
            let law = (2e5 + 1e8 * 0.02) * 0.02 * area;
            assert!((text[0] / law - 1.0).abs() < 0.01, "{} {law}", text[0]);
        }
    }
}

/// Forces at the deepest points of cycles between the surface and 2, 4 and 5 cm.
fn cycle(mut fixture: Fixture, stays: bool) -> Vec<f64> {
    let (still, step) = ([0.0; 6], 1e-4);
    let (mut work, mut turned, mut deepest) = (0.0, 0.0, Vec::new());
    for end in [200, 400, 500] {
        for (by, down) in [(-step, true), (step, false)] {
            for _ in 0..end {
                fixture.set_ports();
                let before = fixture.under_motion(&still)[0];
                let after = fixture.prescribed_step(&[by, 0.0, 0.0, 0.0, 0.0, 0.0])[0];
                assert!(after >= 0.0 && after.is_finite());
                work -= 0.5 * by * (before + after);
                turned += 0.5 * step * (before + after);
                if down && fixture.sunk() > step * (f64::from(end) - 0.5) {
                    deepest.push(after);
                }
            }
        }
        let energy = fixture.soil.energy();
        assert!(work > -1e-6 * turned, "cycle to {end}: the soil gave out {:e} J of {turned:e} J", -work);
        assert!(energy.dissipated >= 0.0 && energy.potential.abs() < 1e-9 * turned, "{energy:?}");
        assert!(!stays || (energy.dissipated - work).abs() < 0.02 * turned, "{work:e} J in, {energy:?}");
    }
    assert_eq!(deepest.len(), 3);
    deepest
}
