//! Files of `docs/` that are made from the table of scenario keys.

use terraglue::scenario::{docs, schema};
use xtask_start::process::{Outcome, between, read, root, write};

/// Begin and end of the generated part of `docs/scenario.md`.
const MARKS: (&str, &str) = ("<!-- keys: begin -->\n", "<!-- keys: end -->");

/// Paths and texts of the generated files.
fn generated() -> Outcome<Vec<(std::path::PathBuf, String)>> {
    let page = root().join("docs/scenario.md");
    let text = between(&read(&page)?, MARKS, &docs::keys_markdown())
        .ok_or_else(|| format!("{} lacks the marks {MARKS:?}", page.display()))?;
    Ok(vec![(root().join("docs/scenario.schema.json"), schema::text()), (page, text)])
}

/// Writes or checks the generated files.
pub fn write_files(check: bool) -> Outcome {
    for (path, text) in generated()? {
        let current = std::fs::read_to_string(&path).unwrap_or_default();
        match (check, current == text) {
            (_, true) => {}
            (true, false) => {
                return Err(format!("{} is out of date: run `cargo xtask schema`", path.display()));
            }
            (false, false) => {
                write(&path, &text)?;
                println!("wrote {}", path.display());
            }
        }
    }
    Ok(())
}
