//! The shapes of a stand: one body for each plant, which stands still for ever.

use crate::stand::{Bush, Stand};
use crate::tree::{Species, Tree};
use terraglue_numerics::random::Random;
use terraglue_numerics::rotation::{product, quaternion};
use terraglue_subsystem::{
    BodyState, Geometry, JointKind, JointVariables, Material, MaterialClass, Pose, Scene, SceneBody,
    SceneJoint, SceneShape,
};

/// A stand as a scene.
#[derive(Clone, Debug)]
pub struct Plants {
    /// One body for each tree, in their order, then one for each bush.
    pub scene: Scene,
    /// Where they stand.
    pub states: Vec<BodyState>,
    /// Material of branches and leaves.
    leaves: Material,
}

/// How far stems go into the ground, m.
const ROOT: f64 = 0.4;
/// Heights at which pieces of a stem end, as shares of the height of the tree.
const CUTS: [f64; 6] = [0.08, 0.2, 0.4, 0.6, 0.8, 1.0];
/// Leaves of a bush.
const LEAVES: u32 = 120;

/// The shapes of a stand: stems as six cones without tips, branches and leaves as triangles drawn from a seed, through which a share of the
/// light passes. Half of the rest comes back.
pub fn plants(stand: &Stand, seed: u64, transmittance: f64) -> Plants {
    let class = MaterialClass::FOLIAGE.0;
    let leaves = Material {
        class,
        reflectance: (0.5 * (1.0 - transmittance)) as f32,
        transmittance: transmittance as f32,
    };
    let mut plants = Plants { scene: Scene::default(), states: Vec::new(), leaves };
    let mut random = Random::new(seed);
    for (number, tree) in stand.trees.iter().enumerate() {
        // the stem is upright in the frame of its body, which leans
        let [x, y] = tree.lean;
        plants.body(format!("tree{number}"), tree.foot, quaternion([-y, x, 0.0]));
        plants.stem(tree);
        plants.branches(tree, &mut random);
    }
    for (number, bush) in stand.bushes.iter().enumerate() {
        plants.body(format!("bush{number}"), bush.foot, [1.0, 0.0, 0.0, 0.0]);
        plants.leaves(bush, &mut random);
    }
    plants
}

impl Plants {
    /// All shapes on one body at the origin that a joint holds for ever, so that it has no states to report in a step. Ids of shapes are
    /// the same.
    pub fn as_one_body(&self, name: &str) -> Scene {
        let whole = |s: &SceneShape| {
            let plant = self.states[s.body as usize].world_from_body;
            let aside = plant.turned(s.body_from_shape.position);
            let position = [0, 1, 2].map(|k| plant.position[k] + aside[k]);
            let orientation = product(plant.orientation, s.body_from_shape.orientation);
            SceneShape { body: 0, body_from_shape: Pose { position, orientation }, ..s.clone() }
        };
        let joint = SceneJoint {
            name: "rooted".into(),
            parent: SceneJoint::WORLD,
            child: 0,
            parent_from_joint: Pose::IDENTITY,
            axis: [0.0; 3],
            kind: JointKind::Fixed,
            limits: [f64::NEG_INFINITY, f64::INFINITY],
            variables: JointVariables::ABSENT,
            break_action: String::new(),
        };
        Scene {
            bodies: vec![SceneBody { name: name.into(), mass: 0.0 }],
            shapes: self.scene.shapes.iter().map(whole).collect(),
            joints: vec![joint],
        }
    }

    fn body(&mut self, name: String, position: [f64; 3], orientation: [f64; 4]) {
        self.scene.bodies.push(SceneBody { name, mass: 0.0 });
        let world_from_body = Pose { position, orientation };
        self.states.push(BodyState { world_from_body, ..BodyState::REST });
    }

    fn shape(&mut self, geometry: Geometry, z: f64, material: Material) {
        let id = self.scene.shapes.len() as u32;
        self.scene.shapes.push(SceneShape {
            id,
            body: self.scene.bodies.len() as u32 - 1,
            name: format!("s{id}"),
            geometry,
            body_from_shape: Pose { position: [0.0, 0.0, z], ..Pose::IDENTITY },
            collides: false,
            material,
        });
    }

    fn stem(&mut self, tree: &Tree) {
        let mut low = -ROOT;
        for high in CUTS.map(|c| c * tree.height) {
            let frustum = Geometry::ConeFrustum {
                half_length: 0.5 * (high - low),
                radius_bottom: tree.radius_at(low),
                radius_top: tree.radius_at(high),
            };
            self.shape(frustum, 0.5 * (low + high), Material::of(MaterialClass::WOOD, 0.5));
            low = high;
        }
    }

    /// Thin triangles: dead ones below the crown, of which spruces have many, and dense ones in it.
    fn branches(&mut self, tree: &Tree, random: &mut Random) {
        let (base, top) = (tree.crown_base(), tree.height);
        let dead = if tree.species == Species::Spruce { 24 } else { 4 };
        let mut triangles = Vec::new();
        for k in 0..dead + 60 {
            let is_dead = k < dead;
            let z = if is_dead { random.between(1.0, base) } else { random.between(base, 0.98 * top) };
            let reach = if is_dead { random.between(0.2, 0.9) } else { 0.15 * (top - z) + 0.4 };
            let width = if is_dead { 0.015 } else { 0.12 };
            triangles.push(branch(z, reach, width, random));
        }
        self.mesh(&triangles);
    }

    fn leaves(&mut self, bush: &Bush, random: &mut Random) {
        let leaf = |random: &mut Random| {
            let at =
                [0, 1, 2].map(|k| bush.radius * random.between(-1.0, 1.0) * if k == 2 { 0.75 } else { 0.7 });
            let corner = |random: &mut Random| at.map(|x| x + random.between(-0.08, 0.08));
            let lifted = |[x, y, z]: [f64; 3]| [x, y, (z + 0.75 * bush.radius).max(0.0)];
            [(); 3].map(|()| lifted(corner(random)))
        };
        let triangles: Vec<_> = (0..LEAVES).map(|_| leaf(random)).collect();
        self.mesh(&triangles);
    }

    fn mesh(&mut self, corners: &[[[f64; 3]; 3]]) {
        let count = corners.len() as u32;
        let triangles = (0..count).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
        let points = corners.as_flattened().to_vec();
        self.shape(Geometry::Mesh { points, triangles }, 0.0, self.leaves);
    }
}

/// A triangle from the axis of a stem outward and a little down.
fn branch(z: f64, reach: f64, width: f64, random: &mut Random) -> [[f64; 3]; 3] {
    let angle = random.between(0.0, std::f64::consts::TAU);
    let (s, c) = (libm::sin(angle), libm::cos(angle));
    let drop = random.between(0.0, 0.3) * reach;
    [[width * s, -width * c, z], [-width * s, width * c, z], [reach * c, reach * s, z - drop]]
}
