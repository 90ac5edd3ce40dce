//! The hexapod with its tripod gait on rigid ground: cost of a step, penetration, slip, forces, residual.

use super::gait::{GaitDrive, GaitWalk, LEGS};
use crate::process::Outcome;
use crate::rigid_body::fixture::{G, pose};
use crate::timing::cpu_s;
use crate::{Context, Figure, Limit};
use nalgebra::Vector3;
use terraglue_numerics::extremes::{larger, smaller};

const SIX: &str = "models/hexapod.urdf";
const EIGHTEEN: &str = "tests/reference/multibody/hexapod_18.urdf";
/// Step, s.
const H: f64 = 1e-3;
const STEPS: usize = 10_000;
/// From here on figures are taken: the robot walks.
const WALKS: usize = 2_000;
/// Radius of a foot, and its centre in the last body of a leg, m.
const RADIUS: f64 = 0.03;
const FOOT: [f64; 3] = [0.3, 0.0, 0.0];
/// Mass of the robot, kg.
const MASS: f64 = 25.02;
/// Runs of the same steps; the figures are of the middle run.
const RUNS: usize = 5;

/// All figures of the walk.
pub fn figures(context: &Context) -> Outcome<Vec<Figure>> {
    let mut all = quality("soft", GaitDrive::Soft)?;
    all.extend(quality("stiff", GaitDrive::Stiff)?);
    if context.timing {
        all.extend(cost("six", SIX, 45.0)?.into_iter().map(Figure::timed));
        all.extend(cost("eighteen", EIGHTEEN, 130.0)?.into_iter().map(Figure::timed));
    }
    Ok(all)
}

/// Sums and maxima over a walk.
#[derive(Default)]
struct SeenWalk {
    penetration: f64,
    slip: f64,
    slips: f64,
    normal: f64,
    residual: f64,
    yielding: f64,
    samples: f64,
    tracking: f64,
}

fn quality(name: &str, drive: GaitDrive) -> Outcome<Vec<Figure>> {
    let mut walk = GaitWalk::new(SIX, drive, H)?;
    let seen = walked(&mut walk)?;
    let end = pose(&walk.fixture.states()?[0]).0;
    let weight = MASS * G;
    let id = |what: &str| format!("rigid-body.gait.{name}.{what}");
    let bar = |limit: f64| if drive == GaitDrive::Stiff { Limit::AtMost(limit) } else { Limit::None };
    Ok(vec![
        Figure::new(
            id("penetration"),
            1e3 * seen.penetration,
            Limit::AtMost(0.01),
            "deepest foot after 2 s, mm",
        ),
        Figure::new(
            id("slip"),
            1e3 * seen.slip / seen.slips,
            bar(0.05),
            "mean speed of feet that stand, mm/s",
        ),
        Figure::new(
            id("normal_forces"),
            (seen.normal / seen.samples / weight - 1.0).abs(),
            Limit::AtMost(1e-2),
            "mean sum of normal forces / weight − 1",
        ),
        Figure::new(
            id("residual"),
            seen.residual,
            Limit::AtMost(1e-6),
            "largest residual of a contact problem",
        ),
        Figure::new(
            id("tracking"),
            (seen.tracking / seen.samples).sqrt(),
            Limit::None,
            "angle − target, root of the mean square, rad",
        ),
        Figure::new(id("x"), end.x, Limit::AtLeast(1.4), "distance in 10 s, m (about 1.64 at best)"),
        Figure::new(id("y"), end.y.abs(), Limit::AtMost(0.1), "sideways in 10 s, m"),
        Figure::new(
            id("yielding"),
            seen.yielding,
            Limit::AtMost(1e-2),
            "most that rigid motors gave way at their largest torque, rad/s",
        ),
    ])
}

/// Walks, and collects the figures of feet and forces.
fn walked(walk: &mut GaitWalk) -> Outcome<SeenWalk> {
    // Bodies are in the order of the legs' joints, four to a leg, after the trunk.
    let feet: Vec<usize> = (1..=LEGS.len()).map(|leg| 4 * leg).collect();
    let normals = LEGS.map(|leg| walk.fixture.id(&format!("{leg}4.contact_normal")));
    let normals = normals.into_iter().collect::<Outcome<Vec<_>>>()?;
    let told = [walk.fixture.id("contact.residual")?, walk.fixture.id("contact.yielding")?];
    let mut before = vec![None; feet.len()];
    let mut seen = SeenWalk::default();
    for step in 0..STEPS {
        walk.step()?;
        let states = walk.fixture.states()?;
        for (foot, last) in feet.iter().zip(&mut before) {
            let (origin, q) = pose(&states[*foot]);
            let p = origin + q * Vector3::from(FOOT);
            let stands = p.z < RADIUS;
            if step >= WALKS {
                seen.penetration = larger(seen.penetration, RADIUS - p.z);
                if let Some(last) = last.filter(|_| stands) {
                    let moved: Vector3<f64> = p - last;
                    seen.slip += moved.xy().norm() / H;
                    seen.slips += 1.0;
                }
            }
            *last = stands.then_some(p);
        }
        seen.residual = larger(seen.residual, walk.fixture.get(told[0])?);
        seen.yielding = larger(seen.yielding, walk.fixture.get(told[1])?);
        if step >= WALKS {
            seen.samples += 1.0;
            for normal in &normals {
                seen.normal += walk.fixture.get(*normal)?;
            }
            seen.tracking += walk.tracking_error()?;
        }
    }
    Ok(seen)
}

/// Median of a step and its 99th percentile over the median. Every run does the same steps, and other work of the machine
/// only adds to one: each step counts with the least of its times.
fn cost(name: &str, model: &str, limit: f64) -> Outcome<Vec<Figure>> {
    let mut times = vec![f64::INFINITY; STEPS];
    for _ in 0..RUNS {
        let mut walk = GaitWalk::new(model, GaitDrive::Soft, H)?;
        for time in &mut times {
            let start = cpu_s();
            walk.step()?;
            *time = smaller(*time, 1e6 * (cpu_s() - start));
        }
    }
    times.sort_by(f64::total_cmp);
    let (half, most) = (times[STEPS / 2], times[STEPS / 100 * 99]);
    let id = |what: &str| format!("rigid-body.gait.{name}.{what}");
    let tail = if name == "six" { Limit::AtMost(2.0) } else { Limit::None };
    Ok(vec![
        Figure::new(
            id("step"),
            half,
            Limit::AtMost(limit),
            "CPU time of a step, least of five runs, median, µs",
        ),
        Figure::new(id("tail"), most / half, tail, "99th percentile of that / median"),
    ])
}
