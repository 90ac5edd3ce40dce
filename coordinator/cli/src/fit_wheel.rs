//! `terraglue fit-soil --wheel`: a soil from a driven wheel.

use super::arguments::FitSoilArguments;
use super::fit_files::{drawing_of, name, write};
use super::output::outln;
use super::{Exit, show};
use terraglue_diagnostics::Result;
use terraglue_scenario::InputError;
use terraglue_soil_fit::{
    Known, Options, Wheel, WheelFit, WheelPoint, fit_wheel, read_wheel, shown, wheel_json, wheel_start,
    wheel_svg, wheel_toml,
};

/// Fits, writes what was asked for and prints.
pub fn wheel(a: &FitSoilArguments, wheel: Wheel, options: &Options, known: Known) -> Result<Exit> {
    if !["bearing", "bekker"].contains(&a.law.as_str()) {
        let message =
            format!("--law {}: a wheel is fitted with Bekker\'s law and Ding\'s slip sinkage", a.law);
        return Err(InputError::plain(message, Some("leave out --law".into())).into());
    }
    let start = wheel_start(options, a.soil.as_deref(), &a.data)?;
    let tests = read_wheel(&a.data, &wheel)?;
    let seen = &tests.points;
    let fit = fit_wheel(wheel, seen, known, start)?;
    let unseen = a.predict.as_deref().map(|path| read_wheel(path, &wheel)).transpose()?;
    let unseen: &[WheelPoint] = unseen.as_ref().map_or(&[], |tests| &tests.points);
    if let Some(out) = &a.out {
        let source = format!(
            "terraglue fit-soil {} --wheel radius={},width={}",
            name(&a.data),
            wheel.radius,
            wheel.width
        );
        write(out, &wheel_toml(&fit, seen, &source))?;
        write(&drawing_of(out), &wheel_svg(&fit, seen, unseen))?;
    }
    let predicted = a.predict.as_deref().map(name);
    if a.json {
        outln!("{}", wheel_json(&fit, seen, predicted.as_deref().map(|file| (file, unseen))));
        return Ok(Exit::Done);
    }
    print(&fit, seen, unseen);
    if tests.braked > 0 {
        outln!("{} rows of a braked wheel left out: slip sinkage knows driven wheels only", tests.braked);
    }
    if let Some(file) = predicted {
        let [sinkage, pull] = fit.fit.errors(unseen);
        outln!("{file}: largest errors: sinkage {:.1} %, drawbar pull {pull:.2} N", 100.0 * sinkage);
    }
    if let Some(out) = &a.out {
        outln!("{} and {} written", out.display(), drawing_of(out).display());
    }
    Ok(Exit::Done)
}

fn print(fit: &WheelFit, seen: &[WheelPoint], unseen: &[WheelPoint]) {
    let mut table = show::table(&["parameter", "value", "95 % confidence", "help"]);
    for n in &fit.fit.numbers {
        table.add_row([n.key.to_owned(), format!("{:.4}", n.value), shown(n.interval), n.help.to_owned()]);
    }
    outln!("{table}");
    let heads = ["slip", "load, N", "sinkage, mm", "fitted", "drawbar pull, N", "fitted", ""];
    let mut table = show::table(&heads);
    for (points, note) in [(seen, ""), (unseen, "not seen")] {
        for p in points {
            let state = fit.fit.state(p.slip, p.load);
            table.add_row([
                format!("{:.3}", p.slip),
                format!("{:.1}", p.load),
                format!("{:.2}", 1e3 * p.sinkage),
                format!("{:.2}", 1e3 * state.sinkage),
                format!("{:.2}", p.pull),
                format!("{:.2}", state.pull),
                note.to_owned(),
            ]);
        }
    }
    outln!("{table}");
    let [sinkage, pull] = fit.fit.errors(seen);
    let groups = fit.fit.groups;
    outln!(
        "largest errors over {groups} slips: sinkage {:.1} %, drawbar pull {pull:.2} N; intervals: each slip left out in turn",
        100.0 * sinkage
    );
}
