//! Two oscillators in two FMUs, glued: the same as one oscillator with the sums of masses, springs and dampers, or, on a
//! spring between them, as both solved at once. Beside it the error of explicit masters at the same step.

use super::cost::peers;
use super::{built, fmus};
use crate::process::{Outcome, command};
use crate::{Figure, Limit};
use std::path::Path;
use terraglue_numerics::extremes::larger;

const STEPS: u32 = 2000;
const H: f64 = 1e-3;
/// m, k, d of both.
const SIDES: [[f64; 3]; 2] = [[1.0, 40.0, 0.3], [10.0, 1000.0, 0.1]];
const X0: f64 = 0.1;

/// Backward Euler: the steps of the FMUs, and one FMU with the sums.
const STEP: &str =
    "v[4] = (v[0] * v[4] + h * (v[5] - v[1] * v[3])) / (v[0] + h * v[2] + h * h * v[1]); v[3] += h * v[4];";

/// `peers`: with other masters for comparison.
pub fn figures(folder: &Path, peers: bool) -> Outcome<Vec<Figure>> {
    for (name, [m, k, d]) in ["left", "right"].iter().zip(SIDES) {
        let variables =
            [("m", 'p', m), ("k", 'p', k), ("d", 'p', d), ("x", 'o', X0), ("v", 'o', 0.0), ("f", 'i', 0.0)];
        fmus::build(folder, name, &variables, "", STEP)?;
    }
    let glued = |form: &str| {
        worst(folder, &format!("[gluing]\nstrategy = \"iterative\"\nform = \"{form}\"\ntolerance = 1e-8\n"))
    };
    let mut all = on_a_spring(folder, peers)?;
    let what = "two oscillators as FMUs, glued T-T, against one oscillator: largest difference of x over its largest value";
    all.insert(0, Figure::new("fmi.pair.tt", glued("tt")?, Limit::AtMost(1e-10), what));
    Ok(all)
}

/// Stiffness and damping of the spring between the masses, N/m and N s/m.
const SPRING: [f64; 2] = [1e3, 1.0];

/// Both masses at once by backward Euler: places of the first.
fn at_once() -> Vec<f64> {
    let ([m1, k1, d1], [m2, k2, d2], [k, d]) = (SIDES[0], SIDES[1], SPRING);
    let shared = H * d + H * H * k;
    let (a11, a22) = (m1 + H * d1 + H * H * k1 + shared, m2 + H * d2 + H * H * k2 + shared);
    let (mut x, mut v) = ([X0, X0], [0.0; 2]);
    let step = |_| {
        let pull = k * (x[0] - x[1]);
        let (b1, b2) = (m1 * v[0] - H * (k1 * x[0] + pull), m2 * v[1] - H * (k2 * x[1] - pull));
        let determinant = a11 * a22 - shared * shared;
        v = [(b1 * a22 + shared * b2) / determinant, (a11 * b2 + shared * b1) / determinant];
        x = [x[0] + H * v[0], x[1] + H * v[1]];
        x[0]
    };
    (0..STEPS).map(step).collect()
}

/// Largest difference over the largest excursion.
fn off(found: &[f64], wanted: &[f64]) -> f64 {
    if found.len() != wanted.len() {
        return f64::NAN;
    }
    let all = found.iter().zip(wanted).map(|(a, b)| (a - b).abs() / X0);
    all.fold(0.0, larger)
}

fn on_a_spring(folder: &Path, peers: bool) -> Outcome<Vec<Figure>> {
    let wanted = at_once();
    let [k, d] = SPRING;
    let tables = scenario(
        "[gluing]\nstrategy = \"iterative\"\nform = \"tt\"\ntolerance = 1e-9\n",
        &format!("compliance_m_n = {:?}\ndamping_n_s_m = {d:?}\n", 1.0 / k),
    );
    let mut testbed = built(folder, &tables)?;
    let mut found = Vec::new();
    for _ in 0..STEPS {
        testbed.step().map_err(|e| e.to_string())?;
        found.push(testbed.read("left.x").unwrap_or(f64::NAN));
    }
    let what = |who: &str| {
        format!("two masses on a spring as FMUs against both solved at once, largest error of x: {who}")
    };
    let ours =
        Figure::new("fmi.pair.spring", off(&found, &wanted), Limit::AtMost(1e-10), what("iterative T-T"));
    let mut all = vec![ours];
    if !peers {
        return Ok(all);
    }
    // the spring belongs to the right FMU, as explicit masters need it
    let [m, own_k, own_d] = SIDES[1];
    let variables = [
        ("m", 'p', m),
        ("k", 'p', own_k),
        ("d", 'p', own_d),
        ("x", 'o', X0),
        ("v", 'o', 0.0),
        ("x1", 'i', X0),
        ("v1", 'i', 0.0),
        ("f", 'o', 0.0),
    ];
    let step = format!(
        "double kc = {k:?}, dc = {d:?}; v[4] = (v[0] * v[4] + h * (-v[1] * v[3] + kc * (v[5] - v[3]) + dc * v[6])) \
         / (v[0] + h * v[2] + h * h * v[1] + h * dc + h * h * kc); v[3] += h * v[4]; \
         v[7] = -(kc * (v[5] - v[3]) + dc * (v[6] - v[4]));"
    );
    fmus::build(folder, "sprung", &variables, "", &step)?;
    for peer in ["ecos", "fmpy", "pyfmi"] {
        let id = format!("fmi.pair.spring.{peer}");
        let run = || -> Outcome<f64> {
            let mut script = command(&peers::python()?, &["tests/validation/src/fmi/pair_peers.py", peer]);
            script.args(["left.fmu", "sprung.fmu"].map(|name| folder.join(name)));
            script.args([STEPS.to_string(), format!("{H:?}")]);
            let found: Vec<f64> =
                peers::result(script)?.split_whitespace().filter_map(|w| w.parse().ok()).collect();
            Ok(off(&found, &wanted))
        };
        all.push(match run() {
            Ok(error) => Figure::new(id, error, Limit::None, what(&format!("{peer}, explicit"))),
            Err(why) => Figure::skipped(id, why),
        });
    }
    Ok(all)
}

fn scenario(gluing: &str, glue: &str) -> String {
    let body = "position = [\"x\"]\nvelocity = [\"v\"]\nforce = [\"f\"]\n";
    format!(
        "[time]\nstep_s = {H}\nduration_s = 2.0\n{gluing}[left]\nfmu = \"left.fmu\"\n[left.bodies.mass]\n{body}\
         [right]\nfmu = \"right.fmu\"\n[right.bodies.mass]\n{body}[[glue]]\nside_1 = \"left.mass\"\nside_2 = \"right.mass\"\n\
         components = [\"x\"]\n{glue}"
    )
}

/// Largest difference of either FMU from the whole, relative to the largest excursion.
fn worst(folder: &Path, gluing: &str) -> Outcome<f64> {
    let mut testbed = built(folder, &scenario(gluing, ""))?;
    let [m, k, d] = [0, 1, 2].map(|i| SIDES[0][i] + SIDES[1][i]);
    let (mut x, mut v, mut worst) = (X0, 0.0, 0.0_f64);
    for _ in 0..STEPS {
        testbed.step().map_err(|e| e.to_string())?;
        v = (m * v - H * k * x) / (m + H * d + H * H * k);
        x += H * v;
        for name in ["left.x", "right.x"] {
            let found = testbed.read(name).unwrap_or(f64::NAN);
            worst = larger(worst, (found - x).abs());
        }
    }
    Ok(worst / X0)
}
