//! Named numbers as a Protobuf message: `LF_j2.angle` is the field `angle` of the field `LF_j2`.
//!
//! The message type is made of the names when a run starts, so every reader of Protobuf plots the variables without
//! knowing this program. Exact name, unit and help of each column, for which Protobuf has no place, are JSON in
//! the channel's metadata under `columns`.

use crate::descriptor;
use crate::snapshot::{Column, ScalarKind};
use prost::bytes::{Buf, BufMut};
use prost::encoding::{self, WireType};
use prost_types::FieldDescriptorProto;
use prost_types::field_descriptor_proto::Type;
use serde::{Deserialize, Serialize};

/// Description of a column.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct About {
    /// Name in its subsystem.
    pub name: String,
    /// Place among all columns of the subsystem.
    pub index: usize,
    /// SI symbols; empty for a pure number.
    pub unit: String,
    pub help: String,
    /// How the number is written.
    pub kind: Kind,
    /// Names of the values 0, 1, … of an enumeration.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub values: Vec<String>,
    /// Numbers of the fields from the message down to the column; elements of an array share theirs.
    pub field: Vec<u32>,
}

/// Type of a field.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Kind {
    Double,
    Int64,
    Bool,
    /// `repeated double`, packed.
    Doubles,
    /// `repeated int64`, packed.
    Int64s,
    /// `repeated bool`, packed.
    Bools,
}

impl Kind {
    fn of(kind: &ScalarKind, array: bool) -> Self {
        match (kind, array) {
            (ScalarKind::Real, false) => Kind::Double,
            (ScalarKind::Real, true) => Kind::Doubles,
            (ScalarKind::Bool, false) => Kind::Bool,
            (ScalarKind::Bool, true) => Kind::Bools,
            (_, false) => Kind::Int64,
            (_, true) => Kind::Int64s,
        }
    }

    /// The kind of one element.
    fn element(self) -> Self {
        match self {
            Kind::Doubles => Kind::Double,
            Kind::Int64s => Kind::Int64,
            Kind::Bools => Kind::Bool,
            scalar => scalar,
        }
    }

    /// Whether its numbers have a fraction.
    pub fn is_real(self) -> bool {
        self.element() == Kind::Double
    }

    fn repeated(self) -> bool {
        self.element() != self
    }

    fn wire(self) -> WireType {
        match self {
            Kind::Double => WireType::SixtyFourBit,
            Kind::Int64 | Kind::Bool => WireType::Varint,
            _ => WireType::LengthDelimited,
        }
    }

    fn proto(self) -> Type {
        match self.element() {
            Kind::Double => Type::Double,
            Kind::Bool => Type::Bool,
            _ => Type::Int64,
        }
    }
}

/// A field of a message.
#[derive(Clone, Debug)]
struct Field {
    number: u32,
    name: String,
    what: What,
    /// Key before it in a message.
    key: Key,
    /// Length of its body with every number there.
    guess: usize,
}

/// Number and type of a field as they are written.
#[derive(Clone, Copy, Debug, Default)]
struct Key {
    bytes: [u8; 5],
    length: u8,
}

impl Key {
    fn new(number: u32, wire: WireType) -> Self {
        let mut key = Self::default();
        let mut rest = key.bytes.as_mut_slice();
        encoding::encode_key(number, wire, &mut rest);
        key.length = 5 - rest.len() as u8;
        key
    }

    fn bytes(&self) -> &[u8] {
        &self.bytes[..usize::from(self.length)]
    }

    fn len(&self) -> usize {
        usize::from(self.length)
    }
}

impl Field {
    fn new(number: u32, name: String, what: What) -> Self {
        let wire = match &what {
            What::Group(_) => WireType::LengthDelimited,
            What::Values { kind, .. } => kind.wire(),
        };
        Self { number, name, what, key: Key::new(number, wire), guess: 0 }
    }
}

#[derive(Clone, Debug)]
enum What {
    Group(Vec<Field>),
    /// The columns from `first` on: one, or the elements of an array.
    Values {
        kind: Kind,
        first: usize,
        count: usize,
    },
}

/// The message type of a list of columns.
#[derive(Clone, Debug, Default)]
pub(crate) struct Columns {
    fields: Vec<Field>,
    /// Number of columns.
    pub count: usize,
}

/// Name without the `[i,j]` of an array's element.
fn base(name: &str) -> (&str, bool) {
    match name.strip_suffix(']').and_then(|n| n.rsplit_once('[')) {
        Some((base, _)) => (base, true),
        None => (name, false),
    }
}

