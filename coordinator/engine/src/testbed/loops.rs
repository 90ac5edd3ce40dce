//! Loops of connections that are solved within a step (`order = "iterate"`): FMUs repeat the step until the outputs at its end are
//! those that it was made with.
//!
//! Where all FMUs of a loop can, and inputs of it are integrated, each repetition is made of two halves, with the outputs in the middle as further
//! values: of fourth order. Else it is one step: an input that outputs of the loop follow at once takes the value at its end, any other one the
//! mean of the values at start and end, which is of second order. Each repetition begins with the state at the start of the step.
//! FMUs that only take values of a loop are stepped when it is solved.
//!
//! The next values are those that Anderson's combination (1965) makes of the last six, of Newton's steps where all FMUs of the loop have
//! directional derivatives, else of the residuals: loops whose gains are above one are solved, too.

use super::loop_values::{LoopValues, Part};
use super::schedule::{Span, StepSchedule};
use super::step_order::StepOrder;
use super::subsystems::Subsystems;
use crate::graph::{components, reached};
use crate::signals::{Faults, FeedThroughs, Link, Links};
use std::collections::BTreeMap;
use std::sync::atomic::Ordering;
use terraglue_diagnostics::Result;
use terraglue_host::Instance;
use terraglue_scenario::ModuleKind;
use terraglue_subsystem::{Capabilities, Motion, Response};

/// Most repetitions of a step.
const MOST: u32 = 60;

/// The way out of a loop that cannot be iterated.
pub(super) const NO_LOOP: &str =
    "leave `order = \"iterate\"` of its connections out: then values of a loop are late by a step";

/// All loops of a run.
#[derive(Debug, Default)]
pub(super) struct Loops {
    loops: Vec<LoopValues>,
    /// Those that repeat the step, ascending.
    members: Vec<usize>,
    /// Those that take values of a loop within the step, and are not part of it.
    followers: Vec<usize>,
    /// Number under which they keep the state at its start.
    state: u32,
}

impl Loops {
    /// The loops of a run; `state`: number of a state that nobody else keeps.
    ///
    /// # Errors
    /// A subsystem that takes part and cannot repeat a step, in words.
    pub fn new(
        links: &Links,
        faults: &Faults,
        feed_through: &FeedThroughs,
        instances: &[Instance],
        schedules: &[StepSchedule],
        state: u32,
    ) -> std::result::Result<Self, String> {
        let mut loops = Self { state, ..Self::default() };
        let component = loops.find_members(links, instances);
        for slot in &loops.members {
            let (instance, schedule) = (&instances[*slot], &schedules[*slot]);
            if let Some(why) = cannot_repeat(instance, schedule) {
                return Err(format!(
                    "`{}` {why}: it cannot take part in a loop that is iterated",
                    instance.name()
                ));
            }
        }
        let numbers = links.numbers.iter().enumerate().filter(|(_, link)| link.is_iterated());
        let mut iterated: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for (k, link) in numbers {
            if faults.change(k) {
                let names = link.names(instances);
                return Err(format!("a fault changes {}: it cannot be iterated", names.join(", ")));
            }
            iterated.entry(component[link.slots()[1]]).or_default().push(k);
        }
        for (number, numbers) in iterated {
            let own = loops.members.iter().copied().filter(|slot| component[*slot] == number).collect();
            loops.loops.push(LoopValues::new(numbers, links, feed_through, instances, own));
        }
        Ok(loops)
    }

    /// Finds those that repeat the step, and those that follow: an FMU that a loop reaches is part of it if it acts on the loop. Answers with
    /// the number of the loop of each subsystem.
    fn find_members(&mut self, links: &Links, instances: &[Instance]) -> Vec<usize> {
        let iterated: Vec<[usize; 2]> =
            links.numbers.iter().filter(|link| link.is_iterated()).map(Link::slots).collect();
        let within = links.numbers.iter().filter(|link| link.is_within_the_step()).map(Link::slots);
        let discrete = links.discrete.iter().filter(|link| link.is_within_the_step());
        let discrete = discrete.map(|link| link.end_ids(instances).map(|(slot, _)| slot));
        let edges: Vec<[usize; 2]> = within.chain(discrete).chain(iterated.iter().copied()).collect();
        let backwards: Vec<[usize; 2]> = edges.iter().map(|[from, to]| [*to, *from]).collect();
        let count = instances.len();
        let behind = reached(count, &edges, iterated.iter().map(|[_, to]| *to));
        let before = reached(count, &backwards, iterated.iter().map(|[from, _]| *from));
        let repeats = |slot: &usize| before[*slot] || iterated.iter().any(|[_, to]| to == slot);
        (self.members, self.followers) = (0..count).filter(|slot| behind[*slot]).partition(repeats);
        components(count, &edges)
    }

    /// Those that are stepped when the loops are solved.
    pub fn followers(&self) -> &[usize] {
        &self.followers
    }

    /// How the loop of a subsystem is solved, in words.
    pub fn way(&self, instances: &[Instance], slot: usize) -> String {
        let own = self.loops.iter().find(|own| own.members().contains(&slot));
        own.map(|own| own.way(instances)).unwrap_or_default()
    }

