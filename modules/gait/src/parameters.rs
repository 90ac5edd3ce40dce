//! Parameters of the module: the schema that the host checks a scenario against, and the checked values.

use crate::command::Command;
use crate::foot::{Search, Swing, TouchDown};
use crate::geometry::{LEGS, Leg};
use crate::pattern::{NAMES, Pattern};
use crate::posture::Gains;
use std::f64::consts::FRAC_PI_2;
use terraglue_subsystem::{Config, Error, Kind, Mount, Parameter, ParameterType, Result, Schema};

/// Constants of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Legs in the order of [`crate::geometry::LEG_NAMES`].
    pub legs: [Leg; LEGS],
    /// Middle of the stance of each foot in the body frame, m.
    pub neutral: [[f64; 2]; LEGS],
    /// Height of the hips above the foot centres, m.
    pub body_height: f64,
    /// Longest way of a foot on the ground in the body frame, m: the parameter or the reach of the legs.
    pub stride_limit: f64,
    /// In which frame a swing begins and ends at rest.
    pub swing: Swing,
    /// When a swing ends.
    pub touch_down: TouchDown,
    /// Time of standing at the start, s.
    pub stand_s: f64,
    /// Time in which the speed grows from zero, s.
    pub ramp_s: f64,
    /// Largest change of the commanded speed, m/s².
    pub acceleration: f64,
    /// Largest change of the turn rate, rad/s².
    pub turn_acceleration: f64,
    /// Feedback.
    pub gains: Gains,
    /// Whether it knows the body that it walks by name, to show something in its frame.
    pub mounted: bool,
    cycle_s: Option<f64>,
    duty: Option<f64>,
}

impl Settings {
    /// Duration of a cycle, s.
    pub fn cycle_s(&self, pattern: Pattern) -> f64 {
        self.cycle_s.unwrap_or(pattern.cycle_s())
    }

    /// Part of the cycle on the ground.
    pub fn duty(&self, pattern: Pattern) -> f64 {
        self.duty.unwrap_or(pattern.duty())
    }
}

/// Name, kind and parameters of the module.
pub fn schema() -> Schema {
    let mut parameters = commands();
    parameters.extend(ground());
    parameters.extend(geometry());
    parameters.extend(feedback());
    let help =
        "Body that it walks, SUBSYSTEM.BODY, in whose frame it shows overlays; none are shown without it";
    parameters.push(Parameter::of(Mount::KEY, ParameterType::Text, help).optional());
    Schema {
        name: "gait".into(),
        kind: Kind::Controller,
        help: "Six legs of four joints: tripod, ripple and wave gait with speed, turn rate and heading"
            .into(),
        parameters,
    }
}

fn commands() -> Vec<Parameter> {
    let number = Parameter::number;
    vec![
        Parameter::of("gait", ParameterType::Text, "Pattern in which the legs follow each other")
            .or("tripod")
            .choices(&NAMES),
        number("speed_m_s", "m/s", 0.15, "Commanded forward speed").within(-2.0, 2.0),
        number("turn_rate_rad_s", "rad/s", 0.0, "Commanded turn rate, left positive").within(-2.0, 2.0),
        number("heading_rad", "rad", 0.0, "Heading in the world that is held, from +x towards +y"),
        number("lift_m", "m", 0.08, "Height of the swing of a foot").within(0.0, 0.2),
        Parameter::of("swing", ParameterType::Text, "A foot lifts and lands at rest relative to this")
            .or("ground")
            .choices(&["ground", "body"]),
        Parameter::of("cycle_s", ParameterType::Number, "Duration of a cycle; silent: 1.2, 1.8, 3 by gait")
            .optional()
            .positive(),
        Parameter::of("duty", ParameterType::Number, "Part of the cycle on the ground; silent: by gait")
            .optional()
            .within(0.5, 0.95),
        number("stride_max_m", "m", 0.24, "Longest way of a foot on the ground; speed is cut to it")
            .positive(),
        number("stand_s", "s", 0.5, "Time of standing at the start").within(0.0, f64::INFINITY),
        number("ramp_s", "s", 1.0, "Time in which the speed grows from zero").positive(),
        number("acceleration_m_s2", "m/s^2", 0.3, "Largest change of the speed").positive(),
        number("turn_acceleration_rad_s2", "rad/s^2", 0.6, "Largest change of the turn rate").positive(),
    ]
}

