//! Exchanges the code of subsystems while a scenario runs: `terraglue run --watch`.
//!
//! The file of a module is looked at between steps, and so are its sources where its table gives a `build` command. New
//! code is copied to a name of its own (the path of a loaded library gives the old code when it is opened again), put to
//! the quick tests of `check-module` in other processes while the old code goes on, and exchanged at the next communication
//! point. Code that cannot be built, fails a test or cannot take over the state changes nothing but a line of the log.
//!
//! Files are polled, not subscribed to: an exchange happens between two steps anyway, where a look at a few files costs
//! microseconds, and polling also sees network folders, containers, and libraries that a linker puts in place by renaming.

/// The examples of the README, which the tests compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

mod candidate;
mod sources;

use candidate::{Candidate, Preparation};
use sources::Stamp;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use terraglue_diagnostics::fingerprint;
use terraglue_diagnostics::{Error, Result};
use terraglue_engine::observer::Observer;
use terraglue_engine::testbed::{Options, Testbed};
use terraglue_host::isolation::end_group;
use terraglue_host::{HostServices, LoadError, LoadedModule, SearchPath, law};
use terraglue_scenario as scenario;
use terraglue_scenario::{Scenario, SubsystemSpec};
use terraglue_subsystem::{Kind, Schema};

/// How code is exchanged.
#[derive(Clone, Debug)]
pub struct ReloadOptions {
    /// The program `terraglue`, which runs the quick tests.
    pub program: PathBuf,
    /// Subsystems start afresh with new code, their state is not carried over.
    pub reset: bool,
    /// Before these steps a subsystem is built, tested and exchanged whether or not it has changed, and the run waits for
    /// it. Where there are any, files are not looked at.
    pub at_steps: Vec<(String, u64)>,
}

/// How often files are looked at.
const LOOK: Duration = Duration::from_millis(50);

/// Watches the modules of a scenario.
pub struct Reloader {
    scenario: Scenario,
    options: ReloadOptions,
    run: Options,
    watched: Vec<Watched>,
    next_look: Instant,
    /// Copies made so far. A name that was loaded once gives the code of that time again, also where it was refused.
    copies: u64,
    // Copies of libraries; they stay until the run has ended.
    folder: tempfile::TempDir,
}

/// Which code of a subsystem is meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Part {
    /// Its module.
    Module,
    /// The law of a soil that is a module of its own.
    Law,
}

/// Code of a subsystem that can be exchanged.
struct Watched {
    spec: SubsystemSpec,
    part: Part,
    schema: Arc<Schema>,
    file: PathBuf,
    /// Where the code in use was loaded from.
    used: PathBuf,
    /// The file and the sources when they were last looked at.
    seen: [Stamp; 2],
    /// Fingerprint of the code in use.
    hash: u64,
    /// How often it was exchanged.
    count: u64,
    job: Option<Job>,
}

/// A preparation on a thread of its own.
struct Job {
    thread: JoinHandle<std::result::Result<Option<Candidate>, String>>,
    /// Process group of the build command; 0: none.
    build: Arc<AtomicU32>,
}

impl Watched {
    fn new(scenario: &Scenario, spec: &SubsystemSpec, part: Part, module: &LoadedModule) -> Option<Self> {
        let file = module.path()?;
        let file = std::path::absolute(file).unwrap_or_else(|_| file.to_owned());
        let mut watched = Self {
            spec: spec.clone(),
            part,
            schema: Arc::new(module.schema().clone()),
            seen: [Stamp::of(&file); 2],
            hash: std::fs::read(&file).map(|b| fingerprint(&b)).unwrap_or_default(),
            used: file.clone(),
            file,
            count: 0,
            job: None,
        };
        watched.seen = watched.now(scenario);
        Some(watched)
    }

    /// `soil` or `soil.law`.
    fn name(&self) -> String {
        match self.part {
            Part::Module => self.spec.name.clone(),
            Part::Law => format!("{}.law", self.spec.name),
        }
    }

    /// The build command. Where a soil has a law of its own, that is what the scenario builds.
    fn command(&self) -> Option<&String> {
        let is_law = self.part == Part::Law;
        self.spec.build.as_ref().filter(|_| is_law == law_of(&self.spec).is_some())
    }

    /// The file and the sources as they are.
    fn now(&self, scenario: &Scenario) -> [Stamp; 2] {
        let sources = match self.command() {
            Some(_) => Stamp::of_sources(&self.spec, &scenario.folder),
            None => Stamp::default(),
        };
        [Stamp::of(&self.file), sources]
    }
}

/// The law that a scenario names below a subsystem.
fn law_of(spec: &SubsystemSpec) -> Option<&str> {
    spec.parameters.get("law")?.get("plugin")?.as_str()
}

