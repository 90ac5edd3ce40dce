//! Power and energy of an actuator: from the solution of a step to current, voltage, heat and joules.
//!
//! Electrical energy = mechanical work + heat + change of ½·L·i². Work is the motor's impulse times the mean rate
//! before and after it, so that it agrees with the kinetic energy of the bodies to rounding; the power of the back-EMF
//! is taken at the end of the step as the implicit winding has it. Their difference, ½·λ·(u⁺ − u⁻), is the damping of
//! the scheme, of first order in h, and counts as heat.

use super::battery::Draw;
use super::curve::at_rest;
use super::{Actuator, Drivetrain, Item, friction, thermal, winding};
use crate::drive::Shares;

/// Powers of the last step (W) and energies since the start (J).
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub(crate) struct EnergyLedger {
    pub power: f64,
    pub electrical_power: f64,
    /// Torque of friction, end stop and brake in the last step, N m.
    pub friction: f64,
    pub stop: f64,
    /// Mechanical work of the motor, signed.
    pub work: f64,
    /// Drawn from the supply.
    pub electrical: f64,
    /// R·i² of the winding.
    pub winding_heat: f64,
    /// Lost in the gear.
    pub gear_heat: f64,
    /// Everything that went in and neither came out nor is stored.
    pub heat: f64,
    /// Lost in friction and viscous friction at the joint.
    pub friction_heat: f64,
}

impl EnergyLedger {
    /// No power.
    pub fn rest(&mut self) {
        (self.power, self.electrical_power, self.friction, self.stop) = (0.0, 0.0, 0.0, 0.0);
    }
}

/// The solution of a step along the axis.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Outcome {
    pub shares: Shares,
    /// Rate at the end, and mean of the rates before and after the impulses.
    pub rate: f64,
    pub mean_rate: f64,
    /// Whether the voltage of the supply limits the motor.
    pub starved: bool,
    pub motor_off: bool,
}

impl Actuator {
    /// Energies count from here on. Energy held by the winding counts as drawn, so that giving it back is no gain.
    pub fn restart_ledger(&mut self) {
        let EnergyLedger { power, electrical_power, friction, stop, .. } = self.ledger;
        let electrical = 0.5 * self[Item::Inductance] * self.current * self.current;
        self.ledger =
            EnergyLedger { power, electrical_power, friction, stop, electrical, ..EnergyLedger::default() };
    }

    /// Advances the actuator by a step of length h at the voltage of the supply; adds to the energy drawn from it.
    pub fn commit(&mut self, o: &Outcome, supply_v: f64, h: f64, draw: &mut Draw) {
        let torque = o.shares.motor / h;
        let work = o.shares.motor * o.mean_rate;
        let lost = -(o.shares.friction + o.shares.damper) * o.mean_rate;
        let bristle = (self[Item::BristleStiffness] > 0.0).then(|| friction::bristle_after(self, h, o.rate));
        let asked = match self.kind {
            Drivetrain::Ideal => {
                (self.current, self.voltage) = (0.0, 0.0);
                work
            }
            Drivetrain::CurrentFormula => {
                self.voltage = supply_v;
                self.current = self.formula(torque, o.rate);
                self.voltage * self.current * h
            }
            Drivetrain::Dc => self.winding_step(o, torque, supply_v, h),
        };
        let electrical = if asked < 0.0 { self[Item::Recuperation].min(1.0) * asked } else { asked };
        let b = &mut self.ledger;
        (b.power, b.electrical_power) = (work / h, electrical / h);
        (b.friction, b.stop) = (o.shares.friction / h, o.shares.stop / h);
        b.work += work;
        b.electrical += electrical;
        b.friction_heat += lost;
        let stored = 0.5 * self[Item::Inductance] * self.current * self.current;
        self.ledger.heat = self.ledger.electrical - self.ledger.work - stored;
        if let Some(bristle) = bristle {
            self.bristle = bristle;
        }
        (self.rate, self.stuck) = (o.rate, at_rest(o.rate));
        draw.power += electrical / h;
        if o.starved && self.kind == Drivetrain::Dc {
            draw.starved += electrical / h;
            draw.conductance += 1.0 / (winding::resistance(self) + self[Item::Inductance] / h);
        }
    }

    /// I(τ, ω) = c0·|τ·ω| + c1·|τ| + c2·|ω| + c3.
    fn formula(&self, torque: f64, rate: f64) -> f64 {
        self[Item::FormulaPower] * (torque * rate).abs()
            + self[Item::FormulaTorque] * torque.abs()
            + self[Item::FormulaRate] * rate.abs()
            + self[Item::FormulaIdle]
    }

    /// Current, voltage and temperatures of the winding after the step; its electrical energy, J.
    fn winding_step(&mut self, o: &Outcome, torque: f64, supply_v: f64, h: f64) -> f64 {
        let before = self.current;
        let current = if o.motor_off { 0.0 } else { winding::current(self, torque, o.rate) };
        let r = winding::resistance(self);
        let emf = self[Item::TorqueConstant] * self[Item::GearRatio] * o.rate;
        let wanted = r * current + self[Item::Inductance] * (current - before) / h + emf;
        // A current that is switched off at once would ask for more: that goes into the switch.
        let most = winding::largest_voltage(self, supply_v);
        self.voltage = wanted.clamp(-most, most);
        self.current = current;
        let heat = r * current * current * h;
        self.ledger.winding_heat += heat;
        self.ledger.gear_heat += emf * current * h - o.shares.motor * o.rate;
        thermal::advance(self, heat / h, h);
        self.voltage * current * h
    }
}

terraglue_subsystem::persist!(EnergyLedger {
    power,
    electrical_power,
    friction,
    stop,
    work,
    electrical,
    winding_heat,
    gear_heat,
    heat,
    friction_heat,
});
