//! From a checked scenario to a testbed: terrain, modules, instances, the group of glued subsystems, signals.

use super::checks::{check_groups, check_report};
use super::declared_glue::{body_states, declared};
use super::glued::GluedGroups;
use super::group::Group;
use super::loops::{LoopRefusal, Loops, NO_LOOP, open_loops};
use super::pieces;
use super::run_clock::RunClock;
use super::schedule::StepSchedule;
use super::sight::{Sight, check_mount};
use super::step_order::StepOrder;
use super::streams::Streams;
use super::subsystems::{Member, Subsystems};
use super::uncoupled::Uncoupled;
use super::{Options, Testbed};
use crate::signals::{self, Directory, Faults, FeedThroughs, Signals, TimeLine};
use std::sync::Arc;
use std::time::Duration;
use terraglue_diagnostics::{Error, Result};
use terraglue_gluing as gluing;
use terraglue_gluing::contact::{BodySide, ContactDetector, GroundSide, PortSet};
use terraglue_gluing::glue::Recipe;
use terraglue_gluing::step_control::{Passage, StepControl};
use terraglue_gluing::timing::Timings;
use terraglue_gluing::{InterfaceProblem, StepReport};
use terraglue_host::crash::Beginning;
use terraglue_host::isolation::What;
use terraglue_host::law;
use terraglue_host::{
    HostServices, Instance, Isolation, Library, LoadError, LoadedModule, SearchPath, Workers, interpreter,
    is_python,
};
use terraglue_scenario as scenario;
use terraglue_scenario::{
    Entry, GlueSpec, GluingSpec, InputError, IsolationSpec, LevelChoice, Scenario, StrategyKind,
    SubsystemSpec,
};
use terraglue_subsystem::{BodyState, Capabilities, Config, Kind, Level, Mount, Subsystem, Terrain};
use terraglue_terrain as terrain;

impl Testbed {
    /// Builds a scenario with modules found as libraries.
    ///
    /// # Errors
    /// Wrong input ([`Error::Input`]): a module that is not found, a parameter, a name in a connection or event.
    pub fn build(scenario: &Scenario, options: &Options) -> Result<Self> {
        Self::build_with(scenario, options, &Library::new())
    }

    /// The same; modules linked into the program come first.
    ///
    /// # Errors
    /// As [`Testbed::build`].
    pub fn build_with(scenario: &Scenario, options: &Options, library: &Library) -> Result<Self> {
        Self::build_hosted(scenario, options, library, |services| services)
    }

    /// The same with services that the caller changes: the log, the number of states that can be kept.
    ///
    /// # Errors
    /// As [`Testbed::build`].
    pub fn build_hosted(
        scenario: &Scenario,
        options: &Options,
        library: &Library,
        change: impl FnOnce(HostServices) -> HostServices,
    ) -> Result<Self> {
        let services = services(scenario, options, true)?;
        let terrain = services.terrain.clone();
        let services = change(services);
        let services = with_loop_state(services);
        advise(scenario);
        let mut instances = instantiate(scenario, options, library, &services)?;
        let mut signals = signals(scenario, &instances)?;
        check_report(scenario, &signals.directory, &instances)?;
        let groups = groups(scenario, &mut instances)?;
        check_groups(scenario, &groups, &instances)?;
        let mut subsystems = Subsystems {
            schedules: schedules(scenario, &instances, &groups),
            members: instances.iter().map(member).collect(),
            instances,
        };
        let mut glued = glued(scenario, groups, &subsystems.instances, terrain.as_deref(), services.gravity)?;
        let Subsystems { instances, schedules, .. } = &mut subsystems;
        let with_glue = instances.iter_mut().zip(schedules).filter(|(_, turn)| turn.glued);
        with_glue.for_each(|(instance, _)| instance.watch());
        signals.initialize(&mut subsystems.instances)?;
        subsystems.read_states()?;
        let sight = Sight::new(&subsystems, &services.workers)?;
        if let Err(Error::Simulation { message, .. }) =
            glued.detect_contacts(0.0, scenario.time.step_s, &subsystems)
        {
            return Err(InputError::plain(format!("at the start: {message}"), Some(SET_DOWN.into())).into());
        }
        let streams = Streams::new(&subsystems.instances);
        let Subsystems { instances, schedules, .. } = &mut subsystems;
        let (order, loops) = order(scenario, &mut signals, instances, schedules, services.slots - 1)?;
        Ok(Self {
            exact: takes_parts(scenario, &subsystems.instances),
            subsystems,
            glued,
            uncoupled: Uncoupled::new(services.workers.clone(), order, loops),
            signals,
            sight,
            streams,
            clock: RunClock::new(scenario.time.step_s),
            events: Vec::new(),
            report: StepReport { converged: true, ..StepReport::default() },
            timings: Timings::default(),
            cancel: options.cancel.clone(),
            standing: options.standing.clone(),
            teardown_errors: services.teardown_errors.clone(),
            last_h: 0.0,
            settle_s: scenario.time.settle_s,
            halvings: 0,
            max_halvings: scenario.gluing.max_halvings,
        })
    }
}

