//! The arguments and their help.

use crate::locate::arguments::LocateArguments;
use crate::scenario_arguments::{ScenarioArguments, parse_folder, parse_set};
use crate::serve_arguments::ServeArguments;
use crate::shot_arguments::ShotArguments;
use crate::sweep_arguments::SweepArguments;
use crate::video_arguments::VideoArguments;
use clap::builder::ArgPredicate;
use clap::{Args, Parser, Subcommand};
use std::path::PathBuf;
use terraglue_fmu::OnNan;
use terraglue_scaffold::{Kind, Language};

/// Simulates robots on deformable ground: rigid bodies, soils and controllers, glued into one run.
#[derive(Parser, Debug)]
#[command(name = "terraglue", version = terraglue_checkpoint::VERSION, after_help = EXAMPLES, disable_help_subcommand = true)]
pub struct Arguments {
    /// Command to run.
    #[command(subcommand)]
    pub command: Command,
}

const EXAMPLES: &str = "\
Examples:
  terraglue run scenarios/moon_walk.toml
  terraglue run scenarios/moon_walk.toml --set soil.module=soil-bekker \\
      --out runs/bekker
  terraglue compare scenarios/moon_walk.toml --strategies cooperative,iterative
  terraglue variables scenarios/moon_walk.toml

Exit codes: 0 done, 1 the simulation or a check failed, 2 the input is wrong, 75 another process does it, 130 interrupted.
TERRAGLUE_LOG=info shows which modules are loaded and what they say; TERRAGLUE_MODULE_PATH adds folders with modules.";

/// The commands.
#[derive(Subcommand, Debug)]
pub enum Command {
    /// Run a scenario and write recording, summary and report.
    Run(RunCommand),
    /// Run a scenario with several strategies and soils and put them side by side.
    Compare(CompareArguments),
    /// Run a scenario many times with values that a plan varies, and put the results into one table and page.
    Sweep(SweepArguments),
    /// Make the report of a recording again, also of one that was cut off.
    Report {
        /// Folder of the run, e.g. runs/moon_walk.
        #[arg(value_name = "DIR")]
        folder: PathBuf,
        /// Also write the points of all scanners, in the world, as LAS or LAZ.
        #[arg(long, value_name = "FILE")]
        points: Option<PathBuf>,
    },
    /// Show a run on a page while it goes on: look, change it, go back in it; or replay a recording. Viewers of the Foxglove
    /// WebSocket protocol connect to the same address.
    Serve(ServeArguments),
    /// Take a picture of a run at a time, in a browser that is found on this machine.
    Shot(ShotArguments),
    /// Make a video of a run, picture by picture in simulated time, with a browser that is found on this machine.
    Video(VideoArguments),
    /// Check a scenario and everything that it refers to, without a step of it; modules and FMUs are made.
    Check(CheckArguments),
    /// Put a module to the test: named tests of what it promises, each in a process of its own.
    CheckModule(CheckModuleArguments),
    /// List the modules that are found, without running them; with a name, show its parameters.
    Modules {
        /// Show this module with its parameters: its name, or the path of its file. A part of names lists those, as does a pattern
        /// with `*`.
        #[arg(value_name = "PATTERN")]
        name: Option<String>,
        /// Search this folder first; may be repeated.
        #[arg(long, value_name = "DIR", value_parser = parse_folder)]
        module_path: Vec<PathBuf>,
        /// Print JSON instead of a table.
        #[arg(long)]
        json: bool,
        /// Load it here and show its parameters only.
        #[arg(long, hide = true)]
        asked: bool,
    },
    /// List the variables and actions of a scenario's subsystems.
    Variables(VariablesArguments),
    /// Run, show or check a functional mock-up unit (FMI 2.0 and 3.0, co-simulation).
    #[command(subcommand)]
    Fmu(FmuCommand),
    /// Write a module or a scenario as a functional mock-up unit for other programs.
    Export(ExportArguments),
    /// Write a system structure (SSP, .ssp or .ssd) as a scenario; `run` takes one as it is.
    Convert(ConvertArguments),
    /// Serve an isolated subsystem; started by `run` itself.
    #[command(hide = true)]
    Worker {
        /// Shared memory of the host.
        segment: PathBuf,
    },
    /// Make the folder of a new module that builds and runs at once.
    New(NewArguments),
    /// Find the parameters of a soil from plate tests.
    FitSoil(FitSoilArguments),
    /// Find where a laser scanner stands among the trees of a map; that it is ambiguous or lost is an answer, too.
    Locate(LocateArguments),
    /// Show a robot file as it would be simulated: bodies, joints, mass, inertia, warnings.
    Robot(RobotArguments),
    /// List the soils that a scenario can name, and those that are refused with the reason.
    Soils {
        /// Everything about this one; a part of names lists those, as does a pattern with `*`.
        #[arg(value_name = "PATTERN")]
        name: Option<String>,
        /// Another soil table.
        #[arg(long, value_name = "CSV")]
        file: Option<PathBuf>,
        /// Print JSON instead of a table.
        #[arg(long)]
        json: bool,
    },
}

