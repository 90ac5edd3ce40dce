//! The time line: events fire once, at a communication point, and set variables or call actions.

use super::access::{Directory, VariableRef};
use serde_json::Value;
use terraglue_diagnostics::closest;
use terraglue_host::Instance;
use terraglue_scenario::{Comparison, EventSpec, InputError, Source, Trigger};
use terraglue_subsystem::Effect;

/// An event with its names resolved.
#[derive(Debug)]
struct ScheduledEvent {
    trigger: Resolved,
    due: Due,
    fired: bool,
}

/// A trigger with its name resolved.
#[derive(Debug)]
pub enum Resolved {
    /// At a time, s.
    At(f64),
    /// When a comparison holds.
    When(VariableRef, Comparison, f64),
}

/// Effect of an event.
#[derive(Clone, Debug, PartialEq)]
pub struct Due {
    /// Full name and new value.
    pub set: Vec<(String, Value)>,
    /// `subsystem.action`.
    pub act: Vec<String>,
}

/// All events of a scenario.
#[derive(Debug, Default)]
pub struct TimeLine {
    events: Vec<ScheduledEvent>,
}

impl TimeLine {
    /// Resolves names and checks what the events would set.
    ///
    /// # Errors
    /// An event that names a variable or action that does not exist, or sets a value that is not accepted or comes too late.
    pub fn new(
        specs: &[EventSpec],
        directory: &Directory,
        instances: &[Instance],
        source: &Source,
    ) -> Result<Self, Box<InputError>> {
        let variable = |name: &str, spec: &EventSpec| {
            directory.find(name).ok_or_else(|| {
                let message = format!("variable `{name}` does not exist");
                source.error_in(spec.entry, &[name], message, directory.hint(name))
            })
        };
        let mut events = Vec::new();
        for spec in specs {
            for (name, value) in &spec.set {
                let found = variable(name, spec)?;
                let late = matches!(spec.trigger, Trigger::At(t) if t > 0.0);
                if late && found.describe(instances).effect == Effect::NeedsReset {
                    let reason = format!("`{name}` can only be set before the first step, not by an event");
                    let help = "give it in the table of its subsystem, where there is a key for it, or take `at_s = 0.0`";
                    return Err(source.error_in(spec.entry, &[name], reason, Some(help.into())));
                }
                if let Some(reason) = found.objection(instances, value) {
                    let help = format!("`terraglue variables SCENARIO {name}` shows what it takes");
                    return Err(source.error_in(spec.entry, &[name], reason, Some(help)));
                }
            }
            for action in &spec.act {
                check_action(action, instances)
                    .map_err(|(message, help)| source.error_in(spec.entry, &[action], message, help))?;
            }
            let trigger = Resolved::new(&spec.trigger, |name| variable(name, spec))?;
            let due = Due { set: spec.set.clone(), act: spec.act.clone() };
            events.push(ScheduledEvent { trigger, due, fired: false });
        }
        Ok(Self { events })
    }

    /// The next event that is due at the communication point t; call until `None`.
    pub fn next_due(&mut self, t: f64, h: f64, instances: &[Instance]) -> Option<Due> {
        let event = self.events.iter_mut().find(|e| !e.fired && e.trigger.holds(t, h, instances))?;
        event.fired = true;
        Some(event.due.clone())
    }

    /// The next time after t at which an event fires, s; ∞: none that is known.
    pub fn next_time(&self, t: f64) -> f64 {
        let times = self.events.iter().filter(|e| !e.fired).map(|e| e.trigger.time());
        times.filter(|time| *time > t).fold(f64::INFINITY, f64::min)
    }

    /// Whether an event at the start sets a variable.
    pub fn sets_at_start(&self) -> bool {
        self.events.iter().any(|e| e.trigger.time() <= 0.0 && !e.due.set.is_empty())
    }

    /// Which events have fired, for a snapshot.
    pub fn fired(&self) -> Vec<bool> {
        self.events.iter().map(|e| e.fired).collect()
    }

    /// Back to a snapshot.
    pub fn set_fired(&mut self, fired: &[bool]) {
        for (event, fired) in self.events.iter_mut().zip(fired) {
            event.fired = *fired;
        }
    }
}

impl Resolved {
    /// Finds the variable of a condition.
    pub fn new<E>(trigger: &Trigger, find: impl Fn(&str) -> Result<VariableRef, E>) -> Result<Self, E> {
        Ok(match trigger {
            Trigger::At(t) => Self::At(*t),
            Trigger::When { variable, comparison, value } => Self::When(find(variable)?, *comparison, *value),
        })
    }

    /// When it holds, where that is known beforehand, s.
    pub fn time(&self) -> f64 {
        match self {
            Self::At(at) => *at,
            Self::When(..) => f64::INFINITY,
        }
    }

    /// Whether it holds at the communication point t.
    pub fn holds(&self, t: f64, h: f64, instances: &[Instance]) -> bool {
        match self {
            // t is a multiple of h up to rounding
            Self::At(at) => t >= at - 1e-9 * h,
            Self::When(variable, comparison, value) => {
                variable.number(instances).is_ok_and(|x| compare(*comparison, x, *value))
            }
        }
    }
}

fn compare(comparison: Comparison, a: f64, b: f64) -> bool {
    match comparison {
        Comparison::Less => a < b,
        Comparison::LessEqual => a <= b,
        Comparison::Greater => a > b,
        Comparison::GreaterEqual => a >= b,
        Comparison::Equal => a == b,
        Comparison::NotEqual => a != b,
    }
}

fn check_action(action: &str, instances: &[Instance]) -> Result<(), (String, Option<String>)> {
    let (subsystem, name) = action.split_once('.').unwrap_or((action, ""));
    let Some(instance) = instances.iter().find(|i| i.name() == subsystem) else {
        let help = format!("subsystems are {}", names(instances.iter().map(Instance::name)));
        return Err((format!("action `{action}`: there is no subsystem `{subsystem}`"), Some(help)));
    };
    let actions = instance.subsystem().actions();
    if actions.iter().any(|a| a.name == name) {
        return Ok(());
    }
    let nearest = closest(name, actions.iter().map(|a| a.name.as_str()));
    let help = nearest.map(|action| format!("did you mean `{subsystem}.{action}`?"));
    Err((format!("`{subsystem}` has no action `{name}`"), help))
}

fn names<'a>(all: impl Iterator<Item = &'a str>) -> String {
    all.collect::<Vec<_>>().join(", ")
}
