//! `--write-docs`: the tables of `docs/validation.md`, so that documents and measurements cannot part ways.

use super::Figure;
use crate::process::{Outcome, read, root, write};
use crate::schema::between;

/// Replaces the tables of an area.
pub fn write_area(area: &str, figures: &[Figure]) -> Outcome {
    replace("docs/validation.md", area, &table(figures))?;
    // the peers are measured in long runs only
    match super::rigid_body::comparison(figures) {
        Some(text) => replace("docs/rigid-body.md", "peers", &text),
        None => Ok(()),
    }
}

/// Replaces the table called `name` of a page.
fn replace(page: &str, name: &str, table: &str) -> Outcome {
    let path = root().join(page);
    let (begin, end) = (format!("<!-- {name}: begin -->\n"), format!("<!-- {name}: end -->"));
    let text = between(&read(&path)?, (&begin, &end), table);
    let text = text.ok_or_else(|| format!("{} has no table `{name}`", path.display()))?;
    write(&path, &text)
}

fn table(figures: &[Figure]) -> String {
    let row = |f: &Figure| {
        // a bar would end the cell
        let what = f.what.replace('|', "\\|");
        format!("| `{}` | {} | {} | {} | {what} |\n", f.id, f.value_text(), f.limit, f.verdict())
    };
    let head = "| figure | value | limit | verdict | what |\n|---|---|---|---|---|\n";
    std::iter::once(head.to_owned()).chain(figures.iter().map(row)).collect()
}
