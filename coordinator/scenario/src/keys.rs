//! Every key of the reserved tables, once: the parser, the JSON Schema and `docs/scenario.md` are made from here.

use super::choices::{
    ConnectionOrder, Extrapolate, FaultChoice, FormChoice, JacobianChoice, LevelChoice, Relaxation,
    StartChoice, StrategyKind, TerrainChoice,
};
use terraglue_diagnostics::allowed;
use terraglue_subsystem::{Parameter, ParameterType};

/// A reserved table of a scenario.
pub struct Table {
    /// Name.
    pub name: &'static str,
    /// Written as `[[name]]`, any number of times.
    pub repeated: bool,
    /// Must be there.
    pub required: bool,
    /// One line for people.
    pub help: &'static str,
    /// Its keys.
    pub keys: Vec<Key>,
}

/// A key of a reserved table.
pub struct Key {
    /// Name, type, range, default, help.
    pub parameter: Parameter,
    /// Shape of the value beyond the parameter.
    pub form: Form,
    /// Values of `kind` that know this key; empty: all.
    pub only: &'static [&'static str],
}

/// Shapes of values beyond what a [`Parameter`] describes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// As the parameter says.
    Plain,
    /// A list of exactly so many numbers.
    Count(usize),
    /// Text or a list of texts.
    Texts,
    /// A table of values by variable name.
    Assignments,
    /// A table of new values by value.
    Map,
    /// A table of lists or ranges by key path of the scenario.
    Vary,
}

impl Key {
    /// Length that a list must have.
    pub fn count(&self) -> Option<usize> {
        match self.form {
            Form::Count(n) => Some(n),
            _ => None,
        }
    }

    /// The allowed values in words.
    pub fn allowed(&self) -> String {
        match self.form {
            Form::Texts => "text in quotes or a list of texts".into(),
            Form::Assignments => "a table { \"subsystem.variable\" = value }".into(),
            Form::Map => "a table { \"value\" = new value }".into(),
            Form::Vary => {
                "a table { \"key.path\" = [values] } or { \"key.path\" = { from = …, to = … } }".into()
            }
            _ => allowed(&self.parameter, self.count()),
        }
    }

    fn only(mut self, kinds: &'static [&'static str]) -> Self {
        self.only = kinds;
        self
    }

    fn form(mut self, form: Form) -> Self {
        self.form = form;
        self
    }
}

impl From<Parameter> for Key {
    fn from(parameter: Parameter) -> Self {
        Self { parameter, form: Form::Plain, only: &[] }
    }
}

/// The strategies of this version.
pub const STRATEGIES: &[&str] = StrategyKind::NAMES;
/// The kinds of terrain of this version.
pub const TERRAIN_KINDS: &[&str] = TerrainChoice::NAMES;
/// Kinds of terrain that are made, not read.
const MADE: &[&str] = &["flat", "slope", "undulating", "crater"];
/// Colours of the ground on a page.
const GROUND_COLOURS: &[&str] = &["plain", "height", "sinkage", "slope"];
/// Cameras of a page.
pub const CAMERAS: &[&str] = &["follow", "side", "top", "front", "orbit"];
/// Layers of a page.
pub const LAYERS: &[&str] = &["forces", "torques", "centre", "support", "overlays", "hits", "ghost", "grid"];
/// How the points of a sweep are chosen.
pub const SWEEP_METHODS: &[&str] = &["grid", "latin-hypercube", "sobol", "table"];
/// Kinds of terrain that come from a file.
pub const READ: &[&str] = &["esri-ascii", "geotiff", "png"];

/// All reserved tables in the order of the documentation.
pub fn tables() -> Vec<Table> {
    vec![
        time(),
        world(),
        terrain(),
        gluing(),
        recording(),
        report(),
        page(),
        sweep(),
        task(),
        connect(),
        glue(),
        event(),
        fault(),
    ]
}

/// The reserved table of that name.
pub fn table(name: &str) -> Option<Table> {
    tables().into_iter().find(|t| t.name == name)
}

fn of(name: &'static str, help: &'static str, keys: Vec<Key>) -> Table {
    Table { name, repeated: false, required: false, help, keys }
}

fn time() -> Table {
    let keys = vec![
        number("step_s", "s", 0.001, "communication step h").positive().within_max(1e6).into(),
        required("duration_s", "s", "simulated time; a multiple of `step_s`").positive().into(),
        number("settle_s", "s", 0.0, "time before the start in which what touches the ground comes to rest")
            .within(0.0, 1e3)
            .into(),
    ];
    Table { required: true, ..of("time", "Duration and steps.", keys) }
}

