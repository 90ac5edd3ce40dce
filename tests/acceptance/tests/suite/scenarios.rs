//! Every scenario that is shipped runs, and the bevameter finds the law that its soil was given.

use terraglue_acceptance::{ROOT, build, shipped, steps};

#[test]
fn every_shipped_scenario_runs() {
    let mut found = 0;
    for entry in std::fs::read_dir(format!("{ROOT}/scenarios")).expect("folder") {
        let path = entry.expect("entry").path();
        let name = path.file_stem().and_then(|n| n.to_str()).expect("name").to_owned();
        let mut testbed = build(&shipped(&name, &[])).unwrap_or_else(|e| panic!("{name}: {e}"));
        steps(&mut testbed, 100);
        found += 1;
    }
    assert!(found >= 7, "{found} scenarios");
}

/// p = (k_c/b + k_φ)·zⁿ (Bekker 1969) of LETE sand under a disc of radius b.
fn bekker_force(radius: f64, depth: f64) -> f64 {
    let pressure = (102e3 / radius + 5301e3) * depth.powf(0.793);
    pressure * std::f64::consts::PI * radius * radius
}

#[test]
fn the_bevameter_measures_the_law_of_its_soil() {
    for soil in ["soil-bekker", "soil-cellular-automaton"] {
        for strategy in ["cooperative", "iterative"] {
            let sets = [("soil.module", soil), ("gluing.strategy", strategy)];
            let mut testbed = build(&shipped("plate_sinkage", &sets)).unwrap_or_else(|e| panic!("{e}"));
            for travel_steps in [1500, 2500, 3500] {
                let todo = travel_steps - testbed.step_index() as usize;
                steps(&mut testbed, todo);
                for (plate, radius) in [("small", 0.025), ("large", 0.05)] {
                    let read = |name: &str| testbed.read(&format!("bevameter.{name}")).expect("variable");
                    let depth = 0.01 - read(&format!("{plate}_plate.z"));
                    let force = read(&format!("{plate}_plate.contact_normal"));
                    let error = force / bekker_force(radius, depth) - 1.0;
                    assert!(error.abs() < 0.01, "{soil}, {strategy}, {plate} plate at {depth} m: {force} N");
                }
            }
        }
    }
}
