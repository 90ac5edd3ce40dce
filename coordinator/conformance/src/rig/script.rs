//! A run of any kind of module that touches all it promises, as bits.

use super::{BodyBench, Flat, Foot, SoilBench, Vectors, outputs, set_numbers};
use crate::finding::Verdict;
use terraglue_host::Instance;
use terraglue_subsystem::{BodyState, Capabilities, Input, Kind, Motion, Step};

/// Runs an instance for some steps and collects the bits of every answer; `variant` changes the motion.
///
/// # Errors
/// The module failed.
pub fn script(instance: Instance, steps: usize, variant: u64) -> Verdict<(Vec<u64>, Instance)> {
    let mut runner = Runner::new(instance)?;
    let mut bits = runner.run(0..steps, variant)?;
    bits.extend(committed(runner.instance())?);
    Ok((bits, runner.into_instance()))
}

/// Bits of everything that can be read of the committed state.
///
/// # Errors
/// The module failed.
pub fn committed(instance: &Instance) -> Verdict<Vec<u64>> {
    let mut bits: Vec<u64> = outputs(instance)?.into_iter().map(bits_of).collect();
    let e = instance.energy()?;
    let energies = [e.kinetic, e.potential, e.dissipated, e.port_work, e.actuator_work, e.electrical];
    bits.extend(energies.map(bits_of));
    let mut states = vec![BodyState::REST; instance.scene().bodies.len()];
    instance.body_states(&mut states)?;
    for s in &states {
        let p = s.world_from_body;
        let all =
            p.position.iter().chain(&p.orientation).chain(&s.linear_velocity).chain(&s.angular_velocity);
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

/// Bits of a number; the two zeros are one, and so is all that is no number.
fn bits_of(x: f64) -> u64 {
    if x.is_nan() { f64::NAN.to_bits() } else { (x + 0.0).to_bits() }
}

/// A module below its bench.
pub enum Runner {
    /// Two feet: down, along, up, and down again.
    Soil(Box<SoilBench>),
    /// Falls, and is held now and then by a force below a shape.
    Robot(Box<BodyBench>),
    /// Inputs that move like sines; plain steps.
    Signals(Box<Instance>),
}

/// Where the feet or the clock of a bench stand.
#[derive(Clone, Debug, Default)]
pub struct Place {
    states: Vec<BodyState>,
    t: f64,
    index: u64,
}

/// Steps after which the motion of a script repeats.
const PERIOD: usize = 80;

impl Runner {
    /// Puts an instance on the bench of its kind.
    ///
    /// # Errors
    /// It shows a ground that cannot be read.
    pub fn new(instance: Instance) -> Verdict<Self> {
        Ok(match instance.kind() {
            Kind::Soil if instance.capabilities().has(Capabilities::MOTION) => {
                let feet = [Foot::sphere(-0.1, 0.02), Foot::plate(0.15, -0.05)];
                Self::Soil(Box::new(SoilBench::around(instance, &Flat::LEVEL, &feet)?))
            }
            Kind::Robot => Self::Robot(Box::new(BodyBench::new(instance))),
            _ => Self::Signals(Box::new(instance)),
        })
    }

    /// The instance.
    pub fn instance(&self) -> &Instance {
        match self {
            Self::Soil(bench) => &bench.soil,
            Self::Robot(bench) => &bench.robot,
            Self::Signals(instance) => instance,
        }
    }

    /// The instance.
    pub fn instance_mut(&mut self) -> &mut Instance {
        match self {
            Self::Soil(bench) => &mut bench.soil,
            Self::Robot(bench) => &mut bench.robot,
            Self::Signals(instance) => instance,
        }
    }

    /// The instance alone.
    pub fn into_instance(self) -> Instance {
        match self {
            Self::Soil(bench) => bench.soil,
            Self::Robot(bench) => bench.robot,
            Self::Signals(instance) => *instance,
        }
    }

    /// Where the bench stands.
    pub fn place(&self) -> Place {
        match self {
            Self::Soil(b) => Place { states: b.states.clone(), t: b.t, index: b.index },
            Self::Robot(b) => Place { states: Vec::new(), t: b.t, index: b.index },
            Self::Signals(_) => Place::default(),
        }
    }

    /// Puts the bench, not the instance, back to where it stood.
    pub fn put_back(&mut self, place: &Place) {
        match self {
            Self::Soil(b) => (b.states, b.t, b.index) = (place.states.clone(), place.t, place.index),
            Self::Robot(b) => (b.t, b.index) = (place.t, place.index),
            Self::Signals(_) => {}
        }
    }

    /// Steps number `steps` of the script; the bits of all answers.
    ///
    /// # Errors
    /// The module failed.
    pub fn run(&mut self, steps: std::ops::Range<usize>, variant: u64) -> Verdict<Vec<u64>> {
        let mut bits = Vec::new();
        for k in steps {
            self.step(k, variant, 0, &mut bits)?;
        }
        Ok(bits)
    }

    /// Trials of step number k that nothing accepts.
    ///
    /// # Errors
    /// The module failed.
    pub fn try_only(&mut self, k: usize, trials: usize) -> Verdict {
        match self {
            Self::Soil(bench) => {
                let down = [[0.02, 0.0, -0.3], [0.0, 0.05, -0.2]];
                bench.meet(&down, 1e-3)?;
                let (x, v) = bench.motion_of(&down, 1e-3);
                for trial in 0..trials {
                    let other: Vec<f64> =
                        x.iter().map(|x| (1.0 + trial as f64 - (k % 3) as f64) * x).collect();
                    bench.try_motion(&other, &v, 1e-3)?;
                }
                Ok(())
            }
            Self::Robot(bench) => {
                bench.ports.clear();
                (0..trials).try_for_each(|_| bench.try_force(&[], 1e-3))
            }
            Self::Signals(instance) => {
                let step = Step::free(1e-3 * k as f64, 1e-3, k as u64);
                (0..trials).try_for_each(|_| {
                    instance.advance(
                        &step,
                        &plain(instance.capabilities()),
                        &mut Vectors::default().response(),
                    )?;
                    Ok(())
                })
            }
        }
    }

    /// Step number k of the script, after `trials` other trials from the same state.
    ///
    /// # Errors
    /// The module failed.
    pub fn step(&mut self, k: usize, variant: u64, trials: usize, bits: &mut Vec<u64>) -> Verdict {
        match self {
            Self::Soil(bench) => soil(bench, k, variant, trials, bits),
            Self::Robot(bench) => robot(bench, k, variant, trials, bits),
            Self::Signals(instance) => signals(instance, k, variant, trials, bits),
        }
    }
}

fn soil(bench: &mut SoilBench, k: usize, variant: u64, trials: usize, bits: &mut Vec<u64>) -> Verdict {
    let slow = 1.0 + 0.1 * (variant % 7) as f64;
    let phase = (4 * k / PERIOD) % 4;
    let [vx, vz] = [[0.0, -0.2], [0.05, -0.01], [0.01, 0.3], [0.0, -0.2]][phase];
    let velocities = [[vx / slow, 0.2 * vx, vz / slow], [-vx, 0.0, 0.5 * vz / slow]];
    bench.meet(&velocities, 1e-3)?;
    bits.extend(bench.now.bits());
    let (x, v) = bench.motion_of(&velocities, 1e-3);
    for trial in 0..trials {
        let scale = 1.0 + 3.0 * (trial as f64) - 0.5 * (k % 5) as f64;
        let other: Vec<f64> = x.iter().map(|x| scale * x - 1e-5 * trial as f64).collect();
        bench.try_motion(&other, &v, 1e-3)?;
    }
    bench.try_motion(&x, &v, 1e-3)?;
    bits.extend(bench.out.bits());
    bench.commit(&velocities, 1e-3)
}

fn robot(bench: &mut BodyBench, k: usize, variant: u64, trials: usize, bits: &mut Vec<u64>) -> Verdict {
    let has_shape = bench.robot.scene().shapes.iter().any(|s| s.collides);
    set_numbers(&mut bench.robot, |input| 0.1 * libm::sin(0.01 * k as f64 + input as f64))?;
    bench.ports.clear();
    let mut t = Vec::new();
    if has_shape && k % 3 == 0 {
        bench.place_port()?;
        t.extend([20.0 + (variant % 7) as f64, 1.0, -2.0]);
    }
    for trial in 0..trials {
        let other: Vec<f64> = t.iter().map(|t| t * (0.2 + trial as f64)).collect();
        bench.try_force(&other, 1e-3)?;
    }
    bench.try_force(&t, 1e-3)?;
    bits.extend(bench.out.bits());
    bench.commit(&t, 1e-3)
}

fn signals(instance: &mut Instance, k: usize, variant: u64, trials: usize, bits: &mut Vec<u64>) -> Verdict {
    set_numbers(instance, |input| 0.2 * libm::sin(0.02 * k as f64 + input as f64 + (variant % 7) as f64))?;
    let step = Step::free(1e-3 * k as f64, 1e-3, k as u64);
    let input = plain(instance.capabilities());
    for _ in 0..=trials {
        instance.advance(&step, &input, &mut Vectors::default().response())?;
    }
    instance.commit(&step, &[], &Motion { x: &[], v: &[] })?;
    bits.extend(outputs(instance)?.iter().map(|v| v.to_bits()));
    Ok(())
}

/// An input without ports, of a kind that the module takes.
fn plain(can: Capabilities) -> Input<'static> {
    match can.has(Capabilities::FORCE) {
        true => Input::Force { t: &[], motion: None },
        false => Input::Motion(Motion { x: &[], v: &[] }),
    }
}
