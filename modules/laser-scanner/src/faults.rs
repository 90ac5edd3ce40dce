//! Faults and errors that can be changed while a run goes on: the live properties of the module.

use crate::errors::RayErrors;
use std::f64::consts::TAU;
use terraglue_subsystem::{Causality, Variable, persist};

/// Values of the live properties, in the order of their ids.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Faults {
    pub values: [f64; COUNT],
}
persist!(Faults { values });

/// Live properties.
pub(crate) const COUNT: usize = 9;
/// Names, units, bounds and help, in the order of their ids.
const ALL: [(&str, &str, [f64; 2], &str); COUNT] = [
    ("blind", "", [0.0, 1.0], "1: it sends nothing"),
    ("frozen", "", [0.0, 1.0], "1: it repeats the last turn"),
    ("blocked_from", "rad", [-TAU, TAU], "First azimuth of a sector in which something hides everything"),
    ("blocked_to", "rad", [-TAU, TAU], "Last azimuth of that sector; none where it is the first one"),
    ("bias_m", "m", [-10.0, 10.0], "Added to all ranges"),
    ("misaligned_yaw", "rad", [-1.0, 1.0], "By how much it is turned on its mount about z without knowing"),
    ("misaligned_pitch", "rad", [-1.0, 1.0], "By how much it looks down without knowing"),
    ("noise_m", "m", [0.0, 10.0], "Standard deviation of a range"),
    ("drop_out", "", [0.0, 1.0], "Probability that a ray is lost"),
];

impl Faults {
    /// None, with the errors of the parameters.
    pub fn of(errors: &RayErrors) -> Self {
        let mut values = [0.0; COUNT];
        (values[4], values[7], values[8]) = (errors.bias_m, errors.noise_m, errors.drop_out);
        Self { values }
    }

    /// The variables; ids count from 0.
    pub fn variables() -> Vec<Variable> {
        let one = |(id, (name, unit, [low, high], help)): (u32, (&str, &str, [f64; 2], &str))| {
            Variable::real(id, name, unit, Causality::Parameter, help).within(low, high)
        };
        (0..).zip(ALL).map(one).collect()
    }

    /// Bounds of a property.
    pub fn bounds(id: usize) -> [f64; 2] {
        ALL[id].2
    }

    pub fn is_blind(&self) -> bool {
        self.values[0] > 0.5
    }

    pub fn is_frozen(&self) -> bool {
        self.values[1] > 0.5
    }

    /// Whether an azimuth lies in the sector that is hidden.
    pub fn blocks(&self, azimuth: f64) -> bool {
        let [from, to] = [self.values[2], self.values[3]];
        from != to && (azimuth - from).rem_euclid(TAU) <= (to - from).rem_euclid(TAU)
    }

    /// Rotation vector by which it is turned on its mount.
    pub fn turn(&self) -> [f64; 3] {
        [0.0, self.values[6], self.values[5]]
    }

    /// Errors of a ray, as they are now.
    pub fn errors(&self, errors: &RayErrors) -> RayErrors {
        RayErrors { bias_m: self.values[4], noise_m: self.values[7], drop_out: self.values[8], ..*errors }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sector_may_go_over_the_end_of_the_turn() {
        let mut faults = Faults::of(&RayErrors::NONE);
        assert!(!faults.blocks(0.0));
        (faults.values[2], faults.values[3]) = (-0.2, 0.3);
        assert!(faults.blocks(0.0) && faults.blocks(TAU - 0.1) && !faults.blocks(0.4) && !faults.blocks(3.0));
    }
}
