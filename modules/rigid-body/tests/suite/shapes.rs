//! Hulls, triangle meshes and height fields against closed forms and against the simple shapes that they equal.

use crate::common;
use common::{Fixture, temporary_urdf};
use std::fmt::Write;
use std::sync::Arc;
use terraglue_numerics::extremes::larger;
use terraglue_rigid_body::RigidBody;
use terraglue_subsystem::{BodyState, Config, Geometry, Module, Standalone, Terrain, TerrainTile};

const G: f64 = 9.81;
const BRICK: &str = r#"<mesh name="brick" vertex="-.1 -.15 -.2 .1 -.15 -.2 -.1 .15 -.2 .1 .15 -.2
    -.1 -.15 .2 .1 -.15 .2 -.1 .15 .2 .1 .15 .2 0 0 0"/>"#;

fn scene(name: &str, asset: &str, world: &str, more: &str) -> Fixture {
    let text = format!("<mujoco><asset>{asset}</asset><worldbody>{world}</worldbody></mujoco>");
    let model = temporary_urdf(&format!("shapes-{name}"), &text);
    Fixture::new(&format!(r#"{{"model": "{model}" {more}}}"#), G, 1e-3)
}

/// A square of triangles in the plane z = 0, its half length and number of cells along an edge.
fn sheet(half: f64, cells: usize) -> String {
    let at = |k: usize| half * (2.0 * k as f64 / cells as f64 - 1.0);
    let (mut vertices, mut faces) = (String::new(), String::new());
    for j in 0..=cells {
        for i in 0..=cells {
            write!(vertices, "{} {} 0 ", at(i), at(j)).unwrap();
            if i < cells && j < cells {
                let a = j * (cells + 1) + i;
                let (b, c, d) = (a + 1, a + cells + 1, a + cells + 2);
                write!(faces, "{a} {b} {d} {a} {d} {c} ").unwrap();
            }
        }
    }
    // A corner far below gives the mesh a hull, which a mesh that stands still does not use.
    format!(r#"<mesh name="sheet" vertex="{vertices} 0 0 -1" face="{faces}"/>"#)
}

fn farthest(a: &[BodyState], b: &[BodyState]) -> f64 {
    let apart = |(a, b): (&BodyState, &BodyState)| {
        let (p, q) = (a.world_from_body.position, b.world_from_body.position);
        (0..3).map(|k| (p[k] - q[k]).abs()).fold(0.0, larger)
    };
    a.iter().zip(b).map(apart).fold(0.0, larger)
}

#[test]
fn the_hull_of_a_box_tumbles_as_the_box() {
    let body = |geom: &str| {
        format!(
            r#"<geom type="plane" size="1 1 1"/>
            <body name="b" pos="0 0 0.4" euler="20 35 10"><freejoint/><geom {geom} mass="2"/></body>"#
        )
    };
    let mut simple = scene("box", "", &body(r#"type="box" size=".1 .15 .2""#), "");
    let mut hull = scene("brick", BRICK, &body(r#"type="mesh" mesh="brick""#), "");
    let Geometry::ConvexMesh { points, triangles } = &hull.scene.shapes[0].geometry else { panic!("a hull") };
    assert_eq!((points.len(), triangles.len()), (8, 12));
    for step in 0..1500 {
        simple.free_step();
        hull.free_step();
        let apart = farthest(&simple.states(), &hull.states());
        assert!(apart < 1e-7, "step {step}: {apart:e}");
    }
    assert!(hull.get("b.z") < 0.21 && hull.get("b.contact_normal") > 0.99 * 2.0 * G);
}

#[test]
fn hulls_rest_on_boxes_and_on_each_other_without_creeping() {
    // Without friction any error of the normal would make them slide.
    let mut fixture = scene(
        "stack",
        BRICK,
        r#"<geom type="box" size="1 1 .1" pos="0 0 -.1"/>
        <body name="a" pos="0 0 .2"><freejoint/><geom type="mesh" mesh="brick" mass="1"/></body>
        <body name="b" pos=".02 .01 .6" euler="0 0 30"><freejoint/><geom type="mesh" mesh="brick" mass="3"/></body>"#,
        r#", "friction": 0"#,
    );
    (0..1000).for_each(|_| fixture.free_step());
    for (body, z) in [("a", 0.2), ("b", 0.6)] {
        let p = fixture.states()[usize::from(body == "b")].world_from_body.position;
        println!("{body} {p:?}");
        assert!((p[2] - z).abs() < 1e-5, "{body} {p:?}");
        let x = if body == "b" { [0.02, 0.01] } else { [0.0; 2] };
        assert!((p[0] - x[0]).hypot(p[1] - x[1]) < 1e-6, "{body} {p:?}");
    }
    assert!((fixture.get("a.contact_normal") / (7.0 * G) - 1.0).abs() < 1e-3);
}

#[test]
fn a_mesh_of_a_plane_is_the_plane() {
    let bodies = r#"<body name="ball" pos="-.4 0.03 .1"><freejoint/><geom size=".1" mass="1"/></body>
        <body name="box" pos="0 .4 .1"><freejoint/><geom type="box" size=".15 .13 .1" mass="2"/></body>
        <body name="rod" pos="0 -.4 .05" euler="0 90 20"><freejoint/>
          <geom type="capsule" size=".05 .2" mass="1"/></body>"#;
    let world = |ground: &str| format!("{ground}{bodies}");
    let mut plane =
        scene("plane", "", &world(r#"<geom type="plane" size="1 1 1"/>"#), r#", "friction": 0.4"#);
    let mesh = world(r#"<geom type="mesh" mesh="sheet"/>"#);
    let mut mesh = scene("sheet", &sheet(1.0, 16), &mesh, r#", "friction": 0.4"#);
    for fixture in [&mut plane, &mut mesh] {
        fixture.push("ball", [900.0, 300.0, 0.0]);
        fixture.push("box", [1500.0, 0.0, 0.0]);
        fixture.free_step();
        ["ball", "box"].iter().for_each(|b| fixture.push(b, [0.0; 3]));
    }
    let mut worst = 0.0_f64;
    for _ in 0..600 {
        plane.free_step();
        mesh.free_step();
        worst = larger(worst, farthest(&plane.states(), &mesh.states()));
    }
    println!("apart by {worst:e}, box at {}", mesh.get("box.x"));
    assert!(worst < 1e-6, "{worst:e}");
    assert!(mesh.get("box.x") > 0.05 && mesh.get("ball.x") > -0.2);
}

#[test]
fn a_sphere_rolls_down_the_slope_of_a_height_field() {
    // Rises by 0.4 m over 2 m along x; the text starts with the row of the largest y.
    let rows = "0 1 2 3 4 5 6 7 8\n".repeat(5);
    let asset = format!(r#"<hfield name="f" nrow="5" ncol="9" size="1 .5 .4 1" elevation="{rows}"/>"#);
    let angle = 0.2_f64.atan();
    let height = |x: f64| 0.2 * (x + 1.0);
    let (x, z) = (0.6 - 0.1 * angle.sin(), height(0.6) + 0.1 * angle.cos());
    let world = format!(
        r#"<geom type="hfield" hfield="f"/>
        <body name="s" pos="{x} .07 {z}"><freejoint/><geom size=".1" mass="1"/></body>"#
    );
    let mut fixture = scene("hfield", &asset, &world, r#", "friction": 0.5"#);
    (0..800).for_each(|_| fixture.free_step());
    let state = fixture.states()[0];
    let (p, v) = (state.world_from_body.position, state.linear_velocity);
    let exact = 5.0 / 7.0 * G * angle.sin() * fixture.t;
    println!("{p:?} {v:?} {exact}");
    assert!((v[0].hypot(v[2]) / exact - 1.0).abs() < 1e-6, "{v:?} {exact}");
    // It stays on the slope.
    let above = (p[2] - height(p[0])) * angle.cos();
    assert!((above - 0.1).abs() < 1e-6 && (p[1] - 0.07).abs() < 1e-9, "{above} {p:?}");
}

#[test]
fn the_first_row_of_the_text_is_the_far_one() {
    let asset = r#"<hfield name="f" nrow="2" ncol="2" size="1 1 .5 1" elevation="1 1 0 0"/>"#;
    let world = r#"<geom type="hfield" hfield="f"/>
        <body name="s" pos="0 .8 .8"><freejoint/><geom size=".1" mass="1"/></body>"#;
    let mut fixture = scene("rows", asset, world, "");
    (0..300).for_each(|_| fixture.free_step());
    assert!(fixture.get("s.vy") < -0.1 && fixture.get("s.z") > 0.4, "{}", fixture.get("s.vy"));
}

#[test]
fn a_hull_lies_on_a_mesh_and_a_closed_mesh_keeps_what_is_above_it() {
    let mut fixture = scene(
        "hull-on-mesh",
        &(sheet(1.0, 40) + BRICK),
        r#"<geom type="mesh" mesh="sheet"/>
        <body name="b" pos=".013 .007 .1" euler="0 90 0"><freejoint/><geom type="mesh" mesh="brick" mass="2"/></body>"#,
        r#", "friction": 0"#,
    );
    (0..500).for_each(|_| fixture.free_step());
    let p = fixture.states()[0].world_from_body.position;
    println!("{p:?} {} points", fixture.get("contact.points"));
    assert!((p[2] - 0.1).abs() < 1e-5 && (p[0] - 0.013).hypot(p[1] - 0.007) < 1e-6, "{p:?}");
    assert!((fixture.get("b.contact_normal") / (2.0 * G) - 1.0).abs() < 1e-3);
    assert!(fixture.get("contact.points") <= 9.0);
}

/// A slope of 10 % along y.
struct Slope;

impl Terrain for Slope {
    fn origin(&self) -> [f64; 2] {
        [-1.0, -1.0]
    }
    fn spacing(&self) -> f64 {
        0.05
    }
    fn size(&self) -> [u32; 2] {
        [41, 61]
    }
    fn heights(&self, _: i64, j0: i64, ni: usize, nj: usize, out: &mut [f64]) -> TerrainTile {
        for j in 0..nj {
            let y = -1.0 + 0.05 * (j0 + j as i64).clamp(0, 60) as f64;
            out[j * ni..(j + 1) * ni].fill(0.1 * y);
        }
        TerrainTile::Varied
    }
}

#[test]
fn the_terrain_can_be_turned_to_stone() {
    let model = common::ball("stone");
    let instantiate = |terrain: Option<Box<dyn Terrain>>| {
        let parameters = format!(r#"{{"model": "{model}", "position_m": [0, 1.5, 0], "ground": "terrain"}}"#);
        let host = Standalone { gravity: [0.0, 0.0, -G], terrain, folder: common::root() };
        RigidBody::instantiate(&Config::parse(&parameters).unwrap(), Arc::new(host))
    };
    let robot = instantiate(Some(Box::new(Slope))).unwrap();
    let scene = robot.scene();
    let mut fixture =
        Fixture { robot, scene, t: 0.0, h: 1e-3, index: 0, reversed: false, margin: 1e-3, mu: 0.8 };
    (0..500).for_each(|_| fixture.free_step());
    let v = fixture.states()[0].linear_velocity;
    let exact = 5.0 / 7.0 * G * 0.1_f64.atan().sin() * fixture.t;
    println!("{v:?} {exact}");
    // It is placed over the nodes below it, a hair above the slope itself.
    assert!((-v[1] - exact * 0.1_f64.atan().cos()).abs() < 0.01 * exact, "{v:?} {exact}");
    let message = instantiate(None).err().unwrap().to_string();
    assert!(message.contains("`ground`") && message.contains("[terrain]"), "{message}");
}

#[test]
fn contacts_with_meshes_are_the_same_in_every_run_and_after_a_rewind() {
    let build = || {
        scene(
            "again",
            &(sheet(1.0, 12) + BRICK),
            r#"<geom type="mesh" mesh="sheet"/>
            <body name="a" pos="0 0 .35" euler="30 20 0"><freejoint/><geom type="mesh" mesh="brick" mass="1"/></body>
            <body name="b" pos=".05 0 .8"><freejoint/><geom type="mesh" mesh="brick" mass="1"/></body>"#,
            "",
        )
    };
    let (mut one, mut two) = (build(), build());
    (0..300).for_each(|_| one.free_step());
    (0..300).for_each(|_| two.free_step());
    assert_eq!(one.states(), two.states());
    one.robot.save_state(0).unwrap();
    (0..200).for_each(|_| one.free_step());
    let first = one.states();
    one.robot.restore_state(0).unwrap();
    (one.t, one.index) = (0.3, 300);
    (0..200).for_each(|_| one.free_step());
    assert_eq!(one.states(), first);
}

#[test]
fn what_stands_still_is_seen_and_does_not_count_as_a_body() {
    let wall = r#"<mesh name="wall" vertex="0 0 0 1 0 0 0 0 1 0 1 0" face="0 1 2 0 3 1"/>
        <hfield name="hill" nrow="2" ncol="200" size="2 1 0.5 0.1" elevation="HEIGHTS"/>"#;
    let heights = (0..400).map(|k| format!("{} ", k % 200)).collect::<String>();
    let world = r#"<geom type="mesh" mesh="wall" pos="3 0 0"/><geom type="hfield" hfield="hill"/>
        <geom type="box" size=".1 .2 .3" pos="0 5 0" contype="0" conaffinity="0"/>
        <body name="b" pos="0 0 4"><freejoint/><geom type="sphere" size="0.1" mass="2"/></body>"#;
    let mut fixture = scene("still", &wall.replace("HEIGHTS", &heights), world, "");
    let bodies: Vec<(&str, f64)> = fixture.scene.bodies.iter().map(|b| (b.name.as_str(), b.mass)).collect();
    assert_eq!(bodies, [("b", 2.0), ("world", 0.0)]);
    let seen: Vec<_> = fixture.scene.shapes.iter().filter(|s| s.body == 1).collect();
    assert!(seen.len() == 3 && seen.iter().all(|s| !s.collides), "{seen:?}");
    let Geometry::ConvexMesh { triangles, .. } = &seen[0].geometry else { panic!("the wall") };
    assert_eq!((triangles.len(), seen[0].body_from_shape.position), (2, [3.0, 0.0, 0.0]));
    let Geometry::ConvexMesh { points, triangles } = &seen[1].geometry else { panic!("the hill") };
    let (first, last) = (points[0], points[points.len() - 1]);
    assert_eq!((first, last), ([-2.0, -1.0, 0.0], [2.0, 1.0, 0.5]));
    assert_eq!((points.len(), triangles.len()), (2 * 101, 2 * 100));
    // all faces look up
    assert!(triangles.iter().all(|t| {
        let [a, b, c] = t.map(|k| points[k as usize]);
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) > 0.0
    }));
    fixture.free_step();
    assert_eq!(fixture.states()[1], BodyState::REST);
}
