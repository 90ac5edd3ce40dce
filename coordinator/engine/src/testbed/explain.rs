//! Flow of values in a run: the order of the exchange, effect and delay of every connection, loops.

use super::Testbed;
use super::group::Group;
use super::loops::Loops;
use super::schedule::StepSchedule;
use super::step_order::StepOrder;
use crate::graph::{components, in_loops};
use crate::signals::{Links, VariableRef, streams};
use serde::{Deserialize, Serialize};
use terraglue_host::Instance;
use terraglue_scenario::{Extrapolate, Scenario};

/// Output of `terraglue run --explain`, also shown in the report; nothing in it was measured.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Explanation {
    /// Parts of a step, in this order.
    pub order: Vec<String>,
    /// All connections.
    pub connections: Vec<ConnectionNote>,
    /// Subsystems whose connections come back to them.
    pub loops: Vec<String>,
}

/// A connection in words.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ConnectionNote {
    /// Full name of the output.
    pub from: String,
    /// Full name of the input.
    pub to: String,
    /// Result for a value x, with units.
    pub value: String,
    /// Steps from when a value holds to the end of the step that it acts on.
    pub delay: String,
    /// Why.
    pub why: String,
}

impl Testbed {
    /// Explains the exchange of a run.
    pub fn explain(&self) -> Explanation {
        let sight = Explained {
            instances: self.instances(),
            links: &self.signals.links,
            schedules: &self.subsystems.schedules,
            groups: &self.glued.groups,
            order: self.uncoupled.order(),
            loops: self.uncoupled.loops(),
        };
        let ends = sight.ends();
        Explanation {
            order: sight.order(&ends),
            connections: ends.iter().map(|end| sight.connection_note(end)).collect(),
            loops: sight.loops(&ends),
        }
    }
}

/// Data of an explanation.
struct Explained<'a> {
    instances: &'a [Instance],
    links: &'a Links,
    schedules: &'a [StepSchedule],
    groups: &'a [Group],
    order: &'a StepOrder,
    loops: &'a Loops,
}

