//! Tests of sensors: outputs follow from observations, no time to come is asked for, nothing of the world is kept, and
//! streams keep to their declaration.

use crate::definition::Test;
use crate::finding::{Stop, Verdict};
use crate::fixture::outputs;
use crate::scope::{Area, Level};
use crate::test_context::{MOUNTED, TestContext};
use std::cell::Cell;
use terraglue_host::{Instance, message, observe};
use terraglue_subsystem::{
    BodyRef, BodyState, Capabilities, Input, Kind, Motion, Pose, Ray, RayHit, RayMask, Response, Scene,
    SceneBody, ShapeRef, Step, World,
};

const fn test(name: &'static str, promise: &'static str, run: fn(&TestContext) -> Verdict) -> Test {
    let (area, level, after) = (Area::Physics, Level::Quick, &["steps"]);
    Test { name, area, level, kinds: &[Kind::Sensor], after, promise, run }
}

/// The tests of this area.
pub const TESTS: &[Test] = {
    &[
        test("same-view", "the same world gives the same outputs and messages, bit for bit", same_view),
        test("no-future", "nothing is asked of a time after the step", no_future),
        test("keeps-nothing", "the world is not asked outside of `observe`", keeps_nothing),
        test("honest-rates", "streams keep to their rate and their longest message", honest_rates),
    ]
};

/// A sensor that takes its inputs from connections looks at nothing.
const BLIND: &str = "it has no sight: what it shows comes from its inputs";
const H: f64 = 0.01;

/// A body of any name that flies over a plane.
struct Plane {
    names: Vec<String>,
    scene: Scene,
    interval: [f64; 2],
    /// The latest time that was asked for, s.
    latest: Cell<f64>,
}

impl Plane {
    fn new(start: f64, end: f64) -> Self {
        let (subsystem, body) = MOUNTED.split_once('.').unwrap_or_default();
        let bodies = vec![SceneBody { name: body.into(), mass: 1.0 }];
        let (names, scene) = (vec![subsystem.into()], Scene { bodies, ..Scene::default() });
        Self { names, scene, interval: [start, end], latest: Cell::new(f64::NEG_INFINITY) }
    }

    fn asked(&self, time: f64) -> f64 {
        self.latest.set(self.latest.get().max(time));
        time.clamp(self.interval[0], self.interval[1])
    }
}

impl World for Plane {
    fn interval(&self) -> [f64; 2] {
        self.interval
    }
    fn subsystems(&self) -> &[String] {
        &self.names
    }
    fn scene(&self, subsystem: u32) -> Option<&Scene> {
        (subsystem == 0).then_some(&self.scene)
    }
    fn is_visible(&self, _: ShapeRef) -> bool {
        true
    }
    fn body(&self, _: &str, _: &str) -> Option<BodyRef> {
        Some(BodyRef { subsystem: 0, body: 0 })
    }
    fn pose(&self, _: BodyRef, time: f64) -> Option<BodyState> {
        let t = self.asked(time);
        let world_from_body = Pose { position: [0.3 * t, 0.0, 2.0 + 0.1 * t], ..Pose::IDENTITY };
        Some(BodyState { world_from_body, linear_velocity: [0.3, 0.0, 0.1], ..BodyState::REST })
    }
    fn cast_rays(&self, rays: &[Ray], _: &RayMask, hits: &mut [RayHit]) {
        for (ray, hit) in rays.iter().zip(hits) {
            let height = ray.origin[2] - 0.05 * self.asked(ray.time);
            let distance = if ray.direction[2] < 0.0 { -height / ray.direction[2] } else { f64::INFINITY };
            *hit = RayHit::MISS;
            if distance >= 0.0 && distance <= ray.range {
                *hit = RayHit { distance, normal: [0.0, 0.0, 1.0], subsystem: 0, ..RayHit::MISS };
            }
        }
    }
    fn ground_heights(&self, _: &[[f64; 2]], heights: &mut [f64]) {
        heights.fill(0.05 * self.interval[1]);
    }
    fn overlap(&self, _: [f64; 3], _: f64, _: &RayMask, found: &mut Vec<ShapeRef>) {
        found.clear();
    }
}

