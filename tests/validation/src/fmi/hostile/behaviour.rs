//! FMUs that misbehave at each stage of their life, in a scenario and alone, without and with isolation: the run reports
//! it, or goes on unharmed; its recording can be read, and nothing is left behind.

use super::super::watched::{Ended, watched};
use crate::parallel::in_parallel;
use crate::process::{Outcome, command, must, read, write};
use crate::{Context, Figure, Limit};
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::Command;
use std::time::Duration;
use terraglue::recording::Recording;
use terraglue_fmi::export::{Compression, Content, pack};

const CODE: &str = include_str!("fmu.c");
const DESCRIPTION: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="m" guid="g"><CoSimulation modelIdentifier="m"/><ModelVariables>
<ScalarVariable name="x" valueReference="0" causality="output" initial="calculated"><Real/></ScalarVariable>
</ModelVariables><ModelStructure><Outputs><Unknown index="1"/></Outputs></ModelStructure></fmiModelDescription>"#;

const STAGES: [&str; 6] = ["load", "instantiate", "initialise", "step", "terminate", "free"];
/// Ends the process, or keeps it for ever.
const DEADLY: [&str; 11] =
    ["abort", "exit", "gone", "segv", "deep", "hang", "stop", "heap", "overrun", "memory", "late"];
/// A status, or a value that is none, with the stages that have one.
const WRONG: [(&str, &[&str]); 5] = [
    ("error", &["instantiate", "initialise", "step", "terminate"]),
    ("fatal", &["initialise", "step", "terminate"]),
    ("discard", &["initialise", "step", "terminate"]),
    ("nan", &["initialise", "step"]),
    ("infinite", &["initialise", "step"]),
];
/// Floods of the log; there is none while the library is loaded.
const LOGS: [&str; 4] = ["flood", "null", "utf", "huge"];
/// Changes and remains in the process.
const CHANGES: [&str; 8] = ["close", "folder", "locale", "mask", "signal", "round", "thread", "child"];
/// Table of an FMU that is run alone.
const TABLE: &str = "table.csv";
/// Longest run, s: the program's own limits come first.
const LONGEST: Duration = Duration::from_secs(60);
/// Samples of a complete recording, and of one whose FMU misbehaves in its first step after 0.25 s.
const ALL: usize = 11;
const SOME: usize = 4;

/// One run.
#[derive(Clone, Copy)]
struct Misbehaviour {
    what: &'static str,
    stage: &'static str,
    isolated: bool,
    /// By `terraglue fmu run`; else in a scenario.
    alone: bool,
}

/// How it must end.
#[derive(Clone, Copy, PartialEq)]
enum Promise {
    /// With an error of the FMU, exit code 1.
    Error,
    /// As if nothing had been.
    Complete,
}

impl Misbehaviour {
    fn all() -> Vec<Self> {
        let mut all = Vec::new();
        for (isolated, alone) in [(true, false), (false, false), (true, true), (false, true)] {
            let mut add = |what, stage| all.push(Self { what, stage, isolated, alone });
            for what in DEADLY.into_iter().filter(|what| isolated || *what == "exit") {
                STAGES.iter().for_each(|stage| add(what, stage));
            }
            WRONG.iter().for_each(|(what, stages)| stages.iter().for_each(|stage| add(what, stage)));
            LOGS.iter().for_each(|what| STAGES[1..].iter().for_each(|stage| add(what, stage)));
            CHANGES.iter().for_each(|what| STAGES.iter().for_each(|stage| add(what, stage)));
            if isolated {
                add("overrun", "get");
            }
        }
        all
    }

    fn name(self) -> String {
        format!("{}_{}", self.what, self.stage)
    }

    fn promise(self) -> Promise {
        if LOGS.contains(&self.what) || CHANGES.contains(&self.what) {
            Promise::Complete
        } else {
            Promise::Error
        }
    }

    /// Folder of its run.
    fn folder(self) -> String {
        let alone = if self.alone { "-alone" } else { "" };
        let isolated = if self.isolated { "-isolated" } else { "" };
        format!("{}{alone}{isolated}", self.name())
    }

    /// Longest time of a call of it, s.
    fn timeout(self) -> f64 {
        if ["hang", "stop"].contains(&self.what) { 1.0 } else { 60.0 }
    }

    /// Samples that the recording must hold; none: the run does not begin.
    fn samples(self) -> Option<usize> {
        match (self.promise(), self.stage) {
            (Promise::Complete, _) | (_, "terminate" | "free") => Some(ALL),
            (_, "step") => Some(SOME),
            _ => None,
        }
    }

    fn scenario(self, fmu: &Path) -> String {
        let (name, fmu, isolated) = (self.name(), fmu.display(), self.isolated);
        let timeout = self.timeout();
        format!(
            "[time]\nstep_s = 0.1\nduration_s = 1.0\n[recording]\nevery_steps = 1\n[{name}]\nfmu = \"{fmu}\"\nisolate = \
             {isolated}\nstep_timeout_s = {timeout}\nload_timeout_s = {timeout}\nmemory_mb = 500\n"
        )
    }
}

