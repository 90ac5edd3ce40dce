//! Overlays of the gait in the frame of the body that it walks.

use crate::common;
use common::{gait, run, standing, targets};
use terraglue_gait::geometry::{JOINTS, LEGS};
use terraglue_gait::{Gait, settings};
use terraglue_subsystem::{Config, Figure, Overlay, Subsystem};

const MOUNTED: &str = r#"{"mount": "robot.body", "touch_down": "time", "posture_feedback": false}"#;

/// Points of a layer; empty where it is not shown.
fn points(gait: &Gait, layer: &str) -> Vec<[f64; 3]> {
    let mut all = Vec::new();
    gait.overlays(&mut all);
    assert!(all.iter().all(|o| o.frame == Overlay::MOUNT));
    let own = all.into_iter().filter(|o| o.layer == layer).map(|o| match o.figure {
        Figure::Lines { points, .. } | Figure::Points { points, .. } | Figure::Arrows { points, .. } => {
            points
        }
        other => panic!("{other:?}"),
    });
    own.flatten().collect()
}

fn near(a: [f64; 3], b: [f64; 3], tolerance: f64) -> bool {
    (0..3).all(|k| (a[k] - b[k]).abs() < tolerance)
}

#[test]
fn nothing_is_shown_of_a_body_that_it_does_not_know() {
    let mut out = Vec::new();
    gait("{}").overlays(&mut out);
    assert!(out.is_empty());
}

#[test]
fn targets_are_where_the_joints_put_the_feet_and_the_polygon_joins_those_that_stand() {
    let (settings, _) = settings(&Config::parse(MOUNTED).expect("JSON")).expect("parameters are right");
    let mut gait = gait(MOUNTED);
    assert_eq!(points(&gait, "support polygon").len(), 2 * 4, "six feet in a rectangle have four corners");
    for _ in 0..40 {
        run(&mut gait, 0.1);
        let angles = targets(&gait);
        let shown = points(&gait, "foot targets");
        assert_eq!(shown.len(), LEGS);
        for (leg, shown) in shown.iter().enumerate() {
            let own: [f64; JOINTS] = angles[JOINTS * leg..][..JOINTS].try_into().expect("four");
            let foot = settings.legs[leg].forward(&own);
            assert!(near(foot, *shown, 1e-9), "{leg}: {foot:?} {shown:?}");
        }
        let polygon = points(&gait, "support polygon");
        if standing(&gait) == 3 {
            assert_eq!(polygon.len(), 6);
        }
        let stands = |p: &[f64; 3]| shown.iter().any(|foot| near(*foot, *p, 1e-9));
        assert!(polygon.iter().all(stands), "{polygon:?}");
    }
}

#[test]
fn a_foot_in_the_air_comes_down_where_its_arrow_points() {
    let mut gait = gait(MOUNTED);
    run(&mut gait, 4.0);
    let mut checked = 0;
    for _ in 0..4 {
        while gait.walker().feet.iter().all(|f| !f.airborne) {
            run(&mut gait, 0.001);
        }
        let leg = gait.walker().feet.iter().position(|f| f.airborne).expect("one flies");
        // arrows are listed in the order of the legs in the air
        let tip = points(&gait, "next footholds")[1];
        while gait.walker().feet[leg].airborne {
            run(&mut gait, 0.001);
        }
        let foot = gait.walker().feet[leg].position;
        assert!(near([foot[0], foot[1], 0.0], [tip[0], tip[1], 0.0], 1e-3), "{foot:?} {tip:?}");
        checked += 1;
    }
    assert_eq!(checked, 4);
}
