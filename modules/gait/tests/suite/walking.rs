//! Properties of a gait under every command: feet on the ground, support, smooth targets, speed, turning.

use crate::common;
use common::{H, gait, read, run, set, standing, step, targets};
use terraglue_gait::Gait;
use terraglue_gait::geometry::LEG_NAMES;
use terraglue_gait::walker::Mode;
use terraglue_numerics::extremes::larger;

const STEADY: &str = r#""posture_feedback": false, "heading_feedback": false"#;

/// Largest change of a target within one step over `time` s.
fn largest_jump(gait: &mut Gait, time: f64) -> f64 {
    let mut worst = 0.0_f64;
    for _ in 0..(time / H).round() as usize {
        let before = targets(gait);
        step(gait, H);
        let after = targets(gait);
        worst = before.iter().zip(after).map(|(a, b)| (a - b).abs()).fold(worst, larger);
    }
    worst
}

/// Distance of the body's centre from the nearest edge of the support polygon (m, positive inside), all feet level.
fn stability_margin(gait: &Gait) -> f64 {
    let feet: Vec<[f64; 2]> = gait.walker().feet.iter().filter(|f| !f.airborne).map(|f| f.position).collect();
    let mut margin = f64::INFINITY;
    for a in &feet {
        for b in &feet {
            let edge = [b[0] - a[0], b[1] - a[1]];
            let length = edge[0].hypot(edge[1]);
            let side = |p: &[f64; 2]| (edge[0] * (p[1] - a[1]) - edge[1] * (p[0] - a[0])) / length;
            if length > 0.0 && feet.iter().all(|p| side(p) > -1e-9) {
                margin = margin.min(side(&[0.0, 0.0]));
            }
        }
    }
    margin
}

