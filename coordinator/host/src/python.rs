//! Modules in Python: one file that says in its docstring what it is, so that nothing of it runs to be listed or checked.
//!
//! From the line `[module]` on the docstring is TOML. `[module]` gives `name`, `kind`, and as far as wanted `help` (else the
//! first line of the docstring), `version`, `license`, `authors`, `can` (what an instance can do, in words); `[parameters]`
//! gives a table per parameter with the keys of [`Parameter`], the type `number` where none is named; `[variables]` gives
//! each the text `ROLE TYPE UNIT`.

use super::description::Description;
use super::error::LoadError;
use serde_json::{Map, Value};
use std::path::{Path, PathBuf};
use terraglue_subsystem::{Kind, Parameter, Schema};

/// Description of a file.
#[derive(Clone, Debug)]
pub(super) struct PythonFile {
    pub schema: Schema,
    pub description: Description,
}

/// Whether a path ends as files of Python do.
pub fn is_python(path: &Path) -> bool {
    path.extension().is_some_and(|e| e == "py")
}

/// Whether a file of Python describes a module, well or badly.
pub fn describes_module(path: &Path) -> bool {
    is_python(path) && terraglue_subsystem::files::read_text(path).is_ok_and(|text| block(&text).is_some())
}

/// The interpreter for modules: the one that is named (relative to `folder` where it has a `/`), else that of the virtual
/// environment, else `python3` of the path.
pub fn interpreter(named: Option<&str>, folder: &Path) -> PathBuf {
    match (named, std::env::var_os("VIRTUAL_ENV")) {
        (Some(path), _) if path.contains('/') => {
            let path = folder.join(path);
            std::path::absolute(&path).unwrap_or(path)
        }
        (Some(name), _) => name.into(),
        (None, Some(environment)) => PathBuf::from(environment).join("bin/python"),
        (None, None) => "python3".into(),
    }
}

impl PythonFile {
    /// Reads the description; no line of the file runs.
    pub fn read(path: &Path) -> Result<Self, LoadError> {
        let text = terraglue_subsystem::files::read_text(path)
            .map_err(|e| LoadError::CannotLoad { path: path.into(), reason: e.to_string() })?;
        parse(&text).map_err(|message| LoadError::Schema { path: path.into(), message })
    }
}

/// The docstring, which must be the first statement, and from where in it the block runs.
fn block(text: &str) -> Option<(&str, &str)> {
    let mut rest = text.trim_start_matches('\u{feff}');
    loop {
        rest = rest.trim_start();
        let Some(comment) = rest.strip_prefix('#') else { break };
        rest = comment.split_once('\n')?.1;
    }
    rest = rest.strip_prefix(['r', 'R']).unwrap_or(rest);
    let quotes = ["\"\"\"", "'''"].into_iter().find(|q| rest.starts_with(q))?;
    let docstring = rest[3..].split_once(quotes)?.0;
    let at = docstring.match_indices("[module]").map(|(at, _)| at).find(|at| {
        let before = &docstring[..*at];
        before.ends_with('\n') && docstring[*at..].lines().next().is_some_and(|l| l.trim() == "[module]")
    })?;
    Some((&docstring[..at], &docstring[at..]))
}

fn parse(text: &str) -> Result<PythonFile, String> {
    let Some((before, block)) = block(text) else {
        return Err("the file does not begin with a docstring that holds a line `[module]`; \
                    `terraglue new soil my-soil --lang python` makes one"
            .into());
    };
    if block.contains('\\') {
        return Err("the block from `[module]` on holds a backslash; write TOML without escapes".into());
    }
    let document: toml_edit::DocumentMut =
        block.parse().map_err(|e| format!("its block from `[module]` on is no TOML: {e}"))?;
    const TABLES: [&str; 3] = ["module", "parameters", "variables"];
    if let Some((key, _)) = document.iter().find(|(key, _)| !TABLES.contains(key)) {
        return Err(format!(
            "its block has a table `{key}`; there are [module], [parameters] and [variables]"
        ));
    }
    let about = table(document.get("module"))?;
    const KEYS: [&str; 7] = ["name", "kind", "help", "version", "license", "authors", "can"];
    known(&about, &KEYS, "[module]")?;
    let word = |key: &str| about.get(key).and_then(Value::as_str).unwrap_or_default().to_owned();
    let first = before.lines().map(str::trim).find(|l| !l.is_empty()).unwrap_or_default();
    let help = Some(word("help")).filter(|h| !h.is_empty()).unwrap_or_else(|| first.into());
    let kind: Kind =
        serde_json::from_value(about.get("kind").cloned().unwrap_or_default()).map_err(|_| {
            format!("kind = \"{}\" in [module]; write soil, robot, controller, law or sensor", word("kind"))
        })?;
    if word("name").is_empty() {
        return Err("[module] has no name".into());
    }
    let parameters = table(document.get("parameters"))?;
    let parameters = parameters.iter().map(|(name, p)| parameter(name, p)).collect::<Result<_, _>>()?;
    let variables = table(document.get("variables"))?.into_iter().map(|(name, what)| match what {
        Value::String(what) => Ok(format!("{name} {what}").trim_end().to_owned()),
        _ => Err(format!("[variables] {name} is no text, e.g. \"{name}\" = \"output f64 N m\"")),
    });
    let can = about.contains_key("can").then(|| word("can").split_whitespace().map(Into::into).collect());
    let schema = Schema { name: word("name"), kind, help, parameters };
    let description = Description {
        name: word("name"),
        version: word("version"),
        abi: "Python".into(),
        kind: word("kind"),
        can,
        variables: variables.collect::<Result<_, _>>()?,
        license: word("license"),
        authors: word("authors"),
    };
    Ok(PythonFile { schema, description })
}

