//! Name and parameters of the module.

use terraglue_subsystem::{Kind, Parameter, ParameterType, Schema};

/// Parameters of a robot in a scenario.
pub(crate) fn schema() -> Schema {
    Schema {
        name: "rigid-body".into(),
        kind: Kind::Robot,
        help: "Rigid bodies with joints and motors, read from a robot file (URDF, MJCF)".into(),
        parameters: file()
            .into_iter()
            .chain(start())
            .chain(making())
            .chain(motors())
            .chain(ground())
            .chain(crate::contact::surfaces::parameters())
            .chain([crate::objects::parameter()])
            .chain(crate::cut::parameters())
            .chain(crate::closure::configure::parameters())
            .chain(crate::actuator::configure::parameters())
            .collect(),
    }
}

/// The robot file.
fn file() -> Vec<Parameter> {
    vec![
        Parameter::of("model", ParameterType::Path, "Robot file (URDF or MJCF)"),
        Parameter::of(
            "packages.*",
            ParameterType::Path,
            "Folder of a package that the robot file names by `package://` (else: folders above the file, ROS_PACKAGE_PATH)",
        )
        .optional(),
        Parameter::of(
            "strict",
            ParameterType::Bool,
            "Refuse a robot file that has a warning: one that says in vain what is not supported, or something that is not \
             used as it stands",
        )
        .or(false),
    ]
}

/// Position and motion of the robot at the start.
fn start() -> Vec<Parameter> {
    vec![
        Parameter {
            unit: "m".into(),
            ..Parameter::of("position_m", ParameterType::Numbers, "Initial x, y, z of the root link's frame")
                .or(vec![0.0, 0.0, 0.0])
        },
        Parameter::number("heading_rad", "rad", 0.0, "Initial rotation of the robot about z"),
        Parameter {
            unit: "rad".into(),
            ..Parameter::of(
                "joints",
                ParameterType::NumberTable,
                "Initial coordinate by joint name (rad or m); `*` stands for any text; others start at 0, or at the end of their range next to it",
            )
            .optional()
        },
        Parameter {
            unit: "m/s".into(),
            ..Parameter::of(
                "velocity_m_s",
                ParameterType::Numbers,
                "Initial velocity of the root link's origin, world axes",
            )
            .or(vec![0.0, 0.0, 0.0])
        },
        Parameter {
            unit: "rad/s".into(),
            ..Parameter::of(
                "rotation_rate_rad_s",
                ParameterType::Numbers,
                "Initial rotation rate of the root link, its own axes",
            )
            .or(vec![0.0, 0.0, 0.0])
        },
        Parameter {
            unit: "rad/s".into(),
            ..Parameter::of(
                "joint_rates",
                ParameterType::NumberTable,
                "Initial rate by joint name (rad/s or m/s); `*` stands for any text; others are at rest",
            )
            .optional()
        },
    ]
}

/// Parameters of reading the file and of stepping.
fn making() -> Vec<Parameter> {
    vec![
        Parameter::of(
            "joint_kind",
            ParameterType::TextByName,
            "Kind of joints by name that the robot file has no word for; they have no motor. A universal joint turns about \
             its axis and a second one across it on the child (y for z, x for y, z for x)",
        )
        .optional()
        .choices(&["as-in-file", "cylindrical", "universal", "spherical", "planar"]),
        Parameter::of("fixed_base", ParameterType::Bool, "Fix the root link to the world").or(false),
        Parameter::of(
            "place_on_ground",
            ParameterType::Bool,
            "Lower or lift the robot until its lowest shape touches the scenario's terrain (ignored without \
             terrain or with a fixed base)",
        )
        .or(true),
        Parameter::of(
            "integrator",
            ParameterType::Text,
            "How the bodies are stepped: `symplectic-euler` (first order, for anything that hits); of second order, for \
             smooth forces: `generalized-alpha` (damps what the step cannot resolve) or `energy-momentum` (damps nothing)",
        )
        .or("symplectic-euler")
        .choices(&crate::dynamics::scheme::Integrator::NAMES),
        Parameter::number("rho_infinity", "", 0.8, "Generalized-alpha: what stays of the fastest vibration per step")
            .within(0.0, 1.0),
    ]
}

/// Commands of the motors at the start.
fn motors() -> Vec<Parameter> {
    vec![
        Parameter::of(
            "motor",
            ParameterType::TextByName,
            "How the motors are driven at the start, for all joints or by name",
        )
        .or("position")
        .choices(&crate::motor::Motor::NAMES),
        by_name("stiffness", "N m/rad", 600.0, "Stiffness of position motors, for all joints or by name"),
        by_name("damping", "N m s/rad", 10.0, "Damping of position motors, for all joints or by name"),
        by_name("max_torque", "N m", 60.0, "Largest torque of the motors, for all joints or by name"),
        target_by_name(
            "velocity_target",
            "rad/s",
            "Rate that the motors want at the start, for all joints or by name",
        ),
        target_by_name(
            "torque_target",
            "N m",
            "Torque that torque motors give at the start, for all joints or by name",
        ),
    ]
}

/// Rigid ground, and how contacts are solved.
fn ground() -> Vec<Parameter> {
    vec![
        Parameter::of(
            "ground",
            ParameterType::Text,
            "Rigid ground under the robot, where no soil is needed: a half-space, or the scenario's terrain turned to stone",
        )
        .or("none")
        .choices(&["none", "half-space", "terrain"]),
        Parameter::number("ground_height_m", "m", 0.0, "Distance of the rigid ground from the origin along its normal"),
        Parameter::of("ground_normal", ParameterType::Numbers, "Direction out of the rigid ground: x, y, z")
            .or(vec![0.0, 0.0, 1.0]),
        Parameter::of(
            "contact_solver",
            ParameterType::Text,
            "How contacts are solved: `ncp` (Coulomb's cone) or a friction pyramid of 4 or 8 facets by Lemke",
        )
        .or("ncp")
        .choices(&crate::contact::bodies::ContactLaw::NAMES),
    ]
}

fn target_by_name(name: &str, unit: &str, help: &str) -> Parameter {
    Parameter { unit: unit.into(), ..Parameter::of(name, ParameterType::NumberByName, help).or(0.0) }
}

fn by_name(name: &str, unit: &str, default: f64, help: &str) -> Parameter {
    let of = Parameter::of(name, ParameterType::NumberByName, help).or(default);
    Parameter { unit: unit.into(), ..of.within(0.0, f64::INFINITY) }
}
