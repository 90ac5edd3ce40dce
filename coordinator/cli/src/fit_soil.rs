//! `terraglue fit-soil`: a soil from plate tests.

use super::arguments::FitSoilArguments;
use super::fit_files::{drawing_of, name, write};
use super::fit_wheel::wheel;
use super::output::outln;
use super::{Exit, show};
use std::path::Path;
use terraglue_diagnostics::Result;
use terraglue_scenario::InputError;
use terraglue_soil_fit::{
    Curve, Known, LawFit, Options, PlateTests, Predicted, SoilFit, fit_law, fit_module, json, known,
    law_json, law_toml, read, rests, shown, svg, toml,
};
use terraglue_soil_law::PRESSURE_LAWS;

/// A fit to fewer readings is meaningless.
const FEWEST: usize = 4;

/// Fits, writes what was asked for and prints.
pub fn fit_soil(a: &FitSoilArguments) -> Result<Exit> {
    if !(a.from_mm.is_finite() && a.from_mm >= 0.0) {
        let message =
            format!("`--from-mm` = {} is out of range: it takes a number of at least 0 mm", a.from_mm);
        let help = "leave it out, and every reading counts".to_owned();
        return Err(InputError::plain(message, Some(help)).into());
    }
    let from = 1e-3 * a.from_mm;
    let options =
        Options { cohesion_pa: a.cohesion_pa, phi_deg: a.phi_deg, shear_m: a.shear_m, density: a.density };
    let known = known(&options, a.soil.as_deref(), &a.data)?;
    options.doubts().iter().for_each(|doubt| eprintln!("warning: {doubt}"));
    if let Some(of) = a.wheel {
        return wheel(a, of, &options, known);
    }
    let tests = read_plausible(&a.data, from)?;
    let Some(built_in) = PRESSURE_LAWS.into_iter().find(|law| *law == a.law) else {
        return module(a, &tests, known);
    };
    enough(a, &tests)?;
    let fit = fit_law(built_in, &tests, known)?;
    let all: Vec<SoilFit> = PRESSURE_LAWS.iter().filter_map(|law| fit_law(law, &tests, known).ok()).collect();
    let rms = |tests: &PlateTests| fit.fit.numbers.rms(&fit.fit.law, &tests.readings);
    let unseen = predict(a, &tests, &rms)?;
    if let Some(out) = &a.out {
        let source = format!("terraglue fit-soil {} --law {}", name(&a.data), a.law);
        write(out, &toml(&fit, &source))?;
        write(&drawing_of(out), &svg(&fit.curve(), &tests, unseen.as_ref().map(|(tests, _)| tests)))?;
    }
    let predicted = unseen.map(|(_, predicted)| predicted);
    match a.json {
        true => outln!("{}", json(&fit, &all, from, predicted.as_ref())),
        false => {
            print(a, &tests, &fit, &all);
            told(a, predicted.as_ref());
        }
    }
    Ok(Exit::Done)
}

/// Refuses a fit to too few readings.
fn enough(a: &FitSoilArguments, tests: &PlateTests) -> Result {
    let (count, rows) = (tests.readings.len(), tests.rows);
    if count >= FEWEST {
        return Ok(());
    }
    let message = format!(
        "{}: {count} of {rows} readings can be used, those from {} mm of sinkage on with a pressure above 0: at least four \
         readings are needed",
        a.data.display(),
        a.from_mm
    );
    Err(InputError::plain(message, Some("give more readings, or lower --from-mm".into())).into())
}

/// How the fit does on unseen tests, and what was written.
fn told(a: &FitSoilArguments, predicted: Option<&Predicted>) {
    if let Some(predicted) = predicted {
        outln!("{predicted}");
    }
    if let Some(out) = &a.out {
        outln!("{} and {} written", out.display(), drawing_of(out).display());
    }
}

/// The same for a law that is a module.
fn module(a: &FitSoilArguments, tests: &PlateTests, known: Known) -> Result<Exit> {
    let from = 1e-3 * a.from_mm;
    let fit = fit_module(&a.law, tests, known)?;
    let unseen = predict(a, tests, &|t| fit.rms_of(t))?;
    if let Some(out) = &a.out {
        write(out, &law_toml(&fit, &format!("terraglue fit-soil {} --law {}", name(&a.data), a.law)))?;
        let curve = Curve { law: &fit.name, rms: fit.rms, pressure: Box::new(|b, z| fit.pressure(b, z)) };
        write(&drawing_of(out), &svg(&curve, tests, unseen.as_ref().map(|(tests, _)| tests)))?;
    }
    let predicted = unseen.map(|(_, predicted)| predicted);
    match a.json {
        true => outln!("{}", law_json(&fit, from, predicted.as_ref())),
        false => {
            print_law(a, tests, &fit);
            told(a, predicted.as_ref());
        }
    }
    Ok(Exit::Done)
}

fn print_law(a: &FitSoilArguments, tests: &PlateTests, fit: &LawFit) {
    let mut table = show::table(&["number", "value", "95 % confidence", "help"]);
    for n in &fit.numbers {
        let told = n.interval.map_or_else(|| "plates do not tell it".to_owned(), shown);
        table.add_row([n.name.clone(), format!("{:.4}", n.value), told, n.help.clone()]);
    }
    outln!("{table}");
    outln!("{}", rests(fit.rms, fit.basis));
    outln!("{} of {} readings, those from {} mm of sinkage on", tests.readings.len(), tests.rows, a.from_mm);
}

/// The tests of `--predict`, and how a fit to `fitted` does on them.
fn predict(
    a: &FitSoilArguments,
    fitted: &PlateTests,
    rms: &dyn Fn(&PlateTests) -> f64,
) -> Result<Option<(PlateTests, Predicted)>> {
    let Some(path) = &a.predict else { return Ok(None) };
    let tests = read_plausible(path, 1e-3 * a.from_mm)?;
    if tests.readings.is_empty() {
        let message = format!("{}: no reading is deep enough", path.display());
        return Err(InputError::plain(message, Some("lower --from-mm".into())).into());
    }
    let predicted = Predicted::of(name(path), rms(&tests), &tests, fitted);
    Ok(Some((tests, predicted)))
}

/// Reads tests and says what makes their units doubtful.
fn read_plausible(path: &Path, from: f64) -> Result<PlateTests> {
    let tests = read(path, from)?;
    if let Some(doubt) = tests.doubt() {
        eprintln!("warning: {}: {doubt}", path.display());
    }
    Ok(tests)
}

fn print(a: &FitSoilArguments, tests: &PlateTests, fit: &SoilFit, all: &[SoilFit]) {
    let mut table = show::table(&["parameter", "value", "95 % confidence", "help"]);
    for p in &fit.parameters {
        table.add_row([p.name.to_owned(), format!("{:.4}", p.value), shown(p.interval), p.help.to_owned()]);
    }
    outln!("{table}");
    outln!("{}", terraglue_soil_fit::basis(fit));
    let count = tests.readings.len();
    outln!("{count} of {} readings, those from {} mm of sinkage on", tests.rows, a.from_mm);
    let laws: Vec<String> = all.iter().map(|f| format!("{} {:.1} %", f.law, 100.0 * f.fit.rms)).collect();
    outln!("rms of the laws: {}", laws.join(", "));
}
