//! Wheels: which contacts roll, how fast they slip, and the shifted peak of their stress.
//!
//! A wheel is recognised by its underside, not by its name: where the nodes lie on a circular cylinder, each of them is
//! r·(m − ν) away from the lowest line, with ν the inward normal there and m that of the lowest line: the vertical, or that of a
//! wheel that leans. A flat foot, whose normals are all alike, and a sphere, which is round in both directions, do not roll.

use crate::contact_memory::Remembered;
use crate::grousers::{Grousers, Point, Rim, Section, is_across};
use crate::patch_nodes::PatchNodes;
use crate::vectors::dot;
use terraglue_numerics::rotation::cross;
use terraglue_soil_law::Rolling;

/// Largest squared distance of nodes from the circle over their squared distance from the lowest line.
const ROUND: f64 = 1e-2;
/// Smallest scatter of the normals of a round underside.
const CURVED: f64 = 1e-8;
/// Largest scatter across the travel over that along it: a wheel may lean a little.
const LEVEL: f64 = 0.02;
/// Nodes whose normal leans further are not looked at: slopes are cut at 72°, cos = 0.31.
const LEANING: f64 = 0.35;

/// Part of its cell from which on a node counts as covered.
const WHOLE: f64 = 0.999;
/// Fewer covered nodes than these do not determine a circle.
const FEW: usize = 4;

/// Memory of a contact that rolls. Part of the committed state.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Memory {
    /// Key of the port.
    pub key: u64,
    /// Slip (w − v)/max(|w|, |v|) with w the way of the rim and v that of the axle: 0 rolls, 1 spins, −1 is locked;
    /// smoothed over the length of the contact.
    pub slip: f64,
    /// Whether the way of the axle points along [`Wheel::heading`].
    pub forward: bool,
    /// Radius of the underside as it was found last, that of the rim where there are grousers, m; 0: never.
    pub radius: f64,
    /// Direction of travel along t1 and t2, as it was found last.
    pub heading: [f64; 2],
    /// Lean as it was found last, see [`Wheel::lean`].
    pub lean: f64,
    /// Grousers on the rim.
    pub grousers: Grousers,
}

/// A contact that can roll, at the start of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wheel {
    /// Radius of the underside, that of the tips of grousers, m.
    pub radius: f64,
    /// The rim between grousers, where it was found in this step.
    pub rim: Option<Rim>,
    /// Direction of travel along t1 and t2, unit length; its sign is arbitrary.
    pub heading: [f64; 2],
    /// Angle by which the axle leans out of the level: the normal m of the lowest line has the parts cos along n and sin across the
    /// travel (n × heading), rad.
    pub lean: f64,
    /// Whether it rolls for the first time.
    pub first: bool,
    /// Length of the loaded nodes across the travel, m.
    pub width: f64,
    /// Half the length of the contact along the travel, as the depth makes it, m.
    pub length: f64,
    /// As of the last commit.
    pub memory: Memory,
}

impl Wheel {
    /// The wheel whose underside the nodes in `range` are; `None` where the contact does not roll. A wheel stays one where too few nodes
    /// are left to look round, as on an edge or a crest. How far it is in the soil follows from [`Wheel::loaded`].
    pub fn find(
        nodes: &PatchNodes,
        range: std::ops::Range<usize>,
        spacing: f64,
        memory: Memory,
    ) -> Option<Self> {
        let used = || used(nodes, range.clone());
        // at an edge the underside is that of the nearest point, not that at the node: it makes the circle smaller
        let whole = |k: &usize| nodes.area[*k] > WHOLE * spacing * spacing;
        let least = if used().filter(whole).count() < FEW { 0.0 } else { WHOLE * spacing * spacing };
        let inner = || used().filter(move |k| nodes.area[*k] > least);
        let normals = || inner().map(|k| nodes.facing[k].inward());
        let axle = heading(normals()).and_then(|heading| across_axle(normals(), heading));
        let found = axle.and_then(|(heading, lean)| {
            let section = Section::new(heading, lean);
            let points = inner().map(|k| (section.of(nodes.arm[k]), section.of(nodes.facing[k].inward())));
            // few nodes at edges do not tell a rim behind grousers
            let (radius, rim) = if least > 0.0 || memory.grousers.is_sure() {
                circle(points.clone(), &memory)?
            } else {
                (radius(points.clone())?, None)
            };
            let grousers = rim.map_or(Grousers::default(), |rim| {
                let before = if rim.has(memory.radius) { memory.grousers } else { Grousers::default() };
                before.seen(&rim, points.filter(is_across))
            });
            Some((Memory { radius, heading, lean, grousers, ..memory }, rim))
        });
        let known = (memory.radius > 0.0).then_some((memory, None));
        let (now, rim) = found.or(known)?;
        Some(Self {
            radius: now.radius + now.grousers.height,
            rim,
            heading: now.heading,
            lean: now.lean,
            first: memory.radius == 0.0,
            width: 0.0,
            length: 0.0,
            memory: now,
        })
    }

