//! A stand of trees that were surveyed, from a table with a line for each.

use crate::stand::Stand;
use crate::tree::{Species, Tree};
use terraglue_numerics::random::Random;

/// Columns that a table may have, m; all but the first two may be missing, or empty in a line.
pub const COLUMNS: [&str; 7] = ["x", "y", "dbh_m", "height_m", "species", "lean_x", "lean_y"];

/// Bounds of the numbers of [`COLUMNS`].
const BOUNDS: [[f64; 2]; 7] =
    [[-1e7, 1e7], [-1e7, 1e7], [0.01, 10.0], [1.5, 120.0], [0.0, 0.0], [-1.0, 1.0], [-1.0, 1.0]];

/// Place of the column `species`.
const SPECIES: usize = 4;

/// Trees nearer to each other than this are one that stands in two lines, m.
const DUPLICATE: f64 = 0.02;

/// A stand, and the columns of its table that mean nothing here.
#[derive(Debug)]
pub struct Listed {
    /// Trees on the level z = 0, without bushes.
    pub stand: Stand,
    /// Names of columns that are not in [`COLUMNS`].
    pub unread: Vec<String>,
}

/// The trees of a table, with `origin` in the middle; `draw` gives diameter and species where the table has none.
///
/// # Errors
/// In words, with line, column and value: a table without x and y, a value that is no number or out of its bounds, two trees at one place.
pub fn listed(
    text: &str,
    origin: [f64; 2],
    draw: impl Fn(&mut Random) -> (f64, Species),
    random: &mut Random,
) -> Result<Listed, String> {
    let mut reader =
        csv::ReaderBuilder::new().trim(csv::Trim::All).comment(Some(b'#')).from_reader(text.as_bytes());
    let head = reader.headers().map_err(|e| e.to_string())?.clone();
    let place = COLUMNS.map(|name| head.iter().position(|h| h.eq_ignore_ascii_case(name)));
    if let Some(k) = (0..2).find(|k| place[*k].is_none()) {
        let found: Vec<&str> = head.iter().collect();
        return Err(format!("the first line names no column `{}`; it says {}", COLUMNS[k], found.join(", ")));
    }
    let known = |h: &&str| COLUMNS.iter().any(|name| h.eq_ignore_ascii_case(name));
    let unread = head.iter().filter(|h| !known(h)).map(str::to_owned).collect();
    let (mut trees, mut lines): (Vec<Tree>, Vec<u64>) = (Vec::new(), Vec::new());
    for row in reader.records() {
        let row = row.map_err(|e| e.to_string())?;
        let line = row.position().map_or(0, csv::Position::line);
        let tree = tree(
            |k| place[k].and_then(|at| row.get(at)).filter(|text| !text.is_empty()),
            origin,
            &draw,
            random,
        )
        .map_err(|why| format!("line {line}: {why}"))?;
        trees.push(tree);
        lines.push(line);
    }
    if let Some([a, b]) = twice(&trees) {
        return Err(format!("lines {} and {}: two trees at the same place", lines[a], lines[b]));
    }
    Ok(Listed { stand: Stand { trees, bushes: Vec::new() }, unread })
}

