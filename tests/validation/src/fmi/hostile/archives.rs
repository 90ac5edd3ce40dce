//! Archives and descriptions that mean harm, run as a user would: one clear error before any code of theirs runs, nothing
//! written elsewhere and nothing left behind. Odd but legal ones run, and a reader never panics.

use super::super::watched::{Ended, watched};
use crate::parallel::in_parallel;
use crate::process::{Outcome, command, must, write};
use crate::{Context, Figure, Limit};
use hostile_archives::mutations::Mutations;
use hostile_archives::{Case, MANY, another_token, corpus, refused, unloadable, usable};
use std::panic::catch_unwind;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};
use terraglue_fmi::{Fmu, Limits};

const CODE: &str = include_str!("library.c");
/// Longest run.
const LONGEST: Duration = Duration::from_secs(60);
/// Changed archives in a long run.
const ROUNDS: usize = 50_000;
/// Written by the library as soon as it is loaded.
const MARK: &str = "mark";
/// Expected files of a case: the archive, output, errors and temporary folder.
const OWN: [&str; 4] = ["x.fmu", "output", "errors", "tmp"];

/// Whether code of the FMU may run, must, or must not.
#[derive(Clone, Copy, PartialEq)]
enum Code {
    Never,
    MayRun,
    Runs,
}

pub fn figures(folder: &Path, context: &Context) -> Outcome<Vec<Figure>> {
    let folder = &folder.canonicalize().map_err(|e| format!("{}: {e}", folder.display()))?;
    let library = &library(folder)?;
    let mut bad: Vec<(Case, Code)> = refused(library).into_iter().map(|case| (case, Code::Never)).collect();
    bad.extend(unloadable(library).into_iter().map(|case| (case, Code::Never)));
    bad.push((another_token(library), Code::MayRun));
    let odd: Vec<(Case, Code)> = usable(library).into_iter().map(|case| (case, Code::Runs)).collect();
    let mut figures = vec![
        counted(
            (folder, context),
            "refused",
            &bad,
            "archives, descriptions and libraries that are answered otherwise than by one clear error before any of their code \
             runs, write elsewhere or leave something behind",
        ),
        counted((folder, context), "usable", &odd, "odd but legal FMUs that do not run"),
    ];
    figures.push(many(folder, context, odd.last())?);
    figures.extend(reader(folder, context)?);
    Ok(figures)
}

fn library(folder: &Path) -> Outcome<Vec<u8>> {
    let [source, library] = ["marked.c", "marked.so"].map(|name| folder.join(name));
    write(&source, CODE)?;
    let flags = ["-shared", "-fPIC", "-w", "-fno-builtin", "-o"];
    must(command("cc", &flags).arg(&library).arg(&source))?;
    std::fs::read(&library).map_err(|e| format!("{}: {e}", library.display()))
}

fn counted((folder, context): (&Path, &Context), id: &str, cases: &[(Case, Code)], what: &str) -> Figure {
    let numbered: Vec<_> = cases.iter().enumerate().collect();
    let judge = |(k, (case, code)): &(usize, &(Case, Code))| {
        let place = folder.join(format!("{id}-{k}"));
        let wrong = judge(&place, context, case, *code).unwrap_or_else(|e| vec![e]);
        drop(std::fs::remove_dir_all(&place));
        (!wrong.is_empty()).then(|| format!("{}: {}", case.name, wrong.join(", ")))
    };
    let told: Vec<String> = in_parallel(&numbered, judge).into_iter().flatten().collect();
    let text = format!("{what}, of {}", cases.len());
    let text = if told.is_empty() { text } else { format!("{text}: {}", told.join("; ")) };
    let text = text.replace(['\n', '\t'], " ");
    Figure::new(format!("fmi.archives.{id}"), told.len() as f64, Limit::Equal(0.0), text)
}

fn run(place: &Path, context: &Context, bytes: &[u8]) -> Outcome<Ended> {
    let wrong = |e: std::io::Error| format!("{}: {e}", place.display());
    std::fs::create_dir_all(place).map_err(wrong)?;
    std::fs::write(place.join(OWN[0]), bytes).map_err(wrong)?;
    let mut run = Command::new(&context.program);
    run.args(["fmu", "run", OWN[0], "--stop", "1", "--step", "0.5", "--output", "x"]);
    watched(run.env("HOSTILE_MARK", place.join(MARK)), place, LONGEST)
}

