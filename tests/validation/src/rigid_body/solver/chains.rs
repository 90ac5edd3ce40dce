//! Passive chains of eight links against references in reduced coordinates.

use crate::process::Outcome;
use crate::rigid_body::fixture::{Fixture, G, pose};
use crate::{Figure, Limit};
use nalgebra::Vector3;
use terraglue_numerics::extremes::larger;

const SPATIAL: &str = r#"{"j2": 0.2, "j4": 0.2, "j6": 0.2, "j8": 0.2}"#;
const HEAVY: &str = r#"{"j1": -1.0707963267948966}"#;
const TIP: [(&str, &str, [f64; 3]); 4] = [
    ("chain8", SPATIAL, [-1.640621154, -0.580129864, -0.919078146]),
    ("chain8_planar", "{}", [-1.763829172, 0.0, -0.929046757]),
    ("chain8_m100", HEAVY, [-0.576683260, 0.0, -1.915025000]),
    ("chain8_m1000", HEAVY, [-0.566796969, 0.0, -1.918003510]),
];
/// An energy error that is rounding, J.
const EXACT: f64 = 1e-6;
const LINK: Vector3<f64> = Vector3::new(0.25, 0.0, 0.0);

/// Results of a run.
struct ChainRun {
    /// Distance of the tip from the reference at 1 s, m.
    tip: f64,
    /// Largest |ΔE| and ΔE at the end, J.
    energy: [f64; 2],
    /// Largest distance of two anchors, m.
    gap: f64,
}

/// The spatial chain with a rule of second order. The one that conserves energy is held against the limit of the energy;
/// that of generalized-alpha, which damps motion that a step cannot resolve, is reported only.
fn spatial_second_order(integrator: &str) -> Outcome<Vec<Figure>> {
    let (file, joints, tip) = TIP[0];
    let [coarse, fine] = [1e-3, 5e-4].map(|h| run(file, joints, tip, integrator, h, 10.0));
    let (coarse, fine) = (coarse?, fine?);
    let figure = |name: &str, value: f64, limit: Limit, what: &str| {
        Figure::new(format!("rigid-body.chain8.{integrator}.{name}"), value, limit, what)
    };
    let conserves = coarse.energy[0] < EXACT;
    let judged = integrator == "energy-momentum";
    let bar = if judged { Limit::AtMost(0.05) } else { Limit::None };
    let (ratio, of) = if conserves {
        (coarse.tip / fine.tip, "error of the tip at 1 s (the energy is conserved at any step)")
    } else {
        (coarse.energy[0] / fine.energy[0], "largest |ΔE|")
    };
    Ok(vec![
        figure("energy", coarse.energy[0], bar, "spatial chain, 10 s: largest |ΔE|, J"),
        figure("energy_end", coarse.energy[1], Limit::None, "the same: ΔE at the end, J"),
        figure("ratio", ratio, Limit::AtLeast(3.0), &format!("{of}: at h over that at h/2")),
        figure("gap", 1e3 * coarse.gap, Limit::AtMost(1e-6), "the same: largest gap of a joint, mm"),
        figure("tip", 1e3 * coarse.tip, Limit::AtMost(0.02), "tip at 1 s, mm from the reference"),
    ])
}

/// All chains.
pub fn figures() -> Outcome<Vec<Figure>> {
    let mut all = Vec::new();
    let (file, joints, tip) = TIP[0];
    let first = run(file, joints, tip, "symplectic-euler", 1e-3, 10.0)?;
    let id = "rigid-body.chain8";
    let figure = |name: &str, value: f64, limit: Limit, what: &str| {
        Figure::new(format!("{id}.{name}"), value, limit, what)
    };
    let what = "spatial chain, first order, 10 s: largest |ΔE|, J";
    all.push(figure("first-order.energy", first.energy[0], Limit::AtMost(10.0), what));
    let what = "spatial chain, first order: ΔE at 10 s, J";
    all.push(figure("first-order.energy_end", first.energy[1], Limit::None, what));
    all.push(figure("first-order.tip", 1e3 * first.tip, Limit::None, "tip at 1 s, mm from the reference"));
    all.extend(spatial_second_order("generalized-alpha")?);
    all.extend(spatial_second_order("energy-momentum")?);
    for integrator in ["generalized-alpha", "energy-momentum"] {
        for (file, joints, tip) in &TIP[1..] {
            let heavy = *joints == HEAVY;
            let run = run(file, joints, *tip, integrator, 1e-3, if heavy { 10.0 } else { 1.0 })?;
            let id = format!("rigid-body.{file}.{integrator}");
            let what = "tip at 1 s, mm from the reference";
            all.push(Figure::new(format!("{id}.tip"), 1e3 * run.tip, Limit::AtMost(0.02), what));
            if heavy {
                let what = "a heavy end on light links, 10 s: largest gap of a joint, mm";
                all.push(Figure::new(format!("{id}.gap"), 1e3 * run.gap, Limit::AtMost(1e-6), what));
                let what = "the same: largest |ΔE|, J";
                all.push(Figure::new(format!("{id}.energy"), run.energy[0], Limit::AtMost(0.05), what));
            }
        }
    }
    Ok(all)
}

fn run(file: &str, joints: &str, tip: [f64; 3], integrator: &str, h: f64, until: f64) -> Outcome<ChainRun> {
    let parameters = format!(
        r#"{{"model": "tests/reference/multibody/{file}.urdf", "motor": "off", "joints": {joints},
        "integrator": "{integrator}"}}"#
    );
    let mut fixture = Fixture::new(&parameters, [0.0, 0.0, -G], h)?;
    let start = fixture.energy().mechanical();
    let mut result = ChainRun { tip: f64::NAN, energy: [0.0; 2], gap: 0.0 };
    let second = (1.0 / h).round();
    fixture.run(until, |fixture| {
        let states = fixture.states()?;
        let mut end = Vector3::zeros();
        for state in &states {
            let (p, q) = pose(state);
            result.gap = larger(result.gap, (p - end).norm());
            end = p + q * LINK;
        }
        if (fixture.t() / h).round() == second {
            result.tip = (end - Vector3::from(tip)).norm();
        }
        let change = fixture.energy().mechanical() - start;
        result.energy = [larger(result.energy[0], change.abs()), change];
        Ok(())
    })?;
    Ok(result)
}
