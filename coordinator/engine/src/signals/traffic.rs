//! All that flows between the subsystems of a run besides glue: connections, the time line of events, faults, and the names by which
//! variables are found.

use super::fault::Change;
use super::{Directory, Discrete, Faults, Link, Links, Moment, TimeLine, initialize, initialize_discrete};
use terraglue_diagnostics::Result;
use terraglue_gluing::memory::Recall;
use terraglue_host::Instance;

/// Signals of a run.
#[derive(Debug)]
pub struct Signals {
    /// Connections between variables.
    pub links: Links,
    /// Variables by their full names.
    pub directory: Directory,
    /// Events.
    pub time_line: TimeLine,
    /// Faults of values on their way.
    pub faults: Faults,
    /// Whether it was told that discrete values do not settle at the start.
    pub told: bool,
}

impl Signals {
    /// Number of variables that are fed by another one.
    pub fn connections(&self) -> usize {
        self.links.numbers.iter().map(Link::count).sum::<usize>()
            + self.links.discrete.len()
            + self.links.streams.len()
    }

    /// Whether a connection feeds a variable.
    pub fn is_fed(&self, instances: &[Instance], slot: usize, id: u32) -> bool {
        self.links.numbers.iter().any(|l| l.feeds(slot, id))
            || self.links.discrete.iter().any(|l| l.feeds(instances, slot, id))
            || self.links.streams.iter().any(|l| l.to().slot == slot && l.to().describe(instances).id == id)
    }

    /// The time of the next event or fault after t, s.
    pub fn next_time(&self, t: f64) -> f64 {
        self.time_line.next_time(t).min(self.faults.next_time(t))
    }

    /// Connected values at the start, where they matter before the first step: in their order, loops of numbers solved.
    ///
    /// # Errors
    /// A loop without a solution, or what a module refuses.
    pub fn initialize(&mut self, instances: &mut [Instance]) -> Result {
        let (numbers_pass, discrete_pass) = self.links.pass_at_start(instances);
        let Links { numbers, discrete, .. } = &mut self.links;
        if numbers_pass {
            initialize(numbers, instances)?;
        }
        if !discrete_pass {
            return Ok(());
        }
        let before: Vec<Discrete> = discrete.iter().map(|link| link.of_input(instances)).collect();
        let mut new = Vec::new();
        // numbers may depend on discrete values and these on numbers, so both are passed until nothing changes
        for _ in 0..=discrete.len() {
            new = initialize_discrete(discrete, instances)?;
            if new.is_empty() {
                return Ok(());
            }
            if numbers_pass {
                initialize(numbers, instances)?;
            }
        }
        let names: Vec<String> = new.iter().map(|k| discrete[*k].label(instances)).collect();
        new.into_iter().try_for_each(|k| before[k].pass_on(instances))?;
        if !std::mem::replace(&mut self.told, true) {
            log::warn!(
                "connected values that do not settle at the start are late by a step: {}",
                names.join(", ")
            );
        }
        Ok(())
    }

    /// Outputs of t become inputs of the step, with the faults on their way; `tell` is called when a fault begins or ends.
    ///
    /// # Errors
    /// As of [`Signals::read`] and [`Signals::write`], or an input that does not take what a fault makes of it.
    pub fn transfer(
        &mut self,
        moment: Moment,
        step_s: f64,
        instances: &mut [Instance],
        tell: impl FnMut(Change),
    ) -> Result {
        self.read(instances)?;
        if !self.faults.is_empty() {
            self.faults.apply((moment.t, step_s), &mut self.links, instances, tell)?;
        }
        self.links.numbers.iter_mut().try_for_each(|link| link.extrapolate(moment, instances))?;
        self.write(instances)
    }

    /// Inputs of a step that is repeated with another length: those that follow a line take its mean anew; all others stay as they were set. What the
    /// discarded step has left in outputs is not of t.
    ///
    /// # Errors
    /// As of [`Signals::read`] and [`Signals::write`].
    pub fn transfer_again(&mut self, moment: Moment, instances: &mut [Instance]) -> Result {
        self.links.numbers.iter_mut().filter(|link| link.follows_line()).try_for_each(|link| {
            link.extrapolate(moment, instances)?;
            link.pass_on_ahead(instances)
        })
    }

    /// Reads all outputs but those that are passed within the step. None is passed on before all are read, so that direct feed-through cannot leak values of the same step.
    ///
    /// # Errors
    /// A value that is no number, has no entry in the `map` of its connection, or that a module cannot give.
    pub fn read(&mut self, instances: &[Instance]) -> Result {
        for link in self.links.numbers.iter_mut().filter(|link| !link.is_within_the_step()) {
            link.read(instances)?;
        }
        let mut discrete = self.links.discrete.iter_mut().filter(|link| !link.is_within_the_step());
        discrete.try_for_each(|link| link.read(instances))
    }

    /// Sets the inputs to what was read.
    ///
    /// # Errors
    /// A value that a module refuses.
    pub fn write(&mut self, instances: &mut [Instance]) -> Result {
        for link in self.links.numbers.iter().filter(|link| !link.is_within_the_step()) {
            link.pass_on_ahead(instances)?;
        }
        for link in self.links.discrete.iter().filter(|link| !link.is_within_the_step()) {
            link.pass_on(instances)?;
        }
        self.links.streams.iter_mut().try_for_each(|l| l.pass_on(instances))
    }

    /// For a snapshot.
    pub fn remember(&self) -> Vec<u64> {
        let mut out = self.faults.remember();
        self.links.streams.iter().for_each(|link| link.remember(&mut out));
        self.links.numbers.iter().for_each(|link| link.remember(&mut out));
        out
    }

    /// Back to a snapshot.
    pub fn recall(&mut self, kept: &mut Recall) {
        self.faults.recall(kept);
        self.links.streams.iter_mut().for_each(|link| link.recall(kept));
        self.links.numbers.iter_mut().for_each(|link| link.recall(kept));
    }
}
