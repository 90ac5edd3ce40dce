//! Sight: after every step the committed world is shown to the subsystems that see.
//!
//! If no subsystem has sight there is no world, and a step costs nothing for it.

use super::run_clock::RunClock;
use super::schedule::Span;
use super::shown::Shown;
use super::subsystems::Subsystems;
use super::uncoupled::span;
use std::sync::Arc;
use std::time::Instant;
use terraglue_diagnostics::{Error, InputError, Result, did_you_mean};
use terraglue_gluing::timing::{Part, Timings};
use terraglue_host::{Instance, Workers, observe, shape_visibility};
use terraglue_scenario::{Scenario, SubsystemSpec};
use terraglue_subsystem::{BodyState, Capabilities, Mount, Step};
use terraglue_world::{Parallel, WorldBuilder, WorldModel, fixed_bodies};

/// The world of a run, where somebody looks at it.
#[derive(Default)]
pub(super) struct Sight {
    open: Option<Box<Open>>,
}

struct Open {
    world: WorldModel,
    /// Slots of those that see.
    seers: Vec<usize>,
    /// Fields `height`: slots and numbers of fields.
    grounds: Vec<(usize, usize)>,
    /// Slots of those that can hide shapes, with room for what is shown.
    shown: Vec<(usize, Vec<bool>)>,
    /// Slots of those that have bodies that move, with their states at the start of the step.
    before: Vec<(usize, Vec<BodyState>)>,
}

/// Error of the world about a scene.
fn odd(error: &terraglue_world::Error) -> Error {
    InputError::plain(format!("what can be seen: {error}"), None).into()
}

impl Sight {
    /// For the instances of a run.
    ///
    /// # Errors
    /// [`Error::Input`]: a scene that cannot be seen, or the mount of a sensor names no body.
    pub fn new(subsystems: &Subsystems, workers: &Arc<Workers>) -> Result<Self> {
        let instances = &subsystems.instances;
        let sees = |slot: &usize| instances[*slot].capabilities().has(Capabilities::SEES);
        let seers: Vec<usize> = (0..instances.len()).filter(sees).collect();
        if seers.is_empty() {
            return Ok(Self::default());
        }
        let mut builder = WorldBuilder::new();
        let (mut grounds, mut shown) = (Vec::new(), Vec::new());
        for (slot, (instance, member)) in instances.iter().zip(&subsystems.members).enumerate() {
            let (scene, states) = (instance.scene(), &member.states);
            let number = builder.subsystem(instance.name(), scene, states, &fixed_bodies(scene));
            let number = number.map_err(|e| odd(&e))?;
            if let Some(field) = instance.fields().iter().position(|f| f.name == "height") {
                builder.ground(number, &instance.fields()[field]).map_err(|e| odd(&e))?;
                grounds.push((slot, field));
            }
            if instance.capabilities().has(Capabilities::HIDES) {
                shown.push((slot, vec![true; scene.shapes.len()]));
            }
        }
        let workers = workers.clone();
        let parallel: Parallel = Arc::new(move |n, job| workers.parallel_for(n, job));
        builder.parallel(parallel);
        let world = builder.build(0.0);
        let moving = (0..instances.len()).filter(|slot| world.moves(*slot as u32));
        let before = moving.map(|slot| (slot, subsystems.members[slot].states.clone())).collect();
        Ok(Self { open: Some(Box::new(Open { world, seers, grounds, shown, before })) })
    }

    /// Keeps where bodies are before the step is committed.
    #[inline]
    pub fn before_commit(&mut self, subsystems: &Subsystems) {
        if let Some(open) = &mut self.open {
            for (slot, before) in &mut open.before {
                before.clone_from(&subsystems.members[*slot].states);
            }
        }
    }

