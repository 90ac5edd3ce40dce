//! Variables of the robot: energies, gaps; names that two of them would have.

use crate::common;
use common::{Fixture, instantiate, temporary_urdf};
use terraglue_subsystem::Values;

fn link(name: &str) -> String {
    format!(
        "<link name=\"{name}\"><inertial><origin xyz=\"0.5 0 0\"/><mass value=\"2\"/>\
         <inertia ixx=\"0.01\" iyy=\"0.1\" izz=\"0.1\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link>"
    )
}

fn joint(name: &str, parent: &str, child: &str) -> String {
    format!(
        "<joint name=\"{name}\" type=\"continuous\"><parent link=\"{parent}\"/><child link=\"{child}\"/>\
         <axis xyz=\"0 1 0\"/></joint>"
    )
}

fn file(test: &str, first: &str, second: &str) -> String {
    let parts = [link("a"), link("b"), joint(first, "world", "a"), joint(second, "a", "b")];
    temporary_urdf(test, &format!("<robot name=\"r\"><link name=\"world\"/>{}</robot>", parts.concat()))
}

#[test]
fn energies_are_those_of_a_falling_pendulum() {
    let text = format!(
        r#"{{"model": "{}", "motor": "off", "actuator": {{"viscous_friction": 0.2}}}}"#,
        file("told", "j", "k")
    );
    let mut fixture = Fixture::new(&text, 9.81, 1e-3);
    for _ in 0..700 {
        fixture.free_step();
        let e = fixture.robot.energy();
        assert_eq!(fixture.get("energy.kinetic"), e.kinetic);
        assert_eq!(fixture.get("energy.potential"), e.potential);
        assert_eq!(fixture.get("energy.dissipated"), e.dissipated);
    }
    // Lost potential energy is kinetic or heat: all of the energy was 0 at the start.
    let [kinetic, potential, heat] =
        ["kinetic", "potential", "dissipated"].map(|e| fixture.get(&format!("energy.{e}")));
    assert!(kinetic > 1.0 && heat > 0.1 && (kinetic + potential + heat).abs() < 0.02 * kinetic);
    assert!(
        fixture.get("joints.gap") > 0.0 && fixture.get("joints.gap") < 1e-10,
        "{}",
        fixture.get("joints.gap")
    );
}

#[test]
fn the_gap_is_that_of_joints_and_loops_that_hold() {
    let text = format!(
        r#"{{"model": "{}", "motor": "off", "coupling": [{{"name": "gear", "joints": ["k", "j"], "ratio": 1.0}}]}}"#,
        file("gaps", "j", "k")
    );
    let mut fixture = Fixture::new(&text, 9.81, 1e-3);
    (0..100).for_each(|_| fixture.free_step());
    assert!(fixture.get("joints.gap") < 1e-10, "{}", fixture.get("joints.gap"));
    // A broken part may be anywhere.
    fixture.robot.act("gear.break", "{}").unwrap();
    fixture.robot.act("k.break", "{}").unwrap();
    (0..100).for_each(|_| fixture.free_step());
    assert!(fixture.get("joints.gap") < 1e-10, "{}", fixture.get("joints.gap"));
}

#[test]
fn a_broken_joint_is_released_in_vain_and_cannot_be_blocked() {
    let text = format!(r#"{{"model": "{}", "motor": "off"}}"#, file("released", "j", "k"));
    let mut fixture = Fixture::new(&text, 9.81, 1e-3);
    fixture.robot.act("k.break", "{}").unwrap();
    let blocked = fixture.id("k.blocked");
    // A connection sets it every step.
    fixture.robot.set(&[blocked], Values::Bool(&[false])).unwrap();
    let refused = fixture.robot.set(&[blocked], Values::Bool(&[true])).unwrap_err().to_string();
    assert!(refused.contains("broken"), "{refused}");
}

#[test]
fn names_that_two_variables_would_have_are_refused() {
    let refusal = |file: &str, more: &str| {
        let made = instantiate(&format!(r#"{{"model": "{file}"{more}}}"#), 9.81);
        made.err().map(|e| e.to_string()).unwrap_or_default()
    };
    // Supply and current are the robot's own, too.
    let own = refusal(&file("own", "supply", "k"), r#", "actuator": {"kind": "dc"}"#);
    assert!(own.contains("`supply.voltage`") && own.contains("different names"), "{own}");
    // The joint of a fixed base is called so.
    let text = format!("<robot name=\"r\">{}{}{}</robot>", link("a"), link("b"), joint("base", "a", "b"));
    let base = refusal(&temporary_urdf("base", &text), r#", "fixed_base": true"#);
    assert!(base.contains("`base.broken`") && base.contains("fixed base"), "{base}");
    // A link of the robot is called like that of an object.
    let text = format!("<robot name=\"r\">{}{}{}</robot>", link("o/a"), link("b"), joint("j", "o/a", "b"));
    let object = temporary_urdf("object", &format!("<robot name=\"r\">{}</robot>", link("a")));
    let more = format!(r#", "object": [{{"name": "o", "model": "{object}", "position_m": [0, 0, 9]}}]"#);
    let twice = refusal(&temporary_urdf("beside", &text), &more);
    assert!(twice.contains("`o/a.x`"), "{twice}");
    assert_eq!(refusal(&file("good", "j", "k"), &more), "");
}
