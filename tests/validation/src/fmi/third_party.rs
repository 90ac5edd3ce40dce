//! FMUs of other tools in `TERRAGLUE_FMU_DIR`, each run here and by FMPy at the same times: every FMU that FMPy simulates runs
//! here with the same last row, or is refused with its breach of the standard.
//!
//! Each run has a process of its own. A refusal counts as one where this project's reader refuses archive or description, or the
//! library lacks functions that the standard requires, or where it stops at a value that is no finite number and FMPy's own
//! table holds one too; anything else that FMPy simulates and that does not run here is a failure, and so is a crash or a hang.

use super::cost::peers;
use super::folder;
use super::watched::watched;
use crate::parallel::in_parallel;
use crate::process::{Outcome, root};
use crate::{Context, Figure, Limit};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;
use terraglue::subsystem::ValueType;
use terraglue_fmi::description::Causality;
use terraglue_fmi::{Error, Fmu};

const SCRIPT: &str = "tests/validation/src/fmi/third_party.py";
/// Longest run of an FMU, s.
const TIMEOUT_S: u64 = 300;
/// The same for its watcher: the program's own limit comes first.
const LONGEST: Duration = Duration::from_secs(TIMEOUT_S + 30);
/// Largest difference of two numbers, relative to the larger of 1 and their size.
const ACCURACY: f64 = 1e-9;

/// Outcome of an FMU.
#[derive(Debug, PartialEq)]
enum FmuOutcome {
    /// It is no FMU for co-simulation on this machine.
    Other,
    Equal,
    Different(String),
    OnlyHere,
    /// Why not here.
    Neither(String),
    /// FMPy simulates it; it is refused here with its breach of the standard.
    Refused(String),
    /// FMPy simulates it; here it does not run.
    Failed(String),
}

/// Results of FMPy for an FMU.
#[derive(Debug, Default)]
struct FmpyResult {
    /// Start, stop and step, s, and whether with event mode; none: it is no FMU for co-simulation on this machine.
    times: Option<Vec<String>>,
    /// Its last row; none: FMPy does not simulate it.
    row: Option<Value>,
}

pub fn figures(place: &Path, context: &Context) -> Outcome<Vec<Figure>> {
    let Some(fmus) = folder::fmus() else {
        return Ok(vec![Figure::skipped("fmi.third_party", folder::NOT_SET)]);
    };
    let fmus = without_copies(fmus.third_party)?;
    if fmus.is_empty() {
        return Ok(vec![Figure::skipped(
            "fmi.third_party",
            "TERRAGLUE_FMU_DIR holds no FMUs of other tools",
        )]);
    }
    let python = peers::python()?;
    if !Command::new(&python).args(["-c", "import fmpy"]).status().is_ok_and(|s| s.success()) {
        return Ok(vec![Figure::skipped("fmi.third_party", "FMPy is not there and could not be installed")]);
    }
    let steps = if context.quick { 200 } else { 2000 };
    let numbered: Vec<(usize, PathBuf)> = fmus.into_iter().enumerate().collect();
    let judge = |(number, fmu): &(usize, PathBuf)| {
        let own = place.join(format!("third-party-{number}"));
        let fate = std::fs::create_dir_all(&own)
            .map_err(|e| e.to_string())
            .and_then(|()| fate(&own, (context, &python), fmu, steps))
            .unwrap_or_else(FmuOutcome::Failed);
        drop(std::fs::remove_dir_all(&own));
        (folder::stem(fmu), fate)
    };
    let mut fates = in_parallel(&numbered, judge);
    fates.retain(|(_, fate)| *fate != FmuOutcome::Other);
    Ok(counted(&fates))
}

