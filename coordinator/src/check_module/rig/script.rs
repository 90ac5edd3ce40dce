//! A run of any kind of module that touches all it promises, as bits.

use super::{BodyBench, Flat, Foot, SoilBench, outputs, set_numbers};
use crate::check_module::finding::Verdict;
use crate::host::Instance;
use terraglue_subsystem::{BodyState, Capabilities, Energy, Input, Kind, Motion, Step};

/// Runs an instance for some steps and collects the bits of every answer; `variant` changes the motion.
///
/// # Errors
/// The module failed.
pub fn script(instance: Instance, steps: usize, variant: u64) -> Verdict<(Vec<u64>, Instance)> {
    match instance.kind() {
        Kind::Soil if instance.capabilities().has(Capabilities::MOTION) => soil(instance, steps, variant),
        Kind::Robot => robot(instance, steps, variant),
        _ => signals(instance, steps, variant),
    }
}

/// Bits of everything that can be read of the committed state.
///
/// # Errors
/// The module failed.
pub fn committed(instance: &Instance) -> Verdict<Vec<u64>> {
    let mut bits: Vec<u64> = outputs(instance)?.iter().map(|v| v.to_bits()).collect();
    let Energy { kinetic, potential, dissipated, port_work, actuator_work } = instance.energy()?;
    bits.extend([kinetic, potential, dissipated, port_work, actuator_work].map(f64::to_bits));
    let mut states = vec![BodyState::REST; instance.scene().bodies.len()];
    instance.body_states(&mut states)?;
    for s in &states {
        let p = s.world_from_body;
        let all = p.position.iter().chain(&p.orientation).chain(&s.linear_velocity).chain(&s.angular_velocity);
        bits.extend(all.map(|v| v.to_bits()));
    }
    for (number, field) in instance.fields().iter().enumerate() {
        let tiles = field.size.map(|n| n.div_ceil(field.tile_edge.max(1)));
        for (b, a) in (0..tiles[1]).flat_map(|b| (0..tiles[0]).map(move |a| (b, a))) {
            let tile = instance.field_tile(number, a, b)?;
            let nodes = (field.tile_edge * field.tile_edge) as usize;
            bits.push((0..nodes).fold(0, |sum: u64, k| {
                sum.rotate_left(5).wrapping_mul(0x0100_0000_01b3) ^ tile.values.at(k).to_bits()
            }));
        }
    }
    Ok(bits)
}

/// Two feet: down, along, up, and down again.
fn soil(instance: Instance, steps: usize, variant: u64) -> Verdict<(Vec<u64>, Instance)> {
    let feet = [Foot::sphere(-0.1, 0.02), Foot::plate(0.15, -0.05)];
    let mut bench = SoilBench::around(instance, &Flat::LEVEL, &feet)?;
    let mut bits = Vec::new();
    let slow = 1.0 + 0.1 * (variant % 7) as f64;
    for k in 0..steps {
        let phase = (4 * k / steps.max(1)) % 4;
        let [vx, vz] = [[0.0, -0.2], [0.05, -0.01], [0.01, 0.3], [0.0, -0.2]][phase];
        bench.go(&[[vx / slow, 0.2 * vx, vz / slow], [-vx, 0.0, 0.5 * vz / slow]], 1e-3)?;
        bits.extend(bench.now.bits().chain(bench.out.bits()));
    }
    bits.extend(committed(&bench.soil)?);
    Ok((bits, bench.soil))
}

/// Falls, and is held now and then by a force below a shape.
fn robot(instance: Instance, steps: usize, variant: u64) -> Verdict<(Vec<u64>, Instance)> {
    let mut bench = BodyBench::new(instance);
    let mut bits = Vec::new();
    let has_shape = bench.robot.scene().shapes.iter().any(|s| s.collides);
    for k in 0..steps {
        set_numbers(&mut bench.robot, |input| 0.1 * libm::sin(0.01 * k as f64 + input as f64))?;
        if has_shape && k % 3 == 0 {
            bench.place_port()?;
            let t = [20.0 + (variant % 7) as f64, 1.0, -2.0];
            bench.try_force(&t, 1e-3)?;
            bits.extend(bench.out.bits());
            bench.commit(&t, 1e-3)?;
        } else {
            bench.fall(1e-3)?;
        }
    }
    bits.extend(committed(&bench.robot)?);
    Ok((bits, bench.robot))
}

/// Inputs that move like sines; plain steps.
fn signals(mut instance: Instance, steps: usize, variant: u64) -> Verdict<(Vec<u64>, Instance)> {
    let mut bits = Vec::new();
    for k in 0..steps {
        set_numbers(&mut instance, |input| {
            0.2 * libm::sin(0.02 * k as f64 + input as f64 + (variant % 7) as f64)
        })?;
        let step = Step::free(1e-3 * k as f64, 1e-3, k as u64);
        let mut out = super::Vectors::default();
        let nothing = Motion { x: &[], v: &[] };
        let input = if instance.capabilities().has(Capabilities::FORCE) {
            Input::Force { t: &[], hold: terraglue_subsystem::Hold::End, motion: None }
        } else {
            Input::Motion(nothing)
        };
        instance.advance(&step, &input, &mut out.response())?;
        instance.commit(&step, &[], &nothing)?;
        bits.extend(outputs(&instance)?.iter().map(|v| v.to_bits()));
    }
    bits.extend(committed(&instance)?);
    Ok((bits, instance))
}