fn world() -> Table {
    let gravity =
        Parameter { unit: "m/s^2".into(), ..list("gravity_m_s2", "gravity in the world frame, z up") };
    let seed = Parameter::of("seed", ParameterType::Integer, "seed of everything random");
    let keys = vec![
        Key::from(gravity.or(vec![0.0, 0.0, -9.81]).within(-1e4, 1e4)).form(Form::Count(3)),
        seed.or(1).within(0.0, f64::INFINITY).into(),
    ];
    of("world", "Properties of the world.", keys)
}

fn terrain() -> Table {
    let kind = Parameter::of("kind", ParameterType::Text, "shape").choices(TERRAIN_KINDS);
    let size =
        Parameter { unit: "m".into(), ..list("size_m", "extent along x and y, centred on the origin") };
    let spacing = required(
        "spacing_m",
        "m",
        "distance of lattice nodes; may be left out for a file, which keeps its own",
    );
    let waves = Parameter { unit: "m".into(), ..list("wavelengths_m", "shortest and longest wavelength") };
    let centre = Parameter { unit: "m".into(), ..list("centre_m", "centre of the crater") };
    let seed = Parameter::of("seed", ParameterType::Integer, "seed of the waves; `world.seed` where absent");
    let half_pi = std::f64::consts::FRAC_PI_2;
    let keys = vec![
        kind.into(),
        Key::from(size.positive()).form(Form::Count(2)).only(MADE),
        spacing.optional().positive().into(),
        Key::from(number("height_m", "m", 0.0, "height of the plane")).only(&["flat"]),
        Key::from(required("angle_rad", "rad", "angle against the horizontal").within(-half_pi, half_pi))
            .only(&["slope"]),
        Key::from(number("heading_rad", "rad", 0.0, "direction of steepest ascent, from +x"))
            .only(&["slope"]),
        Key::from(number("rms_m", "m", 0.015, "root mean square of the height").within(0.0, f64::INFINITY))
            .only(&["undulating"]),
        Key::from(waves.or(vec![0.3, 3.0]).positive()).form(Form::Count(2)).only(&["undulating"]),
        Key::from(seed.optional().within(0.0, f64::INFINITY)).only(&["undulating"]),
        Key::from(
            number("flat_radius_m", "m", 0.0, "radius around the origin blended to flat ground")
                .within(0.0, f64::INFINITY),
        )
        .only(&["undulating"]),
        Key::from(required("diameter_m", "m", "diameter from crest to crest").positive()).only(&["crater"]),
        Key::from(required("depth_m", "m", "depth of the floor below the crest").positive())
            .only(&["crater"]),
        Key::from(
            number("rim_height_m", "m", 0.0, "height of the crest above the plain")
                .within(0.0, f64::INFINITY),
        )
        .only(&["crater"]),
        Key::from(number("max_slope_rad", "rad", half_pi, "steepest slope of the shape").positive())
            .only(&["crater"]),
        Key::from(centre.or(vec![0.0, 0.0])).form(Form::Count(2)).only(&["crater"]),
        Key::from(Parameter::of("file", ParameterType::Path, "elevation file, relative to the scenario"))
            .only(READ),
        Key::from(
            Parameter::of(
                "fill_m",
                ParameterType::Number,
                "height that replaces missing data; refused when absent",
            )
            .optional(),
        )
        .only(READ),
        Key::from(required("pixel_m", "m", "distance of pixels").positive()).only(&["png"]),
        Key::from(number("low_m", "m", 0.0, "height of black pixels")).only(&["png"]),
        Key::from(required("high_m", "m", "height of white pixels")).only(&["png"]),
    ];
    of("terrain", "The ground at the start; built by the coordinator, owned by the soil from then on.", keys)
}

