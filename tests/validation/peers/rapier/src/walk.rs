//! The hexapod with its tripod gait on flat rigid ground.

use crate::robot::{Robot, read, world};
use crate::{Outcome, cpu_s, figure};
use rapier3d_f64::{na, prelude::*};
use std::path::Path;

const H: f64 = 1e-3;
const STEPS: usize = 10_000;
const RUNS: usize = 5;
/// From here on figures are taken.
const WALKS: usize = 2_000;
const CYCLE: f64 = 1.2;
const RADIUS: f64 = 0.03;
const STAND: [f64; 4] = [0.0, 0.9581921787462744, -1.3796341802638374, -1.1493543252773333];

fn targets(t: f64, rows: &[Vec<f64>]) -> Vec<f64> {
    let blend = (t - 0.5).clamp(0.0, 1.0);
    let at = ((t - 0.5).max(0.0) % CYCLE) / CYCLE * (rows.len() - 1) as f64;
    let row = (at as usize).min(rows.len() - 2);
    let share = at - row as f64;
    let mix = |j: usize| (1.0 - share) * rows[row][j] + share * rows[row + 1][j];
    (0..24).map(|j| STAND[j % 4] + blend * (mix(j) - STAND[j % 4])).collect()
}

/// Rows of the gait table without its times.
fn table(path: &Path) -> Outcome<Vec<Vec<f64>>> {
    let text = std::fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))?;
    let row = |l: &str| l.split(',').skip(1).map(|x| x.trim().parse()).collect::<Result<Vec<f64>, _>>();
    text.lines().skip(1).map(|l| row(l).map_err(|e| format!("{l}: {e}"))).collect()
}

/// Largest distance of two anchors (m) and angle between two axes (rad).
fn open(world: &PhysicsWorld, robot: &Robot) -> [f64; 2] {
    robot.hinges.iter().fold([0.0, 0.0], |[gap, angle]: [f64; 2], hinge| {
        let (a, b) = (world.bodies[hinge.parent].position(), world.bodies[hinge.child].position());
        let apart = (a.transform_point(hinge.place.translation) - b.translation).length();
        let axes = (a.rotation * hinge.place.rotation * hinge.axis).cross(b.rotation * hinge.axis).length();
        [gap.max(apart), angle.max(axes)]
    })
}

/// Figures of ten seconds.
struct Seen {
    /// CPU time of every step, µs.
    times: Vec<f64>,
    deepest: f64,
    slip: f64,
    gap: [f64; 2],
    x: f64,
}

/// Runs `drive` on a robot five times and prints its figures: each step counts with the least of its times, as it does on
/// our side.
pub fn walk(model: &Path, gait: &Path, name: &str, stiff: bool) -> Outcome {
    let rows = table(gait)?;
    let wanted: Vec<Vec<f64>> = (0..STEPS).map(|k| targets(k as f64 * H, &rows)).collect();
    let mut seen = run(model, &wanted, stiff)?;
    for _ in 1..RUNS {
        let again = run(model, &wanted, stiff)?.times;
        seen.times.iter_mut().zip(again).for_each(|(time, again)| *time = time.min(again));
    }
    let Seen { mut times, deepest, slip, gap, x } = seen;
    times.sort_by(f64::total_cmp);
    let id = |what: &str| format!("gait.{name}.{what}");
    figure(&id("step"), times[STEPS / 2], "CPU time of a step, least of five runs, median, µs");
    figure(&id("tail"), times[STEPS / 100 * 99] / times[STEPS / 2], "99th percentile of that / median");
    figure(&id("penetration"), 1e3 * deepest, "deepest foot after 2 s, mm");
    figure(&id("slip"), 1e3 * slip, "mean speed of feet that stand, mm/s");
    figure(&id("joint_gap"), 1e3 * gap[0], "largest distance of two anchors, mm");
    figure(&id("axis_error"), 1e3 * gap[1], "largest angle between two axes, mrad");
    figure(&id("x"), x, "distance in 10 s, m");
    Ok(())
}

fn run(model: &Path, wanted: &[Vec<f64>], stiff: bool) -> Outcome<Seen> {
    let mut world = world([0.0, 0.0, -9.81], H);
    world.insert_collider(ColliderBuilder::halfspace(na::Unit::new_unchecked(Vector::Z)).friction(0.8), None);
    let stand = |joint: &str| STAND[joint.as_bytes().last().map_or(0, |b| usize::from(b - b'1') % 4)];
    let robot = read(&mut world, model, Some(Pose::translation(0.0, 0.0, 0.33)), stand)?;
    let mut times = Vec::with_capacity(STEPS);
    let (mut deepest, mut slip, mut slips, mut gap) = (0.0_f64, 0.0, 0.0, [0.0_f64; 2]);
    let mut before = vec![None; robot.feet.len()];
    for (k, wanted) in wanted.iter().enumerate() {
        let start = cpu_s();
        drive(&mut world, &robot, wanted, stiff);
        world.step();
        times.push(1e6 * (cpu_s() - start));
        let now = open(&world, &robot);
        gap = [gap[0].max(now[0]), gap[1].max(now[1])];
        for ((body, centre), last) in robot.feet.iter().zip(&mut before) {
            let p = world.bodies[*body].position().transform_point(*centre);
            let stands = p.z < RADIUS;
            if k >= WALKS {
                deepest = deepest.max(RADIUS - p.z);
                if let Some(last) = last.filter(|_| stands) {
                    let moved: Vector = p - last;
                    slip += moved.truncate().length() / H;
                    slips += 1.0;
                }
            }
            *last = stands.then_some(p);
        }
    }
    let x = world.bodies[robot.bodies[0]].translation().x;
    Ok(Seen { times, deepest, slip: slip / f64::max(slips, 1.0), gap, x })
}

/// Implicit PD, or the error taken back within ten steps at 20 rad/s at most by a motor of nearly no compliance.
fn drive(world: &mut PhysicsWorld, robot: &Robot, wanted: &[f64], stiff: bool) {
    for (hinge, wanted) in robot.hinges.iter().zip(wanted) {
        let (a, b) = (*world.bodies[hinge.parent].rotation(), *world.bodies[hinge.child].rotation());
        let Some(joint) = world.impulse_joints.get_mut(hinge.joint, false) else { continue };
        let motor = &mut joint.data;
        motor.set_motor_model(JointAxis::AngX, MotorModel::ForceBased);
        motor.set_motor_max_force(JointAxis::AngX, 60.0);
        if stiff {
            let turn = (a * hinge.place.rotation).inverse() * b;
            let angle = 2.0 * turn.xyz().dot(hinge.axis).atan2(turn.w);
            let rate = (0.1 / H * (wanted - angle)).clamp(-20.0, 20.0);
            motor.set_motor(JointAxis::AngX, 0.0, rate, 0.0, 1e6);
        } else {
            motor.set_motor(JointAxis::AngX, *wanted, 0.0, 600.0, 10.0);
        }
    }
}
