//! The world itself: what every step changes in it, and what can be asked of it.

use crate::error::{Error, Result};
use crate::fixed::Fixed;
use crate::ground::Ground;
use crate::motion::Motion;
use crate::moving::Moving;
use std::ops::Range;
use std::sync::Arc;
use terraglue_subsystem::{
    BodyRef, BodyState, FieldTile, GROUND, Material, Ray, RayHit, RayMask, Scene, ShapeRef, World,
};

/// Runs job(0) … job(n − 1), possibly on several threads, and returns when all are done: `Host::parallel_for` or the
/// host's own threads.
pub type Parallel = Arc<dyn Fn(usize, &(dyn Fn(usize) + Sync)) + Send + Sync>;

/// A subsystem of the world.
#[derive(Debug)]
pub(crate) struct Member {
    pub scene: Scene,
    /// Its bodies and shapes among all of the world.
    pub bodies: Range<usize>,
    pub shapes: Range<usize>,
    pub ground: Option<Ground>,
    /// Place of its ground among all shapes and grounds: see [`Shape::rank`].
    pub ground_rank: u32,
}

/// A shape of the world.
#[derive(Clone, Debug)]
pub(crate) struct Shape {
    pub of: ShapeRef,
    pub material: Material,
    /// Place among all shapes and grounds by name of the subsystem, then id: which of two hits at one distance counts.
    pub rank: u32,
}

/// The committed world at the end of a step, and within the step interpolated to the time asked for.
pub struct WorldModel {
    pub(crate) interval: [f64; 2],
    pub(crate) names: Vec<String>,
    pub(crate) members: Vec<Member>,
    /// Of all subsystems, one after the other.
    pub(crate) bodies: Vec<Motion>,
    /// Those that are not fixed, in ascending order.
    pub(crate) movable: Vec<u32>,
    pub(crate) shapes: Vec<Shape>,
    /// One flag for each shape.
    pub(crate) is_visible: Vec<bool>,
    pub(crate) fixed: Fixed,
    pub(crate) moving: Moving,
    pub(crate) parallel: Option<Parallel>,
}

impl WorldModel {
    /// Begins a step from `interval[0]` to `interval[1]` (s). Bodies stay, from now on at rest, unless they are moved; the world is
    /// ready when the update is dropped.
    pub fn update(&mut self, interval: [f64; 2]) -> Update<'_> {
        self.interval = interval;
        for k in &self.movable {
            let body = &mut self.bodies[*k as usize];
            if body.moves() {
                *body = Motion::new(&body.after, &body.after);
            }
        }
        Update { world: self }
    }

    /// Whether a subsystem has bodies that are not fixed; the states of one without need not be given.
    pub fn moves(&self, subsystem: u32) -> bool {
        self.member(subsystem).is_ok_and(|member| !self.movable_of(&member.bodies).is_empty())
    }

    /// Places in the list of movable bodies of those in a range.
    fn movable_of(&self, bodies: &Range<usize>) -> Range<usize> {
        let place = |k: usize| self.movable.partition_point(|m| (*m as usize) < k);
        place(bodies.start)..place(bodies.end)
    }

    /// The part of the step that has passed at a time, 0 … 1.
    pub(crate) fn share(&self, time: f64) -> f64 {
        let [start, end] = self.interval;
        let share = (time - start) / (end - start);
        if time >= end || share.is_nan() { 1.0 } else { share.clamp(0.0, 1.0) }
    }

    /// Whether a mask lets a shape be met, by its number among all of the world.
    #[inline]
    pub(crate) fn is_met(&self, number: u32, mask: &RayMask) -> bool {
        let shape = &self.shapes[number as usize];
        self.is_visible[number as usize]
            && mask.admits(shape.material.class)
            && !mask.skip.names(shape.of.subsystem, shape.of.body)
    }

    /// The grounds that a mask lets be met, with the numbers of their subsystems.
    pub(crate) fn grounds(&self, mask: &RayMask) -> impl Iterator<Item = (u32, &Member, &Ground)> + Clone {
        let mask = *mask;
        let all = (0..).zip(&self.members).filter_map(|(k, m)| Some((k, m, m.ground.as_ref()?)));
        let seen = mask.sees & RayMask::THE_GROUND != 0 && mask.admits(GROUND_MATERIAL.class);
        all.filter(move |(k, _, _)| seen && !mask.skip.names(*k, GROUND))
    }
}

/// Material of grounds.
pub(crate) const GROUND_MATERIAL: Material = Material::of(terraglue_subsystem::MaterialClass::SOIL, 0.5);

/// Changes of a step to the world.
pub struct Update<'a> {
    world: &'a mut WorldModel,
}