/// The order of the steps, and the loops in it; `state`: number of a state that nobody else keeps.
fn order(
    scenario: &Scenario,
    signals: &mut Signals,
    instances: &[Instance],
    schedules: &mut [StepSchedule],
    state: u32,
) -> Result<(StepOrder, Loops)> {
    let Signals { links, faults, .. } = signals;
    let feed_through = FeedThroughs::new(instances, &links.ends(instances));
    links.settle_ends(&feed_through);
    let mut order = StepOrder::new(links, faults, &feed_through, instances, schedules);
    let loops = Loops::new(links, faults, &feed_through, instances, schedules, state)
        .map_err(|refusal| loop_error(scenario, instances, refusal))?;
    order.put_behind_loops(loops.followers(), links, instances, schedules);
    open_loops(links, instances).iter().for_each(|warning| log::warn!("{warning}"));
    Ok((order, loops))
}

/// Warns of keys without effect and of doubtful values.
fn advise(scenario: &Scenario) {
    let advice = [scenario::advice::late_events(scenario), scenario::advice::unread_keys(scenario)];
    let doubt = scenario::plausible::terrain(scenario);
    let long = scenario::advice::many_steps(scenario);
    advice.iter().flatten().chain(&doubt).chain(&long).for_each(|advice| log::warn!("{advice}"));
}

/// Connections, events and faults.
fn signals(scenario: &Scenario, instances: &[Instance]) -> Result<Signals> {
    let source = &scenario.source;
    let directory = Directory::new(instances);
    let multiples: Vec<u32> = scenario.subsystems.iter().map(|spec| spec.step_multiple.max(1)).collect();
    let links = signals::connect(&scenario.connections, &directory, instances, &multiples, source)?;
    let time_line = TimeLine::new(&scenario.events, &directory, instances, source)?;
    let random = (scenario.world.seed, scenario.time.step_s);
    let faults = Faults::new(&scenario.faults, &links, &directory, instances, source, random)?;
    let signals = Signals { links, directory, time_line, faults, told: false };
    fed_events(scenario, &signals, instances).iter().for_each(|warning| log::warn!("{warning}"));
    Ok(signals)
}

/// Warnings of events that set an input which a connection feeds: the next step overwrites it.
fn fed_events(scenario: &Scenario, signals: &Signals, instances: &[Instance]) -> Vec<String> {
    let fed = |name: &String| {
        let found = signals.directory.find(name)?;
        let id = found.describe(instances).id;
        signals.is_fed(instances, found.slot(), id).then(|| {
            format!(
                "an event sets `{name}`, which a connection feeds: it has no effect, as the connection sets it at every step; `[[fault]]` \
                 changes values on their way"
            )
        })
    };
    scenario.events.iter().flat_map(|e| e.set.iter()).filter_map(|(name, _)| fed(name)).collect()
}

/// Groups with the detection of their contacts.
fn glued(
    scenario: &Scenario,
    groups: Vec<Group>,
    instances: &[Instance],
    terrain: Option<&dyn Terrain>,
    gravity: [f64; 3],
) -> Result<GluedGroups> {
    let ground = groups.iter().find(|g| g.problem.has_grounds());
    Ok(GluedGroups {
        detector: detector(ground, instances, terrain)?,
        control: control(scenario, &groups, instances)?,
        groups,
        no_ports: PortSet::default(),
        failed: None,
        gravity,
        contact_margin_m: scenario.gluing.contact_margin_m,
    })
}

