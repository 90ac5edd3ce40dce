//! Connections: outputs of t become inputs of the step, with units checked once and converted every step.

use super::access::{Directory, VariableRef};
use super::discrete::{self, Discrete};
use super::extrapolation::{Extrapolation, Moment};
use super::feed_through::FeedThroughs;
use super::pattern;
use super::stream_link::{self, StreamLink};
use super::table;
use terraglue_diagnostics::Result;
use terraglue_gluing::memory::Recall;
use terraglue_host::{By, Instance, Reply};
use terraglue_scenario::{Connection, ConnectionOrder, Extrapolate, InputError, Source};
use terraglue_subsystem::unit::Unit;
use terraglue_subsystem::{Capabilities, Causality, ValueType, Values, ValuesMut};

/// Subsystem and variable on either side of a value, and value_to = a·value_from + b.
pub type Ends = ([(usize, u32); 2], (f64, f64));

/// All f64 connections from one subsystem to another, copied in one call each way. In few pieces: the cost of a chain of
/// cheap subsystems is that of its memory.
#[derive(Debug)]
pub struct Link {
    from: usize,
    to: usize,
    /// When within a step it passes values.
    order: ConnectionOrder,
    /// Whether its target is stepped after its source, with the values at the end of the step.
    within: bool,
    /// Of the outputs, then of the inputs.
    ids: Vec<u32>,
    /// Values, then a and then b of value_to = a·value_from + b.
    numbers: Vec<f64>,
    /// The line that the inputs follow, where they are not held.
    extrapolation: Option<Box<Extrapolation>>,
    /// Largest magnitude that each value has had in the run; empty where none is iterated.
    largest: Vec<f64>,
}

/// Derivatives of all values of `links`, one behind the other, by an entry of the inputs that a link feeds; false where one is not known.
///
/// # Errors
/// [`Error::Module`](terraglue_diagnostics::Error::Module): a subsystem fails.
pub fn derivatives<'a>(
    links: impl Iterator<Item = &'a Link>,
    instances: &[Instance],
    (by, entry): (&Link, usize),
    mut out: &mut [f64],
) -> Result<bool> {
    for link in links {
        let (own, rest) = out.split_at_mut(link.count());
        if !link.derivatives(instances, by, entry, own)? {
            return Ok(false);
        }
        out = rest;
    }
    Ok(true)
}

impl Link {
    #[inline]
    fn output_ids(&self) -> &[u32] {
        &self.ids[..self.count()]
    }

    #[inline]
    fn input_ids(&self) -> &[u32] {
        &self.ids[self.count()..]
    }

    /// Whether it feeds a variable of a subsystem.
    pub fn feeds(&self, slot: usize, id: u32) -> bool {
        self.to == slot && self.input_ids().contains(&id)
    }

    /// Sets the inputs to the values that were read last.
    ///
    /// # Errors
    /// [`Error::Module`](terraglue_diagnostics::Error::Module): the subsystem refuses the values or fails.
    #[inline]
    pub fn pass_on(&self, instances: &mut [Instance]) -> Result {
        self.write(instances, &self.numbers[..self.count()])
    }

    /// The same at the start of a step: inputs that are not held follow their line.
    ///
    /// # Errors
    /// [`Error::Module`](terraglue_diagnostics::Error::Module): the subsystem refuses the values or fails.
    #[inline]
    pub fn pass_on_ahead(&self, instances: &mut [Instance]) -> Result {
        match self.extrapolation.as_ref().and_then(|line| line.ahead()) {
            None => self.pass_on(instances),
            Some(ahead) => self.write(instances, ahead),
        }
    }

    /// The same over one of four quarters of the step, from 0 on.
    ///
    /// # Errors
    /// [`Error::Module`](terraglue_diagnostics::Error::Module): the subsystem refuses the values or fails.
    pub fn pass_on_quarter(&self, k: u32, instances: &mut [Instance]) -> Result {
        match self.extrapolation.as_ref().and_then(|line| line.over_quarter(k)) {
            None => Ok(()),
            Some(values) => self.write(instances, &values),
        }
    }

