//! A wheel's measurements from a file, and the soil fitted to them with names of a scenario.

use super::Known;
use super::columns::{Columns, Names, SINKAGE, unreadable};
use std::path::Path;
use terraglue_scenario::InputError;
use terraglue_soil_identification::{
    self as identification, SoilBounds, Wheel, WheelError, WheelPoint, WheelStart,
};

/// Reads `radius=0.058,width=0.05,load=25`, in m and N; the load may be left out.
///
/// # Errors
/// A malformed text, with the right form.
pub fn parse_wheel(text: &str) -> Result<Wheel, String> {
    let form = "write radius=M,width=M or radius=M,width=M,load=N";
    let mut found = [None; 3];
    for part in text.split(',') {
        let (name, value) =
            part.split_once('=').ok_or_else(|| format!("`{part}` is no NAME=VALUE; {form}"))?;
        let place = ["radius", "width", "load"].iter().position(|n| *n == name.trim());
        let place = place.ok_or_else(|| format!("a wheel has no `{}`; {form}", name.trim()))?;
        let number = value.trim().parse::<f64>().ok().filter(|x| x.is_finite() && *x > 0.0);
        found[place] = Some(
            number.ok_or_else(|| format!("`{}` = `{value}` is no number above 0; {form}", name.trim()))?,
        );
    }
    match found {
        [Some(radius), Some(width), load] => Ok(Wheel { radius, width, load }),
        _ => Err(format!("radius and width of the wheel are needed; {form}")),
    }
}

/// The measurements of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct WheelTests {
    /// In the order of the file.
    pub points: Vec<WheelPoint>,
    /// Rows left out because the wheel is braked: slip sinkage is defined for driven wheels only.
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
/// A malformed file, with the line.
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

/// A soil fitted to a wheel, and what was known of it before.
#[derive(Clone, Debug, PartialEq)]
pub struct WheelFit {
    /// The fit.
    pub fit: identification::WheelFit,
    /// Known parameters.
    pub known: Known,
}

/// Fits a soil to a wheel.
///
/// # Errors
/// Fewer than two slips; a wheel that no soil carries.
pub fn fit_wheel(
    wheel: Wheel,
    points: &[WheelPoint],
    known: Known,
    start: WheelStart,
) -> Result<WheelFit, Box<InputError>> {
    let bounds = SoilBounds { c_pa: known.c_pa, phi_rad: known.phi_rad };
    let fit = identification::fit_wheel(wheel, points, bounds, start).map_err(|error| {
        let help = match error {
            WheelError::TooFew(_) => "give a row for each slip at which the wheel was driven",
            _ => "check radius, width and load of --wheel, and the units of the columns",
        };
        InputError::plain(error.to_string(), Some(help.into()))
    })?;
    Ok(WheelFit { fit, known })
}

impl WheelFit {
    /// Parameters of the soil that the wheel does not identify: keys of a scenario with values and descriptions.
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
        assert_eq!(parse_wheel("radius=0.058, width=0.05"), Ok(WHEEL));
        assert_eq!(
            parse_wheel("width=1,radius=2,load=3"),
            Ok(Wheel { radius: 2.0, width: 1.0, load: Some(3.0) })
        );
        let wrong = |text: &str| parse_wheel(text).expect_err("refused");
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
}
