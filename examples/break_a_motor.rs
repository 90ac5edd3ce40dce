//! A fault, and the same mission without it: a snapshot, a motor without torque, and back.
//!
//! `cargo run --package terraglue-examples --example break_a_motor`

use terraglue::scenario::Scenario;
use terraglue::testbed::Testbed;

/// Angle of a knee (rad) after 0.3 s, with its motor and without.
fn angles_rad() -> terraglue::Result<[f64; 2]> {
    let scenario = Scenario::load(&terraglue_examples::scenario("moon_walk"), &[])?;
    let mut testbed = Testbed::build_with(&scenario, &terraglue_examples::options(), &terraglue::library())?;
    testbed.step()?;
    let start = testbed.snapshot(0)?;
    testbed.run_until(0.3, &mut [])?;
    let sound = testbed.read("robot.LF_j2.angle").unwrap_or(f64::NAN);
    testbed.restore(&start)?;
    testbed.set("robot.LF_j2.max_torque", &0.0.into())?;
    testbed.run_until(0.3, &mut [])?;
    Ok([sound, testbed.read("robot.LF_j2.angle").unwrap_or(f64::NAN)])
}

fn main() -> terraglue::Result {
    let [sound, broken] = angles_rad()?;
    println!("LF_j2 after 0.3 s: {sound:.4} rad, without its motor {broken:.4} rad");
    Ok(())
}

#[cfg(test)]
mod tests {
    #[test]
    fn a_joint_without_torque_gives_way() {
        let [sound, broken] = super::angles_rad().unwrap_or_else(|e| panic!("{e}"));
        assert!((sound - broken).abs() > 1e-3, "{sound} and {broken} rad");
    }
}
