//! Plate tests from comma-separated text.

use super::columns::{Columns, Names, SINKAGE, Wrong, unreadable};
use std::path::Path;
use terraglue_scenario::InputError;
use terraglue_scenario::plausible::doubt;
use terraglue_soil_identification::Reading;
use terraglue_subsystem::Usual;

/// The readings of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct PlateTests {
    /// Those that can be used.
    pub readings: Vec<Reading>,
    /// Rows of the file.
    pub rows: usize,
    /// Rows left out because the plate was not seated yet.
    pub shallow: usize,
    /// Names of the columns of sinkage and pressure.
    pub columns: [String; 2],
}

impl PlateTests {
    /// Doubt about the unit of a column; None: there is none.
    pub fn doubt(&self) -> Option<String> {
        let largest = |of: fn(&Reading) -> f64| self.readings.iter().map(of).fold(0.0, f64::max);
        let [sinkages, pressures] = &self.columns;
        let of = |column: &str| format!("the largest of the column `{column}`");
        let (sinkage, pressure) = (Usual::new("m", 1e-3, 1.0), Usual::new("Pa", 100.0, 1e8));
        let depth = doubt(&sinkage, &of(sinkages), largest(|r| r.depth));
        depth.or_else(|| doubt(&pressure, &of(pressures), largest(|r| r.pressure)))
    }
}

const PRESSURE: Names = &[("pressure_Pa", 1.0), ("pressure_kPa", 1e3), ("pressure_MPa", 1e6)];
/// Size b: radius of a disc or short side of a rectangle.
const SIZE: Names = &[
    ("b_m", 1.0),
    ("b_cm", 1e-2),
    ("b_mm", 1e-3),
    ("plate_diam_m", 0.5),
    ("plate_diam_cm", 0.5e-2),
    ("plate_diam_mm", 0.5e-3),
    ("plate_radius_m", 1.0),
    ("plate_radius_mm", 1e-3),
    ("plate_width_m", 1.0),
    ("plate_width_mm", 1e-3),
];
/// Quantities measured along a curve: equal cells in all other columns make one curve.
const MEASURED: [&str; 4] = ["sinkage_", "pressure_", "force_", "time_"];

/// Reads a file; rows whose sinkage is below `from` (m) are left out.
///
/// # Errors
/// A malformed file, with the line.
pub fn read(path: &Path, from: f64) -> Result<PlateTests, Box<InputError>> {
    let text = terraglue_subsystem::files::read_text(path).map_err(|e| unreadable(path, &e))?;
    parse(&text, from)
        .map_err(|(message, help)| InputError::plain(format!("{}: {message}", path.display()), help))
}

fn parse(text: &str, from: f64) -> Result<PlateTests, Wrong> {
    let table = Columns::parse(text)?;
    let header = &table.header;
    let columns = [table.find(SINKAGE)?, table.find(PRESSURE)?, table.find(SIZE)?];
    let labels: Vec<usize> =
        (0..header.len()).filter(|k| !MEASURED.iter().any(|m| header[*k].starts_with(m))).collect();
    let names = [columns[0].0, columns[1].0].map(|place| header[place].to_owned());
    let mut tests = PlateTests { readings: Vec::new(), rows: 0, shallow: 0, columns: names };
    let mut curves: Vec<Vec<&str>> = Vec::new();
    for row in &table.rows {
        tests.rows += 1;
        let number = |column| table.number(row, column);
        let [depth, pressure, b] = [number(columns[0])?, number(columns[1])?, number(columns[2])?];
        if b <= 0.0 {
            let help = "the column holds diameter or width of each plate, in the unit of its name".to_owned();
            return Err((
                format!("line {}: the size of the plate must be larger than zero", row.0),
                Some(help),
            ));
        }
        // a reading in the middle of a bin of a millimetre is printed with rounding
        if depth < from * (1.0 - 1e-9) || depth <= 0.0 || pressure <= 0.0 {
            tests.shallow += 1;
            continue;
        }
        let label: Vec<&str> = labels.iter().map(|k| row.1[*k]).collect();
        let curve = curves.iter().position(|c| *c == label).unwrap_or_else(|| {
            curves.push(label);
            curves.len() - 1
        });
        tests.readings.push(Reading { curve, b, depth, pressure });
    }
    Ok(tests)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn units_curves_and_seating() {
        let text = "trial,plate_diam_mm,sinkage_mm,pressure_kPa,force_N\n1,60,1,0.5,1\n1,60,3,2,5\n2,60,3,2.5,6\n2,60,4,3,7\n";
        let tests = parse(text, 3e-3).unwrap();
        assert_eq!((tests.rows, tests.shallow, tests.readings.len()), (4, 1, 3));
        let r = tests.readings[1];
        assert!((r.b - 0.03).abs() < 1e-12 && (r.depth - 3e-3).abs() < 1e-12 && r.pressure == 2500.0);
        assert_eq!(tests.readings.iter().map(|r| r.curve).collect::<Vec<_>>(), [0, 1, 1]);
    }

    #[test]
    fn units_that_cannot_be_are_doubted() {
        let doubt = |text: &str| parse(text, 0.0).unwrap().doubt();
        assert_eq!(doubt("sinkage_mm,b_m,pressure_kPa\n20,0.05,30\n"), None);
        let deep = doubt("sinkage_m,b_m,pressure_kPa\n20,0.05,30\n").unwrap();
        assert!(
            deep.contains("`sinkage_m` = 20 m is 20 times above")
                && deep.contains("given in cm (0.2 m) or mm (0.02 m)?"),
            "{deep}"
        );
        let light = doubt("sinkage_mm,b_m,pressure_Pa\n20,0.05,30\n").unwrap();
        assert!(
            light.contains("`pressure_Pa` = 30 Pa is 3.33 times below")
                && light.contains("given in kPa (30000 Pa)"),
            "{light}"
        );
        assert!(doubt("sinkage_mm,b_m,pressure_MPa\n20,0.05,300\n").is_some());
    }

    #[test]
    fn wrong_files_name_line_and_column() {
        let wrong = |text: &str| parse(text, 0.0).unwrap_err();
        assert!(wrong("").0.contains("empty"));
        let (message, help) = wrong("a,b_m,pressure_Pa\n");
        assert!(message.contains("sinkage_mm") && help.unwrap().contains("a, b_m"));
        assert!(wrong("sinkage_m,b_m,pressure_Pa\n1,2,x\n").0.contains("line 2: `x` in `pressure_Pa`"));
        let (message, help) = wrong("sinkage_m,b_m,pressure_Pa\n1,2\n");
        assert!(message.contains("2 cells instead of 3") && help.unwrap().contains("with a point"));
        let help = |text: &str| wrong(text).1.unwrap();
        assert!(help("sinkage_m;b_m;pressure_Pa\n1;2;3\n").contains("semicolons between the cells"));
        assert!(help("sinkage_m\tb_m\tpressure_Pa\n").contains("tabulators between the cells"));
        assert!(wrong("sinkage_m,b_m,pressure_Pa\n1,0,4\n").0.contains("larger than zero"));
    }
}
