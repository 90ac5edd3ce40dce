//! Inputs over time: rows of cells, and numbers by straight lines between them.

use std::io::Read;
use std::path::Path;
use terraglue_fmi::Error;

/// Inputs over time. Cells stay as they are written, because whole numbers of 64 bits do not fit into f64.
#[derive(Clone, Debug, Default)]
pub struct Table {
    /// Names after `time`.
    pub names: Vec<String>,
    /// Rows, ascending in time.
    pub rows: Vec<InputRow>,
    /// The file that it was read from, for errors.
    pub path: String,
}

/// Inputs at a time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct InputRow {
    /// s.
    pub time: f64,
    /// A cell for each name.
    pub cells: Vec<String>,
    /// The same as numbers; NaN where they are none.
    pub numbers: Vec<f64>,
    /// Line in the file.
    pub line: u64,
}

impl Table {
    /// Reads a table from a file: a header that begins with `time`, rows that ascend in time. With `jumps` the last of several rows of one
    /// time counts, as in results with events.
    ///
    /// # Errors
    /// A malformed table, with path and line.
    pub fn read(path: &Path, jumps: bool) -> Result<Self, String> {
        let file = terraglue_subsystem::files::open(path).map_err(|e| e.to_string());
        let table = file.and_then(|file| Self::parse(file, jumps));
        let path = path.display().to_string();
        table.map_err(|e| format!("{path}: {e}")).map(|table| Self { path, ..table })
    }

    /// The same from any text.
    ///
    /// # Errors
    /// A malformed table, with the line.
    pub fn parse(text: impl Read, jumps: bool) -> Result<Self, String> {
        let mut reader = csv::Reader::from_reader(text);
        let header = reader.headers().map_err(|e| e.to_string())?.clone();
        if header.get(0) != Some("time") {
            return Err("the first column is not `time`".into());
        }
        let mut rows: Vec<InputRow> = Vec::new();
        for record in reader.records() {
            let record = record.map_err(|e| unread(&e))?;
            let line = record.position().map_or(0, csv::Position::line);
            let mut cells = record.iter().map(|t| t.trim().to_owned());
            let time = cells.next().and_then(|t| t.parse().ok()).filter(|t: &f64| t.is_finite());
            let time = time.ok_or_else(|| format!("line {line}: the time is no number"))?;
            rows.pop_if(|before| jumps && before.time == time);
            if rows.last().is_some_and(|before| before.time >= time) {
                return Err(format!("line {line}: the time does not grow"));
            }
            let cells: Vec<String> = cells.collect();
            let numbers = cells.iter().map(|t| t.parse().unwrap_or(f64::NAN)).collect();
            rows.push(InputRow { time, cells, numbers, line });
        }
        let names = header.iter().skip(1).map(str::to_owned).collect();
        Ok(Self { names, rows, path: String::new() })
    }

    /// The last row at or before t, or the first of all, and the row after it.
    fn around(&self, t: f64) -> Option<(&InputRow, Option<&InputRow>)> {
        let next = self.rows.partition_point(|r| r.time <= t);
        match next.checked_sub(1) {
            Some(k) => Some((&self.rows[k], self.rows.get(next))),
            None => self.rows.first().map(|row| (row, None)),
        }
    }

    /// A number at t by straight lines between the rows; the first and last row hold beyond.
    pub(super) fn number(&self, t: f64, column: usize) -> f64 {
        match self.around(t) {
            Some((a, Some(b))) => {
                let s = (t - a.time) / (b.time - a.time);
                a.numbers[column] + s * (b.numbers[column] - a.numbers[column])
            }
            Some((row, None)) => row.numbers[column],
            None => 0.0,
        }
    }

    /// Elements at t: one of its own column, or all of a variable; NaN where the cells beside t have no such numbers.
    pub(super) fn write(&self, t: f64, column: usize, element: Option<usize>, out: &mut [f64]) {
        match element {
            Some(k) => out[k] = self.number(t, column),
            None if out.len() == 1 => out[0] = self.number(t, column),
            None => match self.numbers(t, column, out.len()) {
                Some(all) => out.copy_from_slice(&all),
                None => out.fill(f64::NAN),
            },
        }
    }

