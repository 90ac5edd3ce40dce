//! Hulls, triangle meshes and height fields against the simple shapes that they equal.

use crate::process::Outcome;
use crate::rigid_body::fixture::{Fixture, G, model, pose};
use crate::{Context, Figure, Limit};
use std::fmt::Write;
use terraglue_numerics::extremes::larger;

const H: f64 = 1e-3;
const BRICK: &str = r#"<mesh name="brick" vertex="-.1 -.1 -.05 .1 -.1 -.05 -.1 .1 -.05 .1 .1 -.05
    -.1 -.1 .05 .1 -.1 .05 -.1 .1 .05 .1 .1 .05"/>"#;
const PLANE: &str = r#"<geom type="plane" size="1 1 1"/>"#;

/// All of them.
pub fn figures(context: &Context) -> Outcome<Vec<Figure>> {
    Ok(vec![hull(context)?, mesh(context)?, field(context)?])
}

fn scene(context: &Context, name: &str, asset: &str, world: &str, gravity: [f64; 3]) -> Outcome<Fixture> {
    let text = format!("<mujoco><asset>{asset}</asset><worldbody>{world}</worldbody></mujoco>");
    let path = model(&context.scratch, &format!("{name}.xml"), &text)?;
    Fixture::new(&format!(r#"{{"model": "{path}", "friction": 0.5}}"#), gravity, H)
}

/// Largest distance of the first bodies of two scenes over a run, m.
fn apart(mut rigs: [Fixture; 2], until: f64) -> Outcome<f64> {
    let mut worst = 0.0_f64;
    while rigs[0].t() < until - 0.5 * H {
        let mut places = [nalgebra::Vector3::zeros(); 2];
        for (fixture, place) in rigs.iter_mut().zip(&mut places) {
            fixture.step()?;
            *place = pose(&fixture.states()?[0]).0;
        }
        worst = larger(worst, (places[0] - places[1]).norm());
    }
    Ok(worst)
}

fn hull(context: &Context) -> Outcome<Figure> {
    let angle = 35.0_f64.to_radians();
    let gravity = [G * libm::sin(angle), 0.0, -G * libm::cos(angle)];
    let body = |geom: &str| {
        format!(r#"{PLANE}<body name="b" pos="0 0 0.05"><freejoint/><geom {geom} mass="1"/></body>"#)
    };
    let rigs = [
        scene(context, "box", "", &body(r#"type="box" size=".1 .1 .05""#), gravity)?,
        scene(context, "brick", BRICK, &body(r#"type="mesh" mesh="brick""#), gravity)?,
    ];
    let what = "hull of a box on 35° with μ = 0.5, 2 s (3 m): distance from the box, m";
    Ok(Figure::new("rigid-body.shapes.hull", apart(rigs, 2.0)?, Limit::AtMost(1e-9), what))
}

/// A square of triangles in the plane z = 0.
fn sheet(half: f64, cells: usize) -> String {
    let at = |k: usize| half * (2.0 * k as f64 / cells as f64 - 1.0);
    let (mut vertices, mut faces) = (String::new(), String::new());
    for j in 0..=cells {
        for i in 0..=cells {
            let _ = write!(vertices, "{} {} 0 ", at(i), at(j));
            if i < cells && j < cells {
                let a = j * (cells + 1) + i;
                let (b, c, d) = (a + 1, a + cells + 1, a + cells + 2);
                let _ = write!(faces, "{a} {b} {d} {a} {d} {c} ");
            }
        }
    }
    // A corner far below gives the mesh a hull, which a mesh that stands still does not use.
    format!(r#"<mesh name="sheet" vertex="{vertices} 0 0 -1" face="{faces}"/>"#)
}

/// Thrown along x and y, it slides, then rolls over the edges of triangles.
fn mesh(context: &Context) -> Outcome<Figure> {
    let ball = r#"<body name="s" pos="-0.9 -0.2 0.1"><freejoint/><geom size="0.1" mass="1"/></body>"#;
    let gravity = [0.0, 0.0, -G];
    let mut rigs = [
        scene(context, "plane", "", &format!("{PLANE}{ball}"), gravity)?,
        scene(
            context,
            "sheet",
            &sheet(2.0, 32),
            &format!(r#"<geom type="mesh" mesh="sheet"/>{ball}"#),
            gravity,
        )?,
    ];
    for fixture in &mut rigs {
        super::scenes::throw(fixture, "s", [1.5, 0.4, 0.0], H)?;
    }
    let what = "sphere thrown over a plane of triangles, 1 s (1 m): distance from that on the half-space, m";
    Ok(Figure::new("rigid-body.shapes.mesh", apart(rigs, 1.0)?, Limit::AtMost(1e-9), what))
}

/// A slope of 1 : 5.
fn field(context: &Context) -> Outcome<Figure> {
    let rows = "0 1 2 3 4 5 6 7 8\n".repeat(5);
    let asset = format!(r#"<hfield name="f" nrow="5" ncol="9" size="1 .5 .4 1" elevation="{rows}"/>"#);
    let angle = libm::atan(0.2);
    let (sin, cos) = (libm::sin(angle), libm::cos(angle));
    let (x, z) = (0.6 - 0.1 * sin, 0.2 * 1.6 + 0.1 * cos);
    let world = format!(
        r#"<geom type="hfield" hfield="f"/>
        <body name="s" pos="{x} .07 {z}"><freejoint/><geom size=".1" mass="1"/></body>"#
    );
    let mut fixture = scene(context, "field", &asset, &world, [0.0, 0.0, -G])?;
    fixture.run(0.8, |_| Ok(()))?;
    let v = fixture.states()?[0].linear_velocity;
    let exact = 5.0 / 7.0 * G * sin * fixture.t();
    let error = (v[0].hypot(v[2]) / exact - 1.0).abs();
    let what = "sphere rolling down a height field, 0.8 s: relative error of its speed";
    Ok(Figure::new("rigid-body.shapes.field", error, Limit::AtMost(1e-6), what))
}
