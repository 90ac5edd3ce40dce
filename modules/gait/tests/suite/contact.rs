//! Swings that end when the foot presses on the ground: early, late, on uneven ground, with noise, without any word.

use crate::common;
use common::{H, gait, read, run, set, standing, step, targets};
use proptest::prelude::*;
use terraglue_gait::Gait;
use terraglue_gait::geometry::{LEG_NAMES, LEGS};
use terraglue_gait::plane::Plane;
use terraglue_numerics::extremes::larger;
use terraglue_subsystem::Subsystem;

const STEADY: &str = r#""posture_feedback": false, "heading_feedback": false"#;
/// Stiffness of the ground of these tests, N/m, under a body that a hand leads at its height.
const STIFFNESS: f64 = 2000.0;
/// A load on each foot that gives the thresholds their values under a robot, N.
const LOAD: f64 = 10.0;

/// The gait walks over ground of these heights, one per leg, m; `noise` is added to each force, N.
fn walk(gait: &mut Gait, ground: [f64; LEGS], time: f64, mut noise: impl FnMut() -> f64) -> f64 {
    let mut worst = 0.0_f64;
    for _ in 0..(time / H).round() as usize {
        let feet = gait.walker().feet;
        for (leg, name) in LEG_NAMES.iter().enumerate() {
            let depth = ground[leg] - feet[leg].height;
            let load = if depth >= 0.0 { LOAD } else { 0.0 };
            let force = load + STIFFNESS * depth.max(0.0) + noise();
            set(gait, &format!("{name}.contact_force"), force).expect("accepted");
        }
        let before = targets(gait);
        step(gait, H);
        worst = before.iter().zip(targets(gait)).map(|(a, b)| (a - b).abs()).fold(worst, larger);
    }
    worst
}