/// Whether a step of the run may end at any time: all subsystems make every step, and of any length.
fn takes_parts(scenario: &Scenario, instances: &[Instance]) -> bool {
    let any = |i: &Instance| !i.capabilities().has(Capabilities::FIXED_STEP);
    scenario.subsystems.iter().all(|s| s.step_multiple <= 1) && instances.iter().all(any)
}

/// With one more state to keep, the last one, for loops of connections.
fn with_loop_state(services: HostServices) -> HostServices {
    HostServices { slots: services.slots + 1, ..services }
}

/// The way out of a body that stands wrong at the start.
const SET_DOWN: &str =
    "docs/scenario.md has the keys of `[terrain]`, `terraglue modules NAME` those that set a body down";
/// Services for instances of a scenario; `ground`: with the terrain, if it has one.
///
/// # Errors
/// [`Error::Input`]: the terrain of the scenario cannot be made.
pub fn services(scenario: &Scenario, options: &Options, ground: bool) -> Result<HostServices> {
    let terrain: Option<Arc<dyn Terrain>> = match scenario.terrain.as_ref().filter(|_| ground) {
        Some(spec) => {
            let built = terrain::build(spec, scenario.world.seed);
            Some(Arc::from(built.map_err(|error| of_terrain(scenario, error))?))
        }
        None => None,
    };
    Ok(HostServices {
        gravity: scenario.world.gravity_m_s2,
        terrain,
        workers: Arc::new(Workers::new(options.threads)),
        cancel: options.cancel.clone(),
        ..HostServices::new(scenario.world.seed, &scenario.folder)
    })
}

/// Error of the ground, at the key that it is about. An elevation file has places of its own.
fn of_terrain(scenario: &Scenario, error: Error) -> Error {
    match error {
        Error::Input(wrong) if wrong.span.is_none() => {
            let InputError { message, help, .. } = *wrong;
            scenario.source.error_about("terrain", &["terrain", "file"], message, help).into()
        }
        other => other,
    }
}

/// The module of a subsystem.
///
/// # Errors
/// [`Error::Input`]: there is no such module, or it cannot be loaded.
pub fn find(
    scenario: &Scenario,
    spec: &SubsystemSpec,
    options: &Options,
    library: &Library,
) -> Result<LoadedModule> {
    let search = SearchPath::standard(&options.module_paths, &scenario.folder);
    let found = library.find(&spec.module, &search, &scenario.folder);
    found.map_err(|e| module_error(scenario, spec, &e).into())
}

/// The limits of a scenario as the host takes them.
fn isolation(spec: &IsolationSpec) -> Isolation {
    let IsolationSpec { load_timeout_s, step_timeout_s, memory_bytes } = *spec;
    Isolation { load_timeout_s, step_timeout_s, memory_bytes }
}

/// An instance of a module, in this process or in one of its own.
///
/// # Errors
/// [`Error::Input`]: the module refuses its parameters or cannot make an instance.
pub fn make(
    scenario: &Scenario,
    spec: &SubsystemSpec,
    module: LoadedModule,
    config: Config,
    services: &HostServices,
) -> Result<Instance> {
    let config = terraglue_terrain::resolve_mask(scenario, spec, config, services.terrain.as_deref())?;
    let module = module.run_by(interpreter(spec.python.as_deref(), &scenario.folder));
    let made = match spec.isolate || module.is_python() {
        true => module.instantiate_isolated(&spec.name, config, services, isolation(&spec.isolation)),
        false => {
            let services = HostServices { isolation: isolation(&spec.isolation), ..services.clone() };
            module.instantiate(&spec.name, config, &services)
        }
    };
    made.map_err(|e| module_error(scenario, spec, &e).into())
}

