//! A machine in the middle of a stand as its scanners see it: cab, boom, felling head and a stem that the head holds.

use terraglue_numerics::rotation::quaternion;
use terraglue_subsystem::{BodyState, Geometry, Material, MaterialClass, Pose, Scene, SceneBody, SceneShape};

/// A machine that stands level at the origin.
#[derive(Clone, Debug, Default)]
pub struct Machine {
    /// Its bodies and shapes.
    pub scene: Scene,
    /// Where they are, z from the ground below the origin, m.
    pub states: Vec<BodyState>,
}

/// Where the felling head is, m.
pub const HEAD: [f64; 2] = [5.26, 1.91];
/// Where the scanners are, left and right of the cab, m.
pub const SCANNERS: [[f64; 2]; 2] = [[0.6, 1.3], [0.6, -1.3]];
/// Their height above the ground, m.
pub const SCANNER_HEIGHT: f64 = 2.6;

impl Machine {
    /// Cab and boom; the boom ends in the head, which holds a stem upright.
    pub fn harvester() -> Self {
        let mut machine = Self::default();
        let cab = Geometry::Box { half_extents: [0.9, 0.8, 1.1] };
        machine.add("cab", cab, [-0.3, 0.0, 2.4], [0.0; 3]);
        let rear = Geometry::Box { half_extents: [2.5, 1.2, 0.7] };
        machine.add("rear", rear, [-3.2, 0.0, 1.5], [0.0; 3]);
        let azimuth = libm::atan2(HEAD[1], HEAD[0]);
        let reach = libm::hypot(HEAD[0], HEAD[1]);
        // capsules lie along z: turned down to the horizontal, then to the side of the head
        let turn = terraglue_numerics::rotation::product(
            quaternion([0.0, 0.0, azimuth]),
            quaternion([0.0, 1.45, 0.0]),
        );
        let boom = Geometry::Capsule { half_length: 0.5 * reach - 0.6, radius: 0.16 };
        machine.add_turned("boom", boom, [0.5 * HEAD[0] + 0.3, 0.5 * HEAD[1] + 0.1, 3.3], turn);
        let head = Geometry::Cylinder { half_length: 0.7, radius: 0.32 };
        machine.add("head", head, [HEAD[0], HEAD[1], 1.6], [0.0; 3]);
        let stem = Geometry::Cylinder { half_length: 3.0, radius: 0.16 };
        machine.add("held stem", stem, [HEAD[0], HEAD[1], 3.4], [0.0; 3]);
        machine
    }

    fn add(&mut self, name: &str, geometry: Geometry, position: [f64; 3], turn: [f64; 3]) {
        self.add_turned(name, geometry, position, quaternion(turn));
    }

    fn add_turned(&mut self, name: &str, geometry: Geometry, position: [f64; 3], orientation: [f64; 4]) {
        let id = self.scene.shapes.len() as u32;
        self.scene.bodies.push(SceneBody { name: name.into(), mass: 0.0 });
        self.scene.shapes.push(SceneShape {
            id,
            body: id,
            name: name.into(),
            geometry,
            body_from_shape: Pose::IDENTITY,
            collides: false,
            material: Material::of(MaterialClass::METAL, 0.5),
        });
        let world_from_body = Pose { position, orientation };
        self.states.push(BodyState { world_from_body, ..BodyState::REST });
    }
}
