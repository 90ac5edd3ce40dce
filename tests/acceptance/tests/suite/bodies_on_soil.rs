//! What must not matter to a body on soil: how its collision shape is written, whether the terrain falls or gravity is tilted, which of
//! two bodies in one cell comes first.

use std::f64::consts::{PI, TAU};
use std::fmt::Write;
use std::path::Path;
use terraglue::Testbed;
use terraglue::scenario::Scenario;
use terraglue_acceptance::{ROOT, build, read, steps};

const RADIUS: f64 = 0.05;
const MASS: f64 = 3.0;

/// A sphere of triangles, as OBJ.
fn mesh(folder: &Path) -> String {
    let (rings, sides) = (24, 48);
    let mut text = String::new();
    for i in 0..=rings {
        for j in 0..sides {
            let (theta, phi) = (PI * f64::from(i) / f64::from(rings), TAU * f64::from(j) / f64::from(sides));
            let (x, y, z) = (theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
            writeln!(text, "v {} {} {}", RADIUS * x, RADIUS * y, RADIUS * z).expect("text");
        }
    }
    let corner = |i: i32, j: i32| i * sides + j.rem_euclid(sides) + 1;
    for (i, j) in (0..rings).flat_map(|i| (0..sides).map(move |j| (i, j))) {
        let (a, b, c, d) = (corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1));
        writeln!(text, "f {a} {b} {c}\nf {a} {c} {d}").expect("text");
    }
    std::fs::write(folder.join("ball.obj"), text).expect("a mesh");
    "<mesh filename=\"ball.obj\"/>".into()
}

/// A testbed of 1 ms with the `robot` of a model on LETE sand; `terrain`: its keys.
fn testbed(place: &Path, urdf: &str, terrain: &str, soil: &str, strategy: &str, robot: &str) -> Testbed {
    std::fs::write(place.join("robot.urdf"), urdf).expect("a model");
    let text = format!(
        r#"
[time]
step_s = 0.001
duration_s = 1.0
[world]
gravity_m_s2 = [0.0, 0.0, -9.81]
[terrain]
{terrain}
[gluing]
strategy = "{strategy}"
[soil]
parameters = "LETE_sand"
parameters_file = "{ROOT}/models/soils.csv"
density_kg_m3 = 1600.0
{soil}
[robot]
module = "rigid-body"
model = "robot.urdf"
{robot}
"#
    );
    let path = place.join("robot.toml").display().to_string();
    let scenario = Scenario::parse(&text, &path, &[]).unwrap_or_else(|e| panic!("{e}: {:?}", e.help));
    build(&scenario).unwrap_or_else(|e| panic!("{e}"))
}

/// A link of one moment of inertia about all axes.
fn link(name: &str, mass: f64, inertia: f64, collisions: &str) -> String {
    format!(
        "<link name=\"{name}\"><inertial><mass value=\"{mass}\"/><inertia ixx=\"{inertia}\" ixy=\"0\" ixz=\"0\" iyy=\"{inertia}\" \
         iyz=\"0\" izz=\"{inertia}\"/></inertial>{collisions}</link>"
    )
}

fn collision(geometry: &str, xyz: [f64; 3], rpy: [f64; 3]) -> String {
    let text = |v: [f64; 3]| v.map(|c| c.to_string()).join(" ");
    let (xyz, rpy) = (text(xyz), text(rpy));
    format!("<collision><origin xyz=\"{xyz}\" rpy=\"{rpy}\"/><geometry>{geometry}</geometry></collision>")
}