/// A table of TOML as JSON; empty where there is none.
fn table(item: Option<&toml_edit::Item>) -> Result<Map<String, Value>, String> {
    let Some(item) = item else { return Ok(Map::new()) };
    let table = item.as_table_like().ok_or("a table was expected")?;
    table.iter().map(|(key, item)| Ok((key.to_owned(), json(key, item)?))).collect()
}

fn json(key: &str, item: &toml_edit::Item) -> Result<Value, String> {
    match item.as_value() {
        Some(value) => value_of(value).ok_or_else(|| format!("`{key}` has no value that can be read")),
        None => table(Some(item)).map(Value::Object).map_err(|e| format!("`{key}`: {e}")),
    }
}

/// A value of TOML as JSON; None: a date.
pub fn value_of(value: &toml_edit::Value) -> Option<Value> {
    Some(match value {
        toml_edit::Value::String(s) => Value::from(s.value().as_str()),
        toml_edit::Value::Integer(i) => Value::from(*i.value()),
        toml_edit::Value::Float(x) => Value::from(*x.value()),
        toml_edit::Value::Boolean(b) => Value::from(*b.value()),
        toml_edit::Value::Array(a) => Value::Array(a.iter().map(value_of).collect::<Option<_>>()?),
        toml_edit::Value::InlineTable(t) => Value::Object(
            t.iter().map(|(k, v)| Some((k.to_owned(), value_of(v)?))).collect::<Option<Map<_, _>>>()?,
        ),
        toml_edit::Value::Datetime(_) => return None,
    })
}

fn known(table: &Map<String, Value>, keys: &[&str], place: &str) -> Result<(), String> {
    let Some(odd) = table.keys().find(|k| !keys.contains(&k.as_str())) else { return Ok(()) };
    Err(format!("`{odd}` in {place} is not known; there are {}", keys.join(", ")))
}

fn parameter(name: &str, given: &Value) -> Result<Parameter, String> {
    const KEYS: [&str; 9] =
        ["type", "unit", "help", "default", "optional", "min", "max", "above_min", "choices"];
    let place = format!("[parameters] {name}");
    let Value::Object(given) = given else {
        return Err(format!(
            "{place} is no table, e.g. {name} = {{ unit = \"N\", default = 1.0, help = \"…\" }}"
        ));
    };
    known(given, &KEYS, &place)?;
    let mut all = given.clone();
    all.insert("name".into(), name.into());
    all.entry("type").or_insert_with(|| "number".into());
    all.entry("help").or_insert_with(|| "".into());
    serde_json::from_value(Value::Object(all)).map_err(|e| format!("{place}: {e}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILE: &str = "#!/usr/bin/env python3\n# A soil.\n\"\"\"Ground that yields.\n\nMore.\n\n[module]\nname = \"my-soil\"\n\
        kind = \"soil\"\nversion = \"1.2\"\ncan = \"force retry\"\n\n\
        [variables]\ndepth = \"output f64 m\"\non = \"parameter bool\"\n\n[parameters]\n\
        k = { unit = \"N/m\", default = 2e4, min = 0.0, above_min = true, help = \"Stiffness\" }\n\
        law = { type = \"text\", default = \"a\", choices = [\"a\", \"b\"], help = \"Which\" }\n\"\"\"\nraise SystemExit\n";

    #[test]
    fn a_file_is_described_without_being_run() {
        let file = parse(FILE).expect("good");
        assert_eq!((file.schema.name.as_str(), file.schema.kind), ("my-soil", Kind::Soil));
        assert_eq!(file.schema.help, "Ground that yields.");
        assert_eq!(file.description.version, "1.2");
        assert_eq!((file.description.kind.as_str(), file.description.can.is_some()), ("soil", true));
        assert_eq!(file.description.variables, ["depth output f64 m", "on parameter bool"]);
        let [k, law] = &file.schema.parameters[..] else { panic!("{:?}", file.schema.parameters) };
        assert_eq!((k.name.as_str(), k.default.as_f64(), k.above_min), ("k", Some(2e4), true));
        assert_eq!(law.choices, ["a", "b"]);
    }

    #[test]
    fn mistakes_of_a_description_are_named() {
        let cases = [
            ("[module]", "[modul]", "line `[module]`"),
            ("\"soil\"", "\"soul\"", "kind = \"soul\""),
            ("name = \"my-soil\"\n", "", "no name"),
            ("above_min", "abov", "`abov` in [parameters] k"),
            ("version", "verison", "`verison` in [module]"),
            ("unit = \"N/m\"", "unit = 3", "[parameters] k: invalid type"),
            ("default = 2e4", "default = ", "no TOML"),
            ("\"N/m\"", "\"\\\\N\"", "backslash"),
            ("[parameters]", "[parameter]", "table `parameter`"),
            ("\"output f64 m\"", "1.0", "[variables] depth is no text"),
        ];
        for (old, new, told) in cases {
            let error = parse(&FILE.replacen(old, new, 1)).expect_err(new);
            assert!(error.contains(told), "{new}: {error}");
        }
    }
}
