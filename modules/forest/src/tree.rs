//! One tree: its measures, and how thick its stem is at a height.

/// How a tree branches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Species {
    /// Long bare stem.
    Pine,
    /// Branches, many of them dead, nearly from the ground.
    Spruce,
}

/// A tree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tree {
    /// Middle of the stem where it meets the ground, world, m.
    pub foot: [f64; 3],
    /// Diameter at breast height, 1.3 m above the foot, m.
    pub diameter: f64,
    /// Height of the tip above the foot, m.
    pub height: f64,
    /// Slope of the axis of the stem along x and y: metres aside for each metre up.
    pub lean: [f64; 2],
    /// How it branches.
    pub species: Species,
}

/// Height at which diameters are measured, m.
pub const BREAST_HEIGHT: f64 = 1.3;
/// Exponent of the taper: a form between cone (1) and paraboloid (0.5).
const TAPER: f64 = 0.7;

impl Tree {
    /// Radius of the stem `z` m above the foot: r = d/2·((h − z)/(h − 1.3))^p (D. W. Ormerod, "A simple bole model", 1973).
    pub fn radius_at(&self, z: f64) -> f64 {
        let share = ((self.height - z) / (self.height - BREAST_HEIGHT)).max(0.0);
        0.5 * self.diameter * libm::pow(share, TAPER)
    }

    /// Place of the axis `z` m above the foot, world, m.
    pub fn axis_at(&self, z: f64) -> [f64; 3] {
        let [x, y, foot] = self.foot;
        [x + z * self.lean[0], y + z * self.lean[1], foot + z]
    }

    /// Place of the axis at breast height: where a map shows the tree, m.
    pub fn place(&self) -> [f64; 2] {
        let [x, y, _] = self.axis_at(BREAST_HEIGHT);
        [x, y]
    }

    /// Height of a tree of this diameter, m: h = 1.3 + d²/(a + b·d)² with d in cm (M. Näslund, 1936); a and b are such that 10 cm
    /// are 10.4 m and 30 cm are 23 m tall, as in managed stands of pine and spruce.
    pub fn usual_height(diameter: f64) -> f64 {
        let d = 100.0 * diameter;
        let root = d / (1.7 + 0.16 * d);
        (BREAST_HEIGHT + root * root).max(3.0)
    }

    /// Height above the foot from which on living branches grow, m.
    pub fn crown_base(&self) -> f64 {
        match self.species {
            Species::Pine => 0.6 * self.height,
            Species::Spruce => 0.4 * self.height,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stem_has_its_diameter_at_breast_height_and_ends_in_a_tip() {
        let tree = Tree {
            foot: [1.0, 2.0, 3.0],
            diameter: 0.3,
            height: 23.0,
            lean: [0.1, 0.0],
            species: Species::Pine,
        };
        assert!((tree.radius_at(BREAST_HEIGHT) - 0.15).abs() < 1e-15);
        assert_eq!((tree.radius_at(23.0), tree.radius_at(30.0)), (0.0, 0.0));
        assert!((tree.place()[0] - 1.13).abs() < 1e-15);
        assert!((Tree::usual_height(0.3) - 23.0).abs() < 1.0);
    }
}
