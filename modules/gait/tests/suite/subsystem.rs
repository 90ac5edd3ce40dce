//! Trials, commits, snapshots, variables and refusals.

use crate::common;
use common::{H, gait, read, run, set, step, targets, trial};
use std::sync::Arc;
use terraglue_gait::Gait;
use terraglue_subsystem::{
    Causality, Config, Effect, Error, Module, Standalone, Subsystem, Values, ValuesMut, unit::Unit,
};

#[test]
fn a_trial_is_invisible_until_it_is_committed() {
    let mut a = gait("{}");
    let mut b = gait("{}");
    run(&mut a, 2.0);
    run(&mut b, 2.0);
    let before = *a.walker();
    trial(&mut a, 0.4).expect("a long trial");
    trial(&mut a, H).expect("a trial");
    assert_eq!(*a.walker(), before);
    step(&mut a, H);
    step(&mut b, H);
    assert_eq!(a.walker(), b.walker());
    assert_ne!(*a.walker(), before);
}

#[test]
fn a_snapshot_brings_back_the_same_bits() {
    let mut gait = gait("{}");
    set(&mut gait, "roll", 0.05).expect("accepted");
    run(&mut gait, 2.345);
    gait.save_state(1).expect("saved");
    let walk = |gait: &mut Gait| {
        (0..700).for_each(|_| step(gait, H));
        targets(gait).map(f64::to_bits)
    };
    let first = walk(&mut gait);
    set(&mut gait, "speed", -0.3).expect("accepted");
    set(&mut gait, "gait", 1.0).expect("accepted");
    run(&mut gait, 1.0);
    gait.restore_state(1).expect("restored");
    assert_eq!(read(&gait, "speed"), 0.15);
    assert_eq!(first, walk(&mut gait));
    assert!(matches!(gait.restore_state(0), Err(Error::Refused(_))), "nothing was saved there");
    assert!(matches!(gait.save_state(7), Err(Error::Refused(_))));
}

#[test]
fn a_step_of_no_length_changes_nothing_and_one_beyond_a_cycle_is_discarded() {
    let mut gait = gait("{}");
    run(&mut gait, 2.0);
    let before = *gait.walker();
    step(&mut gait, 0.0);
    assert_eq!(*gait.walker(), before);
    assert!(matches!(trial(&mut gait, 2.0), Err(Error::Discard { .. })));
}

#[test]
fn variables_are_complete_and_every_one_can_be_read() {
    let gait = gait("{}");
    let variables = gait.variables();
    assert!(variables.windows(2).all(|w| w[0].id < w[1].id));
    let targets: Vec<_> = variables.iter().filter(|v| v.name.ends_with(".angle_target")).collect();
    assert_eq!(targets.len(), 24);
    assert_eq!(
        (targets[0].name.as_str(), targets[23].name.as_str()),
        ("LF_j1.angle_target", "RR_j4.angle_target")
    );
    for v in variables {
        Unit::parse(&v.unit).expect("a unit");
        if v.enumeration.is_empty() {
            assert!(read(&gait, &v.name).is_finite());
        } else {
            let mut out = [9];
            gait.get(&[v.id], ValuesMut::Enumeration(&mut out)).expect("a choice");
            assert_eq!(v.enumeration[out[0] as usize], "tripod");
        }
        let live = matches!(v.causality, Causality::Input | Causality::Parameter);
        assert_eq!(v.effect, if live { Effect::Live } else { Effect::ReadOnly });
    }
}

#[test]
fn wrong_values_are_refused_and_change_nothing() {
    let mut gait = gait("{}");
    for (name, value) in [
        ("speed", 5.0),
        ("roll", f64::NAN),
        ("lift", -0.1),
        ("gait", 3.0),
        ("phase", 0.5),
        ("LF.stance", 1.0),
    ] {
        assert!(matches!(set(&mut gait, name, value), Err(Error::Refused(_))), "{name}");
    }
    let ids: Vec<u32> =
        ["speed", "lift"].map(|n| gait.variables().iter().find(|v| v.name == n).expect("there").id).into();
    assert!(gait.set(&ids, Values::F64(&[0.2, 9.0])).is_err());
    assert_eq!(read(&gait, "speed"), 0.15, "all or nothing");
    assert!(gait.set(&ids, Values::F64(&[0.2])).is_err());
    assert!(gait.get(&[99], ValuesMut::F64(&mut [0.0])).is_err());
}

#[test]
fn wrong_parameters_are_refused_with_their_name() {
    for (json, word) in [
        (r#"{"links_m": [0.06, 0.1, 0.2]}"#, "links_m"),
        (r#"{"body_height_m": 0.9}"#, "body_height_m"),
        (r#"{"foot_y_m": 1.2}"#, "foot_y_m"),
        (r#"{"gait": "gallop"}"#, "tripod"),
        (r#"{"speed_m_s": "fast"}"#, "speed_m_s"),
    ] {
        let error = Gait::new(&Config::parse(json).expect("JSON"), 1).err().expect("refused");
        assert!(error.to_string().contains(word), "{error}");
    }
}

#[test]
fn the_schema_has_a_default_for_all_but_the_optional_parameters() {
    let schema = Gait::schema();
    assert!(schema.parameters.iter().all(|p| p.optional == p.default.is_null()));
    let host = Arc::new(Standalone::default());
    Gait::instantiate(&Config::default(), host).expect("a gait without parameters");
}