/// A free ball that rolls at 0.5 m/s, set down on the ground.
fn ball(shape: &str, soil: &str, strategy: &str) -> Testbed {
    let place = tempfile::tempdir().expect("folder");
    let geometry = match shape {
        "sphere" => format!("<sphere radius=\"{RADIUS}\"/>"),
        "capsule" => format!("<capsule radius=\"{RADIUS}\" length=\"1e-9\"/>"),
        _ => mesh(place.path()),
    };
    let body = link("b", MASS, 0.4 * MASS * RADIUS * RADIUS, &collision(&geometry, [0.0; 3], [0.0; 3]));
    testbed(
        place.path(),
        &format!("<robot name=\"r\">{body}</robot>"),
        "kind = \"flat\"\nsize_m = [2.0, 0.6]\nspacing_m = 0.01",
        &format!("module = \"{soil}\""),
        strategy,
        "position_m = [-0.7, 0.0021, 0.05]\nvelocity_m_s = [0.5, 0.0, 0.0]\nrotation_rate_rad_s = [0.0, 10.0, 0.0]",
    )
}

/// Kinetic energy (J) and way (m) after half a second.
fn rolled(shape: &str, soil: &str, strategy: &str) -> [f64; 2] {
    let mut testbed = ball(shape, soil, strategy);
    steps(&mut testbed, 500);
    [testbed.energy().kinetic, read(&testbed, "robot.b.x") + 0.7]
}

#[test]
fn a_ball_is_braked_by_its_rut_as_a_capsule_and_a_mesh_of_it_are() {
    let start = 0.7 * MASS * 0.5 * 0.5;
    for (soil, strategy) in [
        ("soil-bekker", "cooperative"),
        ("soil-bekker", "iterative"),
        ("soil-cellular-automaton", "cooperative"),
    ] {
        let [energy, way] = rolled("sphere", soil, strategy);
        assert!(energy < 0.7 * start, "{soil}, {strategy}: {energy} of {start} J are left");
        for shape in ["capsule", "mesh"] {
            let [own, own_way] = rolled(shape, soil, strategy);
            println!("{soil} {strategy} {shape}: {energy} {own} J, {way} {own_way} m");
            assert!((own - energy).abs() < 0.03 * start, "{soil}, {strategy}, {shape}: {own} and {energy} J");
            assert!((own_way - way).abs() < 0.03 * way, "{soil}, {strategy}, {shape}: {own_way} and {way} m");
        }
    }
}

/// A smooth sled goes down a slope as fast as without soil, but for the soil that its front edge meets anew (it sinks by 0.1 mm); a heading
/// across the lattice changes nothing. (The side that leans over its front edge held it back once a cell: 0.20 m instead of 0.32 m.)
#[test]
fn a_smooth_sled_is_not_held_back_by_the_edge_of_its_sole() {
    let (angle, smooth) = (24f64.to_radians(), "interface_phi_rad = 0.0\ninterface_c_pa = 0.0");
    let free = 0.5 * 9.81 * angle.sin() * 0.4 * 0.4;
    for (soil, heading) in [("soil-bekker", 0.0), ("soil-bekker", 0.5), ("soil-cellular-automaton", 0.0)] {
        let place = tempfile::tempdir().expect("folder");
        let shape = "<cylinder radius=\"0.06\" length=\"0.04\"/>";
        let sled = link("b", 4.0, 0.003, &collision(shape, [0.0; 3], [0.0, -angle, heading]));
        let (above, terrain) = (0.02, format!("angle_rad = {angle}\nheading_rad = {heading}"));
        let [x, y, z] = [-angle.sin() * heading.cos(), -angle.sin() * heading.sin(), angle.cos()];
        let mut testbed = testbed(
            place.path(),
            &format!("<robot name=\"r\">{sled}</robot>"),
            &format!("kind = \"slope\"\nsize_m = [1.2, 1.2]\nspacing_m = 0.01\n{terrain}"),
            &format!("module = \"{soil}\"\n{smooth}"),
            "cooperative",
            &format!("position_m = [{}, {}, {}]\nplace_on_ground = false", above * x, above * y, above * z),
        );
        steps(&mut testbed, 400);
        let at = ["x", "y", "z"].map(|c| read(&testbed, &format!("robot.b.{c}")));
        let way = ((at[0] - above * x).hypot(at[1] - above * y)).hypot(at[2] - above * z);
        println!("{soil}, heading {heading}: {way} of {free} m");
        assert!((0.92 * free..1.005 * free).contains(&way), "{soil}, {heading}: {way} of {free} m");
    }
}

