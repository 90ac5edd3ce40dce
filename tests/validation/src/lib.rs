//! `cargo xtask validate`: the figures that each area promises, measured and held against their limits.
//!
//! One line per figure, tab-separated: `id value limit pass|fail|info|skip what`; `info` has no limit or is not judged. A failure that
//! `tests/known-failures.tsv` (id, figure reached, limit, bound, reason) lists is tolerated up to its bound; a listed one that passes is
//! not. A value thirty times worse than in `tests/figures.tsv` fails within its limit. Figures that a clock measures are judged
//! under `--timing` only. The full table of a run is in `target/validation.md`.

mod documents;
mod faults;
mod figure;
mod fmi;
mod forest;
mod gluing;
mod known;
mod page;
mod parallel;
mod plugins;
mod process;
mod rigid_body;
mod soil;
mod stored;
mod sweep;
mod table;
mod timing;
mod walk;
mod watched;
mod world;

pub use faults::write_page as write_faults_page;
pub use figure::{Figure, Limit};
pub use page::write_page as write_summary_page;
pub use soil::print_hash as print_soil_hash;
use table::columns;

use known::KnownFailures;
use process::{Outcome, cargo, must, program};
use std::io::IsTerminal;
use std::path::PathBuf;
use stored::StoredFigures;

/// Areas and options of a validation.
#[derive(clap::Args, Debug, Clone, Default)]
pub struct Arguments {
    /// One area only.
    #[arg(value_parser = area_names())]
    area: Option<String>,
    /// Judge the figures that a clock measures, too; without it they are reported only. For a machine that does nothing else.
    #[arg(long)]
    timing: bool,
    /// Leave out figures that a clock measures, as --quick does.
    #[arg(long, hide = true, conflicts_with = "timing")]
    no_timing: bool,
    /// Shorter runs in the development profile; figures that a clock measures are left out but under --timing.
    #[arg(long)]
    quick: bool,
    /// Evaluate this table of values instead of the area's own figures (area gluing only).
    #[arg(long, value_name = "FILE", requires = "area")]
    table: Option<PathBuf>,
    /// One part of the area only, for a look; a wrong name lists the parts.
    #[arg(long, value_name = "NAME", requires = "area")]
    part: Option<String>,
    /// Write the tables of docs/, and with --quick tests/figures.tsv.
    #[arg(long)]
    write_docs: bool,
    /// Fail where tests/figures.tsv has other figures; they are those of `--quick`.
    #[arg(long, requires = "quick", conflicts_with_all = ["part", "write_docs", "timing"])]
    check_docs: bool,
}

impl Arguments {
    /// Whether clocks are left alone; a table of values is read without one.
    fn leaves_clocks_alone(&self) -> bool {
        !self.timing && (self.quick || self.no_timing) || self.table.is_some()
    }

    /// Whether figures are those that are stored: the quick ones.
    fn is_quick_form(&self) -> bool {
        self.quick && !self.timing && self.table.is_none()
    }
}

/// Settings with which an area measures its figures.
pub struct Context {
    /// The program to run.
    pub program: PathBuf,
    /// Whether a clock may be read.
    pub timing: bool,
    /// Whether to keep it short.
    pub quick: bool,
    /// A folder for results, empty at the start.
    pub scratch: PathBuf,
    /// A table of values to evaluate instead of the area's own figures.
    pub table: Option<PathBuf>,
    /// The only part to measure.
    pub part: Option<String>,
}

impl Context {
    /// A context with the program of a profile; clocks are read in the release profile only.
    fn new(profile: &str) -> Self {
        let scratch = process::target().join("validate");
        let _ = std::fs::remove_dir_all(&scratch);
        let timing = profile == "release";
        Self { program: program(profile), timing, quick: false, scratch, table: None, part: None }
    }
}

/// A part of an area: its name, and the function that measures it.
type Part = (&'static str, fn(&Context) -> Outcome<Vec<Figure>>);

/// Areas with their parts, in the order of the tables.
const AREAS: [(&str, &[Part]); 10] = [
    ("walk", &[("walk", walk::figures), ("speed", walk::speed::figures)]),
    ("rigid-body", &rigid_body::PARTS),
    ("soil", &soil::PARTS),
    ("gluing", &gluing::PARTS),
    ("fmi", &fmi::PARTS),
    ("plugins", &plugins::PARTS),
    ("world", &world::PARTS),
    ("forest", &forest::PARTS),
    ("page", &watched::PARTS),
    ("sweep", &sweep::PARTS),
];

fn area_names() -> Vec<&'static str> {
    AREAS.iter().map(|(name, _)| *name).collect()
}

