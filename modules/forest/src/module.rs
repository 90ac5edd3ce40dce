//! The module: a stand in a scenario, on its terrain. It does nothing but stand there and be seen.

use crate::scene::plants;
use crate::stand::{Growth, Stand, Terrain as Formula};
use crate::survey::Survey;
use crate::table::{self, Listed};
use std::fmt::Write;
use std::path::Path;
use std::sync::Arc;
use terraglue_numerics::random::Random;
use terraglue_subsystem::{
    BodyState, Capabilities, Causality, Config, Energy, Error, Host, Input, Kind, LogLevel, Message, Module,
    Motion, Parameter, ParameterType, Response, Result, Scene, Schema, Slots, Step, StreamInfo, Subsystem,
    Terrain, ValueType, ValuesMut, Variable, bytes, files, persist,
};

/// Form of the serialized state.
const VERSION: u32 = 2;
/// Id of the number of trees.
const TREES: u32 = 0;
/// Help of the parameter `trees`.
const TABLE_HELP: &str = "Table (CSV) of surveyed trees, which stand as it says, instead of those that grow: columns x, y and, where they are \
                          known, dbh_m, height_m, species (pine or spruce), lean_x, lean_y";
/// Most plants of a stand.
const MOST_PLANTS: f64 = 20_000.0;

/// A stand of trees in a scenario.
pub struct Forest {
    scene: Scene,
    stand: Stand,
    variables: Vec<Variable>,
    streams: Vec<StreamInfo>,
    /// The map as a table.
    map: String,
    told: Told,
    slots: Slots<Told>,
}

/// Whether the map has been published.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Told {
    is_over: bool,
    /// Time of its publication, if the last step did so, s.
    now: Option<f64>,
}
persist!(Told { is_over, now });

/// Name, kind and parameters.
pub fn schema() -> Schema {
    let usual = Growth::default();
    let part = |name: &str, unit: &str, default: f64, help: &str| {
        Parameter::number(name, unit, default, help).within(0.0, f64::INFINITY)
    };
    let parameters = vec![
        Parameter::of("trees", ParameterType::Path, TABLE_HELP).optional(),
        Parameter::of(
            "trees_origin_m",
            ParameterType::Numbers,
            "Place of the origin in the coordinates of that table, x and y",
        )
        .or(vec![0.0, 0.0]),
        Parameter::number("seed", "", 1.0, "Seed of the stand, apart from that of the run").within(0.0, 1e15),
        part("per_hectare", "", usual.per_hectare, "Trees per hectare"),
        Parameter::number("half_m", "m", usual.half_m, "Half the edge of the square in which they stand")
            .positive(),
        part("apart_m", "m", usual.apart_m, "Least distance of two trees"),
        Parameter::number(
            "diameter_m",
            "m",
            usual.diameter_m,
            "Scale of the Weibull distribution of diameters",
        )
        .positive(),
        Parameter::number("shape", "", usual.shape, "Shape of that distribution").positive(),
        part("lean", "", usual.lean, "Standard deviation of the lean along x and along y, m/m"),
        Parameter::number("spruces", "", usual.spruces, "Share of spruces; the others are pines")
            .within(0.0, 1.0),
        part("bushes_per_hectare", "", usual.bushes_per_hectare, "Bushes per hectare"),
        Parameter::number(
            "crown_transmittance",
            "",
            0.0,
            "Share of the light that passes each surface of crowns and bushes",
        )
        .within(0.0, 1.0),
        part("clearing_m", "m", usual.clearing_m, "No plant stands nearer to the origin"),
        Parameter::of(
            "road_m",
            ParameterType::Numbers,
            "Corners of a road: x and y of each, one after the other, m",
        )
        .or(Vec::<f64>::new()),
        part("road_half_m", "m", 2.5, "Half the width of that road, within which nothing stands"),
        part("map_noise_m", "m", 0.1, "Standard deviation of a place of the map along x and along y"),
        Parameter::number("map_missing", "", 0.1, "Share of the trees that are not on the map")
            .within(0.0, 1.0),
        Parameter::number(
            "map_extra",
            "",
            0.1,
            "Trees on the map that are not there, as a share of those that are",
        )
        .within(0.0, 10.0),
    ];
    let help =
        "A stand of trees from a table or a seed, with branches and undergrowth, to be seen by sensors";
    Schema { name: "forest".into(), kind: Kind::Robot, help: help.into(), parameters }
}

impl Module for Forest {
    fn schema() -> Schema {
        schema()
    }

    fn instantiate(config: &Config, host: Arc<dyn Host>) -> Result<Box<dyn Subsystem>> {
        Ok(Box::new(Self::new(config, host.as_ref())?))
    }
}

