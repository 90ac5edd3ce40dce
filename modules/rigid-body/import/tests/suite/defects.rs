//! Defects of public robots that a simulation can live with: one minimal robot per defect. Each loads with a warning
//! that names the place, the defect and the value used instead.

use nalgebra::Matrix3;
use std::path::PathBuf;
use terraglue_robot_import::{Base, Options, Robot, ShapeGeometry, read_robot, read_urdf_text};

const ROUND: [f64; 6] = [0.02, 0.0, 0.0, 0.02, 0.0, 0.02];

/// `tensor`: ixx, ixy, ixz, iyy, iyz, izz.
fn link(name: &str, mass: f64, tensor: [f64; 6], shape: &str) -> String {
    let [xx, xy, xz, yy, yz, zz] = tensor;
    format!(
        "<link name=\"{name}\"><inertial><origin xyz=\"0.1 0 0\"/><mass value=\"{mass}\"/><inertia ixx=\"{xx}\" ixy=\"{xy}\" \
         ixz=\"{xz}\" iyy=\"{yy}\" iyz=\"{yz}\" izz=\"{zz}\"/></inertial>{shape}</link>\n"
    )
}

fn joint(name: &str, kind: &str, parent: &str, child: &str, more: &str) -> String {
    format!(
        "<joint name=\"{name}\" type=\"{kind}\"><origin xyz=\"0 0 0.2\"/><parent link=\"{parent}\"/>\
         <child link=\"{child}\"/><axis xyz=\"0 1 0\"/>{more}</joint>\n"
    )
}

fn robot(parts: &[String]) -> String {
    format!("<robot name=\"r\">\n{}</robot>", parts.concat())
}

fn read(parts: &[String]) -> Robot {
    read_urdf_text("r.urdf", &robot(parts), &Options::default()).unwrap()
}

fn one_warning(robot: &Robot, expected: &[&str]) {
    assert_eq!(robot.warnings.len(), 1, "{:#?}", robot.warnings);
    expected
        .iter()
        .for_each(|e| assert!(robot.warnings[0].contains(e), "`{e}` is not in: {}", robot.warnings[0]));
}

/// About the centre of mass in the axes of the file's root, which every frame here is parallel to.
fn near(found: &Matrix3<f64>, expected: &Matrix3<f64>) {
    assert!((found - expected).norm() < 1e-12, "{found} is not {expected}");
}

/// A base of 1e-6 kg with a singular inertia, fixed to the trunk: go1, hyq.
#[test]
fn a_dummy_base_becomes_part_of_the_trunk() {
    let robot = read(&[
        link("base", 1e-6, [1e-6; 6], ""),
        link("trunk", 5.0, ROUND, ""),
        link("leg", 1.0, ROUND, ""),
        joint("floating", "fixed", "base", "trunk", ""),
        joint("hip", "continuous", "trunk", "leg", ""),
    ]);
    assert_eq!(robot.bodies.iter().map(|b| b.name.as_str()).collect::<Vec<_>>(), ["trunk", "leg"]);
    assert!(matches!(robot.base, Base::Free(at) if at.translation.vector.z == 0.2));
    let trunk = &robot.bodies[0];
    assert!((trunk.mass - 5.000001).abs() < 1e-15);
    // Steiner: the base hangs 0.2 m below the trunk's centre.
    let reduced = 5.0 * 1e-6 / 5.000001;
    let arm = nalgebra::Vector3::new(0.0, 0.0, -0.2);
    let apart = Matrix3::from_diagonal_element(arm.norm_squared()) - arm * arm.transpose();
    near(
        &trunk.inertia,
        &(Matrix3::from_diagonal_element(0.02) + Matrix3::from_element(1e-6) + reduced * apart),
    );
    one_warning(&robot, &["r.urdf:2: link `base`", "not positive", "fixed to `trunk`", "5.000001 kg"]);
}

/// The same below the trunk, without mass in the wrong place: a sensor that weighs and has no inertia (hyq's `trunk_imu`).
#[test]
fn a_sensor_without_inertia_becomes_part_of_the_trunk() {
    let robot = read(&[
        link("trunk", 5.0, ROUND, ""),
        link("imu", 0.018, [0.0; 6], ""),
        joint("mount", "fixed", "trunk", "imu", ""),
    ]);
    assert_eq!(robot.bodies.len(), 1);
    assert!((robot.bodies[0].mass - 5.018).abs() < 1e-12);
    one_warning(&robot, &["r.urdf:3: link `imu`", "no inertia", "fixed to `trunk`"]);
}

