//! Faults of single numbers: the value that a subsystem receives differs from the one that was sent.
//!
//! A fault of an output changes the number on every connection that leaves it, in the unit of the output; the output
//! itself, and its recording, stay true. A fault of an input changes what it is given: over its connection, or, where it
//! has none, what it was set to. Messages of a stream can be lost (drop-out) or frozen, on all connections that leave it or on
//! the one of an input. Begin and end at a time are met exactly, because steps end there.

use super::access::{Directory, VariableRef};
use super::connection::{Link, Links};
use super::event::Resolved;
use super::modifier::Modifier;
use super::stream_link::StreamLink;
use serde_json::Value;
use terraglue_diagnostics::{Error, Result};
use terraglue_gluing::memory::{Recall, Remember};
use terraglue_host::{Instance, Reply};
use terraglue_scenario::{FaultEnd, FaultSpec, InputError, Source};
use terraglue_subsystem::{Causality, Effect, ValueType};

/// A number on a connection that a fault changes.
#[derive(Debug)]
struct Entry {
    link: usize,
    number: usize,
    /// Conversion of the connection where the fault belongs to the output.
    conversion: (f64, f64),
    modifier: Modifier,
}

/// A connection of a stream whose messages a fault changes.
#[derive(Debug)]
struct Messages {
    link: usize,
    modifier: Modifier,
}

/// Places of a fault.
#[derive(Debug, Default)]
struct Places {
    entries: Vec<Entry>,
    messages: Vec<Messages>,
    own: Option<Own>,
}

/// An input without a connection.
#[derive(Debug)]
struct Own {
    variable: VariableRef,
    modifier: Modifier,
    /// Value that was set, and the value under the fault.
    sound: f64,
    told: f64,
}

#[derive(Debug)]
struct Fault {
    label: String,
    begin: Resolved,
    end: EndCondition,
    places: Places,
    /// Since when it is there, s.
    since: Option<f64>,
    over: bool,
}

#[derive(Debug)]
enum EndCondition {
    Never,
    Trigger(Resolved),
    After(f64),
}

/// All faults of a scenario, in the order of the file.
#[derive(Debug, Default)]
pub struct Faults {
    all: Vec<Fault>,
}

/// Change of a fault at a communication point.
pub type Change<'a> = (&'a str, bool);

impl Faults {
    /// Resolves names; `seed` is that of the world, `h` the step, s.
    ///
    /// # Errors
    /// A variable that does not exist or that no fault can change.
    pub fn new(
        specs: &[FaultSpec],
        links: &Links,
        directory: &Directory,
        instances: &[Instance],
        source: &Source,
        (seed, h): (u64, f64),
    ) -> std::result::Result<Self, Box<InputError>> {
        let one = |(number, spec): (usize, &FaultSpec)| -> std::result::Result<Fault, Box<InputError>> {
            let refuse = |(message, help): (String, Option<String>)| {
                source.error_in(spec.entry, &[&spec.variable], message, help)
            };
            let find = |name: &str| {
                let missing = || refuse((format!("variable `{name}` does not exist"), directory.hint(name)));
                directory.find(name).ok_or_else(missing)
            };
            let seed = spec.seed.unwrap_or_else(|| seed ^ (number as u64 + 1).rotate_left(32));
            let modifier = Modifier::new(spec.kind, seed, h);
            let places = match directory.streams().iter().position(|name| *name == spec.variable) {
                Some(stream) => of_stream(|l| l.stream() == stream, links, &modifier),
                None => place(find(&spec.variable)?, links, instances, &modifier),
            };
            let places = places.map_err(|why| refuse((format!("`{}` {why}", spec.variable), None)))?;
            Ok(Fault {
                label: format!("{} of {}", spec.kind.name(), spec.variable),
                begin: Resolved::new(&spec.start, find)?,
                end: match &spec.end {
                    FaultEnd::Never => EndCondition::Never,
                    FaultEnd::At(trigger) => EndCondition::Trigger(Resolved::new(trigger, find)?),
                    FaultEnd::After(duration) => EndCondition::After(*duration),
                },
                places,
                since: None,
                over: false,
            })
        };
        Ok(Self { all: specs.iter().enumerate().map(one).collect::<std::result::Result<_, _>>()? })
    }