/// The paths of files that differ in at least a byte; of equal ones the first.
fn without_copies(fmus: Vec<PathBuf>) -> Outcome<Vec<PathBuf>> {
    let mut kept: Vec<(PathBuf, u64)> = Vec::new();
    for fmu in fmus {
        let wrong = |e: std::io::Error| format!("{}: {e}", fmu.display());
        let size = std::fs::metadata(&fmu).map_err(wrong)?.len();
        let mut bytes = None;
        let mut copy = false;
        for (other, _) in kept.iter().filter(|(_, n)| *n == size) {
            if bytes.is_none() {
                bytes = Some(std::fs::read(&fmu).map_err(wrong)?);
            }
            copy |= std::fs::read(other).map_err(wrong)? == *bytes.as_ref().unwrap_or(&Vec::new());
        }
        if !copy {
            kept.push((fmu, size));
        }
    }
    Ok(kept.into_iter().map(|(path, _)| path).collect())
}

fn counted(fates: &[(String, FmuOutcome)]) -> Vec<Figure> {
    let figure = |name: &str, limit, what: &str, of: fn(&FmuOutcome) -> Option<&str>| {
        let found: Vec<(&str, &str)> =
            fates.iter().filter_map(|(fmu, fate)| Some((fmu.as_str(), of(fate)?))).collect();
        let told: Vec<String> = found
            .iter()
            .filter(|(_, why)| !why.is_empty())
            .map(|(fmu, why)| format!("{fmu}: {why}"))
            .collect();
        let told = if told.is_empty() { String::new() } else { format!(": {}", told.join("; ")) };
        let text = format!("{what}{told}").replace(['\n', '\t'], " ");
        Figure::new(format!("fmi.third_party.{name}"), found.len() as f64, limit, text)
    };
    let zero = Limit::Equal(0.0);
    vec![
        figure("units", Limit::None, "different FMUs of other tools for co-simulation on Linux", |_| {
            Some("")
        }),
        figure("equal", Limit::None, "of them with the same last row here and in FMPy, to 1e-9", |f| {
            (*f == FmuOutcome::Equal).then_some("")
        }),
        figure("only_here", Limit::None, "run here and not in FMPy", |f| {
            (*f == FmuOutcome::OnlyHere).then_some("")
        }),
        figure("neither", Limit::None, "run neither here nor in FMPy", |f| {
            if let FmuOutcome::Neither(why) = f { Some(why) } else { None }
        }),
        figure(
            "refused",
            Limit::None,
            "FMPy simulates them, here they are refused with what breaks the standard",
            |f| {
                if let FmuOutcome::Refused(why) = f { Some(why) } else { None }
            },
        ),
        figure("different", zero, "end with another row than in FMPy", |f| {
            if let FmuOutcome::Different(why) = f { Some(why) } else { None }
        }),
        figure(
            "failed",
            zero,
            "FMPy simulates them, here they neither run nor are refused with what breaks the standard",
            |f| {
                if let FmuOutcome::Failed(why) = f { Some(why) } else { None }
            },
        ),
    ]
}

fn fate(place: &Path, (context, python): (&Context, &Path), fmu: &Path, steps: u32) -> Outcome<FmuOutcome> {
    let fmu = &fmu.canonicalize().map_err(|e| format!("{}: {e}", fmu.display()))?;
    let mut script = Command::new(python);
    script.arg(root().join(SCRIPT)).arg(fmu).arg(steps.to_string());
    let told = told(&watched(&mut script, place, LONGEST)?.output);
    let Some(times) = &told.times else { return Ok(FmuOutcome::Other) };
    let mut own = Command::new(&context.program);
    own.args(["fmu", "run", "--isolate", "--timeout", &TIMEOUT_S.to_string()]).arg(fmu);
    own.args(
        ["--start-time", "--stop", "--step", "--event-mode"]
            .iter()
            .zip(times)
            .map(|(key, value)| format!("{key}={value}")),
    );
    let table = place.join("table.csv");
    let ended = watched(own.arg("--csv").arg(&table), place, LONGEST)?;
    let complaint = ended.error().replace(&format!("{}: ", fmu.display()), "");
    Ok(match (ended.code == Some(0), &told.row) {
        (true, Some(row)) => match difference(fmu, &table, row, times.last().is_some_and(|t| t == "on"))? {
            None => FmuOutcome::Equal,
            Some(why) => FmuOutcome::Different(why),
        },
        (true, None) => FmuOutcome::OnlyHere,
        (false, None) => FmuOutcome::Neither(complaint),
        (false, Some(row)) => match breach(fmu, &complaint, row) {
            Some(why) => FmuOutcome::Refused(why),
            None => FmuOutcome::Failed(complaint),
        },
    })
}

