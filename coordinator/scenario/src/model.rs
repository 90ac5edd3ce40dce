//! A checked scenario: plain data that the testbed is built from.

use super::choices::{
    ConnectionOrder, Extrapolate, FaultChoice, FormChoice, JacobianChoice, LevelChoice, Relaxation,
    StartChoice, StrategyKind,
};
use super::isolation::IsolationSpec;
use super::module_kind::ModuleKind;
use serde_json::{Map, Value};
use std::path::PathBuf;

/// Everything a run needs.
///
/// ```
/// use terraglue_scenario::{Scenario, StrategyKind};
///
/// let text = "[time]\nduration_s = 2.0\n[gluing]\nstrategy = \"iterative\"\n[arm]\nmodule = \"arm.py\"\n";
/// let scenario = Scenario::parse(text, "my.toml", &[])?;
/// assert_eq!((scenario.name.as_str(), scenario.gluing.strategy), ("my", StrategyKind::Iterative));
/// assert_eq!(scenario.subsystems[0].name, "arm");
/// # Ok::<(), Box<terraglue_scenario::InputError>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Scenario {
    /// File stem, e.g. `moon_walk`.
    pub name: String,
    /// Folder of the file; relative paths refer to it.
    pub folder: PathBuf,
    /// `[time]`.
    pub time: Time,
    /// `[world]`.
    pub world: World,
    /// `[terrain]`.
    pub terrain: Option<TerrainSpec>,
    /// `[gluing]`.
    pub gluing: GluingSpec,
    /// `[recording]`.
    pub recording: RecordingSpec,
    /// `[report]`.
    pub report: ReportSpec,
    /// `[page]`.
    pub page: PageSpec,
    /// `[sweep]`.
    pub sweep: Option<SweepSpec>,
    /// `[task]`.
    pub task: Option<TaskSpec>,
    /// Subsystems in the order of their names.
    pub subsystems: Vec<SubsystemSpec>,
    /// `[[connect]]`.
    pub connections: Vec<Connection>,
    /// `[[glue]]` in the order of the file.
    pub glue: Vec<GlueSpec>,
    /// `[[event]]` in the order of the file.
    pub events: Vec<EventSpec>,
    /// `[[fault]]` in the order of the file.
    pub faults: Vec<FaultSpec>,
    /// The text it came from, for errors found later (unknown variables, units).
    pub source: super::Source,
}

/// `[time]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Time {
    /// Communication step h, s.
    pub step_s: f64,
    /// Simulated time, s.
    pub duration_s: f64,
    /// Time before the start in which what touches the ground comes to rest, s.
    pub settle_s: f64,
}

impl Time {
    /// Communication steps of the whole run.
    pub fn steps(&self) -> u64 {
        (self.duration_s / self.step_s).round() as u64
    }
}

/// `[world]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct World {
    /// Gravity, m/s².
    pub gravity_m_s2: [f64; 3],
    /// Seed of everything random.
    pub seed: u64,
}

/// `[terrain]`: centred on the world's origin.
#[derive(Clone, Debug, PartialEq)]
pub struct TerrainSpec {
    /// Extent along x and y, m (files bring their own).
    pub size_m: [f64; 2],
    /// Lattice spacing, m.
    pub spacing_m: f64,
    /// Shape.
    pub kind: TerrainKind,
}

/// Shapes of terrain.
#[derive(Clone, Debug, PartialEq)]
pub enum TerrainKind {
    /// z = height_m.
    Flat {
        /// Height, m.
        height_m: f64,
    },
    /// A plane through the origin that rises along `heading_rad` by `angle_rad`.
    Slope {
        /// Angle against the horizontal, rad.
        angle_rad: f64,
        /// Direction of steepest ascent from +x, rad.
        heading_rad: f64,
    },
    /// A sum of waves of random direction and phase.
    Undulating {
        /// Root mean square of the height, m.
        rms_m: f64,
        /// Shortest and longest wavelength, m.
        wavelengths_m: [f64; 2],
        /// Seed; the world's where absent.
        seed: Option<u64>,
        /// Radius around the origin that is blended to flat ground, m (0: none).
        flat_radius_m: f64,
    },
    /// A bowl with a raised rim.
    Crater {
        /// Diameter from crest to crest, m.
        diameter_m: f64,
        /// Depth of the floor below the crest, m.
        depth_m: f64,
        /// Height of the crest above the surrounding plain, m.
        rim_height_m: f64,
        /// Steepest slope that the shape may reach, rad.
        max_slope_rad: f64,
        /// Centre of the crater, m.
        centre_m: [f64; 2],
    },
    /// ESRI ASCII grid.
    EsriAscii {
        /// File.
        file: PathBuf,
        /// Height that replaces NODATA; refused when absent.
        fill_m: Option<f64>,
    },
    /// Greyscale PNG image.
    Png {
        /// File.
        file: PathBuf,
        /// Meaning of its greys.
        greys: Greys,
        /// Height that replaces transparent pixels; refused when absent.
        fill_m: Option<f64>,
    },
    /// GeoTIFF with one band.
    Geotiff {
        /// File.
        file: PathBuf,
        /// Height that replaces NODATA; refused when absent.
        fill_m: Option<f64>,
    },
}

