//! Figures of sweeps: that the table does not depend on who runs the cases and what was killed, and the cost of ten thousand cases.

use crate::process::{Outcome, command, must, root, write};
use crate::{Context, Figure, Limit, Part};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// The parts, in the order of the table.
pub const PARTS: [Part; 2] = [("table", table), ("many", many)];

/// Cases of the second part.
const MANY: usize = 10_000;
/// Done cases after which a sweep is killed.
const KILLED_AFTER: usize = 3;

/// Presses of plates by one process, by two, as commands for a shell, and killed on the way.
fn table(context: &Context) -> Outcome<Vec<Figure>> {
    let place = place(context)?;
    let seeds = if context.quick { 1 } else { 8 };
    let cases = 8 * seeds;
    let text = format!(
        "seeds = {seeds}\n[sweep.vary]\n\"soil.parameters\" = [\"LETE_sand\", \"dry_sand_LLL_K010\"]\n\
                \"time.duration_s\" = {{ from = 0.55, to = 0.7, count = 4 }}\n"
    );
    let sweep = |name: &str| listed(context, &place, name, &text);
    let alone = sweep("alone")?;
    must(run(context, &alone).args(["-j", "1"]))?;
    let both = sweep("both")?;
    must(run(context, &both).args(["-j", "2"]))?;
    let shell = sweep("shell")?;
    for case in 1..=cases {
        must(run(context, &shell).args(["--case", &case.to_string()]))?;
    }
    must(command(&context.program, &["sweep", "collect"]).arg(&shell).stdout(Stdio::null()))?;
    let killed = sweep("killed")?;
    let done = kill(context, &killed, cases)?;
    let before: Vec<_> = done.iter().map(|case| changed(case)).collect();
    must(&mut run(context, &killed))?;
    let repeated = done.iter().zip(&before).filter(|(case, before)| changed(case) != **before).count();
    let different = |name: &str, folder: &Path, what: &str| -> Outcome<Figure> {
        let same =
            |file: &str| -> Outcome<bool> { Ok(bytes(&alone.join(file))? == bytes(&folder.join(file))?) };
        let mut unlike = usize::from(!same("sweep.csv")?);
        for case in 1..=cases {
            unlike += usize::from(!same(&format!("cases/{case:04}/recording.mcap"))?);
        }
        let what = format!("files of a sweep of {cases} cases that differ from those of one process: {what}");
        Ok(Figure::new(format!("sweep.{name}.different"), unlike as f64, Limit::Equal(0.0), what))
    };
    Ok(vec![
        different("two", &both, "two processes at a time")?,
        different("commands", &shell, "each case by its own command")?,
        different("killed", &killed, "killed on the way and started again")?,
        Figure::new(
            "sweep.killed.repeated",
            repeated as f64,
            Limit::Equal(0.0),
            format!("cases that run again though they were done, of {}", done.len()),
        ),
    ])
}

/// Cost of listing and collecting ten thousand cases.
fn many(context: &Context) -> Outcome<Vec<Figure>> {
    if !context.timing {
        return Ok(["list_s", "collect_s"]
            .map(|name| Figure::skipped(format!("sweep.many.{name}"), "measured with a clock only"))
            .to_vec());
    }
    let place = place(context)?;
    let text = format!(
        "method = \"sobol\"\npoints = {MANY}\n[sweep.vary]\n\"world.seed\" = {{ from = 1, to = 9000 }}\n\
         \"gluing.tolerance\" = {{ from = 1e-12, to = 1e-6, log = true }}\n"
    );
    let clock = Instant::now();
    let sweep = listed(context, &place, "many", &text)?;
    let list_s = clock.elapsed().as_secs_f64();
    let figures: Vec<String> =
        (0..60).map(|k| format!("\"energies.number_{k}\": {:?}", 0.1 * f64::from(k))).collect();
    let result = format!("{{\"status\": \"done\", \"figures\": {{{}}}}}", figures.join(", "));
    for case in 1..=MANY {
        let folder = sweep.join(format!("cases/{case:05}"));
        std::fs::create_dir_all(&folder).map_err(|e| e.to_string())?;
        write(&folder.join("case.json"), &result)?;
    }
    let clock = Instant::now();
    must(command(&context.program, &["sweep", "collect"]).arg(&sweep).stdout(Stdio::null()))?;
    let collect_s = clock.elapsed().as_secs_f64();
    let figure = |name: &str, s: f64, what: &str| {
        Figure::new(format!("sweep.many.{name}"), s, Limit::AtMost(2.0), format!("{what} {MANY} cases, s"))
            .timed()
    };
    Ok(vec![figure("list_s", list_s, "to list"), figure("collect_s", collect_s, "to collect")])
}

fn place(context: &Context) -> Outcome<PathBuf> {
    let folder = context.scratch.join("sweep");
    std::fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    Ok(folder)
}

/// The folder of a new sweep of a scenario that takes little time.
fn listed(context: &Context, place: &Path, name: &str, table: &str) -> Outcome<PathBuf> {
    let plan = place.join(format!("{name}.toml"));
    let scenario = root().join("scenarios/plate_sinkage.toml");
    write(&plan, &format!("scenario = {:?}\n[sweep]\n{table}", scenario.display().to_string()))?;
    let folder = place.join(name);
    must(command(&context.program, &["sweep"]).arg(&plan).arg("-o").arg(&folder).stdout(Stdio::null()))?;
    Ok(folder)
}

fn run(context: &Context, sweep: &Path) -> Command {
    let mut run = command(&context.program, &["sweep", "run", "--quiet"]);
    run.arg(sweep).stdout(Stdio::null());
    run
}

/// Kills a sweep after some of its cases; the results of those that were done.
fn kill(context: &Context, sweep: &Path, cases: usize) -> Outcome<Vec<PathBuf>> {
    let results = || -> Vec<PathBuf> {
        let case = |k| sweep.join(format!("cases/{k:04}/case.json"));
        (1..=cases).map(case).filter(|path| path.is_file()).collect()
    };
    let mut child = run(context, sweep).args(["-j", "2"]).spawn().map_err(|e| e.to_string())?;
    while results().len() < KILLED_AFTER && child.try_wait().map_err(|e| e.to_string())?.is_none() {
        std::thread::sleep(Duration::from_millis(5));
    }
    child.kill().and_then(|()| child.wait()).map_err(|e| e.to_string())?;
    Ok(results())
}

fn changed(file: &Path) -> Option<std::time::SystemTime> {
    file.metadata().and_then(|m| m.modified()).ok()
}

fn bytes(file: &Path) -> Outcome<Vec<u8>> {
    std::fs::read(file).map_err(|e| format!("{}: {e}", file.display()))
}
