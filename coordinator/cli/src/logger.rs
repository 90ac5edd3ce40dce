//! Log lines of modules and of the library on standard error: warnings and errors, and all with `TERRAGLUE_LOG=info`.
//!
//! Several runs side by side log the same many times over: their warnings are collected, and each is printed once.

use log::{Level, LevelFilter, Log, Metadata, Record};
use std::cell::RefCell;
use std::sync::{Mutex, PoisonError};

struct Logger;

impl Log for Logger {
    fn enabled(&self, metadata: &Metadata) -> bool {
        metadata.target().starts_with("terraglue")
    }

    fn log(&self, record: &Record) {
        if self.enabled(record.metadata()) {
            // an error that a module or FMU logs is not yet one of the program
            let said = ["terraglue::module", "terraglue_fmu"].contains(&record.target());
            let by = if said && record.level() == Level::Error { "logged " } else { "" };
            let level = match record.level() {
                Level::Warn => "warning".to_owned(),
                other => other.as_str().to_lowercase(),
            };
            let line = format!("{by}{level}: {}", super::shorten::text(&record.args().to_string()));
            match with(|all| all.is_some()) && record.level() <= Level::Warn {
                true => RUN.with_borrow(|run| with(|all| all.iter_mut().for_each(|all| all.add(&line, run)))),
                false => eprintln!("{line}"),
            }
        }
    }

    fn flush(&self) {}
}

/// Shows log lines from now on.
pub fn install() {
    let asked = std::env::var("TERRAGLUE_LOG").ok().and_then(|level| level.parse().ok());
    if log::set_logger(&Logger).is_ok() {
        log::set_max_level(asked.unwrap_or(LevelFilter::Warn));
    }
}

thread_local! {
    /// The run that this thread is about.
    static RUN: RefCell<Option<String>> = const { RefCell::new(None) };
}

static COLLECTED: Mutex<Option<Collected>> = Mutex::new(None);

fn with<T>(work: impl FnOnce(&mut Option<Collected>) -> T) -> T {
    work(&mut COLLECTED.lock().unwrap_or_else(PoisonError::into_inner))
}

/// While this lives, warnings are collected; those that are left are printed at its end.
pub struct Collecting(());

/// Collects warnings from here on.
#[must_use]
pub fn collect() -> Collecting {
    with(|all| *all = Some(Collected::default()));
    Collecting(())
}

impl Collecting {
    /// Prints the warnings collected so far; they are not printed again.
    pub fn tell(&self) {
        with(|all| all.iter_mut().flat_map(Collected::lines).collect::<Vec<_>>())
            .iter()
            .for_each(|line| eprintln!("{line}"));
    }
}

impl Drop for Collecting {
    fn drop(&mut self) {
        self.tell();
        with(|all| *all = None);
    }
}

/// While this lives, log lines of this thread belong to one run.
pub struct OfRun(());

/// Log lines of this thread from here on belong to the run of that name.
#[must_use]
pub fn of_run(name: &str) -> OfRun {
    with(|all| all.iter_mut().for_each(|all| all.begin(name)));
    RUN.set(Some(name.to_owned()));
    OfRun(())
}

impl Drop for OfRun {
    fn drop(&mut self) {
        RUN.set(None);
    }
}

/// Warnings with the runs that they hold for.
#[derive(Debug, Default)]
struct Collected {
    runs: Vec<String>,
    warnings: Vec<Warning>,
}

#[derive(Debug)]
struct Warning {
    line: String,
    runs: Vec<String>,
    told: bool,
}

/// Most names of runs behind a warning.
const NAMES: usize = 4;

impl Collected {
    fn begin(&mut self, run: &str) {
        if !self.runs.iter().any(|known| known == run) {
            self.runs.push(run.to_owned());
        }
    }

    fn add(&mut self, line: &str, run: &Option<String>) {
        let index = self.warnings.iter().position(|w| w.line == line).unwrap_or_else(|| {
            self.warnings.push(Warning { line: line.to_owned(), runs: Vec::new(), told: false });
            self.warnings.len() - 1
        });
        let warning = &mut self.warnings[index];
        if let Some(run) = run.as_ref().filter(|run| !warning.runs.contains(run)) {
            warning.runs.push(run.clone());
        }
    }

    /// Warnings that were not printed yet, each with its runs.
    fn lines(&mut self) -> Vec<String> {
        let all = self.runs.len();
        let untold = self.warnings.iter_mut().filter(|w| !w.told);
        let line = |w: &mut Warning| {
            w.told = true;
            w.line.clone() + &of_runs(&w.runs, all)
        };
        untold.map(line).collect()
    }
}

fn of_runs(runs: &[String], all: usize) -> String {
    match runs.len() {
        0 => String::new(),
        _ if all == 1 => String::new(),
        n if n == all => format!(" (all {all} runs)"),
        n if n > NAMES => {
            format!(" ({n} of {all} runs: {} and {} more)", runs[..NAMES].join("; "), n - NAMES)
        }
        n => format!(" ({n} of {all} runs: {})", runs.join("; ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_warning_is_told_once_with_its_runs() {
        let mut all = Collected::default();
        for run in ["a", "b", "a"] {
            all.begin(run);
            all.add("warning: narrow", &Some(run.into()));
        }
        all.add("warning: deep", &Some("b".into()));
        all.add("warning: old", &None);
        let told = ["warning: narrow (all 2 runs)", "warning: deep (1 of 2 runs: b)", "warning: old"];
        assert_eq!(all.lines(), told);
        all.add("warning: deep", &Some("a".into()));
        assert!(all.lines().is_empty());
        assert_eq!(of_runs(&["a"; 6].map(String::from), 9), " (6 of 9 runs: a; a; a; a and 2 more)");
    }
}
