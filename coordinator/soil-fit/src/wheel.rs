//! A soil from a wheel: sinkage and drawbar pull of a driven wheel over its slip, fitted by the integral of the stresses below
//! the rim with Bekker's pressure, Ding's slip sinkage and the shear between rim and soil.
//!
//! A few slips say little of six numbers, so each is held to where the search starts (a row of the soil table) as loosely as
//! such numbers are known (Tikhonov's regularisation), and the intervals say what the measured slips add.

use super::Known;
use super::columns::{Columns, Names, SINKAGE, unreadable};
use super::rim::{Rim, Rolling};
use std::path::Path;
use terraglue_scenario::InputError;
use terraglue_soil_law::PressureLaw;
use terraglue_soil_law::fit::{Free, Interval, least_squares, spread};

/// A wheel on a test bench.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wheel {
    /// Radius, m.
    pub radius: f64,
    /// Width, m.
    pub width: f64,
    /// Vertical load where the measurements do not tell it, N.
    pub load: Option<f64>,
}

impl std::str::FromStr for Wheel {
    type Err = String;

    /// `radius=0.058,width=0.05,load=25`, in m and N; the load may be left out.
    fn from_str(text: &str) -> Result<Self, String> {
        let form = "write radius=M,width=M or radius=M,width=M,load=N";
        let mut found = [None; 3];
        for part in text.split(',') {
            let (name, value) =
                part.split_once('=').ok_or_else(|| format!("`{part}` is no NAME=VALUE; {form}"))?;
            let place = ["radius", "width", "load"].iter().position(|n| *n == name.trim());
            let place = place.ok_or_else(|| format!("a wheel has no `{}`; {form}", name.trim()))?;
            let number = value.trim().parse::<f64>().ok().filter(|x| x.is_finite() && *x > 0.0);
            found[place] = Some(
                number
                    .ok_or_else(|| format!("`{}` = `{value}` is no number above 0; {form}", name.trim()))?,
            );
        }
        match found {
            [Some(radius), Some(width), load] => Ok(Self { radius, width, load }),
            _ => Err(format!("radius and width of the wheel are needed; {form}")),
        }
    }
}

/// What was measured at a slip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WheelPoint {
    /// Slip 1 − v/(rω), from 0 to below 1.
    pub slip: f64,
    /// Vertical load, N.
    pub load: f64,
    /// Sinkage, m.
    pub sinkage: f64,
    /// Drawbar pull, N.
    pub pull: f64,
}

/// The measurements of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct WheelTests {
    /// In the order of the file.
    pub points: Vec<WheelPoint>,
    /// Rows left out because the wheel is braked: slip sinkage knows driven wheels only.
    pub braked: usize,
}

const SLIP: Names = &[("slip", 1.0), ("slip_percent", 1e-2)];
const PULL: Names = &[("DP_N", 1.0), ("pull_N", 1.0), ("drawbar_pull_N", 1.0)];
const LOAD: Names = &[("Fz_N", 1.0), ("load_N", 1.0)];
/// A wheel that rolls freely is measured a little below 0.
const ROLLS: f64 = -0.01;

/// Reads measurements of a wheel.
///
/// # Errors
/// What is wrong, with file and line.
pub fn read_wheel(path: &Path, wheel: &Wheel) -> Result<WheelTests, Box<InputError>> {
    let text = terraglue_subsystem::files::read_text(path).map_err(|e| unreadable(path, &e))?;
    parse(&text, wheel)
        .map_err(|(message, help)| InputError::plain(format!("{}: {message}", path.display()), help))
}