    /// The same with width and length of its contact; `None` where it does not touch.
    pub fn loaded(self, nodes: &PatchNodes, range: std::ops::Range<usize>, spacing: f64) -> Option<Self> {
        let pressed = || used(nodes, range.clone()).filter(|k| nodes.depth[*k] > nodes.permanent[*k]);
        let across = |k: usize| nodes.arm[k][2] * self.heading[0] - nodes.arm[k][1] * self.heading[1];
        let (sum, mean) =
            pressed().fold((0.0, 0.0), |(s, m), k| (s + nodes.area[k], m + nodes.area[k] * across(k)));
        if sum <= 0.0 {
            return None;
        }
        let mean = mean / sum;
        let variance = pressed().map(|k| nodes.area[k] * (across(k) - mean).powi(2)).sum::<f64>() / sum;
        let deepest = pressed().fold(0.0_f64, |m, k| m.max(nodes.depth[k]));
        // rows of cells of equal load scatter by (W² − Δ²)/12
        let width = (12.0 * variance + spacing * spacing).sqrt();
        let length = (deepest * (2.0 * self.radius - deepest).max(0.0)).sqrt();
        Some(Self { width, length, ..self })
    }

    /// Ways of the rim and of the axle along the heading for a motion `x` (n, t1, t2 and rotations), m.
    pub fn ways(&self, x: &[f64; 6]) -> [f64; 2] {
        let along = |v: [f64; 2]| v[0] * self.heading[0] + v[1] * self.heading[1];
        // the axle lies above the port: θ × r·m along the heading
        let (sin, cos) = (libm::sin(self.lean), libm::cos(self.lean));
        let turn = cos * along([x[5], -x[4]]) - sin * x[3];
        [self.radius * turn, along([x[1], x[2]]) + self.above()[0] * turn]
    }

    /// The axle as seen from the port, towards the axle and along the heading, m: right above the lowest line of a smooth wheel.
    pub fn above(&self) -> [f64; 2] {
        self.rim.map_or([self.radius, 0.0], |rim| rim.axle)
    }

    /// The axle as seen from the port: along n, t1 and t2, m.
    pub fn axle(&self) -> [f64; 3] {
        Section::new(self.heading, self.lean).vector(self.above())
    }

    /// Direction along t1 and t2 in which the wheel is driven: that of the larger way of rim and axle.
    pub fn driven(&self, x: &[f64; 6]) -> [f64; 2] {
        let [rim, axle] = self.ways(x);
        let way = if rim.abs() >= axle.abs() { rim } else { axle };
        let back = way < 0.0 || way == 0.0 && !self.memory.forward;
        self.heading.map(|c| if back { -c } else { c })
    }

    /// Direction in which points of the rim come down, along t1 and t2, unit length: ahead if it turns forward,
    /// whichever way the axle goes; `None` if it is locked.
    pub fn entry(&self, x: &[f64; 6]) -> Option<[f64; 2]> {
        let [rim, _] = self.ways(x);
        (rim != 0.0).then(|| self.heading.map(|c| rim.signum() * c))
    }

