//! The parameters of `feet`.

use super::NAME;
use terraglue_subsystem::{Config, Error, Geometry, Kind, Parameter, ParameterType, Result, Schema};

/// Where a foot is that nobody has placed: far above the ground, m.
const UP_M: f64 = 100.0;
/// Smallest and largest lengths of a foot, m: a grain of sand, and more than any machine needs.
const LENGTHS_M: [f64; 2] = [1e-4, 100.0];
/// Most feet of one instance.
const MOST: f64 = 1024.0;

/// Read and checked.
#[derive(Debug)]
pub struct DrivenBodiesSettings {
    pub shape: Geometry,
    pub positions: Vec<[f64; 3]>,
    pub duration_s: f64,
}

/// Schema of the module.
pub fn schema() -> Schema {
    let [low, high] = LENGTHS_M;
    let number = |name: &str, default: f64, help: &str| {
        Parameter::number(name, "m", default, help).within(low, high).usually("m", 1e-3, 2.0)
    };
    Schema {
        name: NAME.into(),
        kind: Kind::Robot,
        help: "Shapes on prescribed paths, with the forces on them".into(),
        parameters: vec![
            Parameter::of("count", ParameterType::Integer, "Number of feet").or(1).within(1.0, MOST),
            Parameter::of("shape", ParameterType::Text, "Shape of every foot")
                .or("sphere")
                .choices(&["sphere", "box", "cylinder", "capsule"]),
            number("radius_m", 0.03, "Radius of sphere, cylinder and capsule"),
            number("half_length_m", 0.03, "Half length along z of cylinder and capsule"),
            Parameter {
                unit: "m".into(),
                ..Parameter::of(
                    "half_extents_m",
                    ParameterType::Numbers,
                    "Half lengths of a box along x, y, z",
                )
                .or(vec![0.05, 0.05, 0.01])
                .within(low, high)
            },
            Parameter {
                unit: "m".into(),
                ..Parameter::of(
                    "position_m",
                    ParameterType::Numbers,
                    "x, y, z of every foot at the start; far above the ground if silent",
                )
                .optional()
            },
            Parameter::number("duration_s", "s", 1e-3, "Time over which a new pose is reached")
                .within(1e-6, 1e3),
        ],
    }
}

impl DrivenBodiesSettings {
    /// Reads the parameters.
    ///
    /// # Errors
    /// A list of the wrong length, a length that is not positive.
    pub fn read(config: &Config) -> Result<Self> {
        let count = config.number("count")? as usize;
        let radius = config.number("radius_m")?;
        let half_length = config.number("half_length_m")?;
        let shape = match config.text("shape")? {
            "box" => Geometry::Box { half_extents: half_extents(config)? },
            "cylinder" => Geometry::Cylinder { half_length, radius },
            "capsule" => Geometry::Capsule { half_length, radius },
            _ => Geometry::Sphere { radius },
        };
        let given = config.numbers("position_m")?;
        if !given.is_empty() && given.len() != 3 * count {
            let message =
                format!("`position_m` needs {} numbers for {count} feet, not {}", 3 * count, given.len());
            return Err(Error::Refused(message));
        }
        let mut positions: Vec<[f64; 3]> = given.as_chunks::<3>().0.to_vec();
        positions.resize(count, [0.0, 0.0, UP_M]);
        Ok(Self { shape, positions, duration_s: config.number("duration_s")? })
    }
}

fn half_extents(config: &Config) -> Result<[f64; 3]> {
    let given = config.numbers("half_extents_m")?;
    match <[f64; 3]>::try_from(given.as_slice()) {
        Ok(half) if half.iter().all(|x| *x > 0.0) => Ok(half),
        _ => Err(Error::Refused(format!("`half_extents_m` needs three lengths, not {given:?}"))),
    }
}
