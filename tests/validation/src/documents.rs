//! Pages that are made of measured figures: the full table of a run, and the comparison with peers in `docs/rigid-body.md`.

use super::Figure;
use crate::process::{Outcome, between, read, root, target, write};

/// Writes the full table of a run to `target/validation.md`, a section for each area that was measured.
pub fn write_table(areas: &[(&str, Vec<Figure>)]) -> Outcome {
    let sections: String = areas.iter().map(|(area, figures)| section(area, figures)).collect();
    write(&target().join("validation.md"), &format!("# Measured figures\n{sections}"))
}

/// Writes the comparison with peers; they are measured in long runs only.
pub fn write_peers(figures: &[Figure]) -> Outcome {
    super::rigid_body::comparison(figures)
        .map_or(Ok(()), |text| replace("docs/rigid-body.md", &[("peers", text)]))
}

/// Replaces the named blocks of a page.
pub fn replace(page: &str, blocks: &[(&str, String)]) -> Outcome {
    let path = root().join(page);
    let text = replaced(read(&path)?, blocks).map_err(|name| format!("{page} has no block `{name}`"))?;
    write(&path, &text)
}

/// A text with new blocks; an error is the name of one that is not there.
pub fn replaced(mut text: String, blocks: &[(&str, String)]) -> Outcome<String> {
    for (name, block) in blocks {
        let marks = (format!("<!-- {name}: begin -->\n"), format!("<!-- {name}: end -->"));
        text = between(&text, (&marks.0, &marks.1), block).ok_or_else(|| (*name).to_owned())?;
    }
    Ok(text)
}

/// A cell of a table; a bar would end it.
pub fn cell(text: &str) -> String {
    text.replace('|', "\\|")
}

fn section(area: &str, figures: &[Figure]) -> String {
    let row = |f: &Figure| {
        format!("| `{}` | {} | {} | {} | {} |\n", f.id, f.value_text(), f.limit, f.verdict(), cell(&f.what))
    };
    let head = format!("\n## {area}\n| figure | value | limit | verdict | what |\n|---|---|---|---|---|\n");
    std::iter::once(head).chain(figures.iter().map(row)).collect()
}

#[cfg(test)]
mod tests {
    use super::super::Limit;
    use super::*;

    #[test]
    fn a_bar_in_a_text_does_not_end_its_cell() {
        let text = section("walk", &[Figure::new("walk.a", 2.0, Limit::AtMost(3.0), "largest |x|")]);
        assert!(text.ends_with("| `walk.a` | 2 | <= 3 | pass | largest \\|x\\| |\n"), "{text}");
    }

    #[test]
    fn a_page_without_a_block_is_refused_by_its_name() {
        let text = "<!-- a: begin -->\nold\n<!-- a: end -->".to_owned();
        let new = replaced(text.clone(), &[("a", "new\n".to_owned())]);
        assert_eq!(new.as_deref(), Ok("<!-- a: begin -->\nnew\n<!-- a: end -->"));
        assert_eq!(replaced(text, &[("b", String::new())]), Err("b".to_owned()));
    }
}