    /// The first that changes numbers of a connection, by its place in the scenario.
    pub fn that_changes(&self, link: usize) -> Option<usize> {
        self.all.iter().position(|fault| fault.places.entries.iter().any(|entry| entry.link == link))
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.all.is_empty()
    }

    /// The next time after t at which one begins or ends, s; ∞: none that is known.
    pub fn next_time(&self, t: f64) -> f64 {
        let times = self.all.iter().filter(|f| !f.over).map(|fault| match (fault.since, &fault.end) {
            (None, _) => fault.begin.time(),
            (Some(_), EndCondition::Trigger(end)) => end.time(),
            (Some(since), EndCondition::After(duration)) => since + duration,
            (Some(_), EndCondition::Never) => f64::INFINITY,
        });
        times.filter(|time| *time > t).fold(f64::INFINITY, f64::min)
    }

    /// Lets faults see the numbers of time t on all connections, begin and end, and changes what is faulty.
    ///
    /// # Errors
    /// An input that does not take what the fault makes of it.
    pub fn apply(
        &mut self,
        (t, h): (f64, f64),
        links: &mut Links,
        instances: &mut [Instance],
        mut tell: impl FnMut(Change),
    ) -> Result {
        for fault in &mut self.all {
            fault.see(t, &links.numbers, instances);
            if !fault.over && fault.since.is_none() && fault.begin.holds(t, h, instances) {
                fault.begin(t, &links.numbers, instances);
                tell((&fault.label, true));
            }
            if fault.since.is_some_and(|since| fault.ends(since, t, h, instances)) {
                fault.finish(t, instances)?;
                tell((&fault.label, false));
            }
            if fault.since.is_some() {
                fault.change(t, links, instances)?;
            }
        }
        Ok(())
    }

    /// For a snapshot.
    pub fn remember(&self) -> Vec<u64> {
        let mut out = Vec::new();
        for fault in &self.all {
            out.push(u64::from(fault.over) | u64::from(fault.since.is_some()) << 1);
            out.put(fault.since.unwrap_or(0.0));
            let Places { entries, messages, own } = &fault.places;
            entries.iter().for_each(|e| e.modifier.remember(&mut out));
            messages.iter().for_each(|m| m.modifier.remember(&mut out));
            own.iter().for_each(|own| {
                own.modifier.remember(&mut out);
                out.put(own.sound);
                out.put(own.told);
            });
        }
        out
    }

    /// Back to a snapshot.
    pub fn recall(&mut self, kept: &mut Recall) {
        for fault in &mut self.all {
            let flags = kept.word();
            let since = kept.number();
            (fault.over, fault.since) = (flags & 1 != 0, (flags & 2 != 0).then_some(since));
            let Places { entries, messages, own } = &mut fault.places;
            entries.iter_mut().for_each(|e| e.modifier.recall(kept));
            messages.iter_mut().for_each(|m| m.modifier.recall(kept));
            own.iter_mut().for_each(|own| {
                own.modifier.recall(kept);
                (own.sound, own.told) = (kept.number(), kept.number());
            });
        }
    }
}

/// Place of a fault of a variable, or the reason why it has none.
fn place(
    variable: VariableRef,
    links: &Links,
    instances: &[Instance],
    modifier: &Modifier,
) -> std::result::Result<Places, String> {
    if links.streams.iter().any(|l| l.to() == variable) {
        return of_stream(|l| l.to() == variable, links, modifier);
    }
    let v = variable.describe(instances);
    let is_input = matches!(v.causality, Causality::Input | Causality::Parameter);
    let mut entries = Vec::new();
    for (link, on) in links.numbers.iter().enumerate() {
        for number in on.numbers_of(variable.slot, v.id, is_input) {
            let conversion = if is_input { (1.0, 0.0) } else { on.conversion(number) };
            entries.push(Entry { link, number, conversion, modifier: modifier.clone() });
        }
    }
    if !entries.is_empty() {
        return Ok(Places { entries, ..Places::default() });
    }
    match (is_input, v.value_type, v.effect) {
        (false, ..) => {
            Err("feeds no number of another subsystem: a fault of an output acts on its connections".into())
        }
        (_, ValueType::String | ValueType::Binary | ValueType::Clock, _) => Err("is no number".into()),
        (_, _, Effect::Live) => {
            let own = Own { variable, modifier: modifier.clone(), sound: 0.0, told: f64::NAN };
            Ok(Places { own: Some(own), ..Places::default() })
        }
        _ => Err("cannot be set between steps".into()),
    }
}