impl Reloader {
    /// Watches every subsystem of the scenario that is a module from a file, and the laws of soils that are.
    ///
    /// # Errors
    /// A module is not found, or no folder for copies can be made.
    pub fn new(scenario: &Scenario, run: &Options, options: ReloadOptions) -> Result<Self> {
        let folder = tempfile::Builder::new().prefix("terraglue-reload-").tempdir();
        let folder = folder.map_err(|source| Error::File { path: "a temporary folder".into(), source })?;
        let mut watched = Vec::new();
        for spec in scenario.subsystems.iter().filter(|s| !s.is_fmu()) {
            let module = terraglue_engine::testbed::find(scenario, spec, run, &terraglue_fmu::library())?;
            watched.extend(Watched::new(scenario, spec, Part::Module, &module));
            if let Some(name) = law_of(spec) {
                let search = SearchPath::standard(&run.module_paths, &scenario.folder);
                let plain = |e: LoadError| scenario::InputError::plain(e.to_string(), None);
                let path = law::locate(name, &search, &scenario.folder).map_err(plain)?;
                let module = LoadedModule::load(&path).map_err(plain)?;
                watched.extend(Watched::new(scenario, spec, Part::Law, &module));
            }
        }
        let (scenario, run) = (scenario.clone(), run.clone());
        Ok(Self { scenario, options, run, watched, next_look: Instant::now(), copies: 0, folder })
    }

    /// As [`Testbed::run_until`], with a look at the files between steps.
    ///
    /// # Errors
    /// Those of the run; nothing that happens to new code is one.
    pub fn run_until(
        &mut self,
        testbed: &mut Testbed,
        until_s: f64,
        observers: &mut [&mut dyn Observer],
    ) -> Result {
        let step_s = self.scenario.time.step_s;
        while until_s - testbed.t_s() > 1e-6 * step_s && !testbed.cancelled() {
            self.between_steps(testbed);
            testbed.run_until((testbed.t_s() + step_s).min(until_s), observers)?;
        }
        Ok(())
    }

    /// Takes over what is ready, and prepares what has changed.
    fn between_steps(&mut self, testbed: &mut Testbed) {
        let is_due = |w: &Watched| {
            let step = testbed.step_index();
            self.options.at_steps.iter().any(|(name, at)| *name == w.name() && *at == step)
        };
        let due: Vec<usize> = (0..self.watched.len()).filter(|k| is_due(&self.watched[*k])).collect();
        for k in due {
            let ready = self.preparation(k, true).run();
            self.take_over(k, ready, testbed);
        }
        for k in 0..self.watched.len() {
            if self.watched[k].job.as_ref().is_some_and(|j| j.thread.is_finished())
                && let Some(job) = self.watched[k].job.take()
            {
                let ready = job.thread.join().unwrap_or_else(|_| Err("its preparation panicked".into()));
                self.take_over(k, ready, testbed);
            }
        }
        let now = Instant::now();
        if self.options.at_steps.is_empty() && now >= self.next_look {
            self.next_look = now + LOOK;
            self.look();
        }
    }

    /// Starts the preparation of what has changed.
    fn look(&mut self) {
        for k in 0..self.watched.len() {
            let w = &mut self.watched[k];
            if w.job.is_some() {
                continue;
            }
            let now = w.now(&self.scenario);
            let builds = now[1] != w.seen[1];
            if now == w.seen || !builds && now[0].is_missing() {
                continue;
            }
            w.seen = now;
            let preparation = self.preparation(k, builds);
            let build = preparation.build.clone();
            let thread = std::thread::Builder::new().name("terraglue reload".into());
            // Without a thread it is tried again at the next change.
            let started = thread.spawn(move || preparation.run().map(|c| c.filter(|c| c.is_new))).ok();
            self.watched[k].job = started.map(|thread| Job { thread, build });
        }
    }

    fn preparation(&mut self, k: usize, builds: bool) -> Preparation {
        self.copies += 1;
        let w = &self.watched[k];
        Preparation {
            folder: self.scenario.folder.clone(),
            command: w.command().cloned().filter(|_| builds),
            build: Arc::default(),
            file: w.file.clone(),
            hash: w.hash,
            copy: self.folder.path().join(format!("{}-{}", w.name(), self.copies)),
            program: self.options.program.clone(),
            sets: self.parameters(w),
        }
    }