fn told(text: &str) -> FmpyResult {
    let after = |word: &str| text.lines().rev().find_map(|line| line.strip_prefix(word));
    FmpyResult {
        times: after("EXPERIMENT ").map(|t| t.split(' ').map(str::to_owned).collect()),
        row: after("RESULT ").and_then(|t| serde_json::from_str(t).ok()),
    }
}

/// Breach of the standard by an FMU, where the refusal names one.
fn breach(fmu: &Path, complaint: &str, row: &Value) -> Option<String> {
    if let Err(why @ (Error::Archive { .. } | Error::Description { .. })) = Fmu::inspect(fmu) {
        return Some(why.to_string().replace(&format!("{}: ", fmu.display()), ""));
    }
    let odd = row["odd"].as_array().is_some_and(|names| {
        names
            .iter()
            .filter_map(Value::as_str)
            .any(|name| complaint.contains(&format!("the variable `{name}")))
    });
    let named = odd || complaint.contains("its library has no function `");
    named.then(|| if odd { format!("{complaint} (FMPy writes it down)") } else { complaint.to_owned() })
}

/// How the last row here differs from FMPy's; none: not at all.
fn difference(fmu: &Path, table: &Path, row: &Value, events: bool) -> Outcome<Option<String>> {
    let (description, _) = Fmu::inspect(fmu).map_err(|e| e.to_string())?;
    let mut reader = csv::Reader::from_path(table).map_err(|e| e.to_string())?;
    let last = reader.records().last().ok_or("the table has no row")?.map_err(|e| e.to_string())?;
    let mut cells = last.iter();
    let time = row["time"].as_str().unwrap_or_default();
    if !same(ValueType::F64, cells.next().unwrap_or_default(), time) {
        return Ok(Some(format!("ends at t = {} s, in FMPy at {time} s", &last[0])));
    }
    for v in &description.variables {
        let clock = v.value_type == ValueType::Clock;
        if clock && v.causality == Causality::Output && events {
            cells.by_ref().take(v.len()).for_each(drop);
        }
        if clock || v.causality != Causality::Output {
            continue;
        }
        let theirs = row["values"][&v.name].as_array().map_or(&[][..], Vec::as_slice);
        if theirs.len() != v.len() {
            return Ok(Some(format!("`{}` has {} values, in FMPy {}", v.name, v.len(), theirs.len())));
        }
        for value in theirs {
            let (own, their) = (cells.next().unwrap_or_default(), value.as_str().unwrap_or_default());
            if !same(v.value_type, own, their) {
                return Ok(Some(format!("`{}` is {own}, in FMPy {their}", v.name)));
            }
        }
    }
    Ok(None)
}

