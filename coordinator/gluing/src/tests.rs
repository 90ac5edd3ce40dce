//! The strategies on a table on six feet of soil columns, held against independent reference values.
//!
//! Model, integrator and values: `tests/reference/gluing/README.md`, section "Six feet".

use super::*;
use crate::contact::{PortOwner, PortSet};
use terraglue_numerics::extremes::larger;
use terraglue_scenario::{FormChoice, GluingSpec, StartChoice, StrategyKind};
use terraglue_subsystem::{
    Error, Input, Kind, Law, Level, Motion, Port, PortKind, Response, Result as CallResult, Step, Subsystem,
    component,
};

const FEET: [(f64, f64); 6] = [(0.4, 0.3), (0.0, 0.3), (-0.4, 0.3), (0.4, -0.3), (0.0, -0.3), (-0.4, -0.3)];
const INVERSE_MASS: [f64; 3] = [1.0 / 60.0, 1.0 / 2.0, 1.0 / 4.0];
const WEIGHT: f64 = 60.0 * 9.81;

/// Heave (down), roll and pitch of a rigid table, implicit Euler.
struct Table {
    rows: [[f64; 3]; 6],
    q: [f64; 3],
    v: [f64; 3],
    trial: ([f64; 3], [f64; 3]),
}

impl Table {
    fn new(offset: (f64, f64)) -> Self {
        let rows = FEET.map(|(x, y)| [1.0, y - offset.1, -(x - offset.0)]);
        Self { rows, q: [0.0; 3], v: [0.3, 0.0, 0.0], trial: ([0.0; 3], [0.0; 3]) }
    }
}

impl Subsystem for Table {
    fn capabilities(&self) -> Capabilities {
        Capabilities::FORCE | Capabilities::RETRY
    }

    fn advance(&mut self, step: &Step, input: &Input, out: &mut Response) -> CallResult {
        let Input::Force { t, .. } = input else { return Err(Error::Unsupported) };
        for k in 0..3 {
            let load = if k == 0 { WEIGHT } else { 0.0 };
            let feet: f64 = self.rows.iter().zip(*t).map(|(row, t)| row[k] * t).sum();
            self.trial.1[k] = self.v[k] + step.h * INVERSE_MASS[k] * (load - feet);
            self.trial.0[k] = self.q[k] + step.h * self.trial.1[k];
        }
        for (i, row) in self.rows.iter().enumerate() {
            out.v[i] = -(0..3).map(|k| row[k] * self.trial.1[k]).sum::<f64>();
            out.x[i] = step.h * out.v[i];
            (out.a[i], out.t[i]) = (0.0, t[i]);
        }
        out.reached = step.t + step.h;
        Ok(())
    }

    fn commit(&mut self, _: &Step, _: &[f64], _: &Motion) -> CallResult {
        (self.q, self.v) = self.trial;
        Ok(())
    }
}

/// Independent columns: T = K·zⁿ on first loading, stiffness k_u below the deepest point.
struct Columns {
    k: [f64; 6],
    n: [f64; 6],
    k_u: [f64; 6],
    z: [f64; 6],
    z_max: [f64; 6],
    /// Point of the tangent: depth of the last trial.
    trial: [f64; 6],
    under_motion: bool,
}

impl Columns {
    fn new(factor: f64, rock: bool) -> Self {
        let mut k = [1.0, 0.5, 2.0, 1.5, 0.8, 1.2].map(|s| 15383.3 * factor * s);
        let mut n = [1.1; 6];
        let mut k_u = k.map(|k| 40.0 * k);
        if rock {
            (k[0], n[0], k_u[0]) = (1e7, 1.0, 4e7);
        }
        Self { k, n, k_u, z: [0.0; 6], z_max: [0.0; 6], trial: [0.0; 6], under_motion: false }
    }

    fn force(&self, i: usize, z: f64) -> f64 {
        let peak = self.k[i] * libm::pow(self.z_max[i], self.n[i]);
        if z >= self.z_max[i] {
            self.k[i] * libm::pow(z.max(0.0), self.n[i])
        } else {
            (peak - self.k_u[i] * (self.z_max[i] - z)).max(0.0)
        }
    }

    fn depth(&self, i: usize, t: f64) -> f64 {
        let peak = self.k[i] * libm::pow(self.z_max[i], self.n[i]);
        if t < peak {
            self.z_max[i] - (peak - t) / self.k_u[i]
        } else {
            libm::pow(t / self.k[i], 1.0 / self.n[i])
        }
    }