fn instantiate(
    scenario: &Scenario,
    options: &Options,
    library: &Library,
    services: &HostServices,
) -> Result<Vec<Instance>> {
    let search = SearchPath::standard(&options.module_paths, &scenario.folder);
    let (mut instances, mut mounted) = (Vec::new(), Vec::new());
    for spec in &scenario.subsystems {
        if spec.is_fmu() {
            let folder = std::env::current_dir();
            instances.push(fmu(scenario, spec, library, services)?);
            stay_in(folder, &spec.name);
            continue;
        }
        let module = find(scenario, spec, options, library)?;
        let config = scenario::check_parameters(module.schema(), spec, &scenario.source)?;
        let idle = scenario::advice::idle_limits(scenario, spec, module.is_python());
        idle.iter().for_each(|advice| log::warn!("{advice}"));
        for name in scenario::SHIPPED_MODULES.iter().filter(|name| spec.parameters.contains_key(**name)) {
            let Ok(other) = library.find(name, &search, &scenario.folder) else { continue };
            if other.schema().name != module.schema().name
                && let Some(advice) = scenario::advice::unchosen(other.schema(), spec, &scenario.source)
            {
                log::warn!("{advice}");
            }
        }
        let gravity = terraglue_numerics::rotation::length(services.gravity);
        let doubts = scenario::plausible::parameters(scenario, spec, module.schema(), &config);
        let regions = scenario::advice::regions(spec);
        let advice = library.advice(module.schema().kind, &config, &regions, gravity);
        let advice = scenario::advice::of_module(scenario, spec, advice);
        doubts.iter().chain(&advice).for_each(|advice| log::warn!("{advice}"));
        let advice = scenario::advice::law_parameters(module.schema(), spec, &scenario.source);
        advice.iter().for_each(|advice| log::warn!("{advice}"));
        let config = with_law(config, &search, scenario, spec)?;
        if module.schema().parameters.iter().any(|p| p.name == Mount::KEY) {
            mounted.push(spec);
        }
        instances.push(make(scenario, spec, module, config, services)?);
    }
    mounted.iter().try_for_each(|spec| check_mount(scenario, spec, &instances))?;
    Ok(instances)
}

/// Goes back to the working folder, on which the paths of the other subsystems may rest, where `name` has left it.
fn stay_in(folder: std::io::Result<std::path::PathBuf>, name: &str) {
    if let Ok(folder) = folder
        && std::env::current_dir().is_ok_and(|now| now != folder)
        && std::env::set_current_dir(&folder).is_ok()
    {
        log::warn!(
            "`{name}` changed the working folder of the process; it is set back to `{}`",
            folder.display()
        );
    }
}

/// The same parameters with the file of the law that they name.
///
/// # Errors
/// [`Error::Input`]: the file of the law is not found.
pub fn with_law(
    config: Config,
    search: &SearchPath,
    scenario: &Scenario,
    spec: &SubsystemSpec,
) -> Result<Config> {
    let Some(name) = config.get(law::KEY).and_then(|v| v.as_str()) else { return Ok(config) };
    let path = law::locate(name, search, &scenario.folder).map_err(|e| {
        let help = e.nearest().map(|n| format!("did you mean `{n}`?"));
        scenario.source.error_at_value(&[&spec.name, "law", "plugin"], e.to_string(), help)
    })?;
    let path = std::path::absolute(&path).unwrap_or(path);
    let config = config.with(law::KEY, path.to_string_lossy().as_ref());
    Ok(match spec.python.as_deref().filter(|_| is_python(&path)) {
        None => config,
        Some(python) => {
            let python = interpreter(Some(python), &scenario.folder);
            config.with(law::INTERPRETER, python.to_string_lossy().as_ref())
        }
    })
}

