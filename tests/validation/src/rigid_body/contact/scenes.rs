//! Scenes of free boxes and spheres, written as URDF for one case each.

use crate::Context;
use crate::process::Outcome;
use crate::rigid_body::fixture::{Fixture, model};

/// A link with a diagonal inertia (kg m²) and one shape.
pub fn link(name: &str, mass: f64, inertia: [f64; 3], geometry: &str) -> String {
    let [x, y, z] = inertia;
    format!(
        r#"<link name="{name}"><inertial><mass value="{mass}"/>
        <inertia ixx="{x}" iyy="{y}" izz="{z}" ixy="0" ixz="0" iyz="0"/></inertial>
        <collision><geometry>{geometry}</geometry></collision></link>"#
    )
}

/// A homogeneous box.
pub fn cuboid(name: &str, mass: f64, size: [f64; 3]) -> String {
    let [x, y, z] = size;
    let i = |a: f64, b: f64| mass * (a * a + b * b) / 12.0;
    link(name, mass, [i(y, z), i(x, z), i(x, y)], &format!(r#"<box size="{x} {y} {z}"/>"#))
}

/// A homogeneous sphere.
pub fn sphere(name: &str, mass: f64, r: f64) -> String {
    link(name, mass, [0.4 * mass * r * r; 3], &format!(r#"<sphere radius="{r}"/>"#))
}

/// One free body whose frame starts at a place, on the plane z = 0.
pub fn alone(
    context: &Context,
    name: &str,
    body: &str,
    at: [f64; 3],
    more: &str,
    (gravity, h): ([f64; 3], f64),
) -> Outcome<Fixture> {
    let text = format!(r#"<robot name="{name}">{body}</robot>"#);
    let path = model(&context.scratch, &format!("{name}.urdf"), &text)?;
    let parameters = format!(
        r#"{{"model": "{path}", "position_m": {at:?}, "ground": "half-space", "motor": "off" {more}}}"#
    );
    Fixture::new(&parameters, gravity, h)
}

/// Several free bodies on the plane z = 0: they hang from a far root by joints that break at once. Their indices
/// start at 1.
pub fn several(
    context: &Context,
    name: &str,
    bodies: &[(String, [f64; 3])],
    more: &str,
    (gravity, h): ([f64; 3], f64),
) -> Outcome<Fixture> {
    let mut text = format!(r#"<robot name="{name}">{}"#, cuboid("root", 1.0, [0.1; 3]));
    for (k, (body, [x, y, z])) in bodies.iter().enumerate() {
        text += body;
        // The root lies 100 m away.
        let place = format!("{} {y} {}", x + 100.0, z - 0.05);
        text += &format!(
            r#"<joint name="j{k}" type="prismatic"><parent link="root"/><child link="b{k}"/>
            <origin xyz="{place}"/><axis xyz="0 0 1"/><limit lower="-9" upper="9" effort="1" velocity="1"/></joint>"#
        );
    }
    let path = model(&context.scratch, &format!("{name}.urdf"), &(text + "</robot>"))?;
    let parameters = format!(
        r#"{{"model": "{path}", "position_m": [-100, 0, 0.05], "ground": "half-space", "motor": "off" {more}}}"#
    );
    let mut fixture = Fixture::new(&parameters, gravity, h)?;
    (0..bodies.len()).try_for_each(|k| fixture.act(&format!("j{k}.break")))?;
    Ok(fixture)
}

/// Throws a body: an impulse (N s) at its centre of mass within the first step of length h, as if it had moved before.
pub fn throw(fixture: &mut Fixture, body: &str, impulse: [f64; 3], h: f64) -> Outcome {
    let ids = ["x", "y", "z"].map(|axis| fixture.id(&format!("{body}.force_{axis}")));
    let ids = ids.into_iter().collect::<Outcome<Vec<_>>>()?;
    fixture.set(&ids, &impulse.map(|p| p / h))?;
    fixture.step()?;
    fixture.set(&ids, &[0.0; 3])
}