/// Arguments of `variables`.
#[derive(Args, Debug, Clone)]
pub struct VariablesArguments {
    /// The scenario.
    #[command(flatten)]
    pub scenario: ScenarioArguments,
    /// Only names with this in them, or that match it: robot.*.max_torque; a `*` is a part of a name between dots, or a piece of one.
    pub pattern: Option<String>,
    /// Print JSON instead of columns.
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `check`.
#[derive(Args, Debug, Clone)]
pub struct CheckArguments {
    /// The scenario.
    #[command(flatten)]
    pub scenario: ScenarioArguments,
    /// Refuse robot files that have a warning: `strict = true` in the table of every robot.
    #[arg(long)]
    pub strict: bool,
}

/// Arguments of `run` and `compare`.
#[derive(Args, Debug, Clone)]
pub struct RunArguments {
    /// The scenario.
    #[command(flatten)]
    pub scenario: ScenarioArguments,
    /// Folder for the results [default: runs/<scenario>; of `compare` runs/<scenario>-compare]. An earlier run there is renamed
    /// to DIR.1, DIR.2, …; a folder with other files is refused.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Simulated time in seconds, instead of the scenario's.
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    pub duration: Option<String>,
    /// Threads for the loops inside modules; 0: one per core. Results do not depend on it.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = thread_count, allow_negative_numbers = true)]
    pub threads: usize,
    /// Also write variables.csv.
    #[arg(long)]
    pub csv: bool,
    /// No progress bar, no table.
    #[arg(long)]
    pub quiet: bool,
    /// Print the summary as JSON on standard output, and nothing else there.
    #[arg(long)]
    pub json: bool,
}

/// Placeholder for the scenario of a run that is resumed; the checkpoint contains it.
const AS_KEPT: &str = "as kept with the checkpoint";

/// Arguments of `run`.
#[derive(Args, Debug, Clone)]
#[command(after_help = RUN_EXAMPLES)]
#[command(mut_arg("scenario", |a| a.required(false).required_unless_present("resume")
    .default_value_if("resume", ArgPredicate::IsPresent, AS_KEPT)))]
