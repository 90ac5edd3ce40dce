//! Which shapes a sphere touches.

use crate::model::WorldModel;
use terraglue_subsystem::{GROUND, RayMask, ShapeRef};

impl WorldModel {
    /// Shapes and grounds that a sphere touches or that contain it at the end of the step, in ascending order.
    pub(crate) fn touched(&self, centre: [f64; 3], radius: f64, mask: &RayMask, found: &mut Vec<ShapeRef>) {
        found.clear();
        if !(radius >= 0.0 && radius.is_finite() && centre.iter().all(|x| x.is_finite())) {
            return;
        }
        if mask.sees & RayMask::SHAPES != 0 {
            let mut add = |k: u32| {
                let shape = &self.shapes[k as usize];
                if self.is_met(shape, mask) {
                    found.push(shape.of);
                }
            };
            self.fixed.overlap(centre, radius, &mut add);
            self.moving.overlap(centre, radius, &self.bodies, &mut add);
        }
        let touched = self.grounds(mask).filter(|(_, _, ground)| ground.is_touched(centre, radius));
        found.extend(touched.map(|(subsystem, _, _)| ShapeRef { subsystem, body: GROUND, shape: GROUND }));
        found.sort_unstable();
        found.dedup();
    }
}
