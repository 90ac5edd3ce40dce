//! From a checked scenario to a testbed: terrain, modules, instances, the group of glued subsystems, signals.

use super::unglued::Unglued;
use super::{Group, Member, Options, Testbed};
use crate::contact::{BodySide, ContactDetector, GroundSide};
use crate::gluing::glue::Recipe;
use crate::gluing::{self, Exchange, Glue, StepReport};
use crate::host::isolation::{self, What};
use crate::host::{
    HostServices, Instance, Library, LoadError, LoadedModule, Progress, SearchPath, Workers, interpreter,
};
use crate::scenario::{self, GlueSpec, InputError, Scenario, SubsystemSpec};
use crate::signals::{self, Directory, TimeLine};
use crate::timing::Timings;
use crate::{Error, Result, terrain};
use std::sync::Arc;
use std::time::Duration;
use terraglue_subsystem::{BodyState, Capabilities, Hold, Kind, Law, Level, Subsystem, Terrain};

impl Testbed {
    /// Builds a scenario with modules found as libraries.
    ///
    /// # Errors
    /// Wrong input ([`Error::Input`]): a module that is not found, a parameter, a name in a connection or event.
    pub fn build(scenario: &Scenario, options: &Options) -> Result<Self> {
        Self::build_with(scenario, options, &Library::new())
    }

    /// The same; modules linked into the program come first.
    pub fn build_with(scenario: &Scenario, options: &Options, library: &Library) -> Result<Self> {
        Self::build_hosted(scenario, options, library, |services| services)
    }

    /// The same with services that the caller changes: the log, the number of states that can be kept.
    pub(crate) fn build_hosted(
        scenario: &Scenario,
        options: &Options,
        library: &Library,
        change: impl FnOnce(HostServices) -> HostServices,
    ) -> Result<Self> {
        let terrain: Option<Arc<dyn Terrain>> = match &scenario.terrain {
            Some(spec) => Some(Arc::from(terrain::build(spec, scenario.world.seed)?)),
            None => None,
        };
        let services = HostServices {
            gravity: scenario.world.gravity_m_s2,
            terrain: terrain.clone(),
            workers: Arc::new(Workers::new(options.threads)),
            cancel: options.cancel.clone(),
            ..HostServices::new(scenario.world.seed, &scenario.folder)
        };
        let services = change(services);
        scenario::advice::late_events(scenario).iter().for_each(|advice| log::warn!("{advice}"));
        let instances = instantiate(scenario, options, library, &services)?;
        let directory = Directory::new(&instances);
        let links = signals::connect(&scenario.connections, &directory, &instances, &scenario.source)?;
        let time_line = TimeLine::new(&scenario.events, &directory, &instances, &scenario.source)?;
        check_report(scenario, &directory, &instances)?;
        let group = group(scenario, &instances)?;
        let detector = detector(group.as_ref(), &instances, terrain.as_deref())?;
        let mut testbed = Self {
            members: members(scenario, &instances, group.as_ref()),
            detector,
            gravity: services.gravity,
            contact_margin_m: scenario.gluing.contact_margin_m,
            group,
            links,
            time_line,
            directory,
            instances,
            happenings: Vec::new(),
            no_glue: StepReport { converged: true, ..StepReport::default() },
            timings: Timings::default(),
            unglued: Unglued::new(services.workers.clone()),
            cancel: options.cancel.clone(),
            partings: services.partings.clone(),
            step_s: scenario.time.step_s,
            origin_s: 0.0,
            nominal: 0,
            index: 0,
            t: 0.0,
            last_h: 0.0,
            halvings: 0,
            max_halvings: scenario.gluing.max_halvings,
            hold: hold(&scenario.gluing.hold),
            started: false,
        };
        testbed.settle()?;
        testbed.read_states()?;
        if let Err(Error::Simulation { message, .. }) = testbed.detect_contacts(scenario.time.step_s) {
            return Err(InputError::plain(format!("at the start: {message}"), None).into());
        }
        Ok(testbed)
    }
}

