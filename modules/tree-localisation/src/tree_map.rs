//! The global map: the places of all surveyed trees, read from a table, with an index that finds those around a place.

use std::fmt;

/// A tree of the map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapTree {
    /// Place, m.
    pub place: [f64; 2],
    /// Diameter at breast height, m, where it was measured.
    pub diameter: Option<f64>,
}

/// Why a map cannot be used.
#[derive(Clone, Debug, PartialEq)]
pub enum MapError {
    /// A line of the table contains something other than numbers: its number, the column, the text.
    Text {
        /// Line, from 1.
        line: usize,
        /// Column.
        column: String,
        /// Text found there.
        text: String,
    },
    /// The head of the table names no such column.
    Column {
        /// Names that would do.
        wanted: &'static str,
        /// Names that are there.
        found: String,
    },
    /// Fewer trees than can identify a place.
    TooFew {
        /// Trees.
        trees: usize,
    },
    /// More trees, or a wider map, than fit.
    TooLarge {
        /// Trees.
        trees: usize,
        /// Edge, m.
        extent: f64,
    },
}

impl fmt::Display for MapError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Text { line, column, text } => {
                write!(f, "line {line}: column `{column}` = \"{text}\" is no finite number")
            }
            Self::Column { wanted, found } => {
                write!(f, "the first line names no column {wanted}; it says {found}")
            }
            Self::TooFew { trees } => {
                write!(f, "{trees} trees are no map: at least 3 in different places are needed")
            }
            Self::TooLarge { trees, extent } => {
                write!(
                    f,
                    "{trees} trees over {extent:.0} m are more than a map holds (1,000,000 trees, 100 km)"
                )
            }
        }
    }
}

impl std::error::Error for MapError {}

/// Trees of a map, sorted into cells.
#[derive(Clone, Debug)]
pub struct TreeMap {
    trees: Vec<MapTree>,
    duplicates: usize,
    low: [f64; 2],
    high: [f64; 2],
    cell: f64,
    size: [i64; 2],
    /// First entry of each cell in `order`.
    starts: Vec<u32>,
    order: Vec<u32>,
}

/// Trees nearer to each other than this are one that was surveyed twice, m.
const DUPLICATE: f64 = 0.02;
const MOST_TREES: usize = 1_000_000;
const MOST_EXTENT: f64 = 1e5;
/// Trees that a cell holds in the mean.
const PER_CELL: f64 = 0.7;

impl TreeMap {
    /// A map of trees; those that stand at the same place count once.
    ///
    /// # Errors
    /// [`MapError::TooFew`], [`MapError::TooLarge`], [`MapError::Text`]: a place that is not finite.
    pub fn new(mut trees: Vec<MapTree>) -> Result<Self, MapError> {
        let wrong = |t: &MapTree| t.place.iter().any(|x| !x.is_finite());
        if let Some(line) = trees.iter().position(wrong) {
            let text = format!("{:?}", trees[line].place);
            return Err(MapError::Text { line: line + 1, column: "x, y".into(), text });
        }
        let all = trees.len();
        trees.sort_by(|a, b| a.place[0].total_cmp(&b.place[0]).then(a.place[1].total_cmp(&b.place[1])));
        let near = |a: &MapTree, b: &MapTree| (0..2).all(|k| (a.place[k] - b.place[k]).abs() < DUPLICATE);
        trees.dedup_by(|a, b| near(a, b));
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for t in &trees {
            low = [0, 1].map(|k| low[k].min(t.place[k]));
            high = [0, 1].map(|k| high[k].max(t.place[k]));
        }
        let extent = (high[0] - low[0]).max(high[1] - low[1]);
        if trees.len() < 3 {
            return Err(MapError::TooFew { trees: trees.len() });
        }
        if trees.len() > MOST_TREES || extent > MOST_EXTENT {
            return Err(MapError::TooLarge { trees: trees.len(), extent });
        }
        Ok(Self::sorted(trees, all, low, high))
    }

    fn sorted(trees: Vec<MapTree>, all: usize, low: [f64; 2], high: [f64; 2]) -> Self {
        let area = (high[0] - low[0]).max(1.0) * (high[1] - low[1]).max(1.0);
        // no more than four cells for each tree, however they stand
        let cell = (PER_CELL * area / trees.len() as f64).sqrt().max(0.5);
        let size = [0, 1].map(|k| ((high[k] - low[k]) / cell) as i64 + 1);
        let of = |p: [f64; 2]| {
            let [i, j] = [0, 1].map(|k| ((p[k] - low[k]) / cell) as i64);
            (j * size[0] + i) as usize
        };
        let mut starts = vec![0_u32; (size[0] * size[1]) as usize + 1];
        trees.iter().for_each(|t| starts[of(t.place) + 1] += 1);
        (1..starts.len()).for_each(|k| starts[k] += starts[k - 1]);
        let (mut next, mut order) = (starts.clone(), vec![0; trees.len()]);
        for (number, t) in (0..).zip(&trees) {
            let place = &mut next[of(t.place)];
            order[*place as usize] = number;
            *place += 1;
        }
        let duplicates = all - trees.len();
        Self { trees, duplicates, low, high, cell, size, starts, order }
    }

