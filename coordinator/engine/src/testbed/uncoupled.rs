//! Subsystems without glue: one trial each per step, beside each other where that pays.
//!
//! Their trials see committed values only, so the order, and the thread that runs one, cannot be seen in any result.
//! Every 64th step runs one after the other under a watch: it measures what each costs, and whether threads gain.

use super::run_clock::RunClock;
use super::schedule::{Span, StepSchedule};
use super::subsystems::Subsystems;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};
use terraglue_diagnostics::Result;
use terraglue_host::{Instance, Progress, Workers};
use terraglue_subsystem::{Motion, Response, Step};

/// Steps from one that is watched to the next.
const SAMPLED: u64 = 64;
/// The first one to be watched; what is made at the first step of all is no example.
const FIRST: u64 = 1;
/// What threads must save in a step before they are woken: several times what waking costs.
const WORTH: Duration = Duration::from_micros(20);

/// Whether trials run beside each other.
pub(super) struct Uncoupled {
    workers: Arc<Workers>,
    /// What threads would have saved in the last two steps that were watched.
    saved: [Duration; 2],
}

impl Uncoupled {
    pub fn new(workers: Arc<Workers>) -> Self {
        Self { workers, saved: [Duration::ZERO; 2] }
    }

    fn pays(&self) -> bool {
        self.workers.threads() > 1 && self.saved.iter().all(|s| *s >= WORTH)
    }

    /// (3) A trial of every subsystem without glue. What discarded the step, if any.
    pub fn advance(
        &mut self,
        clock: &RunClock,
        (h, end): (f64, f64),
        subsystems: &mut Subsystems,
    ) -> Result<Option<String>> {
        let span = span(clock, h, end);
        if is_sampled(clock) {
            self.sample(&span, subsystems);
        } else if self.pays() {
            let job = |instance: &mut Instance, turn: &mut StepSchedule| {
                turn.try_alone(instance, &span, &mut nothing())
            };
            self.workers.for_each_pair(&mut subsystems.instances, &mut subsystems.schedules, &job);
        } else {
            let mut out = nothing();
            for (instance, turn) in subsystems.instances.iter_mut().zip(&mut subsystems.schedules) {
                turn.try_alone(instance, &span, &mut out);
            }
        }
        if span.broken.into_inner() { broken_trial(subsystems) } else { Ok(None) }
    }

    /// One after the other, each under a watch.
    fn sample(&mut self, span: &Span, subsystems: &mut Subsystems) {
        let (mut sum, mut longest) = (Duration::ZERO, Duration::ZERO);
        let Subsystems { instances, schedules, members } = subsystems;
        let all = instances.iter_mut().zip(schedules).zip(members);
        for ((instance, turn), member) in all.filter(|((_, turn), _)| !turn.glued) {
            let start = Instant::now();
            turn.try_alone(instance, span, &mut nothing());
            let took = start.elapsed();
            member.cost += took * SAMPLED as u32;
            sum += took;
            longest = longest.max(took);
        }
        let threads = self.workers.threads() as u32;
        let beside = longest.max(sum / threads);
        self.saved = [self.saved[1], sum - beside];
    }
}

/// A watch for a part of this step, and how many steps it stands for. Where bodies are glued every step is
/// watched; elsewhere reading the clock would cost more than the step of a cheap FMU.
pub(super) fn watch(clock: &RunClock, glued: bool) -> (Option<Instant>, u32) {
    if glued {
        return (Some(Instant::now()), 1);
    }
    (is_sampled(clock).then(Instant::now), SAMPLED as u32)
}

fn is_sampled(clock: &RunClock) -> bool {
    clock.index % SAMPLED == FIRST
}

/// The step of length h that the testbed makes now.
pub(super) fn span(clock: &RunClock, h: f64, end: f64) -> Span {
    let step = Step::free(clock.t, h, clock.index);
    Span { step, end, nominal: clock.nominal, step_s: clock.step_s, broken: AtomicBool::new(false) }
}

/// What the first trial says that did not end at t + h; all are forgotten.
#[cold]
fn broken_trial(subsystems: &mut Subsystems) -> Result<Option<String>> {
    let all = subsystems.instances.iter().zip(&mut subsystems.schedules);
    let broken: Vec<_> =
        all.filter_map(|(i, turn)| Some((i, turn.step_multiple, turn.trial.take()?))).collect();
    let Some((instance, multiple, trial)) = broken.into_iter().next() else { return Ok(None) };
    match (*trial)? {
        Progress::Complete => Ok(None),
        Progress::Early { reached_s } if multiple > 1 => {
            Err(instance.error("advance", format!("ended its long step early, at t = {reached_s} s")))
        }
        Progress::Early { .. } => Ok(Some(format!("`{}` discarded the step", instance.name()))),
    }
}

/// (5) for subsystems without glue.
pub(super) fn commit(clock: &RunClock, (h, end): (f64, f64), subsystems: &mut Subsystems) -> Result {
    let still = Motion { x: &[], v: &[] };
    let span = span(clock, h, end);
    for (instance, turn) in subsystems.instances.iter_mut().zip(&subsystems.schedules) {
        let committed = turn.own_step(&span, |step| instance.commit(step, &[], &still));
        if let Some(Err(error)) = committed {
            return Err(error);
        }
    }
    Ok(())
}

/// What a subsystem without ports answers.
fn nothing() -> Response<'static> {
    Response { x: &mut [], v: &mut [], a: &mut [], t: &mut [], reached: 0.0, flags: 0 }
}