    /// Whether there is nothing to solve.
    pub fn is_empty(&self) -> bool {
        self.loops.is_empty()
    }

    /// Keeps states and values at the start of the step; the first trial is made with the values of the start.
    pub fn begin(&mut self, links: &Links, instances: &mut [Instance]) -> Result {
        self.loops.iter_mut().for_each(|own| own.begin(links));
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
        let mut repetitions = 0;
        while repetitions < MOST {
            if span.broken.load(Ordering::Relaxed) || self.stand(links, &subsystems.instances)? {
                return Ok(None);
            }
            if self.loops.iter().any(LoopValues::runs_away) {
                break;
            }
            repetitions += 1;
            self.repeat(order, span, links, subsystems)?;
        }
        Ok(Some(self.unsolved(repetitions, span, links, &subsystems.instances)))
    }

    /// One trial of the members from the start of the step, with the inputs that the guess makes.
    fn repeat(
        &mut self,
        order: &StepOrder,
        span: &mut Span,
        links: &mut Links,
        subsystems: &mut Subsystems,
    ) -> Result {
        self.back(&mut subsystems.instances)?;
        let halving = |loops: &[LoopValues], slot: usize| {
            loops.iter().any(|own| own.goes_by_halves() && own.members().contains(&slot))
        };
        let (by_halves, whole): (Vec<usize>, Vec<usize>) =
            self.members.iter().partition(|slot| halving(&self.loops, **slot));
        if !whole.is_empty() {
            self.try_part(Part::Whole, &whole, order, span, links, subsystems)?;
        }
        if by_halves.is_empty() {
            return Ok(());
        }
        let mut first = span.half(false);
        self.try_part(Part::FirstHalf, &by_halves, order, &mut first, links, subsystems)?;
        if first.broken.load(Ordering::Relaxed) {
            span.broken.store(true, Ordering::Relaxed);
            return Ok(());
        }
        for own in self.loops.iter_mut().filter(|own| own.goes_by_halves()) {
            own.take_middle(links, &subsystems.instances)?;
        }
        let still = Motion { x: &[], v: &[] };
        by_halves.iter().try_for_each(|slot| subsystems.instances[*slot].commit(&first.step, &[], &still))?;
        let mut second = span.half(true);
        self.try_part(Part::SecondHalf, &by_halves, order, &mut second, links, subsystems)?;
        span.broken.fetch_or(second.broken.into_inner(), Ordering::Relaxed);
        Ok(())
    }

    /// A part of the trial, of those members that make it so, level by level.
    fn try_part(
        &self,
        part: Part,
        members: &[usize],
        order: &StepOrder,
        span: &mut Span,
        links: &mut Links,
        subsystems: &mut Subsystems,
    ) -> Result {
        let halves = part != Part::Whole;
        let own = self.loops.iter().filter(|own| own.goes_by_halves() == halves);
        own.into_iter().try_for_each(|own| own.set(part, links, &mut subsystems.instances))?;
        for level in 0..order.levels_before_loops() {
            span.level = level as u32;
            order.pass_on(level, |slot| members.contains(&slot), links, &mut subsystems.instances)?;
            let mut out = Response { x: &mut [], v: &mut [], a: &mut [], t: &mut [], reached: 0.0, flags: 0 };
            for slot in members {
                let instance = &mut subsystems.instances[*slot];
                subsystems.schedules[*slot].try_alone(instance, span, &mut out);
            }
        }
        Ok(())
    }

    /// A loop that was not solved: its FMUs, its connections, and how far a value is off.
    #[cold]
    fn unsolved(&self, repetitions: u32, span: &Span, links: &Links, instances: &[Instance]) -> String {
        let all = self.loops.iter().map(|own| (own, own.worst(links, instances)));
        let worst = all.max_by(|(_, a), (_, b)| a.0.total_cmp(&b.0));
        let Some((own, (size, value, connections))) = worst else { return String::new() };
        let names: Vec<&str> = own.members().iter().map(|slot| instances[*slot].name()).collect();
        format!(
            "the loop of {} was not solved in {repetitions} repetitions of a step of {} s. Its connections: {}. The value of {value} is off by {size:.3e} \
             from the one that the step was made with. Ways out: a smaller time.step_s; or {NO_LOOP}",
            names.join(", "),
            span.step.h,
            listed(&connections),
        )
    }

    /// Whether the outputs are those that the trial was made with; where not, a better guess is there.
    fn stand(&mut self, links: &mut Links, instances: &[Instance]) -> Result<bool> {
        let mut all = true;
        for own in &mut self.loops {
            all &= own.stands(links, instances)?;
        }
        Ok(all)
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

/// The first of many names, and how many more there are.
fn listed(names: &[String]) -> String {
    const SHOWN: usize = 8;
    match names.len().saturating_sub(SHOWN) {
        0 => names.join(", "),
        more => format!("{} and {more} more", names[..SHOWN].join(", ")),
    }
}
