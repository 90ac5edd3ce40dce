//! Error over cost of the orders of connections, on four cases with a known solution; beside them other masters with
//! the same FMUs.
//!
//! Cost is the number of steps that all FMUs make per simulated second, with those that are repeated: the FMUs count
//! them themselves.

use super::cost::peers;
use super::{built, fmus};
use crate::process::{Outcome, command};
use crate::{Figure, Limit};
use std::path::Path;
use terraglue_numerics::extremes::larger;

/// End of a run, s.
const END: f64 = 2.0;
/// Lengths of a step, ms.
const STEPS_MS: [u32; 3] = [20, 10, 5];
const SCRIPT: &str = "tests/validation/src/fmi/masters_peers.py";

/// Promise of theory for an error.
#[derive(Clone, Copy)]
enum Theory {
    /// There is none but for rounding.
    Exact,
    /// It falls with the step at least with this order, which leaves room below the one of theory.
    Order(f64),
    /// It is for comparison.
    Nothing,
}

/// A way to pass values on.
struct Order {
    name: &'static str,
    /// Its lines in `[[connect]]`.
    lines: &'static str,
    theory: Theory,
}

const JACOBI: Order = Order { name: "jacobi", lines: "order = \"jacobi\"\n", theory: Theory::Order(0.9) };
const STRUCTURE: Order = Order { name: "structure", lines: "", theory: Theory::Order(0.9) };
const LINEAR: Order =
    Order { name: "linear", lines: "extrapolate = \"linear\"\n", theory: Theory::Order(1.8) };
const DERIVATIVES: Order =
    Order { name: "derivatives", lines: "extrapolate = \"derivatives\"\n", theory: Theory::Order(1.8) };
const ITERATE: Order = Order { name: "iterate", lines: "order = \"iterate\"\n", theory: Theory::Order(1.8) };
const ITERATE_ENDS: Order =
    Order { name: "iterate-ends", lines: "order = \"iterate-ends\"\n", theory: Theory::Order(1.8) };
/// In the order of the structure a chain holds no value: the line is for connections that are late.
const LATE_LINE: Order = Order {
    name: "linear",
    lines: "order = \"jacobi\"\nextrapolate = \"linear\"\n",
    theory: Theory::Order(1.8),
};
const EXACT: Order = Order { name: "structure", lines: "", theory: Theory::Exact };

