//! Direct feed-through of connected values, output by output: which connections have to be passed within a step so that no output is late,
//! and which inputs take the value at the end of a step.
//!
//! An FMU makes one step at a time, but its outputs differ: a mass tells its place without regard to the force of the end of the step, and its
//! acceleration with it. Loops are therefore looked for among outputs and inputs, not among FMUs.

use crate::graph::components;
use terraglue_host::Instance;
use terraglue_subsystem::FeedThrough;

/// Direct feed-through of all subsystems of a run.
#[derive(Debug)]
pub struct FeedThroughs {
    /// Of each subsystem.
    rows: Vec<Vec<FeedThrough>>,
    /// Those outputs of each subsystem by which it is judged when its inputs are held over a step.
    judged: Vec<Vec<usize>>,
}

/// A value that is connected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ConnectedValue {
    /// Place of the connection among those of its kind.
    pub connection: Place,
    /// Subsystem and variable on either side.
    pub ends: [(usize, u32); 2],
}

/// A connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Of numbers.
    Number(usize),
    /// Of another type.
    Discrete(usize),
}

impl FeedThroughs {
    /// Of subsystems between which values with these ends are connected.
    pub fn new(instances: &[Instance], ends: &[[(usize, u32); 2]]) -> Self {
        Self::of(instances.iter().map(|i| i.subsystem().feed_through()).collect(), ends)
    }

    fn of(rows: Vec<Vec<FeedThrough>>, ends: &[[(usize, u32); 2]]) -> Self {
        let mut all = Self { judged: vec![Vec::new(); rows.len()], rows };
        all.judge(ends);
        all
    }

    /// The outputs by which a subsystem acts on itself; without them those that are connected; without them all.
    fn judge(&mut self, ends: &[[(usize, u32); 2]]) {
        let count = self.rows.len();
        let edges: Vec<[usize; 2]> = ends.iter().map(|[from, to]| [from.0, to.0]).collect();
        let component = components(count, &edges);
        let mut kinds = [vec![Vec::new(); count], vec![Vec::new(); count]];
        for &[(from, output), (to, _)] in ends {
            let row = self.row(from, output);
            kinds[1][from].push(row);
            if component[from] == component[to] {
                kinds[0][from].push(row);
            }
        }
        let [back, connected] = kinds;
        for (slot, (back, connected)) in back.into_iter().zip(connected).enumerate() {
            let mut judged = match (back.is_empty(), connected.is_empty()) {
                (false, _) => back,
                (true, false) => connected,
                (true, true) => vec![self.rest(slot)],
            };
            judged.sort_unstable();
            judged.dedup();
            self.judged[slot] = judged;
        }
    }

    /// Entry of an output; that of the rest where none is its own.
    fn row(&self, slot: usize, output: u32) -> usize {
        let own = |row: &FeedThrough| (row.outputs[0]..row.outputs[1]).contains(&output);
        self.rows[slot].iter().position(own).unwrap_or(self.rest(slot))
    }

    /// Entry of all variables that the model structure says nothing of: they follow every input that any output follows.
    fn rest(&self, slot: usize) -> usize {
        self.rows[slot].len()
    }

    fn follows(&self, slot: usize, row: usize, input: u32) -> bool {
        match self.rows[slot].get(row) {
            Some(row) => row.follows(input),
            None => self.rows[slot].iter().any(|row| row.follows(input)),
        }
    }

    /// Whether an input that is held over a step takes the value at its end: an output by which the subsystem is judged follows it at once.
    pub fn takes_end(&self, (slot, input): (usize, u32)) -> bool {
        self.judged[slot].iter().any(|row| self.follows(slot, *row, input))
    }

