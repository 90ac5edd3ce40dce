//! Cost of the automaton: six feet, two threads, old ground, collapses, rates, memory. CPU time of the thread that
//! does the work, so that a busy machine shows less.

use super::cone::released;
use super::feet::{Feet, instance, walk::walk};
use super::field::{Field, Function, PHI, UNLIMITED};
use super::machine::Machine;
use crate::process::Outcome;
use crate::soil::fixture::LUNAR;
use crate::timing::median;
use crate::{Context, Figure, Limit};
use rustix::time::{ClockId, clock_gettime};
use std::sync::Arc;
use terraglue_numerics::extremes::smaller;
use terraglue_soil_cellular_automaton::SoilCellularAutomaton;
use terraglue_subsystem::{Geometry, Pose};

/// Cells of the ground that is old before the feet come.
const OLD_CELLS: f64 = 4e6;

fn read(clock: ClockId) -> f64 {
    let t = clock_gettime(clock);
    t.tv_sec as f64 + 1e-9 * t.tv_nsec as f64
}

/// CPU time of this thread, s.
fn cpu() -> f64 {
    read(ClockId::ThreadCPUTime)
}

/// Level ground of `size` m a side.
fn level(size: f64, spacing: f64, threads: usize) -> Feet {
    let nodes = (size / spacing).round() as u32 + 1;
    let terrain = Function { size: [nodes; 2], spacing, height: |_, _| 0.0 };
    Feet::new(instance::<SoilCellularAutomaton>(LUNAR, Arc::new(Machine::new(Box::new(terrain), threads))))
}

/// Median, 99th percentile and mean of the steps, ms.
struct Spread([f64; 3]);

impl Spread {
    fn of(mut times: Vec<f64>) -> Self {
        times.sort_by(f64::total_cmp);
        let at = |share: f64| 1e3 * times[((times.len() - 1) as f64 * share) as usize];
        Self([at(0.5), at(0.99), 1e3 * times.iter().sum::<f64>() / times.len() as f64])
    }

    /// The best of several runs, number by number: disturbances of a run only add to it.
    fn best(runs: u32, run: impl Fn() -> Vec<f64>) -> Self {
        (0..runs)
            .map(|_| Self::of(run()))
            .fold(Self([f64::INFINITY; 3]), |a, b| Self(std::array::from_fn(|k| a.0[k].min(b.0[k]))))
    }
}

fn six_feet(context: &Context) -> Vec<Figure> {
    let (runs, seconds) = if context.quick { (2, 1.0) } else { (5, 3.0) };
    let mut figures = Vec::new();
    for (spacing, limit) in [(0.01, 0.04), (0.005, 0.12)] {
        let Spread([p50, p99, mean]) =
            Spread::best(runs, || walk(&mut level(20.0, spacing, 1), 6, seconds, cpu));
        let id = |what: &str| format!("soil.automaton.cost.six_feet_{}mm.{what}", spacing * 1e3);
        let what =
            "contact geometry, forces and material of six feet on 20 × 20 m, ms of CPU time per step of 1 ms";
        figures.extend([
            Figure::new(id("p50"), p50, Limit::AtMost(limit), format!("{what}, median")),
            Figure::new(id("mean"), mean, Limit::None, format!("{what}, mean")),
            Figure::new(
                id("p99_over_p50"),
                p99 / p50,
                Limit::AtMost(3.0),
                "99th percentile over median of that",
            ),
        ]);
    }
    figures
}

/// Wall time of twelve feet on one thread over that on two.
fn two_threads(context: &Context) -> Vec<Figure> {
    let (runs, seconds) = if context.quick { (2, 1.0) } else { (5, 3.0) };
    let clock = || read(ClockId::Monotonic);
    let wall =
        |threads| Spread::best(runs, || walk(&mut level(20.0, 0.005, threads), 12, seconds, clock)).0[2];
    let what = "wall time of twelve feet at 5 mm on one thread over that on two";
    let id = "soil.automaton.cost.two_threads";
    vec![Figure::new(id, wall(1) / wall(2), Limit::AtLeast(1.6), what)]
}

/// Presses square plates of 25 cm everywhere but into the strip where the feet will walk; cells that were touched.
fn wear(fixture: &mut Feet) -> f64 {
    const EDGE: f64 = 0.25;
    let plate = Geometry::Box { half_extents: [0.5 * EDGE, 0.5 * EDGE, 0.05] };
    for (a, b) in (-42..=42).flat_map(|b| (-42..=42).map(move |a| (a, b))) {
        let (x, y) = (EDGE * f64::from(a), EDGE * f64::from(b));
        if (-6.0..=-1.0).contains(&x) && y.abs() <= 1.0 {
            continue;
        }
        let at = |z: f64| Pose { position: [x, y, 0.05 + z], ..Pose::IDENTITY };
        fixture.bodies.clear();
        fixture.add(&plate, at(0.0));
        for z in [-0.001, -0.002, 0.01] {
            fixture.step(|_| at(z));
        }
    }
    fixture.lift_and_rest(60_000);
    let touched = fixture.soil.ground().heights.touched().len() * terraglue_ground::TILE_NODES;
    touched as f64
}