/// Measures, prints and judges.
///
/// # Errors
/// All figures that fail, or a measurement that cannot be made.
pub fn validate(arguments: &Arguments) -> Outcome {
    if arguments.table.is_some() && arguments.area.as_deref() != Some("gluing") {
        return Err("--table is for the area gluing: cargo xtask validate gluing --table FILE".into());
    }
    let areas = || AREAS.iter().filter(|(name, _)| arguments.area.as_deref().is_none_or(|a| a == *name));
    // before anything is built
    areas().try_for_each(|(_, parts)| chosen(parts, arguments.part.as_deref()).map(drop))?;
    let no_timing = arguments.leaves_clocks_alone();
    if !no_timing && cfg!(debug_assertions) {
        return again_in_release(arguments);
    }
    let profile = if no_timing { "debug" } else { "release" };
    // in the development profile as the tests build it: with fewer packages the features of dependencies differ, and they are built twice
    let build: &[&str] = match no_timing {
        true => &["build", "--workspace"],
        false => &["build", "--release", "--package", "terraglue-cli", "--package", "terraglue-fmu-library"],
    };
    if arguments.table.is_none() {
        must(&mut cargo(build))?;
    }
    let part = arguments.table.as_ref().map(|_| "values".to_owned()).or_else(|| arguments.part.clone());
    let table = arguments.table.clone();
    let context = Context { quick: arguments.quick, table, part, ..Context::new(profile) };
    let mut complaints = Vec::new();
    let measured = areas()
        .map(|(area, parts)| Ok((*area, judged(area, parts, arguments, &context, &mut complaints)?)))
        .collect::<Outcome<Vec<_>>>()?;
    if context.part.is_none() {
        documents::write_table(&measured)?;
    }
    if arguments.write_docs && arguments.is_quick_form() && context.part.is_none() {
        page::write_page()?;
    }
    if complaints.is_empty() { Ok(()) } else { Err(complaints.join("\n       ")) }
}

/// Measures and prints the figures of an area; writes or checks their stored values. `complaints` collects their faults.
fn judged(
    area: &str,
    parts: &[Part],
    arguments: &Arguments,
    context: &Context,
    complaints: &mut Vec<String>,
) -> Outcome<Vec<Figure>> {
    let (known, stored) = (KnownFailures::read()?, StoredFigures::read()?);
    let writes = arguments.write_docs && context.table.is_none() && context.part.is_none();
    let compares = arguments.is_quick_form() && !writes;
    let figures = measured(area, parts, context, |figure| {
        let judged =
            if figure.timed && !arguments.timing { figure.clone().unjudged() } else { figure.clone() };
        println!("{}", judged.line());
        complaints.extend(known.judge(&judged));
        complaints.extend(compares.then(|| stored.judge(&judged)).flatten());
    })?;
    if writes {
        documents::write_peers(&figures)?;
    }
    if arguments.check_docs && context.table.is_none() {
        complaints.extend(stored.differences(area, &figures));
    }
    if writes && arguments.is_quick_form() {
        stored.write_area(area, &figures)?;
    }
    Ok(figures)
}

/// The figures of the requested parts of an area; each is shown as soon as it is there.
fn measured(
    area: &str,
    parts: &[Part],
    context: &Context,
    mut show: impl FnMut(&Figure),
) -> Outcome<Vec<Figure>> {
    let mut figures = Vec::new();
    for (part, measure) in chosen(parts, context.part.as_deref())? {
        if std::io::stderr().is_terminal() {
            eprintln!("measuring {area}: {part}");
        }
        let of_part = measure(context)?;
        of_part.iter().for_each(&mut show);
        figures.extend(of_part);
    }
    Ok(figures)
}

/// Prints the bits of all figures of `--quick`, one `id<TAB>bits` a line, with the program of the development profile,
/// which is built already: `cargo xtask freeze` holds them.
///
/// # Errors
/// A measurement that cannot be made.
pub fn print_bits() -> Outcome {
    let context = Context { quick: true, ..Context::new("debug") };
    for (area, parts) in AREAS {
        for figure in measured(area, parts, &context, |_| ())? {
            let bits = figure.value.map_or("-".to_owned(), |x| format!("{:016x}", x.to_bits()));
            println!("{}\t{bits}", figure.id);
        }
    }
    Ok(())
}

/// Draws the pictures of docs/images that are computed.
///
/// # Errors
/// A run that fails, or a picture that cannot be written.
pub fn write_pictures() -> Outcome {
    must(&mut cargo(&["build", "--workspace"]))?;
    soil::write_pictures()?;
    walk::write_picture(&program("debug"))
}

/// The parts to measure: all, or the requested one.
fn chosen<'a>(parts: &'a [Part], wanted: Option<&str>) -> Outcome<&'a [Part]> {
    let Some(wanted) = wanted else { return Ok(parts) };
    let found = parts.iter().position(|(name, _)| *name == wanted);
    let names = || parts.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
    found.map(|k| &parts[k..=k]).ok_or_else(|| format!("--part {wanted}: the parts are {}", names()))
}

/// Timing figures count in the release profile only.
fn again_in_release(arguments: &Arguments) -> Outcome {
    let mut command = cargo(&["run", "--release", "--package", "terraglue-validation", "--", "validate"]);
    command.args(&arguments.area);
    command.args(arguments.part.iter().flat_map(|part| ["--part", part]));
    let flags = [
        (arguments.timing, "--timing"),
        (arguments.quick, "--quick"),
        (arguments.write_docs, "--write-docs"),
    ];
    command.args(flags.iter().filter(|(on, _)| *on).map(|(_, flag)| flag));
    must(&mut command)
}
