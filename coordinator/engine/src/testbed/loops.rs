//! Loops of connections that are solved within a step (`order = "iterate"`): FMUs repeat the step until the outputs at its end are
//! those that it was made with.
//!
//! Where all FMUs of a loop and those that feed it can, and inputs of it are integrated, each repetition is made of four quarters, with the outputs in the
//! middle as further values: of fourth order. Else it is one step: an input that outputs of the loop follow at once takes the value at its end, any
//! other one the mean of the values at start and end, which is of second order. Each repetition begins with the state at the start of the step.
//! FMUs that only take values of a loop are stepped when it is solved.
//!
//! The next values are those that Anderson's combination (1965) makes of the last six, of Newton's steps where all FMUs of the loop have
//! directional derivatives, else of the residuals: loops whose gains are above one are solved, too.

use super::loop_values::{LoopValues, Part};
use super::schedule::{Span, StepSchedule};
use super::step_order::StepOrder;
use super::subsystems::Subsystems;
use crate::graph::{components, reached};
use crate::listed::listed;
use crate::signals::{Faults, FeedThroughs, Link, Links};
use std::collections::BTreeMap;
use std::sync::atomic::Ordering;
use terraglue_diagnostics::Result;
use terraglue_host::Instance;
use terraglue_subsystem::{Capabilities, Motion, Response, ValueType};

/// Most repetitions of a step.
const MOST: u32 = 60;

/// The way out of a loop that cannot be iterated.
pub(super) const NO_LOOP: &str =
    "leave `order = \"iterate\"` of its connections out: then values of a loop are late by a step";

/// Why a loop cannot be iterated: the subsystem or the fault that hinders, by its number, and why.
pub(super) enum LoopRefusal {
    Subsystem(usize, String),
    Fault(usize, String),
}

/// All loops of a run.
#[derive(Debug, Default)]
pub(super) struct Loops {
    loops: Vec<LoopValues>,
    /// Those that repeat the step, ascending: parts of loops, and what feeds a loop that goes by quarters.
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
    /// A subsystem that takes part and cannot repeat a step, or a fault that changes a value of a loop.
    pub fn new(
        links: &Links,
        faults: &Faults,
        feed_through: &FeedThroughs,
        instances: &[Instance],
        schedules: &[StepSchedule],
        state: u32,
    ) -> std::result::Result<Self, LoopRefusal> {
        let mut loops = Self { state, ..Self::default() };
        let edges = edges(links, instances);
        loops.find_members(links, &edges, instances.len());
        let component = components(instances.len(), &edges);
        for slot in &loops.members {
            let (instance, schedule) = (&instances[*slot], &schedules[*slot]);
            if let Some(why) = cannot_repeat(instance, schedule) {
                let name = instance.name();
                let message = format!("`{name}` {why}: it cannot take part in a loop that is iterated");
                return Err(LoopRefusal::Subsystem(*slot, message));
            }
        }
        let numbers = links.numbers.iter().enumerate().filter(|(_, link)| link.is_iterated());
        let mut iterated: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for (k, link) in numbers {
            if let Some(fault) = faults.that_changes(k) {
                let names = link.names(instances);
                let message = format!("a fault changes {}: it cannot be iterated", names.join(", "));
                return Err(LoopRefusal::Fault(fault, message));
            }
            iterated.entry(component[link.slots()[1]]).or_default().push(k);
        }
        let backwards: Vec<[usize; 2]> = edges.iter().map(|[from, to]| [*to, *from]).collect();
        let cannot = |slot: usize| makes_no_quarters(&instances[slot], &schedules[slot]);
        for (number, numbers) in iterated {
            let own: Vec<usize> =
                loops.members.iter().copied().filter(|slot| component[*slot] == number).collect();
            let before = reached(instances.len(), &backwards, own.iter().copied());
            let sources = (0..instances.len()).filter(|slot| before[*slot] && !own.contains(slot)).collect();
            loops.loops.push(LoopValues::new(numbers, links, feed_through, [own, sources], cannot));
        }
        loops.find_whole(instances);
        let fed = loops.loops.iter().filter(|own| own.why_whole().is_none());
        let parts: Vec<usize> = fed.flat_map(LoopValues::parts).collect();
        loops.members.extend(parts);
        loops.members.sort_unstable();
        loops.members.dedup();
        let behind = reached(instances.len(), &edges, loops.members.iter().copied());
        let follows = |slot: &usize| behind[*slot] && !loops.members.contains(slot);
        loops.followers = (0..instances.len()).filter(follows).collect();
        Ok(loops)
    }

