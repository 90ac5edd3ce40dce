//! Rigid ground and bodies that touch each other: inclines, rolling, rebound, stacks, the hexapod on its feet.

use crate::common;
use common::{Fixture, STAND, temporary_urdf};
use proptest::prelude::*;
use terraglue_numerics::extremes::larger;

const G: f64 = 9.81;

fn link(name: &str, mass: f64, inertia: [f64; 3], geometry: &str) -> String {
    let [x, y, z] = inertia;
    format!(
        r#"<link name="{name}"><inertial><mass value="{mass}"/>
        <inertia ixx="{x}" iyy="{y}" izz="{z}" ixy="0" ixz="0" iyz="0"/></inertial>
        <collision><geometry>{geometry}</geometry></collision></link>"#
    )
}

fn box_link(name: &str, mass: f64, size: [f64; 3]) -> String {
    let [x, y, z] = size;
    let i = |a: f64, b: f64| mass * (a * a + b * b) / 12.0;
    let geometry = format!(r#"<box size="{x} {y} {z}"/>"#);
    link(name, mass, [i(y, z), i(x, z), i(x, y)], &geometry)
}

fn sphere_link(name: &str, mass: f64, r: f64) -> String {
    link(name, mass, [0.4 * mass * r * r; 3], &format!(r#"<sphere radius="{r}"/>"#))
}

/// One free body at a height on ground whose normal stands at an angle to gravity.
fn on_incline(name: &str, body: &str, z: f64, degrees: f64, more: &str) -> Fixture {
    let model = temporary_urdf(name, &format!(r#"<robot name="r">{body}</robot>"#));
    let (sin, cos) = (degrees.to_radians().sin(), degrees.to_radians().cos());
    // Gravity stays vertical in the fixture: the ground and the body are turned instead, downhill along +x.
    let parameters = format!(
        r#"{{"model": "{model}", "position_m": [{}, 0, {}], "ground": "half-space",
        "ground_normal": [{sin}, 0, {cos}], "heading_rad": 0 {more}}}"#,
        z * sin,
        z * cos
    );
    Fixture::new(&parameters, G, 1e-3)
}

#[test]
fn a_sphere_thrown_along_the_ground_slides_and_then_rolls() {
    // Friction turns a throw at v0 into rolling at 5/7·v0.
    let mut fixture = on_incline("slide", &sphere_link("s", 1.0, 0.1), 0.1, 0.0, r#", "friction": 0.3"#);
    fixture.push("s", [2.0 / fixture.h, 0.0, 0.0]);
    fixture.free_step();
    fixture.push("s", [0.0; 3]);
    (0..600).for_each(|_| fixture.free_step());
    let v = fixture.states()[0].linear_velocity[0];
    assert!((v - 2.0 * 5.0 / 7.0).abs() < 5e-3, "{v}");
    assert!((fixture.states()[0].world_from_body.position[2] - 0.1).abs() < 1e-9);
}

#[test]
fn a_sphere_rolls_down_the_incline() {
    let mut fixture = on_incline("roll", &sphere_link("s", 1.0, 0.1), 0.1, 20.0, r#", "friction": 0.5"#);
    (0..1000).for_each(|_| fixture.free_step());
    let v = fixture.states()[0].linear_velocity;
    let a = (v[0] * v[0] + v[2] * v[2]).sqrt() / fixture.t;
    let exact = 5.0 / 7.0 * G * 20.0_f64.to_radians().sin();
    assert!((a / exact - 1.0).abs() < 1e-3, "{a} {exact}");
}

/// Height of the rebound of a ball that is dropped from 1 m.
fn rebound(name: &str, more: &str) -> f64 {
    let mut fixture = on_incline(name, &sphere_link("s", 1.0, 0.1), 1.1, 0.0, more);
    let mut apex: f64 = 0.0;
    for step in 0..1000 {
        fixture.free_step();
        if step > 500 {
            apex = larger(apex, fixture.states()[0].world_from_body.position[2] - 0.1);
        }
    }
    apex
}

#[test]
fn a_ball_rebounds_with_the_coefficient_of_restitution() {
    let apex = rebound("bounce", r#", "restitution": 0.8"#);
    assert!((apex - 0.64).abs() < 0.01, "{apex}");
}

/// Free bodies: hung from a far root by joints that are broken at once.
fn loose(name: &str, bodies: &[(String, f64)], more: &str) -> Fixture {
    let mut text = format!(r#"<robot name="r">{}"#, box_link("root", 1.0, [0.1; 3]));
    for (k, (link, z)) in bodies.iter().enumerate() {
        text += link;
        text += &format!(
            r#"<joint name="j{k}" type="prismatic"><parent link="root"/><child link="b{k}"/>
            <origin xyz="50 0 {z}"/><axis xyz="0 0 1"/><limit lower="-9" upper="9" effort="1" velocity="1"/></joint>"#
        );
    }
    let model = temporary_urdf(name, &(text + "</robot>"));
    let parameters = format!(
        r#"{{"model": "{model}", "position_m": [0, 0, 0.05], "ground": "half-space", "motor": "off" {more}}}"#
    );
    let mut fixture = Fixture::new(&parameters, G, 1e-3);
    (0..bodies.len()).for_each(|k| fixture.robot.act(&format!("j{k}.break"), "").unwrap());
    fixture
}

#[test]
fn a_stack_of_ten_boxes_stands() {
    let bodies: Vec<_> =
        (0..10).map(|k| (box_link(&format!("b{k}"), 1.0, [0.2; 3]), 0.05 + 0.2 * f64::from(k))).collect();
    let mut fixture = loose("stack", &bodies, r#", "friction": 0.6"#);
    let top = |fixture: &Fixture| fixture.states()[10].world_from_body.position;
    let start = top(&fixture);
    (0..500).for_each(|_| fixture.free_step());
    let end = top(&fixture);
    println!("sink {:e} drift {:e}", start[2] - end[2], (end[0] - start[0]).hypot(end[1] - start[1]));
    assert!((end[2] - start[2]).abs() < 1e-5, "{}", start[2] - end[2]);
    assert!((end[0] - start[0]).hypot(end[1] - start[1]) < 1e-6);
}

#[test]
fn a_tonne_stands_on_a_kilogram() {
    let bodies = [(box_link("b0", 1.0, [0.2; 3]), 0.05), (box_link("b1", 1000.0, [0.2; 3]), 0.25)];
    let mut fixture = loose("heavy", &bodies, "");
    (0..500).for_each(|_| fixture.free_step());
    let z = fixture.states()[2].world_from_body.position[2];
    assert!((z - 0.3).abs() < 1e-5, "{z}");
    let normal = fixture.get("b0.contact_normal");
    assert!((normal / (G * 2001.0) - 1.0).abs() < 1e-3, "{normal}");
}

#[test]
fn boxes_on_an_incline_stick_or_slide_as_coulomb_says() {
    for (degrees, exact) in [(20.0_f64, 0.0), (35.0, 1.608844063366257)] {
        let name = format!("incline{degrees}");
        // A sphere that cannot turn is a block: its inertia is huge.
        let body = link("s", 1.0, [1e6; 3], r#"<box size="0.2 0.2 0.1"/>"#);
        let mut fixture = on_incline(&name, &body, 0.05, 0.0, r#", "friction": 0.5"#);
        let angle = degrees.to_radians();
        let pull = [G * angle.sin(), 0.0, G * (1.0 - angle.cos())];
        for _ in 0..1000 {
            fixture.push("s", pull);
            fixture.free_step();
        }
        let x = fixture.states()[0].world_from_body.position[0];
        let v = fixture.states()[0].linear_velocity[0];
        assert!((v - exact).abs() < 1e-9 + 1e-4 * exact, "{degrees} {v} {exact}");
        assert!(degrees > 30.0 || x.abs() < 1e-12, "{x}");
    }
}

#[test]
fn the_hexapod_stands_on_rigid_ground_without_a_soil() {
    let parameters = format!(
        r#"{{"model": "models/hexapod.urdf", "position_m": [0, 0, 0.33], "ground": "half-space", {STAND}}}"#
    );
    let mut fixture = Fixture::new(&parameters, G, 1e-3);
    (0..500).for_each(|_| fixture.free_step());
    let feet: f64 =
        fixture.scene.bodies.iter().map(|b| fixture.get(&format!("{}.contact_normal", b.name))).sum();
    assert!((feet / (fixture.mass() * G) - 1.0).abs() < 1e-3, "{feet}");
}

#[test]
fn an_unknown_ground_is_refused() {
    let refused = |more: &str| {
        common::instantiate(&format!(r#"{{"model": "models/hexapod.urdf", {more}}}"#), G)
            .err()
            .unwrap()
            .to_string()
    };
    let text = refused(r#""ground": "half-space", "ground_normal": [0, 0, 0]"#);
    assert!(text.contains("ground_normal"), "{text}");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn what_is_dropped_never_gains_energy(
        seed in prop::collection::vec((0.05..0.2_f64, 0.1..10.0_f64, any::<bool>()), 2..4),
        spin in -300.0..300.0_f64,
    ) {
        let mut z = 0.1;
        let bodies: Vec<_> = seed.iter().enumerate().map(|(k, (size, mass, ball))| {
            let name = format!("b{k}");
            z += 0.3;
            (if *ball { sphere_link(&name, *mass, *size) } else { box_link(&name, *mass, [*size, 0.1, 0.15]) }, z)
        }).collect();
        let mut fixture = loose("dropped", &bodies, "");
        fixture.push("b0", [spin, 0.5 * spin, 0.0]);
        fixture.free_step();
        fixture.push("b0", [0.0; 3]);
        let mut before = fixture.robot.energy().mechanical();
        for _ in 0..500 {
            fixture.free_step();
            let after = fixture.robot.energy().mechanical();
            prop_assert!(after.is_finite() && after - before < 1e-3 * (1.0 + before.abs()), "{before} {after}");
            before = after;
        }
        prop_assert!(fixture.states().iter().skip(1).all(|b| b.world_from_body.position[2] > -1e-2));
    }
}

#[test]
fn a_pair_has_a_restitution_of_its_own() {
    for pair in ["s & ground", "ground&s", "* & ground"] {
        let name = format!("pair{}", pair.len());
        let more = format!(r#", "restitution": {{"*": 0.1, "{pair}": 0.8}}"#);
        let apex = rebound(&name, &more);
        assert!((apex - 0.64).abs() < 0.01, "{pair}: {apex}");
    }
}

#[test]
fn a_pair_has_a_friction_of_its_own() {
    // Pulled by half its weight, the upper box slides on the lower one, which the ground holds.
    let bodies =
        [(box_link("b0", 1.0, [4.0, 4.0, 0.2]), 0.05), (box_link("b1", 1.0, [0.2, 0.2, 0.02]), 0.16)];
    let speeds = |friction: &str| {
        let mut fixture =
            loose(&format!("pairs{}", friction.len()), &bodies, &format!(r#", "friction": {friction}"#));
        for _ in 0..200 {
            fixture.push("b1", [0.5 * G, 0.0, 0.0]);
            fixture.free_step();
        }
        [1, 2].map(|k| fixture.states()[k].linear_velocity[0])
    };
    let [low, high] = speeds(r#"{"*": 0.8, "b0 & b1": 0.1}"#);
    assert!(low.abs() < 1e-9 && (high / (0.4 * G * 0.2) - 1.0).abs() < 1e-6, "{low} {high}");
    // a name that is written out goes before a pattern
    assert_eq!(speeds(r#"{"*": 0.8, "b* & b*": 0.9, "b0 & b1": 0.1}"#), [low, high]);
    assert!(speeds("0.8")[1].abs() < 1e-9);
}

#[test]
fn a_pair_that_is_none_is_refused() {
    let model =
        temporary_urdf("nopair", &format!(r#"<robot name="r">{}</robot>"#, sphere_link("s", 1.0, 0.1)));
    for (key, says) in [
        ("s", "is no pair; write `A & B`"),
        ("t & ground", "fits no two bodies"),
        ("s & s", "the bodies are s"),
    ] {
        let refused =
            common::instantiate(&format!(r#"{{"model": "{model}", "friction": {{"{key}": 0.5}}}}"#), G);
        let message = refused.err().map(|e| e.to_string()).unwrap_or_default();
        assert!(message.contains("parameter `friction`") && message.contains(says), "{key}: {message}");
    }
}
