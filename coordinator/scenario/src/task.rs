//! `[task]`: observation, action and reward of an environment for learning.

use super::model::TaskSpec;
use super::section::Section;
use super::subsystems::{check_reference, texts};
use terraglue_diagnostics::InputError;

type Checked<T> = Result<T, Box<InputError>>;

/// Reads the table; `names` are those of the subsystems.
pub fn read(s: &Section, names: &[&str]) -> Checked<TaskSpec> {
    let observe = variables(s, "observe", names)?;
    let acted = variables(s, "act", names)?;
    let (low, high) = (bounds(s, "low", acted.len())?, bounds(s, "high", acted.len())?);
    let act: Vec<(String, [f64; 2])> = acted
        .into_iter()
        .zip(low.into_iter().zip(high))
        .map(|(name, (low, high))| (name, [low, high]))
        .collect();
    if let Some((name, [low, high])) = act.iter().find(|(_, [low, high])| low >= high) {
        let message = format!("the range of `{name}` is empty: {low} to {high}");
        return Err(s.error("high", message, Some("each entry of `high` is above that of `low`".into())));
    }
    for (key, given) in [("observe", observe.is_empty()), ("act", act.is_empty())] {
        if given {
            let help = "list variables, `subsystem.variable`".to_owned();
            return Err(s.error(key, format!("a task needs `{key}`"), Some(help)));
        }
    }
    let reward = variables(s, "reward", names)?;
    if reward.is_empty() {
        let help = "list variables whose growth counts, `reward = \"robot.body.x\"`".to_owned();
        return Err(s.error("reward", "a task needs `reward`".into(), Some(help)));
    }
    Ok(TaskSpec {
        observe,
        act,
        reward,
        cost: variables(s, "cost", names)?,
        tilt: variables(s, "tilt", names)?,
        fallen_rad: s.number("fallen_rad"),
        period_s: s.number("period_s"),
        duration_s: s.optional_number("duration_s"),
    })
}

fn variables(s: &Section, key: &str, names: &[&str]) -> Checked<Vec<String>> {
    let all = s.entry(key).map(texts).unwrap_or_default();
    for name in &all {
        check_reference(name, names).map_err(|c| s.error(key, c.message, c.help))?;
    }
    Ok(all)
}

/// A number for each variable of `act`.
fn bounds(s: &Section, key: &str, count: usize) -> Checked<Vec<f64>> {
    let value = s.value(key);
    let all: Vec<f64> =
        value.as_array().into_iter().flatten().filter_map(serde_json::Value::as_f64).collect();
    if all.len() == count && all.iter().all(|x| x.is_finite()) {
        return Ok(all);
    }
    let message = format!("`{key}` has {} numbers, `act` has {count} entries", all.len());
    Err(s.error(key, message, Some("give one number for each entry of `act`".into())))
}
