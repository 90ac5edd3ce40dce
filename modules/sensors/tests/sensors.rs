//! Sensors in worlds whose truth is known in closed form.
#![allow(clippy::unwrap_used, missing_docs)]

use std::sync::Arc;
use terraglue_sensors::Sensor;
use terraglue_subsystem::*;

const G: f64 = 1.62;
const H: f64 = 1e-3;

/// A body that flies a parabola while it turns about z, above a plane at z = 0.
struct Flight {
    names: Vec<String>,
    scene: Scene,
    interval: [f64; 2],
}

const TURN: f64 = 0.8;
const UP: f64 = 2.0;

impl Flight {
    fn at(start: f64, end: f64) -> Self {
        let scene = Scene { bodies: vec![SceneBody { name: "body".into(), mass: 1.0 }], ..Scene::default() };
        Self { names: vec!["robot".into()], scene, interval: [start, end] }
    }
}

impl World for Flight {
    fn interval(&self) -> [f64; 2] {
        self.interval
    }
    fn subsystems(&self) -> &[String] {
        &self.names
    }
    fn scene(&self, subsystem: u32) -> Option<&Scene> {
        (subsystem == 0).then_some(&self.scene)
    }
    fn is_visible(&self, _: ShapeRef) -> bool {
        true
    }
    fn pose(&self, _: BodyRef, t: f64) -> Option<BodyState> {
        assert!((self.interval[0] - 1e-12..=self.interval[1] + 1e-12).contains(&t), "{t} is not in the step");
        let half = 0.5 * TURN * t;
        Some(BodyState {
            world_from_body: Pose {
                position: [3.0 * t * t, 0.0, UP + t],
                orientation: [half.cos(), 0.0, 0.0, half.sin()],
            },
            linear_velocity: [6.0 * t, 0.0, 1.0],
            angular_velocity: [0.0, 0.0, TURN],
        })
    }
    fn cast_rays(&self, rays: &[Ray], mask: &RayMask, hits: &mut [RayHit]) {
        assert_eq!(mask.skip, BodyRef { subsystem: 0, body: 0 });
        for (ray, hit) in rays.iter().zip(hits) {
            let distance = -ray.origin[2] / ray.direction[2];
            if distance > 0.0 && distance <= ray.range {
                *hit = RayHit { distance, ..RayHit::MISS };
            }
        }
    }
    fn ground_heights(&self, _: &[[f64; 2]], _: &mut [f64]) {}
    fn overlap(&self, _: [f64; 3], _: f64, _: &RayMask, _: &mut Vec<ShapeRef>) {}
}

fn sensor(json: &str) -> Box<dyn Subsystem> {
    let config = Config::parse(json).unwrap().with_defaults(&Sensor::schema());
    let host = Standalone { gravity: [0.0, 0.0, -G], ..Standalone::default() };
    Sensor::instantiate(&config, Arc::new(host)).unwrap()
}

fn get(s: &dyn Subsystem, name: &str) -> f64 {
    let variable = s.variables().iter().find(|v| v.name == name).unwrap_or_else(|| panic!("no {name}"));
    let mut out = [f64::NAN];
    s.get(&[variable.id], ValuesMut::F64(&mut out)).unwrap();
    out[0]
}

fn switch(s: &dyn Subsystem, name: &str) -> bool {
    let variable = s.variables().iter().find(|v| v.name == name).unwrap();
    let mut out = [false];
    s.get(&[variable.id], ValuesMut::Bool(&mut out)).unwrap();
    out[0]
}

/// Step k of a run of steps of one millisecond, with the start before the first.
fn fly(s: &mut dyn Subsystem, steps: u64) {
    s.observe(&Step::free(0.0, 0.0, 0), &Flight::at(0.0, 0.0)).unwrap();
    (0..steps).for_each(|k| fly_step(s, k));
}

fn fly_step(s: &mut dyn Subsystem, k: u64) {
    let (start, end) = (k as f64 * H, (k + 1) as f64 * H);
    s.observe(&Step::free(start, H, k), &Flight::at(start, end)).unwrap();
}

fn feed(s: &mut dyn Subsystem, k: u64, value: f64) {
    s.set(&[0], Values::F64(&[value])).unwrap();
    let none = Motion { x: &[], v: &[] };
    s.commit(&Step::free(k as f64 * H, H, k), &[], &none).unwrap();
}

