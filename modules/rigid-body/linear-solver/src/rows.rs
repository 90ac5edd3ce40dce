//! The six directions of a joint between two bodies and the rates and impulses along them.

use nalgebra::Vector3;

type V3 = Vector3<f64>;

/// Directions 0–2 are translations of the child's anchor against the parent's, 3–5 rotations of the child against
/// the parent; each triple is orthonormal, in world axes. Both bodies meet in one point, the anchor.
///
/// Row r is J_r·v = direction·(velocity or rotation rate of the child against the parent there).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rows {
    /// Unit vectors.
    pub directions: [V3; 6],
    /// The anchor from the child's centre of mass, m.
    pub anchor: V3,
    /// The anchor from the parent's centre of mass (from the world's origin without a parent), m.
    pub lever: V3,
}

impl Rows {
    /// Force and moment about the child's centre of mass of a unit impulse along row r: the row's Jacobian there.
    pub fn on_child(&self, r: usize) -> [f64; 6] {
        wrench(&self.directions[r], &self.anchor, r < 3)
    }

    /// The same for the parent, where it acts with the opposite sign.
    pub fn on_parent(&self, r: usize) -> [f64; 6] {
        wrench(&-self.directions[r], &self.lever, r < 3)
    }

    /// J·v of row r alone. `child`, `parent`: six rates each.
    pub fn rate(&self, r: usize, child: &[f64], parent: Option<&[f64]>) -> f64 {
        let (v, w) = split(child);
        let other = parent.map(split);
        let along = if r < 3 {
            let own = v + w.cross(&self.anchor);
            other.map_or(own, |(v, w)| own - (v + w.cross(&self.lever)))
        } else {
            other.map_or(w, |(_, turn)| w - turn)
        };
        self.directions[r].dot(&along)
    }

    /// J·v of all six rows. `child`, `parent`: six rates each.
    pub fn rates(&self, child: &[f64], parent: Option<&[f64]>) -> [f64; 6] {
        let (mut slide, mut turn) = split(child);
        slide += turn.cross(&self.anchor);
        if let Some(parent) = parent {
            let (v, w) = split(parent);
            slide -= v + w.cross(&self.lever);
            turn -= w;
        }
        let d = &self.directions;
        [
            d[0].dot(&slide),
            d[1].dot(&slide),
            d[2].dot(&slide),
            d[3].dot(&turn),
            d[4].dot(&turn),
            d[5].dot(&turn),
        ]
    }

    /// Rates of the child (centre of mass, rotation) that move it by a unit rate along row r against a parent at
    /// rest, and along no other row.
    pub(crate) fn motion(&self, r: usize) -> [f64; 6] {
        let mut unit = [0.0; 6];
        unit[r] = 1.0;
        self.motion_of(&unit)
    }

    /// The same for any rates along all rows.
    #[inline]
    pub(crate) fn motion_of(&self, b: &[f64; 6]) -> [f64; 6] {
        let d = &self.directions;
        let turn = b[3] * d[3] + b[4] * d[4] + b[5] * d[5];
        let slide = b[0] * d[0] + b[1] * d[1] + b[2] * d[2] + self.anchor.cross(&turn);
        [slide.x, slide.y, slide.z, turn.x, turn.y, turn.z]
    }

    /// Components of a wrench on the child along each row: motion(r)·wrench.
    #[inline]
    pub(crate) fn along(&self, wrench: &[f64; 6]) -> [f64; 6] {
        let (force, moment) = split(wrench);
        let (d, moment) = (&self.directions, moment + force.cross(&self.anchor));
        [
            d[0].dot(&force),
            d[1].dot(&force),
            d[2].dot(&force),
            d[3].dot(&moment),
            d[4].dot(&moment),
            d[5].dot(&moment),
        ]
    }
}

fn wrench(d: &V3, arm: &V3, force: bool) -> [f64; 6] {
    if force {
        let m = arm.cross(d);
        [d.x, d.y, d.z, m.x, m.y, m.z]
    } else {
        [0.0, 0.0, 0.0, d.x, d.y, d.z]
    }
}

#[inline]
fn split(v: &[f64]) -> (V3, V3) {
    (V3::new(v[0], v[1], v[2]), V3::new(v[3], v[4], v[5]))
}
