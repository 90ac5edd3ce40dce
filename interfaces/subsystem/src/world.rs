//! Sight of a subsystem: the bodies, shapes and grounds of all others, and rays through them.
//!
//! # Time of an answer
//! [`crate::Subsystem::observe`] comes once per step [t, t + h], after all subsystems have committed it. Every answer is for the
//! time that the question names, within [t, t + h] ([`World::interval`]): moving bodies stand where a motion between their
//! committed states at t and t + h carries them (on a straight line, turning at a constant rate about one axis), so nothing is
//! older or younger than the question, and nothing after t + h is known. Times outside of the interval are answered with its
//! nearest end. The interval is the last communication step also for a sensor that makes a step only every n-th. The ground and
//! the visibility of shapes are those at t + h. A body that makes a step only every n-th communication point moves when it
//! commits.
//!
//! Answers depend on the question and the committed states alone, never on threads, on the order of subsystems or on earlier
//! questions.

use crate::error::{Error, Result};
use crate::field::{FieldInfo, FieldTile};
use crate::material::Material;
use crate::pose::BodyState;
use crate::scene::Scene;

/// The committed world at the end of a step, and within the step interpolated to the requested time.
///
/// Subsystems are numbered in the order of the scenario; [`World::subsystems`] names them.
pub trait World {
    /// Time of the newest committed states, s: t + h of the step.
    fn time(&self) -> f64 {
        self.interval()[1]
    }

    /// Changes whenever names or scenes of subsystems do, as by an exchange of code while a run goes on: copies made of
    /// them under the same number stay valid.
    fn revision(&self) -> u64 {
        0
    }

    /// First and last time of a query, s.
    fn interval(&self) -> [f64; 2];

    /// Names of all subsystems; their numbers are places in this list.
    fn subsystems(&self) -> &[String];

    /// Bodies, shapes and joints of a subsystem; none: there is no such subsystem.
    fn scene(&self, subsystem: u32) -> Option<&Scene>;

    /// Whether the shape with this id is there and not hidden.
    fn is_visible(&self, shape: ShapeRef) -> bool;

    /// A body by the names of its subsystem and its own.
    fn body(&self, subsystem: &str, body: &str) -> Option<BodyRef> {
        let number = self.subsystems().iter().position(|name| name == subsystem)? as u32;
        let place = self.scene(number)?.bodies.iter().position(|b| b.name == body)?;
        Some(BodyRef { subsystem: number, body: place as u32 })
    }

    /// Pose and twist of a body at a time; none: there is no such body.
    fn pose(&self, body: BodyRef, time: f64) -> Option<BodyState>;

    /// The nearest hit of every ray, each at its own time: `hits[i]` belongs to `rays[i]`. Surfaces are seen from both
    /// sides; a ray that starts inside a shape hits it from within. Rays without a direction, with a range that is not
    /// positive or with numbers that are not finite (the range may be ∞) miss.
    /// If the lengths differ, the rest of the longer list is left alone.
    fn cast_rays(&self, rays: &[Ray], mask: &RayMask, hits: &mut [RayHit]);

    /// Heights of the ground at points x, y of the world, m; NaN where there is none. Of several grounds the highest.
    fn ground_heights(&self, points: &[[f64; 2]], heights: &mut [f64]);

    /// Shapes that a sphere touches or contains, at the time of the newest states, in ascending order, into `found`, which
    /// is emptied before.
    fn overlap(&self, centre: [f64; 3], radius: f64, mask: &RayMask, found: &mut Vec<ShapeRef>);

    /// Fields of a subsystem as committed at t + h; empty: it has none. Those of a subsystem that sees itself are not shown, as
    /// they may change during its own look.
    fn fields(&self, _subsystem: u32) -> &[FieldInfo] {
        &[]
    }

    /// Tile (a, b) of field number `field` of a subsystem.
    ///
    /// # Errors
    /// [`Error::Refused`]: there is no such field or tile. [`Error::Unsupported`]: the subsystem has no fields.
    fn field_tile(&self, _subsystem: u32, _field: usize, _a: u32, _b: u32) -> Result<FieldTile<'_>> {
        Err(Error::Unsupported)
    }
}

