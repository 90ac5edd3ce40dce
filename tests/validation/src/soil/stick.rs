//! A loaded disc under a lateral force below the friction limit stays where it is, on the level and on a slope.

use super::fixture::{Fixture, LUNAR, flat, soil};
use crate::parallel::in_parallel;
use crate::process::Outcome;
use crate::{Context, Figure, Limit};
use terraglue_numerics::extremes::larger;
use terraglue_soil_bekker::SoilBekker;
use terraglue_soil_cellular_automaton::SoilCellularAutomaton;
use terraglue_subsystem::{Geometry, Subsystem};

type SlopeMaker = fn(fn(f64, f64) -> f64) -> Box<dyn Subsystem>;

const LOAD: f64 = 50.0;
const RADIUS: f64 = 0.05;
const COHESION: f64 = 170.0;
const PHI: f64 = 0.610_865_238_198;
const SLOPE_DEG: f64 = 15.0;

fn on<M: terraglue_subsystem::Module>(height: fn(f64, f64) -> f64) -> Box<dyn Subsystem> {
    soil::<M>(LUNAR, 65, 0.01, height)
}

fn slope(x: f64, _: f64) -> f64 {
    -x * SLOPE_DEG.to_radians().tan()
}

/// Figures of a held disc.
#[derive(Clone, Copy, Debug)]
struct Held {
    /// Path after the first two seconds, m.
    drift: f64,
    /// Standard deviation of the lateral force after two seconds over the load.
    chatter: f64,
    /// Largest pull of the soil on the disc, N.
    tension: f64,
}

/// The disc under `share` of its limit for `seconds`.
fn held(make: SlopeMaker, sloped: bool, share: f64, seconds: f64) -> Held {
    let geometry = Geometry::Cylinder { half_length: 0.02, radius: RADIUS };
    let ground = if sloped { slope } else { flat as fn(f64, f64) -> f64 };
    let mut fixture = Fixture::new(make(ground), geometry, LOAD / 9.81, 0.02);
    let tilt = if sloped { SLOPE_DEG.to_radians() } else { 0.0 };
    if sloped {
        fixture.tilt(tilt);
    }
    // the load presses along the normal, so that the limit is the same on the slope
    let limit = COHESION * std::f64::consts::PI * RADIUS * RADIUS + LOAD * PHI.tan();
    let along = [tilt.cos(), 0.0, -tilt.sin()];
    let normal = [tilt.sin(), 0.0, tilt.cos()];
    fixture.gravity = 0.0;
    let steps = |s: f64| (s / rig_step()).round() as u32;
    let (mut start, mut forces, mut tension) = (fixture.position, Vec::new(), 0.0_f64);
    for k in 0..steps(1.0 + seconds) {
        let time = f64::from(k) * rig_step();
        let load = LOAD * (time / 0.5).min(1.0);
        let side = share * limit * ((time - 1.0) / 0.5).clamp(0.0, 1.0);
        fixture.force = std::array::from_fn(|c| side * along[c] - load * normal[c]);
        fixture.iterative_step();
        tension = larger(tension, -fixture.t[0]);
        if k + 1 == steps(3.0) {
            start = fixture.position;
        }
        if k >= steps(3.0) {
            forces.push(fixture.t[1]);
        }
    }
    let drift = (0..3).map(|c| (fixture.position[c] - start[c]).powi(2)).sum::<f64>().sqrt();
    let mean = forces.iter().sum::<f64>() / forces.len() as f64;
    let variance = forces.iter().map(|f| (f - mean).powi(2)).sum::<f64>() / forces.len() as f64;
    Held { drift, chatter: variance.sqrt() / LOAD, tension }
}

fn rig_step() -> f64 {
    1e-3
}

/// All figures.
pub fn figures(context: &Context) -> Outcome<Vec<Figure>> {
    let seconds = if context.quick { 4.0 } else { 60.0 };
    let soils: [(&str, SlopeMaker); 2] =
        [("automaton", on::<SoilCellularAutomaton>), ("bekker", on::<SoilBekker>)];
    let mut cases = Vec::new();
    for (module, make) in soils {
        for sloped in [false, true] {
            for share in [0.3, 0.6, 0.9] {
                cases.push((module, make, sloped, share));
            }
        }
    }
    let results = in_parallel(&cases, |(_, make, sloped, share)| held(*make, *sloped, *share, seconds));
    let mut all = Vec::new();
    for ((module, _, sloped, share), held) in cases.iter().zip(results) {
        let place = if *sloped { "slope" } else { "level" };
        let id = format!("soil.{module}.stick.{place}_{:.0}", 100.0 * share);
        let of = format!("a disc under 50 N at {:.0} % of its friction limit, {seconds} s", 100.0 * share);
        let figure = |name: &str, value: f64, limit, what: &str| {
            Figure::new(format!("{id}.{name}"), value, limit, format!("{what} of {of}"))
        };
        all.push(figure("drift", 1e3 * held.drift, Limit::AtMost(0.1), "drift after 2 s, mm,"));
        all.push(figure(
            "chatter",
            100.0 * held.chatter,
            Limit::AtMost(1.0),
            "standard deviation of the force, % of the load,",
        ));
        all.push(figure("tension", held.tension, Limit::AtMost(0.0), "largest pull, N,"));
    }
    Ok(all)
}
