//! Does the robot still climb the rim of a crater with weaker actuators?

use super::walk::{Place, Walk};
use crate::process::Outcome;
use terraglue_numerics::extremes::larger;

/// Largest torque of every motor, N m.
const TORQUES: [f64; 4] = [60.0, 8.0, 4.0, 2.0];

/// One row per torque.
pub fn table(place: &Place) -> Outcome<String> {
    let mut text =
        "| `max_torque` | height gained | largest height | distance | mechanical energy at the joints | \
                    energy per metre | came to a stand |\n|---|---|---|---|---|---|---|\n"
            .to_owned();
    for torque in TORQUES {
        let set = vec![format!("robot.max_torque={torque:.1}")];
        let walk = Walk::run(place, &format!("{torque} N m"), "scenarios/crater_rim.toml", &set)?;
        text += &row(torque, &walk);
    }
    Ok(text)
}

fn row(torque: f64, walk: &Walk) -> String {
    let number = |key: &str| walk.summary[key].as_f64().unwrap_or(f64::NAN);
    let highest =
        walk.z.iter().copied().fold(f64::NEG_INFINITY, larger) - walk.z.first().copied().unwrap_or(0.0);
    let (distance, energy) = (number("distance_m"), number("energy_j"));
    let per_metre =
        if distance.abs() < 0.1 { "–".to_owned() } else { format!("{:.0} J/m", energy / distance.abs()) };
    let stalled = match walk.summary["stalled"]["t_s"].as_f64() {
        Some(t) => format!(
            "after {t:.1} s, x = {:.2} m",
            walk.summary["stalled"]["x_m"].as_f64().unwrap_or(f64::NAN)
        ),
        None => "no".into(),
    };
    format!(
        "| {torque:.0} N m | {:.2} m | {highest:.2} m | {distance:.2} m | {energy:.0} J | {per_metre} | {stalled} |\n",
        number("height_gained_m")
    )
}
