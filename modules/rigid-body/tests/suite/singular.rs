//! Four-bar windows through the pose in which all rods lie in line, where the rows of their loops depend on each other.

use crate::common;
use common::{Fixture, temporary_urdf};
use std::fmt::Write;
use terraglue_numerics::extremes::larger;

const G: f64 = 9.81;

/// n windows of rods of 1 m and 1 kg: posts on the world, bars between their tops; gravity along −z, upright in z.
fn windows(n: usize, scheme: &str) -> Fixture {
    let mut text = String::from(r#"<robot name="windows"><link name="world"/>"#);
    let mut loops = Vec::new();
    let mut rod = |parent: &str, name: &str, at: [f64; 2], along: [f64; 2], i: [f64; 2]| {
        let [x, z] = along;
        let _ = write!(
            text,
            r#"<link name="{name}"><inertial><origin xyz="{x} 0 {z}"/><mass value="1"/>
            <inertia ixx="{}" iyy="{}" izz="{}" ixy="0" ixz="0" iyz="0"/></inertial></link>
            <joint name="j_{name}" type="continuous"><parent link="{parent}"/><child link="{name}"/>
            <origin xyz="{} 0 {}"/><axis xyz="0 -1 0"/></joint>"#,
            i[0],
            1.0 / 12.0,
            i[1],
            at[0],
            at[1]
        );
    };
    let (slim, wide) = (1.0 / 120.0, 1.0 / 12.0);
    for k in 0..=n {
        rod("world", &format!("post{k}"), [k as f64, 0.0], [0.0, 0.5], [wide, slim]);
    }
    for k in 0..n {
        rod(&format!("post{k}"), &format!("bar{k}"), [0.0, 1.0], [0.5, 0.0], [slim, wide]);
        loops.push(format!(
            r#"{{"name": "close{k}", "kind": "revolute", "links": ["post{}", "bar{k}"], "origin": [0, 0, 1], "axis": [0, -1, 0]}}"#,
            k + 1
        ));
    }
    let file = temporary_urdf(&format!("windows_{n}_{scheme}"), &(text + "</robot>"));
    let parameters = format!(
        r#"{{"model": "{file}", "fixed_base": true, "motor": "off", "integrator": "{scheme}",
        "joint_rates": {{"j_post*": -1.0, "j_bar*": 1.0}}, "loop": [{}]}}"#,
        loops.join(",")
    );
    Fixture::new(&parameters, G, 1e-3)
}

/// Angle of the posts after a time: a·φ¨ = −b·g·cos φ from φ = π/2 with φ˙ = −1.
fn exact(n: usize, t: f64) -> f64 {
    let n = n as f64;
    let (a, b) = ((n + 1.0) / 3.0 + n, (n + 1.0) / 2.0 + n);
    let slope = |y: [f64; 2]| [y[1], -b / a * G * libm::cos(y[0])];
    let along = |y: [f64; 2], k: [f64; 2], h: f64| [y[0] + h * k[0], y[1] + h * k[1]];
    let (steps, mut y) = ((t / 1e-4).round() as usize, [std::f64::consts::FRAC_PI_2, -1.0]);
    let h = t / steps as f64;
    for _ in 0..steps {
        let k1 = slope(y);
        let k2 = slope(along(y, k1, 0.5 * h));
        let k3 = slope(along(y, k2, 0.5 * h));
        let k4 = slope(along(y, k3, h));
        y = std::array::from_fn(|i| y[i] + h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]));
    }
    y[0]
}

/// Largest difference of the posts' angles from the exact one at a time, and |ΔE|.
fn run(n: usize, scheme: &str, until: f64) -> [f64; 2] {
    let mut fixture = windows(n, scheme);
    let start = fixture.robot.energy().mechanical();
    (0..(until / fixture.h).round() as usize).for_each(|_| fixture.free_step());
    let phi = exact(n, until) - std::f64::consts::FRAC_PI_2;
    let off = |k: usize| (fixture.get(&format!("j_post{k}.angle")) - phi).abs();
    let worst = (0..=n).map(off).fold(0.0_f64, larger);
    [worst, (fixture.robot.energy().mechanical() - start).abs()]
}

#[test]
fn rods_pass_the_pose_in_line_on_their_branch() {
    for n in [1, 2] {
        let [angle, energy] = run(n, "energy-momentum", 1.5);
        assert!(angle < 1e-5 && energy < 1e-9, "{n}: {angle:e} {energy:e}");
        let [angle, energy] = run(n, "generalized-alpha", 1.5);
        assert!(angle < 5e-5 && energy < 2e-3, "{n}: {angle:e} {energy:e}");
    }
}
