//! Regions of the ground with soils of their own: a number at every node selects its soil.
//!
//! A scenario gives a picture or a grid of labels (`[soil.mask] file`); its reader, the host, makes of it the tables of
//! numbers (`mask.soils`) and one number per node (`mask.runs`), so that a module opens no file. A foot on a border is carried
//! by each soil at its own nodes.

use serde_json::Value;
use terraglue_ground::Lattice;
use terraglue_soil_law::SoilParameters;
use terraglue_subsystem::{Config, Error, Parameter, ParameterType, Result};

/// Largest number of soils in addition to the scenario's own.
pub const MOST_SOILS: usize = 62;

/// Parameters of a soil on a field in its scenario table: the laws' numbers and the mask.
pub fn schema() -> Vec<Parameter> {
    let mut parameters = SoilParameters::schema();
    let of = |name, kind, help| Parameter::of(name, kind, help).optional();
    parameters.extend([
        of(
            "mask.file",
            ParameterType::Path,
            "regions with soils of their own: a grey PNG image or an ESRI ASCII grid of labels, centred on the ground. Label 0, \
             missing data and what lies outside are the table's own soil",
        ),
        Parameter {
            unit: "m".into(),
            ..of(
                "mask.pixel_m",
                ParameterType::Number,
                "distance of pixels of an image; where it is left out the image covers the ground",
            )
            .positive()
            .usually("m", 1e-3, 5.0)
        },
        of(
            "mask.rows",
            ParameterType::TextByName,
            "row of the soil table, or soil file, by label: 1 = \"LETE_sand\"",
        ),
        of(
            "mask.soils",
            ParameterType::Tables,
            "numbers of the soils beside the table's own, in order; the host makes them of `mask.rows`",
        ),
        of(
            "mask.runs",
            ParameterType::Numbers,
            "pairs of a count and the number of a soil (0: the table's own, 1: the first of `mask.soils`) for the nodes of the \
             ground, x fastest; the host makes them of `mask.file`",
        ),
    ]);
    parameters
}

/// Which soil lies where.
#[derive(Clone, Debug, Default)]
pub struct Mask {
    lattice: Option<Lattice>,
    /// Number of the soil at every node, x fastest.
    numbers: Vec<u8>,
    /// The soils from number 1 on.
    pub soils: Vec<SoilParameters>,
}

impl Mask {
    /// From a scenario's table. Refused: numbers of soils that are not there, runs that do not end with the ground.
    ///
    /// # Errors
    /// [`Error::Refused`]: a mask that does not fit the ground or names a soil that is not there.
    pub fn from_config(config: &Config, gravity: f64, lattice: &Lattice) -> Result<Self> {
        let Some(soils) = config.get("mask.soils").and_then(Value::as_array) else {
            return match config.get("mask.file") {
                Some(Value::String(_)) => {
                    Err(Error::Refused("`mask.file` was not read: this host knows no masks".into()))
                }
                _ => Ok(Self::default()),
            };
        };
        if soils.len() > MOST_SOILS {
            return Err(Error::Refused(format!("`mask` has {} soils, at most {MOST_SOILS}", soils.len())));
        }
        let of = |numbers: &Value| {
            let numbers = numbers
                .as_object()
                .ok_or_else(|| Error::Refused("`mask.soils` takes a list of tables".into()))?;
            SoilParameters::from_config(&SoilParameters::of_region(config, numbers)?, gravity)
        };
        let soils = soils.iter().map(of).collect::<Result<Vec<_>>>()?;
        let numbers = expand(&config.numbers("mask.runs")?, soils.len(), lattice.node_count())?;
        Ok(Self { lattice: Some(*lattice), numbers, soils })
    }

    /// Number of the soil at node (i, j); 0 is the scenario's own.
    #[inline]
    pub fn at(&self, i: i32, j: i32) -> usize {
        let Some(lattice) = &self.lattice else { return 0 };
        let (i, j) = lattice.clamp(i, j);
        usize::from(self.numbers[j as usize * lattice.size[0] as usize + i as usize])
    }
}

fn expand(runs: &[f64], soils: usize, nodes: usize) -> Result<Vec<u8>> {
    let mut numbers = Vec::with_capacity(nodes);
    for run in runs.chunks(2) {
        let (count, soil) = (run[0], run.get(1).copied().unwrap_or(-1.0));
        let whole = count >= 1.0 && count.fract() == 0.0 && soil >= 0.0 && soil.fract() == 0.0;
        if !whole || soil > soils as f64 || numbers.len() as f64 + count > nodes as f64 {
            let text = format!(
                "`mask.runs`: {count} nodes of soil {soil} do not fit {soils} soils on {nodes} nodes"
            );
            return Err(Error::Refused(text));
        }
        numbers.extend(std::iter::repeat_n(soil as u8, count as usize));
    }
    if numbers.len() != nodes {
        let text = format!("`mask.runs` has {} nodes, the ground has {nodes}", numbers.len());
        return Err(Error::Refused(text));
    }
    Ok(numbers)
}

#[cfg(test)]
mod tests {
    use super::*;

    const LATTICE: Lattice = Lattice { origin: [0.0; 2], spacing: 0.1, size: [4, 3] };
    const OWN: &str =
        r#""n":1.0,"k_c":1400,"k_phi":820000,"c_pa":170,"phi_rad":0.61,"K_m":0.018,"density_kg_m3":1500"#;

    fn mask(text: &str) -> Result<Mask> {
        let config = Config::parse(&format!("{{{OWN},\"mask\":{text}}}"))?;
        Mask::from_config(&config, 9.81, &LATTICE)
    }

    #[test]
    fn runs_fill_the_ground_and_the_numbers_of_a_soil_replace_the_own_ones() {
        let m = mask(r#"{"soils":[{"k_phi":5e6,"n":0.8}],"runs":[5,0,3,1,4,0]}"#).expect("a mask");
        let found: Vec<usize> = (0..12).map(|k| m.at(k % 4, k / 4)).collect();
        assert_eq!(found, [0, 0, 0, 0, 0, 1, 1, 1, 0, 0, 0, 0]);
        assert_eq!((m.soils[0].k_phi, m.soils[0].n, m.soils[0].K_m), (5e6, 0.8, 0.018));
        assert_eq!(m.soils[0].density_kg_m3, None);
        assert_eq!(m.at(-7, 1), m.at(0, 1));
        assert_eq!(m.at(9, 1), 1);
    }

    #[test]
    fn what_does_not_fit_is_refused_with_the_reason() {
        for (text, reason) in [
            (r#"{"soils":[{}],"runs":[11,0]}"#, "has 11 nodes, the ground has 12"),
            (r#"{"soils":[{}],"runs":[13,0]}"#, "do not fit"),
            (r#"{"soils":[{}],"runs":[12,2]}"#, "do not fit"),
            (r#"{"soils":[{}],"runs":[12]}"#, "do not fit"),
            (r#"{"soils":[{"phi_rad":-1.0}],"runs":[12,1]}"#, "phi_rad"),
            (r#"{"file":"regions.png"}"#, "knows no masks"),
        ] {
            let refused = mask(text).expect_err(text).to_string();
            assert!(refused.contains(reason), "{text}: {refused}");
        }
    }
}
