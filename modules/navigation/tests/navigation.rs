//! The errors and ways of the modules against closed forms, and their refusals.
#![allow(clippy::unwrap_used, missing_docs)]

use std::sync::Arc;
use terraglue_navigation::{Driver, Gnss, Odometry, Steering};
use terraglue_subsystem::*;

/// One body that stands at a place.
struct Standing {
    names: Vec<String>,
    scene: Scene,
    time: f64,
}

impl Standing {
    fn new() -> Self {
        let scene = Scene { bodies: vec![SceneBody { name: "body".into(), mass: 1.0 }], ..Scene::default() };
        Self { names: vec!["robot".into()], scene, time: 0.0 }
    }
}

impl World for Standing {
    fn interval(&self) -> [f64; 2] {
        [0.0, self.time]
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
    fn pose(&self, _: BodyRef, _: f64) -> Option<BodyState> {
        let world_from_body = Pose { position: [3.0, -2.0, 1.0], ..Pose::IDENTITY };
        Some(BodyState { world_from_body, ..BodyState::REST })
    }
    fn cast_rays(&self, _: &[Ray], _: &RayMask, _: &mut [RayHit]) {}
    fn ground_heights(&self, _: &[[f64; 2]], _: &mut [f64]) {}
    fn overlap(&self, _: [f64; 3], _: f64, _: &RayMask, _: &mut Vec<ShapeRef>) {}
}

fn made<M: Module>(json: &str) -> Result<Box<dyn Subsystem>> {
    M::instantiate(&Config::parse(json)?.with_defaults(&M::schema()), Arc::new(Standalone::default()))
}

fn id(instance: &dyn Subsystem, name: &str) -> u32 {
    instance.variables().iter().find(|v| v.name == name).unwrap().id
}

fn read(instance: &dyn Subsystem, name: &str) -> f64 {
    let mut out = [0.0];
    instance.get(&[id(instance, name)], ValuesMut::F64(&mut out)).unwrap();
    out[0]
}

fn write(instance: &mut dyn Subsystem, name: &str, value: f64) {
    instance.set(&[id(instance, name)], Values::F64(&[value])).unwrap();
}

fn step(instance: &mut dyn Subsystem, t: f64, h: f64) {
    let step = Step::free(t, h, 0);
    let mut out = Response { x: &mut [], v: &mut [], a: &mut [], t: &mut [], reached: f64::NAN, flags: 0 };
    instance.advance(&step, &Input::Force { t: &[], motion: None }, &mut out).unwrap();
    instance.commit(&step, &[], &Motion { x: &[], v: &[] }).unwrap();
}

/// Fixes of a receiver, one a second.
fn fixes(json: &str, count: u32) -> Vec<[f64; 3]> {
    let mut gnss = made::<Gnss>(&format!(r#"{{"mount": "robot.body"{json}}}"#)).unwrap();
    let mut world = Standing::new();
    (0..count)
        .map(|k| {
            world.time = f64::from(k);
            let start = if k > 0 { world.time - 1.0 } else { 0.0 };
            let step = Step::free(start, world.time - start, 0);
            gnss.observe(&step, &world).unwrap();
            ["x", "y", "deviation"].map(|name| read(gnss.as_ref(), name))
        })
        .collect()
}

#[test]
fn the_error_of_gnss_has_its_deviation_and_forgets_as_it_is_told() {
    let all = fixes(r#", "canopy_m": 8, "correlation_s": 5, "noise_m": 0, "offset_m": [10, 0]"#, 20_000);
    let errors: Vec<f64> = all.iter().map(|f| f[0] - 3.0 - 10.0).collect();
    let n = errors.len() as f64;
    let mean = errors.iter().sum::<f64>() / n;
    let square = errors.iter().map(|e| e * e).sum::<f64>() / n;
    let next = errors.windows(2).map(|w| w[0] * w[1]).sum::<f64>() / n;
    // about n·(1 − ρ)/(1 + ρ) errors are independent: 2,000 with ρ = e^(−1/5); four standard errors
    assert!(mean.abs() < 4.0 * 8.0 / 2000.0_f64.sqrt(), "{mean}");
    assert!((square / 64.0 - 1.0).abs() < 4.0 * (2.0 / 2000.0_f64).sqrt(), "{square}");
    assert!((next / square - (-0.2_f64).exp()).abs() < 0.03, "{}", next / square);
    assert!(all.iter().all(|f| f[2] == 8.0));
}

#[test]
fn outages_take_their_share_of_the_time_and_the_same_run_has_the_same_ones() {
    let json = r#", "between_outages_s": 30, "outage_s": 10"#;
    let all = fixes(json, 20_000);
    let out = all.iter().filter(|f| f[2] == 0.0).count() as f64 / 20_000.0;
    assert!((out - 0.25).abs() < 0.04, "{out}");
    assert_eq!(all[..500], fixes(json, 500)[..]);
}

#[test]
fn odometry_of_a_circle_comes_back_and_slip_makes_it_longer() {
    let around = |slip: f64| {
        let mut odometry = made::<Odometry>(&format!(r#"{{"radius_m": 0.5, "slip": {slip}}}"#)).unwrap();
        (1..=4).for_each(|k| write(odometry.as_mut(), &format!("rate_{k}"), 2.0));
        write(odometry.as_mut(), "gyro", 0.1);
        // a turn takes 2π/0.1 s; half of it is a diameter of 20 m away
        let h = std::f64::consts::PI / 0.1 / 1000.0;
        (0..1000).for_each(|k| step(odometry.as_mut(), f64::from(k) * h, h));
        ["x", "y", "yaw"].map(|name| read(odometry.as_ref(), name))
    };
    let [x, y, yaw] = around(0.0);
    assert!(
        x.abs() < 1e-4 && (y - 20.0).abs() < 1e-4 && (yaw - std::f64::consts::PI).abs() < 1e-9,
        "{x} {y}"
    );
    assert!((around(0.1)[1] - 18.0).abs() < 1e-3);
}

#[test]
fn a_driver_brings_a_machine_that_bends_along_its_way() {
    let json =
        r#"{"way_points_m": [0, 0, 20, 0, 40, 8, 60, 8], "front_m": 2.0, "rear_m": 2.1, "speed_m_s": 1.0}"#;
    let mut driver = made::<Driver>(json).unwrap();
    let steering = Steering { front_m: 2.0, rear_m: 2.1, most_rad: 0.7 };
    let (mut x, mut y, mut yaw, mut worst) = (0.0, 1.0, 0.0_f64, 0.0_f64);
    let known = id(driver.as_ref(), "is_known");
    driver.set(&[known], Values::Bool(&[true])).unwrap();
    for k in 0..8000 {
        [("x", x), ("y", y), ("yaw", yaw)].iter().for_each(|(n, v)| write(driver.as_mut(), n, *v));
        step(driver.as_mut(), 0.01 * f64::from(k), 0.01);
        let speed = 0.25 * (read(driver.as_ref(), "rate_left") + read(driver.as_ref(), "rate_right"));
        x += 0.01 * speed * yaw.cos();
        y += 0.01 * speed * yaw.sin();
        yaw += 0.01 * speed * steering.curvature(read(driver.as_ref(), "steering"));
        if x > 12.0 {
            worst = worst.max(read(driver.as_ref(), "aside"));
        }
    }
    let mut arrived = [false];
    driver.get(&[id(driver.as_ref(), "arrived")], ValuesMut::Bool(&mut arrived)).unwrap();
    assert!(arrived[0] && (x - 60.0).abs() < 1.5 && (y - 8.0).abs() < 0.5 && worst < 0.7, "{x} {y} {worst}");
    // without a pose it stops
    driver.set(&[known], Values::Bool(&[false])).unwrap();
    (0..500).for_each(|k| step(driver.as_mut(), 80.0 + 0.01 * f64::from(k), 0.01));
    assert_eq!(read(driver.as_ref(), "rate_left"), 0.0);
}

#[test]
fn parameters_and_values_that_make_no_sense_are_refused() {
    for way in ["[0, 0]", "[0, 0, 1]", "[0, 0, 0, 0]", "[0, 0, 1e9, 0]"] {
        let error = made::<Driver>(&format!(r#"{{"way_points_m": {way}}}"#)).err().unwrap().to_string();
        assert!(error.contains("way_points_m"), "{error}");
    }
    let error = made::<Gnss>(r#"{"mount": "robot.body", "offset_m": [1]}"#).err().unwrap().to_string();
    assert!(error.contains("offset_m"), "{error}");
    assert!(made::<Gnss>(r#"{"mount": "robot"}"#).is_err());
    let mut gnss = made::<Gnss>(r#"{"mount": "robot.mast"}"#).unwrap();
    let missing = gnss.observe(&Step::free(0.0, 0.0, 0), &Standing::new()).unwrap_err().to_string();
    assert!(missing.contains("robot.mast"), "{missing}");
    let mut odometry = made::<Odometry>("{}").unwrap();
    let gyro = id(odometry.as_ref(), "gyro");
    assert!(odometry.set(&[gyro], Values::F64(&[f64::NAN])).is_err());
}