fn instantiate(
    scenario: &Scenario,
    options: &Options,
    library: &Library,
    services: &HostServices,
) -> Result<Vec<Instance>> {
    let search = SearchPath::standard(&options.module_paths, &scenario.folder);
    let mut instances = Vec::new();
    for spec in &scenario.subsystems {
        let wrong = |e: LoadError| Error::Input(module_error(scenario, spec, &e));
        if crate::fmu::is_fmu(&spec.module) {
            instances.push(unit(scenario, spec, services)?);
            continue;
        }
        let module: LoadedModule = library.find(&spec.module, &search, &scenario.folder).map_err(wrong)?;
        let config = scenario::check_parameters(module.schema(), spec, &scenario.source)?;
        for name in scenario::SHIPPED_MODULES.iter().filter(|name| spec.parameters.contains_key(**name)) {
            let Ok(other) = library.find(name, &search, &scenario.folder) else { continue };
            if other.schema().name != module.schema().name
                && let Some(advice) = scenario::advice::unchosen(other.schema(), spec, &scenario.source)
            {
                log::warn!("{advice}");
            }
        }
        let module = module.run_by(interpreter(spec.python.as_deref(), &scenario.folder));
        let made = match spec.isolate || module.is_python() {
            true => module.instantiate_isolated(&spec.name, config, services, spec.isolation),
            false => module.instantiate(&spec.name, config, services),
        };
        instances.push(made.map_err(wrong)?);
    }
    Ok(instances)
}

/// A functional mock-up unit as an instance.
fn unit(scenario: &Scenario, spec: &SubsystemSpec, services: &HostServices) -> Result<Instance> {
    let path = scenario.folder.join(&spec.module);
    let host = services.for_instance(&spec.name);
    let once = || terraglue_fmi::Fmu::inspect(&path).is_ok_and(|(d, _)| d.capabilities.once_per_process);
    let made: terraglue_subsystem::Result<Box<dyn Subsystem>> = match spec.isolate {
        // One instance per process is all that such a unit stands.
        false if !once() => crate::fmu::FmuSubsystem::new(&path, &spec.parameters, host)
            .map(|u| Box::new(u.with_partings(services.partings.clone())) as _),
        _ => {
            let what = What::Unit {
                path: std::path::absolute(&path).unwrap_or_else(|_| path.clone()),
                parameters: spec.parameters.clone(),
            };
            isolation::start(what, &host, services, spec.isolation)
        }
    };
    let made = made.map_err(|e| -> Error {
        match e {
            // What it did, not what was written about it.
            terraglue_subsystem::Error::Fatal(message) => Error::Module {
                subsystem: spec.name.clone(),
                module: spec.module.clone(),
                function: "instantiate",
                time_s: 0.0,
                message,
            },
            other => {
                let message = format!("{} ({}): {other}", spec.name, spec.module);
                scenario.source.error_at_value(&[&spec.name, "fmu"], message, None).into()
            }
        }
    })?;
    Ok(Instance::new(&spec.name, &spec.module, Kind::Controller, made))
}

fn module_error(scenario: &Scenario, spec: &SubsystemSpec, error: &LoadError) -> Box<InputError> {
    let help = error.nearest().map(|n| format!("did you mean `{n}`?"));
    let key = match error {
        LoadError::Refused { .. } | LoadError::Instantiate { .. } => vec![spec.name.as_str()],
        _ => vec![spec.name.as_str(), "module"],
    };
    scenario.source.error_at_value(&key, error.to_string(), help)
}

fn members(scenario: &Scenario, instances: &[Instance], group: Option<&Group>) -> Vec<Member> {
    let glued = |slot| group.is_some_and(|g| g.exchange.members().any(|m| m == slot));
    let member = |(slot, (spec, instance)): (usize, (&SubsystemSpec, &Instance))| Member {
        states: vec![BodyState::REST; instance.scene().bodies.len()],
        step_multiple: u64::from(spec.step_multiple.max(1)),
        glued: glued(slot),
        trial: Ok(Progress::Complete),
        cost: Duration::ZERO,
    };
    scenario.subsystems.iter().zip(instances).enumerate().map(member).collect()
}

