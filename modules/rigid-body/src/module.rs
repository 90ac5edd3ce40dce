//! The module: from parameters to an instance.

use crate::actuator::battery::Supply;
use crate::actuator::curve::Mode;
use crate::actuator::{Actuator, Item, configure};
use crate::closure::configure::closures;
use crate::contact::bodies::ContactLaw;
use crate::contact::plane::Plane;
use crate::contact::surfaces::Surfaces;
use crate::cut;
use crate::dynamics::Dynamics;
use crate::dynamics::scheme::{Acceleration, Integrator, Weights};
use crate::joint::Kind;
use crate::math::V3;
use crate::model::Model;
use crate::motion::Motion;
use crate::motor::Motor;
use crate::objects;
use crate::placement::{StartRates, at_rest, base_pose, clearance, coordinates, joint_rates, set_moving};
use crate::robot::Robot;
use crate::state::{ClosureState, JointState, Load, State};
use nalgebra::Isometry3;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use terraglue_robot_import::{
    Coupling, Drive, DriveKind, Heights, Options, Shape, ShapeGeometry, read_robot,
};
use terraglue_subsystem::{Config, Error, Host, LogLevel, Module, Result, Schema, Subsystem};

/// Rigid bodies with joints and motors, read from a robot file.
#[derive(Clone, Copy, Debug, Default)]
pub struct RigidBody;

impl Module for RigidBody {
    fn schema() -> Schema {
        crate::schema::schema()
    }

    fn instantiate(config: &Config, host: Arc<dyn Host>) -> Result<Box<dyn Subsystem>> {
        let said = config;
        let config = config.clone().with_defaults(&Self::schema());
        let fixed = config.flag("fixed_base")?;
        let folder = Path::new(host.folder());
        let options = Options {
            fixed_base: fixed,
            packages: packages(&config, folder),
            strict: config.flag("strict")?,
            ..Options::default()
        };
        let options = options.with_ros_package_path();
        let file = read_robot(&folder.join(config.text("model")?), &options);
        let mut file = file.map_err(|e| Error::Refused(e.to_string()))?;
        let base = base_pose(&vector(&config, "position_m")?, config.number("heading_rad")?);
        let own = file.bodies.len();
        objects::attach(&config, (folder, &options), &base, &mut file)?;
        let mut model = Model { own, ..Model::new(&file, &base, fixed, V3::from(host.gravity())) };
        set_kinds(&config, &mut model)?;
        model.world_shapes.extend(stone(&config, &*host)?);
        let mut angles = coordinates(&model, &config.number_table("joints")?)?;
        follow(&model, &file.couplings, &mut angles)?;
        let rates = StartRates {
            velocity: vector(&config, "velocity_m_s")?,
            rotation: vector(&config, "rotation_rate_rad_s")?,
            joints: joint_rates(&model, &config.number_table("joint_rates")?)?,
        };
        let mut bodies = start(&config, &*host, &mut model, base, (&angles, &rates))?;
        let mut joints = joint_states((&config, said), &model, &angles, &rates.joints)?;
        without_own_motor(said, &model, &file.couplings, &mut joints);
        let whole =
            cut::Start { model: &mut model, bodies: &mut bodies, angles: &mut angles, joints: &mut joints };
        cut::keep(&config, &base, whole, &mut file)?;
        model.closures = closures(&config, &model, (&bodies, &angles), (&file.couplings, &file.loops))?;
        file.warnings.iter().for_each(|w| host.log(LogLevel::Warning, w));
        file.notices.iter().for_each(|n| host.log(LogLevel::Info, n));
        let mut state = committed(&model, bodies, joints, configure::supply(&config)?);
        host.log(LogLevel::Info, &summary(&file.name, &model));
        let integrator = integrator(&config)?;
        let mut dynamics =
            Dynamics::new(model, integrator, &state.bodies).map_err(|e| Error::Failed(e.to_string()))?;
        let ground = ground(&config)?;
        if integrator.is_second_order() {
            let planes = config.text("ground")? != "none" || !dynamics.model.planes.is_empty();
            without_impacts(&*host, planes, dynamics.contacts.watches())?;
            without_rebound(&dynamics.model, &state)?;
        }
        let law = ContactLaw::from_config(&config)?;
        let surfaces = Surfaces::from_config(&config, &dynamics.model)?;
        dynamics.contacts.set_surroundings(law, surfaces, ground);
        close_loops(&*host, &mut dynamics, &mut state)?;
        Ok(Box::new(Robot::new(host, dynamics, state)?))
    }
}