impl Columns {
    /// The type of these columns and what is known of each; `index` gives their places in the subsystem.
    pub fn new<'a>(columns: impl Iterator<Item = (usize, &'a Column)>) -> (Self, Vec<About>) {
        let mut all = Self::default();
        let mut about: Vec<About> = Vec::new();
        let mut array = "";
        for (index, column) in columns {
            let (base, is_element) = base(&column.name);
            let kind = Kind::of(&column.kind, is_element);
            let field = match about.last() {
                Some(before) if is_element && base == array => before.field.clone(),
                _ => insert(&mut all.fields, base, &What::Values { kind, first: all.count, count: 0 }),
            };
            array = if is_element { base } else { "" };
            if let Some(What::Values { count, .. }) = find(&mut all.fields, &field) {
                *count += 1;
            }
            all.count += 1;
            let values = match &column.kind {
                ScalarKind::Enumeration(names) => names.clone(),
                _ => Vec::new(),
            };
            let (name, unit, help) = (column.name.clone(), column.unit.clone(), column.help.clone());
            about.push(About { name, index, unit, help, kind, values, field });
        }
        guess_lengths(&mut all.fields);
        (all, about)
    }

    /// The type that a recording describes.
    pub fn read(about: &[About]) -> Self {
        let mut all = Self::default();
        let mut last: &[u32] = &[];
        for column in about {
            if !(column.kind.repeated() && last == column.field) {
                let values = What::Values { kind: column.kind, first: all.count, count: 0 };
                place(&mut all.fields, &column.field, &values);
            }
            if let Some(What::Values { count, .. }) = find(&mut all.fields, &column.field) {
                *count += 1;
            }
            last = &column.field;
            all.count += 1;
        }
        all
    }

    /// The message type `package.name` as a set of file descriptors.
    pub fn descriptor(&self, package: &str, name: &str) -> Vec<u8> {
        descriptor::file(package, vec![message(name, &self.fields)])
    }

    /// Appends the message; a number that is zero is left out, which reads back as zero.
    pub fn encode(&self, values: &[f64], out: &mut Vec<u8>) {
        write_all(&self.fields, values, out);
    }

    /// Takes the values of a message; `None` where it is damaged.
    pub fn decode(&self, mut message: &[u8], values: &mut [f64]) -> Option<()> {
        values.fill(0.0);
        read_all(&self.fields, &mut message, values)
    }
}

/// Letters, digits and `_`, not beginning with a digit, and unlike its neighbours.
fn identifier(part: &str, taken: &[Field]) -> String {
    let mut name = descriptor::identifier(part);
    while taken.iter().any(|f| f.name == name) {
        name.push('_');
    }
    name
}

fn next_number(fields: &[Field]) -> u32 {
    match fields.last().map_or(1, |f| f.number + 1) {
        // Reserved by Protobuf.
        19_000..=19_999 => 20_000,
        number => number,
    }
}

/// Puts a variable into the tree of its dotted parts; returns the numbers on the way.
fn insert(fields: &mut Vec<Field>, name: &str, what: &What) -> Vec<u32> {
    let Some((group, rest)) = name.split_once('.') else {
        let number = next_number(fields);
        fields.push(Field::new(number, identifier(name, fields), what.clone()));
        return vec![number];
    };
    let wanted = descriptor::identifier(group);
    let known = fields.iter().position(|f| f.name == wanted && matches!(f.what, What::Group(_)));
    let place = known.unwrap_or_else(|| {
        let (number, name) = (next_number(fields), identifier(group, fields));
        fields.push(Field::new(number, name, What::Group(Vec::new())));
        fields.len() - 1
    });
    let field = &mut fields[place];
    let mut numbers = vec![field.number];
    if let What::Group(inner) = &mut field.what {
        numbers.extend(insert(inner, rest, what));
    }
    numbers
}

/// Puts values at the field numbers of a recording.
fn place(fields: &mut Vec<Field>, numbers: &[u32], what: &What) {
    let Some((number, rest)) = numbers.split_first() else { return };
    let new = || if rest.is_empty() { what.clone() } else { What::Group(Vec::new()) };
    let place = fields.iter().position(|f| f.number == *number).unwrap_or_else(|| {
        fields.push(Field::new(*number, String::new(), new()));
        fields.len() - 1
    });
    if let What::Group(inner) = &mut fields[place].what {
        self::place(inner, rest, what);
    }
}

fn find<'a>(fields: &'a mut [Field], numbers: &[u32]) -> Option<&'a mut What> {
    let (number, rest) = numbers.split_first()?;
    let what = &mut fields.iter_mut().find(|f| f.number == *number)?.what;
    if rest.is_empty() {
        return Some(what);
    }
    match what {
        What::Group(inner) => find(inner, rest),
        What::Values { .. } => None,
    }
}

fn message(name: &str, fields: &[Field]) -> prost_types::DescriptorProto {
    let mut message = descriptor::message(name, Vec::new());
    for field in fields {
        message.field.push(match &field.what {
            What::Values { kind, .. } => described(field, *kind),
            What::Group(inner) => {
                // Types and fields share a scope; no field ends like this.
                let inner_name = format!("{}__type", field.name);
                message.nested_type.push(self::message(&inner_name, inner));
                descriptor::nested(&field.name, field.number, &inner_name)
            }
        });
    }
    message
}

