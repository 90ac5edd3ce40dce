//! Sight of an isolated instance: while it observes, its process asks and the host answers from the committed world, one
//! exchange for each batch, so the answers are those of an instance that is not isolated.

use super::calls::{Call, OwnedStep};
use super::tiles::Tile;
use super::wire::{Reader, Wire, Writer};
use super::worker_channel::WorkerChannel;
use std::cell::OnceCell;
use terraglue_subsystem::{
    BodyRef, BodyState, Error, FieldInfo, FieldTile, Ray, RayHit, RayMask, Result, Scene, ShapeRef,
    Subsystem, World,
};

/// Questions of an instance while it observes.
pub enum Question {
    Names,
    Scene(u32),
    Visible(ShapeRef),
    Pose(BodyRef, f64),
    Rays(RayMask, Vec<Ray>),
    Heights(Vec<[f64; 2]>),
    Overlap(RayMask, [f64; 3], f64),
    Fields(u32),
    Tile(u32, u32, [u32; 2]),
}

impl Question {
    fn put(&self, w: &mut Writer) {
        match self {
            Self::Names => w.put(&1_u8),
            Self::Scene(k) => (w.put(&2_u8), w.put(k)).0,
            Self::Visible(shape) => (w.put(&3_u8), w.put(shape)).0,
            Self::Pose(body, time) => (w.put(&4_u8), w.put(body), w.put(time)).0,
            Self::Rays(mask, rays) => put_rays(w, mask, rays),
            Self::Heights(points) => (w.put(&6_u8), w.put(points)).0,
            Self::Overlap(mask, centre, radius) => {
                (w.put(&7_u8), w.put(mask), w.put(centre), w.put(radius)).0
            }
            Self::Fields(k) => (w.put(&8_u8), w.put(k)).0,
            Self::Tile(k, field, place) => (w.put(&9_u8), w.put(k), w.put(field), w.put(place)).0,
        }
    }

    /// Content of the answer to [`Call::Observe`]: a question, or the end of them.
    pub fn take(r: &mut Reader) -> Option<Option<Self>> {
        Some(Some(match r.take::<u8>()? {
            0 => return Some(None),
            1 => Self::Names,
            2 => Self::Scene(r.take()?),
            3 => Self::Visible(r.take()?),
            4 => Self::Pose(r.take()?, r.take()?),
            5 => Self::Rays(r.take()?, r.take()?),
            6 => Self::Heights(r.take()?),
            7 => Self::Overlap(r.take()?, r.take()?, r.take()?),
            8 => Self::Fields(r.take()?),
            9 => Self::Tile(r.take()?, r.take()?, r.take()?),
            _ => return None,
        }))
    }

    /// Writes the answer of the world.
    pub fn answer(&self, world: &dyn World, w: &mut Writer) {
        match self {
            Self::Names => w.put(world.subsystems()),
            Self::Scene(k) => put_option(w, world.scene(*k)),
            Self::Visible(shape) => w.put(&world.is_visible(*shape)),
            Self::Pose(body, time) => put_option(w, world.pose(*body, *time).as_ref()),
            Self::Rays(mask, rays) => {
                let mut hits = vec![RayHit::MISS; rays.len()];
                world.cast_rays(rays, mask, &mut hits);
                w.put(&hits);
            }
            Self::Heights(points) => {
                let mut heights = vec![f64::NAN; points.len()];
                world.ground_heights(points, &mut heights);
                w.put(&heights);
            }
            Self::Overlap(mask, centre, radius) => {
                let mut found = Vec::new();
                world.overlap(*centre, *radius, mask, &mut found);
                w.put(&found);
            }
            Self::Fields(k) => w.put(world.fields(*k)),
            Self::Tile(k, field, [a, b]) => {
                let tile = world.field_tile(*k, *field as usize, *a, *b).ok();
                put_option(w, tile.as_ref().map(Tile::of).as_ref());
            }
        }
    }
}

fn put_rays(w: &mut Writer, mask: &RayMask, rays: &[Ray]) {
    w.put(&5_u8);
    w.put(mask);
    w.put(rays);
}

fn put_option<T: Wire>(w: &mut Writer, value: Option<&T>) {
    w.put(&u8::from(value.is_some()));
    if let Some(value) = value {
        w.put(value);
    }
}

fn take_option<T: Wire>(r: &mut Reader) -> Option<Option<T>> {
    Some(match r.take::<u8>()? {
        0 => None,
        _ => Some(r.take()?),
    })
}

/// Copies of names and scenes in a worker; requested once for each revision of the world.
#[derive(Default)]
pub struct Known {
    revision: Option<u64>,
    names: Vec<String>,
    subsystems: Vec<Others>,
}

/// Another subsystem, asked for when it is needed.
#[derive(Default)]
struct Others {
    scene: OnceCell<Option<Scene>>,
    fields: OnceCell<Vec<FieldInfo>>,
}

/// Tiles of the fields of one subsystem, for one call of `observe`.
type TilesOf = OnceCell<Vec<Vec<OnceCell<Option<Tile>>>>>;

/// The host's world as its worker sees it.
struct AskingWorld<'a> {
    channel: &'a WorkerChannel,
    known: &'a Known,
    interval: [f64; 2],
    tiles: Vec<TilesOf>,
}