fn parse(text: &str, wheel: &Wheel) -> Result<WheelTests, super::columns::Wrong> {
    let columns = Columns::parse(text)?;
    let [slip, sinkage, pull] = [columns.find(SLIP)?, columns.find(SINKAGE)?, columns.find(PULL)?];
    let load = match (wheel.load, columns.seek(LOAD)) {
        (Some(load), _) => Err(load),
        (None, Some(column)) => Ok(column),
        (None, None) => {
            let help = Some("give it as `--wheel radius=…,width=…,load=N`".into());
            return Err(("no column is called Fz_N or load_N".into(), help));
        }
    };
    let mut tests = WheelTests { points: Vec::new(), braked: 0 };
    for row in &columns.rows {
        let load = load.map_or_else(Ok, |column| columns.number(row, column))?;
        let [slip, sinkage, pull] =
            [columns.number(row, slip)?, columns.number(row, sinkage)?, columns.number(row, pull)?];
        if slip < ROLLS {
            tests.braked += 1;
            continue;
        }
        let line = row.0;
        if slip >= 1.0 {
            let help = Some("a slip in percent stands in a column `slip_percent`".into());
            return Err((format!("line {line}: slip {slip} is not below 1"), help));
        }
        if !(sinkage > 0.0 && sinkage < wheel.radius && load > 0.0) {
            let message = format!(
                "line {line}: a sinkage of {sinkage} m under {load} N is not that of a wheel of {} m radius",
                wheel.radius
            );
            return Err((
                message,
                Some("sinkage and load are above 0, and the axle stays above the ground".into()),
            ));
        }
        tests.points.push(WheelPoint { slip, load, sinkage, pull });
    }
    Ok(tests)
}

/// Points of the integrals.
const POINTS: usize = 100;
/// How far measured means are trusted: sinkage 5 %, drawbar pull 2.8 % of the load.
const SCATTER: [f64; 2] = [0.05, 0.028];
/// ln k_φ, n_0, n_1 of Ding's slip sinkage, shear strength between rim and soil without pressure (Pa), tan of their angle of
/// friction, ln K.
type Numbers = [f64; 6];
/// How far the answer is held to the start.
const PRIOR: Numbers = [3.0, 0.5, 0.6, 800.0, 0.3, 1.0];

/// Keys of a scenario, and what they are.
const KEYS: [(&str, &str); 6] = [
    ("k_phi", "frictional modulus, N/m^(n+2); k_c = 0, one width does not tell it"),
    ("n", "exponent of a wheel without slip"),
    ("slip_sinkage_n1", "growth of the exponent with the slip"),
    ("interface_c_pa", "shear strength between rim and soil without pressure, Pa"),
    ("interface_phi_rad", "angle of friction between rim and soil, rad"),
    ("K_m", "shear deformation modulus, m"),
];

/// A number that was found.
#[derive(Clone, Debug, PartialEq)]
pub struct WheelNumber {
    /// Key of a scenario.
    pub key: &'static str,
    /// Value.
    pub value: f64,
    /// 95 % confidence; NaN: unknown.
    pub interval: Interval,
    /// What it is.
    pub help: &'static str,
}

/// A soil fitted to a wheel.
#[derive(Clone, Debug, PartialEq)]
pub struct WheelFit {
    /// The wheel.
    pub wheel: Wheel,
    /// The numbers.
    pub numbers: Vec<WheelNumber>,
    /// Slips that were left out in turn for the intervals.
    pub groups: usize,
    /// What was known before.
    pub known: Known,
    at: Numbers,
}

/// Where the search begins, beside what is known of the soil: exponent and modulus k_φ of its row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WheelStart {
    /// Exponent.
    pub n: f64,
    /// k_φ, N/m^(n+2).
    pub k_phi: f64,
}

impl Default for WheelStart {
    /// Loose soil.
    fn default() -> Self {
        Self { n: 1.0, k_phi: 820e3 }
    }
}

