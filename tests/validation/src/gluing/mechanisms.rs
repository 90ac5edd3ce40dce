//! Cut mechanisms with generalized-α: errors, order, evaluations, Jacobians, a wrong start; a block with friction.

use super::extrapolate::steps_to;
use super::fixture::{Setting, Tally, build, build_with, read, step, wrench};
use super::planar::{ALPHA, Body, GRAVITY, Mechanism};
use super::{Context, Figure, Limit};
use crate::process::{Outcome, read as read_file, root};
use std::f64::consts::FRAC_PI_2;
use terraglue::scenario::JacobianChoice;
use terraglue_numerics::extremes::{larger, smaller};

/// A mechanism with its reference: a column of a table per angle.
pub(super) struct MechanismCase {
    name: &'static str,
    /// The two parts.
    pub mechanism: Mechanism,
    /// Variables that are compared.
    pub angles: &'static [&'static str],
    table: &'static str,
    columns: &'static [usize],
    until: f64,
    error: f64,
    evaluations: f64,
}

/// The mechanisms of the figures.
pub(super) fn cases() -> [MechanismCase; 4] {
    let corners = [[0.0, 0.0], [0.0, 1.0], [2.0, 2.0], [3.0, 0.0]];
    [
        MechanismCase {
            name: "pendulum",
            mechanism: Mechanism::pendulum(1.0, 1.0, FRAC_PI_2, 0.5),
            angles: &["first.b0.angle"],
            table: "pendulum_exact.csv",
            columns: &[1],
            until: 1.0,
            error: 4.0e-4,
            evaluations: 3.3,
        },
        MechanismCase {
            name: "double_pendulum",
            mechanism: Mechanism::double_pendulum([1.0; 2], [1.0; 2], [0.0; 2]),
            angles: &["first.b0.angle", "second.b0.angle"],
            table: "double_pendulum_ref.csv",
            columns: &[1, 2],
            until: 1.0,
            error: 9e-4,
            evaluations: 3.3,
        },
        MechanismCase {
            name: "four_bar",
            mechanism: Mechanism::four_bar(corners, 1.0),
            angles: &["first.b0.angle", "first.b1.angle", "second.b0.angle"],
            table: "fourbar_ref.csv",
            columns: &[1, 2, 3],
            until: 1.0,
            error: 1.5e-3,
            evaluations: 3.3,
        },
        MechanismCase {
            name: "n_four_bar",
            mechanism: n_four_bar(),
            angles: &["first.b0.angle"],
            table: "",
            columns: &[],
            until: 2.0,
            error: 8.5e-4,
            evaluations: 3.3,
        },
    ]
}

/// A02 of the IFToMM library with one window: posts and bar of 1 m and 1 kg, tops moving with 1 m/s.
fn n_four_bar() -> Mechanism {
    let rod = |a: [f64; 2], b: [f64; 2], rate: [f64; 3]| Body { rate, ..Body::rod(1.0, a, b) };
    let post = |x: f64| rod([x, 0.0], [x, 1.0], [0.5, 0.0, -1.0]);
    Mechanism {
        first: (
            vec![post(0.0), rod([0.0, 1.0], [1.0, 1.0], [1.0, 0.0, 0.0])],
            vec![[0.0, -1.0, 0.0, 0.0], [0.0, 1.0, 0.0, 1.0]],
        ),
        second: (vec![post(1.0)], vec![[0.0, -1.0, 1.0, 0.0]]),
        glued: (1, 0),
        at: [1.0, 1.0],
        weld: false,
    }
}

/// All figures of the part.
pub fn figures(_: &Context) -> Outcome<Vec<Figure>> {
    let mut all = Vec::new();
    for case in cases() {
        all.extend(errors(&case)?);
    }
    all.extend(against_the_uncut()?);
    all.extend(jacobians()?);
    all.extend(wrong_start()?);
    all.extend(friction()?);
    Ok(all)
}

fn setting(h: f64) -> Setting {
    Setting { gluing: String::new(), ..Setting::iterative(h, GRAVITY) }
}