    /// Shows the step from t to t + h that was committed.
    #[inline]
    pub fn after_commit(
        &mut self,
        clock: &RunClock,
        (h, end): (f64, f64),
        subsystems: &mut Subsystems,
        timings: &mut Timings,
    ) -> Result {
        match &mut self.open {
            None => Ok(()),
            Some(open) => open.show(&span(clock, h, end), subsystems, timings),
        }
    }

    /// Shows the start of the run, where nothing moves yet.
    pub fn begin(&mut self, clock: &RunClock, subsystems: &mut Subsystems) -> Result {
        self.before_commit(subsystems);
        let Some(open) = &mut self.open else { return Ok(()) };
        let step = Step::free(clock.t, 0.0, clock.index);
        open.update([clock.t; 2], subsystems)?;
        let Open { world, seers, .. } = open.as_ref();
        seers.iter().try_for_each(|slot| look(world, &mut subsystems.instances, *slot, &step))
    }
}

impl Open {
    fn show(&mut self, span: &Span, subsystems: &mut Subsystems, timings: &mut Timings) -> Result {
        let Subsystems { schedules, .. } = &*subsystems;
        if !self.seers.iter().any(|slot| schedules[*slot].step_of(span).is_some()) {
            return Ok(());
        }
        let start = Instant::now();
        self.update([span.step.t, span.step.t + span.step.h], subsystems)?;
        timings.charge(Part::World, start);
        let Subsystems { instances, schedules, members } = subsystems;
        for slot in &self.seers {
            if let Some(step) = schedules[*slot].step_of(span) {
                let start = Instant::now();
                look(&self.world, instances, *slot, &step)?;
                timings.charge(Part::Observe, start);
                members[*slot].cost += start.elapsed();
            }
        }
        Ok(())
    }

    /// Takes what the step has changed.
    fn update(&mut self, interval: [f64; 2], subsystems: &Subsystems) -> Result {
        let Subsystems { instances, members, .. } = subsystems;
        let mut update = self.world.update(interval);
        for (slot, before) in &self.before {
            update.bodies(*slot as u32, before, &members[*slot].states).map_err(|e| odd(&e))?;
        }
        for (slot, shown) in &mut self.shown {
            shape_visibility(&instances[*slot], shown)?;
            update.visibility(*slot as u32, shown).map_err(|e| odd(&e))?;
        }
        for (slot, field) in &self.grounds {
            let instance: &Instance = &instances[*slot];
            let tile = |a: u32, b: u32| instance.field_tile(*field, a, b).ok();
            update.ground(*slot as u32, tile).map_err(|e| odd(&e))?;
        }
        Ok(())
    }
}

fn look(world: &WorldModel, instances: &mut [Instance], slot: usize, step: &Step) -> Result {
    match Shown::to(world, instances, slot) {
        Some((instance, shown)) => observe(instance, step, &shown),
        None => Ok(()),
    }
}

/// Refuses the mount on a body that there is not.
pub(super) fn check_mount(scenario: &Scenario, spec: &SubsystemSpec, instances: &[Instance]) -> Result {
    let Some(name) = spec.parameters.get(Mount::KEY).and_then(|v| v.as_str()) else { return Ok(()) };
    let wrong = |message: String, help: Option<String>| -> Result {
        Err(scenario.source.error_at_value(&[&spec.name, Mount::KEY], message, help).into())
    };
    let (subsystem, body) = name.split_once('.').unwrap_or((name, ""));
    let with_bodies = || instances.iter().filter(|i| !i.scene().bodies.is_empty());
    let Some(found) = instances.iter().find(|i| i.name() == subsystem) else {
        let help = did_you_mean(subsystem, with_bodies().map(Instance::name));
        return wrong(format!("there is no subsystem `{subsystem}` to sit on"), help);
    };
    let names = || found.scene().bodies.iter().map(|b| b.name.as_str());
    if names().any(|n| n == body) {
        return Ok(());
    }
    wrong(format!("`{subsystem}` has no body `{body}` to sit on"), did_you_mean(body, names()))
}
