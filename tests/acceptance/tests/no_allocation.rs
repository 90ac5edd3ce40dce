//! Once the ports are known no step allocates, on soil or on rigid ground, in the coordinator or in any module, whatever
//! the strategy. A step that is repeated with half the length logs the reason, and is left aside.
//!
//! The modules are linked in, so that one counting allocator sees all of them. Recording is left aside.
#![allow(unsafe_code)] // a global allocator is unsafe by its nature; this one only counts

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use terraglue::Testbed;
use terraglue::scenario::Scenario;
use terraglue::testbed::Options;
use terraglue_acceptance::{ROOT, shipped};

struct Counting;

thread_local! {
    /// Of this thread alone: the test harness allocates in its own.
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

fn allocations() -> u64 {
    ALLOCATIONS.with(Cell::get)
}

fn count_one() {
    ALLOCATIONS.with(|n| n.set(n.get() + 1));
}

// SAFETY: every call goes to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count_one();
        // SAFETY: as the caller promised.
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: as the caller promised.
        unsafe { System.dealloc(pointer, layout) }
    }
    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count_one();
        // SAFETY: as the caller promised.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

/// A scenario with its modules linked in.
fn linked(scenario: &Scenario) -> Testbed {
    let library = terraglue::library()
        .with::<terraglue_rigid_body::RigidBody>()
        .with::<terraglue_soil_bekker::SoilBekker>()
        .with::<terraglue_soil_cellular_automaton::SoilCellularAutomaton>()
        .with::<terraglue_gait::Gait>();
    let options = Options { threads: 1, ..Options::default() };
    Testbed::build_with(scenario, &options, &library).unwrap_or_else(|e| panic!("{e}"))
}

/// The hexapod.
fn walk(sets: &[(&str, &str)]) -> Testbed {
    linked(&shipped("moon_walk", sets))
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Numbers of allocations of each step from `from` on that made any.
fn guilty(testbed: &mut Testbed, from: f64, until: f64) -> Vec<(f64, u64)> {
    let mut guilty = Vec::new();
    while testbed.t_s() < until - 1e-6 {
        let before = allocations();
        testbed.step().unwrap_or_else(|e| panic!("{e}"));
        let count = allocations() - before;
        if testbed.t_s() > from && count > 0 && testbed.report().halvings == 0 {
            guilty.push((testbed.t_s(), count));
        }
    }
    guilty
}

/// Both halves of an oscillator with a spring or a rigid joint between them.
fn oscillator(gluing: &str, glue: &str) -> String {
    let half = |name: &str, place: f64| {
        format!(
            "[{name}]\nmodule = \"mass-chain\"\nmass_kg = [1.0]\nspring_n_m = [40.0]\nposition_m = [{place:?}]\n"
        )
    };
    format!(
        "[time]\nstep_s = 0.01\nduration_s = 1.0\n[gluing]\n{gluing}\n{}{}[[glue]]\nside_1 = \"a.m0\"\nside_2 = \"b.m0\"\ncomponents = \"x\"\n{glue}\n",
        half("a", 0.1),
        half("b", 0.1)
    )
}

#[test]
fn no_strategy_allocates_once_the_ports_are_known() {
    let spring = "compliance_m_n = 0.006";
    for (gluing, glue) in [
        ("strategy = \"iterative\"", spring),
        ("strategy = \"iterative\"\njacobian = \"directional\"", ""),
        ("strategy = \"iterative\"\njacobian = \"finite-differences\"", ""),
        ("strategy = \"iterative\"\njacobian = \"broyden\"", spring),
        ("strategy = \"semi-implicit\"", ""),
        ("strategy = \"xt-newton\"", ""),
        ("strategy = \"relaxed\"\nrelaxation = \"anderson\"", ""),
        ("strategy = \"relaxed\"\nrelaxation = \"aitken\"", ""),
        ("strategy = \"relaxed\"\nrelaxation = \"broyden\"", ""),
        ("strategy = \"jacobi\"", spring),
        ("strategy = \"gauss-seidel\"", spring),
        ("strategy = \"gauss-seidel\"\nenergy_residual_j = 1e-5", spring),
        ("strategy = \"monolithic\"", ""),
    ] {
        let text = oscillator(gluing, glue);
        let scenario = Scenario::parse(&text, "test.toml", &[]).unwrap_or_else(|e| panic!("{e}"));
        let library = terraglue::library().with::<glue_cases::MassChain>();
        let options = Options { threads: 1, ..Options::default() };
        let mut testbed =
            Testbed::build_with(&scenario, &options, &library).unwrap_or_else(|e| panic!("{e}"));
        let guilty = guilty(&mut testbed, 0.2, 1.0);
        assert!(guilty.is_empty(), "{gluing}: steps that allocate: {guilty:?}");
    }
}

#[test]
fn no_step_allocates_on_rigid_ground() {
    for ground in ["half-space", "terrain"] {
        let mut testbed = linked(&on_rigid_ground(ground));
        let guilty = guilty(&mut testbed, 1.0, 2.5);
        assert!(guilty.is_empty(), "{ground}: steps that allocate: {guilty:?}");
    }
}

/// The walk by a generic strategy; a test for each, so that they run side by side.
fn generic_walk(strategy: &str) {
    let sets = [("gluing.strategy", strategy), ("time.duration_s", "1.0")];
    let guilty = guilty(&mut walk(&sets), 0.7, 1.0);
    assert!(guilty.is_empty(), "{strategy}: steps that allocate: {guilty:?}");
}

#[test]
fn no_step_allocates_on_soil_by_gauss_seidel() {
    generic_walk("gauss-seidel");
}

#[test]
fn no_step_allocates_on_soil_by_jacobi() {
    generic_walk("jacobi");
}

#[test]
fn no_step_allocates_on_soil_by_monolithic() {
    generic_walk("monolithic");
}

#[test]
fn no_step_allocates_on_soil_by_relaxed() {
    generic_walk("relaxed");
}

#[test]
fn no_step_allocates_on_soil_by_xt_newton() {
    generic_walk("xt-newton");
}

#[test]
fn no_step_allocates_on_grousers() {
    let guilty = guilty(&mut grousers(), 0.7, 1.0);
    assert!(guilty.is_empty(), "steps that allocate: {guilty:?}");
}

fn walk_on(soil: &str) {
    for strategy in ["cooperative", "cooperative-compliant", "iterative"] {
        let mut testbed = walk(&[("soil.module", soil), ("gluing.strategy", strategy)]);
        let guilty = guilty(&mut testbed, 1.0, 2.5);
        assert!(guilty.is_empty(), "{soil}, {strategy}: steps that allocate: {guilty:?}");
    }
}

#[test]
fn no_step_allocates_on_the_automaton() {
    walk_on("soil-cellular-automaton");
}

#[test]
fn no_step_allocates_on_bekker() {
    walk_on("soil-bekker");
}

/// A wheel with grousers that creeps on soil.
fn grousers() -> Testbed {
    let model = format!("{ROOT}/models/wheel_rig_grousers.urdf");
    linked(&shipped(
        "wheel_rig",
        &[
            ("rig.model", model.as_str()),
            ("gluing.strategy", "cooperative-compliant"),
            ("rig.velocity_target.travel", "0.02"),
            ("rig.velocity_target.drive", "0.2"),
        ],
    ))
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
