//! Variables and actions of the robot: numbering, description, reading, writing.

use crate::actuator::SETTINGS;
use crate::actuator::settings::{Group, Range};
use crate::balance::{energy, widest_gap};
use crate::initial;
use crate::joint::Kind;
use crate::math::euler;
use crate::model::Model;
use crate::motor::Motor;
use crate::state::{JointState, State};
use terraglue_subsystem::{Action, Causality, Effect, Error, JointVariables, Result, ValueType, Variable};

/// Ids per body and per joint.
const BODY_STRIDE: u32 = 32;
const JOINT_STRIDE: u32 = 128;

/// Meaning of an id.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Meaning {
    Body {
        body: usize,
        item: u32,
    },
    Joint {
        joint: usize,
        item: u32,
    },
    /// Of the whole robot: place in [`ROBOT_ITEMS`].
    Robot(usize),
    /// Number of dependent rows of loops.
    RedundantRows,
    /// Share of a divided link that this piece of it is.
    Share(usize),
    /// Of a connection beyond the tree: place in [`CLOSURE_ITEMS`].
    Closure {
        closure: usize,
        item: u32,
    },
}

/// Items of a body: 0–11 motion (of free bodies settable before the start), 12 contact force, 13–15 external force, 16–18
/// external moment, 19–21 where they act, 22–25 orientation.
const BODY_ITEMS: [(&str, &str, &str); 26] = [
    ("x", "m", "Position of the body frame"),
    ("y", "m", "Position of the body frame"),
    ("z", "m", "Position of the body frame"),
    ("roll", "rad", "z-y-x Euler angle about x"),
    ("pitch", "rad", "z-y-x Euler angle about y"),
    ("yaw", "rad", "z-y-x Euler angle about z"),
    ("vx", "m/s", "Velocity of the body frame's origin, world axes"),
    ("vy", "m/s", "Velocity of the body frame's origin, world axes"),
    ("vz", "m/s", "Velocity of the body frame's origin, world axes"),
    ("wx", "rad/s", "Angular velocity, world axes"),
    ("wy", "rad/s", "Angular velocity, world axes"),
    ("wz", "rad/s", "Angular velocity, world axes"),
    ("contact_normal", "N", "Sum of the normal forces of the ground on the body"),
    ("force_x", "N", "External force at the centre of mass, world axes"),
    ("force_y", "N", "External force at the centre of mass, world axes"),
    ("force_z", "N", "External force at the centre of mass, world axes"),
    ("moment_x", "N m", "External moment about the centre of mass, world axes"),
    ("moment_y", "N m", "External moment about the centre of mass, world axes"),
    ("moment_z", "N m", "External moment about the centre of mass, world axes"),
    ("force_at_x", "m", "Centre of mass, where the external force acts, axes of the body frame"),
    ("force_at_y", "m", "Centre of mass, where the external force acts, axes of the body frame"),
    ("force_at_z", "m", "Centre of mass, where the external force acts, axes of the body frame"),
    ("qw", "", "Orientation of the body frame as a unit quaternion, world from body: real part"),
    ("qx", "", "Orientation of the body frame as a unit quaternion, world from body: along x"),
    ("qy", "", "Orientation of the body frame as a unit quaternion, world from body: along y"),
    ("qz", "", "Orientation of the body frame as a unit quaternion, world from body: along z"),
];

const ANGLE: u32 = 0;
const VELOCITY: u32 = 1;
const TORQUE: u32 = 2;
const ANGLE_TARGET: u32 = 3;
const VELOCITY_TARGET: u32 = 4;
const TORQUE_TARGET: u32 = 5;
const MAX_TORQUE: u32 = 6;
const STIFFNESS: u32 = 7;
const DAMPING: u32 = 8;
const MOTOR: u32 = 9;
const BLOCKED: u32 = 10;
const BROKEN: u32 = 11;
const VOLTAGE_TARGET: u32 = 12;
/// First of [`ACTUATOR_ITEMS`] and of the settings of the actuator.
const ACTUATOR: u32 = 16;
const SETTING: u32 = 48;
/// First of [`REACTION_ITEMS`].
const REACTION: u32 = 120;

