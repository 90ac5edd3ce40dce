//! Finds the ports of a step: broad phase on boxes and tiles, then frame and nodes of each patch.

use super::frame::{Patch, extent, mask};
use super::ground::{Bounds, Cut, Ground, Reader};
use super::port_set::{PortOwner, PortSet, port_key};
use crate::error::{Error, Result};
use parry3d_f64::bounding_volume::Aabb;
use parry3d_f64::math::Vector;
use terraglue_ground::{Aabb as Bounding, Placed, Surface, compose, nodes_below};
use terraglue_subsystem::{
    BodyState, Law, Node, Port, PortKind, Pose, Scene, SceneShape, Subsystem, Terrain,
};

/// A subsystem with bodies.
pub struct BodySide<'a> {
    /// Its index, below 65536; part of the ports' keys.
    pub subsystem: u32,
    /// Its name, for errors.
    pub name: &'a str,
    /// Its bodies and shapes.
    pub scene: &'a Scene,
}

/// A subsystem with ground.
pub struct GroundSide<'a> {
    /// Its index, below 65536; part of the ports' keys.
    pub subsystem: u32,
    /// The instance, for its field `height`.
    pub instance: &'a dyn Subsystem,
}

/// The step that contacts are looked for in.
#[derive(Clone, Copy, Debug)]
pub struct Now {
    /// Time at its start, s.
    pub t: f64,
    /// Length, s.
    pub h: f64,
    /// Gravity in the world, m/s².
    pub gravity: [f64; 3],
    /// A port also exists for a shape that stays this far away, m.
    pub margin: f64,
}

/// Finds where shapes may touch ground; remembers shapes and buffers from step to step.
pub struct ContactDetector {
    bodies: Vec<Bodies>,
    grounds: Vec<Ground>,
    set: PortSet,
    before: Vec<(u64, u32)>,
    buried: Option<String>,
}

struct Bodies {
    subsystem: u32,
    name: String,
    shapes: Vec<Shape>,
}

struct Shape {
    id: u32,
    body: u32,
    name: String,
    mask: u32,
    body_from_shape: Pose,
    placed: Placed,
    /// Its box in the world at the start of the step.
    bounds: Bounding,
}

impl ContactDetector {
    /// Bodies and grounds in ascending order of their indices. `terrain` stands in for a soil that shows no
    /// field `height`.
    ///
    /// # Errors
    /// [`Error::Simulation`] when a ground has neither.
    pub fn new(bodies: &[BodySide], grounds: &[GroundSide], terrain: Option<&dyn Terrain>) -> Result<Self> {
        let grounds = grounds.iter().map(|g| Ground::new(g.subsystem, g.instance, terrain));
        let bodies = bodies.iter().map(|b| Bodies {
            subsystem: b.subsystem,
            name: b.name.into(),
            shapes: shapes_of(b.scene),
        });
        Ok(Self {
            bodies: bodies.collect(),
            grounds: grounds.collect::<Result<_>>()?,
            set: PortSet::default(),
            before: Vec::new(),
            buried: None,
        })
    }

    /// The ports of the last call of [`ContactDetector::detect`].
    pub fn ports(&self) -> &PortSet {
        &self.set
    }

    /// The first shape that the last call of [`ContactDetector::detect`] found buried deeper than it is high, in words.
    pub fn buried(&self) -> Option<&str> {
        self.buried.as_deref()
    }

    /// All ports of a step. `states` and `ground` give the committed body states and the instance of the
    /// subsystem with that index. Allocates only when there are more ports or nodes than ever before.
    ///
    /// # Errors
    /// [`Error::Simulation`] when a shape that could touch is beyond the ground, a pose or a height is not a
    /// number.
    pub fn detect<'a>(
        &mut self,
        now: &Now,
        states: impl Fn(u32) -> &'a [BodyState],
        ground: impl Fn(u32) -> &'a dyn Subsystem,
    ) -> Result<&PortSet> {
        self.before.clear();
        self.before.extend(self.set.ports.iter().map(|p| (p.key, p.mask)));
        self.set.ports.clear();
        self.set.nodes.clear();
        self.set.owners.clear();
        self.buried = None;
        for bodies in &mut self.bodies {
            bodies.place(now, states(bodies.subsystem))?;
            for g in &mut self.grounds {
                let owner = (bodies.subsystem, g.subsystem);
                let (reader, mut bounds) = g.read(ground(g.subsystem));
                let found = (&mut self.set, &mut self.buried);
                bodies.meet(now, states(owner.0), owner.1, (&reader, &mut bounds), found)?;
                if let Some(trouble) = reader.trouble() {
                    return Err(failed(now, trouble.to_string()));
                }
            }
        }
        self.number();
        Ok(&self.set)
    }

    /// Places in packed vectors; a new epoch when the set of ports changed.
    fn number(&mut self) {
        let mut first = 0;
        for port in &mut self.set.ports {
            port.first = first;
            first += port.mask.count_ones();
        }
        self.set.n = first;
        let same = self.before.iter().copied().eq(self.set.ports.iter().map(|p| (p.key, p.mask)));
        if !same {
            self.set.epoch += 1;
        }
    }
}