/// Whether two values are the same: numbers to the accuracy, all else exactly.
fn same(kind: ValueType, own: &str, their: &str) -> bool {
    let close = |a: f64, b: f64| a == b || (a - b).abs() <= ACCURACY * a.abs().max(b.abs()).max(1.0);
    match (kind, own.parse::<f64>(), their.parse::<f64>()) {
        (ValueType::F64, Ok(a), Ok(b)) => close(a, b),
        (ValueType::F32, Ok(a), Ok(b)) => close(f64::from(a as f32), f64::from(b as f32)),
        _ => own == their,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use terraglue_fmi::export::{Compression, Content, pack};

    #[test]
    fn the_script_is_there() {
        assert!(root().join(SCRIPT).exists());
    }

    #[test]
    fn of_files_with_the_same_bytes_one_is_run() {
        let folder = tempfile::tempdir().expect("a folder");
        let files = [("a", "one"), ("b", "two"), ("c", "one"), ("d", "three")].map(|(name, text)| {
            let path = folder.path().join(name);
            std::fs::write(&path, text).expect("a file");
            path
        });
        let kept = without_copies(files.to_vec()).expect("kept");
        assert_eq!(kept.iter().map(|p| folder::stem(p)).collect::<Vec<_>>(), ["a", "b", "d"]);
    }

    #[test]
    fn a_refusal_names_what_breaks_the_standard_or_is_a_failure() {
        let row = serde_json::json!({ "odd": ["x"] });
        let folder = tempfile::tempdir().expect("a folder");
        let good =
            crate::fmi::fmus::build(folder.path(), "good", &[("x", 'o', 0.0)], "", "").expect("an FMU");
        let judged = |said: &str| breach(&good, said, &row);
        assert!(judged("at t = 1 s: the variable `x` is NaN").is_some());
        assert!(judged("at t = 1 s: the variable `y` is NaN").is_none(), "FMPy has no such number for y");
        assert!(judged("its library has no function `fmi2DoStep`, which the standard promises").is_some());
        assert!(
            judged("its process was lost: signal 11").is_none()
                && judged("it ended without a word").is_none()
        );
        let broken = folder.path().join("broken.fmu");
        let entry = ("modelDescription.xml".to_owned(), Content::Text("<a/>".into()));
        pack(&broken, &[entry], Compression::Deflate).expect("an archive");
        assert!(breach(&broken, "whatever", &row).is_some_and(|why| why.contains("no FMU")));
    }

    #[test]
    fn numbers_are_compared_to_the_accuracy_and_all_else_exactly() {
        assert!(same(ValueType::F64, "1e6", "1000000.0005") && !same(ValueType::F64, "1", "1.00000001"));
        assert!(same(ValueType::F32, "0.1", "0.10000000149011612") && !same(ValueType::F64, "NaN", "nan"));
        assert!(same(ValueType::I64, "9007199254740993", "9007199254740993"));
        assert!(!same(ValueType::I64, "9007199254740993", "9007199254740992"));
        assert!(same(ValueType::String, "a b", "a b") && !same(ValueType::String, "1.0", "1"));
    }

    #[test]
    fn the_words_of_the_script_are_found_among_those_of_the_fmu() {
        let found = told("hello\n\nEXPERIMENT 0.0 1.0 0.5 off\nnoise\nRESULT {\"time\":\"1.0\"}\n");
        assert_eq!(found.times.as_deref(), Some(&["0.0", "1.0", "0.5", "off"].map(str::to_owned)[..]));
        assert_eq!(found.row.expect("a row")["time"], "1.0");
        assert!(
            told("NONE no FMU\n").times.is_none() && told("EXPERIMENT 0 1 1 off\nFAILED x").row.is_none()
        );
    }

    #[test]
    fn fates_are_counted_and_told() {
        let fates = [
            ("a", FmuOutcome::Equal),
            ("b", FmuOutcome::Refused("x is NaN".into())),
            ("c", FmuOutcome::Failed("lost".into())),
        ];
        let figures = counted(&fates.map(|(name, fate)| (name.to_owned(), fate)));
        let of = |name: &str| figures.iter().find(|f| f.id.ends_with(name)).expect("the figure").clone();
        assert_eq!(
            (of("units").value, of("equal").value, of("refused").value),
            (Some(3.0), Some(1.0), Some(1.0))
        );
        assert!(of("refused").what.ends_with(": b: x is NaN") && of("failed").what.ends_with(": c: lost"));
        assert_eq!(
            (of("failed").pass, of("different").pass, of("refused").pass),
            (Some(false), Some(true), Some(true))
        );
    }
}
