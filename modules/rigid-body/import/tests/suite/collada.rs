//! COLLADA meshes of URDF: units, places of parts, kinds of faces, and refusals.

use std::path::{Path, PathBuf};
use terraglue_robot_import::{Mesh, Options, Robot, ShapeGeometry, read_robot};

/// Corners of a brick of 1 × 2 × 3 units, bits of the index as x, y, z.
const BRICK: &str = "0 0 0 1 0 0 0 2 0 1 2 0 0 0 3 1 0 3 0 2 3 1 2 3";
/// Its sides as quads, counter-clockwise seen from outside.
const SIDES: [[usize; 4]; 6] =
    [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];

fn triangles() -> String {
    let of = |[a, b, c, d]: [usize; 4]| format!("{a} 0 {b} 0 {c} 0 {a} 0 {c} 0 {d} 0 ");
    format!(
        "<triangles count=\"12\"><input semantic=\"VERTEX\" source=\"#v\" offset=\"0\"/>\
         <input semantic=\"NORMAL\" source=\"#n\" offset=\"1\"/><p>{}</p></triangles>",
        SIDES.map(of).concat()
    )
}

fn polylist() -> String {
    let of = |side: [usize; 4]| side.map(|k| format!("{k} ")).concat();
    format!(
        "<polylist count=\"6\"><input semantic=\"VERTEX\" source=\"#v\" offset=\"0\"/><vcount>4 4 4 4 4 4</vcount>\
         <p>{}</p></polylist>",
        SIDES.map(of).concat()
    )
}

fn each(kind: &str, order: [usize; 4]) -> String {
    let of = |side: [usize; 4]| format!("<p>{}</p>", order.map(|k| format!("{} ", side[k])).concat());
    let input = "<input semantic=\"VERTEX\" source=\"#v\" offset=\"0\"/>";
    format!("<{kind} count=\"6\">{input}{}</{kind}>", SIDES.map(of).concat())
}

/// A file with a geometry of these corners and faces, and a scene.
fn file(asset: &str, corners: &str, faces: &str, scene: &str) -> String {
    let count = corners.split_whitespace().count();
    format!(
        "<?xml version=\"1.0\"?>\n<COLLADA xmlns=\"http://www.collada.org/2005/11/COLLADASchema\" version=\"1.4.1\">\n\
         <asset>{asset}</asset>\n<library_geometries><geometry id=\"g\"><mesh>\n<source id=\"s\"><float_array id=\"a\" \
         count=\"{count}\">{corners}</float_array><technique_common><accessor source=\"#a\" count=\"{}\" stride=\"3\"/>\
         </technique_common></source>\n<vertices id=\"v\"><input semantic=\"POSITION\" source=\"#s\"/></vertices>\n{faces}\n\
         </mesh></geometry></library_geometries>\n{scene}\n</COLLADA>",
        count / 3
    )
}

fn scene(nodes: &str) -> String {
    format!(
        "<library_visual_scenes><visual_scene id=\"scene\">{nodes}</visual_scene></library_visual_scenes>\
         <scene><instance_visual_scene url=\"#scene\"/></scene>"
    )
}

const Z_UP: &str = "<unit name=\"meter\" meter=\"1\"/><up_axis>Z_UP</up_axis>";
const PLAIN: &str = "<node><instance_geometry url=\"#g\"/></node>";

/// A robot whose world (it stands still) or body (it moves) has the mesh, as a collision or a picture.
fn robot(name: &str, text: &str, still: bool, tag: &str) -> Result<Robot, String> {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("collada-{name}"));
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("part.dae"), text).unwrap();
    let shape = format!("<{tag}><geometry><mesh filename=\"part.dae\" scale=\"1 1 1\"/></geometry></{tag}>");
    let (world, body) = if still { (shape.as_str(), "") } else { ("", shape.as_str()) };
    let inertial = "<inertial><mass value=\"1\"/><inertia ixx=\"1\" iyy=\"1\" izz=\"1\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial>";
    let urdf = format!(
        "<robot name=\"r\">\n<link name=\"world\">{world}</link>\n<link name=\"a\">{inertial}{body}</link>\
         <joint name=\"j\" type=\"continuous\"><parent link=\"world\"/><child link=\"a\"/></joint></robot>"
    );
    let path: PathBuf = folder.join("r.urdf");
    std::fs::write(&path, urdf).unwrap();
    read_robot(&path, &Options::default()).map_err(|e| e.to_string())
}