impl Forest {
    /// The stand of these parameters.
    ///
    /// # Errors
    /// [`Error::Refused`]: more plants than a stand holds.
    pub fn new(config: &Config, host: &dyn Host) -> Result<Self> {
        let of = |key: &str| config.number(key);
        let growth = growth(config)?;
        let plants_wanted =
            4e-4 * growth.half_m * growth.half_m * (growth.per_hectare + growth.bushes_per_hectare);
        if !(plants_wanted <= MOST_PLANTS) {
            let why = format!(
                "{plants_wanted:.0} plants are more than {MOST_PLANTS:.0}: a smaller `half_m` or fewer `per_hectare`"
            );
            return Err(Error::Refused(why));
        }
        let seed = of("seed")? as u64;
        let (road, half_m) = (corners(&config.numbers("road_m")?)?, of("road_half_m")?);
        let mut stand = match config.text("trees") {
            Ok(path) => {
                let mut stand = surveyed(config, path, (&growth, seed), host)?;
                stand.clear_road_of_bushes(&road, half_m);
                stand
            }
            Err(_) => {
                let mut stand = Stand::grow(&growth, seed);
                stand.clear_road(&road, half_m);
                stand
            }
        };
        let height = |at: [f64; 2]| host.terrain().map_or(0.0, |t| height(t, at));
        let feet =
            stand.trees.iter_mut().map(|t| &mut t.foot).chain(stand.bushes.iter_mut().map(|b| &mut b.foot));
        feet.for_each(|foot| foot[2] = height([foot[0], foot[1]]));
        let scene = plants(&stand, seed, of("crown_transmittance")?).as_one_body("stand");
        let trees = Variable::real(TREES, "trees", "", Causality::Output, "Trees of the stand");
        let survey =
            Survey { noise_m: of("map_noise_m")?, missing: of("map_missing")?, extra: of("map_extra")? };
        let map = table(&survey, &stand, seed);
        let stream = StreamInfo {
            name: "map".into(),
            schema: "terraglue.TreeMap".into(),
            encoding: "csv".into(),
            rate_hz: 0.0,
            most_bytes: map.len() as u32,
            help: "Map of the stand, once: a table with the columns x and y, m".into(),
        };
        Ok(Self {
            scene,
            stand,
            variables: vec![trees.typed(ValueType::U64)],
            streams: vec![stream],
            map,
            told: Told { is_over: false, now: None },
            slots: Slots::new(host.slots()),
        })
    }

    /// The trees and bushes.
    pub fn stand(&self) -> &Stand {
        &self.stand
    }
}

/// How a stand grows.
fn growth(config: &Config) -> Result<Growth> {
    let of = |key: &str| config.number(key);
    Ok(Growth {
        per_hectare: of("per_hectare")?,
        half_m: of("half_m")?,
        apart_m: of("apart_m")?,
        diameter_m: of("diameter_m")?,
        shape: of("shape")?,
        lean: of("lean")?,
        spruces: of("spruces")?,
        bushes_per_hectare: of("bushes_per_hectare")?,
        clearing_m: of("clearing_m")?,
        terrain: Formula::default(),
    })
}

/// The stand of a table, with bushes from the seed.
fn surveyed(config: &Config, path: &str, (growth, seed): (&Growth, u64), host: &dyn Host) -> Result<Stand> {
    let path = Path::new(host.folder()).join(path);
    let shown = path.display();
    let text = files::read_large_text(&path).map_err(|e| Error::Failed(format!("{shown}: {e}")))?;
    let origin = match config.numbers("trees_origin_m")?[..] {
        [x, y] if x.is_finite() && y.is_finite() => [x, y],
        _ => {
            return Err(Error::Refused("parameter `trees_origin_m`: x and y are needed, both finite".into()));
        }
    };
    let mut random = Random::new(seed);
    let draw = |random: &mut Random| (growth.diameter(random), growth.species(random));
    let Listed { mut stand, unread } = table::listed(&text, origin, draw, &mut random)
        .map_err(|why| Error::Refused(format!("{shown}: {why}")))?;
    if stand.trees.len() as f64 > MOST_PLANTS {
        let why = format!("{shown}: {} trees are more than {MOST_PLANTS:.0}", stand.trees.len());
        return Err(Error::Refused(why));
    }
    if !unread.is_empty() {
        let text = format!(
            "{shown}: columns that are not read: {}; those that are: {}",
            unread.join(", "),
            table::COLUMNS.join(", ")
        );
        host.log(LogLevel::Warning, &text);
    }
    stand.grow_bushes(growth, &mut random);
    Ok(stand)
}

/// Corners of a road of a list of x and y.
fn corners(numbers: &[f64]) -> Result<Vec<[f64; 2]>> {
    let (corners, rest) = numbers.as_chunks::<2>();
    if !rest.is_empty() || corners.len() == 1 || !numbers.iter().all(|x| x.is_finite()) {
        let why = "parameter `road_m`: x and y of at least two corners are needed, all finite";
        return Err(Error::Refused(why.into()));
    }
    Ok(corners.to_vec())
}

