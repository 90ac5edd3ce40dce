//! A scenario in which a robot stands on lunar soil and holds its pose: `terraglue new scenario --robot FILE`.
//!
//! Everything that depends on the robot is measured on its file: the pose, the height of its root, what touches the soil, the
//! gains that carry its weight.

use nalgebra::{Isometry3, Vector3};
use std::fmt::Write;
use terraglue_robot_import::{Base, Joint, JointKind, Robot, TotalMass};

/// On the Moon, m/s².
const GRAVITY: f64 = 1.62;
/// How far a joint gives way under the whole weight at its reach, rad or, as a share of a metre, for joints that slide.
const GIVES: [f64; 2] = [0.02, 0.005];
/// Damping over stiffness, s.
const SETTLES: f64 = 0.02;
/// Motors carry the weight this many times, where the file gives no limit.
const RESERVE: f64 = 5.0;
/// Most cells along a side of the ground: it is loaded and recorded within seconds.
const MOST_CELLS: f64 = 3000.0;
/// Time constants of what is left of a swing after which a robot stands.
const STOOD: f64 = 5.0;

/// A robot in the pose in which it shall stand.
pub struct Standing<'a> {
    robot: &'a Robot,
    fixed: bool,
    coordinates: Vec<f64>,
    poses: Vec<Isometry3<f64>>,
    whole: TotalMass,
    /// Smallest and largest corner of what can touch, in the frame of the file, m.
    corners: [Vector3<f64>; 2],
    /// Bodies that reach lowest.
    touching: Vec<usize>,
}

