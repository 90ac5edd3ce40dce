//! The testbeds of a batch and the threads that step them; nothing here knows Python.

use crate::errors::{Refusal, Refused};
use crate::lock::locked;
use crate::run::Run;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::{Duration, Instant};
use terraglue::scenario::Scenario;

/// Wall time after which Python checks for signals such as Ctrl-C.
const SLICE: Duration = Duration::from_millis(50);

/// A testbed that is to be built.
pub struct Plan {
    pub scenario: Scenario,
    /// Folder of its recording.
    pub out: Option<PathBuf>,
}

/// One of the testbeds.
pub struct Member {
    plan: Plan,
    pub run: Option<Run>,
    /// Why it stopped.
    pub failed: Option<String>,
    /// Why it could not be built.
    pub refusal: Option<terraglue::Error>,
    /// The scenario that it is to be built of.
    wanted: Option<Scenario>,
}

impl Member {
    /// The run, where it has not failed.
    pub fn alive(&mut self) -> Option<&mut Run> {
        self.run.as_mut().filter(|_| self.failed.is_none())
    }

    /// Steps towards a time for a slice; whether there is nothing left to do.
    fn step_towards(&mut self, until_s: f64) -> bool {
        let Some(run) = self.alive() else { return true };
        let stepped = catch_unwind(AssertUnwindSafe(|| run.run_until(until_s, SLICE)));
        let why = match stepped {
            Ok(Ok(done)) => return done,
            Ok(Err(error)) => error.to_string(),
            Err(_) => "a defect of terraglue stopped it; its message stands on standard error".to_owned(),
        };
        self.failed = Some(why);
        true
    }

    /// Builds what is wanted; after a refusal everything is as before.
    fn build(&mut self, modules: &[PathBuf]) {
        let Some(scenario) = self.wanted.take() else { return };
        let built = Run::new(scenario.clone(), 1, modules, self.plan.out.as_deref());
        let swapped = built.and_then(|run| self.run.replace(run).map_or(Ok(None), Run::finish));
        match swapped {
            Ok(_) => (self.plan.scenario, self.failed) = (scenario, None),
            Err(error) => self.refusal = Some(error),
        }
    }
}

/// All of them.
pub struct Members {
    all: Vec<Mutex<Member>>,
    threads: usize,
    modules: Vec<PathBuf>,
}

impl Members {
    /// None of them is built yet. `threads` = 0: as many as there are cores.
    pub fn new(plans: Vec<Plan>, threads: usize, modules: Vec<PathBuf>) -> Self {
        let threads = match threads {
            0 => std::thread::available_parallelism().map_or(1, usize::from),
            given => given,
        };
        let member = |plan: Plan| {
            let wanted = Some(plan.scenario.clone());
            Mutex::new(Member { plan, run: None, failed: None, refusal: None, wanted })
        };
        Self { all: plans.into_iter().map(member).collect(), threads, modules }
    }

    pub fn len(&self) -> usize {
        self.all.len()
    }

    /// Does something with each, one after the other.
    pub fn map<T>(&self, work: impl Fn(usize, &mut Member) -> T) -> Vec<T> {
        self.all.iter().enumerate().map(|(k, member)| work(k, &mut locked(member))).collect()
    }

    /// Does something with the first that has a run.
    pub fn first<T>(&self, work: impl FnOnce(&Run) -> T) -> Option<T> {
        let member = self.all.iter().map(locked).find(|member| member.run.is_some())?;
        member.run.as_ref().map(work)
    }

    /// Does something with each on all threads, where `wanted` says so; each by the first thread that is free.
    fn each(&self, wanted: impl Fn() -> bool + Sync, work: impl Fn(usize, &mut Member) + Sync) {
        let next = AtomicUsize::new(0);
        let one = || {
            while wanted() {
                let k = next.fetch_add(1, Ordering::Relaxed);
                let Some(member) = self.all.get(k) else { return };
                work(k, &mut locked(member));
            }
        };
        std::thread::scope(|scope| {
            for _ in 1..self.threads.clamp(1, self.all.len().max(1)) {
                // where no thread can be had, this one does it all
                let _ = std::thread::Builder::new().spawn_scoped(scope, one);
            }
            one();
        });
    }

    /// Steps each towards its time for a slice; whether all are there.
    pub fn step_towards(&self, until_s: &[f64]) -> bool {
        let there = AtomicBool::new(true);
        self.each(
            || true,
            |k, member| {
                if !member.step_towards(until_s[k]) {
                    there.store(false, Ordering::Relaxed);
                }
            },
        );
        there.load(Ordering::Relaxed)
    }

    /// Builds those that are planned, begins no more of them after a slice; whether all are built.
    pub fn build(&self) -> bool {
        let begin = Instant::now();
        let in_time = || begin.elapsed() < SLICE;
        self.each(in_time, |_, member| member.build(&self.modules));
        self.all.iter().all(|member| locked(member).wanted.is_none())
    }

    /// Builds none of those that are planned.
    pub fn forget(&self) {
        self.all.iter().for_each(|member| locked(member).wanted = None);
    }

    /// Plans some of them anew, with further edits of their scenarios; after a refusal none.
    pub fn plan_again(&self, which: &[usize], edits: &[Vec<(String, String)>]) -> Refused {
        let mut plans = Vec::with_capacity(which.len());
        for (k, edits) in which.iter().zip(edits) {
            let member = locked(&self.all[*k]);
            if member.plan.out.is_some() {
                let message = "a batch that is recorded cannot start one again: leave `out` away";
                return Err(Refusal::Input(message.into()));
            }
            let edited = member
                .plan
                .scenario
                .edited(edits)
                .map_err(|e| Refusal::Failed(terraglue::Error::Input(e)))?;
            plans.push((*k, edited));
        }
        for (k, scenario) in plans {
            locked(&self.all[k]).wanted = Some(scenario);
        }
        Ok(())
    }
}