/// The angles at multiples of `every` and the cost of the run.
fn run(case: &MechanismCase, h: f64, every: f64) -> Outcome<(Vec<Vec<f64>>, Tally)> {
    let mut testbed = build(&case.mechanism.cut(&setting(h), ALPHA))?;
    let (mut samples, mut tally, mut count) = (Vec::new(), Tally::default(), 0);
    let stride = steps_to(every, h);
    step(&mut testbed, steps_to(case.until, h), |testbed| {
        tally.add(testbed);
        count += 1;
        if count % stride == 0 {
            samples.push(case.angles.iter().map(|a| read(testbed, a)).collect::<Outcome<Vec<f64>>>()?);
        }
        Ok(())
    })?;
    Ok((samples, tally))
}

/// At every step of 5 ms: the limit of runs with short steps, or the equation of motion in one angle.
pub(super) fn reference(case: &MechanismCase) -> Outcome<Vec<Vec<f64>>> {
    if case.table.is_empty() {
        return Ok(parallelogram(case.until));
    }
    let (coarse, _) = run(case, 0.005 / 8.0, 0.005)?;
    let (fine, _) = run(case, 0.005 / 16.0, 0.005)?;
    let limit = |(a, b): (&Vec<f64>, &Vec<f64>)| a.iter().zip(b).map(|(a, b)| b + (b - a) / 3.0).collect();
    Ok(coarse.iter().zip(&fine).map(limit).collect())
}

/// φ̈ = −k·cos φ of the parallelogram, k = (3/2)·(3N + 1)/(4N + 1)·g with N = 1, by Runge–Kutta.
fn parallelogram(until: f64) -> Vec<Vec<f64>> {
    let k = 1.5 * 4.0 / 5.0 * 9.81;
    let (mut phi, mut rate) = (FRAC_PI_2, -1.0);
    let parts = 100;
    let h = 0.005 / f64::from(parts);
    let f = |phi: f64| -k * phi.cos();
    let mut out = Vec::new();
    for _ in 0..steps_to(until, 0.005) {
        for _ in 0..parts {
            let (k1, l1) = (rate, f(phi));
            let (k2, l2) = (rate + 0.5 * h * l1, f(phi + 0.5 * h * k1));
            let (k3, l3) = (rate + 0.5 * h * l2, f(phi + 0.5 * h * k2));
            let (k4, l4) = (rate + h * l3, f(phi + h * k3));
            phi += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
            rate += h / 6.0 * (l1 + 2.0 * l2 + 2.0 * l3 + l4);
        }
        out.push(vec![phi]);
    }
    out
}

/// Largest difference, `b` taken at every `stride`th row.
pub(super) fn largest(a: &[Vec<f64>], b: &[Vec<f64>], stride: usize) -> f64 {
    let reference = b.iter().skip(stride - 1).step_by(stride);
    a.iter().zip(reference).flat_map(|(a, b)| a.iter().zip(b)).fold(0.0, |m, (a, b)| larger(m, (a - b).abs()))
}

fn errors(case: &MechanismCase) -> Outcome<Vec<Figure>> {
    let id = |name: &str| format!("gluing.{}.{name}", case.name);
    let reference = reference(case)?;
    let mut all = Vec::new();
    if !case.table.is_empty() {
        let text = read_file(&root().join("tests/reference/gluing").join(case.table))?;
        let mut apart: f64 = 0.0;
        for line in text.lines().skip(2) {
            let numbers: Vec<f64> = line.split(',').filter_map(|f| f.parse().ok()).collect();
            let at = steps_to(numbers[0], 0.005) as usize;
            if let Some(row) = reference.get(at.wrapping_sub(1)) {
                for (value, column) in row.iter().zip(case.columns) {
                    apart = larger(apart, (value - numbers[*column]).abs());
                }
            }
        }
        let what = "the reference of the errors below against another program, rad";
        all.push(Figure::new(id("reference"), apart, Limit::AtMost(2e-6), what));
    }
    let (samples, tally) = run(case, 0.005, 0.005)?;
    let error = largest(&samples, &reference, 1);
    let what = format!("largest error of an angle over {} s at h = 5 ms, rad", case.until);
    all.push(Figure::new(id("error"), error, Limit::AtMost(case.error), what));
    all.push(Figure::new(id("gap"), tally.gap, Limit::AtMost(1e-10), "largest gap, m"));
    all.push(Figure::new(
        id("evaluations"),
        tally.mean(),
        Limit::AtMost(case.evaluations),
        format!("evaluations per step, at most {}", tally.most),
    ));
    let coarse = largest(&run(case, 0.01, 0.01)?.0, &reference, 2);
    let fine = largest(&run(case, 0.0025, 0.005)?.0, &reference, 1);
    let order = smaller((coarse / error).log2(), (error / fine).log2());
    all.push(Figure::new(id("order"), order, Limit::AtLeast(1.95), "observed order from 10, 5 and 2.5 ms"));
    Ok(all)
}

