//! A foot at rest: the soil carries exactly its weight and it does not creep.

use terraglue_acceptance::{SOILS, build, foot, scenario, steps};

const WEIGHT: f64 = 5.0 * 9.81;

/// Largest relative error of T1_n against the weight and largest motion over 1000 steps after settling.
fn rest(text: &str, settle_steps: usize) -> (f64, f64, f64) {
    let mut testbed = build(&scenario(text)).unwrap_or_else(|e| panic!("{e}"));
    steps(&mut testbed, settle_steps);
    let start = testbed.read("foot.ball.z").expect("height");
    let (mut error, mut drift) = (0.0_f64, 0.0_f64);
    for _ in 0..1000 {
        steps(&mut testbed, 1);
        let t1: f64 = testbed.report().ports.iter().map(|p| p.wrench[0]).sum();
        error = error.max((t1 / WEIGHT - 1.0).abs());
        drift = drift.max((testbed.read("foot.ball.z").expect("height") - start).abs());
    }
    (error, drift, 0.03 - start)
}

#[test]
fn both_strategies_on_both_soils() {
    for strategy in ["cooperative", "iterative"] {
        for soil in SOILS {
            let (error, drift, sinkage) = rest(&foot(strategy, soil), 3000);
            println!("{strategy} {soil}: error {error:e}, drift {drift:e} m, sinkage {sinkage} m");
            assert!(error <= 1e-8, "{strategy}, {soil}: relative error {error:e}");
            assert!(drift <= 1e-9, "{strategy}, {soil}: drift {drift:e} m");
            assert!(sinkage > 1e-3, "{strategy}, {soil}: sinkage {sinkage} m");
        }
    }
}

#[test]
fn columns_hold_the_foot_to_a_picometre() {
    for strategy in ["cooperative", "iterative"] {
        let soil = "[soil]\nmodule = \"soil-column\"";
        let (error, drift, sinkage) = rest(&foot(strategy, soil), 3000);
        println!("{strategy} columns: error {error:e}, drift {drift:e} m, sinkage {sinkage} m");
        assert!(error <= 1e-8, "{strategy}: relative error {error:e}");
        assert!(drift <= 1e-12, "{strategy}: drift {drift:e} m");
    }
}
