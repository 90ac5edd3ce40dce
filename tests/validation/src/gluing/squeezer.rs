//! Andrews' squeezer, cut at the point where four links meet and glued there, against published multipliers.
//!
//! Model A03 of the IFToMM library of computational benchmark problems. Multipliers at 0.03 s: the test set for
//! initial value problem solvers (Mazzia and Magherini), for g = (E_K2 − E_K3, E_K2 − E_K4, E_K2 − E_K6): T acts as +T
//! on K3, K4 and K6 and as −T on K2.

use super::extrapolate::steps_to;
use super::fixture::{Setting, Tally, build, list, read, step, wrench};
use super::planar::{ALPHA, Body, Pin, bodies};
use super::{Context, Figure, Limit};
use crate::process::Outcome;
use terraglue_numerics::extremes::{larger, smaller};

/// Published multipliers at 0.03 s, N.
const MULTIPLIERS: [f64; 6] = [
    199.175_333_373_191,
    -29.75531228015052,
    23.06654119098399,
    31.45271365475927,
    22.64249232082739,
    11.61740700019673,
];
/// Published angle of the crank at 0.03 s, rad.
const BETA: f64 = 15.81077119629904;
const UNTIL: f64 = 0.03;
const STEP: f64 = 2.5e-5;
/// The smallest force is a seventeenth of the largest: its own relative error needs a shorter step.
const FINE: f64 = 7.5e-6;

/// A part of the mechanism: its links with the pins that stay, and further lines of its table.
struct SqueezerPart {
    name: &'static str,
    links: Vec<Body>,
    pins: Vec<Pin>,
    loads: String,
}

/// The parts, the first with the crank, and the point E where they meet.
fn parts() -> (Vec<SqueezerPart>, [f64; 2]) {
    let [beta, theta, gamma, phi, delta, omega, epsilon]: [f64; 7] = [
        -0.0617138900142764,
        0.0,
        0.455279819163070,
        0.222668390165886,
        0.487364979543843,
        -0.222668390165886,
        1.230547444549821,
    ];
    let (a, b) = ([-0.06934, -0.00227], [-0.03635, 0.03273]);
    // a point with coordinates (x, y) in a frame at `from` that is turned by an angle
    let at = |from: [f64; 2], angle: f64, x: f64, y: f64| {
        let (s, c) = angle.sin_cos();
        [from[0] + c * x - s * y, from[1] + s * x + c * y]
    };
    let link = |mass: f64, inertia: f64, centre: [f64; 2], angle: f64| Body {
        mass,
        inertia,
        pose: [centre[0], centre[1], angle],
        rate: [0.0; 3],
    };
    let f = at([0.0; 2], beta, 0.007, 0.0);
    let g = at(a, delta, 0.04, 0.0);
    let h = at(a, epsilon, 0.0, -0.04);
    let e = at(b, gamma, 0.0, -0.035);
    let k1 = link(0.04325, 2.194e-6, at([0.0; 2], beta, 0.00092, 0.0), beta);
    let k2 = link(0.00365, 4.410e-7, at(f, beta + theta, -0.0115, 0.0), beta + theta);
    let k3 = link(0.02373, 5.255e-6, at(b, gamma, 0.01043, -0.01874), gamma);
    let k4 = link(0.00706, 5.667e-7, at(g, phi + delta, 0.0, -(0.02 - 0.01421)), phi + delta);
    let k5 = link(0.07050, 1.169e-5, at(a, delta, 0.02308, 0.00916), delta);
    let k6 = link(0.00706, 5.667e-7, at(h, omega + epsilon, 0.02 - 0.01421, 0.0), omega + epsilon);
    let k7 = link(0.05498, 1.912e-5, at(a, epsilon, 0.00449, -0.01228), epsilon);
    let fixed = |place: [f64; 2]| [0.0, -1.0, place[0], place[1]];
    let pinned = |place: [f64; 2]| [0.0, 1.0, place[0], place[1]];
    let d = at(b, gamma, 0.02, -0.018);
    let spring = list(&[0.0, d[0], d[1], 0.014, 0.072, 4530.0, 0.07785]);
    let part = |name, links, pins, loads| SqueezerPart { name, links, pins, loads };
    let all = vec![
        part("crank", vec![k1, k2], vec![fixed([0.0; 2]), pinned(f)], "torque = [0, 0.033]\n".into()),
        part("spring", vec![k3], vec![fixed(b)], format!("spring = {spring}\n")),
        part("lower", vec![k5, k4], vec![fixed(a), pinned(g)], String::new()),
        part("upper", vec![k7, k6], vec![fixed(a), pinned(h)], String::new()),
    ];
    (all, e)
}