/// FMUs, their connections, and the solution.
struct Case {
    name: &'static str,
    what: &'static str,
    /// Name of each subsystem and of its FMU.
    subsystems: Vec<[String; 2]>,
    connections: Vec<[String; 2]>,
    /// Variables and their values at the end.
    exact: Vec<(&'static str, f64)>,
    orders: Vec<Order>,
}

/// `peers`: with other masters for comparison.
pub fn figures(folder: &Path, peers: bool) -> Outcome<Vec<Figure>> {
    let folder = folder.join("error_over_cost");
    std::fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let mut all = Vec::new();
    for case in [two_mass(&folder, true)?, chain(&folder)?, van_der_pol(&folder)?, drive(&folder)?] {
        for order in &case.orders {
            let run = |step_s| ours(&folder, &case, order, step_s);
            let text = format!("order `{}`", order.name);
            all.extend(of_master(&case, order.name, &text, order.theory, run)?);
        }
        for peer in ["fmpy", "ecos", "omsimulator"].iter().filter(|_| peers) {
            let run = |step_s| of_peer(&folder, &case, peer, step_s);
            match of_master(&case, peer, peer, Theory::Nothing, run) {
                Ok(figures) => all.extend(figures),
                Err(why) => all.push(Figure::skipped(id(&case, peer), why)),
            }
        }
    }
    all.extend(held(&folder)?);
    all.extend(swings(&folder)?);
    Ok(all)
}

fn id(case: &Case, master: &str) -> String {
    format!("fmi.error_over_cost.{}.{master}", case.name)
}

/// Errors, costs and the order of convergence with steps of all lengths.
fn of_master(
    case: &Case,
    master: &str,
    text: &str,
    theory: Theory,
    run: impl Fn(f64) -> Outcome<End>,
) -> Outcome<Vec<Figure>> {
    let (id, what) = (id(case, master), case.what);
    let limit = if matches!(theory, Theory::Exact) { Limit::AtMost(1e-12) } else { Limit::None };
    let (mut all, mut errors) = (Vec::new(), Vec::new());
    for ms in STEPS_MS {
        let end = run(f64::from(ms) / 1000.0)?;
        errors.push(end.error);
        let text = format!("{what}, {text}, steps of {ms} ms");
        all.push(Figure::new(format!("{id}.{ms}ms"), end.error, limit, format!("{text}: error at the end")));
        let what = format!("{text}: steps of all FMUs per simulated second");
        all.push(Figure::new(format!("{id}.{ms}ms.cost"), end.steps / END, Limit::None, what));
        let what = format!("{text}: CPU time of the run, s");
        all.extend(end.cpu_s.map(|s| Figure::new(format!("{id}.{ms}ms.cpu"), s, Limit::None, what).timed()));
    }
    let limit = match theory {
        Theory::Exact => return Ok(all),
        Theory::Order(least) => Limit::AtLeast(least),
        Theory::Nothing => Limit::None,
    };
    if let [.., coarse, fine] = errors[..] {
        let what = format!("{what}, {text}: order of the error from 10 ms to 5 ms");
        all.push(Figure::new(format!("{id}.order"), (coarse / fine).log2(), limit, what));
    }
    Ok(all)
}

/// The end of a run.
struct End {
    /// Largest distance of a variable from the solution.
    error: f64,
    /// Of all FMUs together.
    steps: f64,
    /// Measured for other masters only.
    cpu_s: Option<f64>,
}

impl End {
    /// From values of the variables with a solution, then the counts of all FMUs.
    fn new(case: &Case, values: &[f64], cpu_s: Option<f64>) -> Self {
        let (found, counts) = values.split_at(case.exact.len());
        let distances = found.iter().zip(&case.exact).map(|(x, (_, exact))| (x - exact).abs());
        Self { error: distances.fold(0.0, larger), steps: counts.iter().sum(), cpu_s }
    }
}

impl Case {
    /// The variables that are read at the end.
    fn variables(&self) -> Vec<String> {
        let counts = self.subsystems.iter().map(|[name, _]| format!("{name}.trials"));
        self.exact.iter().map(|(name, _)| (*name).to_owned()).chain(counts).collect()
    }
}

fn ours(folder: &Path, case: &Case, order: &Order, step_s: f64) -> Outcome<End> {
    Ok(End::new(case, &values(folder, case, order, [step_s, END], &case.variables())?, None))
}

/// Its scenario; step and end in s.
fn scenario(case: &Case, order: &Order, [step_s, end_s]: [f64; 2]) -> String {
    let mut text = format!("[time]\nstep_s = {step_s:?}\nduration_s = {end_s:?}\n");
    for [name, fmu] in &case.subsystems {
        text += &format!("[{name}]\nfmu = \"{fmu}.fmu\"\n");
    }
    for [from, to] in &case.connections {
        text += &format!("[[connect]]\nfrom = \"{from}\"\nto = \"{to}\"\n{}", order.lines);
    }
    text
}

/// Variables at the end of a run; step and end in s.
fn values(
    folder: &Path,
    case: &Case,
    order: &Order,
    [step_s, end_s]: [f64; 2],
    variables: &[String],
) -> Outcome<Vec<f64>> {
    let mut testbed = built(folder, &scenario(case, order, [step_s, end_s]))?;
    while testbed.t_s() < end_s - 0.5 * step_s {
        testbed.step().map_err(|e| e.to_string())?;
    }
    Ok(variables.iter().map(|name| testbed.read(name).unwrap_or(f64::NAN)).collect())
}

fn of_peer(folder: &Path, case: &Case, peer: &str, step_s: f64) -> Outcome<End> {
    let mut script = command(peers::python()?, &[SCRIPT, peer]);
    script.args([format!("{step_s:?}"), format!("{END:?}")]);
    for [name, fmu] in &case.subsystems {
        script.arg(format!("{name}={}", folder.join(format!("{fmu}.fmu")).display()));
    }
    for [from, to] in &case.connections {
        script.arg(format!("{from}->{to}"));
    }
    script.args(case.variables());
    let found: Vec<f64> = peers::result(script)?.split_whitespace().filter_map(|w| w.parse().ok()).collect();
    match found.split_last() {
        Some((cpu_s, values)) if values.len() == case.variables().len() => {
            Ok(End::new(case, values, Some(*cpu_s)))
        }
        _ => Err(format!("{peer} gave {} values", found.len())),
    }
}

/// Values at the end of equations of the first order, by the classical rule of Runge and Kutta in steps of 1e-5 s.
fn at_once<const N: usize>(start: [f64; N], rate: impl Fn(f64, [f64; N]) -> [f64; N]) -> [f64; N] {
    let along = |s: [f64; N], r: [f64; N], h: f64| std::array::from_fn(|i| s[i] + h * r[i]);
    let (mut s, h) = (start, 1e-5);
    for step in 0..(END / h).round() as u32 {
        let t = h * f64::from(step);
        let a = rate(t, s);
        let b = rate(t + 0.5 * h, along(s, a, 0.5 * h));
        let c = rate(t + 0.5 * h, along(s, b, 0.5 * h));
        let d = rate(t + h, along(s, c, h));
        s = std::array::from_fn(|i| s[i] + h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]));
    }
    s
}

