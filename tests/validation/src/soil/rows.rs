//! The soils of the figures: rows of `models/soils.csv`, as a module's configuration and as numbers.

use crate::process::{Outcome, read, root};
use terraglue::scenario::{COLUMNS, SoilTable};

/// Stiffness of unloading of closed forms and integrals, Pa/m.
pub const STIFF: f64 = 4e8;

/// Keys of a soil whose pressure follows the depth alone, whatever the slope, the shear and the way of the body.
const BY_DEPTH: &str =
    r#""slope_factor":false,"load_inclination":false,"passive_pressure":false,"elastic_stiffness_pa_m":4e8"#;

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
pub struct SoilRow {
    /// Short name.
    pub name: &'static str,
    /// As a module's parameters, JSON: pressure by the depth alone, as closed forms and integrals have it.
    pub config: String,
    /// As a module's parameters with all defaults, JSON.
    pub own: String,
    values: [f64; COLUMNS.len()],
}

impl SoilRow {
    /// A number by the name of its column.
    pub fn value(&self, column: &str) -> f64 {
        COLUMNS.iter().position(|c| *c == column).map_or(f64::NAN, |k| self.values[k])
    }

    /// The configuration with more keys, written as JSON.
    pub fn with(&self, keys: &str) -> String {
        self.config.replacen('{', &format!("{{{keys},"), 1)
    }

    /// The same soil for contacts of one size b (m), as integrals have it.
    pub fn of_size(&self, b: f64) -> Self {
        let modulus = format!(r#""k_c":0.0,"k_phi":{:?},"#, self.modulus(b));
        let take = |text: &str| {
            let mut keys: serde_json::Map<String, serde_json::Value> =
                serde_json::from_str(text).unwrap_or_default();
            keys.remove("k_c");
            keys.remove("k_phi");
            serde_json::Value::Object(keys).to_string().replacen('{', &format!("{{{modulus}"), 1)
        };
        Self { config: take(&self.config), own: take(&self.own), ..self.clone() }
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
        if n < 1.0 { law.max(p / STIFF) } else { law }
    }
}

/// The eight soils.
pub fn eight() -> Outcome<Vec<SoilRow>> {
    let table = SoilTable::parse(&read(&root().join("models/soils.csv"))?).map_err(|e| e.to_string())?;
    EIGHT.iter().map(|(row, name)| of(&table, row, name)).collect()
}

fn of(table: &SoilTable, row: &str, name: &'static str) -> Outcome<SoilRow> {
    let offered = table.row(row).and_then(|r| r.offered(&[])).map_err(|e| e.to_string())?;
    let values = COLUMNS.map(|c| offered.iter().find(|(k, _)| *k == c).map_or(f64::NAN, |(_, v)| *v));
    let config: serde_json::Map<_, _> = offered.into_iter().map(|(k, v)| (k.to_owned(), v.into())).collect();
    let own = serde_json::Value::Object(config).to_string();
    Ok(SoilRow { name, config: own.replacen('{', &format!("{{{BY_DEPTH},"), 1), own, values })
}