fn gluing() -> Table {
    let strategy = Parameter::of("strategy", ParameterType::Text, "how the groups are glued");
    let form = Parameter::of("form", ParameterType::Text, "form of the iteration (iterative only)");
    let start =
        Parameter::of("start", ParameterType::Text, "what the iteration starts from (iterative only)");
    let most =
        Parameter::of("max_iterations", ParameterType::Integer, "iterations before the step is halved");
    let mut keys = vec![
        strategy.or("cooperative").choices(STRATEGIES).into(),
        form.or("auto").choices(FormChoice::NAMES).into(),
        number("tolerance", "", 1e-8, "residual relative to the largest of weight and force")
            .positive()
            .within_max(1.0)
            .into(),
        most.or(20).within(1.0, 10_000.0).into(),
        Parameter::of("max_halvings", ParameterType::Integer, "halvings of a step before the run stops")
            .or(4)
            .within(0.0, 16.0)
            .into(),
        start.or("estimate").choices(StartChoice::NAMES).into(),
        Parameter::of("relaxation", ParameterType::Text, "how the fixed point is accelerated (relaxed only)")
            .or("anderson")
            .choices(Relaxation::NAMES)
            .into(),
        Parameter::of("jacobian", ParameterType::Text, "where the bodies' interface Jacobian comes from")
            .or("analytic")
            .choices(JacobianChoice::OFFERED)
            .into(),
    ];
    keys.extend(gluing_of_steps());
    of("gluing", "How subsystems are glued together.", keys)
}

/// Keys of `[gluing]` on the level of joints, the length of steps and contacts.
fn gluing_of_steps() -> Vec<Key> {
    vec![
        Parameter::of("level", ParameterType::Text, "level of the condition at joints")
            .or("position")
            .choices(LevelChoice::NAMES)
            .into(),
        number(
            "stabilisation",
            "",
            0.0,
            "share of the error taken out per step at velocity or acceleration level",
        )
        .within(0.0, 1.0)
        .into(),
        required(
            "energy_residual_j",
            "J",
            "tolerated energy residual of the interface per step: `time.step_s` is then the longest step",
        )
        .optional()
        .positive()
        .into(),
        required("step_min_s", "s", "shortest step under `energy_residual_j`; a hundredth of `time.step_s`")
            .optional()
            .positive()
            .into(),
        number(
            "contact_margin_m",
            "m",
            1e-3,
            "contacts are made when a shape can come this near in the step",
        )
        .within(0.0, f64::INFINITY)
        .into(),
    ]
}

fn recording() -> Table {
    let every = |name, help| Parameter::of(name, ParameterType::Integer, help).within(1.0, 1e9);
    let patterns =
        |name, help| Key::from(Parameter::of(name, ParameterType::Text, help).optional()).form(Form::Texts);
    let keys = vec![
        every("every_steps", "steps between two records of variables and poses").or(5).into(),
        every("ground_every_steps", "steps between two records of the ground that changed").or(100).into(),
        Parameter::of(
            "digits",
            ParameterType::Integer,
            "significant digits of recorded numbers; from 16 on all bits",
        )
        .or(9)
        .within(3.0, 17.0)
        .into(),
        patterns(
            "include",
            "variables or groups that are recorded, `robot.*.angle` or `robot.LF_j2`; all where absent",
        ),
        patterns("exclude", "variables or groups that are not"),
        Parameter::of(
            "overlays",
            ParameterType::Bool,
            "also what subsystems and the gluing show beside the bodies: pressure under feet, friction cones, footholds, …",
        )
        .or(false)
        .into(),
    ];
    of("recording", "Contents of `recording.mcap`.", keys)
}

fn report() -> Table {
    let text = |name, help| Parameter::of(name, ParameterType::Text, help).optional();
    let keys = vec![
        text("body", "`subsystem.body` of distance, roll and pitch; the first body of the first robot")
            .into(),
        text("commanded_speed", "`subsystem.variable` with the speed that is asked for, m/s; `gait.speed_reached` leaves out standing and ramp").into(),
        text("joint", "`subsystem.joint` whose torque, velocity and angle are plotted").into(),
    ];
    of("report", "Body and speed of the summary and the report.", keys)
}

fn page() -> Table {
    let text = |name, help| Parameter::of(name, ParameterType::Text, help).optional();
    let texts = |name, help| Key::from(text(name, help)).form(Form::Texts);
    let keys = vec![
        text("camera", "from where: follow, side, top, front, orbit; or with turn and height, rad, and distance, m: `side,-1.57,0.12,3`")
            .into(),
        text("ground", "colours of the ground; sinkage where absent").choices(GROUND_COLOURS).into(),
        texts("layers", "what is shown beside bodies and ground; contact forces, overlays, sensors and grid where absent"),
        texts("plots", "plots of the oscilloscope, each of variables with commas between: `robot.LF_j2.torque,robot.LM_j2.torque`; `a@b` is a over b"),
        text("select", "`subsystem.part` or `subsystem.variable` whose properties are shown").into(),
    ];
    of("page", "How the page of a run, its report, pictures and videos look at first.", keys)
}