/// A functional mock-up unit as an instance.
fn fmu(
    scenario: &Scenario,
    spec: &SubsystemSpec,
    library: &Library,
    services: &HostServices,
) -> Result<Instance> {
    let path = scenario.folder.join(&spec.module);
    let host = services.for_instance(&spec.name);
    let _begun = Beginning::of_instance(&spec.name, &path);
    let once = || terraglue_fmi::Fmu::inspect(&path).is_ok_and(|(d, _)| d.capabilities.once_per_process);
    let made: terraglue_subsystem::Result<Box<dyn Subsystem>> = match spec.isolate {
        // One instance per process is all that such an FMU stands.
        false if !once() => {
            scenario::advice::idle_limits(scenario, spec, false).iter().for_each(|a| log::warn!("{a}"));
            library
                .fmus()
                .and_then(|make| make(&path, &spec.parameters, host, services.teardown_errors.clone()))
        }
        _ => {
            let what = What::Fmu {
                path: std::path::absolute(&path).unwrap_or_else(|_| path.clone()),
                parameters: spec.parameters.clone(),
            };
            terraglue_host::isolation::start(what, &host, services, isolation(&spec.isolation))
        }
    };
    let made = made.map_err(|e| -> Error {
        match e {
            // The error itself, not its log lines.
            terraglue_subsystem::Error::Fatal(message) => Error::Module {
                subsystem: spec.name.clone(),
                module: spec.module.clone(),
                function: "instantiate",
                time_s: 0.0,
                message,
            },
            other => {
                let message = format!("{} ({}): {other}", spec.name, spec.module);
                scenario.source.error_about(&spec.name, &[&spec.name, "fmu"], message, None).into()
            }
        }
    })?;
    Ok(Instance::new(&spec.name, &spec.module, Kind::Controller, made))
}

/// Hint if a module is not found.
const NO_MODULE: &str = "`terraglue modules` lists those that are found. `cargo build` makes those of the project beside the \
                         program, `cargo xtask install PREFIX` installs them with it; --module-path DIR or \
                         TERRAGLUE_MODULE_PATH adds a folder, and `module` may be the path of a file";

fn module_error(scenario: &Scenario, spec: &SubsystemSpec, error: &LoadError) -> Box<InputError> {
    if let LoadError::Refused { message, .. } = error
        && let Some(shown) = InputError::of_file(message, &error.to_string())
    {
        return shown;
    }
    let near = error.nearest().map(|n| format!("did you mean `{n}`?"));
    let help = near.or_else(|| error.is_unknown().then(|| NO_MODULE.to_owned()));
    let (source, name) = (&scenario.source, spec.name.as_str());
    match error {
        // an error of a soil about its ground belongs to another table
        LoadError::Refused { message, .. } | LoadError::Instantiate { message, .. }
            if message.starts_with("terrain: ") =>
        {
            source.error_of_table("terrain", error.to_string(), help)
        }
        LoadError::Refused { .. } | LoadError::Instantiate { .. } => {
            source.error_about(name, &[name], error.to_string(), help)
        }
        _ => source.error_at_value(&[name, "module"], error.to_string(), help),
    }
}

fn loop_error(scenario: &Scenario, instances: &[Instance], refusal: LoopRefusal) -> Box<InputError> {
    let (source, help) = (&scenario.source, Some(NO_LOOP.to_owned()));
    match refusal {
        LoopRefusal::Subsystem(slot, message) => source.error_of_table(instances[slot].name(), message, help),
        LoopRefusal::Fault(number, message) => {
            let spec = &scenario.faults[number];
            source.error_in(spec.entry, &[&spec.variable], message, help)
        }
    }
}

fn member(instance: &Instance) -> Member {
    Member { states: vec![BodyState::REST; instance.scene().bodies.len()], cost: Duration::ZERO }
}

fn schedules(scenario: &Scenario, instances: &[Instance], groups: &[Group]) -> Vec<StepSchedule> {
    let glued = |slot| groups.iter().any(|g| g.problem.members().any(|m| m == slot));
    let turn = |(slot, (spec, instance)): (usize, (&SubsystemSpec, &Instance))| StepSchedule {
        is_fmu: terraglue_scenario::ModuleKind::is_fmu(instance.module()),
        level: 0,
        step_multiple: spec.step_multiple.max(1),
        glued: glued(slot),
        holds: false,
        has_bodies: !instance.scene().bodies.is_empty(),
        trial: None,
    };
    scenario.subsystems.iter().zip(instances).enumerate().map(turn).collect()
}