fn pairs<const N: usize>(names: [[&str; 2]; N]) -> Vec<[String; 2]> {
    names.iter().map(|pair| pair.map(str::to_owned)).collect()
}

/// Masses, kg, the stiffness between them, N/m, and the place of the first at the start, m.
const TWO_MASS: [f64; 4] = [1.0, 2.0, 30.0, 0.1];

/// The exact motion under a force that is held.
const LEFT: &str = "static double trials; double a = v[1] / v[0]; \
     v[2] += h * v[3] + 0.5 * h * h * a; v[3] += h * a; v[4] = ++trials;";
/// The exact motion while the other end of the spring goes along a line from its last place to the new one.
const RIGHT: &str = "static double trials; double w = sqrt(v[1] / v[0]); \
     double r = (v[2] - v[7]) / h, x = v[4] - v[7], y = v[5] - r; \
     v[4] = x * cos(w * h) + y / w * sin(w * h) + v[2]; v[5] = y * cos(w * h) - w * x * sin(w * h) + r; \
     v[7] = v[2]; v[8] = ++trials;";
/// The same while the other end of the spring stays at its new place.
const RIGHT_HELD: &str = "static double trials; double w = sqrt(v[1] / v[0]), x = v[4] - v[2], y = v[5]; \
     v[4] = x * cos(w * h) + y / w * sin(w * h) + v[2]; v[5] = y * cos(w * h) - w * x * sin(w * h); \
     v[7] = v[2]; v[8] = ++trials;";