fn still(name: &str, text: &str) -> Mesh {
    let robot = robot(name, text, true, "collision").unwrap();
    let ShapeGeometry::Triangles(mesh) = &robot.world_shapes[0].geometry else { panic!("triangles") };
    Mesh::clone(mesh)
}

/// Signed volume, m³, and smallest and largest corner, m.
fn measure(mesh: &Mesh) -> (f64, [f64; 3], [f64; 3]) {
    let corner = |k: &u32| nalgebra::Vector3::from(mesh.points[*k as usize]);
    let of = |[a, b, c]: &[u32; 3]| corner(a).dot(&corner(b).cross(&corner(c))) / 6.0;
    let end =
        |pick: fn(f64, f64) -> f64| [0, 1, 2].map(|k| mesh.points.iter().map(|p| p[k]).reduce(pick).unwrap());
    (mesh.triangles.iter().map(of).sum(), end(f64::min), end(f64::max))
}

fn near(a: [f64; 3], b: [f64; 3]) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12)
}

#[test]
fn every_kind_of_face_gives_the_same_closed_brick() {
    let kinds = [
        triangles(),
        polylist(),
        each("polygons", [0, 1, 2, 3]),
        each("trifans", [0, 1, 2, 3]),
        each("tristrips", [0, 1, 3, 2]),
    ];
    for (k, faces) in kinds.iter().enumerate() {
        let mesh = still(&format!("kind{k}"), &file(Z_UP, BRICK, faces, &scene(PLAIN)));
        let (volume, low, high) = measure(&mesh);
        assert_eq!((mesh.points.len(), mesh.triangles.len(), mesh.is_closed()), (8, 12, true), "{faces}");
        assert!(
            (volume - 6.0).abs() < 1e-12 && near(low, [0.0; 3]) && near(high, [1.0, 2.0, 3.0]),
            "{faces}"
        );
    }
    // Without a scene all geometries are in place.
    let (volume, ..) = measure(&still("bare", &file(Z_UP, BRICK, &triangles(), "")));
    assert!((volume - 6.0).abs() < 1e-12);
}

#[test]
fn units_and_transforms_of_nodes_count_and_a_part_may_stand_in_several_places() {
    let nodes = "<node><translate>10 0 0</translate><rotate>0 0 1 90</rotate><scale>1 1 2</scale>\
        <instance_geometry url=\"#g\"/><node><matrix>1 0 0 0  0 1 0 0  0 0 1 10  0 0 0 1</matrix>\
        <instance_geometry url=\"#g\"/></node></node><node><scale>-1 1 1</scale><instance_node url=\"#n\"/></node>";
    let library = "<library_nodes><node id=\"n\"><translate>20 0 0</translate><instance_geometry url=\"#g\"/></node></library_nodes>";
    let asset = "<unit name=\"centimeter\" meter=\"0.01\"/><up_axis>Z_UP</up_axis>";
    let mesh = still("places", &file(asset, BRICK, &triangles(), &(library.to_owned() + &scene(nodes))));
    let (volume, low, high) = measure(&mesh);
    // Twice stretched to 12 cm³, once mirrored and still inside out of nothing.
    assert_eq!((mesh.points.len(), mesh.triangles.len(), mesh.is_closed()), (24, 36, true));
    assert!((volume - 30e-6).abs() < 1e-15, "{volume}");
    assert!(near(low, [-0.21, 0.0, 0.0]) && near(high, [0.10, 0.02, 0.26]), "{low:?} {high:?}");
}