fn ground() -> Vec<Parameter> {
    let number = Parameter::number;
    vec![
        Parameter::of(
            "touch_down",
            ParameterType::Text,
            "End of a swing: by the force on the foot, or by the time",
        )
        .or("contact")
        .choices(&["contact", "time"]),
        number(
            "touch_share",
            "1",
            0.3,
            "A foot stands from this share of the mean load of one of six feet on",
        )
        .within(0.0, 1.0),
        number("search_m", "m", 0.04, "How far below the plane of the standing feet a foot looks for ground")
            .within(0.0, 0.2),
        number("search_speed_m_s", "m/s", 0.1, "Speed at which it looks further down").positive(),
        number("levelling_s", "s", 0.5, "Time constant of the body's height above the standing feet")
            .positive(),
    ]
}

fn geometry() -> Vec<Parameter> {
    let number = Parameter::number;
    vec![
        Parameter::of("links_m", ParameterType::Numbers, "Lengths of the four links from the hip outwards")
            .or(vec![0.06, 0.10, 0.20, 0.30]),
        number("hip_x_m", "m", 0.35, "Front hips before and rear hips behind the body's origin").positive(),
        number("hip_y_m", "m", 0.2, "Hips beside the body's origin").within(0.0, f64::INFINITY),
        number("foot_y_m", "m", 0.5, "Standing feet beside the body's origin").positive(),
        number("body_height_m", "m", 0.3, "Hips above the centres of the standing feet").positive(),
    ]
}

fn feedback() -> Vec<Parameter> {
    let number = Parameter::number;
    vec![
        Parameter::of("posture_feedback", ParameterType::Bool, "Whether tilt corrects the feet").or(true),
        Parameter::of("heading_feedback", ParameterType::Bool, "Whether heading error turns the robot")
            .or(true),
        number("tilt_gain", "1", 0.3, "Tilt of the plane of the feet per tilt of the body").within(0.0, 2.0),
        number("tilt_integral_gain_per_s", "1/s", 0.8, "The same per second").within(0.0, 20.0),
        number("tilt_limit_rad", "rad", 0.15, "Largest tilt of the plane of the feet").within(0.0, 0.5),
        number("tilt_smoothing_s", "s", 0.2, "Time constant of the smoothing of roll and pitch").positive(),
        number("heading_smoothing_s", "s", 0.2, "Time constant of the smoothing of the heading error")
            .positive(),
        number("heading_gain_per_s", "1/s", 0.8, "Turn rate per heading error").within(0.0, 20.0),
        number("heading_turn_limit_rad_s", "rad/s", 0.2, "Largest turn rate for the heading").positive(),
    ]
}

/// Checked values and the command at the start.
///
/// # Errors
/// `Refused` when a value has the wrong type or the standing feet are out of the legs' reach.
pub fn settings(config: &Config) -> Result<(Settings, Command)> {
    let config = config.clone().with_defaults(&schema());
    let number = |name: &str| config.number(name);
    let (legs, neutral) = legs(&config)?;
    let body_height = number("body_height_m")?;
    let gains = gains(&config)?;
    let reach = stride_reach(&legs[0], &gains, neutral[0], body_height)?;
    let settings = Settings {
        legs,
        neutral,
        body_height,
        stride_limit: number("stride_max_m")?.min(reach),
        swing: if config.text("swing")? == "body" { Swing::Body } else { Swing::Ground },
        touch_down: touch_down(&config)?,
        stand_s: number("stand_s")?,
        ramp_s: number("ramp_s")?,
        acceleration: number("acceleration_m_s2")?,
        turn_acceleration: number("turn_acceleration_rad_s2")?,
        gains,
        mounted: config.text(Mount::KEY).is_ok(),
        cycle_s: config.optional_number("cycle_s")?,
        duty: config.optional_number("duty")?,
    };
    Ok((settings, command(&config)?))
}

