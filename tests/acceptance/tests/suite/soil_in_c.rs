//! The walk on a soil written in C, built by the system's compiler as a stranger would: one word of the scenario
//! changes, and nothing of this workspace knows that soil.

use std::path::Path;
use std::process::Command;
use terraglue::Testbed;
use terraglue::testbed::Options;
use terraglue_acceptance::{ROOT, shipped, steps};

const WEIGHT_N: f64 = 25.02 * 1.62;
const FEET: [&str; 6] = ["LF4", "LM4", "LR4", "RF4", "RM4", "RR4"];

/// Builds the elastic soil into a folder.
fn build_soil(folder: &Path) {
    let source = format!("{ROOT}/tests/modules/soil-elastic-c/soil_elastic.c");
    let include = format!("{ROOT}/interfaces/plugin/include");
    let library = folder.join("libsoil_elastic_plugin.so");
    let flags =
        ["-std=c11", "-O2", "-Wall", "-Wextra", "-Werror", "-fPIC", "-shared", "-I", &include, &source, "-o"];
    let done = Command::new("cc").args(flags).arg(&library).arg("-lm").output().expect("the C compiler `cc`");
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
}

fn read(testbed: &Testbed, name: &str) -> f64 {
    testbed.read(name).unwrap_or_else(|| panic!("no variable {name}"))
}

#[test]
fn the_robot_walks_on_it_with_both_strategies() {
    let folder = tempfile::tempdir().expect("folder");
    build_soil(folder.path());
    for strategy in ["cooperative", "iterative"] {
        let scenario =
            shipped("moon_walk", &[("soil.module", "soil-elastic"), ("gluing.strategy", strategy)]);
        let options = Options { threads: 1, module_paths: vec![folder.path().into()], ..Options::default() };
        let mut testbed =
            Testbed::build_with(&scenario, &options, &terraglue::library()).unwrap_or_else(|e| panic!("{e}"));
        let start = read(&testbed, "robot.body.x");
        let (mut carried, mut samples) = (0.0, 0.0);
        for step in 0..3000 {
            steps(&mut testbed, 1);
            assert!(testbed.report().converged, "{strategy}: step {step}");
            if step >= 1000 {
                carried +=
                    FEET.iter().map(|f| read(&testbed, &format!("robot.{f}.contact_normal"))).sum::<f64>();
                samples += 1.0;
            }
        }
        let walked = read(&testbed, "robot.body.x") - start;
        assert!(walked > 0.1, "{strategy}: walked {walked} m in 3 s");
        for angle in ["roll", "pitch"] {
            let angle = read(&testbed, &format!("robot.body.{angle}"));
            assert!(angle.abs() < 0.26, "{strategy}: tilted by {angle} rad");
        }
        // Over two seconds of walking the feet carry the weight.
        let mean = carried / samples;
        assert!((mean / WEIGHT_N - 1.0).abs() < 0.05, "{strategy}: {mean} N of {WEIGHT_N} N");
    }
}
