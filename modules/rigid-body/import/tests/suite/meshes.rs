//! Mesh files of URDF: formats, scale, search paths, hulls of moving parts and triangles of fixed ones.

use std::path::{Path, PathBuf};
use terraglue_numerics::extremes::larger;
use terraglue_robot_import::{Mesh, Options, Robot, ShapeGeometry, read_robot};

/// A tetrahedron with its corner at the origin and edges of 1, 2 and 3 m along the axes.
const CORNERS: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 3.0]];
const FACES: [[usize; 3]; 4] = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];

fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("meshes-{name}"));
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

fn write(path: &Path, bytes: impl AsRef<[u8]>) {
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    std::fs::write(path, bytes).unwrap();
}

fn ascii_stl() -> String {
    let facet = |f: &[usize; 3]| {
        let vertices: String =
            f.iter().map(|k| CORNERS[*k]).map(|[x, y, z]| format!("vertex {x} {y} {z}\n")).collect();
        format!("facet normal 0 0 0\nouter loop\n{vertices}endloop\nendfacet\n")
    };
    format!("solid t\n{}endsolid t\n", FACES.iter().map(facet).collect::<String>())
}

fn binary_stl() -> Vec<u8> {
    let mut bytes = vec![0_u8; 80];
    bytes.extend(4_u32.to_le_bytes());
    for f in FACES {
        bytes.extend([0_u8; 12]);
        f.iter().flat_map(|k| CORNERS[*k]).for_each(|x| bytes.extend(x.to_le_bytes()));
        bytes.extend([0_u8; 2]);
    }
    bytes
}

fn obj() -> String {
    let corner = |[x, y, z]: [f32; 3]| format!("v {x} {y} {z}\n");
    let face = |[a, b, c]: [usize; 3]| format!("f {} {} {}\n", a + 1, b + 1, c + 1);
    CORNERS.map(corner).concat() + &FACES.map(face).concat()
}

/// A robot of one link with a mesh, in `folder`.
fn robot(folder: &Path, mesh: &str) -> PathBuf {
    let text = format!(
        "<robot name=\"r\"><link name=\"a\"><inertial><mass value=\"1\"/><inertia ixx=\"1\" iyy=\"1\" izz=\"1\" \
         ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial>\n<collision><origin xyz=\"1 0 0\"/><geometry><mesh {mesh}/>\
         </geometry></collision></link></robot>"
    );
    let path = folder.join("r.urdf");
    write(&path, text);
    path
}

fn hull(robot: &Robot) -> &Mesh {
    match &robot.bodies[0].shapes[0].geometry {
        ShapeGeometry::Hull(mesh) => mesh,
        other => panic!("no hull: {other:?}"),
    }
}

fn read(path: &Path) -> Result<Robot, String> {
    read_robot(path, &Options::default()).map_err(|e| e.to_string())
}

#[test]
fn every_format_gives_the_same_hull() {
    let folder = folder("formats");
    write(&folder.join("a.stl"), ascii_stl());
    write(&folder.join("b.STL"), binary_stl());
    write(&folder.join("c.obj"), obj());
    for file in ["a.stl", "b.STL", "c.obj"] {
        let robot = read(&robot(&folder, &format!("filename=\"{file}\" scale=\"0.1 0.1 0.2\""))).unwrap();
        let mesh = hull(&robot);
        assert_eq!((mesh.points.len(), mesh.triangles.len()), (4, 4), "{file}");
        let size = |k: usize| mesh.points.iter().map(|p| p[k]).fold(0.0, larger);
        for (k, exact) in [0.1, 0.2, 0.6].into_iter().enumerate() {
            assert!((size(k) - exact).abs() < 1e-7, "{file} {}", size(k));
        }
        assert_eq!(robot.bodies[0].shapes[0].body_from_shape.translation.x, 1.0);
        assert!(robot.warnings.is_empty(), "{:?}", robot.warnings);
        let notice = &robot.notices[0];
        for expected in ["r.urdf:1", "link `a`", file, "convex hull of 4 corners"] {
            assert!(notice.contains(expected), "`{expected}` is not in: {notice}");
        }
    }
}

