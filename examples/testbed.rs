//! The testbed as a library: load a scenario, step it, read a variable.
//!
//! `cargo run --package terraglue-examples --example testbed`

use terraglue::scenario::Scenario;
use terraglue::testbed::Testbed;

/// Height of the robot's body (m) after a tenth of a second.
fn height_m() -> terraglue::Result<f64> {
    let path = terraglue_examples::scenario("moon_walk");
    let scenario = Scenario::load(&path, &[("soil.module".to_owned(), "soil-bekker".to_owned())])?;
    let mut testbed = Testbed::build_with(&scenario, &terraglue_examples::options(), &terraglue::library())?;
    while testbed.t_s() < 0.1 {
        testbed.step()?;
    }
    Ok(testbed.read("robot.body.z").unwrap_or(f64::NAN))
}

fn main() -> terraglue::Result {
    println!("the body is {:.3} m above the ground's level", height_m()?);
    Ok(())
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_body_stands() {
        let height = super::height_m().unwrap_or_else(|e| panic!("{e}"));
        assert!((0.1..1.0).contains(&height), "{height} m");
    }
}
