//! Loops, rods, springs, couplings and the rarer joints, in every rule of integration.

use crate::common;
use common::{Fixture, instantiate, temporary_urdf};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

const G: f64 = 9.81;
const RULES: [&str; 3] = ["symplectic-euler", "generalized-alpha", "energy-momentum"];

fn link(name: &str, mass: f64, com: &str, i: f64) -> String {
    format!(
        r#"<link name="{name}"><inertial><origin xyz="{com}"/><mass value="{mass}"/>
        <inertia ixx="{i}" iyy="{i}" izz="{i}" ixy="0" ixz="0" iyz="0"/></inertial></link>"#
    )
}

fn joint(parent: &str, child: &str, at: &str, axis: &str) -> String {
    format!(
        r#"<joint name="j_{child}" type="continuous"><parent link="{parent}"/><child link="{child}"/>
        <origin xyz="{at}"/><axis xyz="{axis}"/></joint>"#
    )
}

/// Two upright posts with a bar between their tops; the loop is closed by parameters.
fn four_bar(name: &str) -> String {
    let text = [
        r#"<robot name="four_bar"><link name="world"/>"#,
        &link("left", 1.0, "0 0 0.5", 0.1),
        &link("right", 1.0, "0 0 0.5", 0.1),
        &link("bar", 1.0, "0.5 0 0", 0.1),
        &joint("world", "left", "0 0 0", "0 1 0"),
        &joint("world", "right", "1 0 0", "0 1 0"),
        &joint("left", "bar", "0 0 1", "0 1 0"),
        "</robot>",
    ]
    .concat();
    temporary_urdf(name, &text)
}

const CLOSE: &str = r#""loop": [{"name": "close", "kind": "revolute", "links": ["right", "bar"],
    "origin": [0, 0, 1], "axis": [0, 1, 0]}]"#;

fn new(file: &str, rule: &str, more: &str) -> Fixture {
    let text = format!(r#"{{"model": "{file}", "motor": "off", "integrator": "{rule}", {more}}}"#);
    Fixture::new(&text, G, 1e-3)
}

fn point(fixture: &Fixture, body: usize, at: Vector3<f64>) -> Vector3<f64> {
    let pose = fixture.states()[body].world_from_body;
    let [w, x, y, z] = pose.orientation;
    Vector3::from(pose.position) + UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)) * at
}

