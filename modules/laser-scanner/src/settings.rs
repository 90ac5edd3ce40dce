//! The parameters of the module.

use crate::beam::{Beam, Returns};
use crate::errors::RayErrors;
use crate::pattern::Pattern;
use serde_json::json;
use terraglue_subsystem::{Config, Error, Kind, Mount, Parameter, ParameterType, Result, Schema};

/// Parameters of a scanner in a scenario.
#[derive(Clone, Debug)]
pub(crate) struct Settings {
    pub mount: Mount,
    pub pattern: Pattern,
    pub rate_hz: f64,
    pub phase: f64,
    pub errors: RayErrors,
    pub beam: Beam,
    pub sees_own_body: bool,
}

/// Most rays of a turn.
const MOST_RAYS: usize = 1_000_000;
/// Name of the pattern whose beams are given in the scenario.
const TABLE: &str = "table";

/// A number that is not negative.
fn part(name: &str, unit: &str, default: f64, help: &str) -> Parameter {
    Parameter::number(name, unit, default, help).within(0.0, f64::INFINITY)
}

/// A share.
fn share(name: &str, default: f64, help: &str) -> Parameter {
    Parameter::number(name, "", default, help).within(0.0, 1.0)
}

/// Name, kind and parameters.
pub fn schema() -> Schema {
    let [mount, offset] = Mount::parameters();
    let [line, vlp, os1] = Pattern::NAMES;
    let pattern = Parameter::of(
        "pattern",
        ParameterType::Text,
        "Beams: those of a scanner that is known, or the table below",
    );
    let elevations = "Elevation of each beam of the pattern `table`, degrees, the highest first";
    let parameters = vec![
        mount,
        offset,
        pattern.or(os1).choices(&[line, vlp, os1, TABLE]),
        Parameter::of("elevations_deg", ParameterType::Numbers, elevations).or(json!([0.0])),
        Parameter::number("columns", "", 1024.0, "Firings in a turn of the pattern `table`").within(2.0, 1e5),
        Parameter::number("rate_hz", "Hz", 10.0, "Turns per second").positive(),
        share("phase", 0.0, "Share of a turn by which the first one begins late"),
        part("noise_m", "m", 0.0, "Standard deviation of a range"),
        part("noise_per_m", "", 0.0, "Increase of `noise_m` with each metre of range"),
        part("angle_rad", "rad", 0.0, "Standard deviation of azimuth and of elevation"),
        Parameter::number("bias_m", "m", 0.0, "Added to all ranges"),
        part(
            "beam_bias_m",
            "m",
            0.0,
            "Standard deviation of what is added to all ranges of a beam, drawn for each",
        ),
        part("nearest_m", "m", 0.3, "Nearest range that is reported"),
        part("farthest_m", "m", 120.0, "Farthest range that is reported"),
        share("drop_out", 0.0, "Probability that a ray is lost"),
        part("drop_out_per_m", "1/m", 0.0, "Increase of `drop_out` with each metre of range"),
        share(
            "drop_out_grazing",
            0.0,
            "Increase of `drop_out` along a surface, by the square of 1 − cosine of incidence",
        ),
        Parameter::of("sees_own_body", ParameterType::Bool, "Whether rays meet the body that it sits on")
            .or(false),
    ];
    let parameters = parameters.into_iter().chain(of_beam()).collect();
    let help = "Laser scanner that turns: points of every ray at its own time and pose, with noise, drop-out and faults";
    Schema { name: "laser-scanner".into(), kind: Kind::Sensor, help: help.into(), parameters }
}

/// Parameters of the extent of a beam and of its returns.
fn of_beam() -> Vec<Parameter> {
    let [strongest, first, last] = Returns::NAMES;
    vec![
        part(
            "divergence_rad",
            "rad",
            0.0,
            "Full angle of a beam, at which its light has fallen to 1/e²: seven rays stand for it; 0: a line",
        )
        .within(0.0, 0.5),
        part(
            "pulse_m",
            "m",
            0.6,
            "Surfaces that are nearer to each other along a beam come back as one point",
        ),
        share("threshold", 0.0, "Least share of the light that must come back for a point"),
        Parameter::of(
            "returns",
            ParameterType::Text,
            "Return of a beam that is reported where it meets several surfaces",
        )
        .or(strongest)
        .choices(&[strongest, first, last]),
    ]
}

impl Settings {
    pub fn from_config(config: &Config) -> Result<Self> {
        let name = config.text("pattern")?;
        let pattern = match Pattern::named(name) {
            Some(pattern) => pattern,
            None if name == TABLE => {
                let elevations = config.numbers("elevations_deg")?;
                if elevations.is_empty() || elevations.iter().any(|e| !(-90.0..=90.0).contains(e)) {
                    let why = "parameter `elevations_deg`: at least one angle, all from −90 to 90, is needed";
                    return Err(Error::Refused(why.into()));
                }
                let elevations = elevations.iter().map(|e| e.to_radians()).collect();
                let columns = config.number("columns")? as u32;
                Pattern { columns, elevations, ..Pattern::os1_64() }
            }
            None => return Err(Error::Refused(format!("parameter `pattern` = \"{name}\" is no pattern"))),
        };
        let beam = Beam {
            divergence_rad: config.number("divergence_rad")?,
            pulse_m: config.number("pulse_m")?,
            threshold: config.number("threshold")?,
            returns: Returns::named(config.text("returns")?).unwrap_or(Returns::Strongest),
        };
        let rays = pattern.rays() * beam.rays();
        if rays > MOST_RAYS {
            let why = format!("{rays} rays in a turn are more than {MOST_RAYS}: fewer `columns` or beams");
            return Err(Error::Refused(why));
        }
        let limits_m = [config.number("nearest_m")?, config.number("farthest_m")?];
        if !(limits_m[0] < limits_m[1]) {
            return Err(Error::Refused("parameter `farthest_m` must be more than `nearest_m`".into()));
        }
        let errors = RayErrors {
            noise_m: config.number("noise_m")?,
            noise_per_m: config.number("noise_per_m")?,
            angle_rad: config.number("angle_rad")?,
            bias_m: config.number("bias_m")?,
            beam_bias_m: config.number("beam_bias_m")?,
            limits_m,
            drop_out: config.number("drop_out")?,
            drop_out_per_m: config.number("drop_out_per_m")?,
            drop_out_grazing: config.number("drop_out_grazing")?,
        };
        Ok(Self {
            mount: Mount::from_config(config)?,
            pattern,
            rate_hz: config.number("rate_hz")?,
            phase: config.number("phase")?,
            errors,
            beam,
            sees_own_body: config.flag("sees_own_body")?,
        })
    }
}