#[test]
fn every_gait_keeps_its_duty_factor_and_supports_the_body() {
    for (pattern, period, duty, fewest) in
        [("tripod", 1.2, 0.55, 3), ("ripple", 1.8, 2.0 / 3.0, 4), ("wave", 3.0, 5.0 / 6.0, 5)]
    {
        let mut gait = gait(&format!(r#"{{"gait": "{pattern}", "speed_m_s": 0.08, {STEADY}}}"#));
        let mut margin = f64::INFINITY;
        let mut least = 6;
        for _ in 0..6000 {
            step(&mut gait, H);
            least = least.min(standing(&gait));
            margin = margin.min(stability_margin(&gait));
        }
        assert_eq!(least, fewest, "{pattern}");
        assert!(margin > 0.05, "{pattern}: {margin} m");
        let mut ground = [0.0; 6];
        let steps = (period / H) as usize;
        for _ in 0..steps {
            for (sum, leg) in ground.iter_mut().zip(LEG_NAMES) {
                *sum += read(&gait, &format!("{leg}.stance"));
            }
            step(&mut gait, H);
        }
        for part in ground {
            assert!((part / steps as f64 - duty).abs() < 2e-3, "{pattern}: {part} of {steps}");
        }
    }
}

#[test]
fn feet_on_the_ground_move_with_the_commanded_speed() {
    let mut gait = gait(&format!(r#"{{"speed_m_s": 0.15, {STEADY}}}"#));
    run(&mut gait, 4.0);
    let mut checked = 0;
    for _ in 0..1200 {
        let before = gait.walker().feet;
        step(&mut gait, H);
        for (a, b) in before.iter().zip(gait.walker().feet) {
            if !a.airborne && !b.airborne && a.phase < b.phase {
                assert!(((a.position[0] - b.position[0]) / H - 0.15).abs() < 1e-9);
                assert!((a.position[1] - b.position[1]).abs() < 1e-15);
                checked += 1;
            }
        }
    }
    assert!(checked > 3500);
    assert!((read(&gait, "speed_reached") - 0.15).abs() < 1e-12);
}

/// Largest speed over the ground of a foot that is less than 2 mm high, m/s.
fn drag(swing: &str) -> f64 {
    let mut gait =
        gait(&format!(r#"{{"speed_m_s": 0.15, "turn_rate_rad_s": 0.1, "swing": "{swing}", {STEADY}}}"#));
    run(&mut gait, 4.0);
    let mut worst = 0.0_f64;
    for _ in 0..1200 {
        let before = gait.walker().feet;
        step(&mut gait, H);
        for (a, b) in before.iter().zip(gait.walker().feet).filter(|(a, b)| a.height.max(b.height) < 2e-3) {
            let rest = gait.walker().twist.pass_below(a.position, H);
            worst = larger(worst, (b.position[0] - rest[0]).hypot(b.position[1] - rest[1]) / H);
        }
    }
    worst
}

#[test]
fn feet_that_swing_over_the_ground_do_not_drag() {
    let (ground, body) = (drag("ground"), drag("body"));
    assert!(ground < 0.025, "{ground} m/s");
    assert!(body > 0.12, "{body} m/s: the body-fixed swing drags with the speed of the body");
}

#[test]
fn speed_beyond_reach_is_cut_and_said() {
    let mut gait = gait(&format!(r#"{{"speed_m_s": 1.0, {STEADY}}}"#));
    run(&mut gait, 3.0);
    let limit = 0.24 / (0.55 * 1.2);
    assert!((read(&gait, "speed_reached") - limit).abs() < 1e-12);
    let mut out = 0.0_f64;
    for _ in 0..2400 {
        step(&mut gait, H);
        out = larger(out, read(&gait, "out_of_reach"));
    }
    assert_eq!(out, 0.0);
}

#[test]
fn targets_do_not_jump_at_changes_of_command() {
    let mut gait = gait(r#"{"speed_m_s": 0.15}"#);
    let bound = 0.02; // A joint at 20 rad/s, at the edge of reach; a jump would be ten times as large.
    let mut worst = largest_jump(&mut gait, 3.3);
    for (name, value) in [
        ("speed", 0.25),
        ("turn_rate", 0.3),
        ("roll", 0.2),
        ("pitch", -0.2),
        ("lift", 0.03),
        ("heading", 1.0),
        ("speed", -0.1),
        ("posture_feedback", 0.0),
        ("gait", 2.0),
        ("gait", 1.0),
        ("speed", 0.0),
    ] {
        set(&mut gait, name, value).expect("accepted");
        let jump = largest_jump(&mut gait, 0.77);
        println!("{name} = {value}: {jump} rad");
        worst = larger(worst, jump);
    }
    assert!(worst < bound, "{worst} rad in a step");
    assert!(worst > 1e-3, "nothing moved");
}

#[test]
fn a_change_of_gait_stops_first_and_goes_on() {
    let mut gait = gait(r#"{"speed_m_s": 0.1}"#);
    run(&mut gait, 3.0);
    set(&mut gait, "gait", 2.0).expect("wave");
    step(&mut gait, H);
    assert_eq!(gait.walker().mode, Mode::Stopping);
    let mut stood = false;
    for _ in 0..6000 {
        step(&mut gait, H);
        stood |= matches!(gait.walker().mode, Mode::Standing(_));
        if stood {
            assert!(standing(&gait) >= 5);
        }
    }
    assert!(stood && gait.walker().mode == Mode::Walking);
    assert!((read(&gait, "speed_reached") - 0.24 / 2.5).abs() < 1e-12, "wave at its longest stride");
}

#[test]
fn no_speed_means_standing_still() {
    let mut gait = gait(r#"{"speed_m_s": 0.15}"#);
    run(&mut gait, 3.0);
    set(&mut gait, "speed", 0.0).expect("accepted");
    run(&mut gait, 3.0);
    let before = targets(&gait);
    run(&mut gait, 1.0);
    assert_eq!(before, targets(&gait));
    assert_eq!(standing(&gait), 6);
    set(&mut gait, "speed", 0.15).expect("accepted");
    run(&mut gait, 3.0);
    assert!((read(&gait, "speed_reached") - 0.15).abs() < 1e-12);
}

/// Foot height in the body frame from the targets of a leg, m.
fn foot_height(gait: &Gait, leg: usize) -> f64 {
    let q = &targets(gait)[4 * leg..][..4];
    0.1 * q[1].sin() + 0.2 * (q[1] + q[2]).sin() + 0.3 * (q[1] + q[2] + q[3]).sin()
}

#[test]
fn the_low_side_is_pushed_out() {
    let standing = r#"{"speed_m_s": 0}"#;
    let mut rolled = gait(standing);
    set(&mut rolled, "roll", 0.1).expect("accepted");
    run(&mut rolled, 0.5);
    let (left, right) = (foot_height(&rolled, 1), foot_height(&rolled, 4));
    assert!(left > -0.29 && right < -0.31, "left side high: {left} {right}");
    let mut pitched = gait(standing);
    set(&mut pitched, "pitch", 0.1).expect("accepted");
    run(&mut pitched, 0.5);
    let (front, rear) = (foot_height(&pitched, 0), foot_height(&pitched, 2));
    assert!(front < -0.31 && rear > -0.29, "nose low: {front} {rear}");
    set(&mut pitched, "posture_feedback", 0.0).expect("accepted");
    run(&mut pitched, 5.0);
    assert!((foot_height(&pitched, 0) + 0.3).abs() < 1e-6, "switched off, the feet go back");
}

#[test]
fn a_level_loop_comes_to_rest_at_level() {
    // The body follows the plane of its feet on ground that rises sideways by 0.1 rad.
    let mut gait = gait(r#"{"speed_m_s": 0}"#);
    for _ in 0..10_000 {
        let roll = 0.1 - gait.walker().posture.correction[0];
        set(&mut gait, "roll", roll).expect("accepted");
        step(&mut gait, H);
    }
    assert!((gait.walker().posture.correction[0] - 0.1).abs() < 1e-3);
}

#[test]
fn a_turn_moves_the_feet_about_the_body_centre() {
    let mut gait = gait(&format!(r#"{{"speed_m_s": 0, "turn_rate_rad_s": 0.2, {STEADY}}}"#));
    run(&mut gait, 4.0);
    for _ in 0..1200 {
        let before = gait.walker().feet;
        step(&mut gait, H);
        for (a, b) in before.iter().zip(gait.walker().feet) {
            if !a.airborne && !b.airborne && a.phase < b.phase {
                let turned = (a.position[0] * b.position[1] - a.position[1] * b.position[0])
                    / (a.position[0].hypot(a.position[1]) * b.position[0].hypot(b.position[1]));
                assert!((turned.asin() / H + 0.2).abs() < 1e-9, "feet turn against the body");
                assert!(
                    (a.position[0].hypot(a.position[1]) - b.position[0].hypot(b.position[1])).abs() < 1e-12
                );
            }
        }
    }
}

#[test]
fn a_heading_error_turns_the_robot_the_short_way() {
    let mut gait = gait(r#"{"speed_m_s": 0.1, "heading_rad": 3.0}"#);
    set(&mut gait, "yaw", -3.0).expect("accepted");
    run(&mut gait, 3.0);
    assert!(read(&gait, "turn_rate_reached") < -0.1, "from −3 to 3 rad it is shorter through π");
    set(&mut gait, "heading_feedback", 0.0).expect("accepted");
    run(&mut gait, 3.0);
    assert!(read(&gait, "turn_rate_reached").abs() < 1e-6, "the correction fades out with its smoothing");
}

#[test]
fn a_commanded_turn_takes_the_held_heading_along() {
    let mut gait = gait(r#"{"speed_m_s": 0.1, "turn_rate_rad_s": 0.1}"#);
    let mut yaw = 0.0;
    for _ in 0..20_000 {
        set(&mut gait, "yaw", yaw).expect("accepted");
        step(&mut gait, H);
        yaw += read(&gait, "turn_rate_reached") * H;
    }
    assert!((read(&gait, "turn_rate_reached") - 0.1).abs() < 1e-3);
    assert!((yaw - 1.9).abs() < 0.02, "{yaw}");
}