    /// Those values that an output of their target follows at once: in no loop of such values, and in one.
    pub fn by_loops(&self, values: &[ConnectedValue]) -> [Vec<ConnectedValue>; 2] {
        let graph = Graph::new(self, values);
        let component = components(graph.nodes, &graph.edges);
        let followed = values.iter().enumerate().filter(|(k, _)| graph.followed[*k]);
        let in_loop = |k: usize| component[graph.value(k)] == component[graph.source[k]];
        let (inside, outside): (Vec<_>, Vec<_>) = followed.partition(|(k, _)| in_loop(*k));
        [outside, inside].map(|part| part.into_iter().map(|(_, value)| *value).collect())
    }

    /// Of values in no loop, those that can be passed within a step in which each subsystem is stepped once. Where outputs of one
    /// subsystem are needed before others of it can follow, it is stepped before: values that come back to it are late.
    pub fn in_one_pass(&self, mut values: Vec<ConnectedValue>) -> Vec<ConnectedValue> {
        loop {
            let edges: Vec<[usize; 2]> = values.iter().map(|v| v.ends.map(|(slot, _)| slot)).collect();
            let component = components(self.rows.len(), &edges);
            let inside = |v: &ConnectedValue| component[v.ends[0].0] == component[v.ends[1].0];
            let Some(any) = values.iter().find(|v| inside(v)) else { return values };
            let own = component[any.ends[0].0];
            let circle: Vec<&ConnectedValue> =
                values.iter().filter(|v| inside(v) && component[v.ends[0].0] == own).collect();
            let first = self.first(&circle);
            values.retain(|v| v.ends[1].0 != first || component[v.ends[0].0] != own);
        }
    }

    /// The subsystem of a circle that is stepped first: of those with an output that follows no value of the circle, the one to which the
    /// fewest values come back.
    fn first(&self, circle: &[&ConnectedValue]) -> usize {
        let into = |slot: usize| circle.iter().filter(move |v| v.ends[1].0 == slot);
        let begins = |v: &&&ConnectedValue| {
            let (slot, output) = v.ends[0];
            let row = self.row(slot, output);
            !into(slot).any(|back| self.follows(slot, row, back.ends[1].1))
        };
        let slots = circle.iter().filter(begins).map(|v| v.ends[0].0);
        slots.min_by_key(|slot| (into(*slot).count(), *slot)).unwrap_or(circle[0].ends[1].0)
    }
}

/// Outputs and connected values as nodes: from an output to the values that leave it, from a value to the outputs that follow it.
struct Graph {
    nodes: usize,
    edges: Vec<[usize; 2]>,
    /// Node of the first value.
    first_value: usize,
    /// Node of the output of each value.
    source: Vec<usize>,
    /// Whether an output follows it.
    followed: Vec<bool>,
}

impl Graph {
    fn new(of: &FeedThroughs, values: &[ConnectedValue]) -> Self {
        // per subsystem: its outputs, the rest, and one node that stands for every input
        let mut first = vec![0];
        first.extend(of.rows.iter().scan(0, |sum, rows| {
            *sum += rows.len() + 2;
            Some(*sum)
        }));
        let first_value = first[of.rows.len()];
        let mut graph = Self {
            nodes: first_value + values.len(),
            edges: Vec::new(),
            first_value,
            source: values.iter().map(|v| first[v.ends[0].0] + of.row(v.ends[0].0, v.ends[0].1)).collect(),
            followed: vec![false; values.len()],
        };
        graph.edges.extend(graph.source.iter().enumerate().map(|(k, source)| [*source, first_value + k]));
        let mut fed: Vec<Vec<(u32, usize)>> = vec![Vec::new(); of.rows.len()];
        values.iter().enumerate().for_each(|(k, v)| fed[v.ends[1].0].push((v.ends[1].1, k)));
        for (slot, mut fed) in fed.into_iter().enumerate() {
            fed.sort_unstable();
            graph.follow(&of.rows[slot], first[slot], &fed);
        }
        graph
    }