pub struct RunCommand {
    /// As for `compare`.
    #[command(flatten)]
    pub run: RunArguments,
    /// Say how values go round: the order of a step, every connection with its units and delay, loops; after the run what
    /// each subsystem cost. The report shows the same.
    #[arg(long)]
    pub explain: bool,
    /// Go no faster than the clock; results do not depend on it.
    #[arg(long)]
    pub realtime: bool,
    /// Show the run on a page while it goes on, as `terraglue serve` does; the address is printed.
    #[arg(long, conflicts_with_all = ["resume", "checkpoint_every", "watch", "csv", "explain", "no_report"])]
    pub serve: bool,
    /// Write recording and summary only; `terraglue report DIR` makes the report later.
    #[arg(long)]
    pub no_report: bool,
    /// Also write the points of all scanners, in the world, as LAS or LAZ (scan.laz).
    #[arg(long, value_name = "FILE", conflicts_with = "serve")]
    pub points: Option<PathBuf>,
    /// Refuse robot files that have a warning: `strict = true` in the table of every robot.
    #[arg(long)]
    pub strict: bool,
    /// Keep the whole state so often, in simulated time (5, 5s, 500ms, 2min), in DIR/checkpoint.bin; it is also kept where
    /// Ctrl-C stops the run. Results do not depend on it.
    #[arg(long, value_name = "TIME", value_parser = simulated_time, allow_negative_numbers = true, conflicts_with = "watch")]
    pub checkpoint_every: Option<f64>,
    /// Go on from the last checkpoint of the run in this folder, with its scenario, to the same bytes as without the break.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["scenario", "sets", "out", "duration", "csv", "strict", "watch"])]
    pub resume: Option<PathBuf>,
    /// Watch the files of modules, and exchange their code while the run goes on.
    #[arg(long)]
    pub watch: bool,
    /// Start a subsystem afresh with its new code instead of carrying its state over.
    #[arg(long, requires = "watch")]
    pub reload_reset: bool,
    /// Exchange this subsystem before this step, changed or not. May be repeated.
    #[arg(long, value_name = "NAME=STEP", requires = "watch", hide = true, value_parser = parse_set)]
    pub reload_at: Vec<(String, String)>,
}

const RUN_EXAMPLES: &str = "\
Examples:
  terraglue run scenarios/moon_walk.toml --duration 60 --checkpoint-every 5s --out runs/long
  terraglue run --resume runs/long      after a crash, a kill or Ctrl-C: the files end as if nothing had happened";

/// Multiples of shorter times cannot be distinguished in a long run, s.
const SHORTEST_S: f64 = 1e-6;

/// A time in seconds, or with a unit.
fn simulated_time(text: &str) -> Result<f64, String> {
    const UNITS: [(&str, f64); 4] = [("ms", 1e-3), ("min", 60.0), ("h", 3600.0), ("s", 1.0)];
    let unit = UNITS.iter().find_map(|(unit, s)| Some((text.strip_suffix(unit)?, s)));
    let (number, unit_s) = unit.unwrap_or((text, &1.0));
    let seconds = number.trim().parse::<f64>().ok().map(|x| x * unit_s);
    let seconds = seconds.filter(|x| x.is_finite() && *x >= SHORTEST_S);
    seconds.ok_or_else(|| "a time of a microsecond at least is wanted: 5, 5s, 500ms, 2min or 1h".to_owned())
}

/// Arguments of `convert`.
#[derive(Args, Debug, Clone)]
pub struct ConvertArguments {
    /// The structure, or a scenario of FMUs.
    #[arg(value_name = "SYSTEM.ssp|.ssd|SCENARIO.toml")]
    pub structure: PathBuf,
    /// The scenario to write [default: the structure's name with .toml, beside it]; the FMUs of an archive go into a
    /// folder of the same name. Of a scenario: the archive to write.
    #[arg(short, long, value_name = "FILE.toml|.ssp")]
    pub output: Option<PathBuf>,
}