#[test]
fn a_four_bar_swings_as_its_reduced_equation_says() {
    // Posts at angle a from the vertical: (2·(0.1 + 0.25) + 1)·a'' = 2·g·sin a.
    let (mut a, mut w, h) = (0.3_f64, 0.0_f64, 1e-5);
    for _ in 0..50_000 {
        let f = |a: f64| 2.0 * G * libm::sin(a) / 1.7;
        let (k1, v1) = (w, f(a));
        let (k2, v2) = (w + 0.5 * h * v1, f(a + 0.5 * h * k1));
        (a, w) = (a + h * k2, w + h * v2);
        let _ = k1;
    }
    for (rule, tolerance) in RULES.into_iter().zip([5e-3, 1e-5, 1e-5]) {
        let more = format!(r#""joints": {{"j_left": 0.3, "j_right": 0.3, "j_bar": -0.3}}, {CLOSE}"#);
        let mut fixture = new(&four_bar("four_bar"), rule, &more);
        assert_eq!(fixture.get("loops.redundant_rows"), 3.0);
        let start = fixture.robot.energy().mechanical();
        for _ in 0..500 {
            fixture.free_step();
            let open = point(&fixture, 2, Vector3::z()) - point(&fixture, 1, Vector3::x());
            assert!(open.norm() < 1e-9, "{rule}: {open}");
        }
        let error = (fixture.get("j_right.angle") - a).abs();
        assert!(error < tolerance, "{rule}: {error}");
        let change = (fixture.robot.energy().mechanical() - start).abs();
        assert!(
            change < [0.2, 1e-3, 1e-9][RULES.iter().position(|r| *r == rule).unwrap()],
            "{rule}: {change}"
        );
    }
}

#[test]
fn a_broken_loop_lets_go() {
    let mut fixture = new(&four_bar("broken_loop"), RULES[0], CLOSE);
    (0..10).for_each(|_| fixture.free_step());
    assert!(fixture.get("close.force") > 1.0);
    fixture.robot.act("close.break", "{}").unwrap();
    (0..300).for_each(|_| fixture.free_step());
    assert_eq!((fixture.get("close.force"), fixture.get("loops.redundant_rows")), (0.0, 0.0));
    assert!((point(&fixture, 2, Vector3::x()) - point(&fixture, 1, Vector3::z())).norm() > 0.1);
}

#[test]
fn a_stiff_spring_swings_with_its_period_and_loses_what_its_damper_takes() {
    let file =
        temporary_urdf("bob", &format!(r#"<robot name="bob">{}</robot>"#, link("bob", 2.0, "0 0 0", 0.1)));
    for (rule, tolerance) in RULES.into_iter().zip([2e-4, 2e-6, 2e-6]) {
        let more = r#""position_m": [0, 0, -1], "spring": [{"name": "s", "links": ["world", "bob"],
            "origin": [0, 0, 0], "origin_2": [0, 0, 0], "stiffness": 800, "rest_length": 1.0}]"#;
        let mut fixture = new(&file, rule, more);
        (0..1000).for_each(|_| fixture.free_step());
        let expected = -1.0 - 2.0 * G / 800.0 * (1.0 - libm::cos(20.0));
        let error = (fixture.get("bob.z") - expected).abs();
        assert!(error < tolerance * 10.0, "{rule}: {error}");
        // Far stiffer than the step resolves: it hangs.
        let more = more.replace("800", "8e9").replace(", \"rest", ", \"damping\": 1e6, \"rest");
        let mut fixture = new(&file, rule, &more);
        (0..2000).for_each(|_| fixture.free_step());
        assert!((fixture.get("bob.z") + 1.0).abs() < 1e-4 && fixture.get("bob.vz").abs() < 1e-3, "{rule}");
        assert!((fixture.get("s.force") - 2.0 * G).abs() < 1e-2, "{rule}: {}", fixture.get("s.force"));
    }
}

#[test]
fn coupled_joints_keep_their_ratio() {
    for rule in RULES {
        let more = r#""coupling": [{"name": "gear", "joints": ["j_right", "j_left"], "ratio": -2.0, "offset": 0.1}],
            "joints": {"j_left": 0.2, "j_right": -0.3}"#;
        let mut fixture = new(&four_bar("gear"), rule, more);
        for _ in 0..500 {
            fixture.free_step();
            let left = fixture.get("j_right.angle") + 2.0 * fixture.get("j_left.angle") - 0.1;
            assert!(left.abs() < 1e-9, "{rule}: {left}");
        }
        assert!((fixture.get("j_left.angle") - 0.2).abs() > 0.05);
    }
}

#[test]
fn a_rod_keeps_its_length() {
    let file =
        temporary_urdf("rod", &format!(r#"<robot name="bob">{}</robot>"#, link("bob", 2.0, "0 0 0", 1e-6)));
    for rule in RULES {
        let more = r#""position_m": [1, 0, 0], "loop": [{"name": "rod", "kind": "rod", "links": ["world", "bob"],
            "origin": [0, 0, 0], "origin_2": [0, 0, 0]}]"#;
        let mut fixture = new(&file, rule, more);
        for _ in 0..1000 {
            fixture.free_step();
            assert!((point(&fixture, 0, Vector3::zeros()).norm() - 1.0).abs() < 1e-10, "{rule}");
        }
        assert!(
            fixture.robot.energy().mechanical().abs() < if rule == RULES[0] { 0.3 } else { 1e-3 },
            "{rule}"
        );
    }
}

/// Which of the child's freedoms a joint leaves: three translations, three rotations, measured after pushing it about.
#[test]
fn rarer_joints_leave_what_they_promise() {
    let body = link("arm", 1.0, "0 0 0", 0.1);
    let file = temporary_urdf(
        "kinds",
        &[
            r#"<robot name="kinds"><link name="world"/>"#,
            &body,
            &joint("world", "arm", "0 0 0", "0 0 1"),
            "</robot>",
        ]
        .concat(),
    );
    // Axis z: free directions of (x, y, z) and (turn about x, y, z).
    let cases = [
        ("cylindrical", [false, false, true], [false, false, true]),
        ("universal", [false, false, false], [false, true, true]),
        ("spherical", [false, false, false], [true, true, true]),
        ("planar", [true, true, false], [false, false, true]),
    ];
    for (kind, slides, turns) in cases {
        for rule in RULES {
            let more = format!(
                r#""joint_kind": "{kind}", "spring": [
                {{"name": "a", "links": ["world", "arm"], "origin": [3, 1, 2], "origin_2": [0.5, 0, 0], "stiffness": 9,
                "rest_length": 0}},
                {{"name": "b", "links": ["world", "arm"], "origin": [-1, 2, -3], "origin_2": [0, 0.5, 0.3], "stiffness": 7,
                "rest_length": 0}}]"#
            );
            let text = format!(r#"{{"model": "{file}", "motor": "off", "integrator": "{rule}", {more}}}"#);
            let mut fixture = Fixture::new(&text, 0.0, 1e-3);
            (0..100).for_each(|_| fixture.free_step());
            let p = fixture.states()[0].world_from_body;
            let [w, x, y, z] = p.orientation;
            let q = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
            let first: [bool; 3] = std::array::from_fn(|k| p.position[k].abs() > 1e-3);
            assert_eq!(first, slides, "{kind} {rule}");
            let turned = match kind {
                // About the parent's z and the child's second axis: the two stay perpendicular.
                "universal" => {
                    assert!((q * Vector3::y()).z.abs() < 1e-9, "{rule}");
                    [false, (q * Vector3::z()).z < 1.0 - 1e-6, (q * Vector3::y()).x.abs() > 1e-3]
                }
                _ => std::array::from_fn(|k| q.scaled_axis()[k].abs() > 1e-3),
            };
            assert_eq!(turned, turns, "{kind} {rule}");
        }
    }
}

#[test]
fn what_does_not_fit_is_refused_by_name() {
    let refused = |more: &str| {
        let file = four_bar("refused");
        let text = format!(r#"{{"model": "{file}", "motor": "off", {more}}}"#);
        instantiate(&text, G).err().map(|e| e.to_string()).unwrap_or_default()
    };
    let open = refused(&CLOSE.replace(r#""axis": "#, r#""origin_2": [0.9, 0, 0], "axis": "#));
    assert!(open.contains("`close`") && open.contains("open by 1.000e-1"), "{open}");
    let unknown = refused(&CLOSE.replace("\"bar\"", "\"bra\""));
    assert!(unknown.contains("did you mean `bar`?"), "{unknown}");
    let kind = refused(&CLOSE.replace("\"revolute\"", "\"revolut\""));
    assert!(kind.contains("`revolut` is none of"), "{kind}");
    let key = refused(&CLOSE.replace("\"axis\"", "\"axes\""));
    assert!(key.contains("unknown key"), "{key}");
}