/// The map that a survey makes of a stand, as a table. Trees are listed from west to east, so that the real ones do not come first.
fn table(survey: &Survey, stand: &Stand, seed: u64) -> String {
    let mut places: Vec<[f64; 2]> = survey.of(stand, !seed).iter().map(|s| s.place).collect();
    places.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let mut out = String::from("x,y\n");
    for [x, y] in places {
        let _ = writeln!(out, "{x:.3},{y:.3}");
    }
    out
}

/// Height of the node of a terrain next to a place, m.
fn height(terrain: &dyn Terrain, at: [f64; 2]) -> f64 {
    let (origin, spacing) = (terrain.origin(), terrain.spacing());
    let [i, j] = [0, 1].map(|k| ((at[k] - origin[k]) / spacing).round() as i64);
    let mut out = [0.0];
    terrain.heights(i, j, 1, 1, &mut out);
    out[0]
}

impl Subsystem for Forest {
    fn capabilities(&self) -> Capabilities {
        Capabilities::RETRY | Capabilities::STATE | Capabilities::SERIALIZE
    }

    fn advance(&mut self, _: &Step, _: &Input, _: &mut Response) -> Result {
        Ok(())
    }

    fn commit(&mut self, step: &Step, _: &[f64], _: &Motion) -> Result {
        self.told = Told { is_over: true, now: (!self.told.is_over).then_some(step.t + step.h) };
        Ok(())
    }

    fn streams(&self) -> &[StreamInfo] {
        &self.streams
    }

    fn stream(&self, k: usize) -> Result<Option<Message<'_>>> {
        if k > 0 {
            return Err(Error::Refused(format!("there is no stream number {k}")));
        }
        Ok(self.told.now.map(|time| Message { time, bytes: self.map.as_bytes() }))
    }

    fn scene(&self) -> Scene {
        self.scene.clone()
    }

    fn body_states(&self, out: &mut [BodyState]) -> Result {
        out.fill(BodyState::REST);
        Ok(())
    }

    /// Trees never move and carry no load: all energies are zero, and known.
    fn energy(&self) -> Energy {
        Energy::default()
    }

    fn save_state(&mut self, slot: u32) -> Result {
        self.slots.save(slot, self.told)
    }

    fn restore_state(&mut self, slot: u32) -> Result {
        self.told = self.slots.saved(slot)?;
        Ok(())
    }

    fn serialize(&self) -> Result<Vec<u8>> {
        Ok(bytes::seal(VERSION, self.stand.trees.len() as u64, &self.told))
    }

    fn deserialize(&mut self, from: &[u8]) -> Result {
        self.told = bytes::open(VERSION, self.stand.trees.len() as u64, from)?;
        Ok(())
    }

    fn variables(&self) -> &[Variable] {
        &self.variables
    }

    fn get(&self, ids: &[u32], out: ValuesMut) -> Result {
        match out {
            ValuesMut::U64(out) if ids.iter().all(|id| *id == TREES) => {
                out.fill(self.stand.trees.len() as u64);
                Ok(())
            }
            _ => Err(Error::Refused("there is one variable, `trees`, of the type u64".into())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use terraglue_subsystem::Standalone;

    fn forest(json: &str) -> Result<Forest> {
        let config = Config::parse(json)?.with_defaults(&schema());
        Forest::new(&config, &Standalone::default())
    }

    #[test]
    fn a_stand_is_one_body_that_never_moves() {
        let forest = forest(r#"{"half_m": 20}"#).expect("a stand");
        let scene = forest.scene();
        assert_eq!((scene.bodies.len(), scene.joints.len()), (1, 1));
        assert_eq!((forest.energy().is_known(), forest.energy().mechanical()), (true, 0.0));
        assert!(scene.shapes.len() > 7 * forest.stand().trees.len() && forest.stand().trees.len() > 50);
        assert!(scene.shapes.iter().all(|s| s.wrong().is_none()));
        let mut out = [0_u64];
        forest.get(&[TREES], ValuesMut::U64(&mut out)).expect("trees");
        assert_eq!(out[0], forest.stand().trees.len() as u64);
    }

    #[test]
    fn too_many_plants_and_half_a_corner_are_refused() {
        assert!(matches!(forest(r#"{"half_m": 1e4}"#), Err(Error::Refused(_))));
        assert!(matches!(forest(r#"{"road_m": [1, 2, 3]}"#), Err(Error::Refused(_))));
        assert!(matches!(forest(r#"{"road_m": [1, 2]}"#), Err(Error::Refused(_))));
    }
}