    /// Loops that share an FMU, or feed one another, make one kind of step: by quarters where all can and one of them is worth it.
    fn find_whole(&mut self, instances: &[Instance]) {
        let count = self.loops.len();
        let shares =
            |a: &LoopValues, b: &LoopValues| a.parts().any(|slot| b.parts().any(|other| other == slot));
        let pairs = (0..count).flat_map(|a| (0..count).map(move |b| [a, b]));
        let shared: Vec<[usize; 2]> =
            pairs.filter(|[a, b]| a != b && shares(&self.loops[*a], &self.loops[*b])).collect();
        let group = components(count, &shared);
        for number in 0..count {
            let beside = (0..count).filter(|other| group[*other] == group[number]);
            let beside: Vec<&LoopValues> = beside.map(|other| &self.loops[other]).collect();
            let whole = beside.iter().find_map(|own| Some((own.members(), own.why_whole()?)));
            let why = match whole {
                Some((members, why)) => {
                    let names: Vec<&str> = members.iter().map(|slot| instances[*slot].name()).collect();
                    format!("as the loop of {} beside it does, {why}", names.join(", "))
                }
                None if beside.iter().any(|own| own.integrates()) => continue,
                None => "as outputs follow all its values at once".to_owned(),
            };
            if self.loops[number].why_whole().is_none() {
                self.loops[number].make_whole(why);
            }
        }
    }

