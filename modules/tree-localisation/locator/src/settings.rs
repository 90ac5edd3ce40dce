//! The parameters of the module.

use std::path::Path;
use terraglue_subsystem::{
    Config, Error, Host, Kind, Mount, Parameter, ParameterType, Result, Schema, files,
};
use terraglue_tree_localisation::{MatchModel, TrackRules, TreeMap};

/// How the machine itself is left out.
pub(crate) const MASKS: [&str; 3] = ["off", "body", "volume"];

/// Parameters of a tree localisation in a scenario.
#[derive(Clone, Debug)]
pub(crate) struct Settings {
    pub mount: Mount,
    pub scanners: u32,
    pub map: Option<TreeMap>,
    pub model: MatchModel,
    pub rules: TrackRules,
    pub range_m: [f64; 2],
    pub own_bodies: Vec<String>,
    pub mask: u32,
    pub knows_truth: bool,
    pub shown_hz: f64,
}

/// Most scanners.
const MOST_SCANNERS: f64 = 16.0;

/// Name, kind and parameters.
pub fn schema() -> Schema {
    let (model, rules) = (MatchModel::default(), TrackRules::default());
    let [mount, offset] = Mount::parameters();
    let part = |name: &str, unit: &str, default: f64, help: &str| {
        Parameter::number(name, unit, default, help).within(0.0, f64::INFINITY)
    };
    let table =
        "Map with the columns x, y and, where it is known, dbh_m; without it the input `map` gives one";
    let mask = "How the machine itself is left out: not at all, by the body of a point, or by the boxes around its bodies";
    let own = "Bodies of the machine that are left out, with blanks between the names; none: all of the subsystem of `mount`";
    let parameters = vec![
        mount,
        offset,
        Parameter::of(
            "scanners",
            ParameterType::Integer,
            "Scanners that it reads: the inputs `points_1` and so on",
        )
        .or(1)
        .within(1.0, MOST_SCANNERS),
        Parameter::of("map", ParameterType::Path, table).optional(),
        part("map_noise_m", "m", model.noise_m, "Standard deviation of a place of the map along each axis"),
        part("map_diameter_m", "m", model.diameter_m, "Standard deviation of a diameter of the map"),
        Parameter::number("matched", "", model.matched, "Share of the trees that are seen and on the map")
            .within(0.05, 0.98),
        part("drift", "", rules.drift, "Error of the odometry for each metre"),
        part("turn_drift", "rad/m", rules.turn_drift, "Error of its direction for each metre"),
        Parameter::number("window_m", "m", rules.window_m, "Way for which trees are kept").positive(),
        Parameter::of(
            "tries",
            ParameterType::Integer,
            "Scans in a row without a match after which it is lost",
        )
        .or(rules.patience)
        .within(1.0, 1e6),
        part("gnss_reach", "", rules.gnss_reach, "Deviations of GNSS within which it searches"),
        part("nearest_m", "m", 0.5, "Nearest points that are read"),
        Parameter::number("farthest_m", "m", 40.0, "Farthest points that are read").positive(),
        Parameter::of("mask", ParameterType::Text, mask).or("body").choices(&MASKS),
        Parameter::of("own_bodies", ParameterType::Text, own).or(""),
        Parameter::of(
            "knows_truth",
            ParameterType::Bool,
            "Whether it takes the true pose, to show by how much it is wrong",
        )
        .or(false),
        Parameter::number("shown_hz", "Hz", 1.0, "Most messages of the stream `match` per second").positive(),
    ];
    let help =
        "Where a machine is among trees: stems from scans, their match with a map, and whether to believe it";
    Schema { name: "tree-localisation".into(), kind: Kind::Sensor, help: help.into(), parameters }
}

impl Settings {
    pub fn from_config(config: &Config, host: &dyn Host) -> Result<Self> {
        let of = |key: &str| config.number(key);
        let range_m = [of("nearest_m")?, of("farthest_m")?];
        if !(range_m[0] < range_m[1]) {
            return Err(Error::Refused("parameter `farthest_m` must be more than `nearest_m`".into()));
        }
        let mask = config.text("mask")?;
        let number = MASKS.iter().position(|m| *m == mask);
        let wrong =
            || Error::Refused(format!("parameter `mask` = \"{mask}\" is none of {}", MASKS.join(", ")));
        Ok(Self {
            mount: Mount::from_config(config)?,
            scanners: of("scanners")? as u32,
            map: config.text("map").ok().map(|path| read(path, host)).transpose()?,
            model: MatchModel {
                noise_m: of("map_noise_m")?,
                matched: of("matched")?,
                diameter_m: of("map_diameter_m")?,
            },
            rules: TrackRules {
                drift: of("drift")?,
                turn_drift: of("turn_drift")?,
                window_m: of("window_m")?,
                patience: of("tries")? as u32,
                gnss_reach: of("gnss_reach")?,
            },
            range_m,
            own_bodies: config.text("own_bodies")?.split_whitespace().map(str::to_owned).collect(),
            mask: number.ok_or_else(wrong)? as u32,
            knows_truth: config.flag("knows_truth")?,
            shown_hz: of("shown_hz")?,
        })
    }
}

/// The map in a file below the folder of the scenario.
fn read(path: &str, host: &dyn Host) -> Result<TreeMap> {
    let path = Path::new(host.folder()).join(path);
    let text =
        files::read_large_text(&path).map_err(|e| Error::Failed(format!("{}: {e}", path.display())))?;
    TreeMap::from_table(&text).map_err(|e| Error::Refused(format!("{}: {e}", path.display())))
}