fn described(field: &Field, kind: Kind) -> FieldDescriptorProto {
    match kind.repeated() {
        true => descriptor::repeated(&field.name, field.number, kind.proto()),
        false => descriptor::field(&field.name, field.number, kind.proto()),
    }
}

fn put_scalar(kind: Kind, value: f64, out: &mut Vec<u8>) {
    match kind {
        Kind::Double => out.put_f64_le(value),
        Kind::Bool => out.put_u8(u8::from(value != 0.0)),
        _ => encoding::encode_varint(value as i64 as u64, out),
    }
}

/// Minus zero is not left out.
fn is_zero(value: f64) -> bool {
    value.to_bits() == 0
}

/// Appends what `body` writes with its length before it; `guess` is the length that it has as a rule.
fn write_part(guess: usize, out: &mut Vec<u8>, body: impl FnOnce(&mut Vec<u8>)) {
    let start = out.len();
    let room = encoding::encoded_len_varint(guess as u64);
    out.resize(start + room, 0);
    body(out);
    let length = out.len() - start - room;
    let mut head = [0_u8; 10];
    let mut rest = head.as_mut_slice();
    encoding::encode_varint(length as u64, &mut rest);
    let width = 10 - rest.len();
    if width != room {
        let end = out.len();
        out.resize(end.max(end + width - room), 0);
        out.copy_within(start + room..end, start + width);
        out.truncate(start + width + length);
    }
    out[start..start + width].copy_from_slice(&head[..width]);
}

/// Notes how long groups and arrays are as a rule.
fn guess_lengths(fields: &mut [Field]) {
    for field in fields {
        if let What::Group(inner) = &mut field.what {
            guess_lengths(inner);
        }
        field.guess = longest(field) - field.key.len();
    }
}

/// Length of a field in which every number is there.
fn longest(field: &Field) -> usize {
    let body = match &field.what {
        What::Group(inner) => inner.iter().map(longest).sum(),
        What::Values { kind, count, .. } => count * if kind.is_real() { 8 } else { 1 },
    };
    field.key.len() + body
}

fn write_all(fields: &[Field], values: &[f64], out: &mut Vec<u8>) {
    for field in fields {
        match &field.what {
            What::Group(inner) => {
                out.extend_from_slice(field.key.bytes());
                write_part(field.guess, out, |out| write_all(inner, values, out));
            }
            What::Values { kind: Kind::Double, first, .. } => {
                let value = values[*first];
                if !is_zero(value) {
                    out.extend_from_slice(field.key.bytes());
                    out.extend_from_slice(&value.to_le_bytes());
                }
            }
            What::Values { kind, first, .. } if !kind.repeated() => {
                if !is_zero(values[*first]) {
                    out.extend_from_slice(field.key.bytes());
                    put_scalar(*kind, values[*first], out);
                }
            }
            What::Values { kind, first, count } => {
                out.extend_from_slice(field.key.bytes());
                write_part(field.guess, out, |out| {
                    values[*first..first + count].iter().for_each(|v| put_scalar(kind.element(), *v, out));
                });
            }
        }
    }
}

fn take_scalar(kind: Kind, from: &mut &[u8]) -> Option<f64> {
    match kind {
        Kind::Double => (from.remaining() >= 8).then(|| from.get_f64_le()),
        Kind::Bool => encoding::decode_varint(from).ok().map(|v| f64::from(u8::from(v != 0))),
        _ => encoding::decode_varint(from).ok().map(|v| v as i64 as f64),
    }
}

fn take_part<'a>(from: &mut &'a [u8]) -> Option<&'a [u8]> {
    let length = usize::try_from(encoding::decode_varint(from).ok()?).ok()?;
    let (part, rest) = from.split_at_checked(length)?;
    *from = rest;
    Some(part)
}

fn read_all(fields: &[Field], from: &mut &[u8], values: &mut [f64]) -> Option<()> {
    let mut guess = 0;
    while from.has_remaining() {
        let (number, wire) = encoding::decode_key(from).ok()?;
        // Fields come in their order as a rule.
        let ahead = fields[guess.min(fields.len())..].iter().position(|f| f.number == number);
        let place = ahead.map(|k| k + guess).or_else(|| fields.iter().position(|f| f.number == number))?;
        guess = place + 1;
        match &fields[place].what {
            What::Group(inner) => read_all(inner, &mut take_part(from)?, values)?,
            What::Values { kind, first, .. } if !kind.repeated() => {
                (wire == kind.wire()).then_some(())?;
                values[*first] = take_scalar(*kind, from)?;
            }
            What::Values { kind, first, count } => {
                let mut part = take_part(from)?;
                for value in &mut values[*first..first + count] {
                    *value = take_scalar(kind.element(), &mut part)?;
                }
            }
        }
    }
    Some(())
}

#[cfg(test)]
#[path = "../tests/unit/columns.rs"]
mod tests;
