//! DC motor behind a gear.
//!
//! V = R·i + L·di/dt + k·ω_m, τ_m = k·i, ω_m = N·u (e.g. Leonhard, Control of Electrical Drives, ch. 5), implicit in the
//! step: i⁺ = (L/h·i + V − k·N·u)/(R + L/h), so the electrical time constant may be far below the step. The
//! controller asks for the current i* = τ*/(N·k) of the torque law and gets it within what the supply (|V| ≤ V_max) and
//! the current limit allow. The gear loses (1 − η)·power in either direction: τ = η_driving·N·τ_m where the motor
//! drives the joint, τ = N·τ_m/η_driven where the joint drives the motor; at rest anything between the two.

use super::curve::{Curve, Line, Tag, at_rest};
use super::{Actuator, Drivetrain, Item};
use crate::motor::Motor;
use crate::state::JointState;

/// Temperature at which the resistance is given, K.
const REFERENCE_K: f64 = 293.15;
/// The current limit falls to 0 over this range below the largest temperature, K.
const DERATING_K: f64 = 10.0;

/// Resistance of the winding at its temperature, Ω.
pub(crate) fn resistance(a: &Actuator) -> f64 {
    let change = 1.0 + a[Item::ResistanceTemperature] * (a.winding_k - REFERENCE_K);
    // Above the coldest that copper gets before its law bends (about 60 K).
    a[Item::Resistance] * change.max(0.1)
}

/// Largest current at the winding's temperature, A.
fn largest_current(a: &Actuator) -> f64 {
    let share = ((a[Item::MaxWindingTemperature] - a.winding_k) / DERATING_K).clamp(0.0, 1.0);
    share * a[Item::MaxCurrent]
}

/// Largest voltage at the terminals, V.
pub(crate) fn largest_voltage(a: &Actuator, supply_v: f64) -> f64 {
    a[Item::MaxVoltage].min(supply_v)
}

/// Whether torque comes without a winding in between.
pub(crate) fn is_ideal(j: &JointState) -> bool {
    j.actuator.kind != Drivetrain::Dc || j.motor == Motor::Off
}

/// The law of a motor (impulse at the joint) as the drive train lets it through.
pub(crate) fn through_winding(law: Curve, j: &JointState, supply_v: f64, h: f64) -> Curve {
    let a = &j.actuator;
    if is_ideal(j) {
        return law;
    }
    let (gear, k, l) = (a[Item::GearRatio], a[Item::TorqueConstant], a[Item::Inductance] / h);
    let impedance = resistance(a) + l;
    let to_impulse = h * gear * k;
    // Current against rate at a voltage.
    let at_voltage = |v: f64| Line { at_zero: (l * a.current + v) / impedance, slope: gear * k / impedance };
    let v_max = largest_voltage(a, supply_v);
    let current = if j.motor == Motor::Voltage {
        let tag = if a.voltage_target.abs() >= v_max { Tag::SupplyHigh } else { Tag::Law };
        Curve::line(at_voltage(a.voltage_target.clamp(-v_max, v_max)), tag)
    } else {
        law.times(1.0 / to_impulse)
            .at_most(at_voltage(v_max), Tag::SupplyHigh)
            .at_least(at_voltage(-v_max), Tag::SupplyLow)
    };
    let i_max = largest_current(a);
    let current =
        current.at_most(Line::level(i_max), Tag::CurrentHigh).at_least(Line::level(-i_max), Tag::CurrentLow);
    let (driving, driven) = (a[Item::EfficiencyDriving], a[Item::EfficiencyDriven]);
    let impulse = current.times(to_impulse);
    if driving == 1.0 && driven == 1.0 {
        return impulse;
    }
    impulse.through_gear(|drives| if drives { driving } else { 1.0 / driven })
}

/// Current of the winding that gives the torque τ at the joint at the rate u, A. At rest the gear leaves a range;
/// of it the smallest current.
pub(crate) fn current(a: &Actuator, torque: f64, u: f64) -> f64 {
    let lossless = torque / (a[Item::GearRatio] * a[Item::TorqueConstant]);
    let (driving, driven) = (1.0 / a[Item::EfficiencyDriving], a[Item::EfficiencyDriven]);
    if at_rest(u) || torque * u < 0.0 { lossless * driven } else { lossless * driving }
}