    /// Edges from the values that a subsystem takes, in ascending order of their inputs, to its outputs.
    fn follow(&mut self, rows: &[FeedThrough], first: usize, fed: &[(u32, usize)]) {
        let (rest, every) = (first + rows.len(), first + rows.len() + 1);
        if rows.iter().any(|row| row.inputs.contains(&FeedThrough::ALL)) {
            self.edges.extend(fed.iter().map(|(_, k)| [self.first_value + k, every]));
            fed.iter().for_each(|(_, k)| self.followed[*k] = true);
            self.edges.push([every, rest]);
        }
        for (row, own) in rows.iter().zip(first..) {
            if row.inputs.contains(&FeedThrough::ALL) {
                self.edges.push([every, own]);
                continue;
            }
            for [begin, end] in &row.inputs {
                let from = fed.partition_point(|(input, _)| input < begin);
                for (_, k) in fed[from..].iter().take_while(|(input, _)| input < end) {
                    self.followed[*k] = true;
                    self.edges.extend([[self.first_value + k, own], [self.first_value + k, rest]]);
                }
            }
        }
    }

    fn value(&self, k: usize) -> usize {
        self.first_value + k
    }
}

#[cfg(test)]
mod tests {
    use super::{ConnectedValue, FeedThroughs, Place};
    use terraglue_subsystem::FeedThrough;

    fn of(rows: Vec<Vec<FeedThrough>>, ends: &[[(usize, u32); 2]]) -> (FeedThroughs, Vec<ConnectedValue>) {
        let value = |(k, ends): (usize, &[(usize, u32); 2])| ConnectedValue {
            connection: Place::Number(k),
            ends: *ends,
        };
        (FeedThroughs::of(rows, ends), ends.iter().enumerate().map(value).collect())
    }

    fn output(id: u32, inputs: &[u32]) -> FeedThrough {
        FeedThrough { outputs: [id, id + 1], inputs: inputs.iter().map(|k| [*k, k + 1]).collect() }
    }

    fn passed(of: &FeedThroughs, values: &[ConnectedValue]) -> Vec<usize> {
        let kept = of.in_one_pass(of.by_loops(values)[0].clone());
        kept.iter().filter_map(|v| values.iter().position(|own| own == v)).collect()
    }

    /// A mass with input 0 (force), and outputs 1 (place) and 2 (acceleration); a spring with input 0 and output 1; a display.
    fn mass_and_spring() -> Vec<Vec<FeedThrough>> {
        vec![vec![output(1, &[]), output(2, &[0])], vec![output(1, &[0])], vec![output(1, &[0])]]
    }

    #[test]
    fn an_acceleration_makes_no_loop() {
        let to_spring = [(0, 1), (1, 0)];
        let (all, values) = of(mass_and_spring(), &[to_spring, [(1, 1), (0, 0)]]);
        assert_eq!(passed(&all, &values), [0]);
        assert!(!all.takes_end((0, 0)) && all.takes_end((1, 0)));
        let (all, values) = of(mass_and_spring(), &[to_spring, [(1, 1), (0, 0)], [(0, 2), (2, 0)]]);
        assert_eq!(passed(&all, &values), [0, 2]);
        assert!(!all.takes_end((0, 0)) && all.takes_end((1, 0)));
        // a spring that is driven by the acceleration is a loop
        let (all, values) = of(mass_and_spring(), &[[(0, 2), (1, 0)], [(1, 1), (0, 0)]]);
        assert!(passed(&all, &values).is_empty() && all.takes_end((0, 0)));
    }

    #[test]
    fn a_loop_is_late_and_all_after_it_is_not() {
        let gain = || vec![FeedThrough { outputs: [1, 2], inputs: vec![FeedThrough::ALL] }];
        let (all, values) =
            of(vec![gain(), gain(), gain()], &[[(0, 1), (1, 0)], [(1, 1), (0, 0)], [(1, 1), (2, 0)]]);
        assert_eq!(passed(&all, &values), [2]);
        // a variable of which nothing is known follows as any output does
        let (all, values) = of(vec![gain(), gain()], &[[(0, 7), (1, 0)], [(1, 1), (0, 0)]]);
        assert!(passed(&all, &values).is_empty());
    }
}
