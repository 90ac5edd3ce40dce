//! Trials of a soil under motion or force, and the derivatives at the last one.

use crate::assemble::Noted;
use crate::patch::{Patch, Patches};
use crate::vectors::Stiffness;
use terraglue_subsystem::{Error, Level, Motion, Response, Result};

/// Normal force at which the slope of the law is taken where the foot carries less, N: the compliance of a
/// power law with n > 1 is infinite at 0.
const SMALLEST_FORCE_N: f64 = 1e-3;

#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
enum Kind {
    #[default]
    None,
    Motion,
    Force,
    Hybrid,
}

/// The last trial since the ports were set: enough to take derivatives there.
#[derive(Clone, Debug, Default)]
pub struct Last {
    kind: Kind,
    /// Per port the foot's X, with the soil's answer along n after a force.
    x: Vec<[f64; 6]>,
    normal: Vec<f64>,
    /// Answers of the laws to a motion.
    noted: Noted,
}

impl Last {
    /// Room for `nodes` nodes of all contacts.
    pub fn reserve(&mut self, nodes: usize) {
        self.noted.reserve(nodes);
    }

    /// Forgets the trial.
    pub fn clear(&mut self) {
        self.noted.clear();
        self.kind = Kind::None;
        self.x.clear();
        self.normal.clear();
    }

    /// The law's whole wrench at the foot's motion; the surface follows the foot where it is pressed.
    ///
    /// # Errors
    /// The law, which is a module, has no answer.
    pub fn motion(&mut self, patches: &mut Patches, motion: &Motion, out: &mut Response) -> Result {
        self.clear();
        self.kind = Kind::Motion;
        out.v.fill(0.0);
        for p in 0..patches.ports.len() {
            let x = patches.ports[p].unpack(motion.x);
            let wrench = patches.noted_wrench(p, &x, &mut self.noted)?;
            let mut surface = x;
            if wrench[0] != 0.0 {
                patches.ports[p].pack(&patches.ports[p].unpack(motion.v), out.v);
            } else {
                surface[0] = patches.surface_under(p, 0.0, &x)?;
            }
            patches.ports[p].pack(&surface, out.x);
            patches.ports[p].pack(&wrench, out.t);
            self.x.push(x);
            self.normal.push(wrench[0]);
        }
        Ok(())
    }

    /// The surface under the normal forces of `t`; the other components of the wrench follow from the motion of the
    /// foot where it is known, from a foot at rest otherwise.
    ///
    /// # Errors
    /// The law, which is a module, has no answer.
    pub fn force(
        &mut self,
        patches: &mut Patches,
        t: &[f64],
        motion: Option<&Motion>,
        out: &mut Response,
    ) -> Result {
        self.clear();
        self.kind = if motion.is_some() { Kind::Hybrid } else { Kind::Force };
        out.v.fill(0.0);
        for p in 0..patches.ports.len() {
            let force = patches.ports[p].unpack(t)[0].max(-patches.ports[p].pull);
            let mut x = motion.map_or([0.0; 6], |m| patches.ports[p].unpack(m.x));
            x[0] = patches.surface_under(p, force, &x)?;
            let mut wrench = patches.wrench(p, &x)?;
            wrench[0] = force;
            patches.ports[p].pack(&x, out.x);
            patches.ports[p].pack(&wrench, out.t);
            self.x.push(x);
            self.normal.push(force);
        }
        Ok(())
    }

    /// Derivatives at the last trial as [`terraglue_subsystem::Subsystem::interface_jacobian`] defines them. With
    /// W = −T, the wrench on the soil: after motion dW/dX; after force dX/dW, whose tangential part is 0 because
    /// the soil answers a rest there; after force with motion d(X_n, W_t, W_m)/d(W_n, X_t, X_m).
    pub fn jacobian(&mut self, patches: &mut Patches, n: usize, level: Level, out: &mut [f64]) -> Result {
        out.fill(0.0);
        match (self.kind, level) {
            (Kind::None, _) => return Err(Error::Failed("derivatives were asked for before a trial".into())),
            (_, Level::Position) => {}
            (Kind::Motion, Level::Velocity) => return Ok(()),
            _ => return Err(Error::Unsupported),
        }
        for p in 0..self.x.len() {
            let block = if self.kind == Kind::Motion {
                patches.noted_stiffness(p, &self.x[p], &self.noted)
            } else {
                let k = patches.stiffness(p, &self.x[p])?;
                hybrid(&k, self.normal_stiffness(patches, p, &k)?, self.kind == Kind::Hybrid)
            };
            scatter(&patches.ports[p], &block, n, out);
        }
        Ok(())
    }

    /// dW_n/dX_n, that of a small force where the foot carries none.
    fn normal_stiffness(&self, patches: &mut Patches, p: usize, k: &Stiffness) -> Result<f64> {
        if self.normal[p].abs() >= SMALLEST_FORCE_N && k[0][0] > 0.0 {
            return Ok(k[0][0]);
        }
        let mut x = self.x[p];
        x[0] = patches.surface_under(p, SMALLEST_FORCE_N, &x)?;
        Ok(patches.normal_force(p, &x)?[1])
    }
}

/// Solves the first row of W = K·X for X_n.
fn hybrid(k: &Stiffness, normal: f64, with_motion: bool) -> Stiffness {
    let mut block = [[0.0; 6]; 6];
    let compliance = if normal > 0.0 { 1.0 / normal } else { 0.0 };
    block[0][0] = compliance;
    if with_motion {
        for c in 1..6 {
            block[0][c] = -compliance * k[0][c];
            block[c][0] = compliance * k[c][0];
            for r in 1..6 {
                block[r][c] = k[r][c] - compliance * k[r][0] * k[0][c];
            }
        }
    }
    block
}

/// Adds a block of a patch to a packed matrix of n columns.
pub fn scatter(patch: &Patch, block: &Stiffness, n: usize, out: &mut [f64]) {
    for (row, place_r) in block.iter().zip(patch.place) {
        for (value, place_c) in row.iter().zip(patch.place) {
            if let (Some(r), Some(c)) = (place_r, place_c) {
                out[c * n + r] = *value;
            }
        }
    }
}
