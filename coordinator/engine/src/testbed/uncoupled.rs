//! Subsystems without glue: one trial each per step, beside each other where that pays.
//!
//! Their trials see committed values only, so the order, and the thread that runs one, cannot be seen in any result.
//! Every 64th step runs one after the other under a watch: it measures what each costs, and whether threads gain.
//! FMUs that take outputs of others within the step follow in the order of [`StepOrder`].

use super::loops::Loops;
use super::run_clock::RunClock;
use super::schedule::{Span, StepSchedule};
use super::step_order::StepOrder;
use super::subsystems::Subsystems;
use crate::signals::Links;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use terraglue_diagnostics::Result;
use terraglue_host::{Instance, Progress, Workers};
use terraglue_subsystem::{Motion, Response, Step, Values};

/// Steps from one that is watched to the next.
const SAMPLED: u64 = 64;
/// The first one to be watched; what is made at the first step of all is no example.
const FIRST: u64 = 1;
/// Time that threads must save in a step before they are woken: several times the cost of waking.
const WORTH: Duration = Duration::from_micros(20);

/// Whether trials run beside each other.
pub(super) struct Uncoupled {
    workers: Arc<Workers>,
    /// Time that threads would have saved in the last two steps that were watched.
    saved: [Duration; 2],
    order: StepOrder,
    loops: Loops,
}

impl Uncoupled {
    pub fn new(workers: Arc<Workers>, order: StepOrder, loops: Loops) -> Self {
        Self { workers, saved: [Duration::ZERO; 2], order, loops }
    }

    /// The order of the steps.
    pub fn order(&self) -> &StepOrder {
        &self.order
    }

    /// The loops that are solved.
    pub fn loops(&self) -> &Loops {
        &self.loops
    }

    fn pays(&self) -> bool {
        self.workers.threads() > 1 && self.saved.iter().all(|s| *s >= WORTH)
    }

    /// (3) A trial of every subsystem without glue. Returns the reason why the step was discarded, if it was.
    pub fn advance(
        &mut self,
        clock: &RunClock,
        (h, end): (f64, f64),
        links: &mut Links,
        subsystems: &mut Subsystems,
    ) -> Result<Option<String>> {
        let mut span = span(clock, h, end);
        if !self.loops.is_empty() {
            self.loops.begin(links, &mut subsystems.instances)?;
        }
        self.advance_first(clock, &span, subsystems);
        let before_loops = self.order.levels_before_loops();
        self.advance_levels(1..before_loops, clock, &mut span, links, subsystems)?;
        if !self.loops.is_empty() {
            let unsolved = self.loops.solve(&self.order, &mut span, links, subsystems)?;
            if unsolved.is_some() {
                self.discard(links, subsystems)?;
                return Ok(unsolved);
            }
            self.advance_levels(before_loops..self.order.levels(), clock, &mut span, links, subsystems)?;
        }
        let discarded = if span.broken.into_inner() { broken_trial(subsystems)? } else { None };
        if discarded.is_some() {
            self.discard(links, subsystems)?;
        }
        Ok(discarded)
    }

    /// Forgets the trials of a step that glue did not converge in.
    pub fn discard(&self, links: &mut Links, subsystems: &mut Subsystems) -> Result {
        let Subsystems { instances, schedules, .. } = subsystems;
        let long = |turn: &StepSchedule| turn.is_fmu && !turn.glued && turn.step_multiple > 1;
        for (instance, _) in instances.iter_mut().zip(schedules).filter(|(_, turn)| long(turn)) {
            // an FMU goes back before it is set: the end of its long step may not be reached by the shorter step
            instance.set(&[], Values::F64(&[]))?;
        }
        self.loops.discard(links, instances)
    }

    /// Trials of those that take outputs of others at the end of the step, level by level.
    fn advance_levels(
        &mut self,
        levels: Range<usize>,
        clock: &RunClock,
        span: &mut Span,
        links: &mut Links,
        subsystems: &mut Subsystems,
    ) -> Result {
        for level in levels {
            if span.broken.load(Ordering::Relaxed) {
                break;
            }
            span.level = level as u32;
            self.order.pass_on(level, |_| true, links, &mut subsystems.instances)?;
            if is_sampled(clock) {
                self.sample(span, subsystems);
            } else {
                one_by_one(span, subsystems);
            }
        }
        Ok(())
    }

    /// Trials of all that take outputs of the start of the step only.
    fn advance_first(&mut self, clock: &RunClock, span: &Span, subsystems: &mut Subsystems) {
        if is_sampled(clock) {
            self.sample(span, subsystems);
        } else if self.pays() {
            let job = |instance: &mut Instance, turn: &mut StepSchedule| {
                turn.try_alone(instance, span, &mut nothing())
            };
            self.workers.for_each_pair(&mut subsystems.instances, &mut subsystems.schedules, &job);
        } else {
            one_by_one(span, subsystems);
        }
    }

    /// One after the other, each under a watch.
    fn sample(&mut self, span: &Span, subsystems: &mut Subsystems) {
        let (mut sum, mut longest) = (Duration::ZERO, Duration::ZERO);
        let Subsystems { instances, schedules, members } = subsystems;
        let all = instances.iter_mut().zip(schedules).zip(members);
        for ((instance, turn), member) in all.filter(|((_, turn), _)| !turn.glued && turn.level == span.level)
        {
            let start = Instant::now();
            turn.try_alone(instance, span, &mut nothing());
            let took = start.elapsed();
            member.cost += took * SAMPLED as u32;
            sum += took;
            longest = longest.max(took);
        }
        if span.level > 0 {
            return;
        }
        let threads = self.workers.threads() as u32;
        let beside = longest.max(sum / threads);
        self.saved = [self.saved[1], sum - beside];
    }
}

fn one_by_one(span: &Span, subsystems: &mut Subsystems) {
    let mut out = nothing();
    for (instance, turn) in subsystems.instances.iter_mut().zip(&mut subsystems.schedules) {
        turn.try_alone(instance, span, &mut out);
    }
}

/// A watch for a part of this step, and how many steps it represents. Where bodies are glued every step is
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
    Span { step, end, nominal: clock.nominal, step_s: clock.step_s, level: 0, broken: AtomicBool::new(false) }
}

/// Error of the first trial that did not end at t + h; all are forgotten.
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

/// Response of a subsystem without ports.
pub(super) fn nothing() -> Response<'static> {
    Response { x: &mut [], v: &mut [], a: &mut [], t: &mut [], reached: 0.0, flags: 0 }
}
