//! A run that goes on after it was ended from outside: its whole state in one file beside the recording.
//!
//! [`Keeper`] writes `checkpoint.bin` while a run goes on; the file is always that of one whole state. [`Checkpoint::read`]
//! takes it up again in another process: the same scenario, the same files and modules, and then the same bytes as those of
//! a run that nothing has ended.

/// The examples of the README, which the tests compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

mod origin;
mod states;

use origin::Origin;
pub use states::States;
use std::fs::File;
use std::path::{Path, PathBuf};
use terraglue_diagnostics::{Error, Result};
use terraglue_engine::testbed::{Options, Testbed};
use terraglue_host::Instance;
use terraglue_recording::{
    CHECKPOINT, RECORDING, Recorder, RecorderOptions, RecorderState, SUMMARY, TimingRow, VARIABLES, at,
    replace,
};
use terraglue_scenario::{InputError, Scenario};
use terraglue_subsystem::bytes::{self, Block};
use terraglue_subsystem::{Capabilities, persist};

/// Version of the program with the commit that it is built from: a run goes on in the same version only.
pub const VERSION: &str = env!("TERRAGLUE_VERSION");

/// Version of the form of the file.
const FORM: u32 = 1;
/// Mark of the file: other states are sealed in the same way.
const MARK: u64 = 0x7275_6e00;

/// The state of a run at a communication point.
pub struct Checkpoint {
    origin: Origin,
    /// Simulated time between checkpoints, s.
    every_s: f64,
    csv: bool,
    t_s: f64,
    /// Wall times measured up to here.
    timing: Vec<TimingRow>,
    testbed: Block,
    recorder: RecorderState,
}
persist!(Checkpoint { origin, every_s, csv, t_s, timing, testbed, recorder });

/// State of a run that is resumed.
pub struct Resumed {
    /// Wall times measured before.
    pub timing: Vec<TimingRow>,
    options: RecorderOptions,
    recorder: RecorderState,
}

impl Checkpoint {
    /// The checkpoint of a results folder.
    ///
    /// # Errors
    /// [`Error::Input`]: there is none, or it is of another version or damaged.
    pub fn read(folder: &Path) -> Result<Self> {
        let path = folder.join(CHECKPOINT);
        if !path.exists() {
            return Err(nothing(folder));
        }
        let all = std::fs::read(&path).map_err(at(&path))?;
        bytes::open(FORM, MARK, &all).map_err(|_| {
            let message = format!("`{}` is damaged, or of another version of terraglue", path.display());
            let help = "it was written whole: go on with the program that wrote it, or start the run anew";
            InputError::plain(message, Some(help.into())).into()
        })
    }

    /// Simulated time between checkpoints, s, and whether the run writes `variables.csv`.
    pub fn kept(&self) -> (f64, bool) {
        (self.every_s, self.csv)
    }

    /// The scenario of the run, with its edits.
    ///
    /// # Errors
    /// A file that it names is gone, e.g. that of a system structure.
    pub fn scenario(&self) -> Result<Scenario> {
        self.origin.scenario()
    }

    /// Folders that the run searched for modules.
    pub fn module_paths(&self) -> Vec<PathBuf> {
        self.origin.module_paths()
    }

    /// Refuses to go on with other files or modules than those of the run; another build of the same version is warned of.
    ///
    /// # Errors
    /// [`Error::Input`] with what differs.
    pub fn check(&self, scenario: &Scenario, options: &Options) -> Result {
        self.origin.check(scenario, options)
    }

    /// Puts a testbed of the same scenario where the run was.
    ///
    /// # Errors
    /// A module that does not take its state.
    pub fn restore(self, testbed: &mut Testbed) -> Result<Resumed> {
        testbed.deserialize(&self.testbed.0)?;
        let options = RecorderOptions { csv: self.csv, checkpoints: true };
        Ok(Resumed { timing: self.timing, options, recorder: self.recorder })
    }
}

/// Why there is nothing to go on from.
fn nothing(folder: &Path) -> Error {
    let shown = folder.display();
    let summary = std::fs::read(folder.join(SUMMARY)).unwrap_or_default();
    let summary: serde_json::Value = serde_json::from_slice(&summary).unwrap_or_default();
    let done = summary["status"] == "done";
    let (message, help) = match done {
        true => (
            format!("the run in `{shown}` reached its end: there is nothing to go on with"),
            "a longer run starts anew, with --duration",
        ),
        false => (
            format!("`{shown}` holds no checkpoint"),
            "name the folder of a run that was started with --checkpoint-every and has come so far",
        ),
    };
    InputError::plain(message, Some(help.into())).into()
}

impl Resumed {
    /// The recorder as it was, in the folder of the run.
    ///
    /// # Errors
    /// Files of the recording that are not as the run has left them.
    pub fn recorder(self, folder: &Path, scenario: &Scenario, testbed: &Testbed) -> Result<Recorder> {
        testbed.view(|view| Recorder::resume(folder, scenario, self.options, view, self.recorder))
    }
}

/// Writes the checkpoints of a run.
pub struct Keeper {
    path: PathBuf,
    origin: Origin,
    every_s: f64,
    csv: bool,
    /// Time of the last checkpoint that was written, s.
    written_s: Option<f64>,
}

