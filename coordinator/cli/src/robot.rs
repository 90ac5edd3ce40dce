//! `terraglue robot`: a robot file as it would be simulated.

use super::arguments::RobotArguments;
use super::output::outln;
use super::{Exit, show};
use nalgebra::{Matrix3, Vector3};
use serde_json::{Value, json};
use terraglue_diagnostics::Result;
use terraglue_robot_import::{Base, Joint, JointKind, Options, Robot, TotalMass, read_robot};
use terraglue_scenario::InputError;

/// Prints bodies, joints and what they are together with all joints at 0.
pub fn robot(arguments: &RobotArguments) -> Result<Exit> {
    let packages = arguments.packages.iter().map(|(name, folder)| (name.clone(), folder.into())).collect();
    let options = Options {
        fixed_base: arguments.fixed_base,
        packages,
        strict: arguments.strict,
        ..Options::default()
    };
    let robot = read_robot(&arguments.file, &options.with_ros_package_path()).map_err(|e| wrong(&e))?;
    let whole = robot.whole(&robot.poses(&vec![0.0; robot.joints.len()]));
    if arguments.json {
        outln!("{:#}", as_json(&robot, &whole));
        return Ok(Exit::Done);
    }
    robot.warnings.iter().for_each(|warning| log::warn!("{warning}"));
    robot.notices.iter().for_each(|notice| log::info!("{notice}"));
    outln!("{}\n{}\n{}", bodies(&robot), joints(&robot), together(&robot, &whole));
    Ok(Exit::Done)
}

/// An error of a robot file, shown at its line.
pub fn wrong(error: &terraglue_robot_import::Error) -> Box<InputError> {
    let message = error.to_string();
    let help = match error {
        terraglue_robot_import::Error::Read { .. } => show::PATH,
        _ => show::ROBOT_FILES,
    };
    let mut shown =
        InputError::of_file(&message, &message).unwrap_or_else(|| InputError::plain(message, None));
    shown.help = Some(help.into());
    shown
}

fn bodies(robot: &Robot) -> comfy_table::Table {
    let mut table = show::table(&["body", "mass", "principal moments", "shapes that touch"]);
    for body in &robot.bodies {
        let moments = principal(&body.inertia).map(|m| format!("{m:.3e}")).join(", ");
        let touching = body.shapes.iter().filter(|s| s.collides).count();
        table.add_row([
            &body.name,
            &format!("{:.4} kg", body.mass),
            &format!("{moments} kg m²"),
            &touching.to_string(),
        ]);
    }
    table
}

fn joints(robot: &Robot) -> comfy_table::Table {
    let mut table = show::table(&["joint", "kind", "from", "to", "range"]);
    for joint in &robot.joints {
        let (parent, child) = ends(robot, joint);
        let unit = if joint.kind == JointKind::Prismatic { "m" } else { "rad" };
        let range = joint.limits.map_or_else(
            || "–".into(),
            |[low, high]| format!("{} … {} {unit}", show::fixed(low, 3), show::fixed(high, 3)),
        );
        table.add_row([joint.name.as_str(), kind(joint.kind), parent, child, &range]);
    }
    table
}

fn together(robot: &Robot, whole: &TotalMass) -> comfy_table::Table {
    let mut table = show::table(&["all joints at 0", "value"]);
    let vector = |v: &Vector3<f64>| {
        v.as_slice().iter().map(|x| show::fixed(*x, 4)).collect::<Vec<_>>().join(", ") + " m"
    };
    table.add_row(["root", base(robot)]);
    table.add_row(["degrees of freedom", &robot.freedoms().to_string()]);
    table.add_row(["mass", &format!("{:.6} kg", whole.mass)]);
    table.add_row(["centre of mass", &vector(&whole.com)]);
    for (row, name) in ["inertia about it", "", ""].iter().enumerate() {
        let [x, y, z] = [0, 1, 2].map(|column| whole.inertia[(row, column)]);
        table.add_row([*name, &format!("{x:>12.5e} {y:>12.5e} {z:>12.5e} kg m²")]);
    }
    table
}

fn principal(tensor: &Matrix3<f64>) -> [f64; 3] {
    let mut moments: [f64; 3] = tensor.symmetric_eigenvalues().into();
    moments.sort_by(f64::total_cmp);
    moments
}

fn base(robot: &Robot) -> &'static str {
    match robot.base {
        Base::Free(_) => "free",
        Base::World => "world",
    }
}

fn kind(kind: JointKind) -> &'static str {
    match kind {
        JointKind::Revolute => "revolute",
        JointKind::Prismatic => "prismatic",
        JointKind::Fixed => "fixed",
        JointKind::Spherical => "spherical",
        JointKind::Planar => "planar",
    }
}

fn ends<'a>(robot: &'a Robot, joint: &Joint) -> (&'a str, &'a str) {
    (joint.parent.map_or("world", |p| &robot.bodies[p].name), &robot.bodies[joint.child].name)
}

fn rows(m: &Matrix3<f64>) -> Value {
    json!([0, 1, 2].map(|r| [0, 1, 2].map(|c| m[(r, c)])))
}

fn as_json(robot: &Robot, whole: &TotalMass) -> Value {
    let bodies = robot.bodies.iter().map(|b| {
        json!({
            "name": b.name,
            "mass_kg": b.mass,
            "com_m": b.com.as_slice(),
            "inertia_kg_m2": rows(&b.inertia),
            "touching_shapes": b.shapes.iter().filter(|s| s.collides).count(),
        })
    });
    let joints = robot.joints.iter().map(|j| {
        let (parent, child) = ends(robot, j);
        json!({ "name": j.name, "kind": kind(j.kind), "parent": parent, "child": child, "limits": j.limits })
    });
    json!({
        "name": robot.name,
        "base": base(robot),
        "bodies": bodies.collect::<Vec<_>>(),
        "joints": joints.collect::<Vec<_>>(),
        "freedoms": robot.freedoms(),
        "mass_kg": whole.mass,
        "com_m": whole.com.as_slice(),
        "inertia_kg_m2": rows(&whole.inertia),
        "warnings": robot.warnings,
        "notices": robot.notices,
    })
}