/// Arguments of `export`.
#[derive(Args, Debug, Clone)]
#[command(after_help = EXPORT_EXAMPLES)]
pub struct ExportArguments {
    /// A scenario file (TOML) or the name of a module.
    #[arg(value_name = "MODULE|SCENARIO")]
    pub target: String,
    /// The FMU to write [default: the name of the module or scenario, here].
    #[arg(short, long, value_name = "FILE.fmu")]
    pub output: Option<PathBuf>,
    /// Version of the standard.
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u8).range(2..=3))]
    pub fmi: u8,
    /// Show arrays element by element in FMI 3 too; FMI 2 has no arrays.
    #[arg(long)]
    pub scalars: bool,
    /// Edit the scenario before it is exported; a bare word is text. May be repeated.
    #[arg(long = "set", value_name = "KEY.PATH=VALUE", value_parser = parse_set)]
    pub sets: Vec<(String, String)>,
    /// Author in the description.
    #[arg(long, value_name = "TEXT")]
    pub author: Option<String>,
    /// Version of the model in the description.
    #[arg(long, value_name = "TEXT")]
    pub model_version: Option<String>,
    /// Date and time in the description, as in 2026-11-27T12:00:00Z [default: SOURCE_DATE_EPOCH, else none, so that the same input
    /// gives the same bytes].
    #[arg(long, value_name = "TIME", value_parser = super::words::parse_time)]
    pub date: Option<String>,
    /// Leave out the results of its first steps, which `fmu check --run` compares with.
    #[arg(long)]
    pub no_reference: bool,
    /// Search this folder for modules first; may be repeated.
    #[arg(long, value_name = "DIR", value_parser = parse_folder)]
    pub module_path: Vec<PathBuf>,
}

const EXPORT_EXAMPLES: &str = "\
Examples:
  terraglue export soil-bekker -o soil.fmu --set soil.parameters=LETE_sand \\
      --set foot.count=6
  terraglue export rigid-body -o robot.fmu --fmi 2 \\
      --set robot.model=models/hexapod.urdf
  terraglue export scenarios/moon_walk.toml -o walk.fmu

A module is exported inside a small scenario: [time], [world], and [robot], [unit] or, for a soil, [soil] with
[terrain], [gluing] and [foot] (count, shape, radius_m, half_extents_m, …). --set changes any key of it.";

/// Arguments of `check-module`.
#[derive(Args, Debug, Clone)]
pub struct CheckModuleArguments {
    /// File of the module (lib…_plugin.so, ….py), a folder that holds one, or a name that `terraglue modules` lists.
    #[arg(required_unless_present = "list")]
    pub path: Option<PathBuf>,
    /// How much is tried: quick, standard or thorough.
    #[arg(long, default_value = "standard", value_parser = super::words::level)]
    pub level: terraglue_conformance::Level,
    /// Run this test only. May be repeated.
    #[arg(long, value_name = "NAME")]
    pub only: Vec<String>,
    /// Seed of everything random.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// A parameter of the module. May be repeated.
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = parse_set)]
    pub sets: Vec<(String, String)>,
    /// Also write the results as JSON.
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Also write the results as JUnit's XML.
    #[arg(long, value_name = "FILE")]
    pub junit: Option<PathBuf>,
    /// Processes at a time [default: one per core].
    #[arg(long, value_name = "N", value_parser = process_count, allow_negative_numbers = true)]
    pub jobs: Option<std::num::NonZeroUsize>,
    /// Time that a test may take, s.
    #[arg(long, value_name = "S", default_value_t = 30.0, value_parser = super::words::seconds)]
    pub time_limit: f64,
    /// Run in this process, for a debugger.
    #[arg(long)]
    pub in_process: bool,
    /// List the tests.
    #[arg(long)]
    pub list: bool,
    /// Build the sources of a module in C or C++ with the compiler's sanitizers instead, and report findings of the tests.
    #[arg(long)]
    pub sanitize: bool,
    /// A source for --sanitize [default: those beside the module]. May be repeated.
    #[arg(long = "source", value_name = "FILE", requires = "sanitize")]
    pub sources: Vec<PathBuf>,
    /// Where a test in this process writes its result.
    #[arg(long, value_name = "FILE", hide = true)]
    pub result: Option<PathBuf>,
    /// A run whose bits are wanted: FROM,TO,VARIANT.
    #[arg(long, hide = true)]
    pub remote_run: Option<String>,
    /// File with the state that a remote run starts from.
    #[arg(long, hide = true)]
    pub state: Option<PathBuf>,
}

