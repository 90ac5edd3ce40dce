//! Wheels: the soils against the integral of Wong and Reece over the same stresses, and against its shifted peak.

use super::plates::Maker;
use super::rows::{Row, eight};
use super::wheel_rig::{Bench, Reading};
use super::wong_reece::{State, Wheel, wheel_of, wheel_on};
use super::{MODULES, in_parallel, real_wheel};
use crate::process::Outcome;
use crate::validate::{Context, Figure, Limit};
use terraglue_soil_law::DEFAULT_ELASTIC_STIFFNESS;

/// Spacing of the lattice, m, quickly and else: a contact of 2 cm spans eight cells.
const SPACINGS: [f64; 2] = [0.005, 0.0025];
/// Length of the ground, m.
const GROUND: f64 = 0.6;
/// Way until the wheel has sunk in and the soil below it is as it stays, and way of the means, m.
const WAY: f64 = 0.24;
const MEASURED: f64 = 0.06;
/// a0 and a1 of the reference table.
const SHIFTED: [f64; 2] = [0.4, 0.15];

/// One wheel on one soil at one slip.
struct Case {
    make: Maker,
    soil: Row,
    wheel: [f64; 3],
    slip: f64,
    peak: [f64; 2],
    spacing: f64,
}

impl Case {
    fn expected(&self) -> State {
        let [radius, width, load] = self.wheel;
        let wheel = wheel_on(&self.soil, [radius, width], self.peak);
        Wheel { unloading: DEFAULT_ELASTIC_STIFFNESS, ..wheel }.under(load, self.slip)
    }

    fn driven(&self) -> Reading {
        let [radius, width, load] = self.wheel;
        let config = match self.peak {
            [0.0, 0.0] => self.soil.config.clone(),
            [a0, a1] => self.soil.with(&format!(r#""wheel_peak_a0":{a0},"wheel_peak_a1":{a1}"#)),
        };
        let soil = (self.make)(&config, (GROUND / self.spacing) as u32 + 1, self.spacing);
        Bench::new(soil, [radius, width], load, -0.5 * WAY).drive(self.slip, WAY, MEASURED)
    }

    /// Errors of sinkage (%) and drawbar pull (% of the load).
    fn errors(&self) -> [f64; 2] {
        let (found, expected) = (self.driven(), self.expected());
        [
            100.0 * (found.sinkage / expected.sinkage - 1.0).abs(),
            100.0 * (found.pull - expected.pull).abs() / self.wheel[2],
        ]
    }
}

const WHEELS: [&str; 3] = ["Ishigami_r092_b107_W64.7", "r150_b120_W64", "HIT_r157_b165_W80"];
const SLIPS: [f64; 7] = [0.0, 0.1, 0.2, 0.3, 0.4, 0.6, 0.8];

/// All figures.
pub fn figures(context: &Context) -> Outcome<Vec<Figure>> {
    let mut all = Vec::new();
    let [_, (name, make)] = MODULES;
    for (part, peak, of) in [
        ("integral", [0.0, 0.0], "the integral of the stresses with a0 = a1 = 0 and elastic exit"),
        ("shifted", SHIFTED, "the integral with a0 = 0.4, a1 = 0.15 (wongreece_wheel.csv)"),
    ] {
        let cases = cases(context, make, peak)?;
        let errors = in_parallel(&cases, Case::errors);
        let worst = |k: usize| {
            errors.iter().map(|e| e[k]).fold(0.0, |m: f64, e| if e.is_nan() { e } else { m.max(e) })
        };
        let what = |quantity: &str| {
            format!("largest error of the {quantity}, against {of}, {} wheels, soils and slips", cases.len())
        };
        let figure = |id: &str, value, what| {
            Figure::new(format!("soil.{name}.wheel.{part}.{id}"), value, Limit::AtMost(5.0), what)
        };
        all.push(figure("sinkage", worst(0), what("sinkage, %")));
        all.push(figure("pull", worst(1), what("drawbar pull, % of the load")));
    }
    all.extend(real_wheel::figures(context, name, make)?);
    Ok(all)
}

/// The lines of the reference table; quickly two of them.
fn cases(context: &Context, make: Maker, peak: [f64; 2]) -> Outcome<Vec<Case>> {
    let rows = eight()?;
    let mut cases = Vec::new();
    for wheel in WHEELS {
        for soil in &rows[..4] {
            for slip in SLIPS {
                let shown =
                    wheel == WHEELS[0] && (soil.name == "lunar_nominal" || soil.name == "dry_sand_LLL");
                if !context.quick || shown && (slip == 0.2 || slip == 0.6) {
                    let wheel = wheel_of(wheel).ok_or("no such wheel")?;
                    let spacing = SPACINGS[usize::from(!context.quick)];
                    cases.push(Case { make, soil: soil.clone(), wheel, slip, peak, spacing });
                }
            }
        }
    }
    Ok(cases)
}
