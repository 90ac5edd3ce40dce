//! From the text to the [`Scenario`].

use super::advice::MOST_STEPS;
use super::choices::{FormChoice, JacobianChoice, LevelChoice, Relaxation, StartChoice, StrategyKind};
use super::events::{connections, events, faults, glue};
use super::keys::{self, Table};
use super::model::*;
use super::node::{Node, Place, Raw};
use super::section::Section;
use super::set::{Edit, edit_text};
use super::source::Source;
use super::{page, subsystems, sweep, task, terrain};
use std::path::Path;
use std::sync::Arc;
use terraglue_diagnostics::LARGEST_WHOLE;
use terraglue_diagnostics::{InputError, did_you_mean};
use terraglue_fmi::ssp::Package;
use toml_edit::Document;

type Checked<T> = Result<T, Box<InputError>>;

impl Scenario {
    /// Reads and checks a scenario file, edited by `sets` (key path and value).
    ///
    /// # Errors
    /// Wrong input, with the place in the file or in the edit. Parameters of modules are checked later, by
    /// [`super::check_parameters`].
    pub fn load(path: &Path, sets: &[(String, String)]) -> Checked<Self> {
        Self::load_by(path, sets, &[])
    }

    /// The same; `options` are the words of the command line that brought each of `sets`, `--set` beyond their end.
    ///
    /// # Errors
    /// As [`Scenario::load`].
    pub fn load_by(path: &Path, sets: &[(String, String)], options: &[&str]) -> Checked<Self> {
        if Package::is_one(path) {
            return Self::structure(path, sets, options);
        }
        let text = terraglue_subsystem::files::read_text(path).map_err(|e| unreadable(path, &e))?;
        Self::checked(read_source(&text, &path.display().to_string(), sets, options)?)
    }

    /// A system structure (SSP) as a scenario.
    fn structure(path: &Path, sets: &[(String, String)], options: &[&str]) -> Checked<Self> {
        let wrong = |e: terraglue_fmi::Error| InputError::plain(e.to_string(), None);
        let package = Package::open(path).map_err(wrong)?;
        let converted = crate::ssp::convert(&package, "").map_err(wrong)?;
        converted.notes.iter().for_each(|note| log::warn!("{}: {note}", path.display()));
        let mut source = read_source(&converted.text, &path.display().to_string(), sets, options)?;
        source.package = Some(Arc::new(package));
        Self::checked(source)
    }

    /// The scenario of an earlier run, whose text after all edits was kept; `path` is that of its file.
    ///
    /// # Errors
    /// As [`Scenario::load`].
    pub fn again(path: &Path, text: &str) -> Checked<Self> {
        let mut source = read_source(text, &path.display().to_string(), &[], &[])?;
        if Package::is_one(path) {
            let package = Package::open(path).map_err(|e| InputError::plain(e.to_string(), None))?;
            source.package = Some(Arc::new(package));
        }
        Self::checked(source)
    }

    /// This scenario with further edits.
    ///
    /// # Errors
    /// As [`Scenario::load`].
    pub fn edited(&self, sets: &[(String, String)]) -> Checked<Self> {
        let mut source = read_source(&self.source.text, &self.source.path, sets, &[])?;
        source.package.clone_from(&self.source.package);
        Self::checked(source)
    }

    /// The same for a text; `path` gives its name and folder.
    ///
    /// # Errors
    /// As [`Scenario::load`].
    pub fn parse(text: &str, path: &str, sets: &[(String, String)]) -> Checked<Self> {
        Self::checked(read_source(text, path, sets, &[])?)
    }

