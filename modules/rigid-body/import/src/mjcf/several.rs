//! A body with several joints: a chain of bodies with one joint each.
//!
//! MuJoCo moves a body by all of its joints one after the other. Here every joint connects two bodies, so there are bodies
//! between them that carry a millionth of mass and inertia each, taken from the last one: the sum is that of the file, and
//! where the joints stand at 0 so is every moment.

use super::{ElementPlace, MjcfReader};
use crate::error::Error;
use crate::inertia::Inertial;
use crate::model::Body;
use nalgebra::Isometry3;
use roxmltree::Node;

/// Share of the whole's mass that a body between two joints carries.
const SHARE: f64 = 1e-6;

impl MjcfReader<'_, '_> {
    /// Hangs `name` below `above` by its joints, none or more, and returns its body.
    pub(super) fn hang_by<'a>(
        &mut self,
        joints: &[Node<'a, '_>],
        above: ElementPlace<'a>,
        (name, frame): (&str, Isometry3<f64>),
        whole: Inertial,
    ) -> Result<usize, Error> {
        let between = joints.len().saturating_sub(1);
        let (mut parent, mut at) = (above.body, frame);
        for k in 0..=between {
            let last = k == between;
            let share = if last { 1.0 - SHARE * between as f64 } else { SHARE };
            let own = if last { name.to_owned() } else { format!("{name}_{}", k + 1) };
            let child = self.robot.bodies.len();
            let body = Body {
                name: own.clone(),
                mass: share * whole.mass,
                com: whole.com,
                inertia: share * whole.tensor,
                shapes: Vec::new(),
            };
            self.robot.bodies.push(body);
            let joint = joints.get(k).map(|j| self.d.element(*j, above.class));
            self.hang(joint, parent, child, at, &own)?;
            (parent, at) = (Some(child), Isometry3::identity());
        }
        let body = self.robot.bodies.len() - 1;
        if between > 0 {
            // Bodies next to each other never touch, with others between them neither.
            self.robot.excluded.extend(above.body.map(|above| [above, body]));
            let said = format!(
                "has {} joints: {between} of its millionths go to bodies between them, `{name}_1` and so on",
                joints.len()
            );
            let said = joints[0].parent_element().map(|node| self.place(node, &said));
            self.robot.notices.extend(said);
        }
        Ok(body)
    }
}