/// The state of a robot of these bodies and joints before its first step.
fn committed(model: &Model, bodies: Vec<Motion>, joints: Vec<JointState>, supply: Supply) -> State {
    State {
        loads: vec![Load::default(); bodies.len()],
        reactions: vec![[0.0; 6]; model.joints.len()],
        contact_normal: vec![0.0; bodies.len()],
        accelerations: vec![Acceleration::default(); bodies.len()],
        bodies,
        joints,
        closures: vec![ClosureState::default(); model.closures.len()],
        supply,
        ..State::default()
    }
}

/// Summary of a robot for the log.
fn summary(name: &str, model: &Model) -> String {
    let (bodies, joints) = (model.bodies.len(), model.joints.len());
    format!("{name}: {bodies} bodies, {joints} joints, {:.6} kg", model.mass())
}

/// Counts the redundant rows of loops, and removes from the initial rates the parts that loops do not allow.
fn close_loops(host: &dyn Host, dynamics: &mut Dynamics, state: &mut State) -> Result<()> {
    if dynamics.model.closures.is_empty() {
        return Ok(());
    }
    let changed = dynamics.project_rates(state).map_err(|e| Error::Failed(e.to_string()))?;
    if state.redundant_rows > 0 {
        let text = format!(
            "loops: {} of their rows follow from the others; forces there are one of many choices",
            state.redundant_rows
        );
        host.log(LogLevel::Warning, &text);
    }
    if changed > 1e-9 {
        let text = format!("loops: initial rates changed by up to {changed:.3e} (m/s or rad/s) to fit them");
        host.log(LogLevel::Warning, &text);
    }
    Ok(())
}

/// Kinds of joints that the robot file has no word for.
fn set_kinds(config: &Config, model: &mut Model) -> Result<()> {
    let names: Vec<String> = model.joints.iter().map(|j| j.name.clone()).collect();
    let kind =
        |name: &String| configure::text(config, model, "joint_kind", name).map(|k| k.map(str::to_owned));
    let kinds = names.iter().map(kind).collect::<Result<Vec<_>>>()?;
    for (joint, kind) in model.joints.iter_mut().zip(kinds).filter(|(j, _)| j.moves()) {
        joint.kind = match kind.as_deref() {
            Some("cylindrical") => Kind::Cylindrical,
            Some("universal") => Kind::Universal,
            Some("spherical") => Kind::Spherical,
            Some("planar") => Kind::Planar,
            _ => continue,
        };
        joint.limits = None;
    }
    Ok(())
}

/// The rigid ground, if there is one.
fn ground(config: &Config) -> Result<Option<Plane>> {
    if config.text("ground")? != "half-space" {
        return Ok(None);
    }
    let n = config.numbers("ground_normal")?;
    let refused = || Error::Refused(format!("parameter `ground_normal` = {n:?} is not a direction x, y, z"));
    let [x, y, z] = n[..] else { return Err(refused()) };
    let normal = V3::new(x, y, z);
    let length = normal.norm();
    if !length.is_finite() || length < 1e-9 {
        return Err(refused());
    }
    let offset = config.number("ground_height_m")?;
    Ok(Some(Plane { normal: normal / length, offset, friction: None }))
}