    /// Slope from t to `end`, s, in units per s: that of the straight line where no row lies between, else the mean one.
    pub(super) fn slope(&self, t: f64, end: f64, column: usize) -> f64 {
        match self.around(t) {
            // without what rounding leaves of the difference of near values
            Some((a, Some(b))) if a.time <= t && b.time >= end => {
                (b.numbers[column] - a.numbers[column]) / (b.time - a.time)
            }
            _ => (self.number(end, column) - self.number(t, column)) / (end - t),
        }
    }

    /// Numbers of an array at t, written with spaces between them; nothing where a cell has not so many.
    fn numbers(&self, t: f64, column: usize, count: usize) -> Option<Vec<f64>> {
        let read = |row: &InputRow| {
            let words = row.cells[column].split_whitespace();
            let all: Option<Vec<f64>> =
                words.map(|w| w.parse().ok().filter(|x: &f64| x.is_finite())).collect();
            all.filter(|x| x.len() == count)
        };
        let Some((a, b)) = self.around(t) else { return Some(vec![0.0; count]) };
        let (first, Some(b)) = (read(a)?, b) else { return read(a) };
        let s = (t - a.time) / (b.time - a.time);
        Some(first.iter().zip(read(b)?).map(|(x, y)| x + s * (y - x)).collect())
    }

    /// The error of a column without a number beside t, s.
    pub(super) fn none(&self, column: usize, t: f64) -> Error {
        let name = &self.names[column];
        let beside = self.around(t).into_iter().flat_map(|(row, next)| std::iter::once(row).chain(next));
        let mut wrong = beside.filter(|row| !row.numbers[column].is_finite());
        Error::WrongInput(match wrong.next() {
            Some(row) => format!(
                "{}, line {}: `{name}` = `{}` is no number, and the FMU needs one at t = {t} s",
                self.path, row.line, row.cells[column]
            ),
            None => format!("`{name}`: the input is no number beside t = {t} s"),
        })
    }

    /// The cell that holds at t.
    pub(super) fn cell(&self, t: f64, column: usize) -> &str {
        self.around(t).map_or("0", |(row, _)| &row.cells[column])
    }
}

/// A record that cannot be read; names of elements of arrays hold a comma.
fn unread(error: &csv::Error) -> String {
    match error.kind() {
        csv::ErrorKind::UnequalLengths { .. } => {
            format!("{error}; a name with a comma stands in quotes: time,\"u[1,2]\"")
        }
        _ => error.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(rows: &[(f64, &str)]) -> Table {
        let row = |(time, cell): &(f64, &str)| InputRow {
            time: *time,
            cells: vec![(*cell).to_owned()],
            numbers: vec![cell.parse().unwrap_or(f64::NAN)],
            line: 0,
        };
        Table { names: vec!["u".into()], rows: rows.iter().map(row).collect(), path: String::new() }
    }

    #[test]
    fn a_slope_is_that_of_the_line_and_over_a_bend_the_mean_one() {
        let bent = table(&[(0.0, "1"), (1.0, "3"), (2.0, "0")]);
        assert_eq!(bent.slope(0.25, 0.75, 0), 2.0);
        assert_eq!(bent.slope(0.0, 1.0, 0), 2.0);
        assert_eq!(bent.slope(1.0, 2.0, 0), -3.0);
        // from 2 by 1 to 3, then by -1.5 to 1.5
        assert_eq!(bent.slope(0.5, 1.5, 0), -0.5);
        // before the first and behind the last row nothing changes
        assert_eq!((bent.slope(-2.0, -1.0, 0), bent.slope(2.0, 3.0, 0)), (0.0, 0.0));
        assert_eq!((bent.slope(-1.0, 0.5, 0), bent.slope(1.5, 3.5, 0)), (1.0 / 1.5, -0.75));
        assert!(table(&[(0.0, "1"), (1.0, "x")]).slope(0.0, 0.5, 0).is_nan());
        assert_eq!(table(&[(0.0, "1")]).slope(0.0, 0.5, 0), 0.0);
    }

    #[test]
    fn elements_are_written_whole_or_one_by_one() {
        let whole = table(&[(0.0, "1 2"), (1.0, "3 6")]);
        let mut out = [0.0; 2];
        whole.write(0.5, 0, None, &mut out);
        assert_eq!(out, [2.0, 4.0]);
        table(&[(0.0, "1"), (1.0, "3")]).write(0.25, 0, Some(1), &mut out);
        assert_eq!(out, [2.0, 1.5]);
        let mut three = [0.0; 3];
        whole.write(0.5, 0, None, &mut three);
        assert!(three.iter().all(|x| x.is_nan()));
    }
}