impl<'a> Standing<'a> {
    /// Chooses the pose; none where nothing can touch the soil. `fixed`: the root is held by the world.
    pub fn new(robot: &'a Robot, fixed: bool) -> Option<Self> {
        let coordinates = pose(robot);
        let poses = robot.poses(&coordinates);
        let mut corners = [Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY)];
        let mut lowest = vec![f64::INFINITY; robot.bodies.len()];
        for ((body, pose), low) in robot.bodies.iter().zip(&poses).zip(&mut lowest) {
            for shape in body.shapes.iter().filter(|s| s.collides) {
                for axis in [Vector3::x(), Vector3::y(), Vector3::z()] {
                    let ends = [shape.farthest(pose, &-axis), shape.farthest(pose, &axis)];
                    let [Some(below), Some(above)] = ends else { continue };
                    corners = [corners[0].inf(&below), corners[1].sup(&above)];
                    *low = low.min(below.z);
                }
            }
        }
        let near = corners[0].z + (0.05 * (corners[1].z - corners[0].z)).max(0.005);
        let touching = (0..lowest.len()).filter(|b| lowest[*b] <= near).collect();
        let whole = robot.whole(&poses);
        let fixed = fixed || robot.base == Base::World;
        (fixed || corners[0].z.is_finite()).then_some(Self {
            robot,
            fixed,
            coordinates,
            poses,
            whole,
            corners,
            touching,
        })
    }

    /// Warning before the first run where the centre of mass lies beside the touching bodies.
    pub fn doubt(&self) -> Option<String> {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for b in &self.touching {
            for shape in self.robot.bodies[*b].shapes.iter().filter(|s| s.collides) {
                for (k, axis) in [Vector3::x(), Vector3::y()].iter().enumerate() {
                    let ends =
                        [shape.farthest(&self.poses[*b], &-axis), shape.farthest(&self.poses[*b], axis)];
                    let [Some(below), Some(above)] = ends else { continue };
                    (low[k], high[k]) = (low[k].min(below[k]), high[k].max(above[k]));
                }
            }
        }
        let outside = (0..2).any(|k| self.whole.com[k] < low[k] || self.whole.com[k] > high[k]);
        (outside && !self.fixed).then(|| {
            format!(
                "the centre of mass (x = {:.3} m, y = {:.3} m) lies beside what touches the soil: the robot will tip over unless \
                 [robot.joints] brings it between its feet",
                self.whole.com.x, self.whole.com.y
            )
        })
    }

    /// The text of the scenario; `model`: the robot file as seen from it.
    pub fn scenario(&self, name: &str, model: &str) -> String {
        let [size, spacing] = self.ground();
        let mut text = include_str!("templates/scenario-standing.toml.in").to_owned();
        for (word, by) in [
            ("@name@", name.to_owned()),
            ("@model@", quoted(model)),
            ("@mass@", format!("{:.4}", self.whole.mass)),
            ("@size@", format!("{size:?}")),
            ("@spacing@", format!("{spacing:?}")),
            ("@nodes@", if spacing > 0.02 { COARSE } else { FINE }.to_owned()),
            ("@settle@", format!("{:?}", self.settle_s())),
            ("@height@", format!("{:?}", rounded(self.height(), 1e4))),
            ("@fixed@", self.fixed_line()),
            ("@touching@", self.touching_names()),
            ("@doubt@", self.doubt().map_or_else(String::new, |doubt| format!("# Beware: {doubt}.\n"))),
            ("@joints@", self.start()),
            ("@gains@", self.gains()),
            ("@report@", self.report()),
        ] {
            text = text.replace(word, &by);
        }
        text
    }

    /// Height of the root at which the lowest corner touches z = 0.
    fn height(&self) -> f64 {
        if self.corners[0].z.is_finite() { -self.corners[0].z } else { 0.0 }
    }

    /// Side of the terrain and distance of its nodes, m: six nodes across the smallest thing that touches.
    fn ground(&self) -> [f64; 2] {
        let extent = (self.corners[1] - self.corners[0]).xy();
        let extent = if extent.x.is_finite() { extent.amax() } else { 1.0 };
        let mut narrowest = f64::INFINITY;
        for b in &self.touching {
            for shape in self.robot.bodies[*b].shapes.iter().filter(|s| s.collides) {
                for axis in [Vector3::x(), Vector3::y()] {
                    let ends =
                        [shape.farthest(&self.poses[*b], &-axis), shape.farthest(&self.poses[*b], &axis)];
                    let [Some(below), Some(above)] = ends else { continue };
                    narrowest = narrowest.min((above - below).dot(&axis));
                }
            }
        }
        let spacing = ((narrowest / 6.0).clamp(0.004, 0.02) * 1e3).floor() / 1e3;
        let fits = |size: f64| size / spacing <= MOST_CELLS;
        let roomy = (2.0 * extent + 2.0).ceil();
        let size = if fits(roomy) { roomy } else { (1.2 * extent + 1.0).ceil() };
        [size, if fits(size) { spacing } else { (size / MOST_CELLS * 1e3).ceil() / 1e3 }]
    }

    fn fixed_line(&self) -> String {
        let text = "fixed_base = true               # the root is held by the world\n";
        if self.fixed { text.into() } else { String::new() }
    }

    fn touching_names(&self) -> String {
        let names: Vec<&str> = self.touching.iter().map(|b| self.robot.bodies[*b].name.as_str()).collect();
        if names.is_empty() { "nothing of it".into() } else { names.join(", ") }
    }

    /// Joints whose coordinate is not 0.
    fn start(&self) -> String {
        let turned = self.robot.joints.iter().zip(&self.coordinates).filter(|(_, c)| **c != 0.0);
        turned.fold(String::new(), |mut text, (joint, c)| {
            let _ = writeln!(text, "{} = {:?}", quoted(&joint.name), plain(*c, joint.limits));
            text
        })
    }

    /// Until a robot that is set down has come to rest on its joints: whole seconds.
    fn settle_s(&self) -> f64 {
        let reach = |(j, joint): (usize, &Joint)| match joint.kind {
            JointKind::Prismatic => 0.0,
            _ => self.reach(j, joint),
        };
        let reach = self.driven().map(reach).fold(0.0, f64::max);
        // A weight on a spring that gives way by d swings at ω² = g/d and fades as exp(−½ω²·SETTLES·t).
        let fades = 2.0 * GIVES[0] * reach / (GRAVITY * SETTLES);
        (STOOD * fades).ceil().clamp(1.0, 20.0)
    }

    /// The tables of stiffness, damping and largest torque.
    fn gains(&self) -> String {
        let rows: Vec<(String, Gains)> =
            self.driven().map(|(j, joint)| (quoted(&joint.name), self.gain(j, joint))).collect();
        if rows.is_empty() {
            return String::new();
        }
        let table = |name: &str, value: &dyn Fn(&Gains) -> String| {
            let rows = rows.iter().map(|(joint, gains)| format!("{joint} = {}\n", value(gains)));
            format!("\n[robot.{name}]\n{}", rows.collect::<String>())
        };
        table("stiffness", &|g| format!("{:?}", g.stiffness))
            + &table("damping", &|g| format!("{:?}", g.damping))
            + "\n# `effort` of the robot file where it says more than 0."
            + &table("max_torque", &Gains::torque)
    }

    /// Joints that the limit of the file is too weak for, with it and what they may have to carry.
    pub fn weak(&self) -> Option<String> {
        let weak: Vec<String> = self
            .driven()
            .map(|(j, joint)| (joint, self.gain(j, joint)))
            .filter_map(|(joint, g)| {
                let effort = g.effort.filter(|e| *e < g.share)?;
                Some(format!("`{}` ({effort} of {})", joint.name, two_digits(g.share)))
            })
            .collect();
        let (last, more) = (weak.len().min(3), weak.len().saturating_sub(3));
        let more = if more > 0 { format!(" and {more} more") } else { String::new() };
        (!weak.is_empty()).then(|| {
            format!(
                "`effort` of the file is less than a share of the weight asks at full reach, N m: {}{more}; the robot may sink down. \
                 [robot.max_torque] has what is used",
                weak[..last].join(", ")
            )
        })
    }

    /// Joints with a motor of their own.
    fn driven(&self) -> impl Iterator<Item = (usize, &Joint)> {
        let follows = |j: usize| self.robot.couplings.iter().any(|c| c.follower == j);
        let joints = self.robot.joints.iter().enumerate();
        joints.filter(move |(j, joint)| joint.freedoms() == 1 && !follows(*j))
    }

    /// Stiffness, damping and largest torque of a joint: under a foot it carries the robot, in an arm what hangs on it.
    fn gain(&self, j: usize, joint: &Joint) -> Gains {
        let below = self.below(j);
        let carries = below.iter().any(|b| self.touching.contains(b));
        let mass: f64 = below.iter().map(|b| self.robot.bodies[*b].mass).sum();
        let weight = GRAVITY * if carries { self.whole.mass } else { mass };
        let (load, gives) = match joint.kind {
            JointKind::Prismatic => (weight, GIVES[1]),
            _ => (weight * self.reach(j, joint).max(0.01), GIVES[0]),
        };
        let [stiffness, damping] = [load / gives, load / gives * SETTLES].map(two_digits);
        let effort = joint.data.effort.or(joint.data.drive.and_then(|d| d.max_torque).filter(|t| *t > 0.0));
        let share = if carries { load / self.touching.len() as f64 } else { load };
        Gains { stiffness, damping, load, share, effort }
    }

    /// How far from the joint's axis what it moves reaches, m.
    fn reach(&self, j: usize, joint: &Joint) -> f64 {
        let parent = joint.parent.map_or_else(Isometry3::identity, |p| self.poses[p]);
        let anchor = (parent * joint.parent_from_joint).translation.vector;
        let reach = |b: &usize| {
            let ends = self.robot.bodies[*b].shapes.iter().filter(|s| s.collides).flat_map(|s| {
                [Vector3::x(), Vector3::y(), Vector3::z()].into_iter().flat_map(move |axis| {
                    [s.farthest(&self.poses[*b], &axis), s.farthest(&self.poses[*b], &-axis)]
                })
            });
            let com = self.poses[*b] * nalgebra::Point3::from(self.robot.bodies[*b].com);
            ends.flatten().chain([com.coords]).map(|p| (p - anchor).norm()).fold(0.0, f64::max)
        };
        self.below(j).iter().map(reach).fold(0.0, f64::max)
    }

    /// Bodies that a joint moves.
    fn below(&self, joint: usize) -> Vec<usize> {
        let mut moved = vec![self.robot.joints[joint].child];
        for other in &self.robot.joints {
            if other.parent.is_some_and(|p| moved.contains(&p)) {
                moved.push(other.child);
            }
        }
        moved
    }

    fn report(&self) -> String {
        let bodies = self.robot.bodies.iter();
        let heaviest = bodies.max_by(|a, b| a.mass.total_cmp(&b.mass)).map_or("", |b| b.name.as_str());
        let mut text = format!("body = {}\n", quoted(&format!("robot.{heaviest}")));
        if let Some((_, joint)) = self.driven().next() {
            let _ = writeln!(
                text,
                "joint = {}                # its torque, velocity and angle are plotted",
                quoted(&format!("robot.{}", joint.name))
            );
        }
        text
    }
}