#[test]
fn a_hollow_mesh_is_warned_of_and_stands_still_as_it_is() {
    // An L of two cubes: its hull has 3.5/3 of the volume.
    let outline = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];
    let corner = |z: f64| outline.map(|[x, y]| format!("v {x} {y} {z}\n")).concat();
    let wall = |k: usize| {
        let n = (k + 1) % 6;
        format!("f {} {} {}\nf {} {} {}\n", k + 1, n + 1, n + 7, k + 1, n + 7, k + 7)
    };
    let lids = "f 1 3 2\nf 1 4 3\nf 1 6 4\nf 4 6 5\nf 7 8 9\nf 7 9 10\nf 7 10 12\nf 10 11 12\n";
    let text = corner(0.0) + &corner(1.0) + &(0..6).map(wall).collect::<String>() + lids;
    let folder = folder("hollow");
    write(&folder.join("l.obj"), text);
    let path = robot(&folder, "filename=\"l.obj\"");
    let moving = read(&path).unwrap();
    assert!(moving.warnings[0].contains("1.17 times its own"), "{:?}", moving.warnings);
    assert!(moving.warnings[0].contains("soil meets its own 20 triangles"), "{:?}", moving.warnings);
    let ShapeGeometry::Concave { mesh, hull } = &moving.bodies[0].shapes[0].geometry else {
        panic!("its own form")
    };
    assert_eq!((mesh.triangles.len(), mesh.points.len(), hull.points.len()), (20, 12, 10));
    // The same link without mass is the world's.
    let text = std::fs::read_to_string(&path).unwrap();
    let (head, tail) = (text.find("<inertial>").unwrap(), text.find("</inertial>").unwrap() + 11);
    let still = text[..head].to_owned() + &text[tail..];
    let child = "<link name=\"b\"><inertial><mass value=\"1\"/><inertia ixx=\"1\" iyy=\"1\" izz=\"1\" ixy=\"0\" \
        ixz=\"0\" iyz=\"0\"/></inertial></link><joint name=\"j\" type=\"continuous\"><parent link=\"world\"/>\
        <child link=\"b\"/></joint></robot>";
    write(&path, still.replace("name=\"a\"", "name=\"world\"").replace("</robot>", child));
    let robot = read(&path).unwrap();
    let ShapeGeometry::Triangles(mesh) = &robot.world_shapes[0].geometry else { panic!("triangles") };
    assert_eq!((mesh.triangles.len(), mesh.is_closed(), robot.bodies.len()), (20, true, 1));
    assert!(robot.warnings.is_empty(), "{:?}", robot.warnings);
}

#[test]
fn packages_are_found_by_scenario_folder_and_environment() {
    let root = folder("packages");
    let workspace = root.join("src");
    write(&workspace.join("arm_description/package.xml"), "<package><name>arm</name></package>");
    write(&workspace.join("hands/package.xml"), "<package><name>hands</name></package>");
    write(&workspace.join("arm_description/meshes/a.stl"), ascii_stl());
    write(&workspace.join("hands/a.stl"), ascii_stl());
    write(&root.join("elsewhere/a.stl"), ascii_stl());
    write(&root.join("ros/tools/a.stl"), ascii_stl());
    let urdf = |file: &str| robot(&workspace.join("arm_description/urdf"), &format!("filename=\"{file}\""));
    // Above the file by the name in package.xml and by that of the folder; next to it; by a plain path.
    for file in [
        "package://arm/meshes/a.stl",
        "package://arm_description/meshes/a.stl",
        "package://hands/a.stl",
        "../meshes/a.stl",
    ] {
        assert!(read(&urdf(file)).is_ok(), "{file}");
    }
    let whole = format!("file://{}", root.join("elsewhere/a.stl").display());
    assert!(read(&urdf(&whole)).is_ok());
    let options = Options {
        packages: vec![("away".into(), root.join("elsewhere"))],
        package_path: vec![root.join("ros")],
        ..Options::default()
    };
    assert!(read_robot(&urdf("package://away/a.stl"), &options).is_ok());
    assert!(read_robot(&urdf("package://tools/a.stl"), &options).is_ok());
    let message = read_robot(&urdf("package://nowhere/a.stl"), &options).unwrap_err().to_string();
    let tried = root.join("ros/nowhere/a.stl").display().to_string();
    for expected in ["link `a`", "package://nowhere/a.stl", "tried: ", &tried, "packages = { nowhere = "] {
        assert!(message.contains(expected), "`{expected}` is not in: {message}");
    }
}

#[test]
fn meshes_that_cannot_be_used_are_refused() {
    let folder = folder("bad");
    write(&folder.join("good.stl"), ascii_stl());
    write(&folder.join("flat.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 2 4 3\n");
    write(&folder.join("empty.stl"), "solid x\nendsolid x\n");
    write(&folder.join("far.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n");
    write(&folder.join("cut.stl"), &binary_stl()[..150]);
    write(&folder.join("wheel.ply"), "ply");
    let refused = |mesh: &str, expected: &[&str]| {
        let message = read(&robot(&folder, mesh)).expect_err(mesh);
        assert!(message.contains("r.urdf:1: link `a`"), "{message}");
        expected.iter().for_each(|e| assert!(message.contains(e), "`{e}` is not in: {message}"));
    };
    refused("filename=\"no.stl\"", &["`no.stl`", "tried: ", "relative to the robot file"]);
    refused("filename=\"http://x/a.stl\"", &["http://", "package://"]);
    refused("filename=\"good.stl\" scale=\"1 0 1\"", &["scale"]);
    refused("filename=\"flat.obj\"", &["plane", "volume"]);
    refused("filename=\"empty.stl\"", &["no triangles"]);
    refused("filename=\"far.obj\"", &["far.obj"]);
    refused("filename=\"cut.stl\"", &["cut.stl"]);
    refused("filename=\"wheel.ply\"", &[".ply", "STL, OBJ or COLLADA"]);
}

#[test]
fn a_picture_that_is_missing_is_a_notice() {
    let folder = folder("picture");
    let path = robot(&folder, "filename=\"no.stl\"");
    let text = std::fs::read_to_string(&path).unwrap().replace("collision", "visual");
    write(&path, text);
    let robot = read(&path).unwrap();
    assert!(robot.bodies[0].shapes.is_empty());
    assert!(robot.notices[0].contains("1 <visual> meshes") && robot.notices[0].contains("no.stl"));
}