/// Place of a fault of a stream: the connections that it names; or the reason why it has none.
fn of_stream(
    meant: impl Fn(&StreamLink) -> bool,
    links: &Links,
    modifier: &Modifier,
) -> std::result::Result<Places, String> {
    if !modifier.takes_messages() {
        return Err("carries messages, no numbers: of the faults it can have `freeze` and `drop-out`".into());
    }
    let meant = links.streams.iter().enumerate().filter(|(_, l)| meant(l));
    let messages: Vec<Messages> =
        meant.map(|(link, _)| Messages { link, modifier: modifier.clone() }).collect();
    if messages.is_empty() {
        return Err(
            "is a stream that feeds no other subsystem: a fault of a stream acts on its connections".into()
        );
    }
    Ok(Places { messages, ..Places::default() })
}

impl Fault {
    fn see(&mut self, t: f64, links: &[Link], instances: &[Instance]) {
        for e in &mut self.places.entries {
            let x = e.sound(links[e.link].value(e.number));
            e.modifier.see(t, x);
        }
        if let Some(own) = &mut self.places.own {
            let now = own.variable.number(instances).unwrap_or(f64::NAN);
            // what the fault itself has set is not what anybody wanted
            if self.since.is_none() || now != own.told {
                own.sound = now;
            }
            own.modifier.see(t, own.sound);
        }
    }

    fn begin(&mut self, t: f64, links: &[Link], instances: &[Instance]) {
        self.since = Some(t);
        for e in &mut self.places.entries {
            let x = e.sound(links[e.link].value(e.number));
            e.modifier.begin(t, x);
        }
        self.places.messages.iter_mut().for_each(|m| m.modifier.begin(t, 0.0));
        if let Some(own) = &mut self.places.own {
            own.sound = own.variable.number(instances).unwrap_or(f64::NAN);
            own.told = own.sound;
            own.modifier.begin(t, own.sound);
        }
    }

    fn ends(&self, since: f64, t: f64, h: f64, instances: &[Instance]) -> bool {
        match &self.end {
            EndCondition::Never => false,
            EndCondition::Trigger(end) => end.holds(t, h, instances),
            EndCondition::After(duration) => t >= since + duration - 1e-9 * h,
        }
    }

    fn finish(&mut self, t: f64, instances: &mut [Instance]) -> Result {
        (self.since, self.over) = (None, true);
        match &mut self.places.own {
            Some(own) => {
                let sound = own.sound;
                own.set(t, sound, instances)
            }
            None => Ok(()),
        }
    }

    fn change(&mut self, t: f64, links: &mut Links, instances: &mut [Instance]) -> Result {
        for m in &self.places.messages {
            links.streams[m.link].change(m.modifier.fate(t));
        }
        let links = &mut links.numbers;
        for e in &mut self.places.entries {
            let value = links[e.link].value_mut(e.number);
            let (a, b) = e.conversion;
            let changed = e.modifier.changed(t, e.sound(*value));
            *value = if (a, b) == (1.0, 0.0) { changed } else { a * changed + b };
        }
        match &mut self.places.own {
            Some(own) => {
                let changed = own.modifier.changed(t, own.sound);
                own.set(t, changed, instances)
            }
            None => Ok(()),
        }
    }
}

impl Entry {
    /// The number in the unit that the fault is given in.
    fn sound(&self, value: f64) -> f64 {
        match self.conversion {
            (1.0, 0.0) => value,
            (0.0, b) => b,
            (a, b) => (value - b) / a,
        }
    }
}

impl Own {
    fn set(&mut self, time_s: f64, number: f64, instances: &mut [Instance]) -> Result {
        let v = self.variable.describe(instances);
        let value = match v.value_type {
            ValueType::Bool => Value::Bool(number != 0.0),
            ValueType::F64 | ValueType::F32 => Value::from(number),
            _ if number.fract() == 0.0 && number.abs() < 9e15 => Value::from(number as i64),
            _ => Value::from(number),
        };
        if let Reply::Refused(reason) = self.variable.set(instances, true, &value)? {
            return Err(Error::Simulation { time_s, message: format!("a fault: {reason}") });
        }
        self.told = self.variable.number(instances).unwrap_or(number);
        Ok(())
    }
}