fn sweep() -> Table {
    let whole = |name, help| Parameter::of(name, ParameterType::Integer, help);
    let text = |name, help| Parameter::of(name, ParameterType::Text, help);
    let keys = vec![
        text("method", "grid: every combination of the values; latin-hypercube and sobol: `points` points spread over the ranges (McKay et al., 1979; Sobol, 1967, scrambled after Owen, 1995); table: the rows of `table`")
            .or("grid")
            .choices(SWEEP_METHODS)
            .into(),
        whole("points", "of latin-hypercube and sobol: number of points").or(64).within(1.0, 1e6).into(),
        whole("seeds", "runs of each point, with `world.seed` = `seed`, `seed` + 1, …; 0: one run with the seed of the scenario")
            .or(0)
            .within(0.0, 1e6)
            .into(),
        whole("seed", "of the points, and first seed of the runs").or(1).within(0.0, 4e9).into(),
        Parameter::of("table", ParameterType::Path, "of method table: CSV whose titles are key paths, one row a point")
            .optional()
            .into(),
        Key::from(text("collect", "what the table of results has beside the usual figures: keys of `summary.json` (`energies.friction_j`) and variables at the end (`robot.trunk.x`)").optional())
            .form(Form::Texts),
        Key::from(
            Parameter::of("vary", ParameterType::NumberTable, "lists of values, or ranges, by key path as of `--set`: `\"gluing.strategy\" = [\"cooperative\", \"iterative\"]`, `\"terrain.angle_rad\" = { from = 0.0, to = 0.3, count = 7 }`; `log = true`: spread by their logarithm; `count` is of method grid")
                .optional(),
        )
        .form(Form::Vary),
    ];
    of("sweep", "Runs that differ in some keys, for `terraglue sweep`.", keys)
}

fn task() -> Table {
    let text = |name, help| Parameter::of(name, ParameterType::Text, help).optional();
    let texts = |name, help| Key::from(text(name, help)).form(Form::Texts);
    let keys = vec![
        texts(
            "observe",
            "variables that are observed, in their units; each `*` matches within one dotted part",
        ),
        texts("act", "variables that are set; each `*` matches within one dotted part"),
        list("low", "smallest value of each entry of `act`").optional().into(),
        list("high", "largest value of each entry of `act`").optional().into(),
        texts(
            "reward",
            "variables whose growth is rewarded, `robot.body.x`; their sum, at the end of an episode",
        ),
        texts(
            "cost",
            "variables whose growth the reward is divided by, `battery.energy`; where absent, the work of all drives, J",
        ),
        texts("tilt", "angles whose size beyond `fallen_rad` is a fall, which ends an episode with −1"),
        number("fallen_rad", "rad", 0.8, "see `tilt`").positive().into(),
        number("period_s", "s", 0.1, "time between two actions").positive().within_max(1e6).into(),
        required("duration_s", "s", "time of an episode; that of the run where absent")
            .optional()
            .positive()
            .into(),
    ];
    of("task", "An environment for learning, for `terraglue.gym` of the Python package.", keys)
}

fn connect() -> Table {
    let text = |name, help| Parameter::of(name, ParameterType::Text, help);
    let keys = vec![
        text("from", "`subsystem.variable`, an array or an element of one (`feet.position[2,1]`), or `subsystem.stream`; each `*` matches within one dotted part").into(),
        text("to", "the input, which takes bytes where `from` is a stream; its `*` take what matched in `from`").into(),
        number("factor", "", 1.0, "to = factor · from + offset, after the conversion of units").into(),
        number("offset", "", 0.0, "see `factor`").into(),
        Parameter::of("convert", ParameterType::Bool, "false: units are neither converted nor compared")
            .or(true)
            .into(),
        text("order", "structure: FMUs whose outputs depend on this input are stepped after the FMU that feeds it, so that the value is not late; jacobi: the input is the output of the start of the step; iterate: the FMUs of a loop repeat the step, where they can in four quarters, until the values in the middle and at the end are those that it was made with; iterate-ends: the same with the values at the end alone")
            .or("structure")
            .choices(ConnectionOrder::NAMES)
            .into(),
        text("extrapolate", "where the input is read at the start of a step: constant: held as it was read; linear: it follows the line through the last two values, with the mean over the step of the target, or the value at its end where outputs follow inputs at once; derivatives: the same along the derivative of the output that an FMU tells (`maxOutputDerivativeOrder`)")
            .or("constant")
            .choices(Extrapolate::NAMES)
            .into(),
        Key::from(
            Parameter::of(
                "map",
                ParameterType::NumberTable,
                "what each value becomes, of truth values, whole numbers and enumerations: `{ off = 0, on = 2 }`",
            )
            .optional(),
        )
        .form(Form::Map),
    ];
    Table { repeated: true, ..of("connect", "An output that feeds an input, once per step.", keys) }
}

