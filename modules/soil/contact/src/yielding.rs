//! Bearing capacity of a node: the pressure law if the face is level and nothing but the foot's weight acts, less on
//! inclined faces and under shear, more if it is pushed sideways; and soil that was poured on the bed.
//!
//! The soil is elastic, p = k_u·(z − z₀) above its unloaded surface at the depth z₀, up to the pressure at which it yields:
//! p ≤ s·V(z) + a + b·z. V is first loading of the bed (Bekker 1956 and others). Where loose soil lies on it, the bed is
//! elastic from its own surface on, whatever it yields at, so that a foot that comes down to it meets no jump; and the loose soil
//! bears s·κ·V of its own depth, with a modulus that is a part κ of the bed's (Terzaghi 1943, art. 46): the larger of both.

use crate::patch::{Local, Patches};
use terraglue_subsystem::Result;

impl Patches {
    /// Mean pressure (Pa) over the cell at which node k yields at the mean depth z (m), and its slope (Pa/m).
    ///
    /// # Errors
    /// The law, which is a module, has no answer.
    #[inline]
    pub fn yields(&self, k: usize, z: f64) -> Result<(f64, f64)> {
        let spread = &self.nodes.spread[k];
        if spread.range <= 0.0 {
            return yields_at(self, k, z);
        }
        match spread.look(z, self.nodes.top(k)) {
            Some(look) => {
                Ok(look.mean([yields_at(self, k, look.depth[0])?, yields_at(self, k, look.depth[1])?]))
            }
            None => Ok((0.0, 0.0)),
        }
    }

    /// The same where first loading of the bed, and of a bed in the place of the loose soil, are known.
    #[inline]
    pub fn yields_from(
        &self,
        k: usize,
        z: f64,
        bed: (f64, f64),
        loose: Option<(f64, f64)>,
        law: &Local,
    ) -> (f64, f64) {
        let n = &self.nodes;
        let (share, [a, b]) = (n.share[k], n.passive[k]);
        let (mut p, mut slope) = (share * bed.0, share * bed.1);
        if z > 0.0 {
            (p, slope) = (p + a + b * z, slope + b);
        }
        if let Some((p_loose, slope_loose)) = loose {
            let k_u = law.curve.unloading();
            let elastic = k_u * (z - n.bed[k]);
            if elastic < p {
                (p, slope) = if elastic > 0.0 { (elastic, k_u) } else { (0.0, 0.0) };
            }
            let part = share * law.loose;
            if part * p_loose > p {
                (p, slope) = (part * p_loose, part * slope_loose);
            }
        }
        (p, slope)
    }

    /// Pressure at node k when the foot is at depth z there, and its slope. Soil that was in contact and clings follows the
    /// elastic line below zero down to the tension that it bears, then lets go.
    ///
    /// # Errors
    /// The law, which is a module, has no answer.
    #[inline]
    pub fn pressure(&self, k: usize, z: f64) -> Result<(f64, f64)> {
        Ok(self.pressure_and_yield(k, z)?.0)
    }

    /// The same with the pressure at which the node yields there, where that was needed.
    ///
    /// # Errors
    /// The law, which is a module, has no answer.
    #[inline]
    pub fn pressure_and_yield(&self, k: usize, z: f64) -> Result<((f64, f64), Option<f64>)> {
        let (n, k_u) = (&self.nodes, self.law(k).curve.unloading());
        let elastic = k_u * (z - n.permanent[k]);
        if elastic <= 0.0 {
            return Ok((self.clinging_at(k, z), None));
        }
        if elastic <= n.bound[k] {
            return Ok(((elastic, k_u), None));
        }
        let yields = self.yields(k, z)?;
        Ok((if elastic <= yields.0 { (elastic, k_u) } else { yields }, Some(yields.0)))
    }

    /// Tension at node k above the unloaded surface, Pa (< 0), and its slope.
    #[inline]
    pub fn clinging_at(&self, k: usize, z: f64) -> (f64, f64) {
        let (n, law) = (&self.nodes, self.law(k));
        if law.adhesion == 0.0 || n.stamp[k] == 0 {
            return (0.0, 0.0);
        }
        let stiffness = law.curve.unloading();
        let tension = stiffness * (n.permanent[k] - z);
        if tension <= law.adhesion { (-tension, stiffness) } else { (0.0, 0.0) }
    }
}

/// [`Patches::yields`] at a point at the depth z.
#[inline]
fn yields_at(patches: &Patches, k: usize, z: f64) -> Result<(f64, f64)> {
    let law = patches.law(k);
    let bed = law.curve.first_loading(z)?;
    let loose = match patches.nodes.above_bed(k, z) {
        Some(d) => Some(law.curve.first_loading(d)?),
        None => None,
    };
    Ok(patches.yields_from(k, z, bed, loose, law))
}

impl crate::patch_nodes::PatchNodes {
    /// Depth z (m) of the foot at node k below the top of the loose soil that lay on the bed; `None`: there was none.
    #[inline]
    pub fn above_bed(&self, k: usize, z: f64) -> Option<f64> {
        let loose = self.loose[k];
        (loose > 0.0).then(|| z - self.bed[k] + loose)
    }
}