impl Explained<'_> {
    fn ends(&self) -> Vec<ConnectionEnds> {
        let numbers = self.links.numbers.iter().flat_map(|link| {
            let passes = match () {
                () if link.is_within_the_step() => Passes::AtEnd,
                () if link.is_iterated() => Passes::Repeatedly,
                () => match link.extrapolates() {
                    Extrapolate::Constant => Passes::AtStart,
                    Extrapolate::Linear => Passes::AlongLine,
                    Extrapolate::Derivatives => Passes::AlongDerivative,
                },
            };
            link.ends().map(move |([from, to], conversion)| ConnectionEnds {
                from,
                to,
                conversion: Some(conversion),
                by_table: false,
                stream: false,
                passes,
            })
        });
        let variable = |at: VariableRef| (at.slot, at.describe(self.instances).id);
        let discrete = self.links.discrete.iter().map(|d| {
            let [from, to] = d.ends().map(variable);
            ConnectionEnds {
                from,
                to,
                conversion: d.conversion(),
                by_table: d.has_table(),
                stream: false,
                passes: if d.is_within_the_step() { Passes::AtEnd } else { Passes::AtStart },
            }
        });
        let places: Vec<_> = streams(self.instances).map(|(_, place)| place).collect();
        let messages = self.links.streams.iter().map(|l| {
            let (slot, k) = places[l.stream()];
            ConnectionEnds {
                from: (slot, k as u32),
                to: variable(l.to()),
                conversion: None,
                by_table: false,
                stream: true,
                passes: Passes::AtStart,
            }
        });
        numbers.chain(discrete).chain(messages).collect()
    }

    fn order(&self, ends: &[ConnectionEnds]) -> Vec<String> {
        let name = |slot: usize| self.instances[slot].name();
        let mut order = Vec::new();
        let (numbers, discrete) = self.links.pass_at_start(self.instances);
        if numbers || discrete {
            order.push(
                "once, at the start: connected values are passed on until they agree, loops of numbers by Newton".into(),
            );
        }
        order.push("events and faults of the communication point".into());
        if !ends.is_empty() {
            let [mut from, mut to] = [|e: &ConnectionEnds| e.from.0, |e: &ConnectionEnds| e.to.0]
                .map(|f| ends.iter().map(f).collect::<Vec<_>>());
            for slots in [&mut from, &mut to] {
                slots.sort_unstable();
                slots.dedup();
            }
            let list = |slots: &[usize]| slots.iter().map(|s| name(*s)).collect::<Vec<_>>().join(", ");
            order.push(format!(
                "all outputs are read: {}; then all inputs are set: {}",
                list(&from),
                list(&to)
            ));
        }
        order.extend(self.steps_without_glue());
        for group in self.groups {
            let members: Vec<&str> = group.problem.members().map(name).collect();
            order.push(format!(
                "glued together by `{}`, without delay: {}",
                group.strategy.name(),
                members.join(", ")
            ));
        }
        let all: Vec<&str> = self.instances.iter().map(Instance::name).collect();
        order.push(format!("the step is accepted by all: {}", all.join(", ")));
        order
    }

    /// Steps of subsystems without glue, level by level.
    fn steps_without_glue(&self) -> Vec<String> {
        let name = |slot: usize| self.instances[slot].name();
        let mut order = Vec::new();
        let first = |(_, turn): &(&Instance, &StepSchedule)| !turn.glued && turn.level == 0;
        let alone = self.instances.iter().zip(self.schedules).filter(first);
        let alone: Vec<String> = alone
            .map(|(instance, turn)| match turn.step_multiple {
                1 => instance.name().to_owned(),
                n => format!("{} (every {n} steps)", instance.name()),
            })
            .collect();
        if !alone.is_empty() {
            order.push(format!("a step of each subsystem without glue, in any order: {}", alone.join(", ")));
        }
        let level_note = |level: usize| {
            let follows = self.schedules.iter().enumerate().filter(|(_, turn)| turn.level as usize == level);
            let follows: Vec<&str> = follows.map(|(slot, _)| name(slot)).collect();
            format!("then a step of those that take outputs of its end: {}", follows.join(", "))
        };
        let before = self.order.levels_before_loops();
        order.extend((1..before).map(level_note));
        if !self.loops.is_empty() {
            order.push("the FMUs of loops repeat the step until their values stand".into());
        }
        order.extend((before..self.order.levels()).map(level_note));
        order
    }

    fn connection_note(&self, end: &ConnectionEnds) -> ConnectionNote {
        if end.stream {
            return self.stream_note(end);
        }
        let full = |(slot, id): (usize, u32)| {
            let variable = self.instances[slot].variables().iter().find(|v| v.id == id);
            let name = format!("{}.{}", self.instances[slot].name(), variable.map_or("?", |v| &v.name));
            (name, variable.map(|v| v.unit.clone()).unwrap_or_default())
        };
        let ((from, unit_from), (to, unit_to)) = (full(end.from), full(end.to));
        let units = match (unit_from.is_empty(), unit_to.is_empty()) {
            (false, false) => format!(" ({unit_from} → {unit_to})"),
            (true, true) => String::new(),
            _ => " (no conversion: only one side has a unit)".into(),
        };
        let value = match end.conversion {
            None if end.by_table => "by a table".to_owned(),
            None | Some((1.0, 0.0)) => "x".to_owned(),
            Some((a, 0.0)) => format!("{a}·x"),
            Some((a, b)) => format!("{a}·x + {b}"),
        };
        let (delay, why) = match (end.passes, self.schedules[end.from.0].step_multiple) {
            (Passes::Repeatedly, _) => (
                "0".to_owned(),
                "source and target repeat the step until its values are those that it was made with"
                    .to_owned(),
            ),
            (Passes::AtEnd, _) => (
                "0".to_owned(),
                "its target is stepped after its source, with the output at the end of the step".to_owned(),
            ),
            (Passes::AlongLine, n) => (
                n.to_string(),
                "read at the start of a step; the input follows the line through the last two values"
                    .to_owned(),
            ),
            (Passes::AlongDerivative, n) => (
                n.to_string(),
                "read at the start of a step; the input follows the derivative that its source provides"
                    .to_owned(),
            ),
            (Passes::AtStart, 1) => {
                ("1".to_owned(), "read at the start of a step and held to its end".to_owned())
            }
            (Passes::AtStart, n) => (
                format!("1 to {n}"),
                format!("its source makes one step of {n}, and the value is held between"),
            ),
        };
        ConnectionNote { from, to, value: value + &units, delay, why }
    }

    fn stream_note(&self, end: &ConnectionEnds) -> ConnectionNote {
        let (from, to) = (&self.instances[end.from.0], &self.instances[end.to.0]);
        let stream = from.subsystem().streams().get(end.from.1 as usize).map_or("?", |s| &s.name);
        let input = to.variables().iter().find(|v| v.id == end.to.1).map_or("?", |v| &v.name);
        ConnectionNote {
            from: format!("{}.{stream}", from.name()),
            to: format!("{}.{input}", to.name()),
            value: "each message".into(),
            delay: "1".into(),
            why: "set at the start of the step after the one that made it, and held until the next message"
                .into(),
        }
    }

    /// Each set of subsystems that reach each other over connections.
    fn loops(&self, ends: &[ConnectionEnds]) -> Vec<String> {
        let count = self.instances.len();
        let edges: Vec<[usize; 2]> = ends.iter().map(|e| [e.from.0, e.to.0]).collect();
        let component = components(count, &edges);
        let looped = in_loops(&component, &edges);
        let first = |k: &usize| looped[*k] && !component[..*k].contains(&component[*k]);
        (0..count)
            .filter(first)
            .map(|k| {
                let is_member = |j: usize| component[j] == component[k];
                let members = (0..count).filter(|j| is_member(*j));
                let names: Vec<&str> = members.map(|j| self.instances[j].name()).collect();
                let mut inside = ends.iter().filter(|e| is_member(e.from.0) && is_member(e.to.0));
                let how = match inside.all(|e| matches!(e.passes, Passes::Repeatedly | Passes::AtEnd)) {
                    true => format!(
                        "solved in every step, which its members repeat, {}",
                        self.loops.way(self.instances, k)
                    ),
                    false => "explicit, a connection in it is one step late".to_owned(),
                };
                format!("{}: {how}", names.join(" ⇄ "))
            })
            .collect()
    }
}