/// Lets the instance look, and passes its questions to the host.
///
/// # Errors
/// Errors of the instance. [`Error::Fatal`]: the call is garbled.
pub fn observe(
    subsystem: &mut dyn Subsystem,
    r: &mut Reader,
    channel: &WorkerChannel,
    known: &mut Known,
) -> Result {
    let garbled = || Error::Fatal("the call is garbled".into());
    let step = OwnedStep::take(r).ok_or_else(garbled)?;
    let (interval, revision) = (r.take().ok_or_else(garbled)?, r.take().ok_or_else(garbled)?);
    if known.revision != Some(revision) {
        let names: Vec<String> = ask(channel, &Question::Names, |r| r.take()).ok_or_else(garbled)?;
        let subsystems = names.iter().map(|_| Others::default()).collect();
        *known = Known { revision: Some(revision), names, subsystems };
    }
    let tiles = known.names.iter().map(|_| TilesOf::default()).collect();
    subsystem.observe(&step.step(), &AskingWorld { channel, known, interval, tiles })
}

fn ask<T>(
    channel: &WorkerChannel,
    question: &Question,
    read: impl FnOnce(&mut Reader) -> Option<T>,
) -> Option<T> {
    read_answer(&channel.ask(|w| question.put(w))?, read)
}

fn read_answer<T>(bytes: &[u8], read: impl FnOnce(&mut Reader) -> Option<T>) -> Option<T> {
    let mut r = Reader::new(bytes);
    (r.take::<u8>()? == Call::Answer as u8).then(|| read(&mut r)).flatten()
}

impl World for AskingWorld<'_> {
    fn revision(&self) -> u64 {
        self.known.revision.unwrap_or(0)
    }

    fn interval(&self) -> [f64; 2] {
        self.interval
    }

    fn subsystems(&self) -> &[String] {
        &self.known.names
    }

    fn scene(&self, subsystem: u32) -> Option<&Scene> {
        let others = self.known.subsystems.get(subsystem as usize)?;
        let asked = || ask(self.channel, &Question::Scene(subsystem), take_option).flatten();
        others.scene.get_or_init(asked).as_ref()
    }

    fn is_visible(&self, shape: ShapeRef) -> bool {
        ask(self.channel, &Question::Visible(shape), |r| r.take()).unwrap_or(false)
    }

    fn pose(&self, body: BodyRef, time: f64) -> Option<BodyState> {
        ask(self.channel, &Question::Pose(body, time), take_option).flatten()
    }

    fn cast_rays(&self, rays: &[Ray], mask: &RayMask, hits: &mut [RayHit]) {
        let n = rays.len().min(hits.len());
        hits[..n].fill(RayHit::MISS);
        for (rays, hits) in rays[..n].chunks(BATCH).zip(hits[..n].chunks_mut(BATCH)) {
            let answer = self.channel.ask(|w| put_rays(w, mask, rays));
            let found: Option<Vec<RayHit>> = answer.and_then(|bytes| read_answer(&bytes, |r| r.take()));
            hits.iter_mut().zip(found.into_iter().flatten()).for_each(|(hit, found)| *hit = found);
        }
    }

    fn ground_heights(&self, points: &[[f64; 2]], heights: &mut [f64]) {
        let n = points.len().min(heights.len());
        heights[..n].fill(f64::NAN);
        for (points, heights) in points[..n].chunks(BATCH).zip(heights[..n].chunks_mut(BATCH)) {
            ask(self.channel, &Question::Heights(points.to_vec()), |r| r.fill(heights));
        }
    }

    fn overlap(&self, centre: [f64; 3], radius: f64, mask: &RayMask, found: &mut Vec<ShapeRef>) {
        let question = Question::Overlap(*mask, centre, radius);
        *found = ask(self.channel, &question, |r| r.take()).unwrap_or_default();
    }

    fn fields(&self, subsystem: u32) -> &[FieldInfo] {
        let Some(others) = self.known.subsystems.get(subsystem as usize) else { return &[] };
        let asked = || ask(self.channel, &Question::Fields(subsystem), |r| r.take()).unwrap_or_default();
        others.fields.get_or_init(asked)
    }

    fn field_tile(&self, subsystem: u32, field: usize, a: u32, b: u32) -> Result<FieldTile<'_>> {
        let none = || Error::Refused(format!("no tile ({a}, {b}) of field {field}"));
        let info = self.fields(subsystem).get(field).ok_or_else(none)?;
        let across = |k: usize| info.size[k].div_ceil(info.tile_edge.max(1));
        let cells = |f: &FieldInfo| {
            let count = [0, 1].map(|k| f.size[k].div_ceil(f.tile_edge.max(1)) as usize);
            (0..count[0] * count[1]).map(|_| OnceCell::new()).collect()
        };
        let tiles = self.tiles.get(subsystem as usize).ok_or_else(none)?;
        let tiles = tiles.get_or_init(|| self.fields(subsystem).iter().map(cells).collect());
        if a >= across(0) || b >= across(1) {
            return Err(none());
        }
        let cell = &tiles[field][(b * across(0) + a) as usize];
        let question = Question::Tile(subsystem, field as u32, [a, b]);
        let asked = || ask(self.channel, &question, take_option).flatten();
        let found: Option<&Tile> = cell.get_or_init(asked).as_ref();
        found.filter(|tile| tile.holds(info.tile_edge)).map(Tile::shown).ok_or_else(none)
    }
}

/// Rays or points of one exchange, which fit into the shared memory with room to spare.
const BATCH: usize = 1 << 18;
