//! Runs the tests, each in a process of its own, several at a time, each with a time limit.

use super::catalogue::catalogue;
use super::check_file::CheckFile;
use super::definition::Test;
use super::finding::{Finding, Outcome};
use super::options::Options;
use super::report::{Report, TestResult};
use super::scope::Area;
use super::{Level, unknown};
use serde::{Deserialize, Serialize};
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus};
use std::time::{Duration, Instant};
use terraglue_host::isolation::ForkServer;
use terraglue_subsystem::Kind;

/// Content of the result file that the process of a test writes.
#[derive(Serialize, Deserialize)]
pub struct Told {
    /// How it ended.
    pub outcome: Outcome,
    /// Kind of the module, as far as it could be loaded.
    pub kind: Option<Kind>,
    /// Problem of the given parameters, known once the module has declared its own.
    #[serde(default)]
    pub wrong_set: Option<String>,
}

/// Puts a module to the test.
///
/// # Errors
/// A test of this name does not exist, a given parameter is none of the module's or out of its range, the file beside the module is wrong, or a process cannot be started.
pub fn check(module: &Path, options: &Options) -> Result<Report, String> {
    let beside = CheckFile::beside(module)?;
    let names = options.only.iter().chain(beside.off.iter().map(|(name, _)| name));
    if let Some(name) = names.into_iter().find(|n| !catalogue().iter().any(|t| t.name == n.as_str())) {
        return Err(unknown(name, catalogue()));
    }
    let folder = tempfile::tempdir().map_err(|e| format!("no folder for results: {e}"))?;
    let python = terraglue_host::is_python(module).then(|| terraglue_host::interpreter(None, Path::new(".")));
    // Without it the workers are started one by one, and say what is wrong with the interpreter.
    let fork_server = python.and_then(|python| ForkServer::open(&python).ok());
    let fixture = Supervisor { module, options, folder: folder.path(), fork_server };
    let mut report = Report::new(module, options);
    // Which tests are for it is known only when it has been loaded, and that may end a process.
    let first = &catalogue()[0];
    let kind = fixture.alone(first, &mut report)?;
    let told = std::fs::read_to_string(fixture.file(first, "json")).unwrap_or_default();
    if let Some(wrong) = serde_json::from_str::<Told>(&told).ok().and_then(|told| told.wrong_set) {
        return Err(wrong);
    }
    let mut waiting: Vec<&Test> = catalogue().iter().skip(1).filter(|t| wanted(t, kind, options)).collect();
    if !options.only.is_empty() && !options.only.iter().any(|n| n == first.name) {
        report.rows.clear();
    }
    waiting.retain(|test| match beside.off.iter().find(|(name, _)| name == test.name) {
        None => true,
        Some((_, reason)) => {
            report.rows.push(TestResult::new(test, Outcome::Off { reason: reason.clone() }, 0.0));
            false
        }
    });
    fixture.all(waiting, &mut report)?;
    report.sort();
    Ok(report)
}

fn wanted(test: &Test, kind: Option<Kind>, options: &Options) -> bool {
    let for_it = match kind {
        Some(Kind::Law) => for_law(test),
        _ => test.kinds.is_empty() || kind.is_none_or(|k| test.kinds.contains(&k)),
    };
    if options.only.is_empty() {
        let level =
            if kind == Some(Kind::Law) && BLIND.contains(&test.name) { Level::Standard } else { test.level };
        return for_it && level <= options.level;
    }
    for_it && options.only.iter().any(|n| n == test.name)
}

/// Tests of soils and of all modules that a law, stepped inside a soil, can break.
const IN_A_SOIL: [&str; 8] = [
    "instantiates",
    "steps",
    "trials-invisible",
    "save-restore",
    "jacobian-soil",
    "jacobian-force",
    "no-allocation",
    "four-threads",
];

/// Symmetries of the soil that takes a law. The law itself receives no place and no direction, so it breaks them only by
/// inputs that it should not read, and these tests are not among the quick ones.
const BLIND: [&str; 6] = ["translation", "height", "quarter-turn", "any-turn", "port-frame", "far-feet"];