    /// The memory after the foot has moved by `x` (n, t1, t2 and rotations).
    pub fn rolled(&self, x: &[f64; 6]) -> Memory {
        let [rim, axle] = self.ways(x);
        let way = rim.abs().max(axle.abs());
        if way <= f64::MIN_POSITIVE {
            return self.memory;
        }
        let now = ((rim - axle) * (rim + axle).signum() / way).clamp(-1.0, 1.0);
        let share = if self.first { 1.0 } else { (way / self.length.max(f64::MIN_POSITIVE)).min(1.0) };
        let slip = self.memory.slip + share * (now - self.memory.slip);
        let forward = if axle.abs() > 1e-9 * way { axle > 0.0 } else { self.memory.forward };
        Memory { slip, forward, ..self.memory }
    }

    /// Angle of a node from the lowest line, rad, positive where soil enters.
    fn angle(&self, arm: [f64; 3]) -> f64 {
        let sign = if self.memory.forward { 1.0 } else { -1.0 };
        let ahead = sign * (arm[1] * self.heading[0] + arm[2] * self.heading[1] - self.above()[1]);
        libm::asin((ahead / self.radius).clamp(-1.0, 1.0))
    }

    /// The shifted stress of this step; `None` where it follows the depth.
    pub fn shift(
        &self,
        rolling: &Rolling,
        nodes: &PatchNodes,
        range: std::ops::Range<usize>,
    ) -> Option<Shift> {
        let share = rolling.peak_share(self.memory.slip);
        let used = || range.clone().filter(|k| nodes.area[*k] > 0.0).map(|k| (k, self.angle(nodes.arm[k])));
        // Nodes near the bottom may carry nothing: the soil left there is not the soil ahead.
        let front = used().filter(|(k, _)| nodes.stamp[*k] != 0).fold(0.0_f64, |front, (_, a)| front.max(a));
        let (mut bottom, mut sum, mut count) = (0.0_f64, 0.0, 0.0);
        for (k, angle) in used() {
            if nodes.depth[k] > nodes.permanent[k] {
                bottom = bottom.max(nodes.depth[k] + self.radius * (1.0 - libm::cos(angle)));
            }
            if nodes.stamp[k] == 0 && angle > front {
                sum += nodes.top(k);
                count += 1.0;
            }
        }
        let before = if count > 0.0 { sum / count } else { 0.0 };
        let entry = libm::acos(1.0 - ((bottom - before) / self.radius).clamp(0.0, 1.0));
        (share > 0.0 && entry > 0.0).then_some(Shift { entry, peak: share * entry, before })
    }

    /// Reduction of the depth that counts for a node behind the peak, m: there the stress is that of the angle in front
    /// which lies as far from the entry, in its share, as the node does from the exit at the bottom. `None` in front of
    /// the peak and behind the bottom.
    pub fn relief(&self, shift: &Shift, arm: [f64; 3]) -> Option<f64> {
        let angle = self.angle(arm);
        if angle >= shift.peak || angle < 0.0 {
            return None;
        }
        let equal = shift.entry - angle * (shift.entry - shift.peak) / shift.peak;
        Some((self.radius * (libm::cos(angle) - libm::cos(equal))).max(0.0))
    }
}

/// Position of the largest stress below a wheel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shift {
    /// Angle at which the soil enters, rad.
    pub entry: f64,
    /// Angle of the largest stress, rad.
    pub peak: f64,
    /// Permanent depth of the soil ahead, m.
    pub before: f64,
}

/// Nodes below a wheel that are looked at.
fn used(nodes: &PatchNodes, range: std::ops::Range<usize>) -> impl Iterator<Item = usize> + Clone {
    range.filter(|k| nodes.area[*k] > 0.0 && nodes.facing[*k].inward()[0] > LEANING)
}