/// Two masses on a spring that belongs to the second FMU; `line`: its input goes along a line within it.
fn two_mass(folder: &Path, line: bool) -> Outcome<Case> {
    let [m1, m2, k, x0] = TWO_MASS;
    let left = [("m", 'p', m1), ("f", 'i', -k * x0), ("x", 's', x0), ("v", 's', 0.0), ("trials", 's', 0.0)];
    fmus::build_with_rates(folder, "left", &left, ("", LEFT), &[(2, "v[3]"), (3, "v[1] / v[0]")])?;
    let right = [
        ("m", 'p', m2),
        ("k", 'p', k),
        ("x1", 'i', x0),
        ("v1", 'i', 0.0),
        ("x", 's', 0.0),
        ("v", 's', 0.0),
        ("f", 'o', -k * x0),
        ("before", 's', x0),
        ("trials", 's', 0.0),
    ];
    let (name, step) = if line { ("right", RIGHT) } else { ("right_held", RIGHT_HELD) };
    let force = ("v[6] = v[1] * (v[4] - v[2]);", step);
    fmus::build_with_rates(folder, name, &right, force, &[(6, "v[1] * (v[5] - v[3])")])?;
    let frequency = (k * (1.0 / m1 + 1.0 / m2)).sqrt();
    let (middle, apart) = (m1 * x0 / (m1 + m2), x0 * (frequency * END).cos());
    Ok(Case {
        name: if line { "two_mass" } else { "two_mass_held" },
        what: "two masses on a spring (places, m)",
        subsystems: pairs([["left", "left"], ["right", name]]),
        connections: pairs([["left.x", "right.x1"], ["left.v", "right.v1"], ["right.f", "left.f"]]),
        exact: vec![
            ("left.x", middle + m2 / (m1 + m2) * apart),
            ("right.x", middle - m1 / (m1 + m2) * apart),
        ],
        orders: vec![JACOBI, STRUCTURE, LINEAR, DERIVATIVES, ITERATE, ITERATE_ENDS],
    })
}

/// An FMU with direct feed-through that holds its input within a step loses the second order.
fn held(folder: &Path) -> Outcome<Vec<Figure>> {
    let case = two_mass(folder, false)?;
    let mut all = Vec::new();
    for order in [LINEAR, ITERATE] {
        let text = format!("order `{}`, the FMU of the spring holds its input within a step", order.name);
        let run = |step_s| ours(folder, &case, &order, step_s);
        all.extend(of_master(&case, order.name, &text, Theory::Order(0.9), run)?);
    }
    Ok(all)
}

/// Two masses that swing for long in coarse steps: no damping takes away the energy that an order adds. Amplitudes are the largest of a swing, as
/// a rule may keep another ellipse of places and speeds than the exact motion.
fn swings(folder: &Path) -> Outcome<Vec<Figure>> {
    const STEP_S: f64 = 0.05;
    let (case, [m1, m2, k, x0]) = (two_mass(folder, true)?, TWO_MASS);
    let frequency = (k * (1.0 / m1 + 1.0 / m2)).sqrt();
    let swing = (std::f64::consts::TAU / frequency / STEP_S).ceil() as usize;
    let mut all = Vec::new();
    for (order, limit) in [
        (LINEAR, Limit::None),
        (DERIVATIVES, Limit::None),
        (ITERATE, Limit::AtMost(0.01)),
        (ITERATE_ENDS, Limit::AtMost(0.01)),
    ] {
        let mut testbed = built(folder, &scenario(&case, &order, [STEP_S, 100.0]))?;
        let mut amplitudes = Vec::new();
        while testbed.t_s() < 100.0 - 0.5 * STEP_S {
            testbed.step().map_err(|e| e.to_string())?;
            let read = |name: &str| testbed.read(name).unwrap_or(f64::NAN);
            let (x, v) = (read("left.x") - read("right.x"), read("left.v") - read("right.v"));
            amplitudes.push(x.hypot(v / frequency));
        }
        let largest = |all: &[f64]| all.iter().copied().fold(0.0, larger);
        let (first, last) = (&amplitudes[..swing], &amplitudes[amplitudes.len() - swing..]);
        let id = format!("fmi.error_over_cost.two_mass_100s.{}", order.name);
        let text = format!(
            "two masses on a spring without damping, 100 s in steps of 50 ms, order `{}`",
            order.name
        );
        let growth = 100.0 * (largest(last) / largest(first) - 1.0).abs();
        all.push(Figure::new(&id, growth, limit, format!("{text}: change of the amplitude, %")));
        let apart = largest(&amplitudes.iter().map(|a| (a / x0 - 1.0).abs()).collect::<Vec<f64>>());
        let what = format!("{text}: largest difference from the exact amplitude, %");
        all.push(Figure::new(format!("{id}.apart"), 100.0 * apart, Limit::None, what));
    }
    Ok(all)
}

/// Links of the chain.
const LINKS: usize = 5;
/// Angular frequency of its source, rad/s.
const SOURCE: f64 = 3.0;

