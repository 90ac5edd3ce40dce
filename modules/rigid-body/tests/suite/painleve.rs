//! Painlevé's rod: it slides on its lower end so that no finite force is possible. An impulse comes back, no NaN.

use crate::common;
use common::{Fixture, temporary_urdf};

/// A slender rod of 2 m and 1 kg, its lower end on the ground.
fn rod(name: &str, degrees: f64, friction: f64, v: f64) -> Fixture {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let ends = [1.0, -1.0].map(|e| {
        format!(
            r#"<collision><origin xyz="{} 0 {}"/><geometry><sphere radius="1e-6"/></geometry></collision>"#,
            e * cos,
            e * sin
        )
    });
    // m·l²/3·(1 − d·dᵀ), and a little about the rod itself.
    let (xx, yy, zz, xz) = (sin * sin / 3.0 + 1e-6, 1.0 / 3.0, cos * cos / 3.0 + 1e-6, -sin * cos / 3.0);
    let text = format!(
        r#"<robot name="r"><link name="rod"><inertial><mass value="1"/>
        <inertia ixx="{xx}" iyy="{yy}" izz="{zz}" ixy="0" ixz="{xz}" iyz="0"/></inertial>{}{}</link></robot>"#,
        ends[0], ends[1]
    );
    let model = temporary_urdf(name, &text);
    let parameters = format!(
        r#"{{"model": "{model}", "position_m": [0, 0, {}], "velocity_m_s": [{v}, 0, 0],
        "ground": "half-space", "friction": {friction}}}"#,
        sin + 1e-6
    );
    Fixture::new(&parameters, 9.81, 1e-3)
}

#[test]
fn a_jamming_rod_gets_a_finite_impulse() {
    for (k, (friction, degrees)) in [(1.5, 60.0), (2.0, 40.0), (2.0, 60.0), (2.0, 78.0)].iter().enumerate() {
        // Sliding against its lean it jams at once: p(θ) < 0.
        let mut fixture = rod(&format!("rod{k}"), *degrees, *friction, -1.0);
        fixture.free_step();
        let impulse = fixture.h * fixture.get("rod.contact_normal");
        let tip = fixture.states()[0].linear_velocity[0];
        println!("{friction} {degrees}: {impulse} {tip}");
        assert!(impulse > 0.1 && impulse < 2.0, "{friction} {degrees}: {impulse}");
        for _ in 0..1000 {
            fixture.free_step();
            assert!(fixture.states()[0].world_from_body.position.iter().all(|x| x.is_finite()));
        }
        // The other way it slides on with less than its weight would ask for.
        let mut fixture = rod(&format!("free{k}"), *degrees, *friction, 1.0);
        fixture.free_step();
        let impulse = fixture.h * fixture.get("rod.contact_normal");
        assert!(impulse < 0.02, "{friction} {degrees}: {impulse}");
    }
}