/// Shapes that can be hit, in ascending order of id.
fn shapes_of(scene: &Scene) -> Vec<Shape> {
    let shape = |s: &SceneShape| {
        let placed = Placed::new(&s.geometry, &s.body_from_shape);
        Shape {
            id: s.id,
            body: s.body,
            name: s.name.clone(),
            mask: mask(&s.geometry),
            body_from_shape: s.body_from_shape,
            bounds: placed.aabb(),
            placed,
        }
    };
    let mut shapes: Vec<Shape> = scene.shapes.iter().filter(|s| s.collides).map(shape).collect();
    shapes.sort_by_key(|s| s.id);
    shapes
}

fn failed(now: &Now, message: String) -> Error {
    Error::Simulation { time_s: now.t, message }
}

impl Bodies {
    fn place(&mut self, now: &Now, states: &[BodyState]) -> Result {
        for shape in &mut self.shapes {
            let Some(state) = states.get(shape.body as usize) else {
                let message = format!("{}: no state of body {}", self.name, shape.body);
                return Err(failed(now, message));
            };
            if !is_finite(state) {
                let message = format!("the motion of `{}` of {} is not a number", shape.name, self.name);
                return Err(failed(now, message));
            }
            shape.placed.move_to(&compose(&state.world_from_body, &shape.body_from_shape));
            shape.bounds = shape.placed.aabb();
        }
        Ok(())
    }

    /// Adds the ports of all shapes on one ground.
    fn meet(
        &self,
        now: &Now,
        states: &[BodyState],
        ground: u32,
        (reader, bounds): (&Reader, &mut Bounds),
        (set, buried): (&mut PortSet, &mut Option<String>),
    ) -> Result {
        for shape in &self.shapes {
            let reach = shape.reach(now, &states[shape.body as usize]);
            let swept = shape.swept(reach);
            if !self.is_over(now, shape, reader, &swept)? || !bounds.meets(reader, &swept) {
                continue;
            }
            if buried.is_none() {
                *buried = self.buried(shape, reader);
            }
            let first_node = set.nodes.len();
            let Some(port) = shape.port(reader, reach, &mut set.nodes) else { continue };
            let node_count = (set.nodes.len() - first_node) as u32;
            set.ports.push(Port {
                key: port_key(self.subsystem, ground, shape.id),
                first_node: first_node as u32,
                node_count,
                ..port
            });
            let owner = PortOwner { subsystem: self.subsystem, ground, body: shape.body, shape: shape.id };
            set.owners.push(owner);
        }
        Ok(())
    }

    /// How a shape is buried by more than its own height: what then lies on top of it no soil knows.
    fn buried(&self, shape: &Shape, reader: &Reader) -> Option<String> {
        let [x, y, _] = shape.bounds.centre();
        let [i, j] = reader.lattice().coordinates(x, y).map(|c| c.round() as i32);
        let level = reader.undisturbed().height(i, j);
        let (height, covered) = (shape.bounds.max[2] - shape.bounds.min[2], level - shape.bounds.max[2]);
        (covered > height).then(|| {
            format!(
                "`{}` of {} is buried: the ground at x = {x:.3} m, y = {y:.3} m was {covered:.3} m above its top, and it is \
                 {height:.3} m high; the ground is too weak for its load (take a stronger soil or a larger foot), or it starts \
                 below it",
                shape.name, self.name
            )
        })
    }

