//! Finds the ports of a step: broad phase on boxes and tiles, then frame and nodes of each patch.

use super::ground::{Bounds, Ground, Reader};
use super::port_set::{PortOwner, PortSet, port_key};
use super::shape::{Shape, pieces_of};
use super::touching::Touching;
use super::touching_port::Found;
use parry3d_f64::bounding_volume::Aabb;
use std::ops::Range;
use terraglue_diagnostics::error::{Error, Result};
use terraglue_ground::{Surface, compose};
use terraglue_subsystem::{BodyState, Port, Scene, Subsystem, Terrain};

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
    /// Key and mask of the ports that were found last.
    before: Vec<(u64, u32)>,
    /// The highest epoch so far: none comes again for another set.
    highest: u32,
    buried: Option<String>,
}

struct Bodies {
    subsystem: u32,
    name: String,
    /// Those of one piece one after the other.
    shapes: Vec<Shape>,
    pieces: Vec<Range<usize>>,
    /// [`Touching::relief`] of each piece, m.
    relief: Vec<f64>,
    /// Numbers 0, 1, … of the shapes.
    numbers: Vec<usize>,
    found: Found,
}

impl ContactDetector {
    /// Bodies and grounds in ascending order of their indices. `terrain` replaces the field `height` of a soil that shows
    /// none.
    ///
    /// # Errors
    /// [`Error::Simulation`] when a ground has neither.
    pub fn new(bodies: &[BodySide], grounds: &[GroundSide], terrain: Option<&dyn Terrain>) -> Result<Self> {
        let grounds = grounds.iter().map(|g| Ground::new(g.subsystem, g.instance, terrain));
        Ok(Self {
            bodies: bodies.iter().map(Bodies::of).collect(),
            grounds: grounds.collect::<Result<_>>()?,
            set: PortSet::default(),
            before: Vec::new(),
            highest: 0,
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
        let found = self.set.ports.iter().map(|p| (p.key, p.mask));
        if !self.before.iter().copied().eq(found.clone()) {
            self.highest += 1;
            self.set.epoch = self.highest;
            self.before.clear();
            self.before.extend(found);
        }
    }

    /// For a snapshot: the set of ports that was found last, by which strategies know what still holds.
    pub fn remember(&self) -> Vec<u64> {
        let ports = self.before.iter().flat_map(|(key, mask)| [*key, u64::from(*mask)]);
        std::iter::once(u64::from(self.set.epoch)).chain(ports).collect()
    }

    /// Back to a snapshot.
    pub fn recall(&mut self, kept: &[u64]) {
        let Some((epoch, ports)) = kept.split_first() else { return };
        self.set.epoch = *epoch as u32;
        self.highest = self.highest.max(self.set.epoch);
        self.before.clear();
        self.before.extend(ports.chunks_exact(2).map(|port| (port[0], port[1] as u32)));
    }
}

fn failed(now: &Now, message: String) -> Error {
    Error::Simulation { time_s: now.t, message }
}

impl Bodies {
    fn of(side: &BodySide) -> Self {
        let (shapes, pieces) = pieces_of(side.scene);
        let found = Found::with_capacity(pieces.iter().map(Range::len).max().unwrap_or(0));
        let numbers: Vec<usize> = (0..shapes.len()).collect();
        let relief =
            |piece: &Range<usize>| Touching::of(&shapes, &numbers[piece.clone()]).map_or(0.0, |t| t.relief());
        let relief = pieces.iter().map(relief).collect();
        Self { subsystem: side.subsystem, name: side.name.into(), shapes, pieces, relief, numbers, found }
    }

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

    /// Adds the ports of all pieces on one ground.
    fn meet(
        &mut self,
        now: &Now,
        states: &[BodyState],
        ground: u32,
        (reader, bounds): (&Reader, &mut Bounds),
        (set, buried): (&mut PortSet, &mut Option<String>),
    ) -> Result {
        for p in 0..self.pieces.len() {
            let piece = self.pieces[p].clone();
            let relief = self.relief[p];
            let reach = self.near(now, states, (piece.clone(), relief), (reader, bounds))?;
            if self.found.near.is_empty() {
                continue;
            }
            if buried.is_none() {
                *buried = self.buried(piece.clone(), reader);
            }
            let first_node = set.nodes.len();
            let Some(port) = self.found.port(&self.shapes, reader, [reach, relief], &mut set.nodes) else {
                continue;
            };
            let node_count = (set.nodes.len() - first_node) as u32;
            let (body, shape) = (port.body, port.shape);
            set.ports.push(Port {
                key: port_key(self.subsystem, ground, self.shapes[piece.start].id),
                first_node: first_node as u32,
                node_count,
                ..port
            });
            set.owners.push(PortOwner { subsystem: self.subsystem, ground, body, shape });
        }
        Ok(())
    }

    /// Finds which shapes of a piece of some relief (m) come near the ground, and how far any of them can get, m.
    fn near(
        &mut self,
        now: &Now,
        states: &[BodyState],
        (piece, relief): (Range<usize>, f64),
        (reader, bounds): (&Reader, &mut Bounds),
    ) -> Result<f64> {
        self.found.near.clear();
        let mut farthest = 0.0_f64;
        for k in piece {
            let shape = &self.shapes[k];
            let reach = shape.reach(now, &states[shape.body as usize]);
            let swept = shape.swept(reach);
            let below = shape.swept(reach + relief);
            if self.is_over(now, shape, reader, &swept)? && bounds.meets(reader, &below) {
                self.found.near.push(k);
                farthest = farthest.max(reach);
            }
        }
        Ok(farthest)
    }

    /// Message on a piece that is buried by more than its own height: no soil models the material on top of it.
    fn buried(&self, piece: Range<usize>, reader: &Reader) -> Option<String> {
        let whole = Touching::of(&self.shapes, &self.numbers[piece.clone()])?.bounds;
        let [x, y, _] = whole.centre();
        let [i, j] = reader.lattice().coordinates(x, y).map(|c| c.round() as i32);
        let level = reader.undisturbed().height(i, j);
        let (height, covered) = (whole.max[2] - whole.min[2], level - whole.max[2]);
        (covered > height).then(|| {
            format!(
                "`{}` of {} is buried: the ground at x = {x:.3} m, y = {y:.3} m was {covered:.3} m above its top, and it is \
                 {height:.3} m high; the ground is too weak for its load (take a stronger soil or a larger foot), or it starts \
                 below it",
                self.shapes[piece.start].name, self.name
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
            shape.name,
            self.name,
            plain(low[0]),
            plain(high[0]),
            plain(low[1]),
            plain(high[1])
        );
        Err(failed(now, message))
    }
}

/// A length without the digits that arithmetic leaves.
fn plain(x: f64) -> f64 {
    (x * 1e6).round() / 1e6
}

fn is_finite(state: &BodyState) -> bool {
    let pose = &state.world_from_body;
    let all = [pose.position, state.linear_velocity, state.angular_velocity];
    all.iter().flatten().chain(&pose.orientation).all(|c| c.is_finite())
}
