//! Clocks in event mode (FMI 3.0, 2.2.9): periodic ones tick by themselves, triggered ones on request, output clocks
//! when the FMU reports it. Inputs that belong to clocks wait for a tick of one of them.

use super::foreign::ForeignInstance;
use super::functions::Api;
use super::intervals::{ToldClock, ToldClocks};
use super::log::InstanceLog;
use crate::description::{Causality, Ticks, Variable};
use crate::error::Result;
use terraglue_subsystem::ValueType;

/// Sets an input when its clock ticks.
type Held = Box<dyn Fn(&ForeignInstance) -> Result + Send>;

/// An input that belongs to clocks.
struct Clocked {
    reference: u32,
    clocks: Vec<u32>,
    value: Option<Held>,
}

/// The clocks of an instance that is run with event mode.
#[derive(Default)]
pub struct Clocks {
    /// Input clocks that tick by themselves.
    periodic: Vec<(u32, Ticks)>,
    /// Input clocks that tick at times reported by the FMU.
    pub(super) told: ToldClocks,
    /// Input clocks that tick when the next step begins.
    due: Vec<u32>,
    /// Output clocks, and whether they ticked since that was last forgotten.
    outputs: Vec<u32>,
    ticked: Vec<bool>,
    inputs: Vec<Clocked>,
}

impl Clocks {
    /// The clocks that can tick. The others are logged.
    pub(super) fn new(variables: &[Variable], event_mode: bool, log: &InstanceLog) -> Self {
        let clocks = || variables.iter().filter(|v| v.value_type == ValueType::Clock && !v.alias);
        if !event_mode {
            if clocks().next().is_some() {
                log.note("has clocks, which tick in event mode only: set event_mode");
            }
            return Self::default();
        }
        let outputs: Vec<u32> =
            clocks().filter(|v| v.causality == Causality::Output).map(|v| v.reference).collect();
        let input = |v: &&Variable| v.causality == Causality::Input && !v.clocks.is_empty() && !v.alias;
        let clocked =
            |v: &Variable| Clocked { reference: v.reference, clocks: v.clocks.clone(), value: None };
        let told = |v: &Variable| Some(ToldClock::new(v.reference, v.told?, v.fraction));
        Self {
            periodic: clocks().filter_map(|v| Some((v.reference, v.ticks?))).collect(),
            told: ToldClocks::new(clocks().filter_map(told).collect()),
            due: Vec::new(),
            ticked: vec![false; outputs.len()],
            outputs,
            inputs: variables.iter().filter(input).map(clocked).collect(),
        }
    }

    /// The run starts at this time, s: shifts of clocks count from there (FMI 3.0.2, 2.2.9, t0 = t_start + T_shift).
    pub(super) fn begin(&mut self, start: f64) {
        self.periodic.iter_mut().for_each(|(_, ticks)| ticks.shift += start);
        self.told.begin(start);
    }

    /// The first tick after t that is known, or `end`, s.
    #[inline]
    pub(super) fn next(&self, t: f64, end: f64) -> f64 {
        let first = self.periodic.iter().map(|(_, ticks)| ticks.after(t)).fold(end, f64::min);
        self.told.next(first)
    }

    /// Whether a clock ticks at t by itself, or the FMU has announced an event there.
    #[inline]
    pub(super) fn tick_at(&self, t: f64) -> bool {
        self.periodic.iter().any(|(_, ticks)| ticks.at(t))
            || self.told.any_due(t)
            || self.told.event_is_due(t)
    }

    /// Whether a clock ticks at t because the FMU has just reported it.
    #[inline]
    pub(super) fn told_at(&self, t: f64) -> bool {
        self.told.any_due(t)
    }

    /// Whether a triggered clock waits for the next step.
    #[inline]
    pub(super) fn is_due(&self) -> bool {
        !self.due.is_empty()
    }