fn double_pendulum() -> Mechanism {
    Mechanism::double_pendulum([1.0; 2], [1.0; 2], [0.0; 2])
}

fn against_the_uncut() -> Outcome<Vec<Figure>> {
    let mut all = Vec::new();
    for strategy in ["iterative", "monolithic", "semi-implicit"] {
        let mut cut = build(&double_pendulum().cut(&Setting { strategy, ..setting(0.005) }, ALPHA))?;
        let mut whole = build(&double_pendulum().whole(&setting(0.005), ALPHA))?;
        let (mut worst, mut tally): (f64, _) = (0.0, Tally::default());
        step(&mut cut, 200, |cut| {
            whole.step().map_err(|e| e.to_string())?;
            tally.add(cut);
            for (a, b) in [("first.b0.angle", "all.b0.angle"), ("second.b0.angle", "all.b1.angle")] {
                worst = larger(worst, (read(cut, a)? - read(&whole, b)?).abs());
            }
            Ok(())
        })?;
        let limit = if strategy == "semi-implicit" { Limit::None } else { Limit::AtMost(1e-9) };
        let what = format!(
            "largest difference from the double pendulum uncut over 1 s, rad; gap {:.1e} m, {:.2} evaluations",
            tally.gap,
            tally.mean()
        );
        all.push(Figure::new(format!("gluing.double_pendulum.{strategy}.against_uncut"), worst, limit, what));
    }
    Ok(all)
}

/// Jacobians by differences, by Broyden's update, and one that is never refreshed.
fn jacobians() -> Outcome<Vec<Figure>> {
    let run = |jacobian: &str, steps: u64| {
        let kind = JacobianChoice::named(jacobian).ok_or("no such Jacobian")?;
        let mut testbed =
            build_with(&double_pendulum().cut(&setting(0.005), ALPHA), |gluing| gluing.jacobian = kind)?;
        let mut tally = Tally::default();
        step(&mut testbed, steps, |testbed| {
            tally.add(testbed);
            Ok(())
        })?;
        Ok::<_, String>(([read(&testbed, "first.b0.angle")?, read(&testbed, "second.b0.angle")?], tally))
    };
    let (own, analytic) = run("analytic", 200)?;
    let mut all = Vec::new();
    for jacobian in ["directional", "finite-differences", "broyden"] {
        let (other, tally) = run(jacobian, 200)?;
        let apart = larger((own[0] - other[0]).abs(), (own[1] - other[1]).abs());
        let id = |name: &str| format!("gluing.jacobian.{jacobian}.{name}");
        let what = "largest difference of an angle after 1 s from analytic Jacobians, rad";
        all.push(Figure::new(id("difference"), apart, Limit::AtMost(1e-8), what));
        let more = tally.mean() - analytic.mean();
        let limit = if jacobian == "broyden" { Limit::None } else { Limit::AtMost(0.5) };
        let what = "evaluations per step more than with analytic Jacobians; differences are counted apart";
        all.push(Figure::new(id("evaluations"), more, limit, what));
        // the first step needs one in any case, and differences are taken at the beginning of every step: only
        // Broyden's update decides
        let later = run(jacobian, 20)?.1.refreshes - run(jacobian, 1)?.1.refreshes;
        let limit = if jacobian == "broyden" { Limit::AtLeast(1.0) } else { Limit::None };
        let what = "refreshes in the steps 2 to 20";
        all.push(Figure::new(id("refreshes"), f64::from(later), limit, what));
    }
    let said = run("frozen", 200).err().unwrap_or_default();
    let failed = f64::from(u8::from(said.contains("did not converge")));
    let what = format!("control: a Jacobian that is never refreshed fails: {said}");
    all.push(Figure::new("gluing.jacobian.frozen.fails", failed, Limit::Equal(1.0), what));
    Ok(all)
}