fn glue() -> Table {
    let text = |name, help| Parameter::of(name, ParameterType::Text, help);
    let vector = |name, unit: &str, help| Parameter { unit: unit.into(), ..list(name, help).optional() };
    let bound =
        |name, help| Parameter { unit: "N".into(), ..Parameter::of(name, ParameterType::Number, help) };
    let sign = text("kind", "joint: bilateral; contact: side 2 only pushes, along `normal`");
    let keys = vec![
        text("side_1", "`subsystem.body` on which T acts").into(),
        text("side_2", "`subsystem.body` on which −T acts, or `world`").into(),
        sign.or("joint").choices(&["joint", "contact"]).into(),
        Key::from(vector(
            "at_m",
            "m",
            "world point that is glued, at the start; each body's own origin where absent",
        ))
        .form(Form::Count(3)),
        Key::from(text("components", "of a joint: x, y, z, rx, ry, rz; all where absent").optional())
            .form(Form::Texts),
        text("axes", "world: fixed axes; body: they turn with side 1")
            .or("world")
            .choices(&["world", "body"])
            .into(),
        Key::from(vector("normal", "", "of a contact, from side 2 to side 1").or(vec![0.0, 0.0, 1.0]))
            .form(Form::Count(3)),
        number("compliance_m_n", "m/N", 0.0, "of the glue itself: 1/stiffness of a spring")
            .within(0.0, f64::INFINITY)
            .into(),
        number("damping_n_s_m", "N s/m", 0.0, "of a damper beside that spring")
            .within(0.0, f64::INFINITY)
            .into(),
        bound("t_max_n", "largest normal force; side 2 yields there")
            .optional()
            .within(0.0, f64::INFINITY)
            .into(),
        number("mu", "", 0.0, "Coulomb coefficient of a contact; 0: the normal force only")
            .within(0.0, f64::INFINITY)
            .into(),
        number("ramp_s", "s", 0.0, "time in which a joint without compliance closes the gap between its points at the start; 0: there may be none")
            .within(0.0, f64::INFINITY)
            .into(),
        text("close", "what becomes of a gap between the points of a joint at the start: refuse; project: the free body of side 1, or else of side 2, is moved there with all that hangs on it")
            .or("refuse")
            .choices(&["refuse", "project"])
            .into(),
        text("strategy", "how all that is connected with this glue is glued; `gluing.strategy` where absent")
            .optional()
            .choices(STRATEGIES)
            .into(),
    ];
    Table {
        repeated: true,
        ..of("glue", "Two bodies glued together: a cut joint, or a contact known beforehand.", keys)
    }
}

fn event() -> Table {
    let text = |name, help| Parameter::of(name, ParameterType::Text, help).optional();
    let at = Parameter::of("at_s", ParameterType::Number, "simulated time; either this or `when`").optional();
    let set =
        Parameter::of("set", ParameterType::NumberTable, "new values by `\"subsystem.variable\"`").optional();
    let keys = vec![
        Key::from(Parameter { unit: "s".into(), ..at.within(0.0, f64::INFINITY) }),
        text("when", "a comparison, e.g. `robot.body.z < 0.1`; fires once").into(),
        Key::from(set).form(Form::Assignments),
        Key::from(text("act", "`subsystem.action`, e.g. `robot.LF_j2.break`")).form(Form::Texts),
    ];
    Table {
        repeated: true,
        ..of("event", "An event that occurs once: a failure, an operator's change.", keys)
    }
}