/// A source behind which five FMUs make u + 0.25 sin(u) of their input u at once.
fn chain(folder: &Path) -> Outcome<Case> {
    let source = [("w", 'p', SOURCE), ("phase", 's', 0.0), ("y", 's', 0.0), ("trials", 's', 0.0)];
    let step = "static double trials; v[1] += h * v[0]; v[3] = ++trials;";
    fmus::build(folder, "source", &source, "v[2] = sin(v[1]);", step)?;
    let (mut subsystems, mut connections) = (pairs([["source", "source"]]), Vec::new());
    let (mut before, mut y) = ("source".to_owned(), (SOURCE * END).sin());
    // a library of its own for each link: some masters load a file once, and the count would be that of all links
    let (link, step) =
        ([("u", 'i', 0.0), ("y", 'o', 0.0), ("trials", 's', 0.0)], "static double trials; v[2] = ++trials;");
    for k in 1..=LINKS {
        let name = format!("link_{k}");
        fmus::build(folder, &name, &link, "v[1] = v[0] + 0.25 * sin(v[0]);", step)?;
        subsystems.push([name.clone(), name.clone()]);
        connections.push([format!("{before}.y"), format!("{name}.u")]);
        before = name;
        y += 0.25 * y.sin();
    }
    Ok(Case {
        name: "chain",
        what: "a source and five FMUs with direct feed-through behind each other (the last value)",
        subsystems,
        connections,
        exact: vec![("link_5.y", y)],
        orders: vec![JACOBI, EXACT, LATE_LINE],
    })
}

/// Damping parameter of both oscillators, and the stiffness between them.
const VAN_DER_POL: [f64; 2] = [1.0, 0.5];
/// Place and speed of the first, then of the second.
const VAN_DER_POL_START: [f64; 4] = [2.0, 0.0, -0.5, 1.0];
/// A hundred steps of the midpoint rule with an input that is held.
const OSCILLATOR: &str = "static double trials; double g = h / 100; \
     for (int i = 0; i < 100; i++) { double x = v[3], w = v[4]; \
     double a = v[0] * (1 - x * x) * w - x + v[1] * (v[2] - x); \
     double y = x + 0.5 * g * w, z = w + 0.5 * g * a; \
     v[3] = x + g * z; v[4] = w + g * (v[0] * (1 - y * y) * z - y + v[1] * (v[2] - y)); } v[5] = ++trials;";

/// Two oscillators that feel each other's place.
fn van_der_pol(folder: &Path) -> Outcome<Case> {
    let [mu, k] = VAN_DER_POL;
    for (name, at) in [("one", 0), ("two", 2)] {
        let s = VAN_DER_POL_START;
        let all = [
            ("mu", 'p', mu),
            ("k", 'p', k),
            ("u", 'i', s[2 - at]),
            ("x", 's', s[at]),
            ("v", 's', s[at + 1]),
            ("trials", 's', 0.0),
        ];
        fmus::build_with_rates(folder, name, &all, ("", OSCILLATOR), &[(3, "v[4]")])?;
    }
    let end = at_once(VAN_DER_POL_START, |_, s| {
        let of = |x: f64, v: f64, other: f64| mu * (1.0 - x * x) * v - x + k * (other - x);
        [s[1], of(s[0], s[1], s[2]), s[3], of(s[2], s[3], s[0])]
    });
    Ok(Case {
        name: "van_der_pol",
        what: "two coupled oscillators of van der Pol (places, m)",
        subsystems: pairs([["one", "one"], ["two", "two"]]),
        connections: pairs([["one.x", "two.u"], ["two.x", "one.u"]]),
        exact: vec![("one.x", end[0]), ("two.x", end[2])],
        orders: vec![JACOBI, LINEAR, DERIVATIVES, ITERATE, ITERATE_ENDS],
    })
}

/// Inductance, H, resistance, Ω, constant of the motor, N m/A, inertia, kg m², and friction, N m s.
const MOTOR: [f64; 5] = [0.05, 1.0, 0.5, 0.02, 0.01];
/// Gains, V s and V, and amplitude, rad/s, and angular frequency, rad/s, of the speed that is asked for.
const CONTROLLER: [f64; 4] = [0.5, 4.0, 100.0, 3.0];