/// Meaning of the grey of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Greys {
    /// Distance of pixels, m.
    pub pixel_m: f64,
    /// Height of black, m.
    pub low_m: f64,
    /// Height of white, m.
    pub high_m: f64,
}

/// `[gluing]`.
#[derive(Clone, Debug, PartialEq)]
pub struct GluingSpec {
    /// How steps are glued.
    pub strategy: StrategyKind,
    /// Form of the interface problem (iterative only).
    pub form: FormChoice,
    /// τ in |Λe|∞ ≤ τ·max(T_ref, |T|∞).
    pub tolerance: f64,
    /// Most iterations of one step before it is halved.
    pub max_iterations: u32,
    /// How often a step that does not converge may be halved before the run stops.
    pub max_halvings: u32,
    /// Initial guess of the iteration.
    pub start: StartChoice,
    /// How `relaxed` accelerates its fixed point.
    pub relaxation: Relaxation,
    /// Where the bodies' interface Jacobian comes from.
    pub jacobian: JacobianChoice,
    /// Level of the condition at joints.
    pub level: LevelChoice,
    /// Share of the error that is taken out per step at velocity or acceleration level.
    pub stabilisation: f64,
    /// Tolerated energy residual of a step, J; absent: all steps have the same length.
    pub energy_residual_j: Option<f64>,
    /// Shortest step where the energy residual sets the length, s.
    pub step_min_s: Option<f64>,
    /// Factor on the forces of joints at the start: a control that shows how an integrator forgets a wrong start.
    pub start_scale: f64,
    /// Contacts are made when a shape can come this near within the step, m.
    pub contact_margin_m: f64,
}

/// `[recording]`.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordingSpec {
    /// Every how many steps the ground is written (dirty tiles).
    pub ground_every_steps: u64,
    /// Every how many steps variables and poses are written.
    pub every_steps: u64,
    /// Whether overlays are written.
    pub overlays: bool,
    /// Significant digits of what is recorded.
    pub digits: u64,
    /// Patterns of the variables that are recorded; all where empty.
    pub include: Vec<String>,
    /// Patterns of variables that are not.
    pub exclude: Vec<String>,
}

/// `[report]`.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct ReportSpec {
    /// `subsystem.body` whose distance, roll and pitch are reported; the first body of the first robot when empty.
    pub body: Option<String>,
    /// `subsystem.variable` with the commanded speed, m/s.
    pub commanded_speed: Option<String>,
    /// `subsystem.joint` whose torque, velocity and angle are plotted.
    pub joint: Option<String>,
}

/// `[sweep]`.
#[derive(Clone, Debug, PartialEq)]
pub struct SweepSpec {
    /// How the points are chosen: one of [`super::keys::SWEEP_METHODS`].
    pub method: String,
    /// Points of a method that spreads them.
    pub points: usize,
    /// Runs of each point with seeds of their own; 0: one with the seed of the scenario.
    pub seeds: u64,
    /// Of the points, and the first of the runs.
    pub seed: u64,
    /// Rows that are the points.
    pub table: Option<PathBuf>,
    /// Keys of `summary.json` and variables beside the usual figures.
    pub collect: Vec<String>,
    /// Keys that differ from run to run.
    pub vary: Vec<VariedKey>,
}

/// A key path of a scenario with the values that it takes.
#[derive(Clone, Debug, PartialEq)]
pub struct VariedKey {
    /// Key path, as of `--set`.
    pub key: String,
    /// Its values.
    pub values: VariedValues,
}

/// Values of a key in a sweep.
#[derive(Clone, Debug, PartialEq)]
pub enum VariedValues {
    /// These, written as for `--set`.
    List(Vec<String>),
    /// A range of numbers.
    Range {
        /// Its ends.
        ends: [f64; 2],
        /// Whether both are whole numbers, and so all between.
        is_whole: bool,
        /// Whether numbers are spread by their logarithm.
        is_log: bool,
        /// Numbers on a grid, both ends among them.
        count: Option<usize>,
    },
}