/// A wrong T(t0) of one per cent: generalized-α forgets it, the trapezoidal rule does not.
fn wrong_start() -> Outcome<Vec<Figure>> {
    let trapezoid = "integrator = \"newmark\"";
    let mut all = Vec::new();
    for (name, integrator, limit) in
        [("alpha_0.8", ALPHA, Limit::AtMost(1e-7)), ("trapezoid", trapezoid, Limit::AtLeast(5e-3))]
    {
        let at = |scale: f64| {
            let gluing = "tolerance = 1e-10".to_owned();
            let text = double_pendulum().cut(&Setting { gluing, ..setting(0.005) }, integrator);
            build_with(&text, |gluing| gluing.start_scale = scale)
        };
        let (mut right, mut wrong) = (at(1.0)?, at(1.01)?);
        let mut last: f64 = 0.0;
        step(&mut right, 100, |right| {
            wrong.step().map_err(|e| e.to_string())?;
            last = (0..2).map(|c| (wrench(right, 0, c) - wrench(&wrong, 0, c)).abs()).fold(0.0, larger);
            Ok(())
        })?;
        let what = "difference of T 100 steps after a start with T(t0) wrong by 1 %, N";
        all.push(Figure::new(format!("gluing.wrong_start.{name}"), last, limit, what));
    }
    Ok(all)
}

/// A block on a plane, μ = 0.4, implicit Euler, h = 1 ms.
fn friction() -> Outcome<Vec<Figure>> {
    let block = |speed: f64, push: f64, duration: f64| {
        let setting = Setting {
            gluing: "tolerance = 1e-12".into(),
            ..Setting::iterative(0.001, [push / 2.0, -9.81, 0.0])
        };
        let body = Body { mass: 2.0, inertia: 0.1, pose: [0.0; 3], rate: [speed, 0.0, 0.0] };
        let text = setting.text()
            + &super::planar::bodies("block", "integrator = \"implicit-euler\"", &[body], &[])
            + "[[glue]]\nkind = \"contact\"\nside_1 = \"block.b0\"\nside_2 = \"world\"\nnormal = [0.0, 1.0, 0.0]\nmu = 0.4\n";
        let mut testbed = build(&text)?;
        step(&mut testbed, steps_to(duration, 0.001), |_| Ok(()))?;
        Ok::<_, String>(testbed)
    };
    let stopped = read(&block(1.5, 0.0, 1.0)?, "block.b0.x")?;
    let expected = 1.5 * 1.5 / (2.0 * 0.4 * 9.81) - 0.5e-3 * 1.5;
    let held = block(0.0, 5.0, 1.0)?;
    let (speed, force) = (read(&held, "block.b0.vx")?.abs(), wrench(&held, 0, 1));
    let pushed = read(&block(0.0, 10.0, 1.0)?, "block.b0.vx")?;
    let figure = |name: &str, value: f64, limit: f64, what: String| {
        Figure::new(format!("gluing.friction.{name}"), value, Limit::AtMost(limit), what)
    };
    Ok(vec![
        figure(
            "stop",
            (stopped - expected).abs(),
            1e-6,
            format!("a block of 1.5 m/s stops after {stopped} m: difference from {expected}"),
        ),
        figure("stick", speed, 1e-14, format!("speed of a block pushed by 5 N, m/s; T = {force} N")),
        figure(
            "slide",
            (pushed - 1.0760).abs(),
            1e-4,
            format!("{pushed} m/s after 1 s under 10 N, less 1.0760"),
        ),
    ])
}