    /// Goes on along the line of the values, where there is one.
    ///
    /// # Errors
    /// [`Error::Module`](terraglue_diagnostics::Error::Module): the source cannot give a derivative that it has promised.
    #[inline]
    pub fn extrapolate(&mut self, moment: Moment, instances: &[Instance]) -> Result {
        let Some(line) = &mut self.extrapolation else { return Ok(()) };
        let n = self.ids.len() / 2;
        let source = &instances[self.from];
        line.take(moment, &self.numbers[..n], |slopes| {
            if !source.derivatives(&self.ids[..n], By::Time, slopes)? {
                let why = "it has no derivatives of these outputs, or NaN".to_owned();
                return Err(source.error("output_derivatives", why));
            }
            slopes.iter_mut().zip(&self.numbers[n..2 * n]).for_each(|(slope, factor)| *slope *= factor);
            Ok(())
        })
    }

    /// Extrapolation of its inputs.
    pub fn extrapolates(&self) -> Extrapolate {
        match &self.extrapolation {
            None => Extrapolate::Constant,
            Some(line) if line.by_derivatives() => Extrapolate::Derivatives,
            Some(_) => Extrapolate::Linear,
        }
    }

    /// Settles which inputs take the value at the end of a step, where they follow a line.
    fn settle_ends(&mut self, of: &FeedThroughs) {
        let ends: Vec<bool> = self.input_ids().iter().map(|id| of.takes_end((self.to, *id))).collect();
        if let Some(line) = &mut self.extrapolation {
            line.set_ends(ends);
        }
    }

    /// For a snapshot.
    pub fn remember(&self, out: &mut Vec<u64>) {
        self.extrapolation.iter().for_each(|line| line.remember(out));
        out.extend(self.largest.iter().map(|x| x.to_bits()));
    }

    /// Back to a snapshot.
    pub fn recall(&mut self, kept: &mut Recall) {
        self.extrapolation.iter_mut().for_each(|line| line.recall(kept));
        self.largest.iter_mut().for_each(|x| *x = kept.number());
    }

    /// Values of the outputs, in the units of the inputs.
    ///
    /// # Errors
    /// [`Error::Module`](terraglue_diagnostics::Error::Module): a value is NaN, or the subsystem fails.
    pub fn read(&mut self, instances: &[Instance]) -> Result<&[f64]> {
        let n = self.ids.len() / 2;
        let (values, conversion) = self.numbers.split_at_mut(n);
        instances[self.from].get(&self.ids[..n], ValuesMut::F64(values))?;
        if let ([value], [a, b]) = (&mut *values, &*conversion) {
            *value = a * *value + b;
            return Ok(values);
        }
        let (factors, offsets) = conversion.split_at(n);
        for ((value, a), b) in values.iter_mut().zip(factors).zip(offsets) {
            *value = a * *value + b;
        }
        Ok(values)
    }

    /// Derivatives of its values by entry `k` of the inputs that `other` feeds; false where the subsystem between does not know them.
    ///
    /// # Errors
    /// [`Error::Module`](terraglue_diagnostics::Error::Module): the subsystem fails.
    fn derivatives(&self, instances: &[Instance], other: &Self, k: usize, out: &mut [f64]) -> Result<bool> {
        out.fill(0.0);
        if self.from != other.to {
            return Ok(true);
        }
        let by = By::Variable(other.input_ids()[k]);
        let known = instances[self.from].derivatives(self.output_ids(), by, out)?;
        out.iter_mut().enumerate().for_each(|(k, x)| *x *= self.conversion(k).0);
        Ok(known)
    }

    /// Sets the inputs.
    ///
    /// # Errors
    /// [`Error::Module`](terraglue_diagnostics::Error::Module): the subsystem refuses the values or fails.
    pub fn write(&self, instances: &mut [Instance], values: &[f64]) -> Result {
        let target = &mut instances[self.to];
        match target.set(self.input_ids(), Values::F64(values))? {
            Reply::Accepted => Ok(()),
            Reply::Refused(reason) => Err(target.error("set", reason)),
        }
    }

