//! Rays through everything: grounds, what moves, what is fixed. The nearest hit counts, whatever was looked at first.

use crate::fixed::Met;
use crate::ground::{Ground, Path};
use crate::model::{GROUND_MATERIAL, Member, WorldModel};
use crate::tree::{Line, Stack};
use std::sync::{Mutex, PoisonError};
use terraglue_numerics::rotation::{dot, length};
use terraglue_subsystem::{GROUND, Ray, RayHit, RayMask};

/// Rays that a thread takes at once.
const BATCH: usize = 256;
/// Directions that differ from unit length by less than this are taken as they are.
const UNIT: f64 = 1e-12;

/// Room that one ray after the other uses, and the grounds that they can meet.
struct Room<'a> {
    stacks: [Stack; 2],
    path: Path,
    grounds: Vec<(u32, &'a Member, &'a Ground)>,
}

/// The nearest thing so far.
struct Nearest {
    distance: f64,
    /// Rank of the shape and number of the triangle: of two hits at one distance the lower counts.
    key: (u32, u32),
    what: What,
}

#[derive(Clone, Copy)]
enum What {
    Nothing,
    /// Of the subsystem with this number.
    Ground(u32, [f64; 3]),
    Moving([u32; 2]),
    Fixed(Met),
}

impl Nearest {
    /// Whether a hit would count.
    #[inline(always)]
    fn is_beaten_by(&self, distance: f64) -> bool {
        distance <= self.distance && distance < f64::INFINITY
    }

    #[inline(always)]
    fn offer(&mut self, distance: f64, key: (u32, u32), what: What) {
        if distance < self.distance || key < self.key {
            *self = Self { distance, key, what };
        }
    }
}

impl WorldModel {
    /// Rays on all threads; each answer is the same on any number of them.
    pub(crate) fn cast_batch(&self, rays: &[Ray], mask: &RayMask, hits: &mut [RayHit]) {
        let n = rays.len().min(hits.len());
        let (rays, hits) = (&rays[..n], &mut hits[..n]);
        match &self.parallel {
            Some(parallel) if n > BATCH => {
                let parts: Vec<_> = rays.chunks(BATCH).zip(hits.chunks_mut(BATCH)).map(Mutex::new).collect();
                parallel(parts.len(), &|k| {
                    let mut part = parts[k].lock().unwrap_or_else(PoisonError::into_inner);
                    let (rays, hits) = &mut *part;
                    self.cast_some(rays, mask, hits);
                });
            }
            _ => self.cast_some(rays, mask, hits),
        }
    }

    fn cast_some(&self, rays: &[Ray], mask: &RayMask, hits: &mut [RayHit]) {
        let grounds = self.grounds(mask).collect();
        let mut room = Room { stacks: Default::default(), path: Path::default(), grounds };
        for (ray, hit) in rays.iter().zip(hits) {
            *hit = match line(ray) {
                Some(line) => self.cast_line(&line, ray, mask, &mut room),
                None => RayHit::MISS,
            };
        }
    }

    #[inline(always)]
    fn cast_line(&self, line: &Line, ray: &Ray, mask: &RayMask, room: &mut Room) -> RayHit {
        let share = self.share(ray.time);
        let mut nearest = Nearest { distance: ray.range, key: (u32::MAX, u32::MAX), what: What::Nothing };
        if mask.sees & RayMask::SHAPES != 0 {
            self.cast_shapes((line, share), mask, room, &mut nearest);
        }
        for (subsystem, member, ground) in &room.grounds {
            // what lies exactly at the distance of another still counts by its key
            if let Some((t, normal)) = ground.cast(line, nearest.distance.next_up(), &mut room.path)
                && nearest.is_beaten_by(t)
            {
                nearest.offer(t, (member.ground_rank, 0), What::Ground(*subsystem, normal));
            }
        }
        self.hit(line, share, &nearest)
    }

    #[inline(always)]
    fn cast_shapes(
        &self,
        (line, share): (&Line, f64),
        mask: &RayMask,
        room: &mut Room,
        nearest: &mut Nearest,
    ) {
        self.moving.cast(
            (line, share),
            &self.bodies,
            nearest.distance,
            &mut room.stacks,
            |t, [k, number]| {
                if nearest.is_beaten_by(t) {
                    let shape = self.moving.shape(k).shape;
                    if self.is_met(shape, mask) {
                        let key = (self.shapes[shape as usize].rank, number);
                        nearest.offer(t, key, What::Moving([k, number]));
                    }
                }
                nearest.distance
            },
        );
        self.fixed.cast(line, nearest.distance, &mut room.stacks[0], |t, met| {
            if nearest.is_beaten_by(t) {
                let (shape, number) = self.fixed.what(met);
                if self.is_met(shape, mask) {
                    nearest.offer(t, (self.shapes[shape as usize].rank, number), What::Fixed(met));
                }
            }
            nearest.distance
        });
    }

    /// The hit that is reported for the nearest object.
    fn hit(&self, line: &Line, share: f64, nearest: &Nearest) -> RayHit {
        let t = nearest.distance;
        let (shape, outward) = match nearest.what {
            What::Nothing => return RayHit::MISS,
            What::Ground(subsystem, normal) => {
                return RayHit {
                    distance: t,
                    normal: against(normal, line.direction),
                    subsystem,
                    body: GROUND,
                    shape: GROUND,
                    material: GROUND_MATERIAL,
                };
            }
            What::Moving(which) => {
                let outward = self.moving.outward(which, (line, share), &self.bodies, t);
                (self.moving.shape(which[0]).shape, outward)
            }
            What::Fixed(met) => (self.fixed.what(met).0, self.fixed.outward(met, line, t)),
        };
        let shape = &self.shapes[shape as usize];
        RayHit {
            distance: t,
            normal: against(outward, line.direction),
            subsystem: shape.of.subsystem,
            body: shape.of.body,
            shape: shape.of.shape,
            material: shape.material,
        }
    }
}

/// The line of a ray; none: it has no direction, no range, or numbers that are none.
fn line(ray: &Ray) -> Option<Line> {
    let d = ray.direction;
    let size = length(d);
    let sound = size > 0.0 && size.is_finite() && ray.range > 0.0 && ray.time.is_finite();
    if !sound || ray.origin.iter().any(|x| !x.is_finite()) {
        return None;
    }
    let direction = if (size - 1.0).abs() < UNIT { d } else { d.map(|x| x / size) };
    Some(Line { origin: ray.origin, direction })
}

/// A unit normal that looks against a ray.
fn against(normal: [f64; 3], direction: [f64; 3]) -> [f64; 3] {
    let size = length(normal);
    if !(size > 0.0 && size.is_finite()) {
        return direction.map(|x| -x);
    }
    let sign = if dot(normal, direction) > 0.0 { -1.0 } else { 1.0 };
    normal.map(|x| sign * x / size)
}
