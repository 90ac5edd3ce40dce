//! The sweeps against a reference that looks at every node in the plainest order: windows, sleep, the order of work and
//! threads cannot be seen in the result.

use crate::plain;

use plain::Plain;
use proptest::prelude::*;
use std::sync::Arc;
use terraglue_ground::{Lattice, UNIT_M, lower_surface};
use terraglue_numerics::extremes::larger;
use terraglue_soil_cellular_automaton::Sweeper;
use terraglue_soil_contact::{Covered, Ground, Mask};
use terraglue_subsystem::{Config, Geometry, Host, LogLevel, Pose, Terrain, TerrainTile};

const SPACING: f64 = 0.01;
const PHI: f64 = 0.610865238198;
/// Of the soil on the right of a border.
const OTHER_PHI: f64 = 0.4;
const CURVATURE: f64 = 40.0;

/// Heaps, holes and a slope.
#[derive(Clone, Debug)]
struct Heaps {
    size: [u32; 2],
    slope: [f64; 2],
    /// (x, y, half width, height), nodes and m.
    blocks: Vec<(f64, f64, f64, f64)>,
}

impl Terrain for Heaps {
    fn origin(&self) -> [f64; 2] {
        [0.0; 2]
    }
    fn spacing(&self) -> f64 {
        SPACING
    }
    fn size(&self) -> [u32; 2] {
        self.size
    }
    fn heights(&self, i0: i64, j0: i64, ni: usize, nj: usize, out: &mut [f64]) -> TerrainTile {
        for b in 0..nj {
            for a in 0..ni {
                let x = (i0 + a as i64).clamp(0, i64::from(self.size[0]) - 1) as f64;
                let y = (j0 + b as i64).clamp(0, i64::from(self.size[1]) - 1) as f64;
                let block = |k: &&(f64, f64, f64, f64)| (x - k.0).abs() <= k.2 && (y - k.1).abs() <= k.2;
                let heaped: f64 = self.blocks.iter().filter(block).map(|k| k.3).sum();
                out[b * ni + a] = SPACING * (self.slope[0] * x + self.slope[1] * y) + heaped;
            }
        }
        TerrainTile::Varied
    }
}

fn heaps() -> impl Strategy<Value = Heaps> {
    // some just sharp enough to move, so that bounds must not overlook them
    let height = prop_oneof![-0.08..0.12f64, -0.008..0.008f64];
    let block = (0.0..1.0f64, 0.0..1.0f64, 0.0..6.0f64, height);
    let slope = prop_oneof![Just(0.0), -0.6..0.6f64];
    ((9..150u32, 9..110u32), (slope.clone(), slope), prop::collection::vec(block, 1..7)).prop_map(
        |((nx, ny), (sx, sy), blocks)| Heaps {
            size: [nx, ny],
            slope: [sx, sy],
            blocks: blocks.iter().map(|b| (b.0 * f64::from(nx), b.1 * f64::from(ny), b.2, b.3)).collect(),
        },
    )
}

/// Order of the work of `parallel_for`.
#[derive(Clone, Copy, Debug)]
enum Order {
    Forward,
    Backward,
    Threads(usize),
}

struct Machine(Order);

impl Host for Machine {
    fn name(&self) -> &str {
        "test"
    }
    fn log(&self, _: LogLevel, _: &str) {}
    fn parallel_for(&self, n: usize, job: &(dyn Fn(usize) + Sync)) {
        match self.0 {
            Order::Forward => (0..n).for_each(job),
            Order::Backward => (0..n).rev().for_each(job),
            Order::Threads(count) => std::thread::scope(|scope| {
                for first in 0..count {
                    scope.spawn(move || (first..n).step_by(count).for_each(job));
                }
            }),
        }
    }
    fn seed(&self) -> u64 {
        1
    }
    fn folder(&self) -> &str {
        ""
    }
    fn slots(&self) -> u32 {
        1
    }
    fn max_nodes(&self) -> u32 {
        64
    }
    fn gravity(&self) -> [f64; 3] {
        [0.0, 0.0, -9.81]
    }
    fn terrain(&self) -> Option<&dyn Terrain> {
        None
    }
}

/// Ground with a sweeper that has looked at it.
fn begin(heaps: &Heaps, order: Order) -> (Ground, Sweeper) {
    begin_with_border(heaps, order, None, 0.0)
}

/// The same with another soil from a share of the ground's width on, and steep slopes that stand up to `critical` (m).
fn begin_with_border(heaps: &Heaps, order: Order, border: Option<f64>, critical: f64) -> (Ground, Sweeper) {
    let mut ground = Ground::new(heaps).expect("heights in range");
    if let Some(border) = border {
        ground.mask = mask(heaps.size, border);
    }
    let mut sweeper = Sweeper::new(*ground.heights.lattice(), Arc::new(Machine(order)), 64);
    let others: &[f64] = if border.is_some() { &[OTHER_PHI] } else { &[] };
    sweeper.set_limits(PHI, others, CURVATURE, [critical, 0.5 * critical], SPACING);
    sweeper.scan(&ground);
    (ground, sweeper)
}

