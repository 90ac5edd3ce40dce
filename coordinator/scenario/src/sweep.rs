//! `[sweep]`: which keys of a scenario differ from run to run.

use super::model::{SweepSpec, VariedKey, VariedValues};
use super::node::{Node, Raw};
use super::section::Section;
use super::subsystems::texts;
use terraglue_diagnostics::{InputError, did_you_mean};

type Checked<T> = Result<T, Box<InputError>>;

/// Reads the table.
pub fn read(s: &Section) -> Checked<SweepSpec> {
    let spec = SweepSpec {
        method: s.text("method"),
        points: usize::try_from(s.count("points")).unwrap_or(usize::MAX),
        seeds: s.count("seeds"),
        seed: s.count("seed"),
        table: s.entry("table").map(|_| s.file("table")),
        collect: s.entry("collect").map(texts).unwrap_or_default(),
        vary: s.entry("vary").map(|node| varied(s, node)).transpose()?.unwrap_or_default(),
    };
    let refuse = |key: &str, message: &str, help: &str| Err(s.error(key, message.into(), Some(help.into())));
    match (spec.method.as_str(), &spec.table) {
        ("table", None) => {
            return refuse("method", "the method `table` needs a table", "give `table = \"points.csv\"`");
        }
        ("table", Some(_)) if !spec.vary.is_empty() => {
            return refuse(
                "vary",
                "the points of the method `table` are the rows of its table",
                "leave `vary` out",
            );
        }
        ("grid" | "latin-hypercube" | "sobol", Some(_)) => {
            return refuse("table", "`table` is of the method `table`", "write `method = \"table\"`");
        }
        ("latin-hypercube" | "sobol", None) if spec.vary.is_empty() => {
            return refuse("method", "there is nothing to spread points over", "give `[sweep.vary]`");
        }
        ("grid", None) if spec.vary.is_empty() && spec.seeds == 0 => {
            return refuse(
                "method",
                "nothing differs from run to run",
                "give `[sweep.vary]`, or `seeds` of several runs",
            );
        }
        _ => {}
    }
    if spec.method == "grid" && s.entry("points").is_some() {
        return refuse(
            "points",
            "`points` is of latin-hypercube and sobol",
            "a grid has `count` in its ranges",
        );
    }
    Ok(spec)
}

fn varied(s: &Section, node: &Node) -> Checked<Vec<VariedKey>> {
    let is_grid = s.text("method") == "grid";
    let one = |(key, entry): &(String, Node)| {
        let at = |message: String, help: &str| s.error_at(&entry.at, message, Some(help.to_owned()));
        if key == "world.seed" && s.count("seeds") > 0 {
            return Err(at("`world.seed` is that of `seeds`".into(), "leave one of both out"));
        }
        let values = match &entry.value {
            Raw::List(items) if !items.is_empty() => {
                let all = items.iter().map(written).collect::<Option<Vec<String>>>();
                all.map(VariedValues::List).ok_or_else(|| {
                    at(
                        format!("`{key}` has a value that no `--set` can give"),
                        "values are numbers, texts, truth values, or lists of them",
                    )
                })?
            }
            Raw::Table(_) => range(s, key, entry, is_grid)?,
            _ => {
                let help = "write [a, b, c], or { from = a, to = b } for a range";
                return Err(at(format!("`{key}` takes a list of values or a range"), help));
            }
        };
        Ok(VariedKey { key: key.clone(), values })
    };
    node.entries().iter().map(one).collect()
}

/// Keys of a range.
const RANGE: [&str; 4] = ["from", "to", "count", "log"];

fn range(s: &Section, key: &str, entry: &Node, is_grid: bool) -> Checked<VariedValues> {
    let at = |node: &Node, message: String, help: Option<String>| Err(s.error_at(&node.at, message, help));
    if let Some((name, node)) = entry.entries().iter().find(|(name, _)| !RANGE.contains(&name.as_str())) {
        // a key path without quotes is read as tables in tables
        let help = did_you_mean(name, RANGE)
            .unwrap_or_else(|| format!("a path is written in quotes: \"{key}.{name}\" = [1, 2]"));
        return at(node, format!("a range has no key `{name}`"), Some(help));
    }
    let ends = ["from", "to"].map(|name| entry.get(name).and_then(|node| node.to_json().as_f64()));
    let [Some(from), Some(to)] = ends else {
        return at(
            entry,
            format!("`{key}` lacks `from` or `to`"),
            Some("write { from = 0.0, to = 1.0 }".into()),
        );
    };
    let is_log = entry.get("log").is_some_and(|node| node.to_json() == true);
    if from >= to || (is_log && from <= 0.0) {
        let help = if is_log { "0 < from < to" } else { "from < to" };
        return at(entry, format!("`{key}` has no range from {from} to {to}"), Some(help.into()));
    }
    let count = entry.get("count").map(|node| (node, node.to_json().as_u64()));
    let count = match count {
        Some((node, _)) if !is_grid => {
            return at(
                node,
                "`count` is of the method `grid`".into(),
                Some("`points` says how many there are".into()),
            );
        }
        Some((_, Some(n @ 2..=1_000_000))) => Some(n as usize),
        Some((node, _)) => {
            return at(node, format!("`{key}` takes a `count` of 2 or more"), None);
        }
        None if is_grid => {
            return at(
                entry,
                format!("the range of `{key}` has no `count`"),
                Some("a grid needs the number of its values: { from = 0.0, to = 1.0, count = 5 }".into()),
            );
        }
        None => None,
    };
    let whole = |name: &str| entry.get(name).is_some_and(|node| matches!(node.value, Raw::Integer(_)));
    Ok(VariedValues::Range { ends: [from, to], is_whole: whole("from") && whole("to"), is_log, count })
}

/// A value as `--set` takes it: a text without quotes where it cannot be read as anything else.
fn written(node: &Node) -> Option<String> {
    Some(match &node.value {
        Raw::Text(text) => {
            let is_plain = text.parse::<toml_edit::Value>().is_err()
                && text.trim() == text
                && !text.is_empty()
                && !text.contains(char::is_control);
            if is_plain { text.clone() } else { toml_edit::Value::from(text.as_str()).to_string() }
        }
        Raw::Bool(value) => value.to_string(),
        Raw::Integer(value) => value.to_string(),
        Raw::Number(value) => format!("{value:?}"),
        Raw::List(items) => {
            let quoted = |item: &Node| match &item.value {
                Raw::Text(text) => Some(toml_edit::Value::from(text.as_str()).to_string()),
                _ => written(item),
            };
            format!("[{}]", items.iter().map(quoted).collect::<Option<Vec<_>>>()?.join(", "))
        }
        Raw::Table(_) => return None,
    })
}