/// Direction in which the normals turn; `None` where they are all alike or turn in both.
fn heading(normals: impl Iterator<Item = [f64; 3]> + Clone) -> Option<[f64; 2]> {
    let (mut count, mut mean, mut square) = (0.0, [0.0; 2], [0.0; 3]);
    for [_, a, b] in normals {
        count += 1.0;
        mean = [mean[0] + a, mean[1] + b];
        square = [square[0] + a * a, square[1] + a * b, square[2] + b * b];
    }
    if count < 2.0 {
        return None;
    }
    let m = mean.map(|m| m / count);
    let (xx, xy, yy) =
        (square[0] / count - m[0] * m[0], square[1] / count - m[0] * m[1], square[2] / count - m[1] * m[1]);
    let (half, middle) = ((0.25 * (xx - yy) * (xx - yy) + xy * xy).sqrt(), 0.5 * (xx + yy));
    let (large, small) = (middle + half, middle - half);
    if large < CURVED || small > LEVEL * large {
        return None;
    }
    let v = if xx >= yy { [xx - small, xy] } else { [xy, yy - small] };
    let length = (v[0] * v[0] + v[1] * v[1]).sqrt();
    // x is the usual direction of travel: its sign is kept
    let sign = if v[0] + 1e-6 * v[1] < 0.0 { -1.0 } else { 1.0 };
    (length > 0.0).then(|| v.map(|c| sign * c / length))
}

/// Heading and lean of the axle to which all normals of a cylinder are perpendicular; `heading` says roughly, and with its sign, where it
/// goes. The axle spans the null space of Σ ν νᵀ, as the cross product of two of its rows does.
fn across_axle(normals: impl Iterator<Item = [f64; 3]>, heading: [f64; 2]) -> Option<([f64; 2], f64)> {
    let mut rows = [[0.0; 3]; 3];
    for nu in normals {
        for (row, a) in rows.iter_mut().zip(nu) {
            row.iter_mut().zip(nu).for_each(|(sum, b)| *sum += a * b);
        }
    }
    let axles = [[0, 1], [1, 2], [2, 0]].map(|[a, b]| cross(rows[a], rows[b]));
    let axle = axles.into_iter().fold([0.0; 3], |most, a| if dot(a, a) > dot(most, most) { a } else { most });
    let level = (axle[1] * axle[1] + axle[2] * axle[2]).sqrt();
    if level <= 0.0 {
        return None;
    }
    let ahead = [axle[2] / level, -axle[1] / level];
    let sign = if ahead[0] * heading[0] + ahead[1] * heading[1] < 0.0 { -1.0 } else { 1.0 };
    Some((ahead.map(|c| sign * c), libm::atan2(-sign * axle[0], level)))
}

/// Radius of the circle on which the points lie, and the rim where grousers stand out of it or were known to do so; `None` where they
/// lie on none.
fn circle(points: impl Iterator<Item = Point> + Clone, known: &Memory) -> Option<(f64, Option<Rim>)> {
    if known.grousers.is_sure() {
        return Rim::find(points.filter(is_across), known.radius).map(|rim| (rim.radius, Some(rim)));
    }
    let plain = radius(points.clone());
    let even = plain.filter(|radius| Rim::is_even(*radius, points.clone()));
    if let Some(radius) = even {
        return Some((radius, None));
    }
    let rim = Rim::find(points.filter(is_across), 0.0).map(|rim| (rim.radius, Some(rim)));
    rim.or_else(|| plain.map(|radius| (radius, None)))
}

/// Radius of the circle through the port on which the points lie; `None` where they lie on none.
fn radius(points: impl Iterator<Item = Point> + Clone) -> Option<f64> {
    let pairs = points.map(|(arm, [up, along])| (arm, [1.0 - up, -along]));
    let of = |a: [f64; 2], b: [f64; 2]| a[0] * b[0] + a[1] * b[1];
    let (product, square) = pairs.clone().fold((0.0, 0.0), |(p, s), (a, b)| (p + of(a, b), s + of(b, b)));
    if square <= 0.0 || product <= 0.0 {
        return None;
    }
    let radius = product / square;
    let off = pairs.clone().fold((0.0, 0.0), |(e, all), (a, b)| {
        let d = [a[0] - radius * b[0], a[1] - radius * b[1]];
        (e + of(d, d), all + of(a, a))
    });
    (off.0 <= ROUND * off.1).then_some(radius)
}

