//! The order in which FMUs without glue make their steps.
//!
//! An FMU whose outputs depend on its inputs at once (`ModelStructure`) is stepped after the FMUs that feed it, with their outputs at the
//! end of the step, so that a chain of such FMUs delays no value. FMUs of a loop in which all feed through, FMUs with clocks, subsystems
//! of another kind and those that make steps of another length keep the order of Jacobi: their inputs are the outputs of the start of the step.

use super::schedule::StepSchedule;
use crate::signals::{Faults, Links, VariableRef};
use terraglue_diagnostics::Result;
use terraglue_host::Instance;
use terraglue_scenario::ModuleKind;
use terraglue_subsystem::Capabilities;

/// Connections that pass values within a step, by the level of the subsystem that they feed; level 0 has none.
#[derive(Debug, Default)]
pub(super) struct StepOrder {
    levels: Vec<Passed>,
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
        instances: &[Instance],
        schedules: &mut [StepSchedule],
    ) -> Self {
        let orderly = |slot: usize| {
            let StepSchedule { glued, step_multiple, .. } = schedules[slot];
            ModuleKind::is_fmu(instances[slot].module()) && !glued && step_multiple == 1
        };
        let follows =
            |slot: usize| orderly(slot) && instances[slot].capabilities().has(Capabilities::STEP_FEEDTHROUGH);
        let within = |from: usize, to: usize| from != to && orderly(from) && follows(to);
        let numbers = links.numbers.iter().enumerate();
        let numbers: Vec<_> = numbers
            .filter(|(k, l)| l.is_ordered() && within(l.slots()[0], l.slots()[1]) && !faults.change(*k))
            .map(|(k, l)| (k, l.slots()))
            .collect();
        let discrete = links.discrete.iter().enumerate();
        let discrete: Vec<_> = discrete
            .filter(|(_, d)| d.is_ordered())
            .map(|(k, d)| (k, d.ends().map(VariableRef::slot)))
            .filter(|(_, [from, to])| within(*from, *to))
            .collect();
        let edges: Vec<[usize; 2]> = numbers.iter().chain(&discrete).map(|(_, ends)| *ends).collect();
        let level = levels(instances.len(), &edges);
        let mut order = Self::default();
        order.levels.resize_with(level.iter().max().map_or(1, |l| l + 1), Passed::default);
        for (k, [_, to]) in numbers.into_iter().filter(|(_, [a, b])| level[*a] < level[*b]) {
            links.numbers[k].pass_within_the_step();
            order.levels[level[to]].numbers.push(k);
        }
        for (k, [_, to]) in discrete.into_iter().filter(|(_, [a, b])| level[*a] < level[*b]) {
            links.discrete[k].pass_within_the_step();
            order.levels[level[to]].discrete.push(k);
        }
        schedules.iter_mut().zip(&level).for_each(|(schedule, level)| schedule.level = *level as u32);
        order
    }

    /// Number of levels, at least 1.
    pub fn levels(&self) -> usize {
        self.levels.len().max(1)
    }

    /// Passes the outputs at the end of the step to the subsystems of a level.
    pub fn pass_on(&self, level: usize, links: &mut Links, instances: &mut [Instance]) -> Result {
        let Some(passed) = self.levels.get(level) else { return Ok(()) };
        for k in &passed.numbers {
            links.numbers[*k].read(instances)?;
            links.numbers[*k].pass_on(instances)?;
        }
        for k in &passed.discrete {
            links.discrete[*k].read(instances)?;
            links.discrete[*k].pass_on(instances)?;
        }
        Ok(())
    }
}

/// Length of the longest path of edges to each node; edges within a loop do not count.
fn levels(count: usize, edges: &[[usize; 2]]) -> Vec<usize> {
    let mut next = vec![Vec::new(); count];
    edges.iter().for_each(|[from, to]| next[*from].push(*to));
    let reach = |start: usize| {
        let (mut seen, mut open) = (vec![false; count], vec![start]);
        while let Some(node) = open.pop() {
            for to in next[node].iter().filter(|to| !std::mem::replace(&mut seen[**to], true)) {
                open.push(*to);
            }
        }
        seen
    };
    let reached: Vec<Vec<bool>> = (0..count).map(reach).collect();
    let plain: Vec<[usize; 2]> = edges.iter().copied().filter(|[a, b]| !reached[*b][*a]).collect();
    let mut level = vec![0; count];
    // without loops the longest path has fewer edges than there are nodes
    for _ in 0..count {
        for [from, to] in &plain {
            level[*to] = level[*to].max(level[*from] + 1);
        }
    }
    level
}

#[cfg(test)]
mod tests {
    use super::levels;

    #[test]
    fn a_chain_is_ordered_and_a_loop_is_not() {
        assert_eq!(levels(4, &[[3, 1], [1, 0], [3, 0]]), [2, 1, 0, 0]);
        // 0 and 1 feed each other; 2 comes after both, whatever their order
        assert_eq!(levels(3, &[[0, 1], [1, 0], [1, 2]]), [0, 0, 1]);
        assert_eq!(levels(2, &[]), [0, 0]);
    }
}