fn command(config: &Config) -> Result<Command> {
    let name = config.text("gait")?;
    let pattern = Pattern::named(name)
        .ok_or_else(|| Error::Refused(format!("`gait` = \"{name}\" is none of {}", NAMES.join(", "))))?;
    Ok(Command {
        speed: config.number("speed_m_s")?,
        turn_rate: config.number("turn_rate_rad_s")?,
        heading: config.number("heading_rad")?,
        lift: config.number("lift_m")?,
        pattern,
        posture_feedback: config.flag("posture_feedback")?,
        heading_feedback: config.flag("heading_feedback")?,
        attitude: [0.0; 3],
        contact: [None; LEGS],
    })
}

fn touch_down(config: &Config) -> Result<TouchDown> {
    if config.text("touch_down")? == "time" {
        return Ok(TouchDown::Time);
    }
    Ok(TouchDown::Contact(Search {
        share: config.number("touch_share")?,
        depth: config.number("search_m")?,
        speed: config.number("search_speed_m_s")?,
        levelling_s: config.number("levelling_s")?,
    }))
}

fn gains(config: &Config) -> Result<Gains> {
    Ok(Gains {
        smoothing_s: config.number("tilt_smoothing_s")?,
        tilt: config.number("tilt_gain")?,
        tilt_integral: config.number("tilt_integral_gain_per_s")?,
        tilt_limit: config.number("tilt_limit_rad")?,
        heading_smoothing_s: config.number("heading_smoothing_s")?,
        heading: config.number("heading_gain_per_s")?,
        turn_limit: config.number("heading_turn_limit_rad_s")?,
    })
}

fn legs(config: &Config) -> Result<([Leg; LEGS], [[f64; 2]; LEGS])> {
    let links = config.numbers("links_m")?;
    let links: [f64; 4] = links
        .try_into()
        .ok()
        .filter(|l: &[f64; 4]| l.iter().all(|v| *v > 0.0))
        .ok_or_else(|| Error::Refused("`links_m` must be four positive lengths".into()))?;
    let (hip_x, hip_y) = (config.number("hip_x_m")?, config.number("hip_y_m")?);
    let foot_y = config.number("foot_y_m")?;
    let place = |leg: usize| {
        let side = if leg < 3 { 1.0 } else { -1.0 };
        ([hip_x, 0.0, -hip_x][leg % 3], side)
    };
    let legs = std::array::from_fn(|leg| {
        let (x, side) = place(leg);
        Leg { hip: [x, side * hip_y, 0.0], yaw: side * FRAC_PI_2, links }
    });
    let neutral = std::array::from_fn(|leg| {
        let (x, side) = place(leg);
        [x, side * foot_y]
    });
    Ok((legs, neutral))
}

/// Longest stride that every leg can make at the height of standing, and at the heights that the correction of the
/// tilt may ask for, m.
fn stride_reach(leg: &Leg, gains: &Gains, neutral: [f64; 2], body_height: f64) -> Result<f64> {
    let outward = (neutral[1] - leg.hip[1]).abs();
    let slack = gains.tilt_limit * libm::hypot(neutral[0], neutral[1]);
    let standing = leg.inverse([neutral[0], neutral[1], -body_height]);
    if standing.clipped || outward <= 0.0 {
        return Err(Error::Refused(format!(
            "a foot {outward} m beside its hip and {body_height} m below it is out of reach of the legs; \
             change `foot_y_m`, `body_height_m` or `links_m`"
        )));
    }
    let at = |below: f64| leg.stride_reach(outward, below).map(|x| 2.0 * x);
    let tilted = [body_height - slack, body_height + slack].map(at);
    let level = at(body_height).unwrap_or(0.0);
    Ok(tilted.into_iter().flatten().fold(level, f64::min))
}
