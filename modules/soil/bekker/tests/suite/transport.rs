//! `material_transport`: the walls of a print fall in by the automaton's rules and no unit of material is lost.

use crate::support;

use support::{Fixture, Shown, flat, read, soil};
use terraglue_ground::Surface;
use terraglue_numerics::extremes::larger;
use terraglue_soil_bekker::SoilBekker as Soil;
use terraglue_subsystem::Geometry;

/// Lunar soil that hardly springs back, without cohesion in the walls.
const LUNAR: &str = r#"{"n":1.0,"k_c":1400,"k_phi":820000,"c_pa":170,"phi_rad":0.610865238198,"K_m":0.018,
    "elastic_stiffness_pa_m":4e8,"critical_height_m":0.0}"#;
const DEPTH: f64 = 0.03;
const SPACING: f64 = 0.01;
const SIZE: i32 = 65;

/// A disc of 5 cm pressed 3 cm deep and taken away, then three seconds of rest.
fn print(more: &str) -> Fixture {
    let config = LUNAR.replacen('{', &format!("{{{more}"), 1);
    let disc = Geometry::Cylinder { half_length: 0.1, radius: 0.05 };
    let mut fixture = Fixture::new(soil::<Soil>(&config, SIZE as u32, SPACING, flat), disc, 1.0, 0.1);
    let mut go = |by: f64, steps: u32| {
        (0..steps).for_each(|_| drop(fixture.prescribed_step(&[by, 0.0, 0.0, 0.0, 0.0, 0.0])));
    };
    go(-1e-4, (DEPTH / 1e-4) as u32);
    go(0.01, 5);
    go(0.0, 3000);
    fixture
}

/// Largest step between neighbours along x and y, m, and total depth below the initial surface, m.
fn shape(fixture: &Fixture) -> (f64, f64) {
    let (heights, sunk) = (Shown::new(&*fixture.soil), Shown::field(&*fixture.soil, "sinkage"));
    let (mut step, mut sum) = (0.0_f64, 0.0);
    for (i, j) in (0..SIZE - 1).flat_map(|j| (0..SIZE - 1).map(move |i| (i, j))) {
        let here = heights.height(i, j);
        let beside = [heights.height(i + 1, j), heights.height(i, j + 1)];
        step = beside.iter().map(|h| (h - here).abs()).fold(step, larger);
        sum += sunk.height(i, j);
    }
    (step, sum)
}

#[test]
fn without_the_key_walls_stand() {
    let (step, sum) = shape(&print(""));
    assert!((step - DEPTH).abs() < 1e-3, "{step}");
    assert!(sum * SPACING * SPACING > 0.9 * DEPTH * std::f64::consts::PI * 0.05 * 0.05);
}

#[test]
fn with_it_they_fall_in_and_crater_is_rim_and_compaction() {
    // cells at the edge of the disc are pressed as a whole
    let (_, pressed) = shape(&print(""));
    let slope = SPACING * libm::tan(0.610865238198);
    for (compacted, dense) in [("", 1.0), (r#""compacted_fraction":0.4,"#, 0.4)] {
        let fixture = print(&format!(r#""material_transport":true,"sweeps_per_step":2,{compacted}"#));
        let (step, sum) = shape(&fixture);
        assert!(step < 1.01 * slope, "{step} of {slope}");
        assert_eq!(read(&*fixture.soil, "mass_error_units"), 0.0);
        assert_eq!(read(&*fixture.soil, "active_nodes"), 0.0);
        let booked = read(&*fixture.soil, "compacted_volume") / (SPACING * SPACING);
        assert!((sum - booked).abs() < 1e-9, "sunk {sum} m, booked {booked} m");
        assert!((booked / (dense * pressed) - 1.0).abs() < 0.05, "{booked} m of {pressed} m");
    }
}