    /// Places of the values of a variable: those that come from it, or, with `fed`, those that it is given.
    pub fn numbers_of(&self, slot: usize, id: u32, fed: bool) -> impl Iterator<Item = usize> + '_ {
        let (own, ids) = if fed { (self.to, self.input_ids()) } else { (self.from, self.output_ids()) };
        (0..ids.len()).filter(move |k| own == slot && ids[*k] == id)
    }

    /// Subsystem and variable on either side of every value, and how it is converted.
    pub fn ends(&self) -> impl Iterator<Item = Ends> + '_ {
        let pairs = self.output_ids().iter().zip(self.input_ids()).enumerate();
        pairs.map(|(k, (from, to))| ([(self.from, *from), (self.to, *to)], self.conversion(k)))
    }

    /// value_to = a·value_from + b of one value.
    pub fn conversion(&self, k: usize) -> (f64, f64) {
        let n = self.count();
        (self.numbers[n + k], self.numbers[2 * n + k])
    }

    /// A value that was read last.
    pub fn value(&self, k: usize) -> f64 {
        self.numbers[k]
    }

    /// The same, to change it on its way.
    pub fn value_mut(&mut self, k: usize) -> &mut f64 {
        &mut self.numbers[k]
    }

    /// Notes how large the values are that were read last.
    pub fn learn(&mut self) {
        self.largest.iter_mut().zip(&self.numbers).for_each(|(most, x)| *most = most.max(x.abs()));
    }

    /// Largest magnitude that a value has had in the run, where it is iterated.
    pub fn largest(&self, k: usize) -> f64 {
        self.largest.get(k).copied().unwrap_or(0.0)
    }

    /// Subsystems on either side.
    pub fn slots(&self) -> [usize; 2] {
        [self.from, self.to]
    }

    /// Whether it may pass values within a step where that avoids a delay.
    pub fn is_ordered(&self) -> bool {
        self.order == ConnectionOrder::Structure
    }

    /// Says that its target is stepped after its source.
    pub fn pass_within_the_step(&mut self) {
        self.within = true;
    }

    /// Whether its target is stepped after its source: then nothing is passed at the start of a step.
    pub fn is_within_the_step(&self) -> bool {
        self.within
    }

    /// Whether the step is repeated until its values stand.
    pub fn is_iterated(&self) -> bool {
        self.order.repeats()
    }

    /// Whether that value is exchanged at the end of the step alone.
    pub fn is_iterated_at_ends(&self) -> bool {
        self.order == ConnectionOrder::IterateEnds
    }

    /// Whether its inputs follow a line through the values of the source.
    pub fn follows_line(&self) -> bool {
        self.extrapolation.is_some()
    }

    /// Number of values.
    #[inline]
    pub fn count(&self) -> usize {
        self.ids.len() / 2
    }

    /// `a.y → b.u` of every value.
    pub fn names(&self, instances: &[Instance]) -> Vec<String> {
        let pairs = self.output_ids().iter().zip(self.input_ids());
        pairs.map(|(from, to)| named_ends([(self.from, *from), (self.to, *to)], instances)).collect()
    }
}

/// `a.y → b.u` of a value with these ends: subsystem and variable on either side.
pub fn named_ends(ends: [(usize, u32); 2], instances: &[Instance]) -> String {
    let [from, to] = ends.map(|(slot, id)| {
        let variable = instances[slot].variables().iter().find(|v| v.id == id);
        format!("{}.{}", instances[slot].name(), variable.map_or("?", |v| &v.name))
    });
    format!("{from} → {to}")
}

/// All connections of a scenario, resolved.
#[derive(Debug, Default)]
pub struct Links {
    /// Of f64.
    pub numbers: Vec<Link>,
    /// Of all other types.
    pub discrete: Vec<Discrete>,
    /// Of streams.
    pub streams: Vec<StreamLink>,
}

impl Links {
    /// Whether numbers, and whether other values, are passed on before the first step: where an output depends on an input of the same
    /// time, or an input belongs to an FMU, whose initialisation may depend on it.
    pub fn pass_at_start(&self, instances: &[Instance]) -> (bool, bool) {
        let through = |slot: usize| instances[slot].capabilities().has(Capabilities::FEEDTHROUGH);
        let is_fmu = |slot: usize| terraglue_scenario::ModuleKind::is_fmu(instances[slot].module());
        let matters = |[from, to]: [usize; 2]| through(from) || is_fmu(to);
        let numbers = self.numbers.iter().any(|link| matters(link.slots()));
        let discrete = self.discrete.iter().any(|link| numbers || matters(link.ends().map(|end| end.slot())));
        (numbers, discrete)
    }

    /// Subsystem and variable on either side of every value.
    pub fn ends(&self, instances: &[Instance]) -> Vec<[(usize, u32); 2]> {
        let numbers = self.numbers.iter().flat_map(|link| link.ends().map(|(ends, _)| ends));
        numbers.chain(self.discrete.iter().map(|d| d.end_ids(instances))).collect()
    }