/// Four subsystems; the ends of the last three are glued to that of the first.
fn cut(setting: &Setting) -> String {
    let (parts, e) = parts();
    let mut text = setting.text();
    for part in &parts {
        text += &(bodies(part.name, ALPHA, &part.links, &part.pins) + &part.loads);
    }
    for part in &parts[1..] {
        text += &format!(
            "[[glue]]\nside_1 = \"{}.b{}\"\nside_2 = \"crank.b1\"\nat_m = [{:?}, {:?}, 0.0]\ncomponents = [\"x\", \"y\"]\n",
            part.name,
            part.links.len() - 1,
            e[0],
            e[1]
        );
    }
    text
}

/// One subsystem with pins in the place of the glue.
fn whole(setting: &Setting) -> String {
    let (parts, e) = parts();
    let (mut links, mut pins) = (Vec::new(), Vec::new());
    for part in &parts {
        let first = links.len() as f64;
        let number = |k: f64| if k < 0.0 { k } else { k + first };
        pins.extend(part.pins.iter().map(|p| [number(p[0]), number(p[1]), p[2], p[3]]));
        links.extend(&part.links);
        if first > 0.0 {
            pins.push([links.len() as f64 - 1.0, 1.0, e[0], e[1]]);
        }
    }
    let loads = parts[1].loads.replace("[0.0,", "[2.0,");
    setting.text() + &bodies("all", ALPHA, &links, &pins) + &parts[0].loads + &loads
}

/// Results at the end of a run.
struct SqueezerEnd {
    /// Largest error of a multiplier in parts of the largest multiplier.
    multipliers: f64,
    /// Largest error of a multiplier in parts of itself.
    each: f64,
    beta: f64,
    apart: f64,
    tally: Tally,
}

fn run(h: f64) -> Outcome<SqueezerEnd> {
    let setting = Setting { gluing: String::new(), ..Setting::iterative(h, [0.0; 3]) };
    let (mut glued, mut uncut) = (build(&cut(&setting))?, build(&whole(&setting))?);
    let (mut tally, mut apart) = (Tally::default(), 0.0_f64);
    step(&mut glued, steps_to(UNTIL, h), |glued| {
        uncut.step().map_err(|e| e.to_string())?;
        apart = larger(apart, (read(glued, "crank.b0.angle")? - read(&uncut, "all.b0.angle")?).abs());
        tally.add(glued);
        Ok(())
    })?;
    let largest = MULTIPLIERS[0];
    let error = |k: usize| (wrench(&glued, k / 2, k % 2) - MULTIPLIERS[k]).abs();
    Ok(SqueezerEnd {
        multipliers: (0..6).map(|k| error(k) / largest).fold(0.0, larger),
        each: (0..6).map(|k| error(k) / MULTIPLIERS[k].abs()).fold(0.0, larger),
        beta: (read(&glued, "crank.b0.angle")? - BETA).abs(),
        apart,
        tally,
    })
}

/// All figures of the part.
pub fn figures(_: &Context) -> Outcome<Vec<Figure>> {
    let figure = |name: &str, value: f64, limit: Limit, what: String| {
        Figure::new(format!("gluing.squeezer.{name}"), value, limit, what)
    };
    let (coarse, end) = (run(2.0 * STEP)?, run(STEP)?);
    let fine = run(FINE)?;
    let order = smaller((coarse.multipliers / end.multipliers).log2(), (coarse.beta / end.beta).log2());
    Ok(vec![
        figure(
            "multipliers",
            end.multipliers,
            Limit::AtMost(1e-3),
            format!(
                "Andrews' squeezer cut at E, h = {STEP} s: largest error of the six forces at {UNTIL} s in parts of the largest"
            ),
        ),
        figure(
            "each_multiplier",
            fine.each,
            Limit::AtMost(1e-3),
            format!("the same at h = {FINE} s: largest error of a force in parts of itself"),
        ),
        figure("beta", end.beta, Limit::AtMost(1e-3), "the same: error of the crank's angle, rad".into()),
        figure("order", order, Limit::AtLeast(1.95), "the same: observed order from twice the step".into()),
        figure(
            "against_uncut",
            end.apart,
            Limit::AtMost(1e-7),
            "largest difference of the crank's angle from that of the uncut squeezer, rad".into(),
        ),
        figure("gap", end.tally.gap, Limit::AtMost(1e-10), "largest gap, m".into()),
        figure(
            "evaluations",
            end.tally.mean(),
            Limit::AtMost(3.3),
            format!("evaluations per step, at most {}", end.tally.most),
        ),
    ])
}