/// Whether a test is one for laws: their own, those of any library, and the physics of the soil that takes the law.
fn for_law(test: &Test) -> bool {
    let physics =
        test.area == Area::Physics && test.level == Level::Quick && test.kinds.contains(&Kind::Soil);
    let any = test.kinds.is_empty() && test.area == Area::Library;
    test.kinds.contains(&Kind::Law) || any || physics || IN_A_SOIL.contains(&test.name)
}

struct Supervisor<'a> {
    module: &'a Path,
    options: &'a Options,
    folder: &'a Path,
    /// Where the workers of a module in Python come from.
    fork_server: Option<ForkServer>,
}

/// A test that runs.
struct Running<'a> {
    test: &'a Test,
    process: Child,
    since: Instant,
    looked: Instant,
    /// Time in which this program could see it run: a machine that sleeps, or stops both, makes no test hang.
    seen: Duration,
}

/// The longest time between two looks at a test that counts.
const BLINK: Duration = Duration::from_millis(100);

impl Running<'_> {
    /// Time that it has had, s, without the time that it waited for a processor on a busy machine.
    fn spent_s(&mut self, limit_s: f64) -> f64 {
        let now = Instant::now();
        self.seen += (now - self.looked).min(BLINK);
        self.looked = now;
        let seen = self.seen.as_secs_f64();
        if seen < limit_s { seen } else { seen - self.in_line_s() }
    }

    /// How long the process waited for a processor, s; 0 where the system does not report it.
    fn in_line_s(&self) -> f64 {
        let text = std::fs::read_to_string(format!("/proc/{}/schedstat", self.process.id()));
        let waited = text.ok().and_then(|t| t.split_whitespace().nth(1)?.parse::<f64>().ok());
        1e-9 * waited.unwrap_or_default()
    }
}

