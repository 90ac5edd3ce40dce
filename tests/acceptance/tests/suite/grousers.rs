//! A wheel with grousers on soil: one contact, the same bits with any number of threads.

use terraglue::Testbed;
use terraglue::testbed::Options;
use terraglue_acceptance::{ROOT, read, shipped};

fn rig(soil: &str, threads: usize) -> Testbed {
    let model = format!("{ROOT}/models/wheel_rig_grousers.urdf");
    let sets =
        [("rig.model", model.as_str()), ("soil.module", soil), ("gluing.strategy", "cooperative-compliant")];
    let library = terraglue::library()
        .with::<terraglue_rigid_body::RigidBody>()
        .with::<terraglue_soil_bekker::SoilBekker>()
        .with::<terraglue_soil_cellular_automaton::SoilCellularAutomaton>();
    let options = Options { threads, ..Options::default() };
    Testbed::build_with(&shipped("wheel_rig", &sets), &options, &library).unwrap_or_else(|e| panic!("{e}"))
}

/// Bits of the outputs of soil and bench after each 50 ms.
fn way(soil: &str, threads: usize) -> Vec<u64> {
    let mut testbed = rig(soil, threads);
    let mut all = Vec::new();
    for k in 0..300 {
        testbed.step().unwrap_or_else(|e| panic!("{e}"));
        if k % 50 == 49 {
            let names = ["rig.press.angle", "soil.contact1.pull", "soil.contact1.area"];
            all.extend(names.map(|n| read(&testbed, n).to_bits()));
        }
    }
    all
}

#[test]
fn a_rim_with_grousers_is_one_contact_with_the_same_bits_for_any_number_of_threads() {
    for soil in ["soil-bekker", "soil-cellular-automaton"] {
        let one = way(soil, 1);
        assert_eq!(one, way(soil, 3), "{soil}");
        // The load stands on one contact, which is as wide as the wheel.
        let mut testbed = rig(soil, 1);
        let (mut load, mut count) = (0.0, 0.0);
        while testbed.t_s() < 0.6 {
            testbed.step().unwrap_or_else(|e| panic!("{e}"));
            if testbed.t_s() > 0.3 {
                (load, count) = (load + read(&testbed, "soil.contact1.normal_force"), count + 1.0);
            }
        }
        assert!((load / count - 64.7).abs() < 3.0, "{soil}: {} N", load / count);
    }
}
