//! The order in which FMUs without glue make their steps.
//!
//! An FMU with an output that depends on an input at once (`ModelStructure`) is stepped after the FMU that feeds this input, with the value at
//! the end of the step, so that a chain of such outputs delays no value. Values of a loop of such outputs, FMUs with clocks, subsystems
//! of another kind and those that make steps of another length keep the order of Jacobi: their inputs are the outputs of the start of the step.
//! FMUs that take values of loops that are iterated follow when these are solved.

use super::schedule::StepSchedule;
use crate::graph::levels;
use crate::listed::listed;
use crate::signals::{ConnectedValue, Faults, FeedThroughs, Links, Place, named_ends};
use terraglue_diagnostics::Result;
use terraglue_host::Instance;

/// Connections that pass values within a step, by the level of the subsystem that they feed; level 0 has none.
#[derive(Debug, Default)]
pub(super) struct StepOrder {
    levels: Vec<Passed>,
    /// Number of levels that are stepped before loops are solved.
    before_loops: usize,
}

/// Numbers of connections.
#[derive(Debug, Default)]
struct Passed {
    numbers: Vec<usize>,
    discrete: Vec<usize>,
}

impl StepOrder {
    /// Orders the FMUs of a run and writes their levels into their schedules, and into the connections which of them wait for the end of a step.
    pub fn new(
        links: &mut Links,
        faults: &Faults,
        feed_through: &FeedThroughs,
        instances: &[Instance],
        schedules: &mut [StepSchedule],
    ) -> Self {
        let candidates = candidates(links, faults, instances, schedules);
        let [outside, inside] = feed_through.by_loops(&candidates);
        warn_of_loops(&inside, instances);
        let passed = feed_through.in_one_pass(outside);
        let edges: Vec<[usize; 2]> = passed.iter().map(|v| v.ends.map(|(slot, _)| slot)).collect();
        let level = levels(instances.len(), &edges);
        let mut order = Self::default();
        order.levels.resize_with(level.iter().max().map_or(1, |l| l + 1), Passed::default);
        order.before_loops = order.levels.len();
        for value in passed {
            let own = &mut order.levels[level[value.ends[1].0]];
            match value.connection {
                Place::Number(k) if !links.numbers[k].is_within_the_step() => {
                    links.numbers[k].pass_within_the_step();
                    own.numbers.push(k);
                }
                Place::Discrete(k) if !links.discrete[k].is_within_the_step() => {
                    links.discrete[k].pass_within_the_step();
                    own.discrete.push(k);
                }
                _ => {}
            }
        }
        schedules.iter_mut().zip(&level).for_each(|(schedule, level)| schedule.level = *level as u32);
        order
    }

    /// Puts FMUs, and all that they are passed, behind the loops; none of the others takes a value of theirs within the step.
    pub fn put_behind_loops(
        &mut self,
        followers: &[usize],
        links: &Links,
        instances: &[Instance],
        schedules: &mut [StepSchedule],
    ) {
        let Some(first) = followers.iter().map(|slot| schedules[*slot].level).min() else { return };
        let before = self.levels.len();
        let shift = before - first as usize;
        followers.iter().for_each(|slot| schedules[*slot].level += shift as u32);
        let last = followers.iter().map(|slot| schedules[*slot].level as usize).max().unwrap_or(before);
        self.levels.resize_with(last + 1, Passed::default);
        for level in 0..before {
            let Passed { numbers, discrete } = std::mem::take(&mut self.levels[level]);
            for k in numbers {
                let to = links.numbers[k].slots()[1];
                self.levels[schedules[to].level as usize].numbers.push(k);
            }
            for k in discrete {
                let to = links.discrete[k].end_ids(instances)[1].0;
                self.levels[schedules[to].level as usize].discrete.push(k);
            }
        }
    }

    /// Number of levels that are stepped before loops are solved, at least 1.
    pub fn levels_before_loops(&self) -> usize {
        self.before_loops.max(1)
    }

    /// Number of levels, at least 1.
    pub fn levels(&self) -> usize {
        self.levels.len().max(1)
    }

    /// Passes the outputs at the end of the step to those subsystems of a level that are stepped then.
    pub fn pass_on(
        &self,
        level: usize,
        to: impl Fn(usize) -> bool,
        links: &mut Links,
        instances: &mut [Instance],
    ) -> Result {
        let Some(passed) = self.levels.get(level) else { return Ok(()) };
        for k in &passed.numbers {
            let link = &mut links.numbers[*k];
            if to(link.slots()[1]) {
                link.read(instances)?;
                link.pass_on(instances)?;
            }
        }
        for k in &passed.discrete {
            let link = &mut links.discrete[*k];
            if to(link.ends()[1].slot()) {
                link.read(instances)?;
                link.pass_on(instances)?;
            }
        }
        Ok(())
    }
}

/// Warns of values that follow each other at once in a loop, and are late by a step therefore.
fn warn_of_loops(inside: &[ConnectedValue], instances: &[Instance]) {
    if inside.is_empty() {
        return;
    }
    let names: Vec<String> = inside.iter().map(|v| named_ends(v.ends, instances)).collect();
    let numbers = inside.iter().all(|v| matches!(v.connection, Place::Number(_)));
    let solved = if numbers { "`order = \"iterate\"` solves the loop, " } else { "" };
    log::warn!(
        "{} follow each other at once in a loop (ModelStructure), so that they are late by a step and can diverge: {solved}\
         `order = \"jacobi\"` takes the delay",
        listed(&names)
    );
}

/// Values that may be passed within a step.
fn candidates(
    links: &Links,
    faults: &Faults,
    instances: &[Instance],
    schedules: &[StepSchedule],
) -> Vec<ConnectedValue> {
    let orderly = |slot: usize| {
        let StepSchedule { is_fmu, glued, step_multiple, .. } = schedules[slot];
        is_fmu && !glued && step_multiple == 1
    };
    let within = |[from, to]: [usize; 2]| from != to && orderly(from) && orderly(to);
    let numbers = links.numbers.iter().enumerate();
    let numbers =
        numbers.filter(|(k, l)| l.is_ordered() && within(l.slots()) && faults.that_changes(*k).is_none());
    let numbers = numbers.flat_map(|(k, link)| {
        link.ends().map(move |(ends, _)| ConnectedValue { connection: Place::Number(k), ends })
    });
    let discrete = links.discrete.iter().enumerate().filter(|(_, d)| d.is_ordered());
    let discrete =
        discrete.map(|(k, d)| ConnectedValue { connection: Place::Discrete(k), ends: d.end_ids(instances) });
    numbers.chain(discrete.filter(|v| within(v.ends.map(|(slot, _)| slot)))).collect()
}