/// A camera with an impossible inertia, fixed to the base: anymal_c.
#[test]
fn a_camera_with_an_impossible_inertia_becomes_part_of_the_base() {
    let camera = [0.000637051, 0.000484569, 0.000424211, 0.000929402, 5.138e-06, 0.000484569];
    let robot = read(&[
        link("base", 10.0, ROUND, ""),
        link("camera", 0.16, camera, ""),
        link("lens", 0.16, camera, ""),
        joint("mount", "fixed", "base", "camera", ""),
        joint("thread", "fixed", "camera", "lens", ""),
    ]);
    assert_eq!(robot.bodies.len(), 1);
    let [xx, xy, xz, yy, yz, zz] = camera;
    let of_camera = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
    let arm = |z: f64| Matrix3::from_diagonal(&nalgebra::Vector3::new(z * z, z * z, 0.0));
    let (total, centre) = (10.32, (0.16 * 0.2 + 0.16 * 0.4) / 10.32);
    let whole = Matrix3::from_diagonal_element(0.02) + 2.0 * of_camera + 0.16 * (arm(0.2) + arm(0.4))
        - total * arm(centre);
    near(&robot.bodies[0].inertia, &whole);
    one_warning(&robot, &["r.urdf:3: link `camera`", "sum of the other two", "1 more like it: `lens`"]);
}

/// A moving link whose inertia breaks the triangle inequality: phantomx.
#[test]
fn a_coxa_gets_the_nearest_inertia_that_a_body_can_have() {
    let robot = read(&[
        link("base", 1.0, ROUND, ""),
        link("coxa", 0.02, [2e-6, 0.0, 0.0, 1e-5, 0.0, 2e-5], ""),
        joint("hip", "continuous", "base", "coxa", ""),
    ]);
    // ½·tr(I)·1 − I = diag(14, 6, −4)·1e-6: the −4 becomes a millionth of 14 + 6.
    let least = 2e-11;
    let expected = nalgebra::Vector3::new(6e-6 + least, 14e-6 + least, 20e-6);
    let used = robot.bodies[1].inertia;
    assert!((used - Matrix3::from_diagonal(&expected)).norm() < 1e-15, "{used}");
    one_warning(
        &robot,
        &[
            "r.urdf:3: link `coxa`",
            "2.000000e-6, 1.000000e-5, 2.000000e-5",
            "sum of the other two",
            "6.000020e-6",
        ],
    );
}

/// A turned tensor is repaired in its own axes, and one that a body can have is not touched.
#[test]
fn the_repair_turns_with_the_axes_and_leaves_good_tensors() {
    let turn = nalgebra::Rotation3::from_euler_angles(0.3, -0.8, 1.1);
    let turned = |d: [f64; 3]| turn * Matrix3::from_diagonal(&d.into()) * turn.inverse();
    let six = |m: Matrix3<f64>| [m[(0, 0)], m[(0, 1)], m[(0, 2)], m[(1, 1)], m[(1, 2)], m[(2, 2)]];
    let robot = |d| {
        read(&[
            link("base", 1.0, ROUND, ""),
            link("arm", 1.0, six(turned(d)), ""),
            joint("j", "continuous", "base", "arm", ""),
        ])
    };
    let repaired = robot([0.1, 0.1, 0.5]);
    // Σ = diag(0.25, 0.25, −0.15).
    near(&repaired.bodies[1].inertia, &turned([0.25 + 5e-7, 0.25 + 5e-7, 0.5]));
    let good = robot([0.1, 0.2, 0.3]);
    assert!(good.warnings.is_empty(), "{:?}", good.warnings);
    near(&good.bodies[1].inertia, &turned([0.1, 0.2, 0.3]));
    // Not positive because of its products: the same way out.
    let saddle = robot([-0.05, 0.3, 0.3]);
    one_warning(&saddle, &["link `arm`", "not positive", "used instead"]);
}

