//! The world as one subsystem sees it: the model of what can be hit, and the fields of the others where they lie, without a copy.

use terraglue_host::Instance;
use terraglue_subsystem::{
    BodyRef, BodyState, Capabilities, Error, FieldInfo, FieldTile, Ray, RayHit, RayMask, Result, Scene,
    ShapeRef, World,
};
use terraglue_world::WorldModel;

/// Arguments of `observe` of an instance.
pub(super) struct Shown<'a> {
    model: &'a WorldModel,
    before: &'a [Instance],
    behind: &'a [Instance],
}

impl<'a> Shown<'a> {
    /// The instance in a slot, and the world that it is shown.
    pub fn to(
        model: &'a WorldModel,
        instances: &'a mut [Instance],
        slot: usize,
    ) -> Option<(&'a mut Instance, Self)> {
        let (before, rest) = instances.split_at_mut_checked(slot)?;
        let (own, behind) = rest.split_first_mut()?;
        Some((own, Self { model, before, behind }))
    }

    /// A subsystem whose fields are shown. Those of one that sees change while the world is looked at, so their values would
    /// depend on the order.
    fn other(&self, subsystem: u32) -> Option<&Instance> {
        let slot = subsystem as usize;
        let own = self.before.len();
        let found =
            if slot < own { self.before.get(slot) } else { self.behind.get(slot.checked_sub(own + 1)?) };
        found.filter(|instance| !instance.capabilities().has(Capabilities::SEES))
    }
}

impl World for Shown<'_> {
    fn revision(&self) -> u64 {
        self.model.revision()
    }
    fn interval(&self) -> [f64; 2] {
        self.model.interval()
    }
    fn subsystems(&self) -> &[String] {
        self.model.subsystems()
    }
    fn scene(&self, subsystem: u32) -> Option<&Scene> {
        self.model.scene(subsystem)
    }
    fn is_visible(&self, shape: ShapeRef) -> bool {
        self.model.is_visible(shape)
    }
    fn pose(&self, body: BodyRef, time: f64) -> Option<BodyState> {
        self.model.pose(body, time)
    }
    fn cast_rays(&self, rays: &[Ray], mask: &RayMask, hits: &mut [RayHit]) {
        self.model.cast_rays(rays, mask, hits);
    }
    fn ground_heights(&self, points: &[[f64; 2]], heights: &mut [f64]) {
        self.model.ground_heights(points, heights);
    }
    fn overlap(&self, centre: [f64; 3], radius: f64, mask: &RayMask, found: &mut Vec<ShapeRef>) {
        self.model.overlap(centre, radius, mask, found);
    }
    fn fields(&self, subsystem: u32) -> &[FieldInfo] {
        self.other(subsystem).map_or(&[], Instance::fields)
    }
    fn field_tile(&self, subsystem: u32, field: usize, a: u32, b: u32) -> Result<FieldTile<'_>> {
        let other = self.other(subsystem).ok_or(Error::Unsupported)?;
        other.subsystem().field_tile(field, a, b)
    }
}
