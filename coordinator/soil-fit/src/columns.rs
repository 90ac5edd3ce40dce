//! Measurements as comma-separated text; the name of a column contains the unit.

use std::io::ErrorKind;
use std::path::Path;
use terraglue_scenario::InputError;

/// A file that gives no text.
pub fn unreadable(path: &Path, error: &std::io::Error) -> Box<InputError> {
    let help = (error.kind() == ErrorKind::InvalidData).then(|| HEADED.to_owned());
    InputError::plain(format!("cannot read {}: {error}", path.display()), help)
}

/// How numbers are written.
const NUMBERS: &str = "a comma ends a cell: write numbers with a point, as 1.5 or 2e5";

const HEADED: &str =
    "measurements are text with commas between the cells and the names of the columns in the first line";

/// Description of a problem, and the way out.
pub type Wrong = (String, Option<String>);

/// Name of a column and how many SI units its unit has.
pub type Names = &'static [(&'static str, f64)];

/// Columns of sinkages.
pub const SINKAGE: Names = &[("sinkage_m", 1.0), ("sinkage_cm", 1e-2), ("sinkage_mm", 1e-3)];

/// A table of cells.
pub struct Columns<'a> {
    /// Names of the columns.
    pub header: Vec<&'a str>,
    /// Number of the line and cells of every row.
    pub rows: Vec<(usize, Vec<&'a str>)>,
}

impl<'a> Columns<'a> {
    /// Reads text; empty lines and those that begin with # are left out.
    pub fn parse(text: &'a str) -> Result<Self, Wrong> {
        // what spreadsheets write before UTF-8
        let text = text.trim_start_matches('\u{feff}');
        let mut lines = text.lines().enumerate().filter(|(_, l)| !l.trim().is_empty() && !l.starts_with('#'));
        let cells = |line: &'a str| line.split(',').map(str::trim).collect::<Vec<_>>();
        let header = match lines.next() {
            Some((_, line)) => cells(line),
            None => return Err(("the file is empty".into(), Some(HEADED.into()))),
        };
        let row = |(k, line): (usize, &'a str)| {
            let cells = cells(line);
            let message = || format!("line {}: {} cells instead of {}", k + 1, cells.len(), header.len());
            match cells.len() == header.len() {
                true => Ok((k + 1, cells)),
                false => Err((message(), Some(NUMBERS.into()))),
            }
        };
        let rows = lines.map(row).collect::<Result<_, _>>()?;
        Ok(Self { header, rows })
    }

    /// Place of the column that has one of the names, and its factor.
    pub fn find(&self, names: Names) -> Result<(usize, f64), Wrong> {
        self.seek(names).ok_or_else(|| {
            let known: Vec<&str> = names.iter().map(|n| n.0).collect();
            let message = format!("no column is called {}", known.join(" or "));
            let columns = format!("the columns are {}", self.header.join(", "));
            let other = [(';', "semicolons"), ('\t', "tabulators")]
                .into_iter()
                .find(|(c, _)| self.header.len() == 1 && self.header[0].contains(*c));
            let help = other.map(|(_, what)| {
                format!("there are {what} between the cells: write commas, and points in numbers")
            });
            (message, Some(help.unwrap_or(columns)))
        })
    }

    /// The same where it may be missing.
    pub fn seek(&self, names: Names) -> Option<(usize, f64)> {
        names.iter().find_map(|(name, scale)| Some((self.header.iter().position(|h| h == name)?, *scale)))
    }

    /// The number in a row, SI.
    pub fn number(&self, row: &(usize, Vec<&str>), (place, scale): (usize, f64)) -> Result<f64, Wrong> {
        let (line, cells) = row;
        let value = cells[place].parse::<f64>().ok().filter(|v| v.is_finite());
        let message =
            || format!("line {line}: `{}` in `{}` is not a number", cells[place], self.header[place]);
        value.map(|v| v * scale).ok_or_else(|| (message(), Some(NUMBERS.into())))
    }
}
