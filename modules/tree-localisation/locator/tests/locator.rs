//! The module: point clouds of scanners, messages that are none, scanners at the wrong place, states that are saved.
#![allow(clippy::unwrap_used, missing_docs)]

mod standing;

use proptest::prelude::*;
use standing::Standing;
use std::sync::Arc;
use terraglue_laser_scanner::{Told, message};
use terraglue_subsystem::*;
use terraglue_tree_locator::{Cloud, TreeLocator};

const POSE: Pose = Pose { position: [0.3, -0.9, 1.6], orientation: [0.8, 0.0, 0.0, 0.6] };

fn told(position: [f64; 3]) -> Told {
    Told { position, time: 1.95, intensity: 0.5, ring: 7, subsystem: 2, body: 5, shape: 9 }
}

/// A machine of two bodies that stands.
fn world() -> Standing {
    let body = |name: &str| SceneBody { name: name.into(), mass: 1.0 };
    let scene = Scene { bodies: vec![body("front"), body("head")], ..Scene::default() };
    Standing::with(scene)
}

fn locator(json: &str) -> Result<TreeLocator> {
    let json = format!(r#"{{"mount": "machine.front"{json}}}"#);
    let config = Config::parse(&json)?.with_defaults(&TreeLocator::schema());
    TreeLocator::new(&config, Arc::new(Standalone::default()))
}

fn id(instance: &dyn Subsystem, name: &str) -> u32 {
    instance.variables().iter().find(|v| v.name == name).unwrap().id
}

fn send(instance: &mut TreeLocator, name: &str, bytes: &[u8]) {
    let input = id(instance, name);
    instance.set(&[input], Values::Binary(&[bytes.to_vec()])).unwrap();
}

fn count(instance: &TreeLocator, name: &str) -> u64 {
    let mut out = [0];
    instance.get(&[id(instance, name)], ValuesMut::U64(&mut out)).unwrap();
    out[0]
}

#[test]
fn a_cloud_is_read_as_a_scanner_told_it() {
    let points = [told([1.0, 2.0, 3.0]), told([-4.0, 0.5, 0.25])];
    let cloud = Cloud::read(&message(&points, 2.0, "machine/front", &POSE)).unwrap();
    assert_eq!((cloud.frame.as_str(), cloud.pose), ("machine/front", Some(POSE)));
    assert_eq!(cloud.points[1].position, [-4.0, 0.5, 0.25]);
    assert!((cloud.points[0].time + 0.05).abs() < 1e-6);
    assert_eq!((cloud.points[0].ring, cloud.points[0].on), (Some(7), Some((2, 5))));
}

#[test]
fn messages_that_are_none_are_left_out_and_counted() {
    let mut locator = locator("").unwrap();
    let whole = message(&[told([1.0, 2.0, 3.0])], 2.0, "machine/front", &POSE);
    for bytes in [&b""[..], b"\xff\xff\xff\xff", &whole[..whole.len() - 3]] {
        send(&mut locator, "points_1", bytes);
        locator.observe(&Step::free(0.0, 1.0, 0), &world()).unwrap();
    }
    send(&mut locator, "map", b"x,y\n1,2\nthree,4\n");
    locator.observe(&Step::free(0.0, 1.0, 0), &world()).unwrap();
    assert_eq!((count(&locator, "refused"), count(&locator, "scans")), (4, 0));
}

#[test]
fn scanners_and_bodies_that_do_not_belong_together_are_errors_that_say_so() {
    let step = Step::free(0.0, 1.0, 0);
    let mut rear = locator("").unwrap();
    send(&mut rear, "points_1", &message(&[], 2.0, "machine/rear", &POSE));
    let why = rear.observe(&step, &world()).unwrap_err().to_string();
    assert!(why.contains("machine.rear") && why.contains("machine.front"), "{why}");
    let mut boom = locator(r#", "own_bodies": "head boom""#).unwrap();
    send(&mut boom, "points_1", &message(&[], 2.0, "machine/front", &POSE));
    let why = boom.observe(&step, &world()).unwrap_err().to_string();
    assert!(why.contains("`boom`") && why.contains("front, head"), "{why}");
    for bad in [r#", "map": "no such file.csv""#, r#", "mask": "hands""#, r#", "nearest_m": 50"#] {
        assert!(locator(bad).is_err(), "{bad}");
    }
    let why = locator(r#", "map": "Cargo.toml""#).err().unwrap().to_string();
    assert!(why.contains("Cargo.toml"), "{why}");
}

#[test]
fn a_state_goes_on_in_another_instance_with_its_map() {
    let mut one = locator("").unwrap();
    send(&mut one, "map", b"x,y\n1,2\n3,4\n5,7\n");
    send(&mut one, "points_1", &message(&[], 2.0, "machine/front", &POSE));
    one.observe(&Step::free(0.0, 1.0, 0), &world()).unwrap();
    let bytes = one.serialize().unwrap();
    let mut other = locator("").unwrap();
    other.deserialize(&bytes).unwrap();
    assert_eq!(other.serialize().unwrap(), bytes);
    assert_eq!(count(&other, "scans"), 1);
    assert!(other.deserialize(&bytes[..bytes.len() - 9]).is_err());
    assert!(locator(r#", "scanners": 2"#).unwrap().deserialize(&bytes).is_err());
}

proptest! {
    /// Whatever comes, an answer comes back.
    #[test]
    fn no_bytes_break_the_reader(bytes in prop::collection::vec(any::<u8>(), 0..400), at in 0_usize..500, value in any::<u8>()) {
        let _ = Cloud::read(&bytes);
        let mut whole = message(&[told([1.0, 2.0, 3.0]); 3], 2.0, "machine/front", &POSE);
        let place = at % whole.len();
        whole[place] = value;
        let _ = Cloud::read(&whole);
    }
}
