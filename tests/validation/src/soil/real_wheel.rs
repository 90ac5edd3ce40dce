//! A real wheel: the smooth wheel of Carnegie Mellon's bench in Direct-90 sand. The integral of the stresses is
//! calibrated on some slips, the soil with these numbers drives at all of them.

use super::STILL;
use super::plates::Maker;
use super::wheel_rig::{Bench, Reading};
use crate::parallel::in_parallel;
use crate::process::{Outcome, root};
use crate::{Context, Figure, Limit};
use terraglue::soil_fit::{Known, Wheel, WheelFit, WheelPoint, WheelStart, fit_wheel, read_wheel};
use terraglue_numerics::extremes::largest;

const RADIUS: f64 = 0.058;
const WIDTH: f64 = 0.05;
const FILE: &str = "tests/reference/terramechanics/cmu_smooth_beta0_mean.csv";
/// Known properties of the sand of the plates (`CMU_Direct90_s0`), and the parameters with which the search begins.
const SAND: Known =
    Known { c_pa: Some(1000.0), phi_rad: Some(0.506145483078), shear_m: None, density: Some(1330.0) };
const START: WheelStart = WheelStart { n: 1.46, k_phi: 8e6 };

/// The numbers as a module's configuration: the sand of the plates, its rim smoother than the sand is rough; `keys`: more of
/// them.
fn config(fit: &WheelFit, keys: &str) -> String {
    let numbers: Vec<String> =
        fit.fit.numbers.iter().map(|n| format!(r#""{}":{},"#, n.key, n.value)).collect();
    format!(
        r#"{{{}"k_c":0.0,"c_pa":1000.0,"phi_rad":0.506145483078,"density_kg_m3":1330.0,"slip_sinkage":"ding",
            "slope_factor":false,"load_inclination":false,"passive_pressure":false{keys}}}"#,
        numbers.concat()
    )
}

/// Sinkage and drawbar pull of the soil at a slip.
fn driven(make: Maker, config: &str, p: &WheelPoint, spacing: f64) -> Reading {
    let soil = make(config, (0.5 / spacing) as u32 + 1, spacing);
    Bench::new(soil, [RADIUS, WIDTH], p.load, -0.1).drive(p.slip, 0.2, 0.05)
}

/// The slips, by number, on which the integral is calibrated.
type Seen = (&'static str, &'static [usize], &'static str);
const SEEN: [Seen; 2] = [
    ("three", &[0, 2, 4], "calibrated on slip 0, 0.5, 0.9"),
    ("two", &[1, 3], "calibrated on slip 0.23, 0.75"),
];

/// Errors of sinkage (%) and drawbar pull (N).
fn errors(p: &WheelPoint, found: &Reading) -> [f64; 2] {
    [100.0 * (found.sinkage / p.sinkage - 1.0).abs(), (found.pull - p.pull).abs()]
}

/// The figures of the automaton: calibrated on every other slip and on the rest.
pub fn figures(context: &Context, name: &str, make: Maker) -> Outcome<Vec<Figure>> {
    let wheel = Wheel { radius: RADIUS, width: WIDTH, load: None };
    let points = read_wheel(&root().join(FILE), &wheel).map_err(|e| e.to_string())?.points;
    let spacing = if context.quick { 0.005 } else { 0.0025 };
    let mut all = Vec::new();
    for (part, seen, of) in &SEEN {
        let calibrated: Vec<WheelPoint> = seen.iter().map(|k| points[*k]).collect();
        let fit = fit_wheel(wheel, &calibrated, SAND, START).map_err(|e| e.to_string())?;
        let drive = |keys: &str| {
            let config = config(&fit, keys);
            in_parallel(&points, |p| driven(make, &config, p, spacing))
        };
        let found = drive(&format!(",{STILL}"));
        let id = format!("soil.{name}.real_wheel.{part}");
        for (group, unseen) in [("seen", false), ("unseen", true)] {
            let of_group =
                || points.iter().zip(&found).enumerate().filter(|(k, _)| seen.contains(k) != unseen);
            for (k, quantity, unit, limit) in [(0, "sinkage", "%", 15.0), (1, "pull", "N", 2.0)] {
                let worst = largest(of_group().map(|(_, (p, f))| errors(p, f)[k]));
                let what =
                    format!("largest error of the {quantity} of the real wheel, {unit}, {group} slips; {of}");
                all.push(Figure::new(format!("{id}.{group}.{quantity}"), worst, Limit::AtMost(limit), what));
            }
        }
        let falls = found.windows(2).filter(|w| w[1].sinkage <= w[0].sinkage).count();
        let what = format!("slips between 0 and 0.9 at which the sinkage does not rise; {of}");
        all.push(Figure::new(format!("{id}.falls"), falls as f64, Limit::Equal(0.0), what));
        if !context.quick {
            all.extend(moving(&id, of, &points, &drive("")));
        }
    }
    Ok(all)
}

/// The same numbers where material moves.
fn moving(id: &str, of: &str, points: &[WheelPoint], found: &[Reading]) -> [Figure; 2] {
    let figure = |k: usize, quantity: &str, unit: &str| {
        let worst = largest(points.iter().zip(found).map(|(p, f)| errors(p, f)[k]));
        let what = format!(
            "largest error of the {quantity} of the real wheel, {unit}, all slips, where material moves; {of}; for information: \
             calibrated by the integral, which knows no heap ahead, and nothing measured says how high it is"
        );
        Figure::new(format!("{id}.moving.{quantity}"), worst, Limit::None, what)
    };
    [figure(0, "sinkage", "%"), figure(1, "pull", "N")]
}
