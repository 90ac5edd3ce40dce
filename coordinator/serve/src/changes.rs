//! The changes that clients made to a run: in order, to repeat them; by variable, to undo them.

use serde_json::{Value, json};
use terraglue_scenario::Scenario;

/// A change.
#[derive(Clone, Debug, PartialEq)]
pub enum Kind {
    /// A variable got a value; before it was the other.
    Set {
        /// Full name.
        name: String,
        /// The new value.
        value: Value,
        /// The value before.
        was: Value,
    },
    /// An action was called.
    Act {
        /// Full name.
        name: String,
        /// JSON.
        arguments: String,
    },
}

/// A change with its time.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    /// Steps done before it.
    pub step: u64,
    /// Simulated time, s.
    pub t_s: f64,
    /// Its kind.
    pub kind: Kind,
}

/// All changes of a run.
#[derive(Clone, Debug, Default)]
pub struct Changes {
    all: Vec<Change>,
}

impl Changes {
    /// Notes one.
    pub fn push(&mut self, change: Change) {
        self.all.push(change);
    }

    /// Those of this step, in their order.
    pub fn at(&self, step: u64) -> Vec<Change> {
        self.all.iter().filter(|change| change.step == step).cloned().collect()
    }

    /// Forgets those of this step and of all later ones.
    pub fn forget_from(&mut self, step: u64) {
        self.all.retain(|change| change.step < step);
    }

    /// The value of a variable before it was changed first.
    pub fn original(&self, name: &str) -> Option<Value> {
        self.all.iter().find_map(|change| match &change.kind {
            Kind::Set { name: own, was, .. } if own == name => Some(was.clone()),
            _ => None,
        })
    }

    /// For `/changed`: each variable that is not as it was, with its value, the one before the first change, and the time of the last.
    pub fn list(&self) -> Value {
        let mut by_name: Vec<(String, Value, Value, f64)> = Vec::new();
        for change in &self.all {
            let Kind::Set { name, value, was } = &change.kind else { continue };
            match by_name.iter_mut().find(|(own, ..)| own == name) {
                Some(known) => (known.1, known.3) = (value.clone(), change.t_s),
                None => by_name.push((name.clone(), value.clone(), was.clone(), change.t_s)),
            }
        }
        by_name.retain(|(_, value, was, _)| value != was);
        let one = |(id, value, was, t_s): (String, Value, Value, f64)| json!({ "id": id, "value": value, "was": was, "t_s": t_s });
        by_name.into_iter().map(one).collect()
    }

    /// The scenario with all of them as events: it gives the same run again.
    ///
    /// # Errors
    /// An action was called with arguments, which an event cannot hold.
    pub fn scenario(&self, scenario: &Scenario) -> Result<String, String> {
        let mut text = scenario.source.text.trim_end().to_owned();
        text.push('\n');
        let mut last: Option<u64> = None;
        for change in &self.all {
            let event = match &change.kind {
                Kind::Set { name, value, .. } => {
                    format!("set = {{ {} = {} }}\n", quoted(name), literal(value))
                }
                Kind::Act { name, arguments } if arguments == "{}" => format!("act = [{}]\n", quoted(name)),
                Kind::Act { name, .. } => {
                    return Err(format!(
                        "`{name}` was called with arguments, which no event of a scenario can hold"
                    ));
                }
            };
            if last != Some(change.step) {
                text.push_str("\n# changed while the run went on\n");
            }
            last = Some(change.step);
            text.push_str(&format!("[[event]]\nat_s = {}\n{event}", literal(&json!(change.t_s))));
        }
        Ok(text)
    }
}

/// A text as TOML.
fn quoted(text: &str) -> String {
    // what JSON escapes is escaped alike
    json!(text).to_string()
}

/// A value as TOML: a number keeps its point.
fn literal(value: &Value) -> String {
    match value {
        Value::Number(n) if n.is_f64() => {
            let text = format!("{:?}", n.as_f64().unwrap_or_default());
            if text.contains(['.', 'e']) { text } else { format!("{text}.0") }
        }
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn set(step: u64, value: f64, was: f64) -> Change {
        let kind = Kind::Set { name: "robot.LF_j2.max_torque".into(), value: json!(value), was: json!(was) };
        Change { step, t_s: 0.001 * step as f64, kind }
    }

    #[test]
    fn a_variable_that_is_as_it_was_is_no_longer_listed() {
        let mut changes = Changes::default();
        changes.push(set(10, 3.0, 60.0));
        changes.push(set(20, 0.0, 3.0));
        let list = changes.list();
        assert_eq!(
            (&list[0]["value"], &list[0]["was"], &list[0]["t_s"]),
            (&json!(0.0), &json!(60.0), &json!(0.02))
        );
        assert_eq!(changes.original("robot.LF_j2.max_torque"), Some(json!(60.0)));
        changes.push(set(30, 60.0, 0.0));
        assert_eq!(changes.list(), json!([]));
        changes.forget_from(20);
        assert_eq!(changes.list()[0]["value"], json!(3.0));
    }

    #[test]
    fn changes_are_events_of_a_scenario() -> Result<(), Box<dyn std::error::Error>> {
        let scenario = Scenario::parse(
            "[time]\nstep_s = 0.001\nduration_s = 1.0\n[soil]\nmodule = \"soil-bekker\"\n",
            "a.toml",
            &[],
        )?;
        let mut changes = Changes::default();
        changes.push(set(10, 3.0, 60.0));
        changes.push(Change {
            step: 20,
            t_s: 0.02,
            kind: Kind::Act { name: "robot.lift".into(), arguments: "{}".into() },
        });
        let text = changes.scenario(&scenario)?;
        assert!(
            text.contains("[[event]]\nat_s = 0.01\nset = { \"robot.LF_j2.max_torque\" = 3.0 }\n"),
            "{text}"
        );
        assert!(text.contains("[[event]]\nat_s = 0.02\nact = [\"robot.lift\"]\n"), "{text}");
        changes.push(Change {
            step: 21,
            t_s: 0.021,
            kind: Kind::Act { name: "robot.lift".into(), arguments: "{\"n\":1}".into() },
        });
        assert!(changes.scenario(&scenario).is_err());
        Ok(())
    }
}
