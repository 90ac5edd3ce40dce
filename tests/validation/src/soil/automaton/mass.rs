//! No unit of material is lost, whatever body does what.

use super::feet::{Feet, Wanderer, instance, shape};
use super::field::Function;
use super::machine::Machine;
use crate::process::Outcome;
use crate::soil::fixture::LUNAR;
use crate::{Context, Figure, Limit};
use std::sync::Arc;
use terraglue_soil_cellular_automaton::SoilCellularAutomaton;
use terraglue_subsystem::Pose;

/// Hilly ground of so many nodes a side, 1 cm apart.
pub fn hills(size: u32) -> Function<impl Fn(i64, i64) -> f64 + Send + Sync> {
    let height = |i: i64, j: i64| 0.03 * libm::sin(0.09 * i as f64) * libm::cos(0.07 * j as f64);
    Function { size: [size; 2], spacing: 0.01, height }
}

/// One body of each shape, wandering over a square of the given half width (m), pressed up to 3 cm below level zero.
pub fn crowd(fixture: &mut Feet, half: f64) -> Vec<Wanderer> {
    (0..5)
        .map(|kind| {
            let wanderer = Wanderer::new(41 + u64::from(kind), half, 0.03);
            fixture.add(&shape(kind), wanderer.pose);
            wanderer
        })
        .collect()
}

/// One step of all; now and then a body in the air turns.
pub fn wander(fixture: &mut Feet, wanderers: &mut [Wanderer]) {
    let turning = (fixture.index / 500 % wanderers.len() as u64) as usize;
    if fixture.index.is_multiple_of(500) && fixture.force(turning) == [0.0; 3] {
        wanderers[turning].turn_in_the_air();
        fixture.bodies[turning].move_to(&wanderers[turning].pose);
    }
    let goals: Vec<Pose> = wanderers.iter_mut().map(Wanderer::next).collect();
    fixture.step(|k| goals[k]);
}

/// Units of mass gained and those that the soil itself reports.
pub fn figure(context: &Context) -> Outcome<Figure> {
    let steps = if context.quick { 5_000 } else { 1_000_000 };
    let machine = Arc::new(Machine::new(Box::new(hills(101)), 1));
    let mut fixture = Feet::new(instance::<SoilCellularAutomaton>(LUNAR, machine));
    let mut wanderers = crowd(&mut fixture, 0.52);
    let before = fixture.mass();
    let mut wrong = 0;
    for step in 1..=steps {
        wander(&mut fixture, &mut wanderers);
        if step % 1000 == 0 {
            wrong += i64::from(fixture.mass() != before || fixture.soil.material().counts().gained != 0);
        }
    }
    let compacted = fixture.soil.material().compaction().total();
    let what = format!(
        "times of {} that mass, compaction ({compacted} units) counted, differs from the start; a sphere, box, capsule, \
         cylinder and mesh pressed, dragged, lifted and turned, {steps} steps, also beyond the edge",
        steps / 1000
    );
    Ok(Figure::new("soil.automaton.mass.any_body", wrong as f64, Limit::Equal(0.0), what))
}
