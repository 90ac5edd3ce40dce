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
    let mut verdicts = Verdicts::of(arguments, &context)?;
    measure(areas().copied(), &context, |area, figures| verdicts.show(area, figures))?;
    let (measured, complaints) = verdicts.finish(areas().map(|(area, _)| *area))?;
    if context.part.is_none() {
        documents::write_table(&measured)?;
    }
    if arguments.write_docs && arguments.is_quick_form() && context.part.is_none() {
        page::write_page()?;
    }
    if complaints.is_empty() { Ok(()) } else { Err(complaints.join("\n       ")) }
}

/// The name of an area, and its figures.
type AreaFigures = (&'static str, Vec<Figure>);

/// Figures that were measured, and what is wrong with them.
struct Verdicts<'a> {
    arguments: &'a Arguments,
    context: &'a Context,
    known: KnownFailures,
    stored: StoredFigures,
    figures: Vec<AreaFigures>,
    complaints: Vec<String>,
}

impl<'a> Verdicts<'a> {
    fn of(arguments: &'a Arguments, context: &'a Context) -> Outcome<Self> {
        let (known, stored) = (KnownFailures::read()?, StoredFigures::read()?);
        Ok(Self { arguments, context, known, stored, figures: Vec::new(), complaints: Vec::new() })
    }

    /// Whether the pages of docs/ and the stored figures are written.
    fn writes(&self) -> bool {
        self.arguments.write_docs && self.context.table.is_none() && self.context.part.is_none()
    }

    /// Prints figures of an area and judges them.
    fn show(&mut self, area: &'static str, figures: Vec<Figure>) {
        let compares = self.arguments.is_quick_form() && !self.writes();
        for figure in &figures {
            let unjudged = figure.timed && !self.arguments.timing;
            let judged = if unjudged { figure.clone().unjudged() } else { figure.clone() };
            println!("{}", judged.line());
            self.complaints.extend(self.known.judge(&judged));
            self.complaints.extend(compares.then(|| self.stored.judge(&judged)).flatten());
        }
        match self.figures.iter_mut().find(|(name, _)| *name == area) {
            Some((_, all)) => all.extend(figures),
            None => self.figures.push((area, figures)),
        }
    }

    /// Writes or checks the stored figures of the areas. Returns all figures in the order of the areas, and the complaints.
    fn finish(
        mut self,
        areas: impl Iterator<Item = &'static str>,
    ) -> Outcome<(Vec<AreaFigures>, Vec<String>)> {
        let order: Vec<&str> = areas.collect();
        self.figures.sort_by_key(|(area, _)| order.iter().position(|name| name == area));
        for (area, figures) in &self.figures {
            if self.writes() {
                documents::write_peers(figures)?;
                if self.arguments.is_quick_form() {
                    self.stored.write_area(area, figures)?;
                }
            }
            if self.arguments.check_docs && self.context.table.is_none() {
                self.complaints.extend(self.stored.differences(area, figures));
            }
        }
        Ok((self.figures, self.complaints))
    }
}

/// Areas whose programs have limits on their time, or draw in a browser: nothing is measured beside them.
const ALONE: [&str; 3] = ["fmi", "plugins", "page"];

/// The figures of the requested parts of areas; each part is shown when it and those before it are measured. Parts are measured side by
/// side where no clock is read, apart from those of [`ALONE`], which come last.
fn measure(
    areas: impl Iterator<Item = (&'static str, &'static [Part])>,
    context: &Context,
    mut show: impl FnMut(&'static str, Vec<Figure>),
) -> Outcome {
    let (mut beside, mut alone) = (Vec::new(), Vec::new());
    for (area, parts) in areas {
        let group = if context.timing || ALONE.contains(&area) { &mut alone } else { &mut beside };
        group.extend(chosen(parts, context.part.as_deref())?.iter().map(|part| (area, *part)));
    }
    let mut failures = Vec::new();
    for (threads, jobs) in [(parallel::processors(), beside), (1, alone)] {
        let job = |(area, (part, measure)): &(&str, Part)| {
            if std::io::stderr().is_terminal() {
                eprintln!("measuring {area}: {part}");
            }
            measure(context)
        };
        parallel::in_order(threads, &jobs, job, |(area, (part, _)), figures| match figures {
            Ok(figures) => show(area, figures),
            Err(why) => failures.push(format!("{area}: {part}: {why}")),
        });
    }
    if failures.is_empty() { Ok(()) } else { Err(failures.join("\n       ")) }
}

/// Prints the bits of all figures of `--quick`, one `id<TAB>bits` a line, with the program of the development profile,
/// which is built already: `cargo xtask freeze` holds them.
///
/// # Errors
/// A measurement that cannot be made.
pub fn print_bits() -> Outcome {
    let context = Context { quick: true, ..Context::new("debug") };
    measure(AREAS.into_iter(), &context, |_, figures| {
        for figure in figures {
            let bits = figure.value.map_or("-".to_owned(), |x| format!("{:016x}", x.to_bits()));
            println!("{}\t{bits}", figure.id);
        }
    })
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
