//! The hexapod with its tripod gait: joints, momentum in zero gravity, a blocked joint.

use crate::process::{Outcome, root};
use crate::rigid_body::fixture::{Fixture, G, pose, table};
use crate::{Figure, Limit};
use nalgebra::Vector3;
use terraglue_numerics::extremes::larger;
use terraglue_robot_import::{JointKind, Options, Robot, read_robot};

const STAND: [f64; 4] = [0.0, 0.958_192_178_746_274_4, -1.379_634_180_263_838_4, -1.149_354_325_277_333];
const CYCLE: f64 = 1.2;

/// The robot with its drive (PD of 600 N m/rad and 10 N m s/rad, 60 N m) and the gait's targets.
struct Walker {
    fixture: Fixture,
    robot: Robot,
    targets: Vec<u32>,
    rows: Vec<Vec<f64>>,
}

impl Walker {
    fn new(z: f64, gravity: f64, ground: &str) -> Outcome<Self> {
        let parameters = format!(
            r#"{{"model": "models/hexapod.urdf", "position_m": [0, 0, {z}], "ground": "{ground}", "friction": 0.8,
            "joints": {{"*_j2": {}, "*_j3": {}, "*_j4": {}}}}}"#,
            STAND[1], STAND[2], STAND[3]
        );
        let fixture = Fixture::new(&parameters, [0.0, 0.0, -gravity], 1e-3)?;
        let robot = read_robot(&root().join("models/hexapod.urdf"), &Options::default())
            .map_err(|e| e.to_string())?;
        let moving = robot.joints.iter().filter(|j| j.kind == JointKind::Revolute);
        let targets =
            moving.map(|j| fixture.id(&format!("{}.angle_target", j.name))).collect::<Outcome<_>>()?;
        Ok(Self { fixture, robot, targets, rows: table("gait_tripod.csv")? })
    }

    /// Targets at the start of the step, the step.
    fn step(&mut self) -> Outcome {
        let t = self.fixture.t();
        let blend = (t - 0.5).clamp(0.0, 1.0);
        let place = ((t - 0.5).max(0.0) % CYCLE) / CYCLE * (self.rows.len() - 1) as f64;
        let k = (place as usize).min(self.rows.len() - 2);
        let part = place - k as f64;
        let values: Vec<f64> = (0..self.targets.len())
            .map(|j| {
                let gait = (1.0 - part) * self.rows[k][j + 1] + part * self.rows[k + 1][j + 1];
                STAND[j % 4] + blend * (gait - STAND[j % 4])
            })
            .collect();
        self.fixture.set(&self.targets, &values)?;
        self.fixture.step()
    }

    /// Largest distance of two anchors (m) and sine between two axes.
    fn joints(&self) -> Outcome<[f64; 2]> {
        let states = self.fixture.states()?;
        let mut worst = [0.0_f64; 2];
        for joint in &self.robot.joints {
            let Some(parent) = joint.parent else { continue };
            let ((pp, pq), (cp, cq)) = (pose(&states[parent]), pose(&states[joint.child]));
            let there = pp + pq * joint.parent_from_joint.translation.vector;
            let here = cp + cq * joint.child_from_joint.translation.vector;
            worst[0] = larger(worst[0], (here - there).norm());
            let axes = (pq * (joint.parent_from_joint * *joint.axis))
                .cross(&(cq * (joint.child_from_joint * *joint.axis)));
            worst[1] = larger(worst[1], axes.norm());
        }
        Ok(worst)
    }

    /// Momentum and angular momentum about the centre of mass.
    fn momentum(&self) -> Outcome<[f64; 2]> {
        let states = self.fixture.states()?;
        let (mut p, mut l, mut centre, mut mass) =
            (Vector3::zeros(), Vector3::zeros(), Vector3::zeros(), 0.0);
        for (body, state) in self.robot.bodies.iter().zip(&states) {
            let (origin, q) = pose(state);
            let w = Vector3::from(state.angular_velocity);
            let arm = q * body.com;
            let (c, v) = (origin + arm, Vector3::from(state.linear_velocity) + w.cross(&arm));
            let spin = q * (body.inertia * q.inverse_transform_vector(&w));
            (p, mass, centre) = (p + body.mass * v, mass + body.mass, centre + body.mass * c);
            l += c.cross(&(body.mass * v)) + spin;
        }
        Ok([p.norm(), (l - (centre / mass).cross(&p)).norm()])
    }
}

/// All of them.
pub fn figures() -> Outcome<Vec<Figure>> {
    let mut all = on_ground()?;
    all.extend(in_space()?);
    all.push(blocked()?);
    all.extend(partly_blocked()?);
    all.push(repeated()?);
    Ok(all)
}

fn on_ground() -> Outcome<Vec<Figure>> {
    let mut walker = Walker::new(0.33, G, "half-space")?;
    let mut worst = [0.0_f64; 2];
    while walker.fixture.t() < 10.0 - 1e-9 {
        walker.step()?;
        let now = walker.joints()?;
        (0..2).for_each(|k| worst[k] = larger(worst[k], now[k]));
    }
    let x = pose(&walker.fixture.states()?[0]).0.x;
    let id = "rigid-body.gait";
    Ok(vec![
        Figure::new(
            format!("{id}.joint_gap"),
            1e3 * worst[0],
            Limit::AtMost(1e-6),
            "tripod gait on rigid ground, 10 s: largest distance of two anchors, mm",
        ),
        Figure::new(
            format!("{id}.axis_error"),
            1e3 * worst[1],
            Limit::AtMost(1e-6),
            "the same: largest angle between two axes, mrad",
        ),
        Figure::new(format!("{id}.distance"), x, Limit::AtLeast(1.5), "the same: distance walked, m"),
    ])
}

