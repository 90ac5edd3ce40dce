//! Known parameters of the soil from the command line: options, each within the range of its scenario key, over a row of
//! the soil table.

use super::{Known, WheelStart};
use serde_json::Value;
use std::path::Path;
use terraglue_scenario::plausible::doubt;
use terraglue_scenario::{InputError, SoilRow, TableError, check_value, find_soil_table, read_soil_table};
use terraglue_soil_law::SoilParameters;
use terraglue_subsystem::{Parameter, Usual};

/// Numbers given as options; None: not given.
#[derive(Clone, Copy, Debug, Default)]
pub struct Options {
    /// `--cohesion-pa`, Pa.
    pub cohesion_pa: Option<f64>,
    /// `--phi-deg`, degrees.
    pub phi_deg: Option<f64>,
    /// `--shear-m`, m.
    pub shear_m: Option<f64>,
    /// `--density`, kg/m³.
    pub density: Option<f64>,
}

impl Options {
    /// Option, key of a scenario, value.
    fn all(&self) -> [(&'static str, &'static str, Option<f64>); 4] {
        [
            ("--cohesion-pa", "c_pa", self.cohesion_pa),
            ("--phi-deg", "phi_rad", self.phi_deg),
            ("--shear-m", "K_m", self.shear_m),
            ("--density", "density_kg_m3", self.density),
        ]
    }

    /// Doubts about the values, as of the keys of a scenario.
    pub fn doubts(&self) -> Vec<String> {
        let schema = SoilParameters::schema();
        let of = |(option, key, value): (&str, &str, Option<f64>)| {
            let usual = match key {
                "phi_rad" => Some(Usual::new("degrees", 3.0, 60.0)),
                _ => schema.iter().find(|p| p.name == key)?.usual.clone(),
            };
            doubt(&usual?, &format!("`{option}`"), value?)
        };
        self.all().into_iter().filter_map(of).collect()
    }

    fn check(&self) -> Result<(), Box<InputError>> {
        let schema = SoilParameters::schema();
        for (option, key, value) in self.all() {
            let (Some(value), Some(of_key)) = (value, schema.iter().find(|p| p.name == key)) else {
                continue;
            };
            let mut parameter = Parameter { name: option.into(), ..of_key.clone() };
            if key == "phi_rad" {
                let degrees = |x: f64| (1e4 * x.to_degrees()).round() / 1e4;
                (parameter.min, parameter.max) = (parameter.min.map(degrees), parameter.max.map(degrees));
                parameter.unit = "degrees".into();
            }
            check_value(&parameter, None, &Value::from(value))
                .map_err(|c| InputError::plain(c.message, c.help))?;
        }
        Ok(())
    }
}

/// The options over the row `soil` of the table, which is sought as for a scenario beside the file `data`.
///
/// # Errors
/// An option out of the range of its key; a row that is not there, or that scenarios refuse, too.
pub fn known(options: &Options, soil: Option<&str>, data: &Path) -> Result<Known, Box<InputError>> {
    options.check()?;
    let row = match soil {
        Some(name) => of_row(options, name, data)?,
        None => Known::default(),
    };
    Ok(Known {
        c_pa: options.cohesion_pa.or(row.c_pa),
        phi_rad: options.phi_deg.map(f64::to_radians).or(row.phi_rad),
        shear_m: options.shear_m.or(row.shear_m),
        density: options.density.or(row.density),
    })
}

/// The row of the table beside the file `data` in which the fit of a wheel begins; loose soil where none is named.
///
/// # Errors
/// A row that is not there, or that scenarios refuse, too.
pub fn wheel_start(
    options: &Options,
    soil: Option<&str>,
    data: &Path,
) -> Result<WheelStart, Box<InputError>> {
    let Some(name) = soil else { return Ok(WheelStart::default()) };
    let row = find_row(options, name, data)?;
    let start = WheelStart::default();
    Ok(WheelStart { n: row.value("n").unwrap_or(start.n), k_phi: row.value("k_phi").unwrap_or(start.k_phi) })
}

fn of_row(options: &Options, name: &str, data: &Path) -> Result<Known, Box<InputError>> {
    let row = find_row(options, name, data)?;
    Ok(Known {
        c_pa: row.value("c_pa"),
        phi_rad: row.value("phi_rad"),
        shear_m: row.value("K_m"),
        density: row.value("density_kg_m3"),
    })
}

