//! Loops of connections that are solved within a step (`order = "iterate"`): FMUs repeat the step until the outputs at its end are
//! those that it was made with.
//!
//! An FMU whose outputs follow its inputs at once takes the value at the end of the step; any other one takes the mean of the values
//! at start and end, which makes the step of second order. Each repetition begins with the state at the start of the step.
//! The next values are those that Anderson's combination (1965) makes of the last six, of Newton's steps where all FMUs of the loop have
//! directional derivatives, else of the residuals: loops whose gains are above one are solved, too.

use super::newton::Newton;
use super::schedule::{Span, StepSchedule};
use super::step_order::StepOrder;
use super::subsystems::Subsystems;
use crate::signals::{Faults, Link, Links, held};
use std::sync::atomic::Ordering;
use terraglue_diagnostics::Result;
use terraglue_gluing::acceleration::Acceleration;
use terraglue_host::Instance;
use terraglue_scenario::{ModuleKind, Relaxation};
use terraglue_subsystem::{Capabilities, Response};

/// Most repetitions of a step.
const MOST: u32 = 60;
/// Largest difference of a value and the one that the step was made with, relative to the larger of it and 1e-3 in its unit.
const TOLERANCE: f64 = 1e-10;

/// Values that grow by this factor beyond those of start and first trial have no solution.
const RUNAWAY: f64 = 1e6;

/// The way out of a loop that cannot be iterated.
pub(super) const NO_LOOP: &str =
    "leave `order = \"iterate\"` of its connections out: then values of a loop are late by a step";

/// A connection of a loop.
#[derive(Debug)]
struct Iterated {
    link: usize,
    /// Whether its target takes the value at the end of the step.
    takes_end: bool,
}

/// All loops of a run.
#[derive(Debug)]
pub(super) struct Loops {
    links: Vec<Iterated>,
    /// Those that repeat the step, ascending.
    members: Vec<usize>,
    /// Number under which they keep the state at its start.
    state: u32,
    /// Values at the start of the step, and those that the trial was made with.
    start: Vec<f64>,
    guess: Vec<f64>,
    /// Size of the values at start and first trial.
    scale: Vec<f64>,
    newton: Newton,
    acceleration: Acceleration,
}

impl Default for Loops {
    fn default() -> Self {
        Self {
            links: Vec::new(),
            members: Vec::new(),
            state: 0,
            start: Vec::new(),
            guess: Vec::new(),
            scale: Vec::new(),
            newton: Newton::default(),
            acceleration: Acceleration::new(Relaxation::Anderson, 1.0),
        }
    }
}

impl Loops {
    /// The loops of a run; `state`: number of a state that nobody else keeps.
    ///
    /// # Errors
    /// A subsystem that takes part and cannot repeat a step, in words.
    pub fn new(
        links: &Links,
        faults: &Faults,
        instances: &[Instance],
        schedules: &[StepSchedule],
        state: u32,
    ) -> std::result::Result<Self, String> {
        let iterated = links.numbers.iter().enumerate().filter(|(_, link)| link.is_iterated());
        let follows = |slot: usize| instances[slot].capabilities().has(Capabilities::STEP_FEEDTHROUGH);
        let iterated: Vec<Iterated> =
            iterated.map(|(k, l)| Iterated { link: k, takes_end: follows(l.slots()[1]) }).collect();
        let mut loops = Self { state, ..Self::default() };
        let mut open: Vec<usize> = iterated.iter().map(|i| links.numbers[i.link].slots()[1]).collect();
        while let Some(slot) = open.pop() {
            if loops.members.contains(&slot) {
                continue;
            }
            loops.members.push(slot);
            let passes = |link: &&Link| link.is_within_the_step() && link.slots()[0] == slot;
            open.extend(links.numbers.iter().filter(passes).map(|link| link.slots()[1]));
        }
        loops.members.sort_unstable();
        for slot in &loops.members {
            let (instance, schedule) = (&instances[*slot], &schedules[*slot]);
            if let Some(why) = cannot_repeat(instance, schedule) {
                return Err(format!(
                    "`{}` {why}: it cannot take part in a loop that is iterated",
                    instance.name()
                ));
            }
        }
        if let Some(faulty) = iterated.iter().find(|i| faults.change(i.link)) {
            let names = links.numbers[faulty.link].names(instances);
            return Err(format!("a fault changes {}: it cannot be iterated", names.join(", ")));
        }
        loops.newton = Newton::new(iterated.iter().map(|i| i.link), links, &loops.members);
        loops.links = iterated;
        Ok(loops)
    }

