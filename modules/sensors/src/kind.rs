//! Which sensor it is: its channels, their names and units.

use terraglue_subsystem::{Causality, ValueType, Variable};

/// Most channels of a sensor.
pub(crate) const MOST: usize = 6;
/// First id of the outputs; inputs count from 0.
pub(crate) const OUTPUT: u32 = 16;

/// A sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SensorKind {
    /// Specific force and angular rate of a body, in the axes of the sensor.
    Imu,
    /// Roll and pitch of a body against gravity.
    Inclinometer,
    /// Distance along its axis x to the first surface.
    RangeFinder,
    /// Coordinate of a joint.
    JointEncoder,
    /// Force and moment on a foot.
    FootForce,
    /// Whether a foot presses.
    ContactSwitch,
}

impl SensorKind {
    /// All kinds.
    pub const ALL: [Self; 6] = [
        Self::Imu,
        Self::Inclinometer,
        Self::RangeFinder,
        Self::JointEncoder,
        Self::FootForce,
        Self::ContactSwitch,
    ];

    /// The kind of this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }

    /// Its name in a scenario.
    pub fn name(self) -> &'static str {
        match self {
            Self::Imu => "imu",
            Self::Inclinometer => "inclinometer",
            Self::RangeFinder => "range-finder",
            Self::JointEncoder => "joint-encoder",
            Self::FootForce => "foot-force",
            Self::ContactSwitch => "contact-switch",
        }
    }

    /// Whether it sits on a body and looks at the world.
    pub fn is_mounted(self) -> bool {
        matches!(self, Self::Imu | Self::Inclinometer | Self::RangeFinder)
    }

    /// Names and units of its channels; those from the fourth on have errors of their own.
    pub(crate) fn channels(self) -> &'static [(&'static str, &'static str)] {
        match self {
            Self::Imu => &[
                ("acceleration_x", "m/s^2"),
                ("acceleration_y", "m/s^2"),
                ("acceleration_z", "m/s^2"),
                ("rate_x", "rad/s"),
                ("rate_y", "rad/s"),
                ("rate_z", "rad/s"),
            ],
            Self::Inclinometer => &[("roll", "rad"), ("pitch", "rad")],
            Self::RangeFinder => &[("distance", "m")],
            Self::JointEncoder => &[("angle", "rad")],
            Self::FootForce => &[
                ("force_x", "N"),
                ("force_y", "N"),
                ("force_z", "N"),
                ("moment_x", "N m"),
                ("moment_y", "N m"),
                ("moment_z", "N m"),
            ],
            Self::ContactSwitch => &[("force", "N")],
        }
    }

    /// Name of the output that is true or false.
    pub(crate) fn switch(self) -> Option<&'static str> {
        match self {
            Self::RangeFinder => Some("hit"),
            Self::ContactSwitch => Some("contact"),
            _ => None,
        }
    }

    /// All variables, in ascending order of id.
    pub(crate) fn variables(self) -> Vec<Variable> {
        let mut all = Vec::new();
        if !self.is_mounted() {
            for (k, (name, unit)) in self.channels().iter().enumerate() {
                let (id, name) = (k as u32, format!("true_{name}"));
                all.push(Variable::real(id, name, unit, Causality::Input, "The measured quantity"));
            }
        }
        // a switch shows no number
        let numbers = if self == Self::ContactSwitch { &[] } else { self.channels() };
        for (k, (name, unit)) in numbers.iter().enumerate() {
            all.push(Variable::real(
                OUTPUT + k as u32,
                *name,
                unit,
                Causality::Output,
                "Reading of the sensor",
            ));
        }
        if let Some(name) = self.switch() {
            let id = OUTPUT + MOST as u32;
            let help =
                if self == Self::ContactSwitch { "Whether it presses" } else { "Whether there is a surface" };
            all.push(Variable::real(id, name, "", Causality::Output, help).typed(ValueType::Bool));
        }
        all
    }
}
