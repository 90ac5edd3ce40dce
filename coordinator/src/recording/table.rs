//! A table of numbers by name over time, read from JSON objects without building a tree for each.

use serde::de::{DeserializeSeed, Deserializer, MapAccess, Visitor};
use std::fmt;

/// Columns of equal length; row k belongs to time `t_s[k]`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// Simulated time, s.
    pub t_s: Vec<f64>,
    /// Names in the order of the first message.
    pub names: Vec<String>,
    /// One column per name; NaN where a message had no such number.
    pub columns: Vec<Vec<f64>>,
}

impl Table {
    /// A column by name.
    pub fn column(&self, name: &str) -> Option<&[f64]> {
        self.names.iter().position(|n| n == name).map(|k| self.columns[k].as_slice())
    }

    /// Appends a message: an object with `t` and numbers.
    pub(crate) fn push(&mut self, json: &[u8]) -> serde_json::Result<()> {
        let rows = self.t_s.len();
        let mut reader = serde_json::Deserializer::from_slice(json);
        let read = Row { table: self, rows }.deserialize(&mut reader);
        // A message that breaks off halfway must not leave columns of different length.
        if read.is_err() {
            self.t_s.truncate(rows);
            self.columns.iter_mut().for_each(|c| c.truncate(rows));
        } else {
            self.t_s.resize(rows + 1, 0.0);
            self.columns.iter_mut().for_each(|c| c.resize(rows + 1, f64::NAN));
        }
        read
    }

    fn place(&mut self, name: &str, guess: usize, rows: usize) -> usize {
        if self.names.get(guess).is_some_and(|n| n == name) {
            return guess;
        }
        if let Some(k) = self.names.iter().position(|n| n == name) {
            return k;
        }
        self.names.push(name.to_owned());
        self.columns.push(vec![f64::NAN; rows]);
        self.names.len() - 1
    }
}

struct Row<'a> {
    table: &'a mut Table,
    rows: usize,
}

impl<'de> DeserializeSeed<'de> for Row<'_> {
    type Value = ();
    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_map(self)
    }
}

impl<'de> Visitor<'de> for Row<'_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("an object of numbers")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<(), A::Error> {
        let mut guess = 0;
        while let Some(key) = map.next_key::<std::borrow::Cow<str>>()? {
            let value: Number = map.next_value()?;
            if key == "t" {
                self.table.t_s.resize(self.rows, 0.0);
                self.table.t_s.push(value.0);
            } else {
                let k = self.table.place(&key, guess, self.rows);
                if self.table.columns[k].len() == self.rows {
                    self.table.columns[k].push(value.0);
                }
                guess = k + 1;
            }
        }
        Ok(())
    }
}

/// A number, or true and false as 1 and 0; anything else is NaN.
struct Number(f64);

impl<'de> serde::Deserialize<'de> for Number {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(NumberVisitor)
    }
}

struct NumberVisitor;

impl Visitor<'_> for NumberVisitor {
    type Value = Number;
    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a number, true, false or null")
    }
    fn visit_f64<E>(self, v: f64) -> Result<Number, E> {
        Ok(Number(v))
    }
    fn visit_u64<E>(self, v: u64) -> Result<Number, E> {
        Ok(Number(v as f64))
    }
    fn visit_i64<E>(self, v: i64) -> Result<Number, E> {
        Ok(Number(v as f64))
    }
    fn visit_bool<E>(self, v: bool) -> Result<Number, E> {
        Ok(Number(f64::from(u8::from(v))))
    }
    fn visit_unit<E>(self) -> Result<Number, E> {
        Ok(Number(f64::NAN))
    }
    fn visit_str<E>(self, _: &str) -> Result<Number, E> {
        Ok(Number(f64::NAN))
    }
}
