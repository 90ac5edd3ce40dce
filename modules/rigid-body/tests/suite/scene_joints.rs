//! The joints of the scene: where the bodies' own poses put them, with the variables and actions that the robot has.

use crate::common;
use common::{Fixture, temporary_urdf};
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};
use terraglue_subsystem::{JointKind, JointVariables, Pose, SceneJoint};

fn isometry(p: &Pose) -> Isometry3<f64> {
    let [w, x, y, z] = p.orientation;
    let turn = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
    Isometry3::from_parts(Translation3::from(p.position), turn)
}

/// Position of a joint of the scene in the world, and the direction of its axis.
fn placed(f: &Fixture, joint: &SceneJoint) -> (Vector3<f64>, Vector3<f64>) {
    let parent = match joint.parent {
        SceneJoint::WORLD => Isometry3::identity(),
        body => isometry(&f.states()[body as usize].world_from_body),
    };
    let at = parent * isometry(&joint.parent_from_joint);
    (at.translation.vector, at.rotation * Vector3::from(joint.axis))
}

const ARM: &str = r#"<robot name="arm">
  <link name="base"><inertial><origin xyz="0.1 0 0"/><mass value="2"/>
    <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="upper"><inertial><origin xyz="0 0.2 0.3"/><mass value="1"/>
    <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="fore"><inertial><origin xyz="0 0 0.1"/><mass value="1"/>
    <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
    <origin xyz="0.5 0 0.25" rpy="0 0 1.5707963267948966"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="2" effort="5" velocity="1"/></joint>
  <joint name="elbow" type="continuous"><parent link="upper"/><child link="fore"/>
    <origin xyz="0 0 0.75"/><axis xyz="0 0 1"/></joint>
</robot>"#;

#[test]
fn joints_stand_where_the_file_puts_them_and_name_their_variables() {
    let model = temporary_urdf("scene-joints", ARM);
    let f = Fixture::new(&format!(r#"{{"model": "{model}", "x": 3.0, "z": 1.0}}"#), 0.0, 1e-3);
    let joints = &f.scene.joints;
    assert_eq!(joints.iter().map(|j| j.name.as_str()).collect::<Vec<_>>(), ["shoulder", "elbow"]);
    let (shoulder, elbow) = (&joints[0], &joints[1]);
    assert_eq!((shoulder.kind, shoulder.limits), (JointKind::Revolute, [-1.0, 2.0]));
    assert_eq!((elbow.kind, elbow.limits), (JointKind::Continuous, [f64::NEG_INFINITY, f64::INFINITY]));
    assert_eq!((shoulder.parent, shoulder.child, elbow.parent, elbow.child), (0, 1, 1, 2));
    let base = Vector3::from(f.states()[0].world_from_body.position);
    let (at, axis) = placed(&f, shoulder);
    assert!((at - base - Vector3::new(0.5, 0.0, 0.25)).norm() < 1e-12, "{at}");
    // y of the joint's frame, which is turned by a quarter about z
    assert!((axis - Vector3::new(-1.0, 0.0, 0.0)).norm() < 1e-12, "{axis}");
    let (at, axis) = placed(&f, elbow);
    assert!((at - base - Vector3::new(0.5, 0.0, 1.0)).norm() < 1e-12 && (axis.z - 1.0).abs() < 1e-12);
    for joint in joints {
        let v = joint.variables;
        let named = [v.position, v.velocity, v.torque, v.torque_limit, v.blocked];
        let names = ["angle", "velocity", "torque", "max_torque", "blocked"];
        for (id, name) in named.into_iter().zip(names) {
            assert_eq!(id, f.id(&format!("{}.{name}", joint.name)));
        }
        assert!(f.robot.actions().iter().any(|a| a.name == joint.break_action), "{}", joint.break_action);
    }
}

#[test]
fn loops_and_balls_of_mjcf_are_told_and_what_stands_still_is_held_by_the_world() {
    let text = r#"<mujoco><worldbody>
        <geom name="wall" type="box" size="1 1 1" pos="5 0 0"/>
        <body name="a" pos="0 0 1"><joint name="swing" type="hinge" axis="0 1 0"/><geom type="sphere" size=".1" mass="1"/>
          <body name="b" pos="0.5 0 0"><joint name="ball" type="ball"/><geom type="sphere" size=".1" mass="1"/></body>
        </body></worldbody>
        <equality><connect name="loop" body1="b" anchor="0.5 0 0"/></equality></mujoco>"#;
    let model = temporary_urdf("scene-loop", text);
    let f = Fixture::new(&format!(r#"{{"model": "{model}"}}"#), 0.0, 1e-3);
    let of =
        |name: &str| f.scene.joints.iter().find(|j| j.name == name).unwrap_or_else(|| panic!("no {name}"));
    assert_eq!((of("swing").kind, of("swing").parent), (JointKind::Continuous, SceneJoint::WORLD));
    let ball = of("ball");
    assert_eq!(
        (ball.kind, ball.axis, ball.variables),
        (JointKind::Spherical, [0.0; 3], JointVariables::ABSENT)
    );
    let closure = of("loop");
    assert_eq!((closure.kind, closure.child), (JointKind::Closure, 1));
    let (at, _) = placed(&f, closure);
    assert!((at - Vector3::new(1.0, 0.0, 1.0)).norm() < 1e-9, "{at}");
    // the wall stands for ever
    let still = of("world");
    assert_eq!((still.kind, still.parent, still.child), (JointKind::Fixed, SceneJoint::WORLD, 2));
    assert!(still.break_action.is_empty());
}