    fn checked(source: Source) -> Checked<Self> {
        check_top_level(&source)?;
        let specs = subsystems::all(&source)?;
        let names: Vec<&str> = specs.iter().map(|s| s.name.as_str()).collect();
        let time = with_section(&source, "time", read_time)?;
        let world = with_section(&source, "world", |s| {
            Ok(World { gravity_m_s2: s.numbers("gravity_m_s2"), seed: s.count("seed") })
        })?;
        let terrain = match source.root.get("terrain") {
            Some(_) => Some(with_section(&source, "terrain", terrain::read)?),
            None => None,
        };
        let gluing = with_section(&source, "gluing", read_gluing)?;
        let recording = with_section(&source, "recording", |s| {
            Ok(RecordingSpec {
                every_steps: s.count("every_steps"),
                ground_every_steps: s.count("ground_every_steps"),
                overlays: s.value("overlays") == serde_json::Value::Bool(true),
                digits: s.count("digits"),
                include: s.entry("include").map(subsystems::texts).unwrap_or_default(),
                exclude: s.entry("exclude").map(subsystems::texts).unwrap_or_default(),
            })
        })?;
        let report = with_section(&source, "report", |s| read_report(s, &names))?;
        let page = with_section(&source, "page", |s| page::read(s, &names))?;
        let sweep = match source.root.get("sweep") {
            Some(_) => Some(with_section(&source, "sweep", sweep::read)?),
            None => None,
        };
        let task = match source.root.get("task") {
            Some(_) => Some(with_section(&source, "task", |s| task::read(s, &names))?),
            None => None,
        };
        let connections = connections(&source, &names)?;
        let glue = glue(&source, &names)?;
        let events = events(&source, &names)?;
        let faults = faults(&source, &names)?;
        let stem = Path::new(&source.path).file_stem().map(|s| s.to_string_lossy().into_owned());
        Ok(Self {
            name: stem.unwrap_or_else(|| "scenario".into()),
            folder: source.folder(),
            time,
            world,
            terrain,
            gluing,
            recording,
            report,
            page,
            sweep,
            task,
            subsystems: specs,
            connections,
            glue,
            events,
            faults,
            source,
        })
    }
}

pub(super) fn unreadable(path: &Path, error: &std::io::Error) -> Box<InputError> {
    let message = format!("cannot read the scenario `{}`: {error}", path.display());
    if error.kind() != std::io::ErrorKind::NotFound {
        let help = "a scenario is a text file in TOML, described in docs/scenario.md".to_owned();
        return InputError::plain(message, Some(help));
    }
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut files: Vec<String> = std::fs::read_dir(folder)
        .into_iter()
        .flatten()
        .flatten()
        .map(|e| e.file_name().to_string_lossy().into_owned())
        .filter(|name| name.ends_with(".toml"))
        .collect();
    files.sort();
    let wanted = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    // a link that leads nowhere has the very name
    files.retain(|name| *name != wanted);
    let near = did_you_mean(&wanted, files.iter().map(String::as_str));
    let help = near.or_else(|| Some(format!("there is no scenario (.toml) in `{}`", folder.display())));
    InputError::plain(message, help)
}

pub(super) fn read_source(
    text: &str,
    path: &str,
    sets: &[(String, String)],
    options: &[&str],
) -> Checked<Source> {
    let option = |number: usize| options.get(number).copied().unwrap_or("--set");
    let mut source = Source {
        path: path.into(),
        text: text.into(),
        file_text: text.into(),
        sets: sets
            .iter()
            .enumerate()
            .map(|(number, (key, value))| (option(number).to_owned(), edit_text(key, value)))
            .collect(),
        root: Arc::default(),
        package: None,
    };
    if text.trim().is_empty() {
        let help = Some("docs/scenario.md shows what a scenario holds".into());
        return Err(source.error(&Place::default(), format!("the scenario `{path}` is empty"), help));
    }
    let document = Document::parse(text.to_owned()).map_err(|e| {
        let message = format!("not TOML: {}", e.message().lines().collect::<Vec<_>>().join("; "));
        let help = match e.message().contains("overflow") {
            true => LARGEST_WHOLE,
            false => "docs/scenario.md shows what a scenario looks like, https://toml.io the form",
        }
        .to_owned();
        source.error_at(e.span().unwrap_or(0..0), message, Some(help))
    })?;
    let mut root = Node::of_document(document.as_table());
    let mut document = document.into_mut();
    for (number, (key, value)) in sets.iter().enumerate() {
        let edit = Edit::parse(number, option(number), key, value)?;
        edit.apply(&mut root);
        edit.apply_to_text(&mut document);
    }
    source.text = document.to_string();
    source.root = Arc::new(root);
    Ok(source)
}

