//! Two heat capacities in a row: winding → housing → ambient.
//!
//! C_w·dT_w/dt = P − (T_w − T_h)/R_wh, C_h·dT_h/dt = (T_w − T_h)/R_wh − (T_h − T_a)/R_ha (the usual two-body model of
//! motor catalogues, e.g. maxon, "Motor data and simulation"), by implicit Euler: stable for any step, and the heat
//! that goes in is the heat that is stored plus the heat that leaves.

use super::{Actuator, Item};

/// Advances both temperatures by h under the power P, W, in the winding.
pub(crate) fn advance(a: &mut Actuator, power: f64, h: f64) {
    let (cw, ch) = (a[Item::WindingCapacity] / h, a[Item::HousingCapacity] / h);
    if cw <= 0.0 {
        return;
    }
    let (inner, outer) = (1.0 / a[Item::WindingHousing], 1.0 / a[Item::HousingAmbient]);
    let right = [cw * a.winding_k + power, ch * a.housing_k + outer * a[Item::AmbientTemperature]];
    let (a11, a22) = (cw + inner, ch + inner + outer);
    let determinant = a11 * a22 - inner * inner;
    a.winding_k = (a22 * right[0] + inner * right[1]) / determinant;
    a.housing_k = (inner * right[0] + a11 * right[1]) / determinant;
}