    /// dF/dz on the side of the last trial; regularised at 1e-3 N.
    fn stiffness(&self, i: usize) -> f64 {
        let z = self.trial[i];
        if z < self.z_max[i] {
            return if self.force(i, z) > 0.0 { self.k_u[i] } else { 0.0 };
        }
        let floor = libm::pow(1e-3 / self.k[i], 1.0 / self.n[i]);
        if z <= 0.0 { 0.0 } else { self.k[i] * self.n[i] * libm::pow(z.max(floor), self.n[i] - 1.0) }
    }
}

impl Subsystem for Columns {
    fn capabilities(&self) -> Capabilities {
        Capabilities::FORCE | Capabilities::MOTION | Capabilities::DERIVATIVES | Capabilities::RETRY
    }

    fn set_ports(&mut self, step: &Step, _: &mut [Law], now: &mut Response) -> CallResult {
        for i in 0..step.ports.len() {
            now.x[i] = (self.z[i] - self.depth(i, 0.0)).min(0.0);
            now.t[i] = self.force(i, self.z[i]);
            (now.v[i], now.a[i]) = (0.0, 0.0);
        }
        Ok(())
    }

    fn advance(&mut self, step: &Step, input: &Input, out: &mut Response) -> CallResult {
        self.under_motion = matches!(input, Input::Motion(_));
        for i in 0..step.ports.len() {
            match input {
                Input::Motion(m) => {
                    self.trial[i] = self.z[i] - m.x[i];
                    (out.x[i], out.t[i]) = (m.x[i], self.force(i, self.trial[i]));
                }
                Input::Force { t, .. } => {
                    self.trial[i] = self.depth(i, t[i]);
                    (out.x[i], out.t[i]) = (self.z[i] - self.trial[i], t[i]);
                }
            }
            (out.v[i], out.a[i]) = (0.0, 0.0);
        }
        out.reached = step.t + step.h;
        Ok(())
    }

    fn interface_jacobian(&mut self, step: &Step, _: Level, out: &mut [f64]) -> CallResult {
        let n = step.ports.len();
        out.fill(0.0);
        for i in 0..n {
            let k = self.stiffness(i);
            out[i * (n + 1)] = if self.under_motion { k } else { 1.0 / k.max(1e-3) };
        }
        Ok(())
    }

    fn commit(&mut self, step: &Step, _: &[f64], partner: &Motion) -> CallResult {
        for i in 0..step.ports.len() {
            self.z[i] -= partner.x[i];
            self.z_max[i] = larger(self.z_max[i], self.z[i]);
        }
        Ok(())
    }
}

fn ports() -> PortSet {
    let port = |i: u32| Port {
        key: u64::from(i),
        kind: PortKind::Contact as u32,
        side: 1,
        mask: component::N,
        first: i,
        body: 0,
        shape: i,
        first_node: 0,
        node_count: 0,
        origin: [0.0; 3],
        frame: [0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0],
        extent: [0.0; 2],
        law: Law::UNILATERAL,
    };
    PortSet {
        ports: (0..6).map(port).collect(),
        nodes: Vec::new(),
        epoch: 1,
        n: 6,
        owners: (0..6).map(|shape| PortOwner { subsystem: 0, ground: 1, body: 0, shape }).collect(),
    }
}

fn spec(strategy: &str, form: &str, start: &str) -> GluingSpec {
    GluingSpec {
        strategy: StrategyKind::named(strategy).expect("a strategy"),
        form: FormChoice::named(form).expect("a form"),
        tolerance: 1e-10,
        max_iterations: 60,
        start: StartChoice::named(start).expect("a start"),
        ..GluingSpec::default()
    }
}

