//! The variables of the module: one table of names, and the access to each one.

use crate::command::Command;
use crate::geometry::{JOINTS, LEG_NAMES, LEGS};
use crate::pattern::{NAMES, Pattern};
use crate::walker::Walker;
use terraglue_subsystem::{Causality, Error, Result, ValueType, Variable};

/// Number of joint targets, the first variables.
pub const TARGETS: u32 = (LEGS * JOINTS) as u32;
const STANCES: (u32, u32) = (48, 48 + LEGS as u32);
const FORCES: (u32, u32) = (56, 56 + LEGS as u32);

/// A scalar of the module apart from targets and stance flags.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
#[repr(u32)]
pub enum Id {
    Roll = TARGETS,
    Pitch,
    Yaw,
    Speed,
    TurnRate,
    Heading,
    Lift,
    PostureFeedback,
    HeadingFeedback,
    Gait,
    Phase,
    SpeedReached,
    TurnRateReached,
    RollCorrection,
    PitchCorrection,
    OutOfReach,
}

impl Id {
    const ALL: [Self; 16] = [
        Self::Roll,
        Self::Pitch,
        Self::Yaw,
        Self::Speed,
        Self::TurnRate,
        Self::Heading,
        Self::Lift,
        Self::PostureFeedback,
        Self::HeadingFeedback,
        Self::Gait,
        Self::Phase,
        Self::SpeedReached,
        Self::TurnRateReached,
        Self::RollCorrection,
        Self::PitchCorrection,
        Self::OutOfReach,
    ];

    fn of(id: u32) -> Result<Self> {
        Self::ALL.into_iter().find(|k| *k as u32 == id).ok_or_else(|| unknown(id))
    }

    fn variable(self) -> Variable {
        use Causality::{Input, Local, Output, Parameter};
        let real = |name: &str, unit: &str, causality, help: &str| {
            Variable::real(self as u32, name, unit, causality, help)
        };
        match self {
            Self::Roll => real("roll", "rad", Input, "Measured roll of the body, left side up positive"),
            Self::Pitch => real("pitch", "rad", Input, "Measured pitch of the body, nose down positive"),
            Self::Yaw => real("yaw", "rad", Input, "Measured yaw of the body, to the left positive"),
            Self::Speed => real("speed", "m/s", Parameter, "Commanded forward speed").within(-2.0, 2.0),
            Self::TurnRate => {
                real("turn_rate", "rad/s", Parameter, "Commanded turn rate, left positive").within(-2.0, 2.0)
            }
            Self::Heading => real("heading", "rad", Parameter, "Heading in the world that is held"),
            Self::Lift => real("lift", "m", Parameter, "Height of the swing of a foot").within(0.0, 0.2),
            Self::PostureFeedback => {
                real("posture_feedback", "", Parameter, "Tilt corrects the feet").typed(ValueType::Bool)
            }
            Self::HeadingFeedback => real("heading_feedback", "", Parameter, "Heading error turns the robot")
                .typed(ValueType::Bool),
            Self::Gait => {
                real("gait", "", Parameter, "Pattern; a change stops the robot first").named(&NAMES)
            }
            Self::Phase => real("phase", "", Local, "Phase of the cycle, 0 … 1"),
            Self::SpeedReached => {
                real("speed_reached", "m/s", Output, "Speed that the feet make, after limits and ramps")
            }
            Self::TurnRateReached => real(
                "turn_rate_reached",
                "rad/s",
                Output,
                "Turn rate that the feet make, corrections included",
            ),
            Self::RollCorrection => {
                real("roll_correction", "rad", Local, "Tilt of the plane of the feet against roll")
            }
            Self::PitchCorrection => {
                real("pitch_correction", "rad", Local, "Tilt of the plane of the feet against pitch")
            }
            Self::OutOfReach => {
                real("out_of_reach", "", Local, "Feet whose target is beyond reach of the leg")
            }
        }
    }
}

/// All variables in ascending order of id.
pub fn table() -> Vec<Variable> {
    let targets = (0..TARGETS).map(|id| {
        let (leg, joint) = (id as usize / JOINTS, id as usize % JOINTS);
        let name = format!("{}_j{}.angle_target", LEG_NAMES[leg], joint + 1);
        Variable::real(id, name, "rad", Causality::Output, "Angle that the joint shall take")
    });
    let stances = LEG_NAMES.iter().zip(STANCES.0..).map(|(leg, id)| {
        let help = "Whether the foot stands on the ground, as far as the gait knows";
        Variable::real(id, format!("{leg}.stance"), "", Causality::Local, help).typed(ValueType::Bool)
    });
    let forces = LEG_NAMES.iter().zip(FORCES.0..).map(|(leg, id)| {
        let help = "Normal force of the ground on the foot; once set, it ends the swing of this foot";
        Variable::real(id, format!("{leg}.contact_force"), "N", Causality::Input, help)
    });
    targets.chain(Id::ALL.into_iter().map(Id::variable)).chain(stances).chain(forces).collect()
}