/// Two plates that meet within a row of cells bear what one plate of both bears, whichever body comes first. (The cells counted for one
/// body alone: 12 % less.)
#[test]
fn two_plates_that_share_cells_bear_as_one() {
    let half = |y: f64| collision("<box size=\"0.12 0.04 0.06\"/>", [0.0, y, 0.0], [0.0; 3]);
    let joint = |name: &str, kind: &str, parent: &str, child: &str| {
        format!(
            "<joint name=\"{name}\" type=\"{kind}\"><parent link=\"{parent}\"/><child link=\"{child}\"/><axis xyz=\"0 0 -1\"/>\
             <limit lower=\"-1\" upper=\"1\" effort=\"1e6\" velocity=\"10\"/></joint>"
        )
    };
    let press = |first: &str, second: Option<&str>, soil: &str, y: f64| {
        let place = tempfile::tempdir().expect("folder");
        let welded = second
            .map_or(String::new(), |second| link("c", 1.0, 0.01, second) + &joint("weld", "fixed", "b", "c"));
        let body = link("b", 2.0 - f64::from(second.is_some()), 0.01, first);
        let press = joint("press", "prismatic", "frame", "b");
        let mut testbed = testbed(
            place.path(),
            &format!("<robot name=\"r\"><link name=\"frame\"/>{press}{body}{welded}</robot>"),
            "kind = \"flat\"\nsize_m = [0.6, 0.6]\nspacing_m = 0.01",
            &format!("module = \"{soil}\"\nk_c = 0.0"),
            "cooperative",
            &format!(
                "position_m = [0.0033, {y}, 0.0301]\nfixed_base = true\nmotor = \"velocity\"\nmax_torque = 1e6\n\
                 velocity_target = {{ press = 0.02 }}"
            ),
        );
        steps(&mut testbed, 500);
        read(&testbed, "robot.press.torque")
    };
    for soil in ["soil-bekker", "soil-cellular-automaton"] {
        for y in [0.0, 0.0021, 0.0049] {
            let one = press(&(half(-0.02) + &half(0.02)), None, soil, y);
            for [first, second] in [[-0.02, 0.02], [0.02, -0.02]] {
                let two = press(&half(first), Some(&half(second)), soil, y);
                println!("{soil}, {y} m: {two} and {one} N");
                assert!((two / one - 1.0).abs() < 1e-9, "{soil}, {y} m: {two} and {one} N");
            }
        }
    }
}

const RIM: f64 = 0.044;
const LUGS: i32 = 20;

/// A wheel whose axle is y.
fn smooth_wheel(radius: f64) -> String {
    collision(&format!("<cylinder radius=\"{radius}\" length=\"0.1\"/>"), [0.0; 3], [PI / 2.0, 0.0, 0.0])
}

/// The same with plates on its rim, as a cylinder and boxes.
fn wheel_with_plates() -> String {
    let mut all = smooth_wheel(RIM);
    let (middle, height) = (0.5 * (RADIUS + RIM - 0.002), RADIUS - RIM + 0.002);
    for k in 0..LUGS {
        let angle = TAU * f64::from(k) / f64::from(LUGS);
        let plate = format!("<box size=\"0.002 0.1 {height}\"/>");
        all += &collision(&plate, [middle * angle.sin(), 0.0, middle * angle.cos()], [0.0, angle, 0.0]);
    }
    all
}