/// The tree of a line; `cell` gives the text of a column.
fn tree<'a>(
    cell: impl Fn(usize) -> Option<&'a str>,
    origin: [f64; 2],
    draw: &impl Fn(&mut Random) -> (f64, Species),
    random: &mut Random,
) -> Result<Tree, String> {
    let number = |k: usize| -> Result<Option<f64>, String> {
        let Some(text) = cell(k) else { return Ok(None) };
        let [low, high] = BOUNDS[k];
        match text.parse::<f64>() {
            Ok(x) if (low..=high).contains(&x) => Ok(Some(x)),
            Ok(_) => Err(format!("`{}` = {text} is not from {low} to {high}", COLUMNS[k])),
            Err(_) => Err(format!("`{}` = \"{text}\" is no number", COLUMNS[k])),
        }
    };
    let needed = |k: usize| number(k)?.ok_or_else(|| format!("`{}` is empty", COLUMNS[k]));
    // drawn in any case, so that a value that is filled in changes no other tree
    let drawn = draw(random);
    let species = match cell(SPECIES).map(str::to_lowercase).as_deref() {
        None => drawn.1,
        Some("pine") => Species::Pine,
        Some("spruce") => Species::Spruce,
        Some(other) => return Err(format!("`species` = \"{other}\" is neither pine nor spruce")),
    };
    let diameter = number(2)?.unwrap_or(drawn.0);
    let foot = [needed(0)? - origin[0], needed(1)? - origin[1], 0.0];
    let height = number(3)?.unwrap_or_else(|| Tree::usual_height(diameter));
    let lean = [number(5)?.unwrap_or(0.0), number(6)?.unwrap_or(0.0)];
    Ok(Tree { foot, diameter, height, lean, species })
}

/// Two trees at the same place.
fn twice(trees: &[Tree]) -> Option<[usize; 2]> {
    let mut order: Vec<usize> = (0..trees.len()).collect();
    order.sort_by(|a, b| trees[*a].foot[0].total_cmp(&trees[*b].foot[0]));
    let near = |a: usize, b: usize, k: usize| (trees[a].foot[k] - trees[b].foot[k]).abs() < DUPLICATE;
    order.iter().enumerate().find_map(|(place, a)| {
        let along = order[place + 1..].iter().take_while(|b| near(*a, **b, 0));
        along.into_iter().find(|b| near(*a, **b, 1)).map(|b| [*a.min(b), *a.max(b)])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Listed, String> {
        listed(text, [100.0, 200.0], |random| (random.between(0.2, 0.4), Species::Pine), &mut Random::new(1))
    }

    #[test]
    fn what_a_table_says_stands_and_the_rest_is_usual() {
        let text = "id,X,y,dbh_m,species,height_m,lean_x\n# a survey\n7,101, 202.5,0.25,Spruce,18,0.01\n8,103,199,,,,\n";
        let Listed { stand, unread } = read(text).expect("a stand");
        assert_eq!(unread, ["id"]);
        let [a, b] = stand.trees[..] else { panic!("two trees") };
        assert_eq!((a.foot, a.diameter, a.height), ([1.0, 2.5, 0.0], 0.25, 18.0));
        assert_eq!((a.species, a.lean), (Species::Spruce, [0.01, 0.0]));
        assert!((0.2..0.4).contains(&b.diameter) && b.height == Tree::usual_height(b.diameter));
        assert_eq!((b.species, b.foot), (Species::Pine, [3.0, -1.0, 0.0]));
        // a value that is filled in changes no other tree
        let filled = read("x,y,dbh_m\n101,202.5,0.3\n103,199,\n").expect("a stand");
        assert_eq!(filled.stand.trees[1].diameter, b.diameter);
    }

    #[test]
    fn a_wrong_table_is_refused_with_line_and_column() {
        for (text, wanted) in [
            ("a,y\n1,2\n", "the first line names no column `x`; it says a, y"),
            ("x,y\n1,2\n1,many\n", "line 3: `y` = \"many\" is no number"),
            ("x,y\n1,\n", "line 2: `y` is empty"),
            ("x,y,dbh_m\n1,2,NaN\n", "line 2: `dbh_m` = NaN is not from 0.01 to 10"),
            ("x,y,dbh_m\n1,2,35\n", "line 2: `dbh_m` = 35 is not from 0.01 to 10"),
            ("x,y,species\n1,2,oak\n", "line 2: `species` = \"oak\" is neither pine nor spruce"),
            ("x,y\n1,2\n5,6\n1.01,2\n", "lines 2 and 4: two trees at the same place"),
        ] {
            assert_eq!(read(text).map(|l| l.stand).expect_err(wanted), wanted);
        }
        assert!(read("x,y\n1,2,3\n").is_err());
    }
}