    /// Whether the middle of a shape lies over the ground; an error where it does not and is so low that it
    /// would touch if there were ground.
    fn is_over(&self, now: &Now, shape: &Shape, reader: &Reader, swept: &Aabb) -> Result<bool> {
        let lattice = reader.lattice();
        let (x, y) = (0.5 * (swept.mins.x + swept.maxs.x), 0.5 * (swept.mins.y + swept.maxs.y));
        if lattice.contains(x, y) {
            return Ok(true);
        }
        let [u, v] = lattice.coordinates(x, y).map(|c| c.clamp(-1.0, 1e9).round() as i32);
        if swept.mins.z > reader.height(u, v) {
            return Ok(false);
        }
        let [low, high] = lattice.extent();
        let message = format!(
            "`{}` of {} has left the ground: it is at x = {x:.3} m, y = {y:.3} m; the ground spans \
             x = {} … {} m, y = {} … {} m (make [terrain] size_m larger)",
            shape.name, self.name, low[0], high[0], low[1], high[1]
        );
        Err(failed(now, message))
    }
}

impl Shape {
    /// How far any point of the shape can get within the step, and the margin: |v|h + ½|g|h² + margin.
    fn reach(&self, now: &Now, state: &BodyState) -> f64 {
        let bounds = &self.bounds;
        let c = bounds.centre();
        let r: [f64; 3] = std::array::from_fn(|k| c[k] - state.world_from_body.position[k]);
        let (v, w) = (state.linear_velocity, state.angular_velocity);
        let at_centre = [
            v[0] + w[1] * r[2] - w[2] * r[1],
            v[1] + w[2] * r[0] - w[0] * r[2],
            v[2] + w[0] * r[1] - w[1] * r[0],
        ];
        let speed = length(at_centre) + length(w) * bounds.radius();
        speed * now.h + 0.5 * length(now.gravity) * now.h * now.h + now.margin
    }

    /// Its box enlarged by `reach`, sideways not beyond what lies under it.
    fn swept(&self, reach: f64) -> Aabb {
        let bounds = &self.bounds;
        let [x0, y0, z0] = bounds.min;
        let [x1, y1, z1] = bounds.max;
        // A height field hit along its normal is hit vertically within five times that (slopes up to 78°).
        Aabb::new(Vector::new(x0, y0, z0 - 5.0 * reach), Vector::new(x1, y1, z1))
    }

    /// The port without key and node range, whose nodes are appended; `None` when it cannot touch.
    fn port(&self, reader: &Reader, reach: f64, nodes: &mut Vec<Node>) -> Option<Port> {
        let patch = Patch::find(&self.placed, &self.bounds, &reader.undisturbed(), reader);
        let vertical = patch.vertical(reach);
        let first = nodes.len();
        nodes_below(&self.placed, &Cut(reader), vertical, nodes);
        if nodes.len() == first && patch.origin[2] < patch.ground + vertical {
            nodes.extend(self.node_between(reader, &patch));
        }
        if nodes.len() == first {
            return None;
        }
        let frame = patch.frame();
        Some(Port {
            key: 0,
            kind: PortKind::Contact as u32,
            side: 1,
            mask: self.mask,
            first: 0,
            body: self.body,
            shape: self.id,
            first_node: 0,
            node_count: 0,
            origin: patch.origin,
            frame,
            extent: extent(&self.placed, reader, &patch, &frame, &nodes[first..]),
            law: Law::UNILATERAL,
        })
    }

    /// A shape smaller than a cell can slip between the nodes: then the nearest one carries it.
    fn node_between(&self, reader: &Reader, patch: &Patch) -> Option<Node> {
        let lattice = reader.lattice();
        let bounds = &self.bounds;
        let (width, depth) = (bounds.max[0] - bounds.min[0], bounds.max[1] - bounds.min[1]);
        let small = width < 2.0 * lattice.spacing && depth < 2.0 * lattice.spacing;
        let [i, j] = lattice.coordinates(patch.origin[0], patch.origin[1]).map(|c| c.round() as i32);
        let area = (width * depth).min(lattice.spacing * lattice.spacing);
        (small && lattice.has(i, j)).then_some(Node {
            i,
            j,
            area,
            lower: patch.origin[2],
            slope: self.placed.underside_slope(patch.origin),
        })
    }
}

fn length(v: [f64; 3]) -> f64 {
    v.iter().map(|c| c * c).sum::<f64>().sqrt()
}

fn is_finite(state: &BodyState) -> bool {
    let pose = &state.world_from_body;
    let all = [pose.position, state.linear_velocity, state.angular_velocity];
    all.iter().flatten().chain(&pose.orientation).all(|c| c.is_finite())
}
