//! The tripod and the wave gait against tables of joint angles made independently.

use crate::common;
use common::{gait, step, targets};
use terraglue_numerics::extremes::larger;

/// Largest difference of the 24 angles to the table over one cycle, after some cycles at full speed.
fn worst(table: &str, pattern: &str, period: f64, duty: f64) -> f64 {
    let speed = 0.12 / (duty * period);
    let mut gait = gait(&format!(
        r#"{{"gait": "{pattern}", "speed_m_s": {speed}, "stand_s": 0, "ramp_s": 0.01,
            "swing": "body", "posture_feedback": false, "heading_feedback": false}}"#
    ));
    let rows: Vec<Vec<f64>> = table
        .lines()
        .skip(1)
        .map(|line| line.split(',').map(|v| v.parse().expect("a number")).collect())
        .collect();
    let h = period / 240.0;
    (0..3 * 240).for_each(|_| step(&mut gait, h));
    let mut worst = 0.0_f64;
    for row in &rows {
        for (angle, known) in targets(&gait).iter().zip(&row[1..]) {
            worst = larger(worst, (angle - known).abs());
        }
        step(&mut gait, h);
    }
    worst
}

#[test]
fn the_tripod_table_is_reproduced() {
    let worst = worst(include_str!("reference/gait_tripod.csv"), "tripod", 1.2, 0.55);
    assert!(worst < 1e-9, "{worst} rad");
}

#[test]
fn the_wave_table_is_reproduced() {
    let worst = worst(include_str!("reference/gait_wave.csv"), "wave", 3.0, 5.0 / 6.0);
    assert!(worst < 1e-9, "{worst} rad");
}