/// Arguments of `robot`.
#[derive(Args, Debug, Clone)]
pub struct RobotArguments {
    /// URDF, xacro or MJCF.
    #[arg(value_name = "FILE")]
    pub file: PathBuf,
    /// A root without mass is the world.
    #[arg(long)]
    pub fixed_base: bool,
    /// Folder of a package that the file names by `package://`. May be repeated.
    #[arg(long = "package", value_name = "NAME=DIR", value_parser = parse_package)]
    pub packages: Vec<(String, String)>,
    /// Refuse a file that has a warning.
    #[arg(long)]
    pub strict: bool,
    /// Print JSON and nothing else.
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `new`.
#[derive(Args, Debug, Clone)]
#[command(after_help = NEW_EXAMPLES)]
pub struct NewArguments {
    /// Kind of the module to make, or `scenario`.
    #[arg(value_parser = one_of(New::ALL, New::word))]
    pub kind: New,
    /// Name of the module and of its folder, e.g. my-soil; of a scenario: its folder [default: as the robot file].
    #[arg(required_unless_present = "robot")]
    pub name: Option<String>,
    /// Language [default: rust; a law: scenario].
    #[arg(long, value_parser = one_of(Language::ALL, Language::word))]
    pub lang: Option<Language>,
    /// Of a scenario: the robot in it (URDF, xacro or MJCF).
    #[arg(long, value_name = "FILE")]
    pub robot: Option<PathBuf>,
    /// Of a scenario: the folder for it.
    #[arg(short, long, value_name = "DIR", requires = "robot", conflicts_with = "name")]
    pub output: Option<PathBuf>,
}

const NEW_EXAMPLES: &str = "\
Examples:
  terraglue new soil my-soil --lang c
  terraglue new scenario --robot my.urdf -o my-moon     it stands on the Moon";

/// Kinds that `new` makes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum New {
    /// A module.
    Module(Kind),
    /// A scenario around a robot.
    Scenario,
}

impl New {
    const ALL: [Self; 6] = [
        Self::Module(Kind::Soil),
        Self::Module(Kind::Robot),
        Self::Module(Kind::Controller),
        Self::Module(Kind::Law),
        Self::Module(Kind::Sensor),
        Self::Scenario,
    ];

    fn word(self) -> &'static str {
        match self {
            Self::Module(kind) => kind.word(),
            Self::Scenario => "scenario",
        }
    }
}

/// Takes the word of one of a few values.
fn one_of<T: Copy + Send + Sync + 'static, const N: usize>(
    all: [T; N],
    word: fn(T) -> &'static str,
) -> impl clap::builder::TypedValueParser<Value = T> {
    use clap::builder::TypedValueParser;
    clap::builder::PossibleValuesParser::new(all.map(word)).map(move |text| {
        // The parser before has admitted these words only.
        all.into_iter().find(|value| word(*value) == text).unwrap_or(all[0])
    })
}

