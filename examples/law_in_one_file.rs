//! A pressure-sinkage law in one line of a scenario, measured by a bevameter beside Bekker's law at the same parameters.
//!
//! `cargo run --package terraglue-examples --example law_in_one_file`
//!
//! Bekker's pressure (k_c/b + k_phi)·zⁿ grows without bound. The law here approaches a bearing capacity p_0 instead:
//! p = p_0·(1 − exp(−(k_c/b + k_phi)·zⁿ/p_0)). At small depths it is Bekker's, far down it is p_0. The scenario
//! `plate_sinkage` presses two plates into the soil; the law is text that `[soil.law]` takes, so nothing is compiled.

use terraglue::scenario::Scenario;
use terraglue::testbed::Testbed;

/// k_c (N/m^(n+1)), k_phi (N/m^(n+2)) and n of the scenario's soil, LETE sand.
const BEKKER: [f64; 3] = [102e3, 5301e3, 0.793];
/// Bearing capacity, Pa.
const CAPACITY_PA: f64 = 600e3;
/// Radius of the large plate, m.
const RADIUS_M: f64 = 0.05;
/// The plates touch the soil after this travel, m.
const TRAVEL_M: f64 = 0.01;
/// Times at which the plate is read, s.
const TIMES_S: [f64; 5] = [1.2, 1.5, 2.0, 3.0, 4.0];

/// Bekker's pressure, Pa, at a depth in m.
fn bekker_pa(depth_m: f64) -> f64 {
    let [k_c, k_phi, n] = BEKKER;
    (k_c / RADIUS_M + k_phi) * depth_m.powf(n)
}

/// The law with a bearing capacity, Pa, at a depth in m.
fn capped_pa(depth_m: f64) -> f64 {
    CAPACITY_PA * (1.0 - (-bekker_pa(depth_m) / CAPACITY_PA).exp())
}

/// Keys of the law, to be set in a scenario.
fn law() -> [(String, String); 2] {
    let pressure = "p_0*(1 - exp(-(k_c/b + k_phi)*z^n/p_0))";
    let capacity = format!("{} kPa", CAPACITY_PA / 1e3);
    [("soil.law.pressure", pressure), ("soil.law.parameters.p_0", &capacity)]
        .map(|(key, value)| (key.to_owned(), format!("{value:?}")))
}

/// Depth of the large plate (m) and the mean pressure below it (Pa) at the times.
fn measure(sets: &[(String, String)]) -> terraglue::Result<Vec<[f64; 2]>> {
    let scenario = Scenario::load(&terraglue_examples::scenario("plate_sinkage"), sets)?;
    let mut testbed = Testbed::build_with(&scenario, &terraglue_examples::options(), &terraglue::library())?;
    let mut readings = Vec::new();
    for t_s in TIMES_S {
        testbed.run_until(t_s, &mut [])?;
        let read = |name: &str| testbed.read(name).unwrap_or(f64::NAN);
        let depth_m = TRAVEL_M - read("bevameter.large_plate.z");
        let area_m2 = std::f64::consts::PI * RADIUS_M * RADIUS_M;
        readings.push([depth_m, read("bevameter.large_plate.contact_normal") / area_m2]);
    }
    Ok(readings)
}

fn main() -> terraglue::Result {
    println!("depth, mm   Bekker, kPa: measured   formula   with capacity, kPa: measured   formula");
    for ([depth_m, bekker], [_, capped]) in measure(&[])?.into_iter().zip(measure(&law())?) {
        let [formula, own] = [bekker_pa(depth_m), capped_pa(depth_m)].map(|p| p / 1e3);
        println!(
            "{:<11.1} {:<23.1} {formula:<9.1} {:<30.1} {own:.1}",
            depth_m * 1e3,
            bekker / 1e3,
            capped / 1e3
        );
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_plate_measures_both_laws() {
        let found = |sets: &[(String, String)]| measure(sets).unwrap_or_else(|e| panic!("{e}"));
        for [depth, pressure] in found(&[]) {
            assert!((pressure / bekker_pa(depth) - 1.0).abs() < 0.01, "{pressure} Pa at {depth} m");
        }
        for [depth, pressure] in found(&law()) {
            assert!((pressure / capped_pa(depth) - 1.0).abs() < 0.01, "{pressure} Pa at {depth} m");
        }
    }
}