    /// Finds those that repeat the step: an FMU that a loop reaches is part of it if it acts on the loop.
    fn find_members(&mut self, links: &Links, edges: &[[usize; 2]], count: usize) {
        let iterated: Vec<[usize; 2]> =
            links.numbers.iter().filter(|link| link.is_iterated()).map(Link::slots).collect();
        let backwards: Vec<[usize; 2]> = edges.iter().map(|[from, to]| [*to, *from]).collect();
        let behind = reached(count, edges, iterated.iter().map(|[_, to]| *to));
        let before = reached(count, &backwards, iterated.iter().map(|[from, _]| *from));
        let repeats = |slot: &usize| before[*slot] || iterated.iter().any(|[_, to]| to == slot);
        self.members = (0..count).filter(|slot| behind[*slot] && repeats(slot)).collect();
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
    pub fn begin(&mut self, links: &mut Links, instances: &mut [Instance]) -> Result {
        self.loops.iter_mut().try_for_each(|own| own.begin(links, instances))?;
        self.members.iter().try_for_each(|slot| instances[*slot].save_state(self.state))
    }

    /// Back to the state at the start of the step.
    fn back(&self, instances: &mut [Instance]) -> Result {
        self.members.iter().try_for_each(|slot| instances[*slot].restore_state(self.state))
    }

    /// Back to state and values at the start of the step, from which a shorter one begins.
    pub fn discard(&self, links: &mut Links, instances: &mut [Instance]) -> Result {
        self.loops.iter().for_each(|own| own.back(links));
        self.back(instances)
    }

    /// Repeats the trials of the members until the values no longer change. Returns a message if a loop was not solved.
    pub fn solve(
        &mut self,
        order: &StepOrder,
        span: &mut Span,
        links: &mut Links,
        subsystems: &mut Subsystems,
    ) -> Result<Option<String>> {
        let (mut repetitions, mut begun) = (0, false);
        loop {
            if span.broken.load(Ordering::Relaxed) || self.stand(links, &subsystems.instances)? {
                return Ok(None);
            }
            if !std::mem::replace(&mut begun, true) {
                self.loops.iter_mut().for_each(LoopValues::begin_quarters);
            }
            let by_quarters = self.loops.iter().any(LoopValues::goes_by_quarters);
            let hopeless = repetitions == MOST || self.loops.iter().any(LoopValues::runs_away);
            if by_quarters && (hopeless || self.loops.iter().any(LoopValues::lags)) {
                self.loops.iter_mut().for_each(LoopValues::go_whole);
                repetitions = 0;
            } else if hopeless {
                return Ok(Some(self.unsolved(repetitions, span, links, &subsystems.instances)));
            }
            repetitions += 1;
            self.repeat(order, span, links, subsystems)?;
        }
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
        let quartered: Vec<usize> =
            self.loops.iter().filter(|own| own.goes_by_quarters()).flat_map(LoopValues::parts).collect();
        let (by_quarters, whole): (Vec<usize>, Vec<usize>) =
            self.members.iter().partition(|slot| quartered.contains(slot));
        for k in (0..4).take_while(|_| !by_quarters.is_empty()) {
            let mut quarter = span.quarter(k);
            self.try_part(Part::Quarter(k), &by_quarters, order, &mut quarter, links, subsystems)?;
            if quarter.broken.load(Ordering::Relaxed) {
                return match self.refuse_quarters(&by_quarters, span, subsystems) {
                    true => self.repeat(order, span, links, subsystems),
                    false => Ok(()),
                };
            }
            if k < 3 {
                for own in self.loops.iter_mut().filter(|own| own.goes_by_quarters()) {
                    own.take_within(k as usize, links, &subsystems.instances)?;
                }
                let still = Motion { x: &[], v: &[] };
                let mut all = by_quarters.iter();
                all.try_for_each(|slot| subsystems.instances[*slot].commit(&quarter.step, &[], &still))?;
            }
        }
        self.try_part(Part::Whole, &whole, order, span, links, subsystems)
    }

    /// A quarter was not made: where it was discarded, the step is to be tried whole; a failure ends it.
    fn refuse_quarters(&mut self, by_quarters: &[usize], span: &Span, subsystems: &mut Subsystems) -> bool {
        let failed = |slot: &usize| matches!(subsystems.schedules[*slot].trial.as_deref(), Some(Err(_)));
        if by_quarters.iter().any(failed) {
            span.broken.store(true, Ordering::Relaxed);
            return false;
        }
        by_quarters.iter().for_each(|slot| subsystems.schedules[*slot].trial = None);
        self.loops.iter_mut().for_each(LoopValues::go_whole);
        true
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
        let quarters = part != Part::Whole;
        let mut own = self.loops.iter().filter(|own| own.goes_by_quarters() == quarters);
        own.try_for_each(|own| own.set(part, links, &mut subsystems.instances))?;
        if let Part::Quarter(k) = part {
            let mut lines =
                links.numbers.iter().filter(|l| l.follows_line() && members.contains(&l.slots()[1]));
            lines.try_for_each(|link| link.pass_on_quarter(k, &mut subsystems.instances))?;
        }
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

    /// Whether the outputs are those that the trial was made with; where not, a better guess is there. Loops that take values of others within the step
    /// may stand later than those.
    fn stand(&mut self, links: &mut Links, instances: &[Instance]) -> Result<bool> {
        let mut all = true;
        for own in &mut self.loops {
            all &= own.stands(links, instances)? && !own.lags();
        }
        Ok(all)
    }
}

/// Warnings of connections that are to be iterated, in a loop that another connection opens by a delay.
pub(super) fn open_loops(links: &Links, instances: &[Instance]) -> Vec<String> {
    let every: Vec<[usize; 2]> = links.numbers.iter().map(Link::slots).collect();
    let whole = components(instances.len(), &every);
    let within = components(instances.len(), &edges(links, instances));
    let is_open = |link: &&Link| {
        let [from, to] = link.slots();
        link.is_iterated() && from != to && whole[from] == whole[to] && within[from] != within[to]
    };
    let warning = |link: &Link| {
        let own = whole[link.slots()[0]];
        let delays = |l: &&Link| {
            l.slots().iter().all(|slot| whole[*slot] == own) && !l.is_within_the_step() && !l.is_iterated()
        };
        let late: Vec<String> =
            links.numbers.iter().filter(delays).flat_map(|l| l.names(instances)).collect();
        format!(
            "{} is to be iterated, but its loop is open: {} passes its value with a delay of a step; `order = \"iterate\"` there \
             closes it",
            link.names(instances).join(", "),
            late.join(", ")
        )
    };
    links.numbers.iter().filter(is_open).map(warning).collect()
}

/// Subsystems that pass values to others within a step.
fn edges(links: &Links, instances: &[Instance]) -> Vec<[usize; 2]> {
    let numbers = links.numbers.iter().filter(|link| link.is_within_the_step() || link.is_iterated());
    let discrete = links.discrete.iter().filter(|link| link.is_within_the_step());
    let discrete = discrete.map(|link| link.end_ids(instances).map(|(slot, _)| slot));
    numbers.map(Link::slots).chain(discrete).collect()
}

/// Why a subsystem makes no steps of a quarter of the length, if it does not.
fn makes_no_quarters(instance: &Instance, schedule: &StepSchedule) -> Option<String> {
    let has_clocks = || instance.variables().iter().any(|v| v.value_type == ValueType::Clock);
    let why = match cannot_repeat(instance, schedule) {
        Some(why) => why,
        None if instance.capabilities().has(Capabilities::FIXED_STEP) => "makes steps of one length only",
        None if has_clocks() => "has clocks",
        None => return None,
    };
    Some(format!("`{}` {why}", instance.name()))
}

/// Why a subsystem cannot repeat a step by itself.
fn cannot_repeat(instance: &Instance, schedule: &StepSchedule) -> Option<&'static str> {
    let can = |what| instance.capabilities().has(what);
    match schedule {
        StepSchedule { is_fmu: false, .. } => Some("is no FMU"),
        StepSchedule { glued: true, .. } => Some("is glued"),
        StepSchedule { step_multiple: 2.., .. } => Some("makes steps of another length"),
        _ if !(can(Capabilities::RETRY) && can(Capabilities::STATE)) => Some("cannot save its state"),
        _ => None,
    }
}
