//! Two free bodies as two FMUs, glued off their centres: the same as one robot of both on a ball joint, and their
//! angular momentum stays.

use super::{built, fmus};
use crate::process::{Outcome, write};
use crate::{Figure, Limit};
use nalgebra::Vector3;
use std::fmt::Write;
use std::path::Path;
use terraglue::Testbed;
use terraglue_numerics::extremes::larger;

const STEPS: u32 = 2000;
const H: f64 = 1e-3;
/// Balls: name, mass, kg, moment of inertia, kg m², and place at the start, m.
const SIDES: [(&str, f64, f64, [f64; 3]); 2] =
    [("hull", 3.0, 0.4, [0.0, 0.0, 1.0]), ("arm", 1.0, 0.05, [0.7, 0.3, 0.8])];
/// Where they are glued, m, and how both turn at the start, rad/s.
const JOINT: [f64; 3] = [0.4, 0.1, 0.9];
const SPIN: [f64; 3] = [1.0, 2.0, -1.5];
/// Frames of the links of the robot: that of the second is the joint.
const FRAMES: [[f64; 3]; 2] = [SIDES[0].3, JOINT];
/// Outputs of an FMU, in the order of its variables; then come force, moment, mass and inertia.
const TOLD: [&str; 13] = ["x", "y", "z", "qw", "qx", "qy", "qz", "vx", "vy", "vz", "wx", "wy", "wz"];

/// Semi-implicit Euler; the orientation by the Cayley transform.
const STEP: &str = "for (int k = 0; k < 3; k++) { v[7 + k] += h * v[13 + k] / v[19]; v[k] += h * v[7 + k]; v[10 + k] += h * v[16 + k] / v[20]; } \
    double a = h * v[10] / 2, b = h * v[11] / 2, c = h * v[12] / 2, *q = v + 3, w = q[0], x = q[1], y = q[2], z = q[3]; \
    double t[4] = {w - a * x - b * y - c * z, x + a * w + b * z - c * y, y - a * z + b * w + c * x, z + a * y - b * x + c * w}; \
    double s = sqrt(t[0] * t[0] + t[1] * t[1] + t[2] * t[2] + t[3] * t[3]); for (int k = 0; k < 4; k++) q[k] = t[k] / s;";

type Vector = [f64; 3];

fn cross(a: Vector, b: Vector) -> Vector {
    Vector3::from(a).cross(&Vector3::from(b)).into()
}

fn minus(a: Vector, b: Vector) -> Vector {
    (Vector3::from(a) - Vector3::from(b)).into()
}

/// Largest distance from the robot, and largest change of the angular momentum.
pub fn figures(folder: &Path) -> Outcome<Vec<Figure>> {
    for (name, mass, inertia, place) in SIDES {
        fmu(folder, name, mass, inertia, place)?;
    }
    let (mut glued, mut whole) = (built(folder, &pair())?, built(folder, &robot(folder)?)?);
    let (mut off, mut first, mut drift) = (0.0_f64, None, 0.0_f64);
    for _ in 0..STEPS {
        let mut total = [0.0; 3];
        for testbed in [&mut glued, &mut whole] {
            testbed.step().map_err(|e| e.to_string())?;
        }
        for ((name, mass, inertia, place), frame) in SIDES.into_iter().zip(FRAMES) {
            let found = told(&glued, name, [0.0; 3]);
            let wanted = told(&whole, &format!("robot.{name}"), minus(place, frame));
            // rates of the robot know the gap of its joint, 1e-12 m, over the step
            off = found[..7].iter().zip(wanted).fold(off, |worst, (a, b)| larger(worst, (a - b).abs()));
            let spin = momentum(&found, mass, inertia);
            total = std::array::from_fn(|k| total[k] + spin[k]);
        }
        let start = *first.get_or_insert(total);
        let change = minus(total, start).iter().fold(0.0, |m, x| larger(m, x.abs()));
        drift = larger(drift, change / start.iter().fold(0.0, |m, x| larger(m, x.abs())));
    }
    let what = "two bodies as FMUs, glued beside their centres, against one robot on a ball joint";
    Ok(vec![
        Figure::new(
            "fmi.turning.robot",
            off,
            Limit::AtMost(1e-10),
            format!("{what}: largest difference of place (m) and quaternion over 2 s"),
        ),
        Figure::new(
            "fmi.turning.momentum",
            drift,
            Limit::AtMost(1e-10),
            format!("{what}: largest change of the angular momentum, relative"),
        ),
    ])
}

