//! `terraglue fit-soil`: a soil from plate tests.

use super::arguments::FitSoilArguments;
use super::output::outln;
use super::{Exit, show};
use std::path::{Path, PathBuf};
use terraglue::scenario::{InputError, find_soil_table, read_soil_table};
use terraglue::soil_fit::{
    Curve, Known, LawFit, PlateTests, SoilFit, fit_law, fit_module, json, law_json, law_toml, read, rests,
    svg, toml,
};
use terraglue::{Error, Result};
use terraglue_soil_law::PRESSURE_LAWS;

/// Fits, writes what was asked for and prints.
pub fn fit_soil(a: &FitSoilArguments) -> Result<Exit> {
    let from = 1e-3 * a.from_mm;
    let tests = read(&a.data, from)?;
    let known = known(a)?;
    let Some(built_in) = PRESSURE_LAWS.into_iter().find(|law| *law == a.law) else {
        return module(a, &tests, known);
    };
    let fit = fit_law(built_in, &tests, known)?;
    let all: Vec<SoilFit> = PRESSURE_LAWS.iter().filter_map(|law| fit_law(law, &tests, known).ok()).collect();
    let rms = |tests: &PlateTests| fit.fit.numbers.rms(&fit.fit.law, &tests.readings);
    let unseen = a.predict.as_deref().map(|path| predict(path, from, &rms)).transpose()?;
    if let Some(out) = &a.out {
        let source = format!("terraglue fit-soil {} --law {}", name(&a.data), a.law);
        write(out, &toml(&fit, &source))?;
        write(&drawing_of(out), &svg(&fit.curve(), &tests, unseen.as_ref().map(|(tests, _)| tests)))?;
    }
    let predicted = unseen.as_ref().zip(a.predict.as_deref().map(name));
    if a.json {
        let predicted = predicted.as_ref().map(|((t, rms), file)| (file.as_str(), *rms, t.readings.len()));
        outln!("{}", json(&fit, &all, from, predicted));
        return Ok(Exit::Done);
    }
    print(a, &tests, &fit, &all);
    if let Some(((tests, rms), file)) = predicted {
        outln!("{file}, not seen before: rms {:.2} % over {} readings", 100.0 * rms, tests.readings.len());
    }
    if let Some(out) = &a.out {
        outln!("{} and {} written", out.display(), drawing_of(out).display());
    }
    Ok(Exit::Done)
}

fn name(path: &Path) -> String {
    path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned())
}

/// The same for a law that is a module.
fn module(a: &FitSoilArguments, tests: &PlateTests, known: Known) -> Result<Exit> {
    let from = 1e-3 * a.from_mm;
    let fit = fit_module(&a.law, tests, known)?;
    let unseen = a.predict.as_deref().map(|path| predict(path, from, &|t| fit.rms_of(t))).transpose()?;
    if let Some(out) = &a.out {
        write(out, &law_toml(&fit, &format!("terraglue fit-soil {} --law {}", name(&a.data), a.law)))?;
        let curve = Curve { law: &fit.name, rms: fit.rms, pressure: Box::new(|b, z| fit.pressure(b, z)) };
        write(&drawing_of(out), &svg(&curve, tests, unseen.as_ref().map(|(tests, _)| tests)))?;
    }
    let predicted = unseen.as_ref().zip(a.predict.as_deref().map(name));
    if a.json {
        let predicted = predicted.as_ref().map(|((t, rms), file)| (file.as_str(), *rms, t.readings.len()));
        outln!("{}", law_json(&fit, from, predicted));
        return Ok(Exit::Done);
    }
    print_law(a, tests, &fit);
    if let Some(((tests, rms), file)) = predicted {
        outln!("{file}, not seen before: rms {:.2} % over {} readings", 100.0 * rms, tests.readings.len());
    }
    Ok(Exit::Done)
}

fn print_law(a: &FitSoilArguments, tests: &PlateTests, fit: &LawFit) {
    let mut table = show::table(&["number", "value", "95 % confidence", "help"]);
    for n in &fit.numbers {
        let told = n
            .interval
            .map_or_else(|| "plates do not tell it".to_owned(), |i| format!("{:.4} … {:.4}", i.low, i.high));
        table.add_row([n.name.clone(), format!("{:.4}", n.value), told, n.help.clone()]);
    }
    outln!("{table}");
    outln!("{}", rests(fit.rms, fit.basis));
    outln!("{} of {} readings, those from {} mm of sinkage on", tests.readings.len(), tests.rows, a.from_mm);
}

/// What was given beside the tests: the row of the table, and single numbers over it.
fn known(a: &FitSoilArguments) -> Result<Known> {
    let mut known = Known::default();
    if let Some(name) = &a.soil {
        let path = find_soil_table(Path::new("."))
            .ok_or_else(|| InputError::plain("no soil table: models/soils.csv is not there", None))?;
        let table = read_soil_table(&path).map_err(|message| InputError::plain(message, None))?;
        let row = table.row(name).map_err(|e| InputError::plain(e.to_string(), None))?;
        known = Known {
            c_pa: row.value("c_pa"),
            phi_rad: row.value("phi_rad"),
            shear_m: row.value("K_m"),
            density: row.value("density_kg_m3"),
        };
    }
    Ok(Known {
        c_pa: a.cohesion_pa.or(known.c_pa),
        phi_rad: a.phi_deg.map(f64::to_radians).or(known.phi_rad),
        shear_m: a.shear_m.or(known.shear_m),
        density: a.density.or(known.density),
    })
}

fn predict(path: &Path, from: f64, rms: &dyn Fn(&PlateTests) -> f64) -> Result<(PlateTests, f64)> {
    let tests = read(path, from)?;
    if tests.readings.is_empty() {
        let message = format!("{}: no reading is deep enough", path.display());
        return Err(InputError::plain(message, Some("lower --from-mm".into())).into());
    }
    let rms = rms(&tests);
    Ok((tests, rms))
}

fn drawing_of(out: &Path) -> PathBuf {
    out.with_extension("svg")
}

fn write(path: &Path, text: &str) -> Result {
    std::fs::write(path, text).map_err(|source| Error::File { path: path.display().to_string(), source })
}

fn print(a: &FitSoilArguments, tests: &PlateTests, fit: &SoilFit, all: &[SoilFit]) {
    let mut table = show::table(&["parameter", "value", "95 % confidence", "help"]);
    for p in &fit.parameters {
        let interval = format!("{:.4} … {:.4}", p.interval.low, p.interval.high);
        table.add_row([p.name.to_owned(), format!("{:.4}", p.value), interval, p.help.to_owned()]);
    }
    outln!("{table}");
    outln!("{}", terraglue::soil_fit::basis(fit));
    let count = tests.readings.len();
    outln!("{count} of {} readings, those from {} mm of sinkage on", tests.rows, a.from_mm);
    let laws: Vec<String> = all.iter().map(|f| format!("{} {:.1} %", f.law, 100.0 * f.fit.rms)).collect();
    outln!("rms of the laws: {}", laws.join(", "));
}
