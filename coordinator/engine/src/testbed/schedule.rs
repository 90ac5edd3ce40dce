//! When a subsystem without glue makes a step by itself, and how it ended.

use std::sync::atomic::{AtomicBool, Ordering};
use terraglue_diagnostics::Result;
use terraglue_host::{Instance, Progress};
use terraglue_subsystem::{Input, Response, Step};

/// A step of the testbed as subsystems see it.
pub(super) struct Span {
    pub step: Step<'static>,
    pub end: f64,
    pub nominal: u64,
    pub step_s: f64,
    /// Level of the subsystems whose trials are made now.
    pub level: u32,
    /// Whether a trial ended otherwise than at t + h.
    pub broken: AtomicBool,
}

impl Span {
    /// The step with the length that leads to its end, where it is the last one to there.
    fn on_grid(&self) -> Step<'static> {
        let left = self.end - self.step.t;
        let h = if (left - self.step.h).abs() <= 1e-9 * self.step_s { left } else { self.step.h };
        Step { h, ..self.step }
    }

    /// One of four parts of it, from 0 on.
    pub fn quarter(&self, k: u32) -> Self {
        let Self { step, end, nominal, step_s, level, .. } = *self;
        let h = 0.25 * step.h;
        let step = Step::free(step.t + f64::from(k) * h, h, step.index);
        Self { step, end, nominal, step_s, level, broken: AtomicBool::new(false) }
    }
}

/// When a subsystem makes a step by itself, and how it ended. Apart from all else of a subsystem, as every step asks for it.
pub(super) struct StepSchedule {
    /// Steps of the testbed per step of this subsystem.
    pub step_multiple: u32,
    /// Place in the order of the steps: those of a higher level take outputs of lower ones at the end of the step.
    pub level: u32,
    /// Whether its steps end at the very times of the grid, of which their lengths are differences: FMUs may compare the times.
    pub is_fmu: bool,
    /// Whether it is glued: it makes none by itself.
    pub glued: bool,
    /// Whether it makes no step now, as controllers do before the start.
    pub holds: bool,
    /// Whether it has bodies, whose states are read after every step.
    pub has_bodies: bool,
    /// End of its last trial if that was not at t + h.
    pub trial: Option<Box<Result<Progress>>>,
}

impl StepSchedule {
    /// Its trial of this step, if it makes one.
    #[inline]
    pub fn try_alone(&mut self, instance: &mut Instance, span: &Span, out: &mut Response) {
        if self.level != span.level {
            return;
        }
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
    pub fn own_step<R>(&self, span: &Span, make: impl FnOnce(&Step) -> R) -> Option<R> {
        let long;
        let step = match (self.glued, self.step_multiple) {
            (true, _) => return None,
            _ if self.holds => return None,
            (false, 1) if self.is_fmu => {
                long = span.on_grid();
                &long
            }
            (false, 1) => &span.step,
            (false, _) => {
                long = self.long_step(span)?;
                &long
            }
        };
        Some(make(step))
    }

    /// The step that the subsystem has committed with this one of the testbed, glued or not, without its ports.
    pub fn step_of(&self, span: &Span) -> Option<Step<'static>> {
        match (self.glued, self.step_multiple) {
            _ if self.holds => None,
            (true, _) | (false, 1) => Some(span.step),
            (false, _) => self.long_step(span),
        }
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