impl Update<'_> {
    /// Bodies of a subsystem were at `before` at the start of the step and are at `after` at its end. Those that are fixed
    /// stay where they are.
    ///
    /// # Errors
    /// [`Error::Name`]: there is no such subsystem. [`Error::Count`]: not one state for each body.
    pub fn bodies(&mut self, subsystem: u32, before: &[BodyState], after: &[BodyState]) -> Result {
        let range = self.world.member(subsystem)?.bodies.clone();
        for given in [before, after] {
            self.world.check_count(subsystem, range.len(), given.len(), "states")?;
        }
        for k in self.world.movable_of(&range) {
            let k = self.world.movable[k] as usize;
            let own = k - range.start;
            self.world.bodies[k] = Motion::new(&before[own], &after[own]);
        }
        Ok(())
    }

    /// Shows and hides shapes of a subsystem, in the order of its scene.
    ///
    /// # Errors
    /// [`Error::Name`]: there is no such subsystem. [`Error::Count`]: not one flag for each shape.
    pub fn visibility(&mut self, subsystem: u32, is_visible: &[bool]) -> Result {
        let range = self.world.member(subsystem)?.shapes.clone();
        self.world.check_count(subsystem, range.len(), is_visible.len(), "flags")?;
        self.world.is_visible[range].copy_from_slice(is_visible);
        Ok(())
    }

    /// Copies the tiles of a subsystem's ground that changed; `read` answers tile (a, b) of the field that the ground was
    /// added with. A tile that it does not answer is no ground.
    ///
    /// # Errors
    /// [`Error::Name`]: there is no such subsystem, or it has no ground.
    pub fn ground<'t>(
        &mut self,
        subsystem: u32,
        read: impl FnMut(u32, u32) -> Option<FieldTile<'t>>,
    ) -> Result {
        self.world.member(subsystem)?;
        let ground = &mut self.world.members[subsystem as usize].ground;
        let none = || Error::Name(format!("{} has no ground", self.world.names[subsystem as usize]));
        ground.as_mut().ok_or_else(none)?.update(read);
        Ok(())
    }
}

impl Drop for Update<'_> {
    fn drop(&mut self) {
        self.world.moving.build(&self.world.bodies);
    }
}

impl WorldModel {
    fn member(&self, subsystem: u32) -> Result<&Member> {
        let none = || Error::Name(format!("there is no subsystem number {subsystem}"));
        self.members.get(subsystem as usize).ok_or_else(none)
    }

    fn check_count(&self, subsystem: u32, bodies: usize, given: usize, what: &'static str) -> Result {
        if bodies == given {
            return Ok(());
        }
        Err(Error::Count { subsystem: self.names[subsystem as usize].clone(), bodies, given, what })
    }
}

impl World for WorldModel {
    fn interval(&self) -> [f64; 2] {
        self.interval
    }

    fn subsystems(&self) -> &[String] {
        &self.names
    }

    fn scene(&self, subsystem: u32) -> Option<&Scene> {
        Some(&self.members.get(subsystem as usize)?.scene)
    }

    fn is_visible(&self, shape: ShapeRef) -> bool {
        let Some(member) = self.members.get(shape.subsystem as usize) else { return false };
        let shapes = &self.shapes[member.shapes.clone()];
        let found = shapes.binary_search_by_key(&shape.shape, |s| s.of.shape);
        found.is_ok_and(|k| self.is_visible[member.shapes.start + k] && shapes[k].of == shape)
    }

    fn pose(&self, body: BodyRef, time: f64) -> Option<BodyState> {
        let range = self.members.get(body.subsystem as usize)?.bodies.clone();
        Some(self.bodies.get(range)?.get(body.body as usize)?.state(self.share(time)))
    }

    fn cast_rays(&self, rays: &[Ray], mask: &RayMask, hits: &mut [RayHit]) {
        self.cast_batch(rays, mask, hits);
    }

    fn ground_heights(&self, points: &[[f64; 2]], heights: &mut [f64]) {
        for (point, height) in points.iter().zip(heights) {
            let here = self.members.iter().filter_map(|m| m.ground.as_ref()?.height(*point));
            *height = here.fold(f64::NAN, f64::max);
        }
    }

    fn overlap(&self, centre: [f64; 3], radius: f64, mask: &RayMask, found: &mut Vec<ShapeRef>) {
        self.touched(centre, radius, mask, found);
    }
}

impl std::fmt::Debug for WorldModel {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.debug_struct("WorldModel")
            .field("interval", &self.interval)
            .field("names", &self.names)
            .finish_non_exhaustive()
    }
}
