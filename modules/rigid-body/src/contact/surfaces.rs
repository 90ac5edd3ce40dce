//! Friction and restitution of pairs of bodies as a scenario gives them: a number for all, or a table by pairs `A & B`, where
//! `*` stands for any text and `ground` is all that stands still.

use crate::model::Model;
use crate::placement::matches;
use serde_json::Value;
use terraglue_subsystem::{Config, Error, Parameter, ParameterType, Result};

/// Name of everything that stands still.
const GROUND: &str = "ground";
/// Pattern of all pairs.
const ALL: &str = "*";
/// A parameter: name, default, largest value, help.
type SurfaceParameter = (&'static str, f64, f64, &'static str);

const FRICTION: SurfaceParameter =
    ("friction", 0.8, f64::INFINITY, "Coulomb friction among bodies and with rigid ground");
const RESTITUTION: SurfaceParameter =
    ("restitution", 0.0, 1.0, "Newton's coefficient of restitution among bodies and with rigid ground");

/// Surface data of two bodies that touch; none: the general ones.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Pair {
    pub friction: Option<f64>,
    pub restitution: Option<f64>,
}

/// Friction and restitution of all pairs.
#[derive(Clone, Debug, Default)]
pub(crate) struct Surfaces {
    /// Of pairs without numbers of their own in the scenario or, for friction, in the robot file.
    pub friction: f64,
    pub restitution: f64,
    /// By both bodies, fixed shapes last; empty where no pair has numbers of its own.
    pairs: Vec<Pair>,
    bodies: usize,
}

/// The parameters of the scenario.
pub(crate) fn parameters() -> impl Iterator<Item = Parameter> {
    [FRICTION, RESTITUTION].into_iter().map(|(name, default, most, help)| {
        let help = format!(
            "{help}, for all or by pairs of bodies: `{{ \"{ALL}\" = {default:?}, \"*_foot & {GROUND}\" = … }}`, where `{GROUND}` \
             is all that stands still"
        );
        let of = Parameter::of(name, ParameterType::NumberByName, &help).or(default).within(0.0, most);
        Parameter { unit: "1".into(), ..of }
    })
}

impl Surfaces {
    /// Refused: a pattern that is no pair, or fits none.
    pub fn from_config(config: &Config, model: &Model) -> Result<Self> {
        let names: Vec<&str> = model.bodies.iter().map(|b| b.name.as_str()).chain([GROUND]).collect();
        let (friction, frictions) = read(config, FRICTION, &names)?;
        let (restitution, restitutions) = read(config, RESTITUTION, &names)?;
        let n = names.len();
        let of = |k: usize| {
            let pair = [names[k / n], names[k % n]];
            Pair { friction: best(&frictions, pair), restitution: best(&restitutions, pair) }
        };
        let silent = frictions.is_empty() && restitutions.is_empty();
        let pairs = if silent { Vec::new() } else { (0..n * n).map(of).collect() };
        Ok(Self { friction, restitution, pairs, bodies: model.bodies.len() })
    }

    /// Surface data of two bodies from the scenario; none: a body that stands still.
    pub fn of(&self, bodies: [Option<usize>; 2]) -> Pair {
        let [a, b] = bodies.map(|b| b.unwrap_or(self.bodies));
        self.pairs.get(a * (self.bodies + 1) + b).copied().unwrap_or_default()
    }
}

/// A pattern of two names and its number.
struct PairPattern<'a> {
    names: [&'a str; 2],
    value: f64,
}

impl PairPattern<'_> {
    fn fits(&self, [a, b]: [&str; 2]) -> bool {
        let [p, q] = self.names;
        matches(p, a) && matches(q, b) || matches(p, b) && matches(q, a)
    }

    /// Names that are written out, then the length of the patterns: the more specific pattern goes first.
    fn rank(&self) -> (usize, usize) {
        let plain = self.names.iter().filter(|p| !p.contains('*')).count();
        (plain, self.names.iter().map(|p| p.len()).sum())
    }
}

/// The number of all pairs, and those of some.
fn read<'a>(
    config: &'a Config,
    (key, default, ..): SurfaceParameter,
    names: &[&str],
) -> Result<(f64, Vec<PairPattern<'a>>)> {
    let Some(Value::Object(table)) = config.get(key) else { return Ok((config.number(key)?, Vec::new())) };
    let everywhere = table.get(ALL).and_then(Value::as_f64).unwrap_or(default);
    Ok((everywhere, rows(key, table, names)?))
}

fn rows<'a>(
    key: &str,
    table: &'a serde_json::Map<String, Value>,
    names: &[&str],
) -> Result<Vec<PairPattern<'a>>> {
    let row = |(pattern, value): (&'a String, &Value)| {
        let wrong = |text: &str| Error::Refused(format!("parameter `{key}`: `{pattern}` {text}"));
        let (a, b) = pattern
            .split_once('&')
            .ok_or_else(|| wrong(&format!("is no pair; write `A & B`, or `{ALL}` for all pairs")))?;
        let value = value.as_f64().ok_or_else(|| wrong(&format!("= {value} is not a number")))?;
        let row = PairPattern { names: [a.trim(), b.trim()], value };
        let met = names.iter().enumerate().any(|(k, a)| names[..k].iter().any(|b| row.fits([a, b])));
        met.then_some(row).ok_or_else(|| {
            wrong(&format!(
                "fits no two bodies; `{GROUND}` is all that stands still, the bodies are {}",
                some(names)
            ))
        })
    };
    table.iter().filter(|(pattern, _)| *pattern != ALL).map(row).collect()
}

/// The first names, for a message.
fn some(names: &[&str]) -> String {
    const SHOWN: usize = 8;
    let shown = names.iter().filter(|n| **n != GROUND).take(SHOWN).copied().collect::<Vec<_>>().join(", ");
    if names.len() > SHOWN + 1 { format!("{shown}, …") } else { shown }
}

fn best(rows: &[PairPattern], pair: [&str; 2]) -> Option<f64> {
    rows.iter().filter(|row| row.fits(pair)).max_by_key(|row| row.rank()).map(|row| row.value)
}