/// Arguments of `fit-soil`.
#[derive(Args, Debug, Clone)]
#[command(after_help = FIT_EXAMPLES)]
pub struct FitSoilArguments {
    /// Plate tests: columns sinkage_mm, pressure_kPa and plate_diam_mm or b_mm (also in m); equal cells in the other
    /// columns make one press.
    pub data: PathBuf,
    /// The data are those of a driven wheel instead: columns slip, sinkage_mm (or in m), DP_N and Fz_N. Fitted are Bekker's law,
    /// Ding's slip sinkage and the shear at the rim.
    #[arg(long, value_name = "radius=M,width=M[,load=N]", value_parser = terraglue_soil_fit::parse_wheel)]
    pub wheel: Option<terraglue_soil_fit::Wheel>,
    /// Pressure-sinkage law: bekker, reece, bearing, or a law that is a module, by its name or the path of its file.
    #[arg(long, default_value = "bearing")]
    pub law: String,
    /// Write the soil here, for `parameters = "soil.toml"` in a scenario, and a drawing beside it (.svg).
    #[arg(long, value_name = "TOML")]
    pub out: Option<PathBuf>,
    /// Tests that the fit does not see: how well are they predicted?
    #[arg(long, value_name = "CSV")]
    pub predict: Option<PathBuf>,
    /// Leave out what lies above this sinkage, mm: the plate is not seated yet.
    #[arg(long, value_name = "MM", default_value_t = 3.0, allow_negative_numbers = true)]
    pub from_mm: f64,
    /// Row of the soil table that gives cohesion, friction, shear modulus and density.
    #[arg(long, value_name = "NAME")]
    pub soil: Option<String>,
    /// Cohesion, Pa; needed for reece and bearing.
    #[arg(long, value_name = "PA")]
    pub cohesion_pa: Option<f64>,
    /// Angle of internal friction, degrees.
    #[arg(long, value_name = "DEG")]
    pub phi_deg: Option<f64>,
    /// Shear deformation modulus K, m.
    #[arg(long, value_name = "M")]
    pub shear_m: Option<f64>,
    /// Bulk density, kg/m³; needed for reece and bearing.
    #[arg(long, value_name = "KG_M3")]
    pub density: Option<f64>,
    /// Print JSON and nothing else.
    #[arg(long)]
    pub json: bool,
}

const FIT_EXAMPLES: &str = "\
Example:
  terraglue fit-soil plates.csv --law bearing --density 1330 --cohesion-pa 1000 \\
      --out soil.toml --predict other.csv
  terraglue fit-soil wheel.csv --wheel radius=0.058,width=0.05 \\
      --soil CMU_Direct90_s0 --out soil.toml

The error is the root of the mean square of ln(p/p_measured). b is the radius of a disc or the short side of a
rectangle. Confidence intervals: whole presses are left out in turn.";

/// Arguments of `compare`.
#[derive(Args, Debug, Clone)]
#[command(after_help = COMPARE_EXAMPLES)]
pub struct CompareArguments {
    /// As for `run`.
    #[command(flatten)]
    pub run: RunArguments,
    /// Strategies, separated by commas [default: all; with --vary that of the scenario].
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    pub strategies: Vec<String>,
    /// Soil modules, separated by commas [default: that of the scenario].
    #[arg(long, value_delimiter = ',', value_name = "MODULES")]
    pub soils: Vec<String>,
    /// Values of any key that --set takes, separated by commas, e.g. rows of the soil table: soil.parameters=LETE_sand,…; may be
    /// repeated: every combination runs.
    #[arg(long, value_name = "KEY.PATH=VALUES", value_parser = parse_vary)]
    pub vary: Vec<(String, Vec<String>)>,
    /// Communication steps in seconds, separated by commas [default: that of the scenario].
    #[arg(long, value_delimiter = ',', value_name = "SECONDS", allow_negative_numbers = true)]
    pub steps: Vec<f64>,
    /// Print all figures, not only the main ones.
    #[arg(long, visible_alias = "all")]
    pub details: bool,
    /// Compare the path of the reported body with this: a strategy, e.g. `monolithic`, run on each soil (of several
    /// steps with an eighth of the smallest), or the folder or .mcap file of an earlier run of the same scenario.
    #[arg(long, value_name = "STRATEGY|FOLDER|FILE")]
    pub reference: Option<String>,
    /// Step of the reference in seconds; a smaller one takes longer and leaves less of its own error in the order.
    #[arg(long, value_name = "SECONDS", requires = "reference", allow_negative_numbers = true)]
    pub reference_step: Option<f64>,
}

