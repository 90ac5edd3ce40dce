//! The newcomer's four commands – new, build, run, check – with a watch: longest time per language, the kinds together.

use super::super::{Context, Figure, Limit};
use crate::process::Outcome;
use std::path::Path;
use std::process::Command;
use std::time::Instant;
use terraglue_numerics::extremes::larger;

/// Language, longest time, s, and its build command.
const LANGUAGES: [(&str, f64, &[&str]); 4] = [
    ("rust", 60.0, &["cargo", "build", "-q"]),
    ("c", 10.0, &["make"]),
    ("cpp", 10.0, &["make"]),
    ("python", 10.0, &[]),
];

/// One figure per language.
pub fn figures(context: &Context, out: &mut Vec<Figure>) -> Outcome {
    for (language, limit, build) in LANGUAGES {
        let mut longest = 0.0_f64;
        for kind in ["soil", "robot", "controller", "law"] {
            let folder = context.scratch.join(format!("new-{language}"));
            std::fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
            let start = Instant::now();
            let name = format!("my-{kind}");
            let place = folder.join(&name);
            let program = context.program.display().to_string();
            typed(&folder, &[&program, "new", kind, &name, "--lang", language])?;
            // in place of a build: check that all names fit
            let check: &[&str] = &[&program, "check", "scenario.toml"];
            typed(&place, if build.is_empty() { check } else { build })?;
            typed(&place, &[&program, "run", "scenario.toml", "--quiet"])?;
            let file = match language {
                "rust" => format!("./target/debug/libmy_{kind}_plugin.so"),
                "python" => format!("./my_{kind}.py"),
                _ => format!("./libmy_{kind}_plugin.so"),
            };
            typed(&place, &[&program, "check-module", &file])?;
            longest = larger(longest, start.elapsed().as_secs_f64());
        }
        let what = format!("new, build, run and check of a module in {language}, the slowest kind, s");
        out.push(Figure::new(format!("plugins.newcomer.{language}"), longest, Limit::AtMost(limit), what));
    }
    Ok(())
}

fn typed(folder: &Path, command: &[&str]) -> Outcome {
    let (program, arguments) = command.split_first().ok_or("an empty command")?;
    let done = Command::new(program).args(arguments).current_dir(folder).output();
    let done = done.map_err(|e| format!("cannot start {program}: {e}"))?;
    if done.status.success() {
        return Ok(());
    }
    let said = [done.stdout, done.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).concat();
    Err(format!("{}: {said}", command.join(" ")))
}