/// Mass without inertia on links that move: laikago. Its shapes, filled evenly, have one.
#[test]
fn a_link_without_inertia_gets_that_of_its_shapes() {
    let part = "<collision><geometry><box size=\"0.6 0.2 0.1\"/></geometry></collision>";
    let robot = read(&[
        link("chassis", 12.0, [0.0; 6], part),
        link("leg", 1.5, [0.0; 6], ""),
        joint("hip", "continuous", "chassis", "leg", ""),
    ]);
    let moments = nalgebra::Vector3::new(0.04 + 0.01, 0.36 + 0.01, 0.36 + 0.04);
    near(&robot.bodies[0].inertia, &Matrix3::from_diagonal(&moments));
    // Without shapes: a ball of 1 cm radius.
    near(&robot.bodies[1].inertia, &Matrix3::from_diagonal_element(1.5 * 0.4 * 1e-4));
    assert_eq!(robot.warnings.len(), 2, "{:?}", robot.warnings);
    for (warning, words) in robot.warnings.iter().zip([
        ["r.urdf:2: link `chassis`", "no inertia", "its shapes filled evenly", "3.700000e-1"],
        ["r.urdf:3: link `leg`", "no inertia", "a ball of 1 cm radius", "6.000000e-5"],
    ]) {
        words.iter().for_each(|w| assert!(warning.contains(w), "`{w}` is not in: {warning}"));
    }
}

/// Moments within rounding of 0, on either side: icub.
#[test]
fn moments_a_rounding_below_0_are_repaired() {
    for tensor in [[-5e-20, 0.0, 0.0, 0.0, 0.0, 0.0], [-1e-13, 0.0, 0.0, 0.02, 0.0, 0.02]] {
        let robot = read(&[link("a", 1.0, tensor, "")]);
        one_warning(&robot, &["r.urdf:2: link `a`", "not positive", "used instead"]);
        assert!(robot.bodies[0].inertia.symmetric_eigenvalues().min() > 0.0);
    }
}

/// `<limit>` without `lower` and `upper`: minitaur.
#[test]
fn limits_without_a_range_are_none() {
    let with = |limit: &str| {
        read(&[
            link("base", 1.0, ROUND, ""),
            link("arm", 1.0, ROUND, ""),
            joint("knee", "revolute", "base", "arm", limit),
        ])
    };
    for limit in ["<limit effort=\"0\" velocity=\"0\"/>", "", "<limit lower=\"0.5\" upper=\"0.5\"/>"] {
        let robot = with(limit);
        assert_eq!(robot.joints[0].limits, None);
        one_warning(&robot, &["r.urdf:4: joint `knee`", "no room", "without limits"]);
    }
    assert!(with("").warnings[0].contains("neither `lower` nor `upper`"));
    assert!(with("<limit lower=\"0.5\" upper=\"0.5\"/>").warnings[0].contains("0.5 … 0.5"));
}

