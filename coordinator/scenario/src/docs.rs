//! The key tables of `docs/scenario.md`, made from [`super::keys`].

use super::keys::{Key, Table, subsystem_keys, tables};
use std::fmt::Write;

/// One heading with a table per reserved table, then the host's keys of a subsystem.
pub fn keys_markdown() -> String {
    let mut text = String::new();
    for table in tables() {
        section(&mut text, &heading(&table), table.help, &table.keys);
    }
    let help = "A table with `module` is a subsystem of that name. These keys are the host's; every other key is a \
                parameter of the module (`terraglue modules` lists them).";
    section(&mut text, "[any other name]", help, &subsystem_keys());
    text
}

fn heading(table: &Table) -> String {
    if table.repeated { format!("[[{}]]", table.name) } else { format!("[{}]", table.name) }
}

fn section(text: &mut String, heading: &str, help: &str, keys: &[Key]) {
    // Writing to a string cannot fail.
    let _ =
        write!(text, "\n### `{heading}`\n{help}\n\n| key | takes | default | what |\n|---|---|---|---|\n");
    for key in keys {
        let p = &key.parameter;
        let default = match (&p.default, p.optional) {
            (serde_json::Value::Null, true) => "–".to_owned(),
            (serde_json::Value::Null, false) => "required".to_owned(),
            (value, _) => format!("`{value}`"),
        };
        let only =
            if key.only.is_empty() { String::new() } else { format!(" (kind {})", key.only.join(", ")) };
        let _ = writeln!(text, "| `{}` | {} | {default} | {}{only} |", p.name, key.allowed(), p.help);
    }
    text.push('\n');
}
