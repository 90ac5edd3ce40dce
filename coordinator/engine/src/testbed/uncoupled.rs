//! Subsystems without glue: one trial each per step, beside each other where that pays.
//!
//! Their trials see committed values only, so the order, and the thread that runs one, cannot be seen in any result.
//! Every 64th step runs one after the other under a watch: it tells what each costs, and whether threads gain.

use super::Testbed;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use terraglue_diagnostics::Result;
use terraglue_host::{Instance, Progress, Workers};
use terraglue_subsystem::{Input, Motion, Response, Step};

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

/// A step of the testbed as subsystems see it.
struct Span {
    step: Step<'static>,
    end: f64,
    nominal: u64,
    step_s: f64,
    /// Whether a trial ended otherwise than at t + h.
    broken: AtomicBool,
}

/// When a subsystem makes a step by itself, and how it ended. Apart from all else of a subsystem, as every step asks for it.
pub(super) struct StepSchedule {
    /// Steps of the testbed per step of this subsystem.
    pub step_multiple: u32,
    /// Whether it is glued: it makes none by itself.
    pub glued: bool,
    /// Whether it makes no step now, as controllers do before the start.
    pub holds: bool,
    /// Whether it has bodies, whose states are read after every step.
    pub has_bodies: bool,
    /// How its last trial ended where that was not at t + h.
    pub trial: Option<Box<Result<Progress>>>,
}

impl Uncoupled {
    pub fn new(workers: Arc<Workers>) -> Self {
        Self { workers, saved: [Duration::ZERO; 2] }
    }

    fn pays(&self) -> bool {
        self.workers.threads() > 1 && self.saved.iter().all(|s| *s >= WORTH)
    }
}

impl Testbed {
    /// A watch for a part of this step, and how many steps it stands for. Where bodies are glued every step is
    /// watched; elsewhere reading the clock would cost more than the step of a cheap FMU.
    pub(super) fn watch(&self) -> (Option<Instant>, u32) {
        if !self.groups.is_empty() {
            return (Some(Instant::now()), 1);
        }
        (self.is_sampled().then(Instant::now), SAMPLED as u32)
    }

    fn is_sampled(&self) -> bool {
        self.index % SAMPLED == FIRST
    }

    fn span(&self, h: f64, end: f64) -> Span {
        let step = Step::free(self.t, h, self.index);
        Span { step, end, nominal: self.nominal, step_s: self.step_s, broken: AtomicBool::new(false) }
    }

    /// (3) A trial of every subsystem without glue. What discarded the step, if any.
    pub(super) fn advance_unglued(&mut self, h: f64, end: f64) -> Result<Option<String>> {
        let span = self.span(h, end);
        if self.is_sampled() {
            self.sample(&span);
        } else if self.uncoupled.pays() {
            let job = |instance: &mut Instance, turn: &mut StepSchedule| {
                turn.try_alone(instance, &span, &mut nothing())
            };
            self.uncoupled.workers.for_each_pair(&mut self.instances, &mut self.schedules, &job);
        } else {
            let mut out = nothing();
            for (instance, turn) in self.instances.iter_mut().zip(&mut self.schedules) {
                turn.try_alone(instance, &span, &mut out);
            }
        }
        if span.broken.into_inner() { self.broken_trial() } else { Ok(None) }
    }

    /// What the first trial says that did not end at t + h; all are forgotten.
    #[cold]
    fn broken_trial(&mut self) -> Result<Option<String>> {
        let all = self.instances.iter().zip(&mut self.schedules);
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

    /// One after the other, each under a watch.
    fn sample(&mut self, span: &Span) {
        let (mut sum, mut longest) = (Duration::ZERO, Duration::ZERO);
        let all = self.instances.iter_mut().zip(&mut self.schedules).zip(&mut self.members);
        for ((instance, turn), member) in all.filter(|((_, turn), _)| !turn.glued) {
            let start = Instant::now();
            turn.try_alone(instance, span, &mut nothing());
            let took = start.elapsed();
            member.cost += took * SAMPLED as u32;
            sum += took;
            longest = longest.max(took);
        }
        let threads = self.uncoupled.workers.threads() as u32;
        let beside = longest.max(sum / threads);
        self.uncoupled.saved = [self.uncoupled.saved[1], sum - beside];
    }

    /// (5) for subsystems without glue.
    pub(super) fn commit_unglued(&mut self, h: f64, end: f64) -> Result {
        let still = Motion { x: &[], v: &[] };
        let span = self.span(h, end);
        for (instance, turn) in self.instances.iter_mut().zip(&self.schedules) {
            let committed = turn.own_step(&span, |step| instance.commit(step, &[], &still));
            if let Some(Err(error)) = committed {
                return Err(error);
            }
        }
        Ok(())
    }

    /// What the steps of each subsystem have cost so far, s of wall time. Without glue: the steps that were watched, times
    /// the steps that each stands for; with glue: all calls in a step.
    pub fn costs(&self) -> impl Iterator<Item = (&str, f64)> {
        let cost = |slot: usize| match self.schedules[slot].glued {
            true => self.instances[slot].cost(),
            false => self.members[slot].cost,
        };
        self.instances.iter().enumerate().map(move |(slot, i)| (i.name(), cost(slot).as_secs_f64()))
    }
}

impl StepSchedule {
    /// Its trial of this step, if it makes one.
    #[inline]
    fn try_alone(&mut self, instance: &mut Instance, span: &Span, out: &mut Response) {
        let none = Input::Force { t: &[], motion: None };
        let broken = self.own_step(span, |step| match instance.advance(step, &none, out) {
            Ok(Progress::Complete) => None,
            other => Some(Box::new(other)),
        });
        if let Some(Some(trial)) = broken {
            self.trial = Some(trial);
            span.broken.store(true, Ordering::Relaxed);
        }
    }

    /// Does something with the step that the subsystem makes by itself now, if any.
    #[inline]
    fn own_step<R>(&self, span: &Span, make: impl FnOnce(&Step) -> R) -> Option<R> {
        let long;
        let step = match (self.glued, self.step_multiple) {
            (true, _) => return None,
            _ if self.holds => return None,
            (false, 1) => &span.step,
            (false, _) => {
                long = self.long_step(span)?;
                &long
            }
        };
        Some(make(step))
    }

    /// One of `step_multiple` nominal steps is made when its last part is reached, so its outputs never run ahead.
    #[inline(never)]
    fn long_step(&self, span: &Span) -> Option<Step<'static>> {
        let Span { step, end, nominal, step_s, .. } = span;
        let multiple = u64::from(self.step_multiple);
        let at_end = end - (step.t + step.h) <= 1e-6 * step_s;
        let whole = (nominal + 1).is_multiple_of(multiple);
        let length = multiple as f64 * step_s;
        (at_end && whole).then(|| Step::free(end - length, length, (nominal + 1) / multiple - 1))
    }
}

/// What a subsystem without ports answers.
fn nothing() -> Response<'static> {
    Response { x: &mut [], v: &mut [], a: &mut [], t: &mut [], reached: 0.0, flags: 0 }
}