/// A binary STL file whose header begins with the word that starts ascii ones: solo12.
#[test]
fn a_binary_stl_that_begins_with_solid_is_binary() {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("solid_stl");
    std::fs::create_dir_all(&folder).unwrap();
    let corners = [[0.0_f32; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
    let mut bytes = format!("{:<80}", "solid by a CAD program").into_bytes();
    bytes.extend(4_u32.to_le_bytes());
    for face in faces {
        bytes.extend([0_u8; 12]);
        face.iter().flat_map(|k| corners[*k]).for_each(|x| bytes.extend(x.to_le_bytes()));
        bytes.extend([0_u8; 2]);
    }
    std::fs::write(folder.join("leg.stl"), bytes).unwrap();
    let shape = "<collision><geometry><mesh filename=\"leg.stl\"/></geometry></collision>";
    let file = folder.join("solo.urdf");
    std::fs::write(&file, robot(&[link("leg", 1.0, ROUND, shape)])).unwrap();
    let robot = read_robot(&file, &Options::default()).unwrap();
    let ShapeGeometry::Hull(mesh) = &robot.bodies[0].shapes[0].geometry else { panic!("a hull") };
    assert_eq!((mesh.points.len(), mesh.triangles.len()), (4, 4));
    assert!(robot.warnings.is_empty(), "{:?}", robot.warnings);
}

/// A defect that no simulation can live with stays an error, and `strict` makes one of every warning.
#[test]
fn what_is_broken_is_refused_by_name() {
    let moving = |mass: f64, tensor: [f64; 6]| {
        let parts = [
            link("base", 1.0, ROUND, ""),
            link("arm", mass, tensor, ""),
            joint("j", "continuous", "base", "arm", ""),
        ];
        read_urdf_text("r.urdf", &robot(&parts), &Options::default()).unwrap_err().to_string()
    };
    for (mass, tensor, words) in [
        (f64::NAN, ROUND, "not finite"),
        (1.0, [f64::NAN; 6], "not finite"),
        (-1.0, ROUND, "mass -1 kg is not positive"),
        (0.0, ROUND, "mass 0 kg is not positive"),
        (0.0, [0.0; 6], "moves on a joint but has no mass"),
        (1.0, [-0.1, 0.0, 0.0, 0.2, 0.0, 0.2], "ixx = -0.1 is negative"),
    ] {
        let message = moving(mass, tensor);
        assert!(message.contains("r.urdf:3") && message.contains("`arm`"), "{message}");
        assert!(message.contains(words), "`{words}` is not in: {message}");
    }
    let camera = [
        link("base", 1.0, ROUND, ""),
        link("camera", -0.1, ROUND, ""),
        joint("m", "fixed", "base", "camera", ""),
    ];
    let message = read_urdf_text("r.urdf", &robot(&camera), &Options::default()).unwrap_err().to_string();
    assert!(message.contains("mass -0.1 kg"), "{message}");
}

#[test]
fn strict_refuses_where_there_is_a_warning() {
    let parts = [
        link("base", 1.0, ROUND, ""),
        link("coxa", 0.02, [2e-6, 0.0, 0.0, 1e-5, 0.0, 2e-5], ""),
        joint("hip", "continuous", "base", "coxa", ""),
    ];
    let strict = Options { strict: true, ..Options::default() };
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR"));
    let file = folder.join("strict.urdf");
    std::fs::write(&file, robot(&parts)).unwrap();
    assert!(read_robot(&file, &Options::default()).is_ok());
    let message = read_robot(&file, &strict).unwrap_err().to_string();
    for word in ["strict.urdf:3: link `coxa`", "sum of the other two", "strict"] {
        assert!(message.contains(word), "`{word}` is not in: {message}");
    }
}

/// Defects that other readers accept: prefixes that nothing declares, an inertial without inertia, a texture without a
/// file, a fixed joint that follows, shapes of size 0.
#[test]
fn what_other_readers_bear_is_borne() {
    let parts = [
        link(
            "base",
            1.0,
            ROUND,
            "<visual><geometry><box size=\"0 0 0\"/></geometry><material name=\"m\"><texture/></material></visual>",
        ),
        link("arm", 1.0, ROUND, ""),
        "<link name=\"cap\"><inertial><mass value=\"0.1\"/></inertial></link>\n".into(),
        joint("j", "revolute", "base", "arm", "<limit lower=\"-1\" upper=\"1\" drake:acceleration=\"3\"/>"),
        joint("f", "fixed", "arm", "cap", "<mimic joint=\"j\"/>"),
    ];
    let robot = read(&parts);
    assert_eq!((robot.bodies.len(), robot.couplings.len()), (2, 0));
    assert!((robot.bodies[1].mass - 1.1).abs() < 1e-12);
    let said = robot.warnings.join("\n");
    for words in [
        "r.urdf:4: link `cap`: it has mass and no inertia",
        "r.urdf:6: joint `f`: <mimic> does nothing on a fixed joint",
        "r.urdf:2: link `base`: a shape of size 0 m is left out",
        "r.urdf:5: `acceleration` = \"3\" of <limit>",
    ] {
        assert!(said.contains(words), "`{words}` is not in: {said}");
    }
}

/// A foot that is fixed to its shank overlaps the parent of the shank, too: they never touch.
#[test]
fn bodies_across_fixed_joints_never_touch() {
    let robot = read(&[
        link("thigh", 1.0, ROUND, ""),
        link("shank", 1.0, ROUND, ""),
        link("foot", 1.0, ROUND, ""),
        link("toe", 1.0, ROUND, ""),
        joint("knee", "continuous", "thigh", "shank", ""),
        joint("sole", "fixed", "shank", "foot", ""),
        joint("hinge", "continuous", "foot", "toe", ""),
    ]);
    // Of four bodies the thigh and the toe can meet; the others in line are joined directly.
    assert_eq!(robot.excluded, [[0, 2], [1, 3]]);
}

/// A link that hangs from one called `world` stands still; its mass does not count.
#[test]
fn what_is_fixed_to_the_world_stands_still() {
    let robot = read(&[
        "<link name=\"world\"/>".into(),
        link("post", 5.0, ROUND, ""),
        link("arm", 1.0, ROUND, ""),
        joint("bolt", "fixed", "world", "post", ""),
        joint("j", "continuous", "post", "arm", ""),
    ]);
    assert_eq!((robot.bodies.len(), robot.base), (1, Base::World));
    assert_eq!(robot.joints[0].parent_from_joint.translation.vector.z, 0.4);
}