fn old_ground(context: &Context) -> Outcome<Vec<Figure>> {
    let (runs, seconds) = if context.quick { (1, 1.0) } else { (3, 3.0) };
    let mut old = level(22.0, 0.01, 1);
    let before = resident()?;
    let touched = wear(&mut old);
    let per_cell = (resident()? - before) / touched;
    let fresh = || Spread::of(walk(&mut level(22.0, 0.01, 1), 6, seconds, cpu)).0[0];
    let fresh = median((0..runs).map(|_| fresh()).collect());
    // the same walk on untouched ground amid old one; walked on again it would be another
    let aged = Spread::of(walk(&mut old, 6, seconds, cpu)).0[0];
    let what = format!(
        "median cost of a step where {:.1} million cells were touched before, over that on fresh ground",
        touched / 1e6
    );
    let enough = if touched >= OLD_CELLS { aged / fresh } else { f64::NAN };
    Ok(vec![
        Figure::new("soil.automaton.cost.old_ground", enough, Limit::AtMost(1.2), what),
        Figure::new(
            "soil.automaton.memory.per_touched_cell",
            per_cell,
            Limit::AtMost(20.0),
            "bytes of resident memory that a touched cell takes, everything counted",
        ),
    ])
}

/// Resident memory of this process, bytes.
fn resident() -> Outcome<f64> {
    let text = std::fs::read_to_string("/proc/self/statm").map_err(|e| e.to_string())?;
    let pages: Option<f64> = text.split(' ').nth(1).and_then(|n| n.parse().ok());
    pages.map(|n| 4096.0 * n).ok_or_else(|| format!("/proc/self/statm is `{text}`"))
}

fn collapses(context: &Context) -> Outcome<Vec<Figure>> {
    let mut figures = Vec::new();
    for (radius, limit) in [(32, Limit::AtMost(10.0)), (64, Limit::AtMost(100.0)), (128, Limit::None)] {
        if context.quick && radius == 128 {
            continue;
        }
        let mut times = Vec::new();
        for _ in 0..3 {
            let mut field = released(radius, 0.01, UNLIMITED)?;
            let before = cpu();
            field.relax(200_000)?;
            times.push(1e3 * (cpu() - before));
        }
        let best = times.into_iter().fold(f64::INFINITY, smaller);
        let what = format!("collapse of a column to a cone of {radius} cells by `relax`, ms of CPU time");
        figures.push(Figure::new(format!("soil.automaton.cost.collapse_r{radius}"), best, limit, what));
    }
    Ok(figures)
}

/// Cells per second of one thread: ground at rest looked through with both rules, and a slope that flows everywhere.
fn rates() -> Outcome<Vec<Figure>> {
    let size = [256; 2];
    let waves = |i: i64, j: i64| 0.02 * libm::sin(0.05 * i as f64) * libm::cos(0.04 * j as f64);
    let mut still = Field::new(&Function { size, spacing: 0.01, height: waves }, PHI, super::CURVATURE)?;
    let cells = f64::from(size[0] * size[1]);
    let scans = 40;
    let stable = median_rate(|| {
        (0..scans).for_each(|_| still.sweeper.scan(&still.ground));
        f64::from(scans) * cells
    });
    // rough, since on a plane only the ends change
    let steep = |i: i64, j: i64| 0.012 * i as f64 + 1e-3 * libm::sin(12.9898 * i as f64 + 78.233 * j as f64);
    let mut slope = Field::new(&Function { size, spacing: 0.01, height: steep }, PHI, UNLIMITED)?;
    let flowing = median_rate(|| {
        let before = slope.sweeper.counts.visited;
        slope.sweeper.sweep(&mut slope.ground, 64);
        (slope.sweeper.counts.visited - before) as f64
    });
    let figure = |id: &str, value: f64, limit: f64, what: &str| {
        let id = format!("soil.automaton.cost.{id}");
        Figure::new(
            id,
            value * 1e-9,
            Limit::AtLeast(limit),
            format!("{what}, 1e9 cells per second of one thread"),
        )
    };
    Ok(vec![
        figure("scan_stable", stable, 4.0, "ground at rest looked through with both rules"),
        figure("scan_flowing", flowing, 1.5, "visits of cells that flow"),
    ])
}

/// Median of five measurements of cells per second; `work` returns its cells.
fn median_rate(mut work: impl FnMut() -> f64) -> f64 {
    median(
        (0..5)
            .map(|_| {
                let before = cpu();
                let cells = work();
                cells / (cpu() - before)
            })
            .collect(),
    )
}

/// All figures that a clock or the size of the process measures.
pub fn figures(context: &Context) -> Outcome<Vec<Figure>> {
    let mut all = old_ground(context)?;
    all.extend(six_feet(context));
    all.extend(two_threads(context));
    all.extend(collapses(context)?);
    all.extend(rates()?);
    Ok(all)
}