    /// Settles which inputs take the value at the end of a step, where they follow a line.
    pub fn settle_ends(&mut self, of: &FeedThroughs) {
        let extrapolated = self.numbers.iter_mut().filter(|link| link.follows_line());
        extrapolated.for_each(|link| link.settle_ends(of));
    }

    /// Takes a message of a stream, by its number among all, on its way to the inputs that it feeds.
    pub fn feed(&mut self, stream: usize, bytes: &[u8]) {
        self.streams.iter_mut().filter(|link| link.stream() == stream).for_each(|link| link.take(bytes));
    }
}

/// Name without the index of an element at its end, and that index: `a.b[2,1]` → `a.b`, `[2,1]`.
fn element(name: &str) -> Option<(&str, &str)> {
    name.ends_with(']').then(|| name.rfind('[').map(|at| name.split_at(at))).flatten()
}

/// Source of a variable in a connection: by its own name, or as an element of a whole array that is named.
fn target(connection: &Connection, name: &str) -> Option<(String, bool)> {
    if let Some(target) = pattern::rewrite(&connection.from, &connection.to, name) {
        return Some((target, false));
    }
    let (base, index) = element(name)?;
    pattern::rewrite(&connection.from, &connection.to, base).map(|target| (target + index, true))
}

/// The other form of a target that does not exist: an array of one element and a scalar fit each other.
fn single(directory: &Directory, name: &str, target: &str, of_array: bool) -> Option<String> {
    let count = |base: &str| {
        directory.names().iter().filter(|n| element(n).is_some_and(|(own, _)| own == base)).count()
    };
    if directory.find(target).is_some() || of_array && count(element(name)?.0) != 1 {
        return None;
    }
    let scalar = if of_array { element(target)?.0 } else { target };
    if directory.find(scalar).is_some() {
        return Some(scalar.to_owned());
    }
    let elements = ["[1]", "[1,1]"].iter().map(|index| format!("{scalar}{index}"));
    elements.into_iter().find(|name| directory.find(name).is_some() && count(scalar) == 1)
}

/// Why two whole arrays cannot be connected, where their shapes differ.
fn shapes_differ(directory: &Directory, name: &str, target: &str) -> Option<String> {
    let last = |name: &str| {
        let base = element(name)?.0;
        let own = |n: &&String| element(n).is_some_and(|(b, _)| b == base);
        Some(element(directory.names().iter().rev().find(own)?)?.1.to_owned())
    };
    let (from, to) = (last(name)?, last(target));
    let bases = [name, target].map(|n| element(n).map_or(n, |(base, _)| base));
    (to.as_ref() != Some(&from)).then(|| match to {
        Some(to) => {
            format!("`{}` has the shape {from}, `{}` has {to}: these cannot be connected", bases[0], bases[1])
        }
        None => format!("`{}` has the shape {from}, `{}` is no array", bases[0], bases[1]),
    })
}

/// Resolves all connections of a scenario into links, in the order of the file. `multiples`: steps of the testbed per step of each instance.
///
/// # Errors
/// A connection that matches nothing, names a variable that does not exist, joins what does not fit, or feeds an input twice.
pub fn connect(
    connections: &[Connection],
    directory: &Directory,
    instances: &[Instance],
    multiples: &[u32],
    source: &Source,
) -> std::result::Result<Links, Box<InputError>> {
    let mut resolving =
        Resolving { directory, instances, multiples, source, links: Links::default(), fed: Vec::new() };
    for connection in connections {
        let variables = resolving.variables(connection)?;
        let streams = resolving.streams(connection)?;
        if !variables && !streams {
            let message = format!("no variable and no stream matches `{}`", connection.from);
            let help = directory.hint_with_streams(&connection.from);
            return Err(resolving.refuse(connection, &connection.from, message, help));
        }
    }
    Ok(resolving.links)
}

/// Connections on their way into links.
struct Resolving<'a> {
    directory: &'a Directory,
    instances: &'a [Instance],
    multiples: &'a [u32],
    source: &'a Source,
    links: Links,
    /// Inputs that are fed, and by what.
    fed: Vec<(String, VariableRef)>,
}