impl Remembered for Memory {
    /// A wheel that was never seen rolls forward without slip.
    fn new(key: u64) -> Self {
        Self { key, forward: true, ..Self::default() }
    }
    fn key(&self) -> u64 {
        self.key
    }
}

terraglue_subsystem::persist!(Memory { key, slip, forward, radius, heading, lean, grousers });

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact_memory::recall;
    use crate::patch_nodes::Facing;

    const RADIUS: f64 = 0.15;

    /// Nodes below a wheel that travels along `angle` and leans by `lean`, sunk by 1 cm.
    fn wheel(angle: f64, lean: f64) -> PatchNodes {
        let mut nodes = PatchNodes::default();
        let (s, c) = (libm::sin(angle), libm::cos(angle));
        for i in -6..=6 {
            for j in -5..=5 {
                let (along, across) = (0.01 * f64::from(i), 0.01 * f64::from(j));
                let root = (RADIUS * RADIUS - along * along).sqrt();
                let slope = [along / root * c - lean * s, along / root * s + lean * c];
                let rise = RADIUS - root + lean * across;
                push(&mut nodes, [rise, along * c - across * s, along * s + across * c], slope);
            }
        }
        nodes
    }

    fn push(nodes: &mut PatchNodes, arm: [f64; 3], slope: [f64; 2]) {
        nodes.index.push([0, 0]);
        nodes.arm.push(arm);
        nodes.depth.push(0.01 - arm[0]);
        nodes.permanent.push(0.0);
        nodes.bed.push(0.0);
        nodes.loose.push(0.0);
        nodes.area.push(1e-4);
        nodes.stamp.push(0);
        let press = [1.0, -slope[0], -slope[1]];
        let stretch = (1.0 + slope[0] * slope[0] + slope[1] * slope[1]).sqrt();
        nodes.facing.push(Facing { press, along: [[0.0; 3]; 2], stretch });
    }

    fn find(nodes: &PatchNodes) -> Option<Wheel> {
        let all = 0..nodes.index.len();
        Wheel::find(nodes, all.clone(), 0.01, recall(&[], 1))?.loaded(nodes, all, 0.01)
    }

    #[test]
    fn a_wheel_is_told_by_its_underside_in_any_direction() {
        for (angle, lean) in [(0.0, 0.0), (0.7, 0.0), (1.2, 0.02)] {
            let w = find(&wheel(angle, lean)).expect("a wheel");
            assert!((w.radius - RADIUS).abs() < 2e-2 * RADIUS, "{w:?}");
            let along = (w.heading[0] * libm::cos(angle) + w.heading[1] * libm::sin(angle)).abs();
            assert!(along > 1.0 - 1e-4 && (w.width - 0.11).abs() < 0.005, "{w:?}");
        }
    }

    #[test]
    fn a_wheel_may_lean() {
        for lean in [-0.4, -0.1, 0.05, 0.3] {
            let (mut nodes, (sin, cos)) = (PatchNodes::default(), (libm::sin(lean), libm::cos(lean)));
            for i in -6..=6 {
                for j in -5..=5 {
                    let (x, y) = (0.01 * f64::from(i), 0.01 * f64::from(j));
                    let root = (RADIUS * RADIUS - x * x).sqrt();
                    // along the axle from the lowest point, and up from there
                    let s = (y + sin * (RADIUS - root)) / cos;
                    push(&mut nodes, [s * sin + cos * (RADIUS - root), x, y], [x / (cos * root), sin / cos]);
                }
            }
            nodes.permanent.fill(-1.0);
            let w = find(&nodes).expect("a wheel");
            assert!((w.radius - RADIUS).abs() < 1e-9 && (w.lean + lean).abs() < 1e-9, "{w:?}");
            // rolls about its axle, which leans: without slip, forward or back
            let spin = [0.1 * sin, 0.0, 0.1 * cos];
            let turn = |axis: [f64; 3]| [0.0, 0.1 * RADIUS, 0.0, axis[0], axis[1], axis[2]];
            let [rim, _] = w.ways(&turn(spin));
            assert!((rim - 0.1 * RADIUS).abs() < 1e-9, "{rim}");
        }
    }

    #[test]
    fn a_wheel_stays_one_on_a_single_row_of_nodes() {
        let whole = wheel(0.7, 0.0);
        let seen = find(&whole).expect("a wheel");
        let row = 0..1;
        assert_eq!(Wheel::find(&whole, row.clone(), 0.01, recall(&[], 1)), None);
        let mut nodes = whole.clone();
        nodes.permanent.fill(-1.0);
        let kept = Wheel::find(&nodes, row.clone(), 0.01, seen.memory).expect("a wheel");
        assert!(kept.loaded(&nodes, row, 0.01).is_some());
        assert_eq!((kept.radius, kept.heading), (seen.radius, seen.heading));
    }

    #[test]
    fn feet_do_not_roll() {
        let (mut flat, mut round) = (PatchNodes::default(), PatchNodes::default());
        for i in -4..=4 {
            for j in -4..=4 {
                let (x, y) = (0.01 * f64::from(i), 0.01 * f64::from(j));
                push(&mut flat, [0.05 * x, x, y], [0.05, 0.0]);
                let root = (RADIUS * RADIUS - x * x - y * y).sqrt();
                push(&mut round, [RADIUS - root, x, y], [x / root, y / root]);
            }
        }
        assert_eq!(find(&flat), None);
        assert_eq!(find(&round), None);
    }

    #[test]
    fn what_a_wheel_has_left_is_not_the_soil_ahead() {
        let mut nodes = wheel(0.0, 0.0);
        let found = Wheel { memory: recall(&[], 1), ..find(&nodes).expect("a wheel") };
        let rolling = Rolling { peak: Some([0.4, 0.15]), ..Rolling::default() };
        for k in 0..nodes.arm.len() {
            let along = nodes.arm[k][1];
            // loaded in front of the peak; behind it all is pressed down, next to the bottom nothing is loaded
            nodes.stamp[k] = u64::from(along > 0.015 && nodes.depth[k] > 0.0);
            nodes.permanent[k] = if along < 0.015 { 0.01 } else { 0.0 };
        }
        let shift = found.shift(&rolling, &nodes, 0..nodes.arm.len()).expect("a shifted peak");
        assert_eq!(shift.before, 0.0);
        let entry = libm::acos(1.0 - 0.01 / RADIUS);
        assert!((shift.entry - entry).abs() < 0.01 * entry, "{shift:?}");
    }

    #[test]
    fn points_of_a_rim_come_down_where_it_turns_to() {
        let w = find(&wheel(0.0, 0.0)).expect("a wheel");
        let entry = |rim: f64, axle: f64| w.entry(&[0.0, axle - rim, 0.0, 0.0, 0.0, rim / w.radius]);
        for (rim, axle) in [(1e-3, 1e-3), (1e-3, 0.0), (1e-3, -1e-6), (-1e-3, 0.0), (-1e-3, 1e-6)] {
            let [along, _] = entry(rim, axle).expect("it turns");
            assert!((along - rim.signum()).abs() < 1e-3, "{rim} {axle}: {along}");
        }
        assert_eq!(entry(0.0, 1e-3), None);
    }

    #[test]
    fn slip_is_that_of_rim_and_axle() {
        let w = Wheel { length: 1e-9, ..find(&wheel(0.0, 0.0)).expect("a wheel") };
        let slip = |rim: f64, axle: f64| w.rolled(&[0.0, axle - rim, 0.0, 0.0, 0.0, rim / w.radius]).slip;
        assert!((slip(1e-3, 1e-3)).abs() < 1e-9);
        assert!((slip(1e-3, 0.8e-3) - 0.2).abs() < 1e-9 && (slip(-1e-3, -0.8e-3) - 0.2).abs() < 1e-9);
        assert!((slip(1e-3, 0.0) - 1.0).abs() < 1e-9 && (slip(0.5e-3, 1e-3) + 0.5).abs() < 1e-9);
        assert!((slip(0.0, 1e-3) + 1.0).abs() < 1e-9);
    }
}