impl Supervisor<'_> {
    fn alone(&self, test: &Test, report: &mut Report) -> Result<Option<Kind>, String> {
        let mut running = self.start(test)?;
        loop {
            if let Some((outcome, kind)) = self.ended(&mut running)? {
                report.rows.push(TestResult::new(test, outcome, running.since.elapsed().as_secs_f64()));
                return Ok(kind);
            }
            std::thread::sleep(Duration::from_millis(2));
        }
    }

    fn all(&self, mut waiting: Vec<&Test>, report: &mut Report) -> Result<(), String> {
        let mut running: Vec<Running> = Vec::new();
        while !waiting.is_empty() || !running.is_empty() {
            let mut k = 0;
            while k < running.len() {
                match self.ended(&mut running[k])? {
                    None => k += 1,
                    Some((outcome, _)) => {
                        let done = running.swap_remove(k);
                        report.rows.push(TestResult::new(
                            done.test,
                            outcome,
                            done.since.elapsed().as_secs_f64(),
                        ));
                    }
                }
            }
            // A test is ready when what it builds on has ended; a broken one blocks it.
            let mut k = 0;
            while k < waiting.len() {
                let test = waiting[k];
                let pending = |name: &&str| {
                    waiting.iter().any(|t| t.name == *name) || running.iter().any(|r| r.test.name == *name)
                };
                if test.after.iter().any(pending) {
                    k += 1;
                } else if let Some(by) = report.blocker(test) {
                    report.rows.push(TestResult::new(test, Outcome::Blocked { by }, 0.0));
                    waiting.remove(k);
                } else if running.len() < self.options.jobs.max(1) {
                    running.push(self.start(test)?);
                    waiting.remove(k);
                } else {
                    k += 1;
                }
            }
            std::thread::sleep(Duration::from_millis(2));
        }
        Ok(())
    }

    fn file(&self, test: &Test, end: &str) -> PathBuf {
        self.folder.join(format!("{}.{end}", test.name))
    }

    fn start<'t>(&self, test: &'t Test) -> Result<Running<'t>, String> {
        let options = self.options;
        let file = |end: &str| {
            std::fs::File::create(self.file(test, end))
                .map_err(|e| format!("no file for the output of a test: {e}"))
        };
        let mut command = Command::new(&options.program);
        command.arg("check-module").arg(self.module).args(["--in-process", "--only", test.name]);
        command.args(["--level", options.level.word(), "--seed", &options.seed.to_string()]);
        for (key, value) in &options.sets {
            command.arg("--set").arg(format!("{key}={value}"));
        }
        command.arg("--result").arg(self.file(test, "json")).env_remove("TERRAGLUE_LOG");
        // Without the allocator's caches per thread, what is freed counts as free.
        command.env("GLIBC_TUNABLES", "glibc.malloc.tcache_count=0");
        command.envs(self.fork_server.as_ref().map(ForkServer::variable));
        for (key, value) in &options.environment {
            command.env(key, value.replace("{test}", test.name));
        }
        command.stdin(std::process::Stdio::null()).stdout(file("out")?).stderr(file("err")?);
        let process =
            command.spawn().map_err(|e| format!("{} cannot be started: {e}", options.program.display()))?;
        let now = Instant::now();
        Ok(Running { test, process, since: now, looked: now, seen: Duration::ZERO })
    }

    /// How a running test has ended; None: it still runs.
    fn ended(&self, running: &mut Running) -> Result<Option<(Outcome, Option<Kind>)>, String> {
        let state = running.process.try_wait().map_err(|e| format!("a test cannot be watched: {e}"))?;
        let Some(status) = state else {
            let limit_s = self.options.limit_s;
            if running.spent_s(limit_s) < limit_s {
                return Ok(None);
            }
            // It may have ended meanwhile; then there is nothing to end.
            let _ = running.process.kill();
            let _ = running.process.wait();
            return Ok(Some((Outcome::Hang { limit_s }, None)));
        };
        let text = std::fs::read_to_string(self.file(running.test, "json")).unwrap_or_default();
        let told: Option<Told> = serde_json::from_str(&text).ok();
        let Some(told) = told else {
            return Ok(Some((Outcome::Crash { how: self.how(running.test, status) }, None)));
        };
        let outcome = match told.outcome {
            Outcome::Pass if running.test.name == super::areas::OUTPUT => self.printed(running.test),
            other => other,
        };
        Ok(Some((outcome, told.kind)))
    }

    /// The end of a process that wrote no result.
    fn how(&self, test: &Test, status: ExitStatus) -> String {
        let end = match (status.signal(), status.code()) {
            (Some(11), _) => "segmentation fault (signal 11)".to_owned(),
            (Some(6), _) => "abort (signal 6)".to_owned(),
            (Some(8), _) => "arithmetic fault (signal 8)".to_owned(),
            (Some(4), _) => "illegal instruction (signal 4)".to_owned(),
            (Some(7), _) => "bus error (signal 7)".to_owned(),
            (Some(signal), _) => format!("signal {signal}"),
            (None, code) => format!("it ended the process with exit code {}", code.unwrap_or_default()),
        };
        let last = self.output(test, "err").lines().rev().find(|l| !l.trim().is_empty()).map(str::to_owned);
        last.map_or(end.clone(), |line| format!("{end}; its last words: {line}"))
    }

    fn output(&self, test: &Test, end: &str) -> String {
        let bytes = std::fs::read(self.file(test, end)).unwrap_or_default();
        String::from_utf8_lossy(&bytes).into_owned()
    }

    fn printed(&self, test: &Test) -> Outcome {
        for (end, stream) in [("out", "standard output"), ("err", "standard error")] {
            let text = self.output(test, end);
            if let Some(line) = text.lines().next() {
                let finding = Finding {
                    call: "a run of 60 steps".into(),
                    given: "usual motions".into(),
                    got: format!("{} lines on {stream}, the first: {line}", text.lines().count()),
                    expected: "nothing printed; a line for people goes through host->log".into(),
                };
                return Outcome::Fail { finding };
            }
        }
        Outcome::Pass
    }
}