/// Fits a soil to a wheel.
///
/// # Errors
/// Fewer than two slips.
pub fn fit_wheel(
    wheel: Wheel,
    points: &[WheelPoint],
    known: Known,
    start: WheelStart,
) -> Result<WheelFit, Box<InputError>> {
    if points.len() < 2 {
        let message = format!("{} slips of a driven wheel are too few: two at least", points.len());
        let help = "give a row for each slip at which the wheel was driven".to_owned();
        return Err(InputError::plain(message, Some(help)));
    }
    let begin: Numbers = [start.k_phi.ln(), start.n, 0.3, 200.0, 0.4, 0.01f64.ln()];
    let low: Numbers = [8.0, 0.1, 0.0, 0.0, 0.05, -6.9];
    let most = [known.c_pa.unwrap_or(1000.0).max(1.0), known.phi_rad.unwrap_or(0.7).tan().max(0.1)];
    let high: Numbers = [20.0, 2.0, 1.5, most[0], most[1], -2.3];
    let free: Vec<Free> = (0..6).map(|k| Free { start: begin[k], min: low[k], max: high[k] }).collect();
    let solve = |points: &[WheelPoint], from: &[f64]| {
        let mut residuals = |x: &[f64]| Some(residuals(&wheel, &begin, x, points));
        least_squares(&mut residuals, &free, from).map(|least| least.numbers)
    };
    let none = || {
        let help = "check radius, width and load of --wheel, and the units of the columns".to_owned();
        InputError::plain("no soil carries this wheel", Some(help))
    };
    let found = solve(points, &begin).ok_or_else(none)?;
    let answers: Vec<Vec<f64>> = (0..points.len())
        .filter_map(|left_out| {
            let rest: Vec<WheelPoint> =
                points.iter().enumerate().filter(|(k, _)| *k != left_out).map(|(_, p)| *p).collect();
            solve(&rest, &found)
        })
        .collect();
    let at: Numbers = std::array::from_fn(|k| found[k]);
    let numbers = spread(&answers, &at).into_iter().enumerate().map(|(k, interval)| {
        let (key, help) = KEYS[k];
        let ends = [interval.low.max(low[k]), interval.high.min(high[k])].map(|x| in_scenario(k, x));
        // what is not finite stays unknown
        let known = interval.low.is_finite() && interval.high.is_finite();
        let [low, high] = if known { ends } else { [f64::NAN; 2] };
        WheelNumber { key, value: in_scenario(k, at[k]), interval: Interval { low, high }, help }
    });
    Ok(WheelFit { wheel, numbers: numbers.collect(), groups: points.len(), known, at })
}

/// Number k as a scenario takes it.
fn in_scenario(k: usize, x: f64) -> f64 {
    match k {
        0 | 5 => x.exp(),
        4 => x.atan(),
        _ => x,
    }
}

fn rim(wheel: &Wheel, x: &[f64], slip: f64) -> Rim {
    Rim {
        radius: wheel.radius,
        width: wheel.width,
        modulus: x[0].exp(),
        n: x[1] + x[2] * slip.max(0.0),
        cohesion: x[3],
        friction: x[4],
        shear: x[5].exp(),
        peak: [0.0; 2],
        unloading: PressureLaw::Bekker { k_c: 0.0, k_phi: x[0].exp(), n: x[1] }.unloading(),
        points: POINTS,
    }
}

/// Errors of the integral over their scatter, and how far the numbers are from the start.
fn residuals(wheel: &Wheel, begin: &Numbers, x: &[f64], points: &[WheelPoint]) -> Vec<f64> {
    let mut all = Vec::with_capacity(2 * points.len() + 6);
    for p in points {
        let state = rim(wheel, x, p.slip).under(p.load, p.slip);
        all.push((state.sinkage / p.sinkage).ln() / SCATTER[0]);
        all.push((state.pull - p.pull) / (SCATTER[1] * p.load));
    }
    all.extend((0..6).map(|k| (x[k] - begin[k]) / PRIOR[k]));
    all
}

impl WheelFit {
    /// The wheel under `load` (N) at a slip.
    pub fn state(&self, slip: f64, load: f64) -> Rolling {
        rim(&self.wheel, &self.at, slip).under(load, slip)
    }

    /// Largest errors over points: of the sinkage (relative) and of the pull (N).
    pub fn errors(&self, points: &[WheelPoint]) -> [f64; 2] {
        points.iter().fold([0.0; 2], |[a, b], p| {
            let state = self.state(p.slip, p.load);
            [a.max((state.sinkage / p.sinkage - 1.0).abs()), b.max((state.pull - p.pull).abs())]
        })
    }

