//! The same run in another process, with another environment.

use super::finding::{Stop, Verdict};
use super::fixture::Runner;
use super::test_context::TestContext;
use std::path::Path;
use std::process::{Command, Stdio};

/// A run of the script for another process.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RemoteRun {
    /// Steps of the script.
    pub steps: std::ops::Range<usize>,
    /// Its variant.
    pub variant: u64,
    /// File with a serialized state to start from.
    pub state: Option<std::path::PathBuf>,
}

impl RemoteRun {
    /// A run from the start.
    pub fn fresh(steps: usize) -> Self {
        Self { steps: 0..steps, variant: 0, state: None }
    }

    /// As one word of a command line.
    fn word(&self) -> String {
        format!("{},{},{}", self.steps.start, self.steps.end, self.variant)
    }

    /// From the word of a command line.
    pub fn parse(word: &str, state: Option<&Path>) -> Option<Self> {
        let mut numbers = word.split(',').map(|n| n.parse::<u64>().ok());
        let mut next = || numbers.next().flatten();
        let (start, end, variant) = (next()? as usize, next()? as usize, next()?);
        Some(Self { steps: start..end, variant, state: state.map(Path::to_owned) })
    }
}

/// Does the remote run in this process: the bits of all answers, then of the committed state.
///
/// # Errors
/// The module failed.
pub fn run_remote(context: &TestContext, remote_run: &RemoteRun) -> Verdict<Vec<u64>> {
    terraglue_host::adopt_locale();
    let mut runner = Runner::new(context.instance()?)?;
    if let Some(file) = &remote_run.state {
        let bytes = std::fs::read(file).unwrap_or_default();
        // The fixture gets back to its place by going the same way with an instance of its own.
        let mut guide = Runner::new(context.instance()?)?;
        guide.run(0..remote_run.steps.start, remote_run.variant)?;
        runner.instance_mut().deserialize(&bytes)?;
        runner.put_back(&guide.place());
    }
    let mut bits = runner.run(remote_run.steps.clone(), remote_run.variant)?;
    bits.extend(super::fixture::committed(runner.instance())?);
    Ok(bits)
}

/// Sends a remote run to another process with these environment variables.
///
/// # Errors
/// There is no program to start (a skip), or that process found the module broken.
pub fn in_other_process(
    context: &TestContext,
    remote_run: &RemoteRun,
    environment: &[(&str, &str)],
) -> Verdict<Vec<u64>> {
    let lost = |why: String| Stop::Skip(format!("another process cannot be asked: {why}"));
    let program = context.program.as_ref().ok_or_else(|| lost("the program is not known".into()))?;
    let folder = tempfile::tempdir().map_err(|e| lost(e.to_string()))?;
    let result = folder.path().join("bits.json");
    let mut command = Command::new(program);
    command.arg("check-module").arg(&context.path).args(["--in-process", "--remote-run", &remote_run.word()]);
    command.args(["--seed", &context.seed.to_string()]).arg("--result").arg(&result);
    for (key, value) in &context.sets {
        command.arg("--set").arg(format!("{key}={value}"));
    }
    if let Some(state) = &remote_run.state {
        command.arg("--state").arg(state);
    }
    // In an interpreter of its own, which sees the environment from its start.
    command.env_remove(terraglue_host::isolation::FORK_SERVER).envs(environment.iter().copied());
    let done = command.stdin(Stdio::null()).output().map_err(|e| lost(e.to_string()))?;
    let text = std::fs::read_to_string(&result).unwrap_or_default();
    serde_json::from_str(&text).map_err(|_| {
        let told = String::from_utf8_lossy(&done.stderr);
        let last = told.lines().last().unwrap_or("it wrote no result").to_owned();
        Stop::fail("a run in another process", format!("{remote_run:?}"), last, "the same run as here")
    })
}