/// Every top-level key is a reserved table or a subsystem.
fn check_top_level(source: &Source) -> Checked<()> {
    let tables = keys::tables();
    let reserved: Vec<&str> = tables.iter().map(|t| t.name).collect();
    for (name, node) in source.root.entries() {
        if reserved.contains(&name.as_str()) || node.get("module").is_some() || node.get("fmu").is_some() {
            continue;
        }
        let message = match &node.value {
            Raw::Table(_) => {
                format!(
                    "unknown table `[{name}]`: no table of a scenario, and a subsystem needs `module` or `fmu`"
                )
            }
            Raw::List(items) if items.iter().all(Node::is_table) && !items.is_empty() => {
                format!("unknown table `[[{name}]]`")
            }
            _ => format!("unknown key `{name}` outside of any table"),
        };
        return Err(source.error(&node.key, message, did_you_mean(name, reserved.iter().copied())));
    }
    Ok(())
}

pub(super) fn with_section<T>(
    source: &Source,
    name: &str,
    read: impl FnOnce(&Section) -> Checked<T>,
) -> Checked<T> {
    let empty = || Table { name: "", repeated: false, required: false, help: "", keys: Vec::new() };
    let table = keys::table(name).unwrap_or_else(empty);
    read(&Section::check(source, &table, source.root.get(name))?)
}

fn read_time(s: &Section) -> Checked<Time> {
    let time = Time {
        step_s: s.number("step_s"),
        duration_s: s.number("duration_s"),
        settle_s: s.number("settle_s"),
    };
    let steps = time.duration_s / time.step_s;
    if steps > MOST_STEPS {
        let message = format!(
            "`duration_s` = {} s in steps of {:?} s are {steps:.3e} steps; a run has at most {MOST_STEPS:e}",
            time.duration_s, time.step_s
        );
        let help = format!(
            "lengthen `step_s` (0.001 s is usual) or shorten `duration_s`, to at most {:.3e} s at this step",
            MOST_STEPS * time.step_s
        );
        // a duration that was asked for on the command line is the newer one
        let edited = |key: &str| s.entry(key).is_some_and(|entry| entry.at.set.is_some());
        let shorter = edited("duration_s") && !edited("step_s") || s.entry("step_s").is_none();
        return Err(s.error(if shorter { "duration_s" } else { "step_s" }, message, Some(help)));
    }
    if (steps - steps.round()).abs() > 1e-6 * steps.max(1.0) || steps.round() < 1.0 {
        let below = (steps.floor() * time.step_s).max(time.step_s);
        // as people write it: 18 steps of 1 ms are 0.018 and not 0.018000000000000002
        let below: f64 = format!("{below:.12e}").parse().unwrap_or(below);
        let message =
            format!("`duration_s` = {} is no multiple of `step_s` = {}", time.duration_s, time.step_s);
        return Err(s.error("duration_s", message, Some(format!("e.g. {below}"))));
    }
    Ok(time)
}

fn read_gluing(s: &Section) -> Checked<GluingSpec> {
    // the section has checked that each name is one of the list
    let usual = GluingSpec::default();
    Ok(GluingSpec {
        strategy: StrategyKind::named(&s.text("strategy")).unwrap_or(usual.strategy),
        form: FormChoice::named(&s.text("form")).unwrap_or(usual.form),
        tolerance: s.number("tolerance"),
        max_iterations: u32::try_from(s.count("max_iterations")).unwrap_or(u32::MAX),
        max_halvings: u32::try_from(s.count("max_halvings")).unwrap_or(0),
        start: StartChoice::named(&s.text("start")).unwrap_or(usual.start),
        relaxation: Relaxation::named(&s.text("relaxation")).unwrap_or(usual.relaxation),
        jacobian: JacobianChoice::named(&s.text("jacobian")).unwrap_or(usual.jacobian),
        level: LevelChoice::named(&s.text("level")).unwrap_or(usual.level),
        stabilisation: s.number("stabilisation"),
        energy_residual_j: s.optional_number("energy_residual_j"),
        step_min_s: s.optional_number("step_min_s"),
        start_scale: usual.start_scale,
        contact_margin_m: s.number("contact_margin_m"),
    })
}

fn read_report(s: &Section, names: &[&str]) -> Checked<ReportSpec> {
    for key in ["body", "commanded_speed", "joint"] {
        if let Some(text) = s.optional_text(key) {
            subsystems::check_reference(&text, names).map_err(|c| s.error(key, c.message, c.help))?;
        }
    }
    Ok(ReportSpec {
        body: s.optional_text("body"),
        commanded_speed: s.optional_text("commanded_speed"),
        joint: s.optional_text("joint"),
    })
}
