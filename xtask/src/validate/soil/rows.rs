//! The soils of the figures: rows of `models/soils.csv`, as a module's configuration and as numbers.

use crate::process::{Outcome, read, root};
use terraglue_soil_law::{COLUMNS, SoilTable};

/// Stiffness of unloading of the protocols, Pa/m.
pub const DEFAULT_ELASTIC_STIFFNESS: f64 = 4e8;

/// Row of the table, and the short name under which the reference data know the soil.
pub const EIGHT: [(&str, &str); 8] = [
    ("dry_sand_LLL_K010", "dry_sand_LLL"),
    ("LETE_sand", "LETE_sand"),
    ("lunar_nominal_Apollo", "lunar_nominal"),
    ("FJS1_beta0", "FJS1_Ishigami"),
    ("sandy_loam_LLL_15pct", "sandy_loam_LLL15"),
    ("clayey_Thai38_K010", "clayey_Thai38"),
    ("snow_US_Harrison", "snow_US_Harrison"),
    ("CMU_Direct90_s0", "CMU_Direct90"),
];

/// The numbers of a row.
#[derive(Clone, Debug)]
pub struct Row {
    /// Short name.
    pub name: &'static str,
    /// As a module's parameters, JSON.
    pub config: String,
    values: [f64; COLUMNS.len()],
}

impl Row {
    /// A number by the name of its column.
    pub fn value(&self, column: &str) -> f64 {
        COLUMNS.iter().position(|c| *c == column).map_or(f64::NAN, |k| self.values[k])
    }

    /// The configuration with more keys, written as JSON.
    pub fn with(&self, keys: &str) -> String {
        self.config.replacen('{', &format!("{{{keys},"), 1)
    }

    /// k_c/b + k_φ of Bekker's law, Pa/mⁿ.
    pub fn modulus(&self, b: f64) -> f64 {
        self.value("k_c") / b + self.value("k_phi")
    }

    /// Bekker's pressure at the depth z under a contact of size b, Pa.
    pub fn pressure(&self, z: f64, b: f64) -> f64 {
        self.modulus(b) * z.powf(self.value("n"))
    }

    /// Depth at which soil pressed for the first time gives the pressure p, m: Bekker's law, or the elastic line where the
    /// law would be stiffer than it (n < 1 near the surface). There the line is the deeper of both.
    pub fn depth(&self, p: f64, b: f64) -> f64 {
        let n = self.value("n");
        let law = (p / self.modulus(b)).powf(1.0 / n);
        if n < 1.0 { law.max(p / DEFAULT_ELASTIC_STIFFNESS) } else { law }
    }
}

/// The eight soils.
pub fn eight() -> Outcome<Vec<Row>> {
    let table = SoilTable::parse(&read(&root().join("models/soils.csv"))?).map_err(|e| e.to_string())?;
    EIGHT.iter().map(|(row, name)| of(&table, row, name)).collect()
}

fn of(table: &SoilTable, row: &str, name: &'static str) -> Outcome<Row> {
    let offered = table.row(row).and_then(|r| r.offered(&[])).map_err(|e| e.to_string())?;
    let values = COLUMNS.map(|c| offered.iter().find(|(k, _)| *k == c).map_or(f64::NAN, |(_, v)| *v));
    let config: serde_json::Map<_, _> = offered.into_iter().map(|(k, v)| (k.to_owned(), v.into())).collect();
    Ok(Row { name, config: serde_json::Value::Object(config).to_string(), values })
}