impl Keeper {
    /// For a run into `folder` with a checkpoint every so many seconds of simulation.
    ///
    /// # Errors
    /// [`Error::Input`] with all subsystems that cannot save their state.
    pub fn new(
        folder: &Path,
        scenario: &Scenario,
        options: &Options,
        (every_s, csv): (f64, bool),
    ) -> Result<Self> {
        let origin = Origin::of(scenario, options)?;
        remove_parts(folder);
        Ok(Self { path: folder.join(CHECKPOINT), origin, every_s, csv, written_s: None })
    }

    /// The time of the next checkpoint after t, s.
    pub fn next_s(&self, t_s: f64) -> f64 {
        let count = (t_s / self.every_s * (1.0 + 1e-9)).floor() + 1.0;
        count * self.every_s
    }

    /// Writes the state of now in place of the checkpoint before. Where there is no room for it, that one stays, and a
    /// warning says so.
    ///
    /// # Errors
    /// A module that does not give its state.
    pub fn keep(&mut self, testbed: &Testbed, recorder: &mut Recorder, timing: Vec<TimingRow>) -> Result {
        let state = Checkpoint {
            origin: self.origin.clone(),
            every_s: self.every_s,
            csv: self.csv,
            t_s: testbed.t_s(),
            timing,
            testbed: Block(testbed.serialize()?),
            recorder: testbed.view(|view| recorder.state(view))?,
        };
        let lasting = self.sync_recording();
        match lasting.and_then(|()| replace(&self.path, &bytes::seal(FORM, MARK, &state))) {
            Ok(()) => self.written_s = Some(state.t_s),
            Err(e) => {
                let left =
                    self.written_s.map_or_else(String::new, |t| format!("; that of t = {t:.3} s stays"));
                log::warn!("{}: no checkpoint at t = {:.3} s: {e}{left}", self.path.display(), state.t_s);
            }
        }
        Ok(())
    }

    /// Puts the files of the recording on the disk before the checkpoint, also where the power fails.
    fn sync_recording(&self) -> std::io::Result<()> {
        let files = if self.csv { &[RECORDING, VARIABLES][..] } else { &[RECORDING] };
        files.iter().try_for_each(|name| File::open(self.path.with_file_name(name))?.sync_data())
    }

    /// A run that has reached its end needs none.
    pub fn remove(&self) {
        if let Err(e) = std::fs::remove_file(&self.path)
            && e.kind() != std::io::ErrorKind::NotFound
        {
            log::warn!("{}: {e}", self.path.display());
        }
    }
}

/// Refuses a run whose state cannot be kept.
///
/// # Errors
/// [`Error::Input`] with all subsystems that cannot save their state.
pub fn require_states(testbed: &Testbed) -> Result {
    let cannot = |i: &&Instance| !i.capabilities().has(Capabilities::SERIALIZE);
    let name = |i: &Instance| format!("`{}` ({})", i.name(), i.module());
    let names: Vec<String> = testbed.instances().iter().filter(cannot).map(name).collect();
    let their = match names.len() {
        0 => return Ok(()),
        1 => "its state",
        _ => "their states",
    };
    let message = format!("--checkpoint-every: {} cannot save {their} as bytes", names.join(", "));
    let help = "leave the option out; an FMU needs `canSerializeFMUState`, a module in Python `self.state`, another one \
                `serialize` and `deserialize`";
    Err(InputError::plain(message, Some(help.into())).into())
}

/// Removes what is left of a checkpoint in whose middle the program was killed.
fn remove_parts(folder: &Path) {
    let is_part = |name: &str| {
        name.strip_prefix(CHECKPOINT).is_some_and(|rest| rest.starts_with('.') && rest.ends_with(".part"))
    };
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        if entry.file_name().to_str().is_some_and(is_part) {
            drop(std::fs::remove_file(entry.path()));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_of_checkpoints_alone_are_removed() {
        let folder = tempfile::tempdir().expect("folder");
        let names = ["checkpoint.bin", "checkpoint.bin.a1.part", "scan.part", "checkpoint.bin.old"];
        names.iter().for_each(|name| std::fs::write(folder.path().join(name), "").expect("written"));
        remove_parts(folder.path());
        let left = names.map(|name| folder.path().join(name).exists());
        assert_eq!(left, [true, false, true, true]);
    }

    #[test]
    fn a_file_is_replaced_whole_or_stays() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("checkpoint.bin");
        replace(&path, b"first").expect("written");
        replace(&path, b"second").expect("written");
        assert_eq!(std::fs::read(&path).expect("there"), b"second");
        // it cannot be put in its place: there is a folder
        let taken = folder.path().join("taken");
        std::fs::create_dir_all(taken.join("inner")).expect("made");
        assert!(replace(&taken, b"third").is_err());
        assert!(replace(&folder.path().join("nowhere/checkpoint.bin"), b"third").is_err());
        assert_eq!(std::fs::read_dir(folder.path()).expect("there").count(), 2, "a part is left");
    }

    #[test]
    fn a_file_that_several_write_at_once_is_whole() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("sweep.csv");
        std::thread::scope(|scope| {
            for writer in 0..4_u8 {
                let path = &path;
                scope.spawn(move || {
                    for _ in 0..50 {
                        replace(path, &[writer; 5000]).expect("written");
                        let there = std::fs::read(path).expect("there");
                        assert!(there.len() == 5000 && there.iter().all(|byte| *byte == there[0]));
                    }
                });
            }
        });
        assert_eq!(std::fs::read_dir(folder.path()).expect("there").count(), 1, "a part is left");
    }
}