fn mask([nx, ny]: [u32; 2], border: f64) -> Mask {
    let left = 1 + (border * f64::from(nx - 2)) as u32;
    let row = format!("{left},0,{},1", nx - left);
    let runs = vec![row; ny as usize].join(",");
    let config = Config::parse(&format!(
        r#"{{"n":1,"k_c":1400,"k_phi":820000,"c_pa":170,"phi_rad":{PHI},"K_m":0.018,
            "mask":{{"soils":[{{"phi_rad":{OTHER_PHI}}}],"runs":[{runs}]}}}}"#
    ));
    let lattice = Lattice { origin: [0.0; 2], spacing: SPACING, size: [nx, ny] };
    Mask::from_config(&config.expect("a table"), 9.81, &lattice).expect("a mask")
}

/// A ball over the ground: nodes that it presses by `pressed` (m) carry it, others are roofed.
fn ball(ground: &Ground, [x, y]: [f64; 2], pressed: f64) -> Vec<Covered> {
    let size = ground.heights.lattice().size;
    let (x, y) = (x * f64::from(size[0] - 1) * SPACING, y * f64::from(size[1] - 1) * SPACING);
    let top = ground.heights.height((x / SPACING) as i32, (y / SPACING) as i32);
    let pose = Pose { position: [x, y, top + 0.03 - pressed], orientation: [1.0, 0.0, 0.0, 0.0] };
    let mut covered = Vec::new();
    for j in 0..size[1] as i32 {
        for i in 0..size[0] as i32 {
            let at = [f64::from(i) * SPACING, f64::from(j) * SPACING];
            let Some(lower) = lower_surface(&Geometry::Sphere { radius: 0.03 }, &pose, at[0], at[1]) else {
                continue;
            };
            let depth = ground.heights.height(i, j) - lower;
            let pressure = 8e5 * depth.max(0.0);
            covered.push(Covered {
                i,
                j,
                lower,
                depth,
                pressure,
                virgin: pressure,
                surface: lower,
                flow: [0.0; 2],
            });
        }
    }
    covered
}

fn assert_equal(ground: &Ground, plain: &Plain) -> Result<(), TestCaseError> {
    let [nx, ny] = ground.heights.lattice().size;
    for j in 0..ny as i32 {
        for i in 0..nx as i32 {
            prop_assert_eq!(ground.heights.units(i, j), plain.height(i, j), "node ({}, {})", i, j);
        }
    }
    Ok(())
}

/// Sweeps one by one, then forty next to the reference; twice, the second time with `dropped` units in the middle.
fn sleepers_are_at_rest(heaps: &Heaps, dropped: i32) -> Result<(), TestCaseError> {
    let (mut ground, mut sweeper) = begin(heaps, Order::Forward);
    let at = heaps.size.map(|n| n as i32 / 2);
    for _ in 0..2 {
        for _ in 0..400 {
            sweeper.sweep(&mut ground, 1);
        }
        let mut plain = Plain::new(&ground, &[PHI, OTHER_PHI], CURVATURE, 0.0);
        let first = sweeper.counts.parity;
        sweeper.sweep(&mut ground, 40);
        (0..40).for_each(|k| plain.sweep(first + k));
        assert_equal(&ground, &plain)?;
        ground.add_material(at[0], at[1], dropped);
        sweeper.changed.mark(at);
    }
    Ok(())
}