impl Resolving<'_> {
    fn refuse(
        &self,
        connection: &Connection,
        end: &str,
        message: String,
        help: Option<String>,
    ) -> Box<InputError> {
        self.source.error_in(connection.entry, &[end], message, help)
    }

    fn find(
        &self,
        connection: &Connection,
        name: &str,
        target: &str,
    ) -> std::result::Result<VariableRef, Box<InputError>> {
        self.directory.find(target).ok_or_else(|| {
            let message = format!("`{name}` is connected to `{target}`, which does not exist");
            self.refuse(connection, &connection.to, message, self.directory.hint(target))
        })
    }

    /// Takes an input, which nothing else may feed.
    fn feed(
        &mut self,
        connection: &Connection,
        name: &str,
        (target, to): (&str, VariableRef),
    ) -> std::result::Result<(), Box<InputError>> {
        if let Some((other, _)) = self.fed.iter().find(|(_, input)| *input == to) {
            let message = format!("`{target}` is fed by `{other}` already and cannot take `{name}` too");
            let help =
                "an input takes one number: delete one of the two, or let a module add them up".to_owned();
            return Err(self.refuse(connection, &connection.to, message, Some(help)));
        }
        self.fed.push((name.to_owned(), to));
        Ok(())
    }

    /// All variables that a connection names; false: it names none.
    fn variables(&mut self, connection: &Connection) -> std::result::Result<bool, Box<InputError>> {
        let (directory, instances) = (self.directory, self.instances);
        let mut matched = false;
        for (name, from) in directory.iter() {
            let Some((target, of_array)) = target(connection, name) else { continue };
            matched = true;
            let (target, of_array) = match single(directory, name, &target, of_array) {
                Some(single) => (single, false),
                None => (target, of_array),
            };
            if let Some(message) = of_array.then(|| shapes_differ(directory, name, &target)).flatten() {
                return Err(self.refuse(connection, &connection.to, message, None));
            }
            let to = self.find(connection, name, &target)?;
            let conversion = check(connection, instances, (name, from), (&target, to))
                .map_err(|message| self.refuse(connection, &connection.to, message, None))?;
            self.feed(connection, name, (&target, to))?;
            self.check_order(connection, name, from)?;
            if from.describe(instances).value_type == ValueType::F64 {
                self.add([from, to], conversion, connection);
                continue;
            }
            let table = table::resolve(&connection.map, instances, from, to).map_err(|message| {
                self.refuse(connection, "map", format!("`{name}` → `{target}`: {message}"), None)
            })?;
            self.links.discrete.push(Discrete::new([from, to], table, conversion, connection.order));
        }
        Ok(matched)
    }

    /// Iteration is for numbers of 64 bits: the residual of other values says nothing about the next ones.
    fn check_order(
        &self,
        connection: &Connection,
        name: &str,
        from: VariableRef,
    ) -> std::result::Result<(), Box<InputError>> {
        let value_type = from.describe(self.instances).value_type;
        if !connection.order.repeats() || value_type == ValueType::F64 {
            return Ok(());
        }
        let own = format!("{value_type:?}").to_lowercase();
        let message = format!("`{name}` is of type {own}: only numbers of 64 bits can be iterated");
        let help = "leave `order = \"iterate\"` of this connection out: then its value is passed in the order of the model structure, or \
                    late by a step in a loop";
        Err(self.refuse(connection, "order", message, Some(help.into())))
    }

    /// All streams that a connection names; false: it names none.
    fn streams(&mut self, connection: &Connection) -> std::result::Result<bool, Box<InputError>> {
        let directory = self.directory;
        let mut matched = false;
        for (number, name) in directory.streams().iter().enumerate() {
            let Some(target) = pattern::rewrite(&connection.from, &connection.to, name) else { continue };
            matched = true;
            if connection.order.repeats() {
                let message = format!("`{name}` is a stream: only numbers of 64 bits can be iterated");
                let help = "leave `order = \"iterate\"` of this connection out: messages are late by a step";
                return Err(self.refuse(connection, "order", message, Some(help.into())));
            }
            let to = self.find(connection, name, &target)?;
            stream_link::check(connection, self.instances, name, (&target, to))
                .map_err(|message| self.refuse(connection, &connection.to, message, None))?;
            self.feed(connection, name, (&target, to))?;
            self.links.streams.push(StreamLink::new(number, to));
        }
        Ok(matched)
    }

    /// Adds a value to the link of its subsystems.
    fn add(&mut self, [from, to]: [VariableRef; 2], conversion: (f64, f64), connection: &Connection) {
        let (instances, multiples) = (self.instances, self.multiples);
        let Connection { order, extrapolate, .. } = *connection;
        let links = &mut self.links.numbers;
        let same = |l: &Link| {
            l.from == from.slot && l.to == to.slot && l.order == order && l.extrapolates() == extrapolate
        };
        let k = links.iter().position(same).unwrap_or_else(|| {
            let by_derivatives = extrapolate == Extrapolate::Derivatives;
            let multiples = [from, to].map(|end| multiples[end.slot]);
            let line = || Extrapolation::new(multiples, by_derivatives);
            let extrapolation = (extrapolate != Extrapolate::Constant).then(|| Box::new(line()));
            let (ids, numbers) = (Vec::new(), Vec::new());
            let (within, largest) = (false, Vec::new());
            let (from, to) = (from.slot, to.slot);
            links.push(Link { from, to, order, within, ids, numbers, extrapolation, largest });
            links.len() - 1
        });
        let link = &mut links[k];
        let n = link.count();
        link.ids.insert(n, from.describe(instances).id);
        link.ids.push(to.describe(instances).id);
        // from the last place on, as each moves what is behind it
        link.numbers.push(conversion.1);
        link.numbers.insert(2 * n, conversion.0);
        link.numbers.insert(n, 0.0);
        if link.is_iterated() {
            link.largest.push(0.0);
        }
    }
}

