//! `scenarios/wheel_rig.toml` as a user runs it, against the integral of the stresses: sinkage and drawbar pull by slip.

use super::rows::{EIGHT, STIFF, SoilRow, eight};
use super::wong_reece::wheel_on;
use crate::parallel::in_parallel;
use crate::process::{Outcome, read, run_scenario};
use crate::{Context, Figure, Limit};
use std::collections::BTreeMap;
use terraglue::soil_fit::{Rim, Rolling};
use terraglue_numerics::extremes::largest;

const SCENARIO: &str = "scenarios/wheel_rig.toml";
/// Radius and width of the wheel in models/wheel_rig.urdf, m; its load, N.
const WHEEL: [f64; 2] = [0.092, 0.107];
const LOAD: f64 = 64.7;
/// Weight of fork and wheel, N.
const WEIGHT: f64 = 9.81;
/// Speed of the rim in the scenario, m/s.
const RIM: f64 = 0.2;
/// Way of the axle, and the last part of it over which means are taken, m.
const WAY: f64 = 0.30;
const MEASURED: f64 = 0.06;

struct RigCase {
    /// Name in `models/soils.csv`.
    name: &'static str,
    soil: SoilRow,
    slip: f64,
}

impl RigCase {
    /// Means of the variables of the run over the last way.
    fn driven(&self, context: &Context) -> Outcome<BTreeMap<String, f64>> {
        let id = format!("rig.{}.{}", self.name, self.slip);
        let out = context.scratch.join(&id);
        let speed = RIM * (1.0 - self.slip);
        let seconds = |way: f64| format!("{:.3}", way / speed);
        let sets = [
            "soil.module=soil-cellular-automaton".to_owned(),
            format!("soil.parameters={}", self.name),
            // where the table gives another exponent than the reference data
            format!("soil.n={:?}", self.soil.value("n")),
            // the integral has one size of the contact, and pressure by the depth alone
            "soil.k_c=0.0".to_owned(),
            format!("soil.k_phi={:?}", self.soil.modulus(WHEEL[1])),
            "soil.slope_factor=false".to_owned(),
            "soil.load_inclination=false".to_owned(),
            "soil.passive_pressure=false".to_owned(),
            format!("soil.elastic_stiffness_pa_m={STIFF:?}"),
            // it knows no material that moves
            "soil.soil-cellular-automaton.compacted_fraction=1.0".to_owned(),
            "soil.soil-cellular-automaton.angle_of_repose_rad=1.4".to_owned(),
            format!("rig.velocity_target.travel={speed:?}"),
            format!("rig.torque_target.press={:?}", LOAD - WEIGHT),
        ];
        let duration = seconds(WAY);
        let mut options = vec!["--csv", "--duration", &duration];
        sets.iter().for_each(|set| options.extend(["--set", set]));
        let summary = run_scenario(&context.program, &id, SCENARIO, &out, &options)?;
        if summary["status"] != "done" {
            return Err(format!("{id}: {}", summary["error"]));
        }
        means(&read(&out.join("variables.csv"))?, (WAY - MEASURED) / speed)
            .ok_or_else(|| format!("{id}: no table"))
    }

    fn expected(&self) -> Rolling {
        let wheel = wheel_on(&self.soil, WHEEL, [0.0; 2]);
        Rim { unloading: STIFF, ..wheel }.under(LOAD, self.slip)
    }

    /// Errors of sinkage (%), of drawbar pull and of the load (% of the load), and of the slip that the soil reports.
    fn errors(&self, context: &Context) -> Outcome<[f64; 4]> {
        let (found, expected) = (self.driven(context)?, self.expected());
        let of = |name: &str| found.get(name).copied().unwrap_or(f64::NAN);
        Ok([
            100.0 * (of("rig.press.angle") / expected.sinkage - 1.0).abs(),
            100.0 * (of("soil.contact1.pull") - expected.pull).abs() / LOAD,
            100.0 * (of("soil.contact1.normal_force") / LOAD - 1.0).abs(),
            (of("soil.contact1.slip") - self.slip).abs(),
        ])
    }
}

/// Means of the columns from `from_s` on.
pub fn means(table: &str, from_s: f64) -> Option<BTreeMap<String, f64>> {
    let mut lines = table.lines();
    let names: Vec<&str> = lines.next()?.split(',').collect();
    let (mut sums, mut count) = (vec![0.0; names.len()], 0.0);
    for line in lines {
        let row: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap_or(f64::NAN)).collect();
        if *row.first()? > from_s {
            sums.iter_mut().zip(&row).for_each(|(sum, value)| *sum += value);
            count += 1.0;
        }
    }
    (count > 0.0)
        .then(|| names.into_iter().map(str::to_owned).zip(sums.iter().map(|sum| sum / count)).collect())
}

/// All figures, on one soil: both carry the wheel by the same code where it stays in place.
pub fn figures(context: &Context) -> Outcome<Vec<Figure>> {
    let soils = eight()?;
    let slips: &[f64] = if context.quick { &[0.2] } else { &[0.0, 0.1, 0.2, 0.3, 0.4, 0.6, 0.8] };
    let names = if context.quick { &[2][..] } else { &[0, 1, 2, 3] };
    let mut cases = Vec::new();
    for k in names {
        let case = |slip| RigCase { name: EIGHT[*k].0, soil: soils[*k].clone(), slip };
        cases.extend(slips.iter().copied().map(case));
    }
    let errors = in_parallel(&cases, |case| case.errors(context)).into_iter().collect::<Outcome<Vec<_>>>()?;
    let figure = |(k, quantity, limit, what): (usize, &str, f64, &str)| {
        let what = format!("{what} of {SCENARIO} against the integral of the stresses, {} runs", cases.len());
        let worst = largest(errors.iter().map(|e| e[k]));
        Figure::new(format!("soil.automaton.rig.{quantity}"), worst, Limit::AtMost(limit), what)
    };
    let quantities = [
        (0, "sinkage", 5.0, "largest error of the sinkage, %,"),
        (1, "pull", 5.0, "largest error of the drawbar pull, % of the load,"),
        (2, "load", 1.0, "largest error of the load on the soil, %,"),
        (3, "slip", 0.005, "largest error of the slip that the soil tells"),
    ];
    Ok(quantities.map(figure).into())
}