/// Bodies that can touch the ground, with the ground, and all that glue connects: one group each.
fn groups(scenario: &Scenario, instances: &mut [Instance]) -> Result<Vec<Group>> {
    let glue = declared(scenario, instances)?;
    let instances = &*instances;
    pieces::check(scenario, instances, &glue, &body_states(instances)?)?;
    let grounds: Vec<usize> = (0..instances.len()).filter(|k| instances[*k].kind() == Kind::Soil).collect();
    if let [first, second, ..] = grounds[..] {
        let message = format!(
            "`{}` and `{}` are both soils, but the terrain can belong to one only",
            instances[first].name(),
            instances[second].name()
        );
        let source = &scenario.source;
        let help = "take one out; regions of a soil can have other parameters (docs/soil.md)".to_owned();
        return Err(source.error_at_value(&[instances[second].name()], message, Some(help)).into());
    }
    // the smallest member that a subsystem is connected with; none: it is not glued
    let mut root: Vec<Option<usize>> = vec![None; instances.len()];
    for (slot, instance) in instances.iter().enumerate() {
        let stands = instance.kind() == Kind::Robot
            && instance.capabilities().has(Capabilities::FORCE)
            && instance.scene().shapes.iter().any(|s| s.collides);
        if let Some(ground) = grounds.first().filter(|_| stands) {
            join(&mut root, slot, *ground);
        }
    }
    for ends in &glue {
        let [a, b] = ends.ends.map(|e| e.map(|(slot, _)| slot));
        if let Some(a) = a.or(b) {
            join(&mut root, a, b.unwrap_or(a));
        }
    }
    let mut all = Vec::new();
    for first in (0..instances.len()).filter(|k| root[*k] == Some(*k)) {
        let of = |soil: bool| -> Vec<usize> {
            let is = |k: &usize| root[*k] == Some(first) && (instances[*k].kind() == Kind::Soil) == soil;
            (0..instances.len()).filter(is).collect()
        };
        let (bodies, grounds) = (of(false), of(true));
        if !bodies.is_empty() {
            all.push(group(scenario, instances, &bodies, &grounds, &glue)?);
        }
    }
    Ok(all)
}

/// Makes two subsystems members of one group.
fn join(root: &mut [Option<usize>], a: usize, b: usize) {
    let (of_a, of_b) = (root[a].unwrap_or(a), root[b].unwrap_or(b));
    let smallest = of_a.min(of_b);
    for entry in root.iter_mut().flatten().filter(|r| **r == of_a || **r == of_b) {
        *entry = smallest;
    }
    (root[a], root[b]) = (Some(smallest), Some(smallest));
}

/// One group with its strategy.
fn group(
    scenario: &Scenario,
    instances: &[Instance],
    bodies: &[usize],
    grounds: &[usize],
    glue: &[Recipe],
) -> Result<Group> {
    let gravity = terraglue_numerics::rotation::length(scenario.world.gravity_m_s2);
    let mass: f64 = bodies.iter().flat_map(|b| &instances[*b].scene().bodies).map(|b| b.mass).sum();
    let weight = mass * gravity;
    let mut problem = InterfaceProblem::new(bodies, grounds, if weight > 0.0 { weight } else { 1.0 });
    let states = body_states(instances)?;
    let own = |r: &&Recipe| r.ends.iter().flatten().any(|(slot, _)| bodies.contains(slot));
    for recipe in glue.iter().filter(own) {
        problem.glue.add(recipe, |slot, body| states[slot][body as usize]);
    }
    problem.conditions.stabilisation = scenario.gluing.stabilisation;
    problem.conditions.level = match scenario.gluing.level {
        LevelChoice::Position => Level::Position,
        LevelChoice::Velocity => Level::Velocity,
        LevelChoice::Acceleration => Level::Acceleration,
    };
    let (own, at) = own_strategy(scenario, glue.iter().filter(own).map(|r| r.number))?;
    let spec = &GluingSpec { strategy: own.unwrap_or(scenario.gluing.strategy), ..scenario.gluing.clone() };
    if let Some(refusal) = gluing::refusal(spec, &problem, instances) {
        let help = match refusal.would_work.as_slice() {
            [] => "no strategy of this version can glue these subsystems".into(),
            names => format!("these would work: {}", names.join(", ")),
        };
        let source = &scenario.source;
        return Err(match at {
            Some(entry) => source.error_in(entry, &["strategy"], refusal.reason, Some(help)),
            None => source.error_at_value(&["gluing", "strategy"], refusal.reason, Some(help)),
        }
        .into());
    }
    let can_start = |s: usize| instances[s].capabilities().has(Capabilities::FORCE | Capabilities::RETRY);
    let start =
        (problem.glue.has_joints() && problem.body_slots().all(can_start)).then(|| gluing::start(spec));
    let strategy = gluing::strategy(spec);
    Ok(Group { problem, strategy, own, start, closed: Vec::new(), passage: Passage::default() })
}

