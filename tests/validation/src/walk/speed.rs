//! Cost of a step of the shipped scenarios as a whole, recording included, and against MuJoCo's step of the same robot on
//! rigid ground in the same run. Reported wherever clocks may be read, judged under `--timing` only.

use crate::process::Outcome;
use crate::rigid_body::mujoco_gait;
use crate::{Context, Figure, Limit};
use terraglue_acceptance::step_times::{COMBINATIONS, Case, RECORDING, Row, SCENARIOS, WHOLE, measure};

const RUNS: usize = 3;

/// All figures of the part.
pub fn figures(context: &Context) -> Outcome<Vec<Figure>> {
    if !context.timing {
        return Ok(Vec::new());
    }
    let before = mujoco_gait();
    let (mut all, mut whole) = (Vec::new(), f64::NAN);
    for (scenario, seconds) in SCENARIOS {
        for (soil, strategy) in COMBINATIONS {
            let seconds = if context.quick { 0.2 } else { seconds };
            let case = Case { scenario, soil, strategy };
            let rows = measure(case, seconds, RUNS, true).map_err(|e| e.to_string())?;
            let id = format!("walk.speed.{scenario}.{soil}.{strategy}");
            all.extend(of_case(&id, &rows));
            if (scenario, soil, strategy) == ("moon_walk", "soil-bekker", "cooperative") {
                whole = row(&rows, WHOLE, |r| r.quantile(0.5));
            }
        }
    }
    all.extend(against_mujoco(whole, [before, mujoco_gait()]));
    Ok(all.into_iter().map(Figure::timed).collect())
}

fn row(rows: &[Row], name: &str, figure: impl Fn(&Row) -> f64) -> f64 {
    rows.iter().find(|r| r.name == name).map_or(f64::NAN, figure)
}

fn of_case(id: &str, rows: &[Row]) -> Vec<Figure> {
    let figure = |name: &str, value: f64, what: &str| {
        Figure::new(
            format!("{id}.{name}"),
            value,
            Limit::None,
            format!("CPU time of the stepping thread in a step with recording: {what}"),
        )
    };
    let whole = |name: &str, of: &dyn Fn(&Row) -> f64, what: &str| figure(name, row(rows, WHOLE, of), what);
    let mut all = vec![
        whole("mean", &Row::mean, "mean, µs"),
        whole("median", &|r| r.quantile(0.5), "median, µs"),
        whole("p99", &|r| r.quantile(0.99), "99th percentile, µs; wanted: 300"),
        whole("largest", &Row::largest, "largest, µs; wanted: 600"),
    ];
    let parts = rows.iter().filter(|r| r.name != WHOLE);
    all.extend(parts.map(|r| figure(r.name, r.mean(), &format!("of it {}, mean, µs", r.name))));
    let recording = row(rows, RECORDING, |r| r.quantile(0.99));
    all.push(figure("recording_p99", recording, "of it recording, 99th percentile, µs"));
    all
}

/// The least of what MuJoCo took before and after.
fn against_mujoco(whole: f64, runs: [Outcome<Vec<Figure>>; 2]) -> Vec<Figure> {
    let id = |contacts: &str| format!("walk.speed.over_mujoco.{contacts}");
    let one = |contacts: &str| {
        let name = format!("gait.{contacts}.step");
        let of = |run: &Outcome<Vec<Figure>>| {
            let figures = run.as_ref().ok()?;
            figures.iter().find(|f| f.id.ends_with(&name)).and_then(|f| f.value)
        };
        match runs.iter().filter_map(of).reduce(f64::min) {
            Some(step) => Figure::new(
                id(contacts),
                whole / step,
                Limit::None,
                format!(
                    "step of moon_walk (Bekker, cooperative, recording; median {whole:.0} µs) over MuJoCo's of the same robot on \
                     rigid ground, {step:.1} µs; wanted with stiff contacts: 4"
                ),
            ),
            None => Figure::skipped(id(contacts), "MuJoCo is not here"),
        }
    };
    vec![one("soft"), one("stiff_contacts")]
}
