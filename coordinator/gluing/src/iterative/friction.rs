//! Coulomb friction at a glued contact as a projection (Alart and Curnier 1991, eq. 3.9).
//!
//! T_t is the projection of τ = T_t − r·e_t onto the disc of radius μ·T_n. Inside the disc the contact sticks and the
//! row stays e_t = 0; outside it slips and the row becomes T_t − μ·T_n·τ/|τ| = 0. Its derivative couples T_t to
//! T_n but not T_n to T_t: Λ is not symmetric. Rows are divided by r, so that all rows stay in metres.

use terraglue_subsystem::Port;

/// Turns the tangential rows of a port, still e_t and de_t/dT (row-major), into those of the projection.
pub fn project(port: &Port, t: &[f64], e: &mut [f64], matrix: &mut [f64]) {
    let n = t.len();
    let normal = port.first as usize;
    let rows = normal + 1..(normal + port.len()).min(normal + 3);
    let compliance = rows.clone().map(|i| matrix[i * n + i]).fold(0.0, f64::max);
    if compliance <= 0.0 {
        return;
    }
    let r = 1.0 / compliance;
    let radius = port.law.mu * t[normal].max(0.0);
    let mut tau = [0.0; 2];
    for (k, i) in rows.clone().enumerate() {
        tau[k] = t[i] - r * e[i];
    }
    let size = (tau[0] * tau[0] + tau[1] * tau[1]).sqrt();
    if size <= radius {
        return;
    }
    let along = tau.map(|x| x / size);
    let share = radius / size;
    let loaded = f64::from(u8::from(t[normal] > 0.0));
    for column in 0..n {
        // d(e_t)/dT of this column, before any row is overwritten
        let mut change = [0.0; 2];
        for (k, i) in rows.clone().enumerate() {
            change[k] = f64::from(u8::from(i == column)) - r * matrix[i * n + column];
        }
        let radial = along[0] * change[0] + along[1] * change[1];
        for (k, i) in rows.clone().enumerate() {
            let own = f64::from(u8::from(i == column));
            let rim = if column == normal { port.law.mu * loaded * along[k] } else { 0.0 };
            matrix[i * n + column] = (own - rim - share * (change[k] - along[k] * radial)) / r;
        }
    }
    for (k, i) in rows.enumerate() {
        e[i] = (t[i] - radius * along[k]) / r;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use terraglue_subsystem::{Law, PortKind, component};

    /// The row's derivative against differences of the row, at a slipping state with a full G.
    #[test]
    fn the_derivative_is_that_of_the_projection() {
        let port = Port {
            key: 0,
            kind: PortKind::Contact as u32,
            side: 1,
            mask: component::FORCE,
            first: 0,
            body: 0,
            shape: 0,
            first_node: 0,
            node_count: 0,
            origin: [0.0; 3],
            frame: [0.0; 9],
            extent: [0.0; 2],
            law: Law { mu: 0.4, ..Law::UNILATERAL },
        };
        let g = [2.0, 0.3, 0.1, 0.3, 1.5, 0.2, 0.1, 0.2, 1.5];
        let at = |t: &[f64; 3]| {
            let mut e: Vec<f64> = (0..3)
                .map(|i| [0.1, 0.9, -0.7][i] + (0..3).map(|j| g[3 * i + j] * t[j]).sum::<f64>())
                .collect();
            let mut matrix = g.to_vec();
            project(&port, t, &mut e, &mut matrix);
            (e, matrix)
        };
        let t = [2.0, 0.5, 0.4];
        let (e, matrix) = at(&t);
        for column in 0..3 {
            let mut moved = t;
            moved[column] += 1e-7;
            let (next, _) = at(&moved);
            for row in 0..3 {
                let difference = (next[row] - e[row]) / 1e-7;
                assert!((difference - matrix[3 * row + column]).abs() < 1e-5, "{row} {column}");
            }
        }
    }
}