    /// Reads a table with a head: `x`, `y` (or `east`, `north`), and the diameter as `dbh_m`, `diameter_m` or `dbh_cm`, separated by
    /// commas, semicolons, tabs or spaces. Other columns do not matter; lines that begin with `#` are remarks.
    ///
    /// # Errors
    /// [`MapError`] with the line and the column.
    pub fn from_table(text: &str) -> Result<Self, MapError> {
        let mut lines = text.lines().zip(1..).filter(|(l, _)| !l.trim().is_empty() && !l.starts_with('#'));
        let head = lines.next().map_or("", |(l, _)| l);
        let names: Vec<String> = fields(head).iter().map(|n| n.trim_matches('"').to_lowercase()).collect();
        let column = |all: &[&str]| names.iter().position(|n| all.contains(&n.as_str()));
        let found = || names.join(", ");
        let need =
            |all: &[&str], wanted| column(all).ok_or_else(|| MapError::Column { wanted, found: found() });
        let x = need(&["x", "x_m", "east", "east_m", "easting"], "`x` (or `east`)")?;
        let y = need(&["y", "y_m", "north", "north_m", "northing"], "`y` (or `north`)")?;
        let metres = column(&["dbh_m", "diameter_m", "diameter", "d_m"]);
        let centimetres = column(&["dbh_cm", "stemdiam", "diameter_cm"]);
        let mut trees = Vec::new();
        for (text, line) in lines {
            let values = fields(text);
            let number = |k: usize| -> Result<f64, MapError> {
                let text = values.get(k).copied().unwrap_or_default();
                let value = text.trim_matches('"').parse().ok().filter(|v: &f64| v.is_finite());
                value.ok_or_else(|| MapError::Text { line, column: names[k].clone(), text: text.into() })
            };
            let measured = |k: Option<usize>| k.and_then(|k| number(k).ok()).filter(|d| *d > 0.0);
            let diameter = measured(metres).or_else(|| Some(0.01 * measured(centimetres)?));
            trees.push(MapTree { place: [number(x)?, number(y)?], diameter });
        }
        Self::new(trees)
    }

    /// All trees, from west to east.
    pub fn trees(&self) -> &[MapTree] {
        &self.trees
    }

    /// Trees of the table that stand where another one does.
    pub fn duplicates(&self) -> usize {
        self.duplicates
    }

    /// Lowest and highest coordinates, m.
    pub fn bounds(&self) -> [[f64; 2]; 2] {
        [self.low, self.high]
    }

    /// Trees for each square metre within the bounds.
    pub fn density(&self) -> f64 {
        let area = (self.high[0] - self.low[0]).max(1.0) * (self.high[1] - self.low[1]).max(1.0);
        self.trees.len() as f64 / area
    }

    /// Numbers of the trees in the cells that a circle meets.
    pub fn around(&self, at: [f64; 2], radius: f64) -> impl Iterator<Item = u32> + '_ {
        let cell = |k: usize, x: f64| (((x - self.low[k]) / self.cell).floor().clamp(-1e9, 1e9)) as i64;
        let range = |k: usize| cell(k, at[k] - radius).max(0)..=cell(k, at[k] + radius).min(self.size[k] - 1);
        let columns = range(0);
        range(1).flat_map(move |j| {
            let (first, last) = (*columns.start(), *columns.end());
            let (from, to) = if first > last {
                (0, 0)
            } else {
                let row = j * self.size[0];
                (self.starts[(row + first) as usize], self.starts[(row + last) as usize + 1])
            };
            self.order[from as usize..to as usize].iter().copied()
        })
    }
}

fn fields(line: &str) -> Vec<&str> {
    let by = [',', ';', '\t'].into_iter().find(|c| line.contains(*c));
    match by {
        Some(by) => line.split(by).map(str::trim).collect(),
        None => line.split_whitespace().collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_with_text_are_refused_with_line_and_column() {
        let map = TreeMap::from_table("x,y,dbh_m\n1,2,0.3\n3,4,\n5,6,0.2\n1,2,0.3\n").expect("a map");
        assert_eq!((map.trees().len(), map.duplicates(), map.trees()[1].diameter), (3, 1, None));
        let error = TreeMap::from_table("x,y\n1,2\nthree,4\n").expect_err("text");
        assert_eq!(error, MapError::Text { line: 3, column: "x".into(), text: "three".into() });
        assert!(matches!(TreeMap::from_table("x,y\n1,nan\n"), Err(MapError::Text { line: 2, .. })));
        assert!(matches!(TreeMap::from_table("a,b\n1,2\n"), Err(MapError::Column { .. })));
        assert!(matches!(TreeMap::from_table(""), Err(MapError::Column { .. })));
        assert!(matches!(TreeMap::from_table("x y\n1 1\n1 1\n1 1\n"), Err(MapError::TooFew { trees: 1 })));
        assert!(matches!(TreeMap::from_table("x y\n1 1\n2 2\n1e9 1\n"), Err(MapError::TooLarge { .. })));
    }

    #[test]
    fn around_finds_all_trees_of_a_circle() {
        let trees =
            (0..400).map(|k| MapTree { place: [f64::from(k % 20), f64::from(k / 20)], diameter: None });
        let map = TreeMap::new(trees.collect()).expect("a map");
        let near = |at: [f64; 2], r: f64| {
            let d = |t: u32| {
                let p = map.trees()[t as usize].place;
                (p[0] - at[0]).hypot(p[1] - at[1])
            };
            map.around(at, r).filter(|t| d(*t) <= r).count()
        };
        assert_eq!(near([5.0, 5.0], 1.0), 5);
        assert_eq!(near([-3.0, -3.0], 1.0), 0);
        assert_eq!(near([100.0, 5.0], 200.0), 400);
    }
}
