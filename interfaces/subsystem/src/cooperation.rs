//! The plain co-operational pass: T1 from the rigid estimate T* and the force F of the soil's law.
//!
//! Rossmann, Jung and Rast (2010), section IV B, step 3, made reactive: the soil never pushes harder than the
//! rigid estimate asks for (no rebound at any stiffness) and never harder than its law allows.

use crate::port::Port;

/// T1 of one port. `t_star`, `law_wrench` and `t1` are packed over all ports; `shear_strength` is the largest
/// tangential force of the law at its full normal force (N), `mu` bounds it further by Coulomb.
///
/// T1_n = min(T*_n, F_n, t_max) ≥ 0. The soil's whole wrench is scaled with T1_n/F_n. The tangential force has
/// the direction of the estimate, so it can stop the slip and never reverses it; moments are clipped by those
/// of the estimate likewise.
pub fn plain_pass(
    port: &Port,
    t_star: &[f64],
    law_wrench: &[f64],
    shear_strength: f64,
    mu: f64,
    t1: &mut [f64],
) {
    let first = port.first as usize;
    let f_n = law_wrench[first].min(port.law.t_max).max(0.0);
    let t_n = t_star[first].min(f_n).max(0.0);
    if t_n == 0.0 {
        t1[port.range()].fill(0.0);
        return;
    }
    let scale = t_n / f_n;
    let bound = (shear_strength * scale).min(mu * t_n);
    let wanted = tangential_norm(port, t_star);
    let share = if wanted > bound { bound / wanted } else { 1.0 };
    for (i, c) in port.components() {
        t1[i] = match c {
            0 => t_n,
            1 | 2 => share * t_star[i],
            _ => (law_wrench[i].abs() * scale).min(t_star[i].abs()).copysign(t_star[i]),
        };
    }
}

/// Magnitude of the tangential force of a packed wrench, N.
pub fn tangential_norm(port: &Port, t: &[f64]) -> f64 {
    let squares: f64 = port.components().filter(|(_, c)| *c == 1 || *c == 2).map(|(i, _)| t[i] * t[i]).sum();
    squares.sqrt()
}
