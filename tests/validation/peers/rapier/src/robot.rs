//! Robots from URDF as Rapier's bodies, revolute joints (impulse joints) and spheres.

use crate::Outcome;
use rapier3d_f64::prelude::*;
use std::path::Path;
use urdf_rs::{Geometry, JointType};

/// A joint: its bodies, its place in the parent and its axis in the child.
pub struct Hinge {
    pub joint: ImpulseJointHandle,
    pub parent: RigidBodyHandle,
    pub child: RigidBodyHandle,
    pub place: Pose,
    pub axis: Vector,
}

/// A robot in a world.
pub struct Robot {
    pub hinges: Vec<Hinge>,
    /// Root, then the child of each hinge.
    pub bodies: Vec<RigidBodyHandle>,
    /// Bodies with a sphere, and its centre there.
    pub feet: Vec<(RigidBodyHandle, Vector)>,
}

/// A world with steps of 1 ms and Rapier's own settings otherwise.
pub fn world(gravity: [f64; 3], h: f64) -> PhysicsWorld {
    let mut world = PhysicsWorld::new();
    world.gravity = Vector::from_array(gravity);
    world.integration_parameters.dt = h;
    world
}

/// Diagonal moments about a centre of mass.
pub fn mass_of(com: [f64; 3], mass: f64, moments: [f64; 3]) -> MassProperties {
    MassProperties::new(Vector::from_array(com), mass, Vector::from_array(moments))
}

/// A place in a parent.
fn pose(p: &urdf_rs::Pose) -> Pose {
    let [r, q, y] = *p.rpy;
    let turn = |axis: Vector, angle: f64| Pose::rotation(axis * angle);
    Pose::from_translation(Vector::from_array(*p.xyz))
        * turn(Vector::Z, y)
        * turn(Vector::Y, q)
        * turn(Vector::X, r)
}

/// Reads a robot with revolute joints, parents before children, and sets it at `base`; `angle` gives a joint's angle.
pub fn read(
    world: &mut PhysicsWorld,
    path: &Path,
    base: Option<Pose>,
    angle: impl Fn(&str) -> f64,
) -> Outcome<Robot> {
    let file = urdf_rs::read_file(path).map_err(|e| format!("{}: {e}", path.display()))?;
    let mut robot = Robot { hinges: Vec::new(), bodies: Vec::new(), feet: Vec::new() };
    let root = &file.links.first().ok_or("no link")?.name;
    let mut poses = vec![(root.clone(), base.unwrap_or_default())];
    let handle = insert(world, &file, root, poses[0].1, &mut robot, base.is_none())?;
    let mut handles = vec![handle];
    for joint in
        file.joints.iter().filter(|j| matches!(j.joint_type, JointType::Revolute | JointType::Continuous))
    {
        let at = poses.iter().position(|(n, _)| *n == joint.parent.link);
        let at = at.ok_or_else(|| format!("joint {} stands before its parent", joint.name))?;
        let (place, axis) = (pose(&joint.origin), Vector::from_array(*joint.axis.xyz).normalize());
        let here = poses[at].1 * place * Pose::rotation(axis * angle(&joint.name));
        let child = insert(world, &file, &joint.child.link, here, &mut robot, false)?;
        // Rapier's hinges turn about x.
        let along = Pose::from_rotation(Rotation::from_rotation_arc(Vector::X, axis));
        let data = GenericJointBuilder::new(JointAxesMask::LOCKED_REVOLUTE_AXES)
            .local_frame1(place * along)
            .local_frame2(along)
            .contacts_enabled(false);
        let handle = world.insert_impulse_joint(handles[at], child, data);
        robot.hinges.push(Hinge { joint: handle, parent: handles[at], child, place, axis });
        poses.push((joint.child.link.clone(), here));
        handles.push(child);
    }
    Ok(robot)
}

fn insert(
    world: &mut PhysicsWorld,
    file: &urdf_rs::Robot,
    name: &str,
    here: Pose,
    robot: &mut Robot,
    fixed: bool,
) -> Outcome<RigidBodyHandle> {
    let link = file.links.iter().find(|l| l.name == name).ok_or_else(|| format!("no link {name}"))?;
    let (m, i) = (link.inertial.mass.value, &link.inertial.inertia);
    let body = if fixed { RigidBodyBuilder::fixed() } else { RigidBodyBuilder::dynamic() };
    let mass = mass_of(*link.inertial.origin.xyz, m, [i.ixx, i.iyy, i.izz]);
    let handle = world.insert_body(body.pose(here).additional_mass_properties(mass).can_sleep(false));
    if !fixed {
        robot.bodies.push(handle);
    }
    for collision in &link.collision {
        let Geometry::Sphere { radius } = collision.geometry else { continue };
        let at = Vector::from_array(*collision.origin.xyz);
        let ball = ColliderBuilder::ball(radius).translation(at).density(0.0).friction(0.8);
        world.insert_collider(ball, Some(handle));
        robot.feet.push((handle, at));
    }
    Ok(handle)
}

/// Kinetic and potential energy, J.
pub fn energy(world: &PhysicsWorld, bodies: &[RigidBodyHandle]) -> f64 {
    let one = |handle: &RigidBodyHandle| {
        let body = &world.bodies[*handle];
        let (v, w) = (body.linvel(), body.rotation().inverse() * body.angvel());
        let mass = &body.mass_properties().local_mprops;
        let w = mass.principal_inertia_local_frame.inverse() * w;
        let spin = 0.5 * (mass.principal_inertia() * w).dot(w);
        0.5 * body.mass() * v.length_squared() + spin - body.mass() * world.gravity.dot(body.center_of_mass())
    };
    bodies.iter().map(one).sum()
}