/// All outputs of a body whose centre of mass lies at `com` in it, for that centre.
fn told(testbed: &Testbed, prefix: &str, com: Vector) -> [f64; 13] {
    let mut told = TOLD.map(|what| testbed.read(&format!("{prefix}.{what}")).unwrap_or(f64::NAN));
    let axis = [told[4], told[5], told[6]];
    let (once, twice) = (cross(axis, com), cross(axis, cross(axis, com)));
    let arm: Vector = std::array::from_fn(|k| com[k] + 2.0 * (told[3] * once[k] + twice[k]));
    let speed = cross([told[10], told[11], told[12]], arm);
    for k in 0..3 {
        told[k] += arm[k];
        told[7 + k] += speed[k];
    }
    told
}

/// About the origin of the world, kg m²/s.
fn momentum(told: &[f64; 13], mass: f64, inertia: f64) -> Vector {
    let three = |k: usize| [told[k], told[k + 1], told[k + 2]];
    let (about, spin) = (cross(three(0), three(7)), three(10));
    std::array::from_fn(|k| mass * about[k] + inertia * spin[k])
}

fn fmu(folder: &Path, name: &str, mass: f64, inertia: f64, place: Vector) -> Outcome<()> {
    let speed = cross(SPIN, minus(place, SIDES[0].3));
    let turn = [1.0, 0.0, 0.0, 0.0];
    let starts = place.into_iter().chain(turn).chain(speed).chain(SPIN);
    let mut variables: Vec<fmus::Variable> =
        TOLD.iter().zip(starts).map(|(name, x)| (*name, 'o', x)).collect();
    variables.extend(["fx", "fy", "fz", "mx", "my", "mz"].map(|name| (name, 'i', 0.0)));
    variables.extend([("mass", 'p', mass), ("inertia", 'p', inertia)]);
    fmus::build(folder, name, &variables, "", STEP).map(drop)
}

fn time() -> String {
    format!(
        "[time]\nstep_s = {H}\nduration_s = 2.0\n[world]\ngravity_m_s2 = [0.0, 0.0, 0.0]\n[gluing]\nstrategy = \"iterative\"\n\
         tolerance = 1e-10\n"
    )
}

fn pair() -> String {
    let mut text = time();
    for (name, ..) in SIDES {
        let _ = writeln!(
            text,
            "[{name}]\nfmu = \"{name}.fmu\"\n[{name}.bodies.body]\nposition = {:?}\norientation = {:?}\nvelocity = {:?}\n\
             angular_velocity = {:?}\nforce = [\"fx\", \"fy\", \"fz\"]\nmoment = [\"mx\", \"my\", \"mz\"]",
            &TOLD[..3],
            &TOLD[3..7],
            &TOLD[7..10],
            &TOLD[10..]
        );
    }
    text + &format!(
        "[[glue]]\nside_1 = \"hull.body\"\nside_2 = \"arm.body\"\nat_m = {JOINT:?}\ncomponents = [\"x\", \"y\", \"z\"]\n"
    )
}

/// The same as one robot; writes its file.
fn robot(folder: &Path) -> Outcome<String> {
    let triple = |v: Vector| v.map(|x| x.to_string()).join(" ");
    let mut links = String::new();
    for ((name, mass, i, place), frame) in SIDES.into_iter().zip(FRAMES) {
        let _ = write!(
            links,
            "<link name=\"{name}\"><inertial><origin xyz=\"{}\"/><mass value=\"{mass}\"/><inertia ixx=\"{i}\" iyy=\"{i}\" \
             izz=\"{i}\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link>",
            triple(minus(place, frame))
        );
    }
    let joint = format!(
        "<joint name=\"ball\" type=\"continuous\"><parent link=\"hull\"/><child link=\"arm\"/><axis xyz=\"0 0 1\"/>\
         <origin xyz=\"{}\"/></joint>",
        triple(minus(JOINT, SIDES[0].3))
    );
    write(&folder.join("turning.urdf"), &format!("<robot name=\"pair\">{links}{joint}</robot>"))?;
    Ok(time()
        + &format!(
            "[robot]\nmodule = \"rigid-body\"\nmodel = \"turning.urdf\"\nmotor = \"off\"\nposition_m = {:?}\n\
             rotation_rate_rad_s = {SPIN:?}\njoint_kind = {{ ball = \"spherical\" }}\n",
            SIDES[0].3
        ))
}