/// Slot and variable on either side.
struct ConnectionEnds {
    from: (usize, u32),
    to: (usize, u32),
    conversion: Option<(f64, f64)>,
    by_table: bool,
    /// Whether `from` is the number of a stream.
    stream: bool,
    passes: Passes,
}

/// When within a step a connection passes its values.
#[derive(Clone, Copy)]
enum Passes {
    /// Read at its start, and held.
    AtStart,
    /// Read at its start; the input follows a line.
    AlongLine,
    /// Read at its start; the input follows the derivative of the output.
    AlongDerivative,
    /// Read at its end, by a target that is stepped later.
    AtEnd,
    /// The step is repeated until they stand.
    Repeatedly,
}

impl Explanation {
    /// For a terminal.
    pub fn text(&self, scenario: &Scenario) -> String {
        let mut out = format!("A step of {} s:\n", scenario.time.step_s);
        for (k, line) in self.order.iter().enumerate() {
            out += &format!("  {}. {line}\n", k + 1);
        }
        if !self.connections.is_empty() {
            out += "Connections (delay in steps):\n";
        }
        for c in &self.connections {
            out += &format!("  {} → {}: {}; delay {}: {}\n", c.from, c.to, c.value, c.delay, c.why);
        }
        for line in &self.loops {
            out += &format!("Loop: {line}\n");
        }
        out
    }
}
