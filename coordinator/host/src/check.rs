//! Finds values that a subsystem left NaN or infinite, with their places.

use terraglue_subsystem::Step;

/// Names of the components of a port.
const COMPONENTS: [&str; 6] = ["n", "t1", "t2", "mn", "mt1", "mt2"];

/// Error of the first entry of a packed vector that is not finite.
pub(super) fn packed(step: &Step, vector: &str, values: &[f64]) -> Option<String> {
    let k = values.iter().position(|v| !v.is_finite())?;
    let port = step.ports.iter().enumerate().find(|(_, p)| p.range().contains(&k));
    let place = match port {
        None => format!("entry {k}"),
        Some((number, port)) => {
            let component = port.components().find(|(i, _)| *i == k).map_or("?", |(_, c)| COMPONENTS[c]);
            format!("component {component} of port {number} (key {:#x})", port.key)
        }
    };
    Some(format!("{vector} is {} at {place}; every component must be answered", values[k]))
}

/// Error of the first entry of an n × n column-major matrix that is not finite.
pub(super) fn matrix(n: usize, name: &str, values: &[f64]) -> Option<String> {
    let k = values.iter().position(|v| !v.is_finite())?;
    Some(format!("{name} is {} in row {}, column {}", values[k], k % n, k / n))
}

#[cfg(test)]
mod tests {
    use super::*;
    use terraglue_subsystem::{Law, Port, component};

    #[test]
    fn the_place_is_named() {
        let port = |key, first, mask| Port {
            key,
            kind: 0,
            side: 1,
            mask,
            first,
            body: 0,
            shape: 0,
            first_node: 0,
            node_count: 0,
            origin: [0.0; 3],
            frame: [0.0; 9],
            extent: [0.0; 2],
            law: Law::UNILATERAL,
        };
        let ports = [port(7, 0, component::FORCE), port(42, 3, component::N | component::MT1)];
        let step = Step { ports: &ports, n: 5, ..Step::free(0.0, 1e-3, 0) };
        assert_eq!(packed(&step, "x", &[0.0; 5]), None);
        let text = packed(&step, "x", &[0.0, 0.0, 0.0, 0.0, f64::NAN]).expect("found");
        assert!(text.starts_with("x is NaN at component mt1 of port 1 (key 0x2a)"), "{text}");
        let text = matrix(2, "G", &[0.0, 0.0, f64::INFINITY, 0.0]).expect("found");
        assert_eq!(text, "G is inf in row 0, column 1");
    }
}