/// The strategy that the glue of a group names, and where; all that name one must agree.
fn own_strategy(
    scenario: &Scenario,
    numbers: impl Iterator<Item = usize>,
) -> Result<(Option<StrategyKind>, Option<Entry>)> {
    let mut found: Option<&GlueSpec> = None;
    for spec in numbers.map(|k| &scenario.glue[k]).filter(|s| s.strategy.is_some()) {
        match found {
            Some(other) if other.strategy != spec.strategy => {
                let message: String = "glue of one group, but another strategy is named before".into();
                let help =
                    Some("subsystems that are connected by glue are solved together, by one strategy".into());
                return Err(scenario.source.error_in(spec.entry, &["strategy"], message, help).into());
            }
            _ => found = Some(spec),
        }
    }
    Ok((found.and_then(|s| s.strategy), found.map(|s| s.entry)))
}

/// The control of the steps, where the scenario asks for it and all can follow.
fn control(scenario: &Scenario, groups: &[Group], instances: &[Instance]) -> Result<Option<StepControl>> {
    let Some(tolerance) = scenario.gluing.energy_residual_j else { return Ok(None) };
    let refused = |message: String, help: &str| {
        let at = &["gluing", "energy_residual_j"];
        Err(Error::from(scenario.source.error_at_value(at, message, Some(help.into()))))
    };
    if let Some(fixed) = instances.iter().find(|i| i.capabilities().has(Capabilities::FIXED_STEP)) {
        let message = format!("`{}` ({}) makes steps of one length only", fixed.name(), fixed.module());
        return refused(message, "leave the key out: all steps are then time.step_s long");
    }
    if !groups.iter().any(|g| g.problem.has_grounds() || g.problem.glue.spring().is_some()) {
        let message = "no soil and no spring is glued: a constraint passes as much energy as it takes, so there is \
                       no residual to set the steps by";
        return refused(message.into(), "give the glue a compliance_m_n, or leave the key out");
    }
    let longest = scenario.time.step_s;
    let shortest = scenario.gluing.step_min_s.unwrap_or(0.01 * longest);
    if shortest > longest {
        let at = &["gluing", "step_min_s"];
        let message = format!("{shortest} s is longer than time.step_s, the longest step");
        let help = "make it shorter, or leave it out for a hundredth of time.step_s".to_owned();
        return Err(scenario.source.error_at_value(at, message, Some(help)).into());
    }
    Ok(Some(StepControl::new(tolerance, [shortest, longest])))
}

fn detector(
    group: Option<&Group>,
    instances: &[Instance],
    terrain: Option<&dyn Terrain>,
) -> Result<ContactDetector> {
    let Some(group) = group else { return ContactDetector::new(&[], &[], terrain) };
    let body = |slot: usize| BodySide {
        subsystem: slot as u32,
        name: instances[slot].name(),
        scene: instances[slot].scene(),
    };
    let ground = |slot: usize| GroundSide { subsystem: slot as u32, instance: instances[slot].subsystem() };
    // a soil that shows no ground is met by declared glue only
    let shown = |slot: &usize| {
        terrain.is_some()
            || instances[*slot].fields().iter().any(|f| f.name == "height")
            || group.problem.glue.is_empty()
    };
    let bodies: Vec<_> = group.problem.body_slots().map(body).collect();
    let grounds: Vec<_> = group.problem.ground_slots().filter(shown).map(ground).collect();
    ContactDetector::new(&bodies, &grounds, terrain)
}
