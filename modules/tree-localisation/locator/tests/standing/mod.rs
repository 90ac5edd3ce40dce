//! A machine that stands at the origin.

use terraglue_subsystem::*;

/// A world with one machine.
pub struct Standing {
    names: Vec<String>,
    scene: Scene,
}

impl Standing {
    /// With these bodies and shapes.
    pub fn with(scene: Scene) -> Self {
        Self { names: vec!["machine".into()], scene }
    }
}

impl World for Standing {
    fn interval(&self) -> [f64; 2] {
        [0.0, 1.0]
    }
    fn subsystems(&self) -> &[String] {
        &self.names
    }
    fn scene(&self, subsystem: u32) -> Option<&Scene> {
        (subsystem == 0).then_some(&self.scene)
    }
    fn is_visible(&self, _: ShapeRef) -> bool {
        true
    }
    fn pose(&self, _: BodyRef, _: f64) -> Option<BodyState> {
        Some(BodyState::REST)
    }
    fn cast_rays(&self, _: &[Ray], _: &RayMask, _: &mut [RayHit]) {}
    fn ground_heights(&self, _: &[[f64; 2]], _: &mut [f64]) {}
    fn overlap(&self, _: [f64; 3], _: f64, _: &RayMask, _: &mut Vec<ShapeRef>) {}
}