    /// Whether there is nothing to solve.
    pub fn is_empty(&self) -> bool {
        self.links.is_empty()
    }

    /// Keeps states and values at the start of the step; the first trial is made with the values of the start.
    pub fn begin(&mut self, links: &Links, instances: &mut [Instance]) -> Result {
        let values = |i: &Iterated| {
            let link = &links.numbers[i.link];
            (0..link.count()).map(|k| link.value(k)).collect::<Vec<f64>>()
        };
        self.start = self.links.iter().flat_map(values).collect();
        self.guess.clone_from(&self.start);
        self.scale.clear();
        self.acceleration.begin();
        self.members.iter().try_for_each(|slot| instances[*slot].save_state(self.state))
    }

    /// Back to the state at the start of the step, from which a shorter one begins.
    pub fn back(&self, instances: &mut [Instance]) -> Result {
        self.members.iter().try_for_each(|slot| instances[*slot].restore_state(self.state))
    }

    /// Repeats the trials of the members until the values no longer change. Returns a message if a loop was not solved.
    pub fn solve(
        &mut self,
        order: &StepOrder,
        span: &mut Span,
        links: &mut Links,
        subsystems: &mut Subsystems,
    ) -> Result<Option<String>> {
        for _ in 0..MOST {
            if span.broken.load(Ordering::Relaxed) || self.stands(links, &subsystems.instances)? {
                return Ok(None);
            }
            if self.runs_away() {
                break;
            }
            self.back(&mut subsystems.instances)?;
            self.set(links, &mut subsystems.instances)?;
            for level in 0..order.levels() {
                span.level = level as u32;
                order.pass_on(level, links, &mut subsystems.instances)?;
                let mut out =
                    Response { x: &mut [], v: &mut [], a: &mut [], t: &mut [], reached: 0.0, flags: 0 };
                for slot in &self.members {
                    let instance = &mut subsystems.instances[*slot];
                    subsystems.schedules[*slot].try_alone(instance, span, &mut out);
                }
            }
        }
        let names: Vec<&str> = self.members.iter().map(|slot| subsystems.instances[*slot].name()).collect();
        Ok(Some(format!("the loop of {} was not solved in {MOST} repetitions", names.join(", "))))
    }

    /// Whether the outputs are those that the trial was made with; if not, a better guess is there.
    fn stands(&mut self, links: &mut Links, instances: &[Instance]) -> Result<bool> {
        let residual = self.acceleration.residual();
        residual.clear();
        let mut stands = true;
        for own in &self.links {
            for value in links.numbers[own.link].read(instances)? {
                let guess = self.guess[residual.len()];
                stands &= (value - guess).abs() <= TOLERANCE * value.abs().max(guess.abs()).max(1e-3);
                residual.push(value - guess);
            }
        }
        if self.scale.is_empty() {
            let sizes = self.guess.iter().zip(&*residual).map(|(u, r)| u.abs().max((u + r).abs()).max(1e-3));
            self.scale.extend(sizes);
        }
        if !stands {
            self.newton.solve(residual, links, instances)?;
            let step = self.acceleration.step(&self.guess);
            self.guess.iter_mut().zip(step).for_each(|(guess, d)| *guess += d);
        }
        Ok(stands)
    }

    /// Whether the guess has left all that start and first trial were of.
    fn runs_away(&self) -> bool {
        self.guess.iter().zip(&self.scale).any(|(guess, scale)| guess.abs() > RUNAWAY * scale)
    }

    /// Sets the inputs to what the guess makes of them.
    fn set(&self, links: &Links, instances: &mut [Instance]) -> Result {
        let mut first = 0;
        for own in &self.links {
            let link = &links.numbers[own.link];
            let pairs = self.start[first..].iter().zip(&self.guess[first..]).take(link.count());
            let values: Vec<f64> = pairs.map(|(start, end)| held(own.takes_end, *start, *end)).collect();
            link.write(instances, &values)?;
            first += link.count();
        }
        Ok(())
    }
}

/// Why a subsystem cannot repeat a step by itself.
fn cannot_repeat(instance: &Instance, schedule: &StepSchedule) -> Option<&'static str> {
    let can = |what| instance.capabilities().has(what);
    match schedule {
        _ if !ModuleKind::is_fmu(instance.module()) => Some("is no FMU"),
        StepSchedule { glued: true, .. } => Some("is glued"),
        StepSchedule { step_multiple: 2.., .. } => Some("makes steps of another length"),
        _ if !(can(Capabilities::RETRY) && can(Capabilities::STATE)) => Some("cannot save its state"),
        _ => None,
    }
}