/// The scenario's terrain as rigid ground, where that is wanted.
fn stone(config: &Config, host: &dyn Host) -> Result<Option<Shape>> {
    if config.text("ground")? != "terrain" {
        return Ok(None);
    }
    let missing = "parameter `ground` = \"terrain\" needs a [terrain] in the scenario";
    let terrain = host.terrain().ok_or_else(|| Error::Refused(missing.into()))?;
    let (origin, spacing, nodes) = (terrain.origin(), terrain.spacing(), terrain.size().map(|n| n as usize));
    if nodes.iter().any(|n| *n < 2) {
        return Err(Error::Refused(
            "parameter `ground` = \"terrain\": the terrain has fewer than 2 nodes".into(),
        ));
    }
    let mut heights = vec![0.0; nodes[0] * nodes[1]];
    terrain.heights(0, 0, nodes[0], nodes[1], &mut heights);
    let lengths = nodes.map(|n| (n - 1) as f64 * spacing);
    let middle = Isometry3::translation(origin[0] + lengths[0] / 2.0, origin[1] + lengths[1] / 2.0, 0.0);
    Ok(Some(Shape {
        name: "terrain".into(),
        geometry: ShapeGeometry::Heights(Arc::new(Heights { nodes, lengths, heights })),
        body_from_shape: middle,
        collides: true,
        friction: None,
        group: 1,
        mask: 1,
    }))
}

/// Folders of packages by name.
fn packages(config: &Config, folder: &Path) -> Vec<(String, PathBuf)> {
    let table = config.get("packages").and_then(|v| v.as_object());
    let entries = table.into_iter().flatten();
    entries.filter_map(|(name, path)| Some((name.clone(), folder.join(path.as_str()?)))).collect()
}

/// Gives joints that follow others in the robot file their coordinates, leaders first.
fn follow(model: &Model, couplings: &[Coupling], angles: &mut [f64]) -> Result<()> {
    // A chain of followers is as long as there are couplings at most.
    for _ in couplings {
        couplings.iter().for_each(|c| {
            angles[model.joint_of_file(c.follower)] =
                c.ratio * angles[model.joint_of_file(c.leader)] + c.offset
        });
    }
    let outside = |c: &&Coupling| {
        let (joint, angle) =
            (&model.joints[model.joint_of_file(c.follower)], angles[model.joint_of_file(c.follower)]);
        joint.limits.is_some_and(|[low, high]| angle < low || angle > high)
    };
    match couplings.iter().find(outside) {
        None => Ok(()),
        Some(c) => Err(Error::Refused(format!(
            "parameter `joints`: joint `{}` follows `{}` to {} at the start, outside its limits",
            model.joints[model.joint_of_file(c.follower)].name,
            model.joints[model.joint_of_file(c.leader)].name,
            angles[model.joint_of_file(c.follower)]
        ))),
    }
}

/// A joint that follows another has no motor unless the scenario names it.
fn without_own_motor(said: &Config, model: &Model, couplings: &[Coupling], joints: &mut [JointState]) {
    let named =
        |name: &str| said.get("motor").and_then(|v| v.as_object()).is_some_and(|t| t.contains_key(name));
    for c in
        couplings.iter().map(|c| model.joint_of_file(c.follower)).filter(|j| !named(&model.joints[*j].name))
    {
        joints[c].motor = Motor::Off;
    }
}

/// A parameter with x, y, z.
fn vector(config: &Config, name: &str) -> Result<V3> {
    match config.numbers(name)?[..] {
        [x, y, z] if x.is_finite() && y.is_finite() && z.is_finite() => Ok(V3::new(x, y, z)),
        ref other => Err(Error::Refused(format!("parameter `{name}` = {other:?} is not a list of x, y, z"))),
    }
}

fn integrator(config: &Config) -> Result<Integrator> {
    let rho = config.number("rho_infinity")?;
    Ok(match config.text("integrator")? {
        "generalized-alpha" => Integrator::GeneralizedAlpha(Weights::new(rho)),
        "energy-momentum" => Integrator::EnergyMomentum,
        _ => Integrator::SymplecticEuler,
    })
}

/// End stops that throw back need impulses, too.
fn without_rebound(model: &Model, state: &State) -> Result<()> {
    let rebounds = |j: &crate::state::JointState| j.actuator[crate::actuator::Item::LimitRestitution] > 0.0;
    match state.joints.iter().position(rebounds) {
        None => Ok(()),
        Some(j) => Err(Error::Refused(format!(
            "parameter `actuator.limit_restitution` of joint `{}` does not go with an `integrator` of second order: \
             what hits needs \"symplectic-euler\"",
            model.joints[j].name
        ))),
    }
}

