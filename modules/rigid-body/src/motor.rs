//! The ways in which the motor of a joint can be driven.

/// Control mode of the motor of a joint. The numbers are the values of the variable `motor`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Motor {
    Off,
    Position,
    Velocity,
    Torque,
    RigidPosition,
    Voltage,
    /// PD from the state at the start of the step, as a controller outside would compute it.
    ExplicitPosition,
}

impl Motor {
    pub const NAMES: [&'static str; 7] =
        ["off", "position", "velocity", "torque", "rigid-position", "voltage", "explicit-position"];
    const ALL: [Self; 7] = [
        Self::Off,
        Self::Position,
        Self::Velocity,
        Self::Torque,
        Self::RigidPosition,
        Self::Voltage,
        Self::ExplicitPosition,
    ];

    pub fn from_index(i: i64) -> Option<Self> {
        usize::try_from(i).ok().and_then(|i| Self::ALL.get(i).copied())
    }

    pub fn from_name(name: &str) -> Option<Self> {
        Self::NAMES.iter().position(|n| *n == name).map(|i| Self::ALL[i])
    }

    pub fn index(self) -> i64 {
        self as i64
    }
}

terraglue_subsystem::persist!(
    enum Motor {
        Off,
        Position,
        Velocity,
        Torque,
        RigidPosition,
        Voltage,
        ExplicitPosition,
    }
);