/// Walks at once, so that no height is left over from standing.
fn walking(more: &str) -> Gait {
    gait(&format!(r#"{{"speed_m_s": 0.1, "stand_s": 0.2, "levelling_s": 1e6, {STEADY} {more}}}"#))
}

/// Heights at which the feet that stand have met the ground, m.
fn met(gait: &Gait) -> Vec<(usize, f64)> {
    let stands = |leg: &usize| read(gait, &format!("{}.stance", LEG_NAMES[*leg])) == 1.0;
    (0..LEGS).filter(stands).map(|leg| (leg, gait.walker().feet[leg].height)).collect()
}

#[test]
fn a_swing_ends_where_the_ground_is() {
    for height in [0.03, 0.01, -0.01, -0.03] {
        let mut gait = walking("");
        walk(&mut gait, [height; LEGS], 6.0, || 0.0);
        let feet = met(&gait);
        assert!(feet.len() >= 3, "{height}: {feet:?}");
        for (_, found) in feet {
            assert!((found - height).abs() < 1.5e-3, "ground at {height} m, foot at {found} m");
        }
    }
}

#[test]
fn the_body_stays_level_over_uneven_ground() {
    // Each foot finds its own ground, so no foot has to lift or drop the body to reach the height of the others.
    let ground = [0.02, -0.015, 0.01, -0.02, 0.015, 0.0];
    let mut gait = walking("");
    walk(&mut gait, ground, 6.0, || 0.0);
    for (leg, found) in met(&gait) {
        assert!((found - ground[leg]).abs() < 1.5e-3, "{leg}: {found}");
    }
}

#[test]
fn the_search_ends_at_its_limit() {
    let mut gait = walking(r#", "search_m": 0.025"#);
    walk(&mut gait, [-1.0; LEGS], 1.0, || 0.0);
    let mut lowest = 0.0_f64;
    for _ in 0..40 {
        walk(&mut gait, [-1.0; LEGS], 0.1, || 0.0);
        lowest = gait.walker().feet.iter().map(|f| f.height).fold(lowest, f64::min);
    }
    assert!((lowest + 0.025).abs() < 1e-12, "{lowest}");
    assert!(standing(&gait) >= 3);
}

#[test]
fn the_cycle_waits_for_a_foot_that_looks_for_the_ground() {
    let deep = [-0.035, 0.0, -0.035, 0.0, -0.035, 0.0];
    let mut gait = walking("");
    for _ in 0..4000 {
        walk(&mut gait, deep, H, || 0.0);
        let held = met(&gait).len() + gait.walker().feet.iter().filter(|f| f.searching).count();
        assert!(held >= 3);
        let pressing = gait.walker().feet.iter().filter(|f| !f.airborne && !f.searching).count();
        assert!(pressing >= 3, "feet leave the ground before others have found it");
    }
}

#[test]
fn without_a_word_about_forces_the_swing_ends_at_its_time() {
    let run_for = |more: &str| {
        let mut gait = gait(&format!(r#"{{"speed_m_s": 0.15{more}}}"#));
        run(&mut gait, 4.321);
        targets(&gait).map(f64::to_bits)
    };
    assert_eq!(run_for(""), run_for(r#", "touch_down": "time""#));
}

#[test]
fn with_touch_down_by_time_forces_change_nothing() {
    let run_for = |forces: bool| {
        let mut gait = gait(r#"{"speed_m_s": 0.15, "touch_down": "time"}"#);
        for k in 0..4321 {
            if forces {
                set(&mut gait, "RM.contact_force", f64::from(k % 17)).expect("accepted");
            }
            step(&mut gait, H);
        }
        targets(&gait).map(f64::to_bits)
    };
    assert_eq!(run_for(true), run_for(false));
}

#[test]
fn the_body_goes_back_to_its_height() {
    let mut gait = gait(&format!(r#"{{"speed_m_s": 0, {STEADY}}}"#));
    walk(&mut gait, [0.0; LEGS], 0.2, || 0.0);
    let mut walking = self::gait(&format!(r#"{{"speed_m_s": 0.1, "levelling_s": 0.2, {STEADY}}}"#));
    walk(&mut walking, [0.02; LEGS], 3.0, || 0.0);
    set(&mut walking, "speed", 0.0).expect("accepted");
    walk(&mut walking, [0.02; LEGS], 3.0, || 0.0);
    let mean: f64 = walking.walker().feet.iter().map(|f| f.height).sum::<f64>() / LEGS as f64;
    assert!(mean.abs() < 1e-3, "{mean} m");
}

#[test]
fn a_touch_makes_no_jump_whatever_the_step() {
    for h in [0.0005, 0.001, 0.004] {
        let mut gait = walking("");
        let mut worst = 0.0_f64;
        for _ in 0..(5.0 / h) as usize {
            for (leg, name) in LEG_NAMES.iter().enumerate() {
                let force = if gait.walker().feet[leg].height < 0.02 { LOAD } else { 0.0 };
                set(&mut gait, &format!("{name}.contact_force"), force).expect("accepted");
            }
            let before = targets(&gait);
            step(&mut gait, h);
            worst = before.iter().zip(targets(&gait)).map(|(a, b)| (a - b).abs()).fold(worst, larger);
        }
        assert!(worst < 15.0 * h, "h = {h}: {worst} rad in a step");
    }
}

#[test]
fn a_plane_through_feet_is_found_and_a_line_has_no_slope() {
    let points =
        [[0.35, 0.5], [-0.35, 0.5], [0.0, -0.5]].map(|p: [f64; 2]| (p, 0.01 + 0.02 * p[0] - 0.03 * p[1]));
    let plane = Plane::through(points.iter().copied()).expect("three points");
    for (p, z) in points {
        assert!((plane.at(p) - z).abs() < 1e-15);
    }
    assert!((plane.slope[0] - 0.02).abs() < 1e-14 && (plane.slope[1] + 0.03).abs() < 1e-14);
    let line = [([0.0, 0.0], 0.0), ([1.0, 1.0], 1.0), ([2.0, 2.0], 5.0)];
    let plane = Plane::through(line.into_iter()).expect("points");
    assert!(plane.slope == [0.0; 2] && (plane.height - 2.0).abs() < 1e-15);
    assert!(Plane::through(line.into_iter().take(0)).is_none());
}

#[test]
fn without_measured_tilt_the_body_goes_parallel_to_its_feet() {
    let ground = [0.02, 0.02, 0.02, -0.02, -0.02, -0.02];
    let slope = |feedback: bool| {
        let mut gait = gait(&format!(
            r#"{{"speed_m_s": 0.1, "stand_s": 0.2, "heading_feedback": false, "posture_feedback": {feedback}}}"#
        ));
        walk(&mut gait, ground, 4.0, || 0.0);
        set(&mut gait, "speed", 0.0).expect("accepted");
        // The ground goes where the feet are: a body that moves takes its feet along.
        for _ in 0..6000 {
            let here = gait.walker().feet.map(|f| f.height);
            walk(&mut gait, here, H, || 0.0);
        }
        let feet = gait.walker().feet;
        Plane::through(feet.iter().map(|f| (f.position, f.height))).expect("feet").slope[1]
    };
    let [with, without] = [true, false].map(slope);
    assert!(without.abs() < 1e-6, "{without}: the feet are in a plane of the body");
    assert!(with > 0.01, "{with}: what was found stays, tilt is measured");
}

#[test]
fn nobody_waits_for_a_leg_that_is_gone() {
    let cycles = |lost: f64| {
        let mut gait = gait(&format!(r#"{{"gait": "ripple", "speed_m_s": 0.1, {STEADY}}}"#));
        let mut ground = [0.0; LEGS];
        walk(&mut gait, ground, 3.0, || 0.0);
        ground[0] = lost;
        walk(&mut gait, ground, 4.0, || 0.0);
        let (mut turned, mut before) = (0.0, read(&gait, "phase"));
        for _ in 0..1800 {
            walk(&mut gait, ground, H, || 0.0);
            let phase = read(&gait, "phase");
            turned += (phase - before).rem_euclid(1.0);
            before = phase;
        }
        turned
    };
    let (whole, lost) = (cycles(0.0), cycles(-1.0));
    assert!((whole - lost).abs() < 1e-9, "{whole} and {lost} cycles");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn targets_never_jump(
        ground in prop::array::uniform6(-0.05_f64..0.05),
        noise in 0.0_f64..6.0,
        seed in any::<u64>(),
        gait_name in prop::sample::select(vec!["tripod", "ripple", "wave"]),
        turn in -0.2_f64..0.2,
    ) {
        let json = format!(r#"{{"gait": "{gait_name}", "speed_m_s": 0.12, "turn_rate_rad_s": {turn}, "stand_s": 0.1}}"#);
        let mut gait = gait(&json);
        let mut state = seed | 1;
        let jump = walk(&mut gait, ground, 4.0, || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            noise * ((state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5)
        });
        // A joint at the edge of reach, where it is fastest; a jump by a centimetre of a foot would be twice as large.
        prop_assert!(jump < 0.03, "{jump} rad in a step");
        prop_assert!(targets(&gait).iter().all(|t| t.is_finite()));
        let limits = gait.walker().feet.iter().all(|f| f.height > -0.1 && f.height < 0.15);
        prop_assert!(limits, "{:?}", gait.walker().feet.map(|f| f.height));
    }
}

#[test]
fn what_feet_know_of_the_ground_is_in_snapshots_and_bytes() {
    let ground = [0.02, -0.015, 0.01, -0.02, 0.015, 0.0];
    let mut one = walking("");
    walk(&mut one, ground, 2.345, || 0.0);
    one.save_state(0).expect("saved");
    let bytes = one.serialize().expect("bytes");
    let go = |gait: &mut Gait| {
        walk(gait, ground, 1.5, || 0.0);
        targets(gait).map(f64::to_bits)
    };
    let first = go(&mut one);
    one.restore_state(0).expect("restored");
    assert_eq!(first, go(&mut one));
    let mut other = walking("");
    other.deserialize(&bytes).expect("taken");
    assert_eq!(first, go(&mut other));
}