/// Impacts need impulses, which the second-order option does not have.
fn without_impacts(host: &dyn Host, ground: bool, pairs: bool) -> Result<()> {
    if ground {
        return Err(Error::Refused(
            "an `integrator` of second order does not go with rigid `ground`: what hits needs \"symplectic-euler\""
                .into(),
        ));
    }
    if pairs {
        let text = "an integrator of second order does not keep the robot's own bodies apart; \
                    \"symplectic-euler\" does";
        host.log(LogLevel::Warning, text);
    }
    Ok(())
}

/// Bodies in the initial pose with their rates, on the ground where that is wanted and there is one.
fn start(
    config: &Config,
    host: &dyn Host,
    model: &mut Model,
    mut base: Isometry3<f64>,
    (angles, rates): (&[f64], &StartRates),
) -> Result<Vec<Motion>> {
    let mut bodies = at_rest(model, &base, angles);
    let terrain = host.terrain().filter(|_| model.free.iter().any(Option::is_some));
    if let Some(terrain) = terrain.filter(|_| config.flag("place_on_ground").unwrap_or(true)) {
        let before = base;
        base.translation.vector.z -= clearance(model, &bodies[..model.own], terrain).unwrap_or(0.0);
        // Objects stay where the scenario puts them.
        let own = model.own;
        model.free[own..].iter_mut().flatten().for_each(|pose| *pose = base.inverse() * before * *pose);
        bodies = at_rest(model, &base, angles);
    }
    set_moving(model, &base, rates, &mut bodies);
    Ok(bodies)
}

fn joint_states(
    config: (&Config, &Config),
    model: &Model,
    angles: &[f64],
    rates: &[f64],
) -> Result<Vec<JointState>> {
    let states = model.joints.iter().zip(angles.iter().zip(rates));
    let start = |(joint, (angle, rate)): (&crate::joint::Joint, (&f64, &f64))| {
        Ok(JointState { velocity: *rate, ..joint_state(config, model, joint, *angle)? })
    };
    states.map(start).collect()
}

/// `said`: the scenario without defaults; the robot file fills its gaps.
fn joint_state(
    (config, said): (&Config, &Config),
    model: &Model,
    joint: &crate::joint::Joint,
    angle: f64,
) -> Result<JointState> {
    let (data, joint) = (joint.data, joint.name.as_str());
    let drive = data.drive;
    let silent = |key: &str| said.get(key).is_none();
    let given = drive.filter(|_| silent("motor")).map(|d| match d.kind {
        DriveKind::Position => "position",
        DriveKind::Velocity => "velocity",
        DriveKind::Torque => "torque",
    });
    let name = match given {
        Some(name) => name,
        None => configure::text(config, model, "motor", joint)?.unwrap_or("off"),
    };
    let motor = Motor::from_name(name).ok_or_else(|| {
        Error::Refused(format!("parameter `motor` = `{name}` is none of {:?}", Motor::NAMES))
    })?;
    let number = |name: &str, given: Option<f64>| match given.filter(|_| silent(name)) {
        Some(given) => Ok::<f64, Error>(given),
        None => Ok(configure::number(config, model, name, joint)?.unwrap_or(0.0)),
    };
    let gain = |of: fn(&Drive) -> f64| drive.as_ref().filter(|d| d.kind == DriveKind::Position).map(of);
    let mut from_file = Actuator::default();
    for (item, value) in [
        (Item::ViscousFriction, data.damping),
        (Item::CoulombFriction, data.friction),
        (Item::Armature, data.armature),
        (Item::SpringStiffness, data.stiffness),
        (Item::SpringReference, data.reference),
    ] {
        from_file.settings[item as usize] = value;
    }
    Ok(JointState {
        angle,
        velocity: 0.0,
        torque: 0.0,
        angle_target: angle,
        velocity_target: number("velocity_target", None)?,
        torque_target: number("torque_target", None)?,
        max_torque: number("max_torque", drive.and_then(|d| d.max_torque))?,
        stiffness: number("stiffness", gain(|d| d.stiffness))?,
        damping: number("damping", gain(|d| d.damping))?,
        motor,
        blocked: None,
        broken: false,
        mode: Mode::Free,
        actuator: configure::actuator(config, model, joint, from_file)?,
    })
}