fn find_row(options: &Options, name: &str, data: &Path) -> Result<SoilRow, Box<InputError>> {
    let plain = |message: String, help: Option<String>| InputError::plain(message, help);
    let beside = data.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let path = find_soil_table(beside).or_else(|| find_soil_table(Path::new("."))).ok_or_else(|| {
        let message = format!(
            "--soil {name}: no soil table: models/soils.csv and ../models/soils.csv are neither in {} nor here nor in the \
             installation",
            beside.display()
        );
        let help = "give --cohesion-pa and --density themselves, or run it in the folder that holds models/soils.csv";
        plain(message, Some(help.into()))
    })?;
    let table = read_soil_table(&path).map_err(|message| plain(message, None))?;
    let given: Vec<&str> = options.all().iter().filter(|o| o.2.is_some()).map(|o| o.1).collect();
    let row = table.row(name).and_then(|row| row.offered(&given).map(|_| row)).map_err(|e| {
        let help = matches!(e, TableError::Refused { .. }).then(|| {
            "`terraglue soils` lists the rows that can be used; options give c_pa, phi_rad and K_m themselves".into()
        });
        plain(format!("--soil {name}: {e}"), help)
    })?;
    Ok(row.clone())
}

#[cfg(test)]
mod tests {
    use super::*;

    const DATA: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios/plates.csv");

    fn refused(options: Options, soil: Option<&str>) -> String {
        let error = known(&options, soil, Path::new(DATA)).expect_err("refused");
        format!("{} {}", error.message, error.help.clone().unwrap_or_default())
    }

    #[test]
    fn options_keep_to_the_ranges_of_the_keys() {
        let none = Options::default();
        for (options, said) in [
            (Options { density: Some(f64::NAN), ..none }, "`--density` takes a number greater than 0 kg/m^3"),
            (
                Options { density: Some(-3.0), ..none },
                "`--density` = -3.0 is out of range: it takes a number greater",
            ),
            (Options { cohesion_pa: Some(-1000.0), ..none }, "`--cohesion-pa` = -1000.0 is out of range"),
            (
                Options { phi_deg: Some(95.0), ..none },
                "`--phi-deg` = 95.0 is out of range: it takes a number from 0.573",
            ),
            (Options { shear_m: Some(-1.0), ..none }, "`--shear-m` = -1.0 is out of range"),
        ] {
            let found = refused(options, None);
            assert!(found.contains(said), "{found}");
        }
        let good = Options {
            cohesion_pa: Some(0.0),
            phi_deg: Some(30.0),
            shear_m: Some(0.01),
            density: Some(1500.0),
        };
        assert!(
            (known(&good, None, Path::new(DATA)).expect("good").phi_rad.unwrap_or(0.0)
                - 30.0_f64.to_radians())
            .abs()
                < 1e-4
        );
    }

    #[test]
    fn options_in_other_units_are_doubted() {
        let slips =
            Options { cohesion_pa: Some(1.04), phi_deg: Some(0.61), shear_m: Some(1.8), density: Some(1.6) };
        let doubts = slips.doubts();
        for (doubt, said) in doubts.iter().zip([
            "in kPa (1040 Pa)",
            "in rad (35 degrees)?",
            "in cm (0.018 m)?",
            "in t/m³ or g/cm³ (1600 kg/m^3)?",
        ]) {
            assert!(doubt.contains(said), "{doubt}");
        }
        assert_eq!(doubts.len(), 4);
        assert!(Options { density: Some(1500.0), ..Options::default() }.doubts().is_empty());
    }

    #[test]
    fn rows_that_scenarios_refuse_are_refused() {
        for (row, said) in [
            ("Toyoura_sand_Ishigami", "k_phi has ambiguous units"),
            ("GRC-1_GRC-3_JSC-1A", "three soils in one row"),
            ("dry_sand_LLL", "K_m is a range"),
            ("cheese", "no soil is called `cheese`"),
        ] {
            let found = refused(Options::default(), Some(row));
            assert!(found.contains(said), "{found}");
        }
        let shear = Options { shear_m: Some(0.01), ..Options::default() };
        assert_eq!(known(&shear, Some("dry_sand_LLL"), Path::new(DATA)).expect("given").shear_m, Some(0.01));
    }
}
