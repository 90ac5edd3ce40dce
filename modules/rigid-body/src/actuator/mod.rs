//! Actuators: the chain from a command to the torque at a joint, and its energy.
//!
//! | file | what |
//! |---|---|
//! | `curve` | monotone relation between impulse and rate, of which every drive is made |
//! | `settings` | all data of an actuator: key, unit, range, default, help |
//! | `winding` | DC motor and gear: current, voltage, efficiency both ways |
//! | `friction` | Coulomb friction that sticks exactly, LuGre friction |
//! | `thermal` | winding, housing, ambient |
//! | `battery` | supply of all motors of a robot |
//! | `ledger` | power and energy of an actuator |
//! | `configure` | from the scenario: presets and patterns |
//!
//! The one knob is `max_torque`: it bounds the torque at the joint whatever drives it.

pub(crate) mod battery;
pub(crate) mod configure;
pub(crate) mod curve;
pub(crate) mod energy_ledger;
pub(crate) mod friction;
pub(crate) mod settings;
mod thermal;
pub(crate) mod winding;

pub(crate) use settings::{Item, SETTINGS, Setting};
use std::ops::Index;

/// Relation of electrical to mechanical power.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Drivetrain {
    /// Gives any torque at any rate without a loss.
    Ideal,
    /// The same for the bodies; its current is a formula of torque and rate.
    CurrentFormula,
    /// A DC motor behind a gear.
    Dc,
}

impl Drivetrain {
    pub const NAMES: [&'static str; 3] = ["ideal", "current-formula", "dc"];

    pub fn from_name(name: &str) -> Option<Self> {
        let i = Self::NAMES.iter().position(|n| *n == name)?;
        [Self::Ideal, Self::CurrentFormula, Self::Dc].get(i).copied()
    }
}

/// Data and memory of an actuator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Actuator {
    pub kind: Drivetrain,
    pub settings: [f64; SETTINGS.len()],
    /// Voltage that is commanded in the mode `voltage`, V.
    pub voltage_target: f64,
    /// Winding current and terminal voltage, A and V; of the supply where there is no winding.
    pub current: f64,
    pub voltage: f64,
    /// Temperatures, K.
    pub winding_k: f64,
    pub housing_k: f64,
    /// Deflection of the bristles (LuGre), rad or m.
    pub bristle: f64,
    /// Rate at the end of the last step, rad/s or m/s.
    pub rate: f64,
    /// Whether friction held the joint in the last step.
    pub stuck: bool,
    pub ledger: energy_ledger::EnergyLedger,
}

impl Default for Actuator {
    fn default() -> Self {
        Self {
            kind: Drivetrain::Ideal,
            settings: SETTINGS.map(|s: Setting| s.default),
            voltage_target: 0.0,
            current: 0.0,
            voltage: 0.0,
            winding_k: SETTINGS[Item::AmbientTemperature as usize].default,
            housing_k: SETTINGS[Item::AmbientTemperature as usize].default,
            bristle: 0.0,
            rate: 0.0,
            stuck: true,
            ledger: energy_ledger::EnergyLedger::default(),
        }
    }
}

impl Index<Item> for Actuator {
    type Output = f64;

    fn index(&self, item: Item) -> &f64 {
        &self.settings[item as usize]
    }
}

impl Actuator {
    /// Inertia along the axis besides that of the bodies: armature and geared rotor, kg m².
    pub fn inertia(&self) -> f64 {
        let gear = self[Item::GearRatio];
        self[Item::Armature] + gear * gear * self[Item::RotorInertia]
    }

    /// Energy stored in spring and armature at a coordinate and rate, J.
    pub fn stored(&self, angle: f64) -> (f64, f64) {
        let stretch = angle - self[Item::SpringReference];
        let spring = 0.5 * self[Item::SpringStiffness] * stretch * stretch;
        (spring, 0.5 * self.inertia() * self.rate * self.rate)
    }

    /// Everything stops: the joint is broken.
    pub fn stop(&mut self) {
        (self.current, self.voltage, self.bristle, self.rate, self.stuck) = (0.0, 0.0, 0.0, 0.0, false);
        self.ledger.rest();
    }
}

terraglue_subsystem::persist!(
    enum Drivetrain {
        Ideal,
        CurrentFormula,
        Dc,
    }
);
terraglue_subsystem::persist!(Actuator {
    kind,
    settings,
    voltage_target,
    current,
    voltage,
    winding_k,
    housing_k,
    bristle,
    rate,
    stuck,
    ledger,
});