/// `[task]`.
#[derive(Clone, Debug, PartialEq)]
pub struct TaskSpec {
    /// Variables that are observed; patterns.
    pub observe: Vec<String>,
    /// Variables that are set, patterns, with their ranges.
    pub act: Vec<(String, [f64; 2])>,
    /// Variables whose growth is rewarded.
    pub reward: Vec<String>,
    /// Variables whose growth the reward is divided by; empty: the work of all drives, J.
    pub cost: Vec<String>,
    /// Angles of a fall, rad.
    pub tilt: Vec<String>,
    /// Size of an angle that is a fall, rad.
    pub fallen_rad: f64,
    /// Time between two actions, s.
    pub period_s: f64,
    /// Time of an episode, s; that of the run where absent.
    pub duration_s: Option<f64>,
}

/// `[page]`.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct PageSpec {
    /// From where: a name, or a name with turn and height, rad, and distance, m.
    pub camera: Option<String>,
    /// Colours of the ground.
    pub ground: Option<String>,
    /// Layers that are on; the usual ones where absent.
    pub layers: Option<Vec<String>>,
    /// Plots, each of variables with commas between; what stands along its axis follows an `@`.
    pub plots: Vec<String>,
    /// `subsystem.part` or `subsystem.variable` that is selected.
    pub select: Option<String>,
}

impl PageSpec {
    /// All variables of a plot.
    pub fn variables(plot: &str) -> impl Iterator<Item = &str> {
        plot.split([',', '@']).map(str::trim)
    }

    /// `[page]` of the text of a scenario, as the page reads it; none where it is absent.
    pub fn of_text(text: &str) -> Option<Value> {
        Scenario::parse(text, "scenario.toml", &[]).ok()?.page.to_json()
    }

    /// As the page reads it; none where nothing was given.
    pub fn to_json(&self) -> Option<Value> {
        let all = [
            ("camera", self.camera.clone().map(Value::from)),
            ("ground", self.ground.clone().map(Value::from)),
            ("layers", self.layers.clone().map(Value::from)),
            ("plots", (!self.plots.is_empty()).then(|| self.plots.join(";").into())),
            ("select", self.select.clone().map(Value::from)),
        ];
        let said: Map<String, Value> =
            all.into_iter().filter_map(|(key, value)| Some((key.to_owned(), value?))).collect();
        (!said.is_empty()).then_some(Value::Object(said))
    }
}

/// A subsystem's table.
#[derive(Clone, Debug, PartialEq)]
pub struct SubsystemSpec {
    /// Name of the table.
    pub name: String,
    /// `module`, as written.
    pub module: String,
    /// Steps of the testbed per step of the subsystem.
    pub step_multiple: u32,
    /// Whether it lives in a process of its own by `isolate = true`; what is in Python always does.
    pub isolate: bool,
    /// Limits of that process.
    pub isolation: IsolationSpec,
    /// `python`: the interpreter of a module in Python, as written.
    pub python: Option<String>,
    /// `build`: what makes the module anew, for `run --watch`.
    pub build: Option<String>,
    /// `sources`: files and folders that this depends on; empty: the scenario's folder.
    pub sources: Vec<String>,
    /// All parameters, nested tables as objects: the host's keys are taken out.
    pub parameters: Map<String, Value>,
    /// Numbers of a named soil row that are offered to the module, not demanded of it.
    pub offered: Map<String, Value>,
    /// Soils by the labels of the mask, in ascending order.
    pub regions: Vec<Region>,
}

impl SubsystemSpec {
    /// Whether it is an FMU.
    pub fn is_fmu(&self) -> bool {
        ModuleKind::is_fmu(&self.module)
    }
}

/// A label of a soil's mask.
#[derive(Clone, Debug, PartialEq)]
pub struct Region {
    /// 1 … 255.
    pub label: u8,
    /// Row of the soil table, or soil file, as written.
    pub soil: String,
    /// Its numbers.
    pub numbers: Map<String, Value>,
}

/// An entry of a repeated table, e.g. `[[event]]`, for errors about it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Entry {
    /// Name of the table.
    pub table: &'static str,
    /// Number in the order of the file, from 0.
    pub number: usize,
}

/// `[[connect]]`.
#[derive(Clone, Debug, PartialEq)]
pub struct Connection {
    /// `subsystem.variable`, each `*` matches one dotted part or a piece of it.
    pub from: String,
    /// The same; its `*` take what matched in `from`.
    pub to: String,
    /// to = factor · from + offset, after the conversion of units.
    pub factor: f64,
    /// See `factor`.
    pub offset: f64,
    /// Whether units are compared and converted.
    pub convert: bool,
    /// When within a step its value is passed.
    pub order: ConnectionOrder,
    /// Extrapolation of the input where it is read at the start of a step.
    pub extrapolate: Extrapolate,
    /// New value for each truth value, whole number or item of an enumeration; empty: unchanged.
    pub map: Vec<(String, Value)>,
    /// Where it stands.
    pub entry: Entry,
}