/// Deviations from the promised behaviour.
fn judge(place: &Path, context: &Context, case: &Case, code: Code) -> Outcome<Vec<String>> {
    let ended = run(place, context, &case.bytes)?;
    let mut wrong = Vec::new();
    let told = ended.errors.lines().filter(|l| ["error", "  x ", "  × "].iter().any(|w| l.starts_with(w)));
    let told = told.count();
    if code == Code::Runs {
        let rows = ended.output.lines().count();
        if ended.code != Some(0) || told != 0 || rows != 4 {
            wrong.push(format!("{rows} rows and {told} errors ({})", ended.errors));
        }
    } else {
        if !matches!(ended.code, Some(1 | 2)) || told != 1 || ended.errors.len() > 2000 {
            wrong.push(format!("exit code {:?} and {told} errors ({})", ended.code, ended.errors));
        }
        if !in_one_line(&ended.errors).contains(case.says) {
            wrong.push(format!("it is not said that `{}` ({})", case.says, ended.errors));
        }
    }
    let marked = place.join(MARK).exists();
    if marked && code == Code::Never || !marked && code == Code::Runs {
        wrong.push(if marked { "its code ran".into() } else { "its code did not run".into() });
    }
    let beside = std::fs::read_dir(place).into_iter().flatten().flatten();
    let beside = beside.map(|e| e.file_name().to_string_lossy().into_owned());
    let written = beside.filter(|name| name != MARK && !OWN.contains(&name.as_str())).chain(ended.left);
    wrong.extend(written.map(|name| format!("{name} was written")));
    if Path::new("/evil").exists() {
        wrong.push("/evil was written".into());
    }
    Ok(wrong)
}

/// Messages are broken into lines of the width of a terminal.
fn in_one_line(text: &str) -> String {
    let lines = text.lines().map(|l| l.trim_start_matches([' ', '|', '│']));
    lines.collect::<Vec<_>>().join(" ")
}

/// Time to read, start and run an FMU with many variables.
fn many(folder: &Path, context: &Context, case: Option<&(Case, Code)>) -> Outcome<Figure> {
    const ID: &str = "fmi.archives.many_variables";
    let (true, Some((case, _))) = (context.timing, case) else {
        return Ok(Figure::skipped(ID, "measured with a clock only"));
    };
    let place = folder.join("many");
    let start = Instant::now();
    run(&place, context, &case.bytes)?;
    let what = format!("s to read, start, run and end an FMU with {MANY} variables");
    Ok(Figure::new(ID, start.elapsed().as_secs_f64(), Limit::AtMost(2.0), what).timed())
}

/// Kept and fresh changes of good archives: read or refused with an error that names the file.
fn reader(folder: &Path, context: &Context) -> Outcome<Vec<Figure>> {
    let place = tempfile::tempdir_in(folder).map_err(|e| e.to_string())?;
    let path = place.path().join(OWN[0]);
    let kept = corpus().map_err(|e| format!("the corpus: {e}"))?;
    let seed = 0x2545_f491_4f6c_dd1d;
    let fresh = Mutations::new(seed).take(if context.quick { 200 } else { ROUNDS });
    let mut figures = Vec::new();
    let kept: &mut dyn Iterator<Item = Vec<u8>> = &mut kept.into_iter().map(|(_, bytes)| bytes);
    for (id, all, what) in [
        ("corpus", kept, "kept in tests/hostile-archives/corpus"),
        ("fuzz", &mut { fresh }, "changed at random"),
    ] {
        let (mut count, mut wrong) = (0, 0);
        for bytes in all {
            std::fs::write(&path, &bytes).map_err(|e| e.to_string())?;
            count += 1;
            wrong += u32::from(!survives(&path));
        }
        let what = format!(
            "archives {what} that make the reader panic or are refused without their name, of {count}"
        );
        figures.push(Figure::new(format!("fmi.archives.{id}"), f64::from(wrong), Limit::Equal(0.0), what));
    }
    let left = std::fs::read_dir(place.path()).map_err(|e| e.to_string())?.count();
    figures.push(Figure::new(
        "fmi.archives.written",
        left as f64 - 1.0,
        Limit::Equal(0.0),
        "files that reading them left beside them",
    ));
    Ok(figures)
}

fn survives(path: &Path) -> bool {
    let limits = Limits { total: 1 << 24, description: 1 << 22, ..Limits::default() };
    let read = catch_unwind(|| Fmu::open_within(path, limits).map(drop).map_err(|e| e.to_string()));
    match read {
        Ok(Ok(())) => true,
        Ok(Err(text)) => text.contains(OWN[0]) && text.len() < 2000,
        Err(_) => false,
    }
}
