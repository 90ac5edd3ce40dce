//! After the first second of `moon_walk`, on soil or on rigid ground, no step allocates, in the coordinator or in any
//! module.
//!
//! The modules are linked in, so that one counting allocator sees all of them. Recording is left aside.
#![allow(unsafe_code)] // a global allocator is unsafe by its nature; this one only counts

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicU64, Ordering};
use terraglue::Testbed;
use terraglue::host::Library;
use terraglue::scenario::Scenario;
use terraglue::testbed::Options;
use terraglue_acceptance::{ROOT, shipped};

struct Counting;

static ALLOCATIONS: AtomicU64 = AtomicU64::new(0);

// SAFETY: every call goes to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.fetch_add(1, Ordering::Relaxed);
        // SAFETY: as the caller promised.
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: as the caller promised.
        unsafe { System.dealloc(pointer, layout) }
    }
    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        ALLOCATIONS.fetch_add(1, Ordering::Relaxed);
        // SAFETY: as the caller promised.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Steps after the first second that allocate, with their counts.
fn guilty(scenario: &Scenario) -> Vec<(f64, u64)> {
    let library = Library::new()
        .with::<terraglue_rigid_body::RigidBody>()
        .with::<terraglue_soil_bekker::SoilBekker>()
        .with::<terraglue_soil_cellular_automaton::SoilCellularAutomaton>()
        .with::<terraglue_gait::Gait>();
    let options = Options { threads: 1, ..Options::default() };
    let mut testbed = Testbed::build_with(scenario, &options, &library).unwrap_or_else(|e| panic!("{e}"));
    let mut guilty = Vec::new();
    while testbed.t_s() < 2.5 - 1e-6 {
        let before = ALLOCATIONS.load(Ordering::Relaxed);
        testbed.step().unwrap_or_else(|e| panic!("{e}"));
        let count = ALLOCATIONS.load(Ordering::Relaxed) - before;
        if testbed.t_s() > 1.0 && count > 0 {
            guilty.push((testbed.t_s(), count));
        }
    }
    guilty
}

/// One test, because tests that run side by side would count each other's allocations.
#[test]
fn no_step_of_moon_walk_allocates_after_the_first_second() {
    for ground in ["half-space", "terrain"] {
        let guilty = guilty(&on_rigid_ground(ground));
        assert!(guilty.is_empty(), "{ground}: steps that allocate: {guilty:?}");
    }
    for soil in ["soil-cellular-automaton", "soil-bekker"] {
        for strategy in ["cooperative", "cooperative-compliant", "iterative", "semi-implicit"] {
            let scenario = shipped("moon_walk", &[("soil.module", soil), ("gluing.strategy", strategy)]);
            let guilty = guilty(&scenario);
            assert!(guilty.is_empty(), "{soil}, {strategy}: steps that allocate: {guilty:?}");
        }
    }
}

/// The walk without its soil, on a half-space or on the terrain as stone.
fn on_rigid_ground(ground: &str) -> Scenario {
    let path = format!("{ROOT}/scenarios/moon_walk.toml");
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{e}"));
    let (head, rest) = text.split_once("[soil]").unwrap_or_else(|| panic!("no soil"));
    let after = rest.find("\n[").map_or("", |at| &rest[at..]);
    let sets = [("robot.ground".to_owned(), ground.to_owned())];
    Scenario::parse(&format!("{head}{after}"), &path, &sets).unwrap_or_else(|e| panic!("{e:?}"))
}