fn fault() -> Table {
    let text = |name, help| Parameter::of(name, ParameterType::Text, help);
    let seconds = |name, help| required(name, "s", help).within(0.0, f64::INFINITY);
    let value = required("value", "", "override: the value; offset: is added; gain: the factor");
    let keys = vec![
        text(
            "variable",
            "`subsystem.variable`: an output on all its connections, or an input; or `subsystem.stream`",
        )
        .into(),
        text("kind", "what is wrong with its number").choices(FaultChoice::NAMES).into(),
        Key::from(value).only(&["override", "offset", "gain"]),
        Key::from(required("rate_per_s", "", "what is added grows by this")).only(&["ramp"]),
        Key::from(required("delay_s", "s", "how old the number is").positive()).only(&["delay"]),
        Key::from(
            required(
                "probability",
                "",
                "of each step that the last number stays, of each message of a stream that it is lost",
            )
            .within(0.0, 1.0),
        )
        .only(&["drop-out"]),
        Key::from(
            required("deviation", "", "standard deviation of what is added").within(0.0, f64::INFINITY),
        )
        .only(&["noise"]),
        seconds("at_s", "when it begins; either this or `when`").optional().into(),
        text("when", "a comparison, e.g. `robot.body.z < 0.1`, at which it begins").optional().into(),
        seconds("until_s", "when it ends; the end of the run where nothing says so").optional().into(),
        text("until", "a comparison at which it ends").optional().into(),
        seconds("for_s", "how long it lasts").optional().into(),
        Parameter::of("seed", ParameterType::Integer, "of noise and drop-outs; by `world.seed` where absent")
            .optional()
            .within(0.0, f64::INFINITY)
            .into(),
    ];
    Table { repeated: true, ..of("fault", "A signal fault, once, for a limited time.", keys) }
}

/// Keys of the host in the table of a subsystem; everything else there is a parameter of the module.
pub fn subsystem_keys() -> Vec<Key> {
    let multiple = "steps of the testbed per step of this subsystem; 1 for what is glued";
    let module = "a module's name, or the path of a library or of a file in Python relative to the scenario";
    let python = "interpreter of a module in Python; by default $VIRTUAL_ENV/bin/python, else python3";
    let build = "command that builds the module, run by `run --watch` in the scenario's folder on a change of its sources";
    let sources =
        "files and folders that `build` depends on; where absent, the sources below the scenario's folder";
    let fmu = "a functional mock-up unit instead of a module; other keys are its start values, `on_nan`, `event_mode`, `rollback`, and \
                `bodies`, what of it can be glued (docs/fmi.md)";
    let row = "a row of the soil table, or a soil file (.toml), whose numbers are offered to the module";
    vec![
        Parameter::of("module", ParameterType::Text, module).into(),
        Parameter::of("fmu", ParameterType::Path, fmu).optional().into(),
        Parameter::of("step_multiple", ParameterType::Integer, multiple).or(1).within(1.0, 1e6).into(),
        Parameter::of(
            "isolate",
            ParameterType::Bool,
            "in a process of its own: a crash or a hang is an error",
        )
        .or(false)
        .into(),
        number("load_timeout_s", "s", 60.0, "longest time to load it, where isolated or in Python")
            .within(1e-3, 1e7)
            .into(),
        number("step_timeout_s", "s", 30.0, "longest time of one call, where isolated or in Python")
            .within(1e-3, 1e7)
            .into(),
        number("memory_mb", "", 8192.0, "most memory of its process in MiB, where isolated or in Python")
            .within(16.0, 1e9)
            .into(),
        Parameter::of("python", ParameterType::Text, python).optional().into(),
        Parameter::of("build", ParameterType::Text, build).optional().into(),
        Key::from(Parameter::of("sources", ParameterType::Text, sources).optional()).form(Form::Texts),
        Parameter::of("parameters", ParameterType::Text, row).optional().into(),
        Parameter::of("parameters_file", ParameterType::Path, "soil table other than `models/soils.csv`")
            .optional()
            .into(),
    ]
}

fn number(name: &str, unit: &str, default: f64, help: &str) -> Parameter {
    Parameter::number(name, unit, default, help)
}

fn required(name: &str, unit: &str, help: &str) -> Parameter {
    Parameter { unit: unit.into(), ..Parameter::of(name, ParameterType::Number, help) }
}

fn list(name: &str, help: &str) -> Parameter {
    Parameter::of(name, ParameterType::Numbers, help)
}

/// An upper bound beside an exclusive lower one.
trait WithinMax {
    fn within_max(self, max: f64) -> Self;
}

impl WithinMax for Parameter {
    fn within_max(self, max: f64) -> Self {
        Self { max: Some(max), ..self }
    }
}