#[test]
fn a_polygon_with_a_hollow_corner_is_cut_along_its_outline() {
    // An arrow head of 1 m²: a fan from its first corner would cover 1.5 m².
    let corners = "0 0 0 2 1 0 0 2 0 1 1 0";
    let faces = "<polygons count=\"1\"><input semantic=\"VERTEX\" source=\"#v\" offset=\"0\"/><p>0 1 2 3</p></polygons>";
    let mesh = still("hollow", &file(Z_UP, corners, faces, &scene(PLAIN)));
    let corner = |k: u32| nalgebra::Vector3::from(mesh.points[k as usize]);
    let area =
        |[a, b, c]: &[u32; 3]| 0.5 * (corner(*b) - corner(*a)).cross(&(corner(*c) - corner(*a))).norm();
    assert!((mesh.triangles.iter().map(area).sum::<f64>() - 1.0).abs() < 1e-12);
}

#[test]
fn a_body_that_moves_gets_the_hull_and_other_axes_are_told_of_but_not_turned() {
    let text = |up: &str| file(&format!("<up_axis>{up}</up_axis>"), BRICK, &triangles(), &scene(PLAIN));
    for (up, told) in [("Z_UP", false), ("Y_UP", true)] {
        let robot = robot(up, &text(up), false, "collision").unwrap();
        let ShapeGeometry::Hull(hull) = &robot.bodies[0].shapes[0].geometry else { panic!("a hull") };
        assert!(near(measure(hull).2, [1.0, 2.0, 3.0]));
        let said = robot.notices.iter().any(|n| n.contains("part.dae") && n.contains("<up_axis> Y_UP"));
        assert_eq!(said, told, "{:?}", robot.notices);
    }
}

#[test]
fn what_cannot_be_read_is_refused_with_its_line_and_does_no_harm_to_a_picture() {
    let plain = |faces: &str, nodes: &str| file(Z_UP, BRICK, faces, &scene(nodes));
    let far = triangles().replacen("0 0", "9 0", 1);
    let cases = [
        ("<html/>".to_owned(), ["line 1: <html>", "<COLLADA>"]),
        ("<COLLADA><a></COLLADA>".to_owned(), ["part.dae", "1:13"]),
        (file("<unit meter=\"0\"/>", BRICK, &triangles(), &scene(PLAIN)), ["line 3: <unit>", "not a length"]),
        (plain(&far, PLAIN), ["line 7: <triangles>", "corner that is not there"]),
        (plain(&triangles().replacen("0 0", "x 0", 1), PLAIN), ["<p>", "`x` is not a number"]),
        (plain(&polylist().replacen("4 4", "4 9", 1), PLAIN), ["<polylist>", "<vcount>"]),
        (
            plain("<polygons><input semantic=\"VERTEX\" source=\"#v\"/><ph/></polygons>", PLAIN),
            ["<ph>", "holes"],
        ),
        (plain("<triangles/>", PLAIN), ["<triangles>", "VERTEX"]),
        (plain("", PLAIN), ["part.dae", "no triangles"]),
        (plain(&triangles(), ""), ["part.dae", "no triangles"]),
        (plain(&triangles(), "<node><instance_geometry url=\"#x\"/></node>"), ["line 9", "id `x`"]),
        (
            plain(&triangles(), "<node><instance_node url=\"a.dae#x\"/></node>"),
            ["<instance_node>", "other files"],
        ),
        (plain(&triangles(), "<node id=\"n\"><instance_node url=\"#n\"/></node>"), ["<node> `n`", "circle"]),
        (
            plain(&triangles(), "<node><instance_controller url=\"#c\"/></node>"),
            ["<instance_controller>", "skins"],
        ),
        (plain(&triangles(), "<node><skew>1</skew></node>"), ["<skew>", "<matrix>"]),
        (plain(&triangles(), "<node><matrix>1 0</matrix></node>"), ["<matrix>", "16 finite numbers"]),
    ];
    for (k, (text, expected)) in cases.iter().enumerate() {
        let message = robot(&format!("bad{k}"), text, true, "collision").expect_err(text);
        let all = ["r.urdf:2: link `world`", "the mesh `part.dae`"].iter().chain(expected);
        all.for_each(|e| assert!(message.contains(e), "`{e}` is not in: {message}"));
        let seen = robot(&format!("seen{k}"), text, true, "visual").expect("a picture does no harm");
        assert!(
            seen.notices
                .iter()
                .any(|n| n.contains("1 <visual> meshes are not shown") && n.contains(expected[1]))
        );
    }
}