/// A number.
pub fn number(id: u32, walker: &Walker, command: &Command) -> Result<f64> {
    if id < TARGETS {
        return Ok(walker.targets[id as usize]);
    }
    if let Some(leg) = force(id) {
        return Ok(command.contact[leg].unwrap_or(0.0));
    }
    Ok(match Id::of(id)? {
        Id::Roll => command.attitude[0],
        Id::Pitch => command.attitude[1],
        Id::Yaw => command.attitude[2],
        Id::Speed => command.speed,
        Id::TurnRate => command.turn_rate,
        Id::Heading => command.heading,
        Id::Lift => command.lift,
        Id::Phase => walker.phase,
        Id::SpeedReached => walker.twist.speed,
        Id::TurnRateReached => walker.twist.turn_rate,
        Id::RollCorrection => walker.posture.correction[0],
        Id::PitchCorrection => walker.posture.correction[1],
        Id::OutOfReach => f64::from(walker.out_of_reach),
        Id::PostureFeedback | Id::HeadingFeedback | Id::Gait => return Err(unknown(id)),
    })
}

/// true or false.
pub fn flag(id: u32, walker: &Walker, command: &Command) -> Result<bool> {
    if (STANCES.0..STANCES.1).contains(&id) {
        let foot = &walker.feet[(id - STANCES.0) as usize];
        return Ok(!foot.airborne && !foot.searching);
    }
    match Id::of(id)? {
        Id::PostureFeedback => Ok(command.posture_feedback),
        Id::HeadingFeedback => Ok(command.heading_feedback),
        _ => Err(unknown(id)),
    }
}

/// Number of an enumeration's value.
pub fn choice(id: u32, command: &Command) -> Result<i64> {
    match Id::of(id)? {
        Id::Gait => Ok(command.pattern as i64),
        _ => Err(unknown(id)),
    }
}

/// The leg whose force a variable is.
fn force(id: u32) -> Option<usize> {
    (FORCES.0..FORCES.1).contains(&id).then(|| (id - FORCES.0) as usize)
}

/// Writes a number into the command.
pub fn set_number(id: u32, value: f64, command: &mut Command, table: &[Variable]) -> Result {
    if let Some(leg) = force(id) {
        if !value.is_finite() {
            let name = LEG_NAMES[leg];
            return Err(Error::Refused(format!("`{name}.contact_force` = {value} is not a finite number")));
        }
        command.contact[leg] = Some(value);
        return Ok(());
    }
    let place = match Id::of(id)? {
        Id::Roll => &mut command.attitude[0],
        Id::Pitch => &mut command.attitude[1],
        Id::Yaw => &mut command.attitude[2],
        Id::Speed => &mut command.speed,
        Id::TurnRate => &mut command.turn_rate,
        Id::Heading => &mut command.heading,
        Id::Lift => &mut command.lift,
        _ => return Err(unknown(id)),
    };
    let bounds = table.iter().find(|v| v.id == id).ok_or_else(|| unknown(id))?;
    if !value.is_finite() || value < bounds.min || value > bounds.max {
        return Err(Error::Refused(format!(
            "`{}` = {value} is outside {} … {}",
            bounds.name, bounds.min, bounds.max
        )));
    }
    *place = value;
    Ok(())
}

/// Writes true or false into the command.
pub fn set_flag(id: u32, value: bool, command: &mut Command) -> Result {
    match Id::of(id)? {
        Id::PostureFeedback => command.posture_feedback = value,
        Id::HeadingFeedback => command.heading_feedback = value,
        _ => return Err(unknown(id)),
    }
    Ok(())
}

/// Writes an enumeration's value into the command.
pub fn set_choice(id: u32, value: i64, command: &mut Command) -> Result {
    let pattern = usize::try_from(value).ok().and_then(|v| Pattern::ALL.get(v));
    match (Id::of(id)?, pattern) {
        (Id::Gait, Some(pattern)) => command.pattern = *pattern,
        (Id::Gait, None) => {
            return Err(Error::Refused(format!("`gait` = {value} is none of 0 … {}", NAMES.len() - 1)));
        }
        _ => return Err(unknown(id)),
    }
    Ok(())
}

fn unknown(id: u32) -> Error {
    Error::Refused(format!("no variable of this type has the number {id}, or it cannot be set"))
}