/// All bodies that can touch the ground and the ground: one group with the scenario's strategy.
fn group(scenario: &Scenario, instances: &[Instance]) -> Result<Option<Group>> {
    let of = |f: &dyn Fn(&Instance) -> bool| -> Vec<usize> {
        instances.iter().enumerate().filter(|(_, i)| f(i)).map(|(slot, _)| slot).collect()
    };
    let named = |i: &Instance| {
        scenario
            .glue
            .iter()
            .any(|g| g.sides.iter().any(|s| s.split_once('.').is_some_and(|(n, _)| n == i.name())))
    };
    let grounds = of(&|i| i.kind() == Kind::Soil);
    let bodies = of(&|i| {
        i.kind() != Kind::Soil && named(i)
            || i.kind() == Kind::Robot
                && !grounds.is_empty()
                && i.capabilities().has(Capabilities::FORCE)
                && i.scene().shapes.iter().any(|s| s.collides)
    });
    if let [first, second, ..] = grounds[..] {
        let message = format!(
            "`{}` and `{}` are both soils, but the terrain can belong to one only",
            instances[first].name(),
            instances[second].name()
        );
        let source = &scenario.source;
        return Err(source.error_at_value(&[instances[second].name()], message, None).into());
    }
    if bodies.is_empty() || grounds.is_empty() && scenario.glue.is_empty() {
        return Ok(None);
    }
    let gravity = scenario.world.gravity_m_s2.iter().map(|g| g * g).sum::<f64>().sqrt();
    let mass: f64 = bodies.iter().flat_map(|b| &instances[*b].scene().bodies).map(|b| b.mass).sum();
    let weight = mass * gravity;
    let mut exchange = Exchange::new(&bodies, &grounds, if weight > 0.0 { weight } else { 1.0 });
    exchange.glue = glue(scenario, instances)?;
    exchange.stabilisation = scenario.gluing.stabilisation;
    if scenario.gluing.level == "velocity" {
        exchange.level = Level::Velocity;
    } else if scenario.gluing.hold == "linear" {
        let message = "a linear hold with the condition at position level grows by 2 + √3 = 3.73 per step";
        let help = Some("use hold = \"end\" or \"constant\", or level = \"velocity\"".into());
        return Err(scenario.source.error_at_value(&["gluing", "hold"], message, help).into());
    }
    let spec = &scenario.gluing;
    if let Some(refusal) = gluing::refusal(spec, &exchange, instances) {
        let help = match refusal.would_work.as_slice() {
            [] => "no strategy of this version can glue these subsystems".into(),
            names => format!("these would work: {}", names.join(", ")),
        };
        let at = &["gluing", "strategy"];
        return Err(scenario.source.error_at_value(at, refusal.reason, Some(help)).into());
    }
    let can_start = |s: usize| instances[s].capabilities().has(Capabilities::FORCE | Capabilities::RETRY);
    let start =
        (exchange.glue.has_joints() && exchange.members().all(can_start)).then(|| gluing::start(spec));
    Ok(Some(Group { exchange, strategy: gluing::strategy(spec), start, closed: Vec::new() }))
}

fn hold(text: &str) -> Hold {
    match text {
        "constant" => Hold::Constant,
        "linear" => Hold::Linear,
        _ => Hold::End,
    }
}