fn seeing(context: &TestContext) -> Verdict<Instance> {
    let instance = context.instance()?;
    if instance.capabilities().has(Capabilities::SEES) { Ok(instance) } else { Err(Stop::Skip(BLIND.into())) }
}

/// One step, after which it looks; the latest time that it asked for.
fn step(instance: &mut Instance, index: u64) -> Verdict<f64> {
    let (t, end) = (H * index as f64, H * (index + 1) as f64);
    let step = Step::free(t, H, index);
    let input = Input::Force { t: &[], motion: None };
    let mut out = Response { x: &mut [], v: &mut [], a: &mut [], t: &mut [], reached: t + H, flags: 0 };
    instance.advance(&step, &input, &mut out)?;
    instance.commit(&step, &[], &Motion { x: &[], v: &[] })?;
    let world = Plane::new(t, end);
    observe(instance, &step, &world)?;
    Ok(world.latest.get())
}

/// Outputs and messages of fifty steps, as bits.
fn course(context: &TestContext) -> Verdict<Vec<u8>> {
    let mut instance = seeing(context)?;
    let mut all = Vec::new();
    for index in 0..50 {
        step(&mut instance, index)?;
        all.extend(outputs(&instance)?.iter().flat_map(|x| x.to_bits().to_le_bytes()));
        for k in 0..instance.subsystem().streams().len() {
            if let Some(made) = message(&instance, k)? {
                all.extend(made.time.to_bits().to_le_bytes());
                all.extend_from_slice(made.bytes);
            }
        }
    }
    Ok(all)
}

fn same_view(context: &TestContext) -> Verdict {
    let (first, second) = (course(context)?, course(context)?);
    match first.iter().zip(&second).position(|(a, b)| a != b) {
        None if first.len() == second.len() => Ok(()),
        place => {
            let at = place.unwrap_or(first.len().min(second.len()));
            let got = format!("outputs and messages that differ from byte {at} of {} on", first.len());
            Err(Stop::fail("observe", "the same world twice, to two instances", got, "the same bytes"))
        }
    }
}

fn no_future(context: &TestContext) -> Verdict {
    let mut instance = seeing(context)?;
    for index in 0..50 {
        let (latest, end) = (step(&mut instance, index)?, H * (index + 1) as f64);
        if latest > end + 1e-9 {
            let given = format!("a step that ends at t = {end} s");
            let got = format!("a question about t = {latest} s");
            return Err(Stop::fail("observe", given, got, "times up to the end of the step"));
        }
    }
    Ok(())
}

/// A world that a module has kept answers that it is closed, and the next call reports the question.
fn keeps_nothing(context: &TestContext) -> Verdict {
    let mut instance = seeing(context)?;
    for index in 0..10 {
        step(&mut instance, index)?;
        outputs(&instance)?;
        (0..instance.subsystem().streams().len()).try_for_each(|k| message(&instance, k).map(drop))?;
    }
    Ok(())
}

fn honest_rates(context: &TestContext) -> Verdict {
    let mut instance = seeing(context)?;
    let streams = instance.subsystem().streams().to_vec();
    let mut last = vec![None; streams.len()];
    for index in 0..100 {
        step(&mut instance, index)?;
        for (k, (info, last)) in streams.iter().zip(&mut last).enumerate() {
            let Some(made) = message(&instance, k)?.filter(|m| *last != Some(m.time)) else { continue };
            let given = format!("the stream `{}`", info.name);
            if made.bytes.len() > info.most_bytes as usize {
                let got = format!("a message of {} bytes", made.bytes.len());
                return Err(Stop::fail("stream", given, got, format!("at most {}", info.most_bytes)));
            }
            if let Some(before) = *last
                && info.rate_hz > 0.0
                && made.time - before < 0.5 / info.rate_hz
            {
                let got = format!("a message {} s after the one before", made.time - before);
                return Err(Stop::fail("stream", given, got, format!("at most {} per second", info.rate_hz)));
            }
            *last = Some(made.time);
        }
    }
    Ok(())
}
