//! Boxes on an incline, a stack, a tonne on a kilogram, a spinning body, passive chains.

use crate::robot::{energy, mass_of, read, world};
use crate::{Outcome, figure};
use rapier3d_f64::{na, prelude::*};
use std::path::Path;

const H: f64 = 1e-3;
const G: f64 = 9.81;

fn run(world: &mut PhysicsWorld, seconds: f64) {
    (0..(seconds / H).round() as usize).for_each(|_| world.step());
}

/// Free boxes (mass, half extents, height of the centre) on the plane z = 0.
fn boxes(
    gravity: [f64; 3],
    friction: f64,
    of: &[(f64, [f64; 3], f64)],
) -> (PhysicsWorld, Vec<RigidBodyHandle>) {
    let mut world = world(gravity, H);
    world.insert_collider(
        ColliderBuilder::halfspace(na::Unit::new_unchecked(Vector::Z)).friction(friction),
        None,
    );
    let one = |(mass, [x, y, z], height): &(f64, [f64; 3], f64)| {
        let body = RigidBodyBuilder::dynamic().translation(Vector::new(0.0, 0.0, *height)).can_sleep(false);
        world.insert(body, ColliderBuilder::cuboid(*x, *y, *z).mass(*mass).friction(friction)).0
    };
    let handles = of.iter().map(one).collect();
    (world, handles)
}

fn incline(degrees: f64) -> (PhysicsWorld, RigidBodyHandle) {
    let a = degrees.to_radians();
    let (world, handles) = boxes([G * a.sin(), 0.0, -G * a.cos()], 0.5, &[(1.0, [0.1, 0.1, 0.05], 0.05)]);
    (world, handles[0])
}

/// All contact cases.
pub fn contacts() {
    let (mut world, body) = incline(20.0);
    run(&mut world, 5.0);
    let before = world.bodies[body].translation().x;
    run(&mut world, 5.0);
    let creep = (world.bodies[body].translation().x - before).abs() / 5.0;
    figure("incline.creep", 1e3 * creep, "box on 20° with μ = 0.5: creep, mm/s");
    let (mut world, body) = incline(35.0);
    run(&mut world, 2.0);
    let error = world.bodies[body].translation().x / 2.0 / 1.608_844_063_366_257 - 1.0;
    figure("incline.acceleration", error.abs(), "box on 35° with μ = 0.5: error of 2x/t²");
    let stack: Vec<_> = (0..10).map(|k| (1.0, [0.1; 3], 0.1 + 0.2 * f64::from(k))).collect();
    for (name, bodies) in
        [("stack.sink", stack), ("heavy.sink", vec![(1.0, [0.1; 3], 0.1), (1000.0, [0.1; 3], 0.3)])]
    {
        let (mut world, handles) = boxes([0.0, 0.0, -G], 0.6, &bodies);
        let top = handles[handles.len() - 1];
        let start = world.bodies[top].translation().z;
        run(&mut world, 5.0);
        let sink = (world.bodies[top].translation().z - start).abs();
        figure(name, 1e3 * sink, "5 s: sink of the top, mm");
    }
}

/// The intermediate axis over a minute.
pub fn spin() {
    let moments = Vector::new(0.1, 0.2, 0.3);
    let mut world = world([0.0; 3], H);
    let body = RigidBodyBuilder::dynamic().angvel(Vector::new(0.01, 10.0, 0.01)).can_sleep(false);
    let handle = world.insert_body(body.additional_mass_properties(mass_of([0.0; 3], 1.0, moments.into())));
    let mut state = |step: bool| {
        if step {
            world.step();
        }
        let body = &world.bodies[handle];
        let w = body.rotation().inverse() * body.angvel();
        (0.5 * (moments * w).dot(w), *body.rotation() * (moments * w), w.y)
    };
    let (e0, l0, mut last) = state(false);
    let (mut energy, mut turn, mut flips) = (0.0_f64, 0.0_f64, 0.0);
    for _ in 0..60_000 {
        let (e, l, rate) = state(true);
        energy = energy.max((e / e0 - 1.0).abs());
        turn = turn.max((l - l0).length() / l0.length());
        flips += f64::from(rate * last < 0.0);
        last = rate;
    }
    figure("dzhanibekov.energy", energy, "free body, 60 s: largest |ΔE|/E");
    figure("dzhanibekov.momentum", turn, "the same: largest |ΔL|/L");
    figure("dzhanibekov.flips", flips, "sign changes of the middle rate");
}

/// A passive chain for ten seconds from rest.
pub fn chain(folder: &Path, name: &str, angles: fn(usize) -> f64, tip: [f64; 3]) -> Outcome {
    let mut world = world([0.0, 0.0, -G], H);
    let number = |joint: &str| joint.trim_start_matches('j').parse().unwrap_or(1) - 1;
    let robot = read(&mut world, &folder.join(format!("{name}.urdf")), None, |j| angles(number(j)))?;
    // Rapier works out masses and world inertias within the first step.
    let Some(last) = robot.bodies.last() else { return Err(format!("{name} has no bodies")) };
    world.bodies.iter_mut().for_each(|(_, b)| b.recompute_mass_properties_from_colliders(&world.colliders));
    let start = energy(&world, &robot.bodies);
    let (mut largest, mut change, mut gap, mut error) = (0.0_f64, 0.0, 0.0_f64, f64::NAN);
    for k in 1..=10_000 {
        world.step();
        change = energy(&world, &robot.bodies) - start;
        largest = largest.max(change.abs());
        for hinge in &robot.hinges {
            let (a, b) = (world.bodies[hinge.parent].position(), world.bodies[hinge.child].position());
            gap = gap.max((a.transform_point(hinge.place.translation) - b.translation).length());
        }
        if k == 1000 {
            let end = world.bodies[*last].position().transform_point(Vector::new(0.25, 0.0, 0.0));
            error = (end - Vector::from_array(tip)).length();
        }
    }
    figure(&format!("{name}.energy"), largest, "chain of eight, 10 s: largest |ΔE|, J");
    figure(&format!("{name}.energy_end"), change, "the same: ΔE at the end, J");
    figure(&format!("{name}.gap"), 1e3 * gap, "the same: largest gap of a joint, mm");
    figure(&format!("{name}.tip"), 1e3 * error, "the same: tip at 1 s, mm from the reference");
    Ok(())
}