/// The glue that the scenario declares, between bodies that exist.
fn glue(scenario: &Scenario, instances: &[Instance]) -> Result<Glue> {
    let mut glue = Glue::default();
    let source = &scenario.source;
    let wrong = |spec: &GlueSpec, message: String, help: Option<String>| {
        Error::from(source.error_at(spec.span.clone(), message, help))
    };
    let mut states: Vec<Vec<BodyState>> = Vec::new();
    for instance in instances {
        let mut own = vec![BodyState::REST; instance.scene().bodies.len()];
        instance.body_states(&mut own)?;
        states.push(own);
    }
    for spec in &scenario.glue {
        let mut ends = [None; 2];
        for (end, side) in ends.iter_mut().zip(&spec.sides).filter(|(_, side)| *side != "world") {
            let (name, body) = side.split_once('.').unwrap_or((side, ""));
            let slot = instances.iter().position(|i| i.name() == name);
            let found = slot
                .and_then(|s| Some((s, instances[s].scene().bodies.iter().position(|b| b.name == body)?)));
            let Some((slot, k)) = found else {
                let names: Vec<&str> = slot
                    .iter()
                    .flat_map(|s| instances[*s].scene().bodies.iter().map(|b| b.name.as_str()))
                    .collect();
                let help = scenario::did_you_mean(body, names.iter().copied());
                return Err(wrong(spec, format!("glue: body `{side}` does not exist"), help));
            };
            *end = Some((slot, k as u32));
        }
        let soil_at = |e: usize| ends[e].is_some_and(|(s, _)| instances[s].kind() == Kind::Soil);
        if soil_at(0) || soil_at(1) && !spec.contact {
            let message = "a soil is side 2 of glue of kind `contact`".into();
            return Err(wrong(spec, message, None));
        }
        if ends[0].map(|e| e.0) == ends[1].map(|e| e.0) {
            return Err(wrong(spec, "glue joins two different subsystems".into(), None));
        }
        let law = Law {
            t_min: if spec.contact { 0.0 } else { f64::NEG_INFINITY },
            t_max: spec.t_max,
            mu: if spec.contact { spec.mu } else { f64::INFINITY },
            compliance: spec.compliance,
        };
        let axes =
            if spec.contact { axes(spec.normal) } else { [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0] };
        let at = spec.at_m.or(if spec.contact && soil_at(1) {
            ends[0].map(|(s, b)| states[s][b as usize].world_from_body.position)
        } else {
            None
        });
        let (mask, turning, soil) = (spec.mask, spec.turning, soil_at(1));
        let (damping, contact) = (spec.damping, spec.contact);
        let recipe = Recipe { ends, at, mask, axes, turning, law, damping, contact, soil };
        glue.add(&recipe, |slot, body| states[slot][body as usize]);
    }
    Ok(glue)
}

/// n along a vector and two tangents: the first in the plane of n and x where that exists.
fn axes(normal: [f64; 3]) -> [f64; 9] {
    let size = normal.iter().map(|x| x * x).sum::<f64>().sqrt();
    let n = normal.map(|x| if size > 0.0 { x / size } else { 0.0 });
    let seed = if n[0].abs() < 0.9 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
    let along: f64 = (0..3).map(|k| seed[k] * n[k]).sum();
    let t = [0, 1, 2].map(|k| seed[k] - along * n[k]);
    let length = t.iter().map(|x| x * x).sum::<f64>().sqrt();
    let t = t.map(|x| x / length);
    let b = [n[1] * t[2] - n[2] * t[1], n[2] * t[0] - n[0] * t[2], n[0] * t[1] - n[1] * t[0]];
    [n[0], n[1], n[2], t[0], t[1], t[2], b[0], b[1], b[2]]
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
            || group.exchange.glue.is_empty()
    };
    let bodies: Vec<_> = group.exchange.body_slots().map(body).collect();
    let grounds: Vec<_> = group.exchange.ground_slots().filter(shown).map(ground).collect();
    ContactDetector::new(&bodies, &grounds, terrain)
}

/// The names that the report speaks of must exist.
fn check_report(scenario: &Scenario, directory: &Directory, instances: &[Instance]) -> Result {
    let source = &scenario.source;
    if let Some(name) = &scenario.report.commanded_speed
        && directory.find(name).is_none()
    {
        let help = directory.hint(name);
        let message = format!("variable `{name}` does not exist");
        return Err(source.error_at_value(&["report", "commanded_speed"], message, help).into());
    }
    if let Some(name) = &scenario.report.joint
        && directory.find(&format!("{name}.angle")).is_none()
    {
        let joints: Vec<&str> = directory.names().iter().filter_map(|n| n.strip_suffix(".angle")).collect();
        let help = scenario::did_you_mean(name, joints.iter().copied());
        let message = format!("joint `{name}` does not exist");
        return Err(source.error_at_value(&["report", "joint"], message, help).into());
    }
    if let Some(name) = &scenario.report.body {
        let bodies: Vec<String> = instances
            .iter()
            .flat_map(|i| i.scene().bodies.iter().map(move |b| format!("{}.{}", i.name(), b.name)))
            .collect();
        if !bodies.iter().any(|b| b == name) {
            let help = scenario::did_you_mean(name, bodies.iter().map(String::as_str));
            let message = format!("body `{name}` does not exist");
            return Err(source.error_at_value(&["report", "body"], message, help).into());
        }
    }
    Ok(())
}