    /// Makes a triggered input clock tick, or not, when the next step begins, or the initialisation ends.
    pub(super) fn trigger(&mut self, clock: u32, on: bool) {
        self.due.retain(|due| *due != clock);
        if on {
            self.due.push(clock);
        }
    }

    /// Forgets which clocks were to tick: the step that they ticked in stands.
    pub fn forget_triggers(&mut self) {
        self.due.clear();
    }

    /// Whether a triggered input clock will tick, or an output clock has ticked since that was forgotten.
    pub fn ticks(&self, clock: u32) -> bool {
        let out = self.outputs.iter().position(|own| *own == clock);
        out.map_or_else(|| self.due.contains(&clock), |k| self.ticked[k])
    }

    /// Forgets which output clocks have ticked.
    pub fn forget_ticks(&mut self) {
        self.ticked.fill(false);
    }

    /// Whether an input waits for a clock.
    pub fn waits_for_clock(&self, input: u32) -> bool {
        self.inputs.iter().any(|i| i.reference == input)
    }

    /// Keeps the function that sets an input until a clock of it ticks, then and at every tick after it.
    pub fn hold(&mut self, input: u32, value: impl Fn(&ForeignInstance) -> Result + Send + 'static) {
        if let Some(found) = self.inputs.iter_mut().find(|i| i.reference == input) {
            found.value = Some(Box::new(value));
        }
    }

    /// In event mode: activates the clocks that are to tick at once, as reported by the FMU.
    pub(super) fn tick_told(&mut self, foreign: &ForeignInstance, t: f64) -> Result {
        self.tick_without_periodic(foreign, t, false)
    }

    /// The same, or at the beginning of a step those that were triggered: a periodic clock that ticks there did so when the step
    /// before ended there.
    pub(super) fn tick_without_periodic(
        &mut self,
        foreign: &ForeignInstance,
        t: f64,
        begins: bool,
    ) -> Result {
        let periodic = std::mem::take(&mut self.periodic);
        let ticked = self.tick(foreign, t, begins);
        self.periodic = periodic;
        ticked
    }

    /// In event mode: activates the input clocks that tick at t, and those that were triggered where a step begins there.
    pub(super) fn tick(&self, foreign: &ForeignInstance, t: f64, begins: bool) -> Result {
        let Api::Three(three) = foreign.api else { return Ok(()) };
        let periodic = self.periodic.iter().filter(|(_, ticks)| ticks.at(t)).map(|(vr, _)| *vr);
        let triggered = self.due.iter().copied().filter(|_| begins);
        let due: Vec<u32> = periodic.chain(triggered).chain(self.told.take(t)).collect();
        if due.is_empty() {
            return Ok(());
        }
        let on = vec![true; due.len()];
        let (r, n, p) = (due.as_ptr(), due.len(), on.as_ptr());
        // SAFETY: as many values as references.
        foreign.call("fmi3SetClock", three.set_clock, |f, c| unsafe { f(c, r, n, p) })?;
        let ticks = |input: &&Clocked| input.clocks.iter().any(|clock| due.contains(clock));
        let values = self.inputs.iter().filter(ticks).filter_map(|i| i.value.as_ref());
        values.into_iter().try_for_each(|set| set(foreign))
    }

    /// In event mode, before discrete states are updated: which output clocks tick.
    pub(super) fn look(&mut self, foreign: &ForeignInstance) -> Result {
        let Api::Three(three) = foreign.api else { return Ok(()) };
        if self.outputs.is_empty() {
            return Ok(());
        }
        let mut on = vec![0_u8; self.outputs.len()];
        let (r, n, p) = (self.outputs.as_ptr(), on.len(), on.as_mut_ptr());
        // SAFETY: as many values as references.
        foreign.call("fmi3GetClock", three.get_clock, |f, c| unsafe { f(c, r, n, p) })?;
        self.ticked.iter_mut().zip(on).for_each(|(ticked, on)| *ticked |= on != 0);
        Ok(())
    }
}