/// All joints at 0, or at the limit next to it. Where a knee cannot be straight, the joint above it with a parallel axis takes
/// back half of its angle: the foot stays below the hip.
fn pose(robot: &Robot) -> Vec<f64> {
    let nearest =
        |joint: &Joint, wanted: f64| joint.limits.map_or(wanted, |[low, high]| wanted.clamp(low, high));
    let mut coordinates: Vec<f64> =
        robot.joints.iter().map(|j| if j.freedoms() == 1 { nearest(j, 0.0) } else { 0.0 }).collect();
    let poses = robot.poses(&vec![0.0; robot.joints.len()]);
    let axis = |j: &Joint| {
        let parent = j.parent.map_or_else(Isometry3::identity, |p| poses[p]);
        parent * j.parent_from_joint * j.axis
    };
    for (k, knee) in robot.joints.iter().enumerate() {
        if knee.kind != JointKind::Revolute || nearest(knee, 0.0) == 0.0 {
            continue;
        }
        let above = robot.joints.iter().position(|j| Some(j.child) == knee.parent);
        let Some(hip) = above.filter(|h| coordinates[*h] == 0.0) else { continue };
        let along = axis(&robot.joints[hip]).dot(&axis(knee));
        if robot.joints[hip].kind == JointKind::Revolute && along.abs() > 0.99 {
            coordinates[hip] = nearest(&robot.joints[hip], -0.5 * along.signum() * coordinates[k]);
        }
    }
    let follow = |c: &terraglue_robot_import::Coupling, all: &[f64]| c.ratio * all[c.leader] + c.offset;
    for c in robot.couplings.iter().cycle().take(robot.couplings.len().pow(2)) {
        coordinates[c.follower] = follow(c, &coordinates);
    }
    coordinates
}

