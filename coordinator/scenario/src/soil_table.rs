//! The table of soils, `models/soils.csv`, read from its text: named rows, and rows refused with a reason.

/// Columns with numbers, which are also the keys that a scenario can override.
pub const COLUMNS: [&str; 10] = [
    "n",
    "k_c",
    "k_phi",
    "c_pa",
    "phi_rad",
    "K_m",
    "density_kg_m3",
    "elastic_stiffness_pa_m",
    "measured_gravity_m_s2",
    "wall_cohesion_pa",
];

/// Columns that a usable row may leave empty, and a table leave out but the first.
const OPTIONAL: [&str; 4] =
    ["density_kg_m3", "elastic_stiffness_pa_m", "measured_gravity_m_s2", "wall_cohesion_pa"];

/// Errors of a table or a name.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum TableError {
    /// The table itself cannot be read.
    Malformed {
        /// Line of the text, from 1.
        line: usize,
        /// Description of the problem.
        what: String,
    },
    /// No row has this name.
    Unknown {
        /// The name asked for.
        name: String,
        /// All names, in the order of the table.
        known: Vec<String>,
    },
    /// The row exists but cannot be used as it stands.
    Refused {
        /// Name of the row.
        name: String,
        /// Why, and what would help.
        reason: String,
    },
}

impl std::fmt::Display for TableError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Malformed { line, what } => write!(f, "line {line} of the soil table: {what}"),
            Self::Unknown { name, known } => {
                write!(f, "no soil is called `{name}`; known are {}", known.join(", "))
            }
            Self::Refused { name, reason } => write!(f, "soil `{name}` cannot be used: {reason}"),
        }
    }
}

impl std::error::Error for TableError {}

/// One soil.
#[derive(Clone, Debug, PartialEq)]
pub struct SoilRow {
    /// Name.
    pub name: String,
    /// Numbers in the order of [`COLUMNS`]; `None` where the source gives no single number.
    pub values: [Option<f64>; COLUMNS.len()],
    /// Where the numbers come from.
    pub source: String,
    /// Confidence in them; empty where the table gives none.
    pub confidence: String,
    /// Why the row cannot be used as it stands.
    pub refused: Option<String>,
}

impl SoilRow {
    /// Value of a column; `None` where there is none.
    pub fn value(&self, column: &str) -> Option<f64> {
        COLUMNS.iter().position(|c| *c == column).and_then(|k| self.values[k])
    }

    /// The numbers that the row offers as (key, value). Refused while a needed number is missing from the row
    /// that `overridden` does not name.
    ///
    /// # Errors
    /// [`TableError::Refused`]: a needed number is missing.
    pub fn offered(&self, overridden: &[&str]) -> Result<Vec<(&'static str, f64)>, TableError> {
        let lacking =
            |(c, v): (&&str, &Option<f64>)| v.is_none() && !OPTIONAL.contains(c) && !overridden.contains(c);
        if COLUMNS.iter().zip(&self.values).any(lacking) {
            let reason = self.refused.clone().unwrap_or_else(|| "a number is missing".into());
            return Err(TableError::Refused { name: self.name.clone(), reason });
        }
        Ok(COLUMNS.iter().zip(&self.values).filter_map(|(c, v)| v.map(|v| (*c, v))).collect())
    }
}

/// All rows.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct SoilTable {
    /// In the order of the file.
    pub rows: Vec<SoilRow>,
}

impl SoilTable {
    /// Reads comma-separated text with a header line. Cells hold no commas.
    ///
    /// # Errors
    /// [`TableError::Malformed`], with the line: no header, a column that is missing, or a cell that is no number.
    pub fn parse(text: &str) -> Result<Self, TableError> {
        let mut lines = text.lines().enumerate().filter(|(_, l)| !l.trim().is_empty());
        let header: Vec<&str> = match lines.next() {
            Some((_, line)) => line.split(',').map(str::trim).collect(),
            None => return Err(malformed(0, "the table is empty")),
        };
        let columns = Columns::find(&header)?;
        let rows = lines.map(|(k, line)| columns.row(k, line, header.len())).collect::<Result<_, _>>()?;
        Ok(Self { rows })
    }

    /// The row of a name, usable or not.
    ///
    /// # Errors
    /// [`TableError::Unknown`], with the names of all rows.
    pub fn row(&self, name: &str) -> Result<&SoilRow, TableError> {
        self.rows.iter().find(|r| r.name == name).ok_or_else(|| TableError::Unknown {
            name: name.into(),
            known: self.rows.iter().map(|r| r.name.clone()).collect(),
        })
    }
}

fn malformed(line: usize, what: impl Into<String>) -> TableError {
    TableError::Malformed { line: line + 1, what: what.into() }
}

/// Places of the columns in the header.
struct Columns {
    name: usize,
    numbers: [Option<usize>; COLUMNS.len()],
    source: usize,
    /// A table without grades is a table all the same.
    confidence: Option<usize>,
    refused: usize,
}

impl Columns {
    fn find(header: &[&str]) -> Result<Self, TableError> {
        let at = |name: &str| {
            header
                .iter()
                .position(|h| *h == name)
                .ok_or_else(|| malformed(0, format!("column `{name}` is missing")))
        };
        let mut numbers = [None; COLUMNS.len()];
        for (place, name) in numbers.iter_mut().zip(COLUMNS) {
            *place = if OPTIONAL[1..].contains(&name) { at(name).ok() } else { Some(at(name)?) };
        }
        let [name, source, refused] = [at("name")?, at("source")?, at("refused")?];
        let confidence = header.iter().position(|h| *h == "confidence");
        Ok(Self { name, numbers, source, confidence, refused })
    }

    fn row(&self, line: usize, text: &str, width: usize) -> Result<SoilRow, TableError> {
        let cells: Vec<&str> = text.split(',').map(str::trim).collect();
        if cells.len() != width {
            return Err(malformed(line, format!("{} cells instead of {width}", cells.len())));
        }
        let mut values = [None; COLUMNS.len()];
        for ((value, place), column) in values.iter_mut().zip(self.numbers).zip(COLUMNS) {
            let cell = place.map_or("", |place| cells[place]);
            *value = number(cell)
                .map_err(|()| malformed(line, format!("`{cell}` in column `{column}` is not a number")))?;
        }
        let refused = Some(cells[self.refused].to_string()).filter(|r| !r.is_empty());
        let text = |place: usize| cells[place].to_owned();
        let [name, source] = [text(self.name), text(self.source)];
        let confidence = self.confidence.map(text).unwrap_or_default();
        Ok(SoilRow { name, values, source, confidence, refused })
    }
}

fn number(cell: &str) -> Result<Option<f64>, ()> {
    if cell.is_empty() {
        return Ok(None);
    }
    cell.parse().ok().filter(|v: &f64| v.is_finite()).map(Some).ok_or(())
}