const COMPARE_EXAMPLES: &str = "\
Example:
  terraglue compare scenarios/moon_walk.toml --strategies cooperative,iterative \\
      --soils soil-cellular-automaton,soil-bekker
  terraglue compare scenarios/moon_walk.toml \\
      --vary soil.parameters=lunar_nominal_Apollo,LETE_sand \\
      --vary gait.speed_m_s=0.1,0.2
  terraglue compare scenarios/moon_walk.toml --duration 1 \\
      --steps 5e-4,1e-3,2e-3 --reference monolithic

Writes compare.html, compare.csv and compare.json, and each run into a folder of its own beside them.";

impl RunArguments {
    /// The edits, `--duration` among them.
    pub fn sets(&self) -> Vec<(String, String)> {
        let duration = self.duration.iter().map(|s| ("time.duration_s".to_owned(), s.clone()));
        self.scenario.sets.iter().cloned().chain(duration).collect()
    }
}

/// Most threads or processes that can be asked for.
const MOST_THREADS: usize = 1024;

fn thread_count(text: &str) -> Result<usize, String> {
    let number = text.parse().ok().filter(|n| *n <= MOST_THREADS);
    number.ok_or_else(|| format!("a whole number from 0 (one per core) to {MOST_THREADS} is wanted"))
}

fn process_count(text: &str) -> Result<std::num::NonZeroUsize, String> {
    let number = text.parse().ok().filter(|n: &std::num::NonZeroUsize| n.get() <= MOST_THREADS);
    number.ok_or_else(|| format!("a whole number from 1 to {MOST_THREADS} is wanted"))
}

fn parse_package(text: &str) -> Result<(String, String), String> {
    let (name, folder) =
        terraglue_scenario::split_set(text).ok_or_else(|| "there is no `=`: write NAME=DIR".to_owned())?;
    match std::path::Path::new(&folder).is_dir() {
        true => Ok((name, folder)),
        false => Err(format!("there is no folder `{folder}`: name the folder of the package `{name}`")),
    }
}

/// A key path and its values; a comma within brackets or quotes parts none.
fn parse_vary(text: &str) -> Result<(String, Vec<String>), String> {
    let (key, all) = parse_set(text)?;
    let (mut values, mut depth, mut quote) = (vec![String::new()], 0_i32, None);
    for c in all.chars() {
        match (c, quote) {
            ('"' | '\'', None) => quote = Some(c),
            (c, Some(open)) if c == open => quote = None,
            ('[' | '{', None) => depth += 1,
            (']' | '}', None) => depth -= 1,
            (',', None) if depth == 0 => {
                values.push(String::new());
                continue;
            }
            _ => {}
        }
        if let Some(last) = values.last_mut() {
            last.push(c);
        }
    }
    let values: Vec<String> = values.iter().map(|v| v.trim().to_owned()).collect();
    match values.iter().any(String::is_empty) {
        true => Err("a value is empty: write KEY.PATH=A,B,C".into()),
        false => Ok((key, values)),
    }
}

/// Commands for a functional mock-up unit.
#[derive(Subcommand, Debug)]
pub enum FmuCommand {
    /// Run an FMU alone and write its outputs as a table.
    Run(FmuRunArguments),
    /// Show what is inside an FMU of any version; none of its code runs.
    Info {
        /// The FMU.
        fmu: PathBuf,
        /// Print JSON instead of tables.
        #[arg(long)]
        json: bool,
    },
    /// List what is wrong with an FMU; none of its code runs without --run.
    Check {
        /// The FMU.
        fmu: PathBuf,
        /// Also run the default experiment, and hold it against the results that the FMU brings with it (FMI-LS-REF).
        #[arg(long)]
        run: bool,
        /// Largest difference from these results that passes, as a share of the range of each output.
        #[arg(long, value_name = "SHARE", default_value_t = 0.01, value_parser = positive, requires = "run")]
        within: f64,
    },
}