    /// The value of a key.
    pub fn value(&self, key: &str) -> f64 {
        self.numbers.iter().find(|n| n.key == key).map_or(f64::NAN, |n| n.value)
    }

    /// What of the soil the wheel does not tell, as keys of a scenario with what they are.
    pub fn others(&self) -> [(&'static str, Option<f64>, &'static str); 3] {
        let known = &self.known;
        [
            ("c_pa", known.c_pa, "cohesion of the soil"),
            ("phi_rad", known.phi_rad, "angle of internal friction"),
            ("density_kg_m3", known.density, "density"),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WHEEL: Wheel = Wheel { radius: 0.058, width: 0.05, load: None };

    #[test]
    fn a_wheel_is_read_from_text() {
        assert_eq!("radius=0.058, width=0.05".parse(), Ok(WHEEL));
        assert_eq!("width=1,radius=2,load=3".parse(), Ok(Wheel { radius: 2.0, width: 1.0, load: Some(3.0) }));
        let wrong = |text: &str| text.parse::<Wheel>().expect_err("refused");
        assert!(wrong("radius=0.1").contains("radius and width"));
        assert!(wrong("radius=0.1,width=-1").contains("`width` = `-1`") && wrong("r=1").contains("no `r`"));
        assert!(wrong("0.058").contains("no NAME=VALUE"));
    }

    #[test]
    fn measurements_are_read_and_wrong_ones_named() {
        let text = "slip,sinkage_mm,DP_N,Fz_N\n-0.5,20,-9,25\n-0.001,14.4,-1.3,24.6\n0.5,22.7,1,25.3\n";
        let tests = parse(text, &WHEEL).expect("good");
        assert_eq!((tests.points.len(), tests.braked), (2, 1));
        assert!((tests.points[1].sinkage - 0.0227).abs() < 1e-12 && tests.points[1].load == 25.3);
        let given = Wheel { load: Some(10.0), ..WHEEL };
        assert_eq!(
            parse("slip_percent,sinkage_m,pull_N\n50,0.01,1\n", &given).expect("good").points[0].slip,
            0.5
        );
        let wrong = |text: &str| parse(text, &WHEEL).expect_err("refused");
        assert!(wrong("slip,sinkage_mm,DP_N\n0,1,1\n").1.is_some_and(|h| h.contains("load=N")));
        assert!(wrong("slip,sinkage_mm,DP_N,Fz_N\n20,1,1,1\n").0.contains("line 2: slip 20 is not below 1"));
        assert!(wrong("slip,sinkage_m,DP_N,Fz_N\n0.2,20,1,1\n").0.contains("a sinkage of 20 m"));
        assert!(wrong("slip,sinkage_m,DP_N,Fz_N\n0.2,x,1,1\n").0.contains("line 2: `x` in `sinkage_m`"));
    }

    #[test]
    fn what_a_soil_has_done_to_a_wheel_is_found_again() {
        let known = Known { c_pa: Some(1000.0), phi_rad: Some(0.5), ..Known::default() };
        let truth = [(2e6_f64).ln(), 1.2, 0.25, 300.0, 0.45, (0.012_f64).ln()];
        let slips = [0.0, 0.15, 0.3, 0.45, 0.6, 0.75, 0.9];
        let points: Vec<WheelPoint> = slips
            .iter()
            .map(|slip| {
                let state = rim(&WHEEL, &truth, *slip).under(25.0, *slip);
                WheelPoint { slip: *slip, load: 25.0, sinkage: state.sinkage, pull: state.pull }
            })
            .collect();
        let fit = fit_wheel(WHEEL, &points, known, WheelStart { n: 1.1, k_phi: 1e6 }).expect("fitted");
        let [sinkage, pull] = fit.errors(&points);
        // held to its start, the answer is not the truth, but does as the soil did
        assert!(sinkage < 0.01 && pull < 0.1, "{sinkage} {pull} {fit:?}");
        assert!((fit.value("n") - 1.2).abs() < 0.15 && fit.numbers.iter().all(|n| n.interval.low <= n.value));
        assert!(fit_wheel(WHEEL, &points[..1], known, WheelStart::default()).is_err());
    }
}