pub fn figures(folder: &Path, context: &Context) -> Outcome<Vec<Figure>> {
    let folder = &folder.canonicalize().map_err(|e| format!("{}: {e}", folder.display()))?;
    let fmu = &fmu(folder)?;
    let cases = Misbehaviour::all();
    let broken = in_parallel(&cases, |case| {
        let wrong = judge(folder, context, fmu, *case).unwrap_or_else(|e| vec![e]);
        (!wrong.is_empty()).then(|| format!("{}: {}", case.name(), wrong.join(", ")))
    });
    let figure = |(isolated, alone), id: &str, what: &str| {
        let of = || cases.iter().zip(&broken).filter(|(c, _)| (c.isolated, c.alone) == (isolated, alone));
        let told: Vec<&str> = of().filter_map(|(_, broken)| broken.as_deref()).collect();
        let text = format!("FMUs {what} that end otherwise than promised, of {}", of().count());
        let text = if told.is_empty() { text } else { format!("{text}: {}", told.join("; ")) };
        let text = text.replace(['\n', '\t'], " ");
        Figure::new(format!("fmi.behaviour.{id}"), told.len() as f64, Limit::Equal(0.0), text)
    };
    Ok(vec![
        figure((true, false), "isolated", "of a scenario in a process of their own that misbehave"),
        figure((false, false), "same_process", "of a scenario that misbehave without killing its process"),
        figure((true, true), "alone.isolated", "run alone in a process of their own that misbehave"),
        figure((false, true), "alone.same_process", "run alone that misbehave without killing the process"),
    ])
}

fn fmu(folder: &Path) -> Outcome<std::path::PathBuf> {
    let [source, library, fmu] = ["hostile.c", "hostile.so", "hostile.fmu"].map(|name| folder.join(name));
    write(&source, CODE)?;
    must(
        command("cc", &["-shared", "-fPIC", "-w", "-o"])
            .arg(&library)
            .arg(&source)
            .args(["-lpthread", "-lm"]),
    )?;
    let entries = [
        ("modelDescription.xml".to_owned(), Content::Text(DESCRIPTION.into())),
        ("binaries/linux64/m.so".to_owned(), Content::File(library)),
    ];
    pack(&fmu, &entries, Compression::Deflate)?;
    Ok(fmu)
}

/// Deviations from the promised behaviour.
fn judge(folder: &Path, context: &Context, fmu: &Path, case: Misbehaviour) -> Outcome<Vec<String>> {
    let place = folder.join(case.folder());
    let mut run = Command::new(&context.program);
    if case.alone {
        std::fs::create_dir_all(&place).map_err(|e| format!("{}: {e}", place.display()))?;
        run.args(["fmu", "run", "--stop", "1", "--step", "0.1", "--csv", TABLE]).arg(fmu);
        if case.isolated {
            run.args(["--isolate", "--memory-mb", "500", "--timeout", &case.timeout().to_string()]);
        }
        run.env("HOSTILE_NAME", case.name());
    } else {
        write(&place.join("x.toml"), &case.scenario(fmu))?;
        run.args(["run", "x.toml", "--csv", "--quiet", "--out", "out"]);
    }
    if case.stage == "load" {
        run.env("HOSTILE_LOAD", case.what);
    }
    let ended = watched(&mut run, &place, LONGEST)?;
    let mut wrong = about_end(case, &ended);
    if let Some(samples) = case.samples() {
        wrong.extend(match case.alone {
            true => about_table(&place.join(TABLE), samples),
            false => about_recording(&place.join("out"), &case.name(), samples),
        });
    }
    wrong.extend(ended.left.iter().map(|what| format!("{what} is left")));
    if wrong.is_empty() {
        drop(std::fs::remove_dir_all(&place));
    }
    Ok(wrong)
}

fn about_end(case: Misbehaviour, ended: &Ended) -> Vec<String> {
    let mut wrong = Vec::new();
    let (code, errors) = (ended.code, &ended.errors);
    let wanted = if case.promise() == Promise::Error { 1 } else { 0 };
    if code != Some(wanted) {
        let code = code.map_or("none".to_owned(), |code| code.to_string());
        wrong.push(format!("exit code {code}, not {wanted} ({})", ended.error()));
    }
    let told = errors.lines().filter(|line| line.starts_with("error")).count();
    if told != usize::try_from(wanted).unwrap_or(0) {
        wrong.push(format!("{told} errors are told"));
    }
    // a library that ends the process of the run while it is loaded has no name yet
    let named =
        case.isolated || case.what != "exit" || !["load", "instantiate", "initialise"].contains(&case.stage);
    let name = if case.alone { "hostile.fmu".to_owned() } else { case.name() };
    if wanted == 1 && (named || case.alone) && !ended.error().contains(&name) {
        wrong.push(format!("`{}` does not name it", ended.error()));
    }
    if errors.contains("panicked") || errors.len() > 100_000 {
        wrong.push(format!("{} bytes of errors", errors.len()));
    }
    wrong
}

fn about_recording(folder: &Path, name: &str, samples: usize) -> Option<String> {
    let found = match Recording::open(folder) {
        Err(e) => return Some(format!("no recording: {e}")),
        Ok(recording) if recording.damaged > 0 => return Some("its recording is damaged".into()),
        Ok(recording) => {
            // the sum of tenths shows how it was rounded
            let (end, numbers) = (recording.end_s(), recording.series(&format!("{name}.x")));
            if samples == ALL && end != 1.0 {
                return Some(format!("its recording ends at {end} s"));
            }
            numbers.map_or(0, |(t, _)| t.len())
        }
    };
    if found != samples {
        return Some(format!("{found} samples in its recording, not {samples}"));
    }
    if let Some(wrong) = about_table(&folder.join("variables.csv"), samples) {
        return Some(wrong);
    }
    let closed = |name: &&str| {
        let mode = std::fs::metadata(folder.join(name)).map_or(0, |of| of.permissions().mode());
        mode & 0o400 == 0
    };
    let unread = ["recording.mcap", "variables.csv", "summary.json", "report.html"].into_iter().find(closed);
    unread.map(|name| format!("{name} is missing or cannot be read"))
}

fn about_table(path: &Path, samples: usize) -> Option<String> {
    let rows = read(path).map_or(0, |text| text.lines().count());
    (rows != samples + 1).then(|| format!("{rows} lines in its table, not {}", samples + 1))
}