/// Arguments of `fmu run`.
#[derive(Args, Debug, Clone)]
pub struct FmuRunArguments {
    /// The FMU.
    pub fmu: PathBuf,
    /// Write the table here [default: standard output].
    #[arg(long, value_name = "FILE")]
    pub csv: Option<PathBuf>,
    /// Inputs over time: a header with `time` and names, straight lines between the rows. Elements of arrays of Float64 may have
    /// columns of their own (`u[2]`); whole arrays are written with spaces between their values. FMUs that can follow inputs within steps do so.
    #[arg(long, value_name = "FILE")]
    pub input: Option<PathBuf>,
    /// Hold inputs over each step, also of FMUs that can follow them within (FMI 3: intermediate update; FMI 2: canInterpolateInputs).
    #[arg(long)]
    pub hold_inputs: bool,
    /// Do not save the state of the FMU before a step: one that the FMU discards cannot be halved then.
    #[arg(long)]
    pub no_rollback: bool,
    /// Write what the FMU shows at its inner steps here (FMI 3, intermediate update).
    #[arg(long, value_name = "FILE")]
    pub intermediate: Option<PathBuf>,
    /// A start value. May be repeated.
    #[arg(long = "start", value_name = "NAME=VALUE", value_parser = parse_set)]
    pub start: Vec<(String, String)>,
    /// Time at the start, s [default: that of the FMU, else 0].
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    pub start_time: Option<f64>,
    /// Time at the end, s [default: that of the FMU, else 1].
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    pub stop: Option<f64>,
    /// Communication step, s [default: that of the FMU, else a 500th of the run].
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    pub step: Option<f64>,
    /// Relative tolerance [default: that of the FMU].
    #[arg(long, value_parser = positive, allow_negative_numbers = true)]
    pub tolerance: Option<f64>,
    /// Switch categories of its own log on, separated by commas; `all` for all of them. `fmu info` lists them.
    #[arg(long, value_delimiter = ',', value_name = "CATEGORIES")]
    pub log_categories: Vec<String>,
    /// Refuse an FMU whose description contradicts the standard, instead of warning.
    #[arg(long)]
    pub strict: bool,
    /// Write every call of the FMU here before it is made, with its values by reference and its status.
    #[arg(long, value_name = "FILE")]
    pub trace: Option<PathBuf>,
    /// What a value that is NaN or infinite does: it stops the run, or is warned of once and written.
    #[arg(long, value_name = "stop|warn", default_value = "stop", value_parser = on_nan)]
    pub on_nan: OnNan,
    /// Names to write, separated by commas [default: all outputs].
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    pub output: Vec<String>,
    /// Run it in a process of its own: a crash, a hang or an `exit` is an error. Advised for an FMU that was never run before: its code
    /// is trusted otherwise.
    #[arg(long)]
    pub isolate: bool,
    /// Longest time from one row to the next where it is isolated, s.
    #[arg(long, value_name = "S", default_value_t = 30.0, value_parser = positive, allow_negative_numbers = true)]
    pub timeout: f64,
    /// Most memory where it is isolated, MiB.
    #[arg(long, value_name = "MIB", default_value_t = 8192, value_parser = clap::value_parser!(u64).range(16..=1_000_000_000))]
    pub memory_mb: u64,
    /// Handle events in event mode (FMI 3).
    #[arg(long, value_name = "on|off", action = clap::ArgAction::Set, default_value = "off",
          value_parser = clap::builder::BoolishValueParser::new(), hide_possible_values = true)]
    pub event_mode: bool,
}

/// As the key `on_nan` of an FMU in a scenario.
fn on_nan(text: &str) -> Result<OnNan, String> {
    OnNan::of(text).ok_or_else(|| "stop or warn is wanted".to_owned())
}

/// A finite number above 0.
fn positive(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|x: &f64| x.is_finite() && *x > 0.0);
    number.ok_or_else(|| "a number above 0 is wanted".to_owned())
}