/// value_to = a·value_from + b, or why the two cannot be connected.
fn check(
    connection: &Connection,
    instances: &[Instance],
    (from_name, from): (&str, VariableRef),
    (to_name, to): (&str, VariableRef),
) -> std::result::Result<(f64, f64), String> {
    let (a, b) = (from.describe(instances), to.describe(instances));
    let mapped = !connection.map.is_empty();
    if mapped && !(table::takes(a.value_type) && table::takes(b.value_type)) {
        return Err(format!(
            "`{from_name}` → `{to_name}`: `map` is for truth values, whole numbers and enumerations"
        ));
    }
    if !mapped && !discrete::fits(a.value_type, b.value_type) {
        let [own, other] = [a.value_type, b.value_type].map(|t| format!("{t:?}").to_lowercase());
        return Err(format!(
            "`{from_name}` is of type {own} and `{to_name}` of {other}: these cannot be connected"
        ));
    }
    if a.causality == Causality::Input {
        return Err(format!("`{from_name}` is an input and cannot feed another variable"));
    }
    if !matches!(b.causality, Causality::Input | Causality::Parameter) {
        return Err(format!("`{to_name}` is not an input and cannot be connected to"));
    }
    let Connection { factor, offset, convert, .. } = *connection;
    let takes_factor = matches!(a.value_type, ValueType::F64 | ValueType::F32)
        || discrete::is_whole(a.value_type) && !mapped;
    if connection.extrapolate != Extrapolate::Constant && a.value_type != ValueType::F64 {
        return Err(format!("`{from_name}` is no number of 64 bits: it cannot be extrapolated"));
    }
    let tells = || instances[from.slot].capabilities().has(Capabilities::OUTPUT_DERIVATIVES);
    if connection.extrapolate == Extrapolate::Derivatives && !tells() {
        return Err(format!(
            "`{from_name}` has no derivative that its subsystem tells: only FMUs with `maxOutputDerivativeOrder` that are not \
             isolated do; `extrapolate = \"linear\"` needs none"
        ));
    }
    if (factor, offset) != (1.0, 0.0) && !takes_factor {
        return Err(format!("`{from_name}` is of a type that takes neither `factor` nor `offset`"));
    }
    if a.unit.is_empty() || b.unit.is_empty() || !convert {
        return Ok((factor, offset));
    }
    let parse = |name: &str, unit: &str| Unit::parse(unit).map_err(|e| format!("unit of `{name}`: {e}"));
    let (unit_a, unit_b) = (parse(from_name, &a.unit)?, parse(to_name, &b.unit)?);
    let conversion = unit_a.conversion_to(&unit_b).ok_or_else(|| {
        format!("`{from_name}` is in {} and `{to_name}` in {}: these cannot be connected", a.unit, b.unit)
    })?;
    Ok((factor * conversion.0, factor * conversion.1 + offset))
}