fn in_space() -> Outcome<Vec<Figure>> {
    let mut walker = Walker::new(5.0, 0.0, "none")?;
    let mut worst = [0.0_f64; 2];
    while walker.fixture.t() < 10.0 - 1e-9 {
        walker.step()?;
        let now = walker.momentum()?;
        (0..2).for_each(|k| worst[k] = larger(worst[k], now[k]));
    }
    let id = "rigid-body.zero-gravity";
    Ok(vec![
        Figure::new(
            format!("{id}.momentum"),
            worst[0],
            Limit::AtMost(1e-12),
            "tripod gait in zero gravity, 10 s: largest momentum, N s",
        ),
        Figure::new(
            format!("{id}.angular_momentum"),
            worst[1],
            Limit::AtMost(1e-6),
            "the same: largest angular momentum about the centre of mass, N m s",
        ),
    ])
}

fn blocked() -> Outcome<Figure> {
    let mut walker = Walker::new(0.33, G, "half-space")?;
    while walker.fixture.t() < 3.0 - 1e-9 {
        walker.step()?;
    }
    let id = walker.fixture.id("LF_j3.angle")?;
    let held = walker.fixture.get(id)?;
    walker.fixture.act("LF_j3.block")?;
    let mut worst = 0.0_f64;
    while walker.fixture.t() < 8.0 - 1e-9 {
        walker.step()?;
        worst = larger(worst, (walker.fixture.get(id)? - held).abs());
    }
    let what = "LF_j3 blocked at 3 s, gait to 8 s: largest deviation, mrad";
    Ok(Figure::new("rigid-body.blocked_joint", 1e3 * worst, Limit::AtMost(1e-6), what))
}

/// The largest torque that the block needs to hold, and how far it slips with half as much.
fn partly_blocked() -> Outcome<Vec<Figure>> {
    let slip = |torque: f64| -> Outcome<[f64; 2]> {
        let mut walker = Walker::new(0.33, G, "half-space")?;
        while walker.fixture.t() < 3.0 - 1e-9 {
            walker.step()?;
        }
        let [angle, stop] = [walker.fixture.id("LF_j3.angle")?, walker.fixture.id("LF_j3.stop_torque")?];
        let (held, limit) = (walker.fixture.get(angle)?, walker.fixture.id("LF_j3.block_torque")?);
        walker.fixture.set(&[limit], &[torque])?;
        walker.fixture.act("LF_j3.block")?;
        let mut worst = [0.0_f64; 2];
        while walker.fixture.t() < 5.0 - 1e-9 {
            walker.step()?;
            worst[0] = larger(worst[0], (walker.fixture.get(angle)? - held).abs());
            worst[1] = larger(worst[1], walker.fixture.get(stop)?.abs());
        }
        Ok(worst)
    };
    let needed = slip(1e3)?[1];
    let (strong, weak) = (slip(1.05 * needed)?, slip(0.5 * needed)?);
    let what = format!("partial block above the {needed:.1} N m that it needs: largest slip in 2 s, mrad");
    let above = Figure::new("rigid-body.partial_block.above", 1e3 * strong[0], Limit::AtMost(1e-6), what);
    let what = "partial block with half of that: largest slip, mrad";
    let below = Figure::new("rigid-body.partial_block.below", 1e3 * weak[0], Limit::AtLeast(1.0), what);
    let what = "the same: largest torque over the torque of the block";
    let torque = weak[1] / (0.5 * needed);
    let bound = Figure::new("rigid-body.partial_block.torque", torque, Limit::AtMost(1.0 + 1e-9), what);
    Ok(vec![above, below, bound])
}

/// Numbers that differ between a run alone and two at the same time in two threads.
fn repeated() -> Outcome<Figure> {
    let run = || -> Outcome<Vec<u64>> {
        let mut walker = Walker::new(0.33, G, "half-space")?;
        let mut bits = Vec::new();
        while walker.fixture.t() < 2.0 - 1e-9 {
            walker.step()?;
            for s in walker.fixture.states()? {
                let pose = s.world_from_body;
                bits.extend(pose.position.iter().chain(&pose.orientation).map(|x| x.to_bits()));
                bits.extend(s.linear_velocity.iter().chain(&s.angular_velocity).map(|x| x.to_bits()));
            }
        }
        Ok(bits)
    };
    let alone = run()?;
    let both = std::thread::scope(|scope| {
        let threads = [(); 2].map(|()| scope.spawn(run));
        threads.map(|t| t.join().unwrap_or_else(|_| Err("a thread of the gait ended early".into())))
    });
    let mut different = 0;
    for bits in both {
        different += alone.iter().zip(&bits?).filter(|(a, b)| a != b).count();
    }
    let what = format!(
        "gait, 2 s, alone and twice at once in two threads: numbers out of {} that differ in their bits",
        alone.len()
    );
    Ok(Figure::new("rigid-body.repeated_run", different as f64, Limit::Equal(0.0), what))
}