impl Default for GluingSpec {
    fn default() -> Self {
        Self {
            strategy: StrategyKind::Cooperative,
            form: FormChoice::Auto,
            tolerance: 1e-8,
            max_iterations: 20,
            max_halvings: 4,
            start: StartChoice::Estimate,
            relaxation: Relaxation::Anderson,
            jacobian: JacobianChoice::Analytic,
            level: LevelChoice::Position,
            stabilisation: 0.0,
            energy_residual_j: None,
            step_min_s: None,
            start_scale: 1.0,
            contact_margin_m: 1e-3,
        }
    }
}

/// `[[glue]]`: two bodies glued together.
#[derive(Clone, Debug, PartialEq)]
pub struct GlueSpec {
    /// `subsystem.body` of both sides; the second may be `world`.
    pub sides: [String; 2],
    /// Unilateral along `normal`; else a joint.
    pub contact: bool,
    /// World point at the start; absent: each body's own origin.
    pub at_m: Option<[f64; 3]>,
    /// Mask of carried components in the order of the axes.
    pub mask: u32,
    /// The axes turn with side 1.
    pub turning: bool,
    /// Normal of a contact.
    pub normal: [f64; 3],
    /// Compliance of the glue, m/N.
    pub compliance: f64,
    /// Damping of the glue beside its spring, N s/m.
    pub damping: f64,
    /// Time in which the gap at the start is closed, s; 0: there may be none.
    pub ramp_s: f64,
    /// Whether a free body is moved so that the points of a joint meet at the start.
    pub projects: bool,
    /// Largest normal force, N.
    pub t_max: f64,
    /// Coulomb coefficient.
    pub mu: f64,
    /// Strategy of its group; absent: that of `[gluing]`.
    pub strategy: Option<StrategyKind>,
    /// Where it stands.
    pub entry: Entry,
}

/// `[[event]]`.
#[derive(Clone, Debug, PartialEq)]
pub struct EventSpec {
    /// When.
    pub trigger: Trigger,
    /// `subsystem.variable` = value, in the order of the file.
    pub set: Vec<(String, Value)>,
    /// `subsystem.action`.
    pub act: Vec<String>,
    /// Where it stands.
    pub entry: Entry,
}

/// `[[fault]]`.
#[derive(Clone, Debug, PartialEq)]
pub struct FaultSpec {
    /// `subsystem.variable`.
    pub variable: String,
    /// Effect on its numbers.
    pub kind: FaultKind,
    /// From when on.
    pub start: Trigger,
    /// Until when.
    pub end: FaultEnd,
    /// Seed of noise and drop-outs; absent: by the world's and the place in the file.
    pub seed: Option<u64>,
    /// Where it stands.
    pub entry: Entry,
}

/// Effect of a fault on a number x.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FaultKind {
    /// This value.
    Override(f64),
    /// x + this.
    Offset(f64),
    /// x · this.
    Gain(f64),
    /// x + this · time since the fault began, 1/s.
    Ramp(f64),
    /// The value of x when the fault began.
    Freeze,
    /// The value of x so long ago, s.
    Delay(f64),
    /// With this probability per step the value passed last.
    DropOut(f64),
    /// x + a normal random number with this deviation.
    Noise(f64),
}

impl FaultKind {
    /// As written in a scenario.
    pub fn name(self) -> &'static str {
        match self {
            Self::Override(_) => FaultChoice::Override.name(),
            Self::Offset(_) => FaultChoice::Offset.name(),
            Self::Gain(_) => FaultChoice::Gain.name(),
            Self::Ramp(_) => FaultChoice::Ramp.name(),
            Self::Freeze => FaultChoice::Freeze.name(),
            Self::Delay(_) => FaultChoice::Delay.name(),
            Self::DropOut(_) => FaultChoice::DropOut.name(),
            Self::Noise(_) => FaultChoice::Noise.name(),
        }
    }
}

/// When a fault ends.
#[derive(Clone, Debug, PartialEq)]
pub enum FaultEnd {
    /// Not in this run.
    Never,
    /// At a time or when a comparison holds.
    At(Trigger),
    /// So long after its begin, s.
    After(f64),
}

/// When an event fires; once.
#[derive(Clone, Debug, PartialEq)]
pub enum Trigger {
    /// At the first communication point with t ≥ at_s.
    At(f64),
    /// At the first communication point where the comparison holds.
    When {
        /// `subsystem.variable`.
        variable: String,
        /// `<`, `<=`, `>`, `>=`, `==` or `!=`.
        comparison: Comparison,
        /// Right-hand side.
        value: f64,
    },
}

/// A comparison of a variable with a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Comparison {
    Less,
    LessEqual,
    Greater,
    GreaterEqual,
    Equal,
    NotEqual,
}
