//! Wheels: the soils against the integral of Wong and Reece over the same stresses, and against its shifted peak.

use super::plates::Maker;
use super::rows::{STIFF, SoilRow, eight};
use super::wheel_rig::{Bench, Reading};
use super::wong_reece::{wheel_of, wheel_on};
use super::{MODULES, STILL, real_wheel};
use crate::parallel::in_parallel;
use crate::process::Outcome;
use crate::{Context, Figure, Limit};
use std::fmt;
use terraglue::soil_fit::{Rim, Rolling};

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
struct WheelCase {
    name: &'static str,
    make: Maker,
    soil: SoilRow,
    wheel: [f64; 3],
    slip: f64,
    peak: [f64; 2],
    spacing: f64,
    /// Whether all that is pressed becomes denser in place and nothing slides; the automaton moves material otherwise.
    still: bool,
}

impl fmt::Display for WheelCase {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, {}, slip {}", self.name, self.soil.name, self.slip)
    }
}

impl WheelCase {
    fn expected(&self) -> Rolling {
        let [radius, width, load] = self.wheel;
        let wheel = wheel_on(&self.soil, [radius, width], self.peak);
        Rim { unloading: STIFF, ..wheel }.under(load, self.slip)
    }

    fn driven(&self) -> Reading {
        let [radius, width, load] = self.wheel;
        let [a0, a1] = self.peak;
        let still = if self.still { format!(",{STILL}") } else { String::new() };
        let config =
            self.soil.of_size(width).with(&format!(r#""wheel_peak_a0":{a0},"wheel_peak_a1":{a1}{still}"#));
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
///
/// The integral knows no material that moves: it is compared with soil that becomes denser where it is pressed, and walls
/// of ruts that stand. The effect of heaps and slides on the automaton is reported separately.
pub fn figures(context: &Context) -> Outcome<Vec<Figure>> {
    let mut all = Vec::new();
    let depth = "the integral of the stresses with a0 = a1 = 0 and elastic exit";
    // soil that becomes denser in place is pressed by the same code in both soils
    let [(name, make), _] = MODULES;
    all.extend(errors(&format!("{name}.wheel.integral"), depth, &cases(context, make, [0.0; 2], true)?));
    let of = "the integral with a0 = 0.4, a1 = 0.15 (wongreece_wheel.csv)";
    all.extend(errors(&format!("{name}.wheel.shifted"), of, &cases(context, make, SHIFTED, true)?));
    all.extend(real_wheel::figures(context, name, make)?);
    let moving = cases(context, make, [0.0; 2], false)?;
    all.extend(errors(&format!("{name}.wheel.moving"), &format!("{depth}; material moves"), &moving));
    Ok(all)
}

/// The largest errors of sinkage and drawbar pull, and where they are.
fn errors(id: &str, of: &str, cases: &[WheelCase]) -> [Figure; 2] {
    let errors = in_parallel(cases, WheelCase::errors);
    let figure = |k: usize, quantity: &str, unit: &str| {
        // a NaN is larger than any number here
        let worst = errors.iter().zip(cases).max_by(|(a, _), (b, _)| a[k].total_cmp(&b[k]));
        let (error, at) = worst.map_or((f64::NAN, String::new()), |(e, case)| (e[k], case.to_string()));
        let what = format!(
            "largest error of the {unit}, against {of}, {} wheels, soils and slips; {at}",
            cases.len()
        );
        Figure::new(format!("soil.{id}.{quantity}"), error, Limit::AtMost(5.0), what)
    };
    [figure(0, "sinkage", "sinkage, %"), figure(1, "pull", "drawbar pull, % of the load")]
}

/// The lines of the reference table; quickly two of them.
fn cases(context: &Context, make: Maker, peak: [f64; 2], still: bool) -> Outcome<Vec<WheelCase>> {
    let rows = eight()?;
    let mut cases = Vec::new();
    for wheel in WHEELS {
        for soil in &rows[..4] {
            for slip in SLIPS {
                let shown =
                    wheel == WHEELS[0] && (soil.name == "lunar_nominal" || soil.name == "dry_sand_LLL");
                if !context.quick || shown && (slip == 0.2 || slip == 0.6) {
                    let spacing = SPACINGS[usize::from(!context.quick)];
                    let (name, wheel) = (wheel, wheel_of(wheel).ok_or("no such wheel")?);
                    cases.push(WheelCase {
                        name,
                        make,
                        soil: soil.clone(),
                        wheel,
                        slip,
                        peak,
                        spacing,
                        still,
                    });
                }
            }
        }
    }
    Ok(cases)
}
