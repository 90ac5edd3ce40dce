//! The parameters of an instance, already checked by the host against the module's schema.

use crate::error::{Error, Result};
use crate::schema::Schema;
use serde_json::Value;

/// Parameter values by dotted name.
///
/// ```
/// use terraglue_subsystem::Config;
///
/// let config = Config::parse(r#"{"gear": {"ratio": 0.25}, "axes": [1.0, 2.0]}"#)?;
/// assert_eq!((config.number("gear.ratio")?, config.numbers("axes")?), (0.25, vec![1.0, 2.0]));
/// let missing = config.number("gear.backlash").expect_err("it is not given");
/// assert!(missing.to_string().contains("gear.backlash"));
/// # Ok::<(), terraglue_subsystem::Error>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Config {
    values: serde_json::Map<String, Value>,
}

impl Config {
    /// From a JSON object; nested objects are reached by dotted names.
    ///
    /// # Errors
    /// [`Error::Refused`]: the text is no JSON object.
    pub fn parse(json: &str) -> Result<Self> {
        match serde_json::from_str(json) {
            Ok(Value::Object(values)) => Ok(Self { values }),
            Ok(_) => Err(Error::Refused("configuration is not a JSON object".into())),
            Err(e) => Err(Error::Refused(format!("configuration is not JSON: {e}"))),
        }
    }

    /// The same with the defaults of the schema for missing values.
    pub fn with_defaults(mut self, schema: &Schema) -> Self {
        for p in &schema.parameters {
            if !p.default.is_null() && self.get(&p.name).is_none() {
                insert(&mut self.values, &p.name, p.default.clone());
            }
        }
        self
    }

    /// The same with another value for a dotted name.
    pub fn with(mut self, name: &str, value: impl Into<Value>) -> Self {
        insert(&mut self.values, name, value.into());
        self
    }

    /// Value of a dotted name.
    pub fn get(&self, name: &str) -> Option<&Value> {
        let mut parts = name.split('.');
        let mut value = self.values.get(parts.next()?)?;
        for part in parts {
            value = value.get(part)?;
        }
        Some(value)
    }

    /// A number.
    ///
    /// # Errors
    /// [`Error::Refused`]: it is missing or no number.
    pub fn number(&self, name: &str) -> Result<f64> {
        self.optional_number(name)?.ok_or_else(|| missing(name))
    }

    /// A number that may be absent.
    ///
    /// # Errors
    /// [`Error::Refused`]: it is no number.
    pub fn optional_number(&self, name: &str) -> Result<Option<f64>> {
        match self.get(name) {
            None | Some(Value::Null) => Ok(None),
            Some(v) => v.as_f64().map(Some).ok_or_else(|| wrong(name, v, "a number")),
        }
    }

    /// Text.
    ///
    /// # Errors
    /// [`Error::Refused`]: it is missing or no text.
    pub fn text(&self, name: &str) -> Result<&str> {
        let v = self.get(name).ok_or_else(|| missing(name))?;
        v.as_str().ok_or_else(|| wrong(name, v, "text"))
    }

    /// true or false; false when absent.
    ///
    /// # Errors
    /// [`Error::Refused`]: it is neither true nor false.
    pub fn flag(&self, name: &str) -> Result<bool> {
        match self.get(name) {
            None | Some(Value::Null) => Ok(false),
            Some(v) => v.as_bool().ok_or_else(|| wrong(name, v, "true or false")),
        }
    }

    /// A list of numbers; empty when absent.
    ///
    /// # Errors
    /// [`Error::Refused`]: it is no list of numbers.
    pub fn numbers(&self, name: &str) -> Result<Vec<f64>> {
        match self.get(name) {
            None | Some(Value::Null) => Ok(Vec::new()),
            Some(v) => v
                .as_array()
                .and_then(|a| a.iter().map(Value::as_f64).collect())
                .ok_or_else(|| wrong(name, v, "a list of numbers")),
        }
    }

    /// The table below a name as (key, number), in the order of the keys; empty when absent.
    ///
    /// # Errors
    /// [`Error::Refused`]: it is no table of numbers.
    pub fn number_table(&self, name: &str) -> Result<Vec<(String, f64)>> {
        match self.get(name) {
            None | Some(Value::Null) => Ok(Vec::new()),
            Some(v) => v
                .as_object()
                .and_then(|o| o.iter().map(|(k, v)| v.as_f64().map(|x| (k.clone(), x))).collect())
                .ok_or_else(|| wrong(name, v, "a table of numbers")),
        }
    }

    /// As a JSON object.
    pub fn to_json(&self) -> String {
        Value::Object(self.values.clone()).to_string()
    }
}

fn missing(name: &str) -> Error {
    Error::Refused(format!("parameter `{name}` is missing"))
}

fn wrong(name: &str, value: &Value, expected: &str) -> Error {
    Error::Refused(format!("parameter `{name}` = {value} is not {expected}"))
}

fn insert(map: &mut serde_json::Map<String, Value>, name: &str, value: Value) {
    match name.split_once('.') {
        None => drop(map.insert(name.into(), value)),
        Some((head, rest)) => {
            let below = map.entry(head).or_insert_with(|| Value::Object(serde_json::Map::new()));
            if let Value::Object(below) = below {
                insert(below, rest, value);
            }
        }
    }
}