/// The exact motion under a voltage that is held: the series of the exponential of the matrix.
const MOTOR_STEP: &str = "static double trials; double w = (v[2] * v[7] - v[4] * v[6]) / v[3] * h, \
     i = (v[5] - v[1] * v[7] - v[2] * v[6]) / v[0] * h; \
     for (int k = 2; k <= 20; k++) { v[6] += w; v[7] += i; double a = (v[2] * i - v[4] * w) / v[3] * h / k; \
     i = -(v[1] * i + v[2] * w) / v[0] * h / k; w = a; } v[9] = ++trials;";
/// Acceleration of the motor.
const MOTOR_CALC: &str = "v[8] = (v[2] * v[7] - v[4] * v[6]) / v[3];";
/// Sum of a proportional part and an integral; the latter by the trapezoidal rule over the last two errors.
const CONTROLLER_STEP: &str = "static double trials; v[7] += h; double e = v[2] * sin(v[3] * v[7]) - v[4]; \
     v[8] += 0.5 * h * v[1] * (v[9] + e); v[9] = e; v[10] = ++trials;";
const CONTROLLER_CALC: &str = "v[6] = v[0] * (v[2] * sin(v[3] * v[7]) - v[4]) + v[8];";
const CONTROLLER_RATE: &str =
    "v[0] * (v[2] * v[3] * cos(v[3] * v[7]) - v[5]) + v[1] * (v[2] * sin(v[3] * v[7]) - v[4])";

/// A motor whose speed a controller moves.
fn drive(folder: &Path) -> Outcome<Case> {
    let ([l, r, k, j, d], [kp, ki, top, omega]) = (MOTOR, CONTROLLER);
    let motor = [
        ("l", 'p', l),
        ("r", 'p', r),
        ("k", 'p', k),
        ("j", 'p', j),
        ("d", 'p', d),
        ("u", 'i', 0.0),
        ("w", 's', 0.0),
        ("i", 's', 0.0),
        ("a", 's', 0.0),
        ("trials", 's', 0.0),
    ];
    let jerk = "(v[2] * (v[5] - v[1] * v[7] - v[2] * v[6]) / v[0] - v[4] * v[8]) / v[3]";
    fmus::build_with_rates(folder, "motor", &motor, (MOTOR_CALC, MOTOR_STEP), &[(6, "v[8]"), (8, jerk)])?;
    let controller = [
        ("kp", 'p', kp),
        ("ki", 'p', ki),
        ("top", 'p', top),
        ("omega", 'p', omega),
        ("w", 'i', 0.0),
        ("a", 'i', 0.0),
        ("u", 'o', 0.0),
        ("t", 's', 0.0),
        ("integral", 's', 0.0),
        ("before", 's', 0.0),
        ("trials", 's', 0.0),
    ];
    let code = (CONTROLLER_CALC, CONTROLLER_STEP);
    fmus::build_with_rates(folder, "controller", &controller, code, &[(6, CONTROLLER_RATE)])?;
    let end = at_once([0.0; 3], |t, [w, i, integral]| {
        let e = top * (omega * t).sin() - w;
        [(k * i - d * w) / j, (kp * e + integral - r * i - k * w) / l, ki * e]
    });
    Ok(Case {
        name: "drive",
        what: "a motor and its controller (speed, rad/s)",
        subsystems: pairs([["motor", "motor"], ["controller", "controller"]]),
        connections: pairs([
            ["motor.w", "controller.w"],
            ["motor.a", "controller.a"],
            ["controller.u", "motor.u"],
        ]),
        exact: vec![("motor.w", end[0])],
        orders: vec![JACOBI, STRUCTURE, LINEAR, DERIVATIVES, ITERATE, ITERATE_ENDS],
    })
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_script_is_there() {
        assert!(crate::process::root().join(super::SCRIPT).exists());
    }
}