/// Reactions of every joint of the tree.
const REACTION_ITEMS: [(&str, &str, &str); 6] = [
    ("reaction_x", "N", "Force that the joint exerts on its child in the last step, world axes"),
    ("reaction_y", "N", "Force that the joint exerts on its child in the last step, world axes"),
    ("reaction_z", "N", "Force that the joint exerts on its child in the last step, world axes"),
    ("reaction_mx", "N m", "Moment on the child about the joint's origin, motor included, world axes"),
    ("reaction_my", "N m", "Moment on the child about the joint's origin, motor included, world axes"),
    ("reaction_mz", "N m", "Moment on the child about the joint's origin, motor included, world axes"),
];

/// Variable of an actuator: name, unit (of a joint that turns), group, help, value.
type ActuatorItem = (&'static str, &'static str, Group, &'static str, fn(&JointState) -> f64);

const ACTUATOR_ITEMS: [ActuatorItem; 14] = [
    ("power", "W", Group::All, "Mechanical power of the motor in the last step", |j| j.actuator.ledger.power),
    ("work", "J", Group::All, "Mechanical work of the motor since the start, signed", |j| {
        j.actuator.ledger.work
    }),
    ("electrical_power", "W", Group::All, "Power drawn in the last step", |j| {
        j.actuator.ledger.electrical_power
    }),
    ("electrical_energy", "J", Group::All, "Energy drawn since the start", |j| j.actuator.ledger.electrical),
    ("friction_torque", "N m", Group::Friction, "Friction in the last step", |j| j.actuator.ledger.friction),
    ("stop_torque", "N m", Group::Friction, "End stop and brake in the last step", |j| {
        j.actuator.ledger.stop
    }),
    ("friction_heat", "J", Group::Friction, "Lost in the joint's friction since the start", |j| {
        j.actuator.ledger.friction_heat
    }),
    ("current", "A", Group::Formula, "Current of the motor", |j| j.actuator.current),
    ("voltage", "V", Group::Formula, "Voltage at the motor", |j| j.actuator.voltage),
    ("motor_heat", "J", Group::Formula, "Drawn energy that is neither work nor stored", |j| {
        j.actuator.ledger.heat
    }),
    ("winding_heat", "J", Group::Dc, "Heat of the winding since the start", |j| {
        j.actuator.ledger.winding_heat
    }),
    ("gear_heat", "J", Group::Dc, "Heat of the gear since the start", |j| j.actuator.ledger.gear_heat),
    ("winding_temperature", "K", Group::Thermal, "Temperature of the winding", |j| j.actuator.winding_k),
    ("housing_temperature", "K", Group::Thermal, "Temperature of the housing", |j| j.actuator.housing_k),
];

/// Variables of the robot as a whole.
const ROBOT_ITEMS: [(&str, &str, &str); 17] = [
    ("energy.motor_work", "J", "Mechanical work of all motors since the start"),
    ("energy.electrical", "J", "Electrical energy drawn by all motors since the start"),
    ("energy.distance", "m", "Horizontal distance of the first body from its start"),
    ("energy.per_metre", "J/m", "Electrical energy / distance; 0 until 1 cm has been made"),
    ("supply.voltage", "V", "Voltage that feeds the motors"),
    ("supply.current", "A", "Current drawn from the supply in the last step"),
    ("contact.points", "", "Points that pressed in the last step, among the bodies and on rigid ground"),
    ("contact.residual", "", "Residual of the contact problem of the last step, relative to its data"),
    (
        "contact.lost",
        "J",
        "Lost in impacts and friction among the bodies and on rigid ground since the start",
    ),
    ("contact.yielding", "", "By how much rigid motors gave way at their largest torque, rad/s or m/s"),
    ("energy.kinetic", "J", "Kinetic energy of bodies and armatures"),
    ("energy.potential", "J", "Potential energy of bodies against the origin, and of springs"),
    ("energy.dissipated", "J", "Turned into heat since the start"),
    ("joints.gap", "", "Farthest that a joint or loop is out of place, m or rad"),
    ("battery.charge", "", "Share of the capacity that is left"),
    ("battery.lost", "J", "Lost in the internal resistance since the start"),
    ("battery.missing", "J", "Asked for beyond what the battery could give"),
];
/// Those before are there without a battery.
const WITHOUT_BATTERY: usize = 14;
/// Ids of connections beyond the tree; the one before is the number of dependent rows.
const CLOSURES: u32 = 1 << 24;
const CLOSURE_STRIDE: u32 = 8;
const CLOSURE_ITEMS: [(&str, &str, &str); 2] = [
    ("force", "N", "Magnitude of the force in the last step"),
    ("moment", "N m", "Magnitude of the moment in the last step"),
];
const CLOSURE_BROKEN: u32 = 2;
/// Ids of the shares of divided links, by body.
const SHARES: u32 = 1 << 25;
/// Below this distance an energy per metre is meaningless, m.
const SHORTEST: f64 = 1e-2;

/// All variables of a robot in ascending order of id.
pub(crate) fn describe(model: &Model, state: &State) -> Vec<Variable> {
    let mut all = Vec::new();
    for (b, body) in model.bodies.iter().enumerate() {
        for (item, (name, unit, help)) in BODY_ITEMS.iter().enumerate() {
            let causality = match item {
                13..19 => Causality::Input,
                19..22 => Causality::Local,
                _ => Causality::Output,
            };
            let id = b as u32 * BODY_STRIDE + item as u32;
            let v = Variable::real(id, format!("{}.{name}", body.name), unit, causality, help);
            all.push(if item < 12 && initial::is_free(model, b) { at_the_start(v) } else { v });
        }
    }
    let first = model.bodies.len() as u32 * BODY_STRIDE;
    for (j, joint) in model.joints.iter().enumerate() {
        let id = first + j as u32 * JOINT_STRIDE;
        if joint.moves() {
            let first = all.len();
            describe_moving(id, &joint.name, joint.kind, &mut all);
            if initial::has_coordinate(model, j) {
                all[first..].iter_mut().take(2).for_each(|v| *v = at_the_start(v.clone()));
            }
        }
        let help = "Whether the joint is gone for ever; true breaks it";
        all.push(flag(id + BROKEN, &joint.name, "broken", Causality::Parameter, help));
        if joint.moves() {
            describe_actuator(id, &joint.name, joint.kind, &state.joints[j], &mut all);
        }
        for (item, (what, unit, help)) in REACTION_ITEMS.iter().enumerate() {
            let (id, name) = (id + REACTION + item as u32, format!("{}.{what}", joint.name));
            all.push(Variable::real(id, name, unit, Causality::Output, help));
        }
    }
    let first = first + model.joints.len() as u32 * JOINT_STRIDE;
    let count = if state.supply.is_battery() { ROBOT_ITEMS.len() } else { WITHOUT_BATTERY };
    for (item, (name, unit, help)) in ROBOT_ITEMS[..count].iter().enumerate() {
        all.push(Variable::real(first + item as u32, *name, unit, Causality::Output, help));
    }
    describe_closures(model, &mut all);
    for (b, body) in model.bodies.iter().enumerate().filter(|(_, b)| b.share < 1.0) {
        let (id, name) = (SHARES + b as u32, format!("{}.link_share", body.name));
        let help = "Share of the link's mass and inertia in this piece of it, where `cut` divides the link";
        all.push(Variable::real(id, name, "", Causality::Local, help));
    }
    all
}

/// Variables that hold the values of a joint of the tree.
pub(crate) fn of_joint(model: &Model, j: usize) -> JointVariables {
    let id = model.bodies.len() as u32 * BODY_STRIDE + j as u32 * JOINT_STRIDE;
    let of = |item: u32| if model.joints[j].moves() { id + item } else { JointVariables::NONE };
    JointVariables {
        position: of(ANGLE),
        velocity: of(VELOCITY),
        torque: of(TORQUE),
        torque_limit: of(MAX_TORQUE),
        blocked: of(BLOCKED),
    }
}

/// Refuses names that two variables have: of things that are called alike, or like the robot's own.
pub(crate) fn check_names(all: &[Variable]) -> Result {
    let mut known = std::collections::BTreeSet::new();
    let Some(twice) = all.iter().find(|v| !known.insert(v.name.as_str())) else { return Ok(()) };
    let own: Vec<&str> = ROBOT_ITEMS.iter().filter_map(|(n, ..)| Some(n.split_once('.')?.0)).collect();
    let (name, own) = (&twice.name, own.iter().collect::<std::collections::BTreeSet<_>>());
    Err(Error::Refused(format!(
        "two variables would be called `{name}`: give links, joints and connections of the robot file and of objects \
         different names, other than {own:?} and `base` for the joint of a fixed base"
    )))
}

/// An output whose value before the first step can be given.
fn at_the_start(v: Variable) -> Variable {
    Variable { effect: Effect::NeedsReset, ..v }
}

fn describe_closures(model: &Model, all: &mut Vec<Variable>) {
    if model.closures.is_empty() {
        return;
    }
    let help = "Rows of loops that follow from the others, in the last step";
    all.push(Variable::real(CLOSURES - 1, "loops.redundant_rows", "", Causality::Output, help));
    for (c, closure) in model.closures.iter().enumerate() {
        let id = CLOSURES + c as u32 * CLOSURE_STRIDE;
        for (item, (what, unit, help)) in CLOSURE_ITEMS.iter().enumerate() {
            let name = format!("{}.{what}", closure.name);
            all.push(Variable::real(id + item as u32, name, unit, Causality::Output, help));
        }
        let help = "Whether it is gone for ever; true breaks it";
        all.push(flag(id + CLOSURE_BROKEN, &closure.name, "broken", Causality::Parameter, help));
    }
}

/// Variables of an actuator, and its data.
fn describe_actuator(id: u32, name: &str, kind: Kind, j: &JointState, all: &mut Vec<Variable>) {
    let unit = |of: &'static str| if kind == Kind::Prismatic { for_sliding(of) } else { of };
    let a = &j.actuator;
    let formula = a.has(Group::Formula) || a.has(Group::Dc);
    let has = |group: Group| if group == Group::Formula { formula } else { a.has(group) };
    let target = Variable::real(
        id + VOLTAGE_TARGET,
        format!("{name}.voltage_target"),
        "V",
        Causality::Input,
        "Voltage at the terminals of a motor in the mode `voltage`",
    );
    all.extend(Some(target).filter(|_| a.has(Group::Dc)));
    for (item, (what, of, _, help, _)) in ACTUATOR_ITEMS.iter().enumerate().filter(|(_, i)| has(i.2)) {
        let id = id + ACTUATOR + item as u32;
        all.push(Variable::real(id, format!("{name}.{what}"), unit(of), Causality::Output, help));
    }
    for (item, s) in SETTINGS.iter().enumerate().filter(|(_, s)| a.has(s.group)) {
        let (id, name) = (id + SETTING + item as u32, format!("{name}.{}", s.key));
        let variable = Variable::real(id, name, unit(s.unit), Causality::Parameter, s.help);
        all.push(match s.range {
            Range::NotNegative | Range::Positive => variable.within(0.0, f64::INFINITY),
            Range::Share | Range::UpToOne => variable.within(0.0, 1.0),
            Range::Any => variable,
        });
    }
}

/// The unit of a joint that slides for that of one that turns.
fn for_sliding(unit: &'static str) -> &'static str {
    match unit {
        "N m" => "N",
        "rad" => "m",
        "rad/s" => "m/s",
        "N m/rad" => "N/m",
        "N m s/rad" => "N s/m",
        "kg m^2" => "kg",
        "A/(N m)" => "A/N",
        "A s/rad" => "A s/m",
        "N m/A" => "N m/A",
        other => other,
    }
}

fn describe_moving(id: u32, name: &str, kind: Kind, all: &mut Vec<Variable>) {
    let slides = kind == Kind::Prismatic;
    let pick = |turns: &'static str, slides_unit: &'static str| if slides { slides_unit } else { turns };
    let (angle, rate, torque) = (pick("rad", "m"), pick("rad/s", "m/s"), pick("N m", "N"));
    let (stiffness, damping) = (pick("N m/rad", "N/m"), pick("N m s/rad", "N s/m"));
    let mut real = |item: u32, what: &str, unit: &str, causality: Causality, help: &str| {
        let v = Variable::real(id + item, format!("{name}.{what}"), unit, causality, help);
        all.push(if causality == Causality::Parameter { v.within(0.0, f64::INFINITY) } else { v });
    };
    real(ANGLE, "angle", angle, Causality::Output, "Coordinate of the joint");
    real(VELOCITY, "velocity", rate, Causality::Output, "Rate of the joint");
    real(TORQUE, "torque", torque, Causality::Output, "Torque of the motor in the last step");
    real(ANGLE_TARGET, "angle_target", angle, Causality::Input, "Where a position motor wants to be");
    real(VELOCITY_TARGET, "velocity_target", rate, Causality::Input, "Rate that the motor wants");
    real(TORQUE_TARGET, "torque_target", torque, Causality::Input, "Torque that a torque motor is to give");
    real(MAX_TORQUE, "max_torque", torque, Causality::Parameter, "Largest magnitude of the motor's torque");
    real(STIFFNESS, "stiffness", stiffness, Causality::Parameter, "Stiffness of the position motor");
    real(DAMPING, "damping", damping, Causality::Parameter, "Damping of the position motor");
    let motor =
        Variable::real(id + MOTOR, format!("{name}.motor"), "", Causality::Parameter, "How it is driven");
    all.push(motor.named(&Motor::NAMES));
    all.push(flag(id + BLOCKED, name, "blocked", Causality::Parameter, "Held at its coordinate"));
}

fn flag(id: u32, joint: &str, what: &str, causality: Causality, help: &str) -> Variable {
    Variable::real(id, format!("{joint}.{what}"), "", causality, help).typed(ValueType::Bool)
}

/// Action that begins to count work and heat afresh.
pub(crate) const RESTART: &str = "energy.restart";

/// All actions of a robot.
pub(crate) fn actions(model: &Model) -> Vec<Action> {
    let action =
        |name: &str, what: &str, help: &str| Action { name: format!("{name}.{what}"), help: help.into() };
    let help = "Count work, heat, drawn energy and distance from here on";
    let mut all = vec![Action { name: RESTART.into(), help: help.into() }];
    for joint in &model.joints {
        all.push(action(&joint.name, "break", "Remove the joint for ever"));
        if joint.moves() {
            all.push(action(&joint.name, "block", "Hold the joint at its coordinate"));
            all.push(action(&joint.name, "release", "Let a blocked joint move again"));
        }
    }
    all.extend(model.closures.iter().map(|c| action(&c.name, "break", "Remove it for ever")));
    all
}

/// Meaning of an id in this model.
pub(crate) fn meaning(model: &Model, id: u32) -> Result<Meaning> {
    let first = model.bodies.len() as u32 * BODY_STRIDE;
    let unknown = || Error::Refused(format!("there is no variable number {id}"));
    if let Some(body) = id.checked_sub(SHARES).map(|b| b as usize) {
        let known = model.bodies.get(body).is_some_and(|b| b.share < 1.0);
        return if known { Ok(Meaning::Share(body)) } else { Err(unknown()) };
    }
    if id >= CLOSURES {
        let (closure, item) = ((id - CLOSURES) / CLOSURE_STRIDE, (id - CLOSURES) % CLOSURE_STRIDE);
        let known = (closure as usize) < model.closures.len() && item <= CLOSURE_BROKEN;
        let meaning = Meaning::Closure { closure: closure as usize, item };
        return if known { Ok(meaning) } else { Err(unknown()) };
    }
    if id == CLOSURES - 1 && !model.closures.is_empty() {
        return Ok(Meaning::RedundantRows);
    }
    if id < first {
        let (body, item) = ((id / BODY_STRIDE) as usize, id % BODY_STRIDE);
        let known = (item as usize) < BODY_ITEMS.len();
        return if known { Ok(Meaning::Body { body, item }) } else { Err(unknown()) };
    }
    let (joint, item) = (((id - first) / JOINT_STRIDE) as usize, (id - first) % JOINT_STRIDE);
    if joint >= model.joints.len() {
        let item = (id - first) as usize - model.joints.len() * JOINT_STRIDE as usize;
        return if item < ROBOT_ITEMS.len() { Ok(Meaning::Robot(item)) } else { Err(unknown()) };
    }
    let told = ACTUATOR..ACTUATOR + ACTUATOR_ITEMS.len() as u32;
    let settings = SETTING..SETTING + SETTINGS.len() as u32;
    let reactions = REACTION..REACTION + REACTION_ITEMS.len() as u32;
    let of_moving = item <= VOLTAGE_TARGET || told.contains(&item) || settings.contains(&item);
    let of_all = item == BROKEN || reactions.contains(&item);
    let known = model.joints.get(joint).is_some_and(|j| of_all || (j.moves() && of_moving));
    if known { Ok(Meaning::Joint { joint, item }) } else { Err(unknown()) }
}

fn wrong_type(id: u32) -> Error {
    Error::Refused(format!("variable number {id} is of another type"))
}

/// Reads a number.
pub(crate) fn number(model: &Model, state: &State, id: u32) -> Result<f64> {
    match meaning(model, id)? {
        Meaning::Body { body, item } => Ok(body_number(model, state, body, item)),
        Meaning::Joint { joint, item: item @ REACTION.. } => {
            Ok(state.reactions[joint][(item - REACTION) as usize])
        }
        Meaning::Joint { joint, item } => {
            let j = &state.joints[joint];
            match item {
                ANGLE => Ok(j.angle),
                VELOCITY => Ok(j.velocity),
                TORQUE => Ok(j.torque),
                ANGLE_TARGET => Ok(j.angle_target),
                VELOCITY_TARGET => Ok(j.velocity_target),
                TORQUE_TARGET => Ok(j.torque_target),
                MAX_TORQUE => Ok(j.max_torque),
                STIFFNESS => Ok(j.stiffness),
                DAMPING => Ok(j.damping),
                VOLTAGE_TARGET => Ok(j.actuator.voltage_target),
                MOTOR..=BROKEN => Err(wrong_type(id)),
                ACTUATOR..SETTING => Ok(ACTUATOR_ITEMS[(item - ACTUATOR) as usize].4(j)),
                _ => Ok(j.actuator.settings[(item - SETTING) as usize]),
            }
        }
        Meaning::Robot(item) => Ok(robot_number(model, state, item)),
        Meaning::RedundantRows => Ok(state.redundant_rows as f64),
        Meaning::Share(body) => Ok(model.bodies[body].share),
        Meaning::Closure { item: CLOSURE_BROKEN, .. } => Err(wrong_type(id)),
        Meaning::Closure { closure, item } => {
            let s = &state.closures[closure];
            Ok(if item == 0 { s.force } else { s.moment })
        }
    }
}

fn robot_number(model: &Model, state: &State, item: usize) -> f64 {
    let distance = || match (state.start, state.bodies.first()) {
        (Some(start), Some(body)) => (body.c - start).xy().norm(),
        _ => 0.0,
    };
    match item {
        0 => state.joints.iter().map(|j| j.actuator.ledger.work).sum(),
        1 => state.energy.electrical,
        2 => distance(),
        3 if distance() < SHORTEST => 0.0,
        3 => state.energy.electrical / distance(),
        4 => state.supply.limit,
        5 => state.supply.current,
        6 => state.contact.points as f64,
        7 => state.contact.residual,
        8 => state.contact.lost,
        9 => state.contact.yielding,
        10 => energy(model, state).kinetic,
        11 => energy(model, state).potential,
        12 => state.energy.dissipated,
        13 => widest_gap(model, state),
        14 => state.supply.charge,
        15 => state.supply.lost,
        _ => state.supply.missing,
    }
}

fn body_number(model: &Model, state: &State, body: usize, item: u32) -> f64 {
    let m = &state.bodies[body];
    match item as usize {
        item @ 0..12 => motion_part(model, state, body, item / 3)[item % 3],
        12 => state.contact_normal[body],
        item @ 13..16 => state.loads[body].force[item - 13],
        item @ 16..19 => state.loads[body].moment[item - 16],
        item @ 19..22 => model.bodies[body].com[item - 19],
        item => [m.q.w, m.q.i, m.q.j, m.q.k][item - 22],
    }
}

/// Position, Euler angles, velocity or angular velocity of a body.
fn motion_part(model: &Model, state: &State, body: usize, part: usize) -> [f64; 3] {
    let (m, com) = (&state.bodies[body], &model.bodies[body].com);
    match part {
        0 => m.point(&-com).into(),
        1 => euler(&m.q),
        2 => (m.v - m.w.cross(&(m.q * com))).into(),
        _ => m.w.into(),
    }
}

/// Reads numbers. Bodies that are requested whole are read whole: a recording requests all.
pub(crate) fn numbers(model: &Model, state: &State, mut ids: &[u32], mut out: &mut [f64]) -> Result {
    let all = BODY_ITEMS.len();
    while let (Some(id), false) = (ids.first(), out.is_empty()) {
        let body = (id / BODY_STRIDE) as usize;
        let whole = id % BODY_STRIDE == 0
            && body < model.bodies.len()
            && ids.len().min(out.len()) >= all
            && ids[..all].iter().zip(*id..).all(|(k, wanted)| *k == wanted);
        let count = if whole { all } else { 1 };
        let (now, later) = std::mem::take(&mut out).split_at_mut(count);
        if whole {
            for part in 0..4 {
                now[3 * part..3 * part + 3].copy_from_slice(&motion_part(model, state, body, part));
            }
            (12..all).for_each(|item| now[item] = body_number(model, state, body, item as u32));
        } else {
            now[0] = number(model, state, *id)?;
        }
        (ids, out) = (&ids[count..], later);
    }
    Ok(())
}

/// Writes a number.
pub(crate) fn set_number(model: &Model, state: &mut State, id: u32, value: f64) -> Result {
    if !value.is_finite() {
        return Err(Error::Refused(format!("{value} is not a finite number")));
    }
    match meaning(model, id)? {
        Meaning::Body { body, item: item @ 13..16 } => {
            state.loads[body].force[item as usize - 13] = value;
            Ok(())
        }
        Meaning::Body { body, item: item @ 16..19 } => {
            state.loads[body].moment[item as usize - 16] = value;
            Ok(())
        }
        Meaning::Body { body, item: item @ 0..=11 } => {
            initial::set_body(model, state, body, item as usize, value)
        }
        Meaning::Body { item: 12, .. } => {
            Err(Error::Refused("the force of contacts can be read only".into()))
        }
        Meaning::Body { .. } => Err(Error::Refused(
            "the place of the centre of mass and the quaternion can be read only; before the first step roll, pitch and \
             yaw can be set".into(),
        )),
        Meaning::Share(_) => Err(Error::Refused("the share of a divided link can be read only".into())),
        Meaning::Robot(_) | Meaning::RedundantRows => {
            Err(Error::Refused("variables of the robot as a whole are read only".into()))
        }
        Meaning::Closure { item: CLOSURE_BROKEN, .. } => Err(wrong_type(id)),
        Meaning::Closure { .. } => Err(Error::Refused("what a connection carries can be read only".into())),
        Meaning::Joint { item: REACTION.., .. } => {
            Err(Error::Refused("what a joint carries can be read only".into()))
        }
        Meaning::Joint { joint, item: SETTING.. } => {
            let place = ((id - model.bodies.len() as u32 * BODY_STRIDE) % JOINT_STRIDE - SETTING) as usize;
            let s = &SETTINGS[place];
            if !s.range.accepts(value) {
                return Err(Error::Refused(format!("`{}` cannot be {value}: {}", s.key, s.help)));
            }
            state.joints[joint].actuator.settings[place] = value;
            Ok(())
        }
        Meaning::Joint { item: ACTUATOR..SETTING, .. } => {
            Err(Error::Refused("this variable of an actuator is read only".into()))
        }
        Meaning::Joint { joint, item: item @ (ANGLE | VELOCITY) } => {
            initial::set_joint(model, state, joint, item == VELOCITY, value)
        }
        Meaning::Joint { joint, item } => set_motor_number(&mut state.joints[joint], item, id, value),
    }
}

/// Writes a target or a limit of a motor.
fn set_motor_number(j: &mut JointState, item: u32, id: u32, value: f64) -> Result {
    let (slot, lowest) = match item {
        ANGLE_TARGET => (&mut j.angle_target, f64::NEG_INFINITY),
        VELOCITY_TARGET => (&mut j.velocity_target, f64::NEG_INFINITY),
        TORQUE_TARGET => (&mut j.torque_target, f64::NEG_INFINITY),
        MAX_TORQUE => (&mut j.max_torque, 0.0),
        STIFFNESS => (&mut j.stiffness, 0.0),
        DAMPING => (&mut j.damping, 0.0),
        VOLTAGE_TARGET => (&mut j.actuator.voltage_target, f64::NEG_INFINITY),
        TORQUE => return Err(Error::Refused("what the motor gave can be read only".into())),
        _ => return Err(wrong_type(id)),
    };
    if value < lowest {
        return Err(Error::Refused(format!("{value} is negative")));
    }
    *slot = value;
    Ok(())
}

/// Reads a flag.
pub(crate) fn flag_value(model: &Model, state: &State, id: u32) -> Result<bool> {
    match meaning(model, id)? {
        Meaning::Joint { joint, item: BLOCKED } => Ok(state.joints[joint].blocked.is_some()),
        Meaning::Joint { joint, item: BROKEN } => Ok(state.joints[joint].broken),
        Meaning::Closure { closure, item: CLOSURE_BROKEN } => Ok(state.closures[closure].broken),
        _ => Err(wrong_type(id)),
    }
}

/// Writes a flag.
pub(crate) fn set_flag(model: &Model, state: &mut State, id: u32, value: bool) -> Result {
    match meaning(model, id)? {
        Meaning::Joint { joint, item: BLOCKED } => block(state, joint, value),
        Meaning::Joint { joint, item: BROKEN } if value => {
            break_joint(state, joint);
            Ok(())
        }
        Meaning::Joint { joint, item: BROKEN } if state.joints[joint].broken => {
            Err(Error::Refused("the joint is broken: nothing mends it".into()))
        }
        Meaning::Joint { item: BROKEN, .. } => Ok(()),
        Meaning::Closure { closure, item: CLOSURE_BROKEN } if value => {
            break_closure(state, closure);
            Ok(())
        }
        Meaning::Closure { closure, item: CLOSURE_BROKEN } if state.closures[closure].broken => {
            Err(Error::Refused("it is broken: nothing mends it".into()))
        }
        Meaning::Closure { item: CLOSURE_BROKEN, .. } => Ok(()),
        _ => Err(wrong_type(id)),
    }
}

/// Blocks a joint where it stands, or lets it go.
pub(crate) fn block(state: &mut State, joint: usize, hold: bool) -> Result {
    let j = &mut state.joints[joint];
    if j.broken && hold {
        return Err(Error::Refused("the joint is broken: there is nothing to block".into()));
    }
    j.blocked = match (hold, j.blocked) {
        (true, Some(held)) => Some(held),
        (true, None) => Some(j.angle),
        (false, _) => None,
    };
    Ok(())
}

/// Removes a joint for ever.
pub(crate) fn break_joint(state: &mut State, joint: usize) {
    let j = &mut state.joints[joint];
    if !j.broken {
        // Energy of spring and armature is lost with the joint.
        let (spring, armature) = j.actuator.stored(j.angle);
        state.energy.dissipated += spring + armature;
    }
    (j.broken, j.velocity, j.torque, j.blocked) = (true, 0.0, 0.0, None);
    j.actuator.stop();
    state.reactions[joint] = [0.0; 6];
}

/// Removes a connection beyond the tree for ever; the energy of a spring is lost.
pub(crate) fn break_closure(state: &mut State, closure: usize) {
    let s = &mut state.closures[closure];
    state.energy.dissipated += s.stored;
    *s = crate::state::ClosureState { broken: true, ..Default::default() };
}

/// Reads the drive of a motor.
pub(crate) fn motor(model: &Model, state: &State, id: u32) -> Result<i64> {
    match meaning(model, id)? {
        Meaning::Joint { joint, item: MOTOR } => Ok(state.joints[joint].motor.index()),
        _ => Err(wrong_type(id)),
    }
}

/// Changes the drive of a motor.
pub(crate) fn set_motor(model: &Model, state: &mut State, id: u32, value: i64) -> Result {
    let Meaning::Joint { joint, item: MOTOR } = meaning(model, id)? else { return Err(wrong_type(id)) };
    let drive = Motor::from_index(value);
    let drive =
        drive.ok_or_else(|| Error::Refused(format!("there is no motor drive number {value} (0 to 5)")))?;
    state.joints[joint].motor = drive;
    Ok(())
}