#[test]
fn an_imu_feels_acceleration_less_gravity_in_its_own_axes() {
    let quarter = std::f64::consts::FRAC_1_SQRT_2;
    // the sensor's x looks up, its z along −x of the body
    let mount = format!(r#""mount": "robot.body", "mount_offset": [0, 0, 0, {quarter}, 0, -{quarter}, 0]"#);
    let mut imu = sensor(&format!(r#"{{"kind": "imu", {mount}, "rate_hz": 100}}"#));
    fly(imu.as_mut(), 500);
    // half way from the sample before
    let angle = TURN * 0.495_f64;
    let (forward, side) = (6.0 * angle.cos(), -6.0 * angle.sin());
    let near = |name: &str, expected: f64| {
        let got = get(imu.as_ref(), name);
        assert!((got - expected).abs() < 1e-9, "{name}: {got} {expected}");
    };
    near("acceleration_x", G);
    near("acceleration_y", side);
    near("acceleration_z", -forward);
    near("rate_x", TURN);
    near("rate_y", 0.0);
    near("rate_z", 0.0);
}

#[test]
fn an_inclinometer_shows_how_its_mount_leans_and_not_where_it_looks() {
    // the body turns about z; its mount leans by −0.4 rad about y, then by 0.3 rad about its new x
    let ([sp, cp], [sr, cr]) = ([(-0.2_f64).sin(), 0.2_f64.cos()], [0.15_f64.sin(), 0.15_f64.cos()]);
    let turn = format!("{}, {}, {}, {}", cp * cr, cp * sr, sp * cr, -sp * sr);
    let text = format!(
        r#"{{"kind": "inclinometer", "mount": "robot.body", "mount_offset": [0, 0, 0, {turn}], "rate_hz": 0}}"#
    );
    let mut leaning = sensor(&text);
    fly(leaning.as_mut(), 0);
    for k in 0..2000 {
        fly_step(leaning.as_mut(), k);
        let [roll, pitch] = ["roll", "pitch"].map(|name| get(leaning.as_ref(), name));
        assert!((roll - 0.3).abs() < 1e-12 && (pitch + 0.4).abs() < 1e-12, "{roll} {pitch}");
    }
    let config = Config::parse(&text).unwrap().with_defaults(&Sensor::schema());
    let weightless = Standalone { gravity: [0.0; 3], ..Standalone::default() };
    let why = Sensor::instantiate(&config, Arc::new(weightless)).err().unwrap().to_string();
    assert!(why.contains("no gravity"), "{why}");
}

#[test]
fn a_range_finder_that_meets_nothing_has_no_errors_and_none_leads_out_of_its_range() {
    // along x of the body, where nothing is, and down
    let down = std::f64::consts::FRAC_1_SQRT_2;
    let noisy =
        r#""kind": "range-finder", "mount": "robot.body", "noise": 2.0, "range_m": 3.0, "rate_hz": 0"#;
    let up = sensor(&format!("{{{noisy}}}"));
    let near = sensor(&format!(r#"{{{noisy}, "mount_offset": [0, 0, -0.5, {down}, 0, {down}, 0]}}"#));
    for (mut finder, hits) in [(up, false), (near, true)] {
        fly(finder.as_mut(), 0);
        for k in 0..50 {
            fly_step(finder.as_mut(), k);
            let distance = get(finder.as_ref(), "distance");
            assert_eq!(switch(finder.as_ref(), "hit"), hits);
            assert!((0.0..=3.0).contains(&distance) && (hits || distance == 3.0), "{distance}");
        }
    }
}

#[test]
fn a_switch_without_a_threshold_is_open_without_a_force() {
    let mut contact = sensor(r#"{"kind": "contact-switch", "threshold_n": 0, "rate_hz": 0}"#);
    feed(contact.as_mut(), 0, 0.0);
    assert!(!switch(contact.as_ref(), "contact"));
    feed(contact.as_mut(), 1, 0.1);
    assert!(switch(contact.as_ref(), "contact"));
}

#[test]
fn a_range_finder_meets_the_ground_and_shows_it_later() {
    let down = std::f64::consts::FRAC_1_SQRT_2;
    let text = |more: &str| {
        format!(
            r#"{{"kind": "range-finder", "mount": "robot.body", "mount_offset": [0, 0, -0.5, {down}, 0, {down}, 0] {more}}}"#
        )
    };
    let mut now = sensor(&text(r#", "rate_hz": 100"#));
    let mut late = sensor(&text(r#", "rate_hz": 100, "delay_s": 0.025"#));
    fly(now.as_mut(), 103);
    fly(late.as_mut(), 103);
    // the samples of t = 0.10 s and of 0.07 s
    assert!((get(now.as_ref(), "distance") - (UP + 0.10 - 0.5)).abs() < 1e-12);
    assert!((get(late.as_ref(), "distance") - (UP + 0.07 - 0.5)).abs() < 1e-12);
    assert!(switch(now.as_ref(), "hit"));
    let mut short = sensor(&text(r#", "range_m": 1.0"#));
    fly(short.as_mut(), 10);
    assert!(get(short.as_ref(), "distance") == 1.0 && !switch(short.as_ref(), "hit"));
}

#[test]
fn an_encoder_samples_holds_and_rounds() {
    let mut encoder = sensor(r#"{"rate_hz": 100, "quantum": 0.25}"#);
    let mut shown = Vec::new();
    for k in 0..40 {
        feed(encoder.as_mut(), k, 0.01 * k as f64);
        shown.push(get(encoder.as_ref(), "angle"));
    }
    // samples at 0, 10, 20 and 30 ms, of the input in the step that ends there
    let expected = |k: usize| [0.0, 0.0, 0.25, 0.25][(k + 1) / 10 % 4];
    assert!((0..39).all(|k| shown[k] == expected(k)), "{shown:?}");
    let mut each = sensor(r#"{"rate_hz": 0}"#);
    feed(each.as_mut(), 0, 0.3);
    assert_eq!(get(each.as_ref(), "angle"), 0.3);
}

#[test]
fn a_contact_switch_opens_at_half_of_what_closes_it() {
    let mut foot = sensor(r#"{"kind": "contact-switch", "rate_hz": 0, "threshold_n": 10}"#);
    let mut states = Vec::new();
    for (k, force) in [0.0, 9.0, 10.0, 6.0, 5.0, 4.9, 9.9].into_iter().enumerate() {
        feed(foot.as_mut(), k as u64, force);
        states.push(switch(foot.as_ref(), "contact"));
    }
    assert_eq!(states, [false, false, true, true, true, false, false]);
}

#[test]
fn a_restored_sensor_goes_on_with_the_same_noise() {
    let text = r#"{"kind": "imu", "mount": "robot.body", "noise": 0.1, "turn_noise": 0.01, "bias": 0.5, "delay_s": 0.013}"#;
    let mut imu = sensor(text);
    fly(imu.as_mut(), 57);
    imu.save_state(1).unwrap();
    let bytes = imu.serialize().unwrap();
    let go = |s: &mut dyn Subsystem| -> Vec<u64> {
        let step = |k: u64| {
            fly_step(s, k);
            [get(s, "acceleration_x"), get(s, "rate_z")].map(f64::to_bits)
        };
        (57..120).flat_map(step).collect()
    };
    let first = go(imu.as_mut());
    imu.restore_state(1).unwrap();
    assert_eq!(go(imu.as_mut()), first);
    let mut other = sensor(text);
    other.deserialize(&bytes).unwrap();
    assert_eq!(go(other.as_mut()), first);
    assert!(first.windows(2).any(|w| w[0] != w[1]));
    assert!(sensor("{}").deserialize(&bytes).is_err(), "of another kind");
}

#[test]
fn what_makes_no_sense_is_refused() {
    let made = |json: &str| {
        let config = Config::parse(json).unwrap().with_defaults(&Sensor::schema());
        Sensor::instantiate(&config, Arc::new(Standalone::default())).err().map(|e| e.to_string())
    };
    assert!(made(r#"{"kind": "imu"}"#).unwrap().contains("needs a `mount`"));
    assert!(made(r#"{"mount": "robot.body"}"#).unwrap().contains("takes no `mount`"));
    let mut encoder = sensor("{}");
    assert!(encoder.set(&[0], Values::F64(&[f64::NAN])).is_err());
    assert!(encoder.set(&[16], Values::F64(&[0.0])).is_err());
    assert!(encoder.get(&[16], ValuesMut::Bool(&mut [false])).is_err());
    assert!(encoder.restore_state(0).is_err() && encoder.save_state(99).is_err());
}

#[test]
fn a_range_finder_shows_its_ray_in_the_frame_of_its_body() {
    let down = std::f64::consts::FRAC_1_SQRT_2;
    let text = format!(
        r#"{{"kind": "range-finder", "mount": "robot.body", "mount_offset": [0.1, 0, -0.5, {down}, 0, {down}, 0], "rate_hz": 0}}"#
    );
    let mut finder = sensor(&text);
    finder.observe(&Step::free(0.0, H, 0), &Flight::at(0.0, H)).unwrap();
    let distance = get(&*finder, "distance");
    assert!((distance - (UP + H - 0.5)).abs() < 1e-9, "{distance}");
    let mut all = Vec::new();
    finder.overlays(&mut all);
    let [Overlay { frame: Overlay::MOUNT, figure: Figure::Lines { points, .. }, .. }] = &all[..] else {
        panic!("one ray: {all:?}")
    };
    let tip = [0.1, 0.0, -0.5 - distance];
    assert!(
        points[0] == [0.1, 0.0, -0.5] && (0..3).all(|k| (points[1][k] - tip[k]).abs() < 1e-9),
        "{points:?}"
    );
    let mut none = Vec::new();
    sensor(r#"{"kind": "imu", "mount": "robot.body"}"#).overlays(&mut none);
    assert!(none.is_empty());
}
