//! New code in a run: how long after its source was saved, and how much memory a hundred exchanges take.

use super::super::{Context, Figure, Limit};
use crate::process::Outcome;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;
use terraglue::observer::{Event, Observer};
use terraglue::reload::{ReloadOptions, Reloader};
use terraglue::scaffold::{Kind, Language, scaffold};
use terraglue::scenario::Scenario;
use terraglue::testbed::{Options, Testbed};

/// All figures; the hundred exchanges only where there is time.
pub fn figures(context: &Context, out: &mut Vec<Figure>) -> Outcome {
    for (language, id, limit) in [(Language::C, "c", 2.0), (Language::Rust, "rust", 2.0)] {
        let place = made(context, language)?;
        let seconds = saved_to_new_code(context, &place, language)?;
        let what = format!("saved source to first step of new code, a controller in {}, s", language.title());
        out.push(Figure::new(format!("plugins.reload.{id}"), seconds, Limit::AtMost(limit), what));
    }
    if !context.quick {
        let grown = hundred(context, &made(context, Language::C)?)?;
        let what = "memory that a hundred exchanges of code take, MB";
        out.push(Figure::new("plugins.reload.memory", grown, Limit::AtMost(50.0), what));
    }
    Ok(())
}

/// How many numbers of a run differ where the same code is exchanged for itself in the middle.
pub fn same(context: &Context, out: &mut Vec<Figure>) -> Outcome {
    let folder = made(context, Language::C)?;
    let run = |at_steps| -> Outcome<Vec<u64>> {
        let (mut testbed, mut reloader) = started(context, &folder, at_steps)?;
        let mut bits = Vec::new();
        for k in 1..=200 {
            reloader.run_until(&mut testbed, 1e-3 * f64::from(k), &mut []).map_err(|e| e.to_string())?;
            for name in ["controller.angle_target", "controller.speed_target", "robot.shoulder.angle"] {
                bits.push(testbed.read(name).ok_or_else(|| format!("no variable {name}"))?.to_bits());
            }
        }
        Ok(bits)
    };
    let (plain, exchanged) = (run(Vec::new())?, run(vec![("controller".to_owned(), 100)])?);
    let differ = plain.iter().zip(&exchanged).filter(|(a, b)| a != b).count();
    let what = "numbers of a run that differ when code is exchanged for the same code at step 100";
    out.push(Figure::new("plugins.reload.same", differ as f64, Limit::Equal(0.0), what));
    Ok(())
}

/// The folder of a new controller, built.
fn made(context: &Context, language: Language) -> Outcome<PathBuf> {
    let program = context.program.display().to_string();
    let made = scaffold(Kind::Controller, language, "my-controller", &program).map_err(|e| e.to_string())?;
    let folder = context.scratch.join(format!("reload-{}", language.word()));
    drop(std::fs::remove_dir_all(&folder));
    made.write(&folder).map_err(|e| e.to_string())?;
    let built = Command::new("sh").args(["-c", &made.commands[0]]).current_dir(&folder).output();
    let built = built.map_err(|e| e.to_string())?;
    match built.status.success() {
        true => Ok(folder),
        false => Err(format!("a new controller does not build: {}", String::from_utf8_lossy(&built.stderr))),
    }
}

/// The time at which a recording would get the event of an exchange.
#[derive(Default)]
struct Heard(Option<(Instant, String)>);

impl Observer for Heard {
    fn event(&mut self, event: &Event) -> terraglue::Result {
        if event.what.starts_with("reload ") {
            self.0 = Some((Instant::now(), event.what.clone()));
        }
        Ok(())
    }
}

fn started(context: &Context, folder: &Path, at_steps: Vec<(String, u64)>) -> Outcome<(Testbed, Reloader)> {
    let scenario = Scenario::load(&folder.join("scenario.toml"), &[]).map_err(|e| e.to_string())?;
    let options = Options { threads: 1, ..Options::default() };
    let testbed =
        Testbed::build_with(&scenario, &options, &terraglue::library()).map_err(|e| e.to_string())?;
    let wanted = ReloadOptions { program: context.program.clone(), reset: false, at_steps };
    let reloader = Reloader::new(&scenario, &options, wanted).map_err(|e| e.to_string())?;
    Ok((testbed, reloader))
}

fn saved_to_new_code(context: &Context, folder: &Path, language: Language) -> Outcome<f64> {
    let source = folder.join(if language == Language::C { "my_controller.c" } else { "src/lib.rs" });
    let (mut testbed, mut reloader) = started(context, folder, Vec::new())?;
    reloader.run_until(&mut testbed, 0.1, &mut []).map_err(|e| e.to_string())?;
    let text = std::fs::read_to_string(&source).map_err(|e| e.to_string())?;
    let changed = text.replace("* left;", "* left * 1.0000001;");
    std::fs::write(&source, changed).map_err(|e| e.to_string())?;
    let saved = Instant::now();
    let mut heard = Heard::default();
    while heard.0.is_none() && saved.elapsed().as_secs() < 120 {
        let until = testbed.t_s() + 0.01;
        reloader.run_until(&mut testbed, until, &mut [&mut heard]).map_err(|e| e.to_string())?;
    }
    match heard.0 {
        Some((at, told)) if told.contains("carried over") => Ok((at - saved).as_secs_f64()),
        Some((_, told)) => Err(told),
        None => Err("new code was not taken over within two minutes".into()),
    }
}

fn hundred(context: &Context, folder: &Path) -> Outcome<f64> {
    let resident = || -> Outcome<f64> {
        let status = std::fs::read_to_string("/proc/self/status").map_err(|e| e.to_string())?;
        let line = status.lines().find_map(|l| l.strip_prefix("VmRSS:"));
        let kb = line.and_then(|l| l.split_whitespace().next()?.parse::<f64>().ok());
        Ok(kb.ok_or("the system does not tell the memory of this process")? / 1024.0)
    };
    let (mut testbed, mut reloader) =
        started(context, folder, (10..110).map(|k| ("controller".to_owned(), k)).collect())?;
    reloader.run_until(&mut testbed, 0.009, &mut []).map_err(|e| e.to_string())?;
    let before = resident()?;
    reloader.run_until(&mut testbed, 0.12, &mut []).map_err(|e| e.to_string())?;
    Ok(resident()? - before)
}
