//! `--write-docs`: the tables of `docs/validation.md`, so that documents and measurements cannot part ways.

use super::Figure;
use crate::process::{Outcome, read, root, write};
use crate::schema::between;

/// Replaces the table of an area.
pub fn write_area(area: &str, figures: &[Figure]) -> Outcome {
    let path = root().join("docs/validation.md");
    let (begin, end) = (format!("<!-- {area}: begin -->\n"), format!("<!-- {area}: end -->"));
    let text = between(&read(&path)?, (&begin, &end), &table(figures));
    let text = text.ok_or_else(|| format!("{} has no table of the area `{area}`", path.display()))?;
    write(&path, &text)
}

fn table(figures: &[Figure]) -> String {
    let row = |f: &Figure| {
        format!("| `{}` | {} | {} | {} | {} |\n", f.id, f.value_text(), f.limit, f.verdict(), f.what)
    };
    let head = "| figure | value | limit | verdict | what |\n|---|---|---|---|---|\n";
    std::iter::once(head.to_owned()).chain(figures.iter().map(row)).collect()
}