/// Mean and largest number of evaluations of the soil, T of foot 0 and the heave at the end.
fn run(spec: &GluingSpec, factor: f64, h: f64, rock: bool) -> (f64, u32, f64, f64) {
    let duration = if h < 0.002 { 0.02 } else { 0.1 };
    let found = ports();
    let table = Instance::new("table", "test", Kind::Robot, Box::new(Table::new((0.05, 0.02))));
    let columns = Instance::new("soil", "test", Kind::Soil, Box::new(Columns::new(factor, rock)));
    let mut instances = vec![table, columns];
    let mut problem = InterfaceProblem::new(&[0], &[1], WEIGHT);
    let mut strategy = strategy(spec);
    let steps = (duration / h).round() as u64;
    let (mut sum, mut most, mut heave) = (0, 0, 0.0);
    for index in 0..steps {
        problem.begin(StepContext { t: index as f64 * h, h, index, ..StepContext::default() }, &found);
        problem.set_ports(&mut instances).expect("ports");
        let outcome = strategy.solve(&mut problem, &mut instances).expect("no module error");
        assert_eq!(outcome, Outcome::Converged, "step {index} {:?}", problem.report);
        problem.commit(&mut instances).expect("commit");
        // the mean of the feet without offset is the heave at the table's centre
        heave -= (0..6).map(|i| problem.first.x[i]).sum::<f64>() / 6.0;
        let report = &problem.report;
        assert!(strategy.name() == cooperative::NAME || report.evaluations_bodies <= 4, "{report:?}");
        let evaluations = report.evaluations_soil.max(1);
        sum += evaluations;
        most = larger(most, evaluations);
    }
    (f64::from(sum) / steps as f64, most, problem.t[0], heave)
}

/// Rows `tt_full` of `tests/reference/gluing/table6_iterations.csv`: factor, h, rock, T0 at the end.
const REFERENCE: [(f64, f64, bool, f64); 8] = [
    (1.0, 0.001, false, 74.36538739339291),
    (1.0, 0.005, false, 101.24515324432575),
    (1.0, 0.01, false, 92.48043473830403),
    (1.0, 0.02, false, 129.3602296594808),
    (10.0, 0.01, false, 124.10815106114465),
    (100.0, 0.01, false, 124.37397993845036),
    (1000.0, 0.01, false, 124.70325752302557),
    (1.0, 0.01, true, 217.6727717222384),
];

#[test]
fn tt_form_reaches_the_reference_within_the_evaluations_of_a_full_newton() {
    for (factor, h, rock, t0) in REFERENCE {
        let (mean, most, t, _) = run(&spec(iterative::NAME, "tt", "estimate"), factor, h, rock);
        println!("tt factor {factor} h {h} rock {rock}: mean {mean} max {most} T0 {t}");
        assert!((t - t0).abs() < 1e-6, "factor {factor}, h {h}: T0 = {t}, not {t0}");
        // a plain Newton on both sides needs at most 6 and 12; the check of the bodies adds one of the soil
        assert!(mean <= 7.0 && most <= 12, "factor {factor}, h {h}: {mean} mean, {most} max");
    }
}

#[test]
fn xt_form_reaches_the_same_forces_on_soft_ground() {
    for (factor, h, rock, t0) in &REFERENCE[..3] {
        let (mean, most, t, _) = run(&spec(iterative::NAME, "xt", "estimate"), *factor, *h, *rock);
        println!("xt factor {factor} h {h}: mean {mean} max {most} T0 {t}");
        assert!((t - t0).abs() < 1e-6, "factor {factor}, h {h}: T0 = {t}, not {t0}");
    }
}

#[test]
fn auto_changes_the_form_by_kappa_and_the_start_from_the_estimate_saves_evaluations() {
    let (mut cold, mut warm) = (0.0, 0.0);
    for (factor, h, rock, t0) in REFERENCE {
        let from_estimate = run(&spec(iterative::NAME, "auto", "estimate"), factor, h, rock);
        let from_zero = run(&spec(iterative::NAME, "auto", "zero"), factor, h, rock);
        assert!((from_estimate.2 - t0).abs() < 1e-6 && (from_zero.2 - t0).abs() < 1e-6, "{factor} {h}");
        (warm, cold) = (warm + from_estimate.0, cold + from_zero.0);
    }
    println!("start from the estimate {warm}, from zero {cold}");
    assert!(warm < cold, "{warm} against {cold}");
}

#[test]
fn the_single_pass_is_one_evaluation_and_first_order_in_h() {
    let heave = |h| {
        let (mean, most, _, heave) = run(&spec(cooperative::NAME, "auto", "estimate"), 1.0, h, false);
        assert!(mean == 1.0 && most == 1, "{mean} {most}");
        heave
    };
    let heaves = [1e-3, 5e-4, 2.5e-4, 1.25e-4].map(heave);
    let changes: Vec<f64> = heaves.windows(2).map(|pair| pair[0] - pair[1]).collect();
    let orders: Vec<f64> = changes.windows(2).map(|pair| (pair[0] / pair[1]).log2()).collect();
    println!("heaves {heaves:?}: orders {orders:?}");
    assert!(orders.iter().all(|order| (0.8..1.25).contains(order)), "{orders:?} of {heaves:?}");
}
