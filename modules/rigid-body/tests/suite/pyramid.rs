//! The contact law can be chosen: a friction pyramid brakes less across its diagonals than Coulomb's cone.

use crate::common;
use common::{Fixture, STAND, temporary_urdf};

const BOX: &str = r#"<robot name="r"><link name="s"><inertial><mass value="1"/>
    <inertia ixx="1e6" iyy="1e6" izz="1e6" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><geometry><sphere radius="0.1"/></geometry></collision></link></robot>"#;

/// Deceleration over μ·g of a block that slides at an angle to x.
fn braking(law: &str, degrees: f64) -> f64 {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let model = temporary_urdf(&format!("pyramid{law}{degrees}"), BOX);
    let parameters = format!(
        r#"{{"model": "{model}", "position_m": [0, 0, 0.1], "velocity_m_s": [{}, {}, 0], "ground": "half-space",
        "friction": 0.5, "contact_solver": "{law}"}}"#,
        3.0 * cos,
        3.0 * sin
    );
    let mut fixture = Fixture::new(&parameters, 9.81, 1e-3);
    fixture.free_step();
    let [x, y, _] = fixture.states()[0].linear_velocity;
    (3.0 - x * cos - y * sin) / (0.5 * 9.81 * fixture.h)
}

#[test]
fn facets_brake_as_their_edges_say() {
    let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-6, "{a} {b}");
    for law in ["ncp", "lcp-4", "lcp-8"] {
        near(braking(law, 0.0), 1.0);
    }
    near(braking("ncp", 45.0), 1.0);
    near(braking("lcp-8", 45.0), 1.0);
    assert!(braking("lcp-4", 40.0) < 0.8);
    assert!((0.9..0.95).contains(&braking("lcp-8", 20.0)));
}

#[test]
fn the_hexapod_stands_by_the_pyramid_too() {
    for law in ["lcp-4", "lcp-8"] {
        let parameters = format!(
            r#"{{"model": "models/hexapod.urdf", "position_m": [0, 0, 0.33], "ground": "half-space",
            "contact_solver": "{law}", {STAND}}}"#
        );
        let mut fixture = Fixture::new(&parameters, 9.81, 1e-3);
        (0..300).for_each(|_| fixture.free_step());
        let feet: f64 =
            fixture.scene.bodies.iter().map(|b| fixture.get(&format!("{}.contact_normal", b.name))).sum();
        assert!((feet / (fixture.mass() * 9.81) - 1.0).abs() < 1e-3, "{feet}");
    }
}

#[test]
fn an_unknown_law_is_refused_with_the_known_ones() {
    let parameters = r#"{"model": "models/hexapod.urdf", "contact_solver": "lcp"}"#;
    let text = common::instantiate(parameters, 9.81).err().unwrap().to_string();
    assert!(text.contains("contact_solver") && text.contains("lcp-4"), "{text}");
}