/// Note on the spacing of the ground.
const FINE: &str = "six nodes across the narrowest thing that touches";
/// See [`FINE`]; of a robot so large that its ground would have too many nodes.
const COARSE: &str = "coarse: a ground of this size with six nodes across what touches would be too large";

/// Gains that hold a joint.
struct Gains {
    stiffness: f64,
    damping: f64,
    /// Under the whole weight at full reach.
    load: f64,
    /// The same where all that touches carries alike.
    share: f64,
    /// Largest torque by the file.
    effort: Option<f64>,
}

impl Gains {
    /// The largest torque, with its reason where it is not that of the file.
    fn torque(&self) -> String {
        match self.effort {
            Some(effort) => format!("{effort:?}"),
            None => {
                format!("{:?}      # {RESERVE} times what the weight asks", two_digits(self.load * RESERVE))
            }
        }
    }
}

/// Without the digits that arithmetic leaves, as long as that stays within the limits.
fn plain(c: f64, limits: Option<[f64; 2]>) -> f64 {
    let rounded = rounded(c, 1e9);
    let inside = limits.is_none_or(|[low, high]| (low..=high).contains(&rounded));
    if inside { rounded } else { c }
}

/// A name as a text of TOML.
fn quoted(name: &str) -> String {
    toml_edit::Value::from(name).to_string()
}

fn rounded(x: f64, digits: f64) -> f64 {
    (x * digits).round() / digits
}

/// Rounded up to two digits.
fn two_digits(x: f64) -> f64 {
    let unit = 10_f64.powi(x.log10().floor() as i32 - 1);
    let digits = (x / unit).ceil();
    // Dividing by a power of ten is exact where multiplying by its inverse is not.
    if unit < 1.0 { digits / (1.0 / unit).round() } else { digits * unit.round() }
}