    /// The parameters of the subsystem for the tests; paths as the tests find them. Of a law its numbers.
    fn parameters(&self, w: &Watched) -> Vec<(String, String)> {
        let soil = self.watched.iter().find(|m| m.part == Part::Module && m.spec.name == w.spec.name);
        if let (Part::Law, Some(soil)) = (w.part, soil) {
            let config = scenario::check_parameters(&soil.schema, &w.spec, &self.scenario.source);
            let numbers = config.ok().and_then(|config| law::numbers(&w.schema, &config).ok());
            let names = w.schema.parameters.iter().map(|p| p.name.clone());
            return names.zip(numbers.into_iter().flatten().map(|x| x.to_string())).collect();
        }
        let config = scenario::check_parameters(&w.schema, &w.spec, &self.scenario.source);
        let text = config.map(|c| c.to_json()).unwrap_or_default();
        let Ok(serde_json::Value::Object(map)) = serde_json::from_str(&text) else { return Vec::new() };
        let is_path = |name: &str| {
            let found = w.schema.parameters.iter().find(|p| p.name == name);
            found.is_some_and(|p| p.parameter_type == terraglue_subsystem::ParameterType::Path)
        };
        let folder = std::path::absolute(&self.scenario.folder).unwrap_or_default();
        map.into_iter()
            .map(|(key, value)| match value.as_str().filter(|_| is_path(&key)) {
                Some(path) => (key, folder.join(path).display().to_string()),
                None => (key, value.to_string()),
            })
            .collect()
    }

    /// Puts prepared code in the place of the old one, or says why not.
    fn take_over(
        &mut self,
        k: usize,
        ready: std::result::Result<Option<Candidate>, String>,
        testbed: &mut Testbed,
    ) {
        let name = self.watched[k].name();
        // The file that the build command has written is known now.
        self.watched[k].seen[0] = Stamp::of(&self.watched[k].file);
        let done = match ready {
            Ok(None) => return,
            Ok(Some(candidate)) => self.exchange(k, &candidate, testbed),
            Err(why) => Err(why),
        };
        match done {
            Ok(told) => testbed.note(told),
            Err(why) => {
                let first = why.lines().next().unwrap_or_default();
                testbed.note(format!("reload {name} refused, the old code goes on: {first}"));
                log::warn!("reload of `{name}` refused, the old code goes on: {why}");
            }
        }
    }

    fn exchange(
        &mut self,
        k: usize,
        new: &Candidate,
        testbed: &mut Testbed,
    ) -> std::result::Result<String, String> {
        let w = &self.watched[k];
        // The other part of the subsystem stays what it is.
        let used = |part: Part| {
            let other = self.watched.iter().find(|o| o.spec.name == w.spec.name && o.part == part);
            if w.part == part { Some(&new.path) } else { other.map(|o| &o.used) }
        };
        let path = used(Part::Module).ok_or("its module is not from a file")?;
        let module = LoadedModule::load(path).map_err(|e| e.to_string())?;
        let config = scenario::check_parameters(module.schema(), &w.spec, &self.scenario.source)
            .map_err(|e| e.to_string())?;
        let config = match used(Part::Law) {
            None => config,
            Some(path) => {
                let search = SearchPath::only(Vec::new());
                let config = config.with(law::KEY, path.to_string_lossy().as_ref());
                let done = terraglue_engine::testbed::with_law(config, &search, &self.scenario, &w.spec);
                done.map_err(|e| e.to_string())?
            }
        };
        let schema = match w.part {
            Part::Module => Arc::new(module.schema().clone()),
            Part::Law => {
                let law = LoadedModule::load(&new.path).map_err(|e| e.to_string())?;
                Arc::new(law.schema().clone())
            }
        };
        let ground = module.schema().kind == Kind::Soil;
        let services = terraglue_engine::testbed::services(&self.scenario, &self.run, ground);
        let services = services.map_err(|e| e.to_string())?;
        let services = HostServices { teardown_errors: testbed.teardown_errors(), ..services };
        let made = terraglue_engine::testbed::make(&self.scenario, &w.spec, module, config, &services);
        let made = made.map_err(|e| e.to_string())?;
        let earlier: u64 = self.watched.iter().filter(|o| o.spec.name == w.spec.name).map(|o| o.count).sum();
        let carried = testbed.exchange(made, self.options.reset, earlier + 1)?;
        let state = match carried {
            Some(bytes) => format!("state of {bytes} bytes carried over"),
            None => "started afresh".into(),
        };
        let told = format!("reload {}: {:016x} to {:016x}, {state}", w.name(), w.hash, new.hash);
        let w = &mut self.watched[k];
        (w.hash, w.schema, w.count) = (new.hash, schema, w.count + 1);
        w.used.clone_from(&new.path);
        Ok(told)
    }
}

impl Drop for Reloader {
    fn drop(&mut self) {
        for job in self.watched.iter_mut().filter_map(|w| w.job.take()) {
            end_group(job.build.load(Ordering::Relaxed));
            // Its result is not needed any more.
            drop(job.thread.join());
        }
    }
}