/// A body of the world.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct BodyRef {
    /// Number of the subsystem.
    pub subsystem: u32,
    /// Index into the bodies of its scene.
    pub body: u32,
}

impl BodyRef {
    /// No body.
    pub const NONE: Self = Self { subsystem: u32::MAX, body: u32::MAX };

    /// All bodies of a subsystem, for [`RayMask::skip`].
    pub const fn all_of(subsystem: u32) -> Self {
        Self { subsystem, body: u32::MAX }
    }

    /// Whether this names that body: itself, or all bodies of its subsystem.
    pub fn names(self, subsystem: u32, body: u32) -> bool {
        self.subsystem == subsystem && (self.body == body || self.body == u32::MAX) && subsystem != u32::MAX
    }
}

/// A shape of the world.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ShapeRef {
    /// Number of the subsystem.
    pub subsystem: u32,
    /// Index of the body in its scene.
    pub body: u32,
    /// Id of the shape, or [`GROUND`].
    pub shape: u32,
}

/// [`RayHit::shape`] and [`RayHit::body`] of the ground: the height field of the subsystem that is named.
pub const GROUND: u32 = u32::MAX;

/// A half line that looks for the first thing in its way.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Start, world, m.
    pub origin: [f64; 3],
    /// Direction, world, unit.
    pub direction: [f64; 3],
    /// When it looks, s; within [`World::interval`].
    pub time: f64,
    /// Its range, m; may be ∞.
    pub range: f64,
}

/// First hit of a ray.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayHit {
    /// Distance from the start, m; ∞: nothing was met, and the rest is meaningless.
    pub distance: f64,
    /// Unit normal of the surface, world, against the ray.
    pub normal: [f64; 3],
    /// Number of the subsystem.
    pub subsystem: u32,
    /// Index of the body in its scene; [`GROUND`]: the ground.
    pub body: u32,
    /// Id of the shape; [`GROUND`]: the ground.
    pub shape: u32,
    /// Material of the surface.
    pub material: Material,
}

impl RayHit {
    /// Nothing was met.
    pub const MISS: Self = Self {
        distance: f64::INFINITY,
        normal: [0.0; 3],
        subsystem: u32::MAX,
        body: u32::MAX,
        shape: u32::MAX,
        material: Material::UNKNOWN,
    };

    /// Whether something was met.
    pub fn is_hit(&self) -> bool {
        self.distance < f64::INFINITY
    }
}

/// Filter of rays and overlaps.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RayMask {
    /// Bits [`RayMask::SHAPES`] and [`RayMask::THE_GROUND`].
    pub sees: u32,
    /// Bit k: material class k is met; bit 31: all classes from 31 on.
    pub classes: u32,
    /// A body that is passed by, such as the one that the sensor sits on; [`BodyRef::NONE`]: none,
    /// [`BodyRef::all_of`]: a whole subsystem.
    pub skip: BodyRef,
}

impl RayMask {
    /// Bit of [`RayMask::sees`]: shapes that are not hidden.
    pub const SHAPES: u32 = 1;
    /// Bit of [`RayMask::sees`]: height fields.
    pub const THE_GROUND: u32 = 2;
    /// Meets everything.
    pub const ALL: Self =
        Self { sees: Self::SHAPES | Self::THE_GROUND, classes: u32::MAX, skip: BodyRef::NONE };

    /// Everything but that body.
    pub const fn without(body: BodyRef) -> Self {
        Self { skip: body, ..Self::ALL }
    }

    /// Whether a surface of this class is met.
    pub fn admits(&self, class: u32) -> bool {
        self.classes >> class.min(31) & 1 == 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mask_passes_by_what_it_names() {
        let own = BodyRef { subsystem: 2, body: 1 };
        assert!(own.names(2, 1) && !own.names(2, 0) && !own.names(1, 1));
        assert!(BodyRef::all_of(2).names(2, 7) && !BodyRef::all_of(2).names(3, 7));
        assert!(!BodyRef::NONE.names(u32::MAX, u32::MAX));
        let wood = RayMask { classes: 1 << 4 | 1 << 31, ..RayMask::ALL };
        assert!(wood.admits(4) && !wood.admits(5) && wood.admits(31) && wood.admits(400));
    }
}
