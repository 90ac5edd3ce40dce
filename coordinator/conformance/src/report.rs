//! The results of a check: for people, as JSON and as JUnit's XML.

use super::catalogue::catalogue;
use super::definition::Test;
use super::finding::Outcome;
use super::options::Options;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Result of one test.
#[derive(Clone, Debug, serde::Serialize)]
pub struct TestResult {
    /// Name of the test.
    pub test: &'static str,
    /// Its area.
    pub area: &'static str,
    /// The promise that it tests.
    pub promise: &'static str,
    /// How it ended.
    #[serde(flatten)]
    pub outcome: Outcome,
    /// Time of its process, s.
    pub time_s: f64,
    /// Command that repeats it, where it is broken.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub repeat: Option<String>,
}

impl TestResult {
    /// Of a test.
    pub fn new(test: &Test, outcome: Outcome, time_s: f64) -> Self {
        Self {
            test: test.name,
            area: test.area.title(),
            promise: test.promise,
            outcome,
            time_s,
            repeat: None,
        }
    }
}

/// Results of all tests.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Report {
    /// The module.
    pub module: PathBuf,
    /// Level in words.
    pub level: &'static str,
    /// Seed.
    pub seed: u64,
    /// Results in the order of the catalogue.
    pub rows: Vec<TestResult>,
    #[serde(skip)]
    program: PathBuf,
    #[serde(skip)]
    sets: Vec<(String, String)>,
}

impl Report {
    /// Empty.
    pub fn new(module: &Path, options: &Options) -> Self {
        Self {
            module: module.to_owned(),
            level: options.level.word(),
            seed: options.seed,
            rows: Vec::new(),
            program: options.program.clone(),
            sets: options.sets.clone(),
        }
    }

    /// The first test below this one that is broken.
    pub(super) fn blocker(&self, test: &Test) -> Option<String> {
        let row = |name: &str| self.rows.iter().find(|r| r.test == name);
        test.after.iter().filter_map(|name| row(name)).find(|r| !r.outcome.carries_on()).map(|r| {
            match &r.outcome {
                // The root of the trouble, not the next link.
                Outcome::Blocked { by } => by.clone(),
                _ => r.test.to_owned(),
            }
        })
    }

    pub(super) fn sort(&mut self) {
        let place = |name: &str| catalogue().iter().position(|t| t.name == name);
        let area = |title: &str| catalogue().iter().position(|t| t.area.title() == title);
        self.rows.sort_by_key(|r| (area(r.area), place(r.test)));
        let sets: String = self.sets.iter().map(|(k, v)| format!(" --set {k}={v}")).collect();
        let (program, module) = (self.program.display(), self.module.display());
        let (level, seed) = (self.level, self.seed);
        for row in self.rows.iter_mut().filter(|r| r.outcome.is_broken()) {
            let test = row.test;
            row.repeat = Some(format!(
                "{program} check-module {module} --only {test} --level {level} --seed {seed}{sets} --in-process"
            ));
        }
    }

    /// Whether no promise is broken.
    pub fn is_good(&self) -> bool {
        !self.rows.iter().any(|r| r.outcome.is_broken())
    }

    /// How many ended in this way.
    pub fn count(&self, word: &str) -> usize {
        self.rows.iter().filter(|r| r.outcome.word() == word).count()
    }

    /// Names of the tests that are broken.
    pub fn broken(&self) -> Vec<&'static str> {
        self.rows.iter().filter(|r| r.outcome.is_broken()).map(|r| r.test).collect()
    }

    /// One line: how many ended how.
    pub fn summary(&self) -> String {
        let words = ["pass", "fail", "crash", "hang", "blocked", "warning", "skip", "off"];
        let counts = words.iter().map(|w| (self.count(w), w)).filter(|(n, _)| *n > 0);
        counts.map(|(n, w)| format!("{n} {w}")).collect::<Vec<_>>().join(", ")
    }

    /// For people: a line per test below its area, what was found below that, and the summary.
    pub fn text(&self) -> String {
        let mut out = String::new();
        let mut area = "";
        for row in self.rows.iter().filter(|r| r.outcome.word() != "blocked") {
            if row.area != area {
                area = row.area;
                let _ = writeln!(out, "{}{area}", if out.is_empty() { "" } else { "\n" });
            }
            let _ = writeln!(
                out,
                "  {:<8} {:<24} {:>6.2} s  {}",
                row.outcome.word(),
                row.test,
                row.time_s,
                row.promise
            );
            details(row, &mut out);
        }
        let mut roots: Vec<&str> = self.rows.iter().filter_map(|r| r.outcome.blocked_by()).collect();
        roots.dedup();
        for (k, root) in roots.iter().enumerate().filter(|(k, root)| !roots[..*k].contains(root)) {
            let names: Vec<&str> =
                self.rows.iter().filter(|r| r.outcome.blocked_by() == Some(*root)).map(|r| r.test).collect();
            let gap = if k == 0 { "\n" } else { "" };
            let _ = writeln!(out, "{gap}blocked by {root}: {}", names.join(", "));
        }
        let _ = writeln!(out, "\n{}: {}", self.module.display(), self.summary());
        out
    }

    /// As JSON.
    pub fn json(&self) -> String {
        serde_json::to_string_pretty(self).unwrap_or_default()
    }

    /// As the XML that continuous integration reads.
    pub fn junit(&self) -> String {
        let mut out = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
        let skipped =
            self.rows.iter().filter(|r| matches!(r.outcome.word(), "skip" | "blocked" | "off")).count();
        let errors = self.count("crash") + self.count("hang");
        let _ = writeln!(
            out,
            "<testsuite name=\"{}\" tests=\"{}\" failures=\"{}\" errors=\"{errors}\" skipped=\"{skipped}\">",
            escaped(&self.module.display().to_string()),
            self.rows.len(),
            self.count("fail"),
        );
        for row in &self.rows {
            let detail = escaped(&row.outcome.detail());
            let inner = match row.outcome.word() {
                "fail" => format!("<failure message=\"{detail}\"/>"),
                "crash" | "hang" => format!("<error message=\"{detail}\"/>"),
                "skip" | "blocked" | "off" => format!("<skipped message=\"{detail}\"/>"),
                "warning" => format!("<system-out>{detail}</system-out>"),
                _ => String::new(),
            };
            let (area, test, time) = (row.area, row.test, row.time_s);
            let _ = writeln!(
                out,
                "  <testcase classname=\"{area}\" name=\"{test}\" time=\"{time:.3}\">{inner}</testcase>"
            );
        }
        out + "</testsuite>\n"
    }
}

fn details(row: &TestResult, out: &mut String) {
    let mut line = |what: &str, text: &str| {
        let _ = writeln!(out, "           {what:<9} {text}");
    };
    match &row.outcome {
        Outcome::Pass => {}
        Outcome::Fail { finding } => {
            line("call", &finding.call);
            line("given", &finding.given);
            line("got", &finding.got);
            line("expected", &finding.expected);
        }
        other => line("", &other.detail()),
    }
    if let Some(repeat) = &row.repeat {
        line("repeat", repeat);
    }
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
