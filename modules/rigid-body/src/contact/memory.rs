//! Contact forces of the last step, from which the solution of the next one starts.
//!
//! If contacts are redundant the solution is not unique, and the one next to the last is the one that does not make a
//! resting stack tremble. It belongs to the state: a restored run goes on as it would have.

use crate::contact::detection::ContactPoint;
use crate::math::V3;
use crate::motion::Motion;
use terraglue_subsystem::Result;
use terraglue_subsystem::bytes::Persist;

/// Points of a pair nearer than this to an old one go on with its force, m.
const NEAR: f64 = 1e-2;

/// A point that pressed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pressed {
    /// Which shapes met, see [`ContactPoint::pair`].
    pair: usize,
    /// Where, from the centre of mass of body b in its axes, m.
    place: V3,
    /// Normal and tangential force in the frame of the contact, N.
    force: [f64; 3],
}

fn place(p: &ContactPoint, bodies: &[Motion]) -> V3 {
    p.bodies[1].map_or(p.points[1], |b| bodies[b].q.inverse_transform_vector(&(p.points[1] - bodies[b].c)))
}

/// Replaces the memory by the points of a step of length h that press; `bodies` at its start.
pub(crate) fn remember(
    memory: &mut Vec<Pressed>,
    points: &[ContactPoint],
    impulses: &[f64],
    bodies: &[Motion],
    h: f64,
) {
    memory.clear();
    for (p, r) in points.iter().zip(impulses.chunks_exact(3)).filter(|(_, r)| r[0] > 0.0) {
        memory.push(Pressed { pair: p.pair, place: place(p, bodies), force: [r[0] / h, r[1] / h, r[2] / h] });
    }
}

/// Fills the impulses of points with the forces of the nearest old ones.
pub(crate) fn recall(
    memory: &[Pressed],
    points: &[ContactPoint],
    bodies: &[Motion],
    h: f64,
    impulses: &mut [f64],
) {
    for (p, r) in points.iter().zip(impulses.chunks_exact_mut(3)) {
        let here = place(p, bodies);
        let away = |m: &Pressed| (m.place - here).norm_squared();
        let old = memory.iter().filter(|m| m.pair == p.pair && away(m) < NEAR * NEAR);
        if let Some(old) = old.min_by(|a, b| away(a).total_cmp(&away(b))) {
            r.iter_mut().zip(old.force).for_each(|(r, f)| *r = h * f);
        }
    }
}

impl Persist for Pressed {
    fn write(&self, out: &mut Vec<u8>) {
        let Self { pair, place, force } = self;
        (*pair, [<[f64; 3]>::from(*place), *force]).write(out);
    }
    fn read(from: &mut &[u8]) -> Result<Self> {
        let (pair, [place, force]) = <(usize, [[f64; 3]; 2])>::read(from)?;
        Ok(Self { pair, place: place.into(), force })
    }
}