/// The same as a mesh whose lugs are 6 mm thick, as OBJ.
fn wheel_with_lugs(folder: &Path) -> String {
    let (facets, half) = (8, 0.003 / RADIUS);
    let mut outline = Vec::new();
    for k in 0..LUGS {
        let angle = TAU * f64::from(k) / f64::from(LUGS);
        outline.extend([
            (angle - half, RIM),
            (angle - half, RADIUS),
            (angle + half, RADIUS),
            (angle + half, RIM),
        ]);
        let gap = TAU / f64::from(LUGS) - 2.0 * half;
        outline.extend((1..facets).map(|n| (angle + half + gap * f64::from(n) / f64::from(facets), RIM)));
    }
    let mut text = String::new();
    for y in [-0.05, 0.05] {
        for (angle, radius) in &outline {
            writeln!(text, "v {} {y} {}", radius * angle.sin(), radius * angle.cos()).expect("text");
        }
    }
    text += "v 0 -0.05 0\nv 0 0.05 0\n";
    let count = outline.len();
    for k in 0..count {
        let (a, b) = (k + 1, (k + 1) % count + 1);
        let (c, d) = (a + count, b + count);
        writeln!(
            text,
            "f {a} {b} {c}\nf {b} {d} {c}\nf {} {b} {a}\nf {} {c} {d}",
            2 * count + 1,
            2 * count + 2
        )
        .expect("text");
    }
    std::fs::write(folder.join("lugs.obj"), text).expect("a mesh");
    collision("<mesh filename=\"lugs.obj\"/>", [0.0; 3], [0.0; 3])
}

/// Kinetic energy (J) and way (m) of a free wheel that has rolled for 0.4 s in the direction `yaw` (rad).
fn wheel_rolled(shape: &str, soil: &str, strategy: &str, yaw: f64) -> [f64; 2] {
    let place = tempfile::tempdir().expect("folder");
    let shapes = match shape {
        "plates" => wheel_with_plates(),
        "lugs" => wheel_with_lugs(place.path()),
        _ => smooth_wheel(RADIUS),
    };
    let body = link("b", MASS, 0.4 * MASS * RADIUS * RADIUS, &shapes);
    let (sin, cos) = yaw.sin_cos();
    let start = format!(
        "position_m = [-0.3, 0.0021, 0.05]\nheading_rad = {yaw:?}\nvelocity_m_s = [{}, {}, 0.0]\n\
         rotation_rate_rad_s = [{}, {}, 0.0]",
        0.5 * cos,
        0.5 * sin,
        -10.0 * sin,
        10.0 * cos,
    );
    let terrain = "kind = \"flat\"\nsize_m = [1.4, 1.4]\nspacing_m = 0.005";
    let urdf = format!("<robot name=\"r\">{body}</robot>");
    let mut testbed =
        testbed(place.path(), &urdf, terrain, &format!("module = \"{soil}\""), strategy, &start);
    steps(&mut testbed, 400);
    let way = (read(&testbed, "robot.b.x") + 0.3).hypot(read(&testbed, "robot.b.y") - 0.0021);
    [testbed.energy().kinetic, way]
}

/// Plates and lugs began the shear of a node anew whenever one came over it. A mesh whose lugs are as wide as a cell rolls over some of them before
/// two are seen at a time.
#[test]
fn a_wheel_with_grousers_rolls_as_the_cylinder_of_their_tips() {
    let start = 0.7 * MASS * 0.5 * 0.5;
    for (soil, strategy, yaw, shape, part) in [
        ("soil-bekker", "iterative", 0.6, "plates", 0.02),
        ("soil-cellular-automaton", "cooperative", 0.0, "plates", 0.02),
        ("soil-bekker", "cooperative", 0.0, "lugs", 0.1),
    ] {
        let [energy, way] = wheel_rolled("cylinder", soil, strategy, yaw);
        let [own, own_way] = wheel_rolled(shape, soil, strategy, yaw);
        println!("{soil} {strategy} {yaw} {shape}: {energy} {own} J, {way} {own_way} m");
        assert!((own - energy).abs() < part * start, "{soil}, {strategy}, {shape}: {own} and {energy} J");
        assert!((own_way - way).abs() < part * way, "{soil}, {strategy}, {shape}: {own_way} and {way} m");
    }
}
