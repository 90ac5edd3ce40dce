//! Calls in any order, as no coordinator makes them.

use super::life_cycle::same;
use crate::definition::Test;
use crate::finding::{Stop, Verdict};
use crate::fixture::{Flat, Runner, Vectors};
use crate::scope::{Area, Level};
use crate::test_context::TestContext;
use terraglue_host::Instance;
use terraglue_subsystem::{
    Capabilities, Estimate, Input, Law, Level as Derivative, Motion, Node, Port, Step,
};
use terraglue_terrain::SplitMix64;

/// The tests of this area.
pub const TESTS: &[Test] = {
    &[Test {
        name: "any-order",
        area: Area::LifeCycle,
        level: Level::Standard,
        kinds: &[],
        after: &["steps"],
        promise: "calls in any order are answered by a status, and a state that was saved before stands",
        run: any_order,
    }]
};

/// Calls of a round.
const CALLS: usize = 80;

fn any_order(context: &TestContext) -> Verdict {
    let module = context.module()?;
    let mut random = context.random("any-order");
    let mut reference = Runner::new(context.instance_on(&module, Flat::LEVEL)?)?;
    let mut expected = [reference.run(0..10, 0)?, reference.run(10..30, 0)?];
    let frames = [Frame::default(), Frame::of(&mut reference)?];
    for round in 0..context.count(6) {
        // Every other instance meets the disorder at its first call.
        let start = if round % 2 == 0 { 0 } else { 10 };
        let mut runner = Runner::new(context.instance_on(&module, Flat::LEVEL)?)?;
        runner.run(0..start, 0)?;
        let (place, keeps) = (runner.place(), runner.instance().capabilities().has(Capabilities::STATE));
        if keeps {
            runner.instance_mut().save_state(0)?;
        }
        disorder(runner.instance_mut(), &frames, context.services().slots, &mut random)?;
        if runner.instance().has_failed() || !keeps {
            continue;
        }
        runner.instance_mut().restore_state(0)?;
        runner.put_back(&place);
        let given = format!("a run from the saved state after {CALLS} calls in any order");
        for (part, range) in expected.iter_mut().zip([0..10, 10..30]).skip(start / 10) {
            same(&given, part, &runner.run(range, 0)?)?;
        }
    }
    Ok(())
}

/// Calls drawn by lot; a panic or an exception ends them, as it ends the instance.
fn disorder(instance: &mut Instance, frames: &[Frame; 2], slots: u32, random: &mut SplitMix64) -> Verdict {
    let mut made: Vec<&str> = Vec::new();
    for _ in 0..CALLS {
        let mut draw = |n: usize| ((n as f64 * random.unit()) as usize).min(n - 1);
        let (call, frame, t) = (draw(10), &frames[draw(2)], 1e-3 * draw(50) as f64);
        // The first slot holds what is restored at the end.
        let slot = 1 + draw(slots.max(2) as usize - 1) as u32;
        let (name, done) = frame.call(instance, call, slot, t);
        made.push(name);
        let Err(error) = done else { continue };
        let text = error.to_string();
        if text.contains("unknown status") {
            let last = made[made.len().saturating_sub(6)..].join(", ");
            return Err(Stop::fail(
                name,
                format!("the calls … {last}"),
                text,
                "one of the statuses of the header",
            ));
        }
        if instance.has_failed() {
            break;
        }
    }
    Ok(())
}

/// The ports of a step; the default has none.
#[derive(Default)]
struct Frame {
    ports: Vec<Port>,
    nodes: Vec<Node>,
}

impl Frame {
    /// Ports as the fixture meets them.
    fn of(runner: &mut Runner) -> Verdict<Self> {
        match runner {
            Runner::Soil(fixture) => {
                let down = vec![[0.0, 0.0, -0.2]; fixture.states.len()];
                fixture.meet(&down, 1e-3)?;
                Ok(Self { ports: fixture.ports.clone(), nodes: fixture.nodes.clone() })
            }
            Runner::Robot(fixture) => match fixture.place_port() {
                Ok(()) => Ok(Self { ports: fixture.ports.clone(), nodes: Vec::new() }),
                Err(Stop::Skip(_)) => Ok(Self::default()),
                Err(other) => Err(other),
            },
            Runner::Signals(_) => Ok(Self::default()),
        }
    }

    /// Makes a call; its name, and what came of it.
    fn call(
        &self,
        on: &mut Instance,
        which: usize,
        slot: u32,
        t: f64,
    ) -> (&'static str, terraglue_diagnostics::Result) {
        let n: usize = self.ports.iter().map(Port::len).sum();
        let (ports, nodes) = (&self.ports[..], &self.nodes[..]);
        let step = Step { n: n as u32, ports, nodes, ..Step::free(t, 1e-3, (1e3 * t) as u64) };
        let (mut out, mut laws) = (Vectors::new(n), vec![Law::UNILATERAL; ports.len()]);
        let (x, force, mut g) = (vec![1e-5; n], vec![1.0; n], vec![0.0; n * n]);
        let motion = Motion { x: &x, v: &x };
        match which {
            0 => ("set_ports", on.set_ports(&step, &mut laws, &mut out.response())),
            1 => {
                let input = Input::Force { t: &force, motion: None };
                ("advance", on.advance(&step, &input, &mut out.response()).map(drop))
            }
            2 => ("advance", on.advance(&step, &Input::Motion(motion), &mut out.response()).map(drop)),
            3 => ("interface_jacobian", on.interface_jacobian(&step, Derivative::Position, &mut g)),
            4 | 5 => {
                let (mut t_star, mut x_free, mut active) = (force.clone(), x.clone(), vec![1; ports.len()]);
                let (t_star, x_free, active) = (&mut t_star[..], &mut x_free[..], &mut active[..]);
                let mut estimate = Estimate { t_star, x_free, g: &mut g, active, unique: true };
                if which == 4 {
                    let solved = on.solve_compatibility(&step, &estimate, &mut out.response());
                    return ("solve_compatibility", solved.map(drop));
                }
                ("estimate_forces", on.estimate_forces(&step, &motion, &mut estimate).map(drop))
            }
            6 => ("commit", on.commit(&step, &force, &motion)),
            7 => ("save_state", on.save_state(slot)),
            8 => ("restore_state", on.restore_state(slot)),
            _ => ("deserialize", on.serialize().and_then(|bytes| on.deserialize(&bytes))),
        }
    }
}