fn any_order() -> impl Strategy<Value = Order> {
    prop_oneof![Just(Order::Forward), Just(Order::Backward), Just(Order::Threads(2)), Just(Order::Threads(5))]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn every_unit_is_that_of_the_plain_reference(
        heaps in heaps(),
        order in any_order(),
        border in prop::option::of(0.0..1.0f64),
        turns in prop::collection::vec((1..21u32, prop::option::of((0.0..1.0f64, 0.0..1.0f64, -0.01..0.02f64))), 1..5),
    ) {
        let (mut ground, mut sweeper) = begin_with_border(&heaps, order, border, 0.0);
        let mut plain = Plain::new(&ground, &[PHI, OTHER_PHI], CURVATURE, 0.0);
        for (sweeps, foot) in turns {
            let covered = foot.map_or(Vec::new(), |(x, y, pressed)| ball(&ground, [x, y], pressed));
            sweeper.feet.take(&ground, &covered, &mut sweeper.changed);
            plain.stand(sweeper.feet.list.iter().map(|f| (f.node, f.load, f.room)));
            let first = sweeper.counts.parity;
            sweeper.sweep(&mut ground, sweeps);
            (0..sweeps).for_each(|k| plain.sweep(first + k));
            assert_equal(&ground, &plain)?;
        }
        prop_assert_eq!(sweeper.counts.gained, 0);
    }

    #[test]
    fn nodes_that_sleep_are_at_rest_until_something_changes(heaps in heaps(), dropped in 1..200_000i32) {
        sleepers_are_at_rest(&heaps, dropped)?;
    }

    /// Sleepers of a steep run wake a node a sweep, so only the end is that of the reference: nodes at rest stay so.
    #[test]
    fn steep_slopes_stand_up_to_the_critical_height_and_lose_nothing(
        heaps in heaps(), order in any_order(), border in prop::option::of(0.0..1.0f64), critical in 0.005..0.08f64,
    ) {
        let (mut ground, mut sweeper) = begin_with_border(&heaps, order, border, critical);
        for _ in 0..40 {
            sweeper.sweep(&mut ground, 100);
            prop_assert_eq!(sweeper.counts.gained, 0);
            prop_assert_eq!(ground.heights.gained_units(), 0);
        }
        if sweeper.sleeps() {
            let mut plain = Plain::new(&ground, &[PHI, OTHER_PHI], CURVATURE, critical);
            (0..2).for_each(|k| plain.sweep(k));
            assert_equal(&ground, &plain)?;
        }
    }

    #[test]
    fn nothing_flows_under_a_standing_foot(heaps in heaps(), place in (0.0..1.0f64, 0.0..1.0f64)) {
        let (mut ground, mut sweeper) = begin(&heaps, Order::Forward);
        let covered = ball(&ground, [place.0, place.1], 0.01);
        sweeper.feet.take(&ground, &covered, &mut sweeper.changed);
        let before: Vec<i32> = covered.iter().map(|c| ground.heights.units(c.i, c.j)).collect();
        for _ in 0..10 {
            sweeper.sweep(&mut ground, 20);
            for (c, before) in covered.iter().zip(&before) {
                let now = ground.heights.units(c.i, c.j);
                let roof = ((c.lower / UNIT_M).floor() as i32).max(*before);
                prop_assert!(now <= if c.pressure > 0.0 { *before } else { roof }, "{c:?}: {before} {now}");
            }
        }
    }
}

#[test]
fn one_sweep_moves_what_the_formula_says() {
    let heaps = Heaps {
        size: [40, 30],
        slope: [0.3, -0.2],
        blocks: vec![(20.0, 14.0, 3.0, 0.07), (31.0, 20.0, 2.0, -0.04)],
    };
    let (mut ground, mut sweeper) = begin(&heaps, Order::Forward);
    let before = ground.clone();
    // the first sweep holds both rules, the second repose alone
    sweeper.counts.parity = 1;
    sweeper.sweep(&mut ground, 1);
    let threshold = SPACING * PHI.tan() / UNIT_M;
    let h = |i: i32, j: i32| f64::from(before.heights.units(i, j));
    let flux = |i: i32, j: i32, [a, b]: [i32; 2]| {
        // the ground ends here
        if !before.heights.lattice().has(i + a, j + b) || !before.heights.lattice().has(i, j) {
            return 0.0;
        }
        let along = h(i, j) - h(i + a, j + b);
        let across = |i: i32, j: i32| 0.5 * (h(i + b, j + a) - h(i - b, j - a));
        let g_t = 0.5 * (across(i, j) + across(i + a, j + b));
        let g = along.hypot(g_t);
        0.25 * (g - threshold).max(0.0) * along / g.max(1e-9)
    };
    for j in 0..30 {
        for i in 0..40 {
            let [e, w] = [flux(i, j, [1, 0]), flux(i - 1, j, [1, 0])];
            let [n, s] = [flux(i, j, [0, 1]), flux(i, j - 1, [0, 1])];
            let change = f64::from(ground.heights.units(i, j) - before.heights.units(i, j));
            // four fluxes, each in single precision and rounded down to a unit
            let size = [e, w, n, s].iter().fold(0.0f64, |m, q| larger(m, q.abs()));
            assert!(
                (change - (w - e + s - n)).abs() <= 4.0 * (1.0 + 1e-5 * size),
                "({i}, {j}): {change}, {}",
                w - e + s - n
            );
        }
    }
    assert!(sweeper.counts.moved > 0);
}

/// Windows once ended one or two nodes before those that a round of few sweeps had woken for the rule of curvature.
#[test]
fn what_a_single_sweep_wakes_is_not_cut_off() {
    let heaps = Heaps {
        size: [20, 36],
        slope: [0.0, 0.19990025032612393],
        blocks: vec![
            (12.99, 5.80, 1.7568, 0.007287506056784901),
            (10.12, 1.90, 3.3854, -0.0011521911970828807),
            (1.53, 7.89, 5.4619, 0.09734065975905311),
            (8.27, 2.79, 1.9614, 0.016462982448432337),
        ],
    };
    sleepers_are_at_rest(&heaps, 1).expect("what the plain reference does");
}
