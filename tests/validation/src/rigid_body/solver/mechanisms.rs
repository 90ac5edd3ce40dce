//! Mechanisms of the IFToMM library of computational benchmark problems against reference motions: A01 pendulum, A02 windows,
//! A03 Andrews' squeezer, A04 Bricard, A05 flyball governor.

use crate::process::Outcome;
use crate::rigid_body::fixture::{Fixture, G, Urdf, pose, table};
use crate::{Context, Figure, Limit};
use nalgebra::Vector3;
use std::f64::consts::PI;
use terraglue_numerics::extremes::larger;

const X: [f64; 3] = [1.0, 0.0, 0.0];
const Y: [f64; 3] = [0.0, 1.0, 0.0];
const Z: [f64; 3] = [0.0, 0.0, 1.0];
const ORIGIN: [f64; 3] = [0.0; 3];
const SCHEMES: [&str; 2] = ["generalized-alpha", "energy-momentum"];

/// All of them.
pub fn figures(context: &Context) -> Outcome<Vec<Figure>> {
    let mut all = Vec::new();
    for scheme in SCHEMES {
        all.extend(pendulum(context, scheme)?);
        all.extend(windows(context, scheme, 2)?);
        all.extend(bricard(context, scheme)?);
        all.extend(governor(context, scheme)?);
        all.extend(squeezer(context, scheme)?);
    }
    if !context.quick {
        all.extend(windows(context, "energy-momentum", 40)?);
    }
    Ok(all)
}

fn parameters(file: &str, scheme: &str, more: &str) -> String {
    format!(r#"{{"model": "{file}", "fixed_base": true, "motor": "off", "integrator": "{scheme}"{more}}}"#)
}

/// The row of a table at a time; the first column is the time.
fn row_at(rows: &[Vec<f64>], t: f64) -> Outcome<&Vec<f64>> {
    let near =
        rows.iter().filter(|r| !r.is_empty()).min_by(|a, b| (a[0] - t).abs().total_cmp(&(b[0] - t).abs()));
    near.filter(|r| (r[0] - t).abs() < 1e-9).ok_or_else(|| format!("the reference has no row at {t} s"))
}

/// Largest |ΔE| over a run and ΔE at its end, J.
fn run(fixture: &mut Fixture, until: f64) -> Outcome<[f64; 2]> {
    let start = fixture.energy().mechanical();
    let mut energy = [0.0_f64; 2];
    fixture.run(until, |fixture| {
        let change = fixture.energy().mechanical() - start;
        energy = [larger(energy[0], change.abs()), change];
        Ok(())
    })?;
    Ok(energy)
}

/// A01: a point mass on a rod without mass, released horizontally; total energy 0.
fn pendulum(context: &Context, scheme: &str) -> Outcome<Vec<Figure>> {
    let file = Urdf::in_world()
        .body("bob", 1.0, [-1.0, 0.0, 0.0], [1e-9; 3])
        .joint("continuous", ["world", "bob"], ORIGIN, Z)
        .write(&context.scratch, "pendulum.urdf")?;
    let mut fixture = Fixture::new(&parameters(&file, scheme, ""), [0.0, -G, 0.0], 1e-3)?;
    let energy = run(&mut fixture, 10.0)?[0] / G;
    let rows = table("ref_A01.csv")?;
    let row = row_at(&rows, 10.0)?;
    let (p, q) = pose(&fixture.states()?[0]);
    let place = p + q * -Vector3::x() - Vector3::new(row[1], row[2], 0.0);
    let id = format!("rigid-body.a01.{scheme}");
    let limit = if scheme == "energy-momentum" { Limit::AtMost(1e-9) } else { Limit::None };
    Ok(vec![
        Figure::new(format!("{id}.energy"), energy, limit, "pendulum, 10 s, 1 ms: largest |ΔE|/(m g L)"),
        Figure::new(format!("{id}.place"), place.norm(), Limit::None, "the same: error at 10 s, m"),
    ])
}

/// A02: N four-bar windows side by side, which pass through a pose where all rods are in line.
fn windows(context: &Context, scheme: &str, n: usize) -> Outcome<Vec<Figure>> {
    let rod = [1.0 / 120.0, 1.0 / 12.0, 1.0 / 12.0];
    let upright = [1.0 / 12.0, 1.0 / 120.0, 1.0 / 12.0];
    let mut file = Urdf::in_world();
    let mut loops = Vec::new();
    for i in 0..=n {
        let post = format!("post{i}");
        file = file.body(&post, 1.0, [0.0, 0.5, 0.0], upright).joint(
            "continuous",
            ["world", &post],
            [i as f64, 0.0, 0.0],
            Z,
        );
    }
    for i in 0..n {
        let (post, next, bar) = (format!("post{i}"), format!("post{}", i + 1), format!("bar{i}"));
        file =
            file.body(&bar, 1.0, [0.5, 0.0, 0.0], rod).joint("continuous", [&post, &bar], [0.0, 1.0, 0.0], Z);
        loops.push(format!(
            r#"{{"name": "close{i}", "kind": "revolute", "links": ["{next}", "{bar}"], "origin": [0, 1, 0], "axis": [0, 0, 1]}}"#
        ));
    }
    let file = file.write(&context.scratch, &format!("windows{n}.urdf"))?;
    let more =
        format!(r#", "joint_rates": {{"j_post*": -1.0, "j_bar*": 1.0}}, "loop": [{}]"#, loops.join(","));
    let h = 1e-3;
    let mut fixture = Fixture::new(&parameters(&file, scheme, &more), [0.0, -G, 0.0], h)?;
    let redundant = fixture.get(fixture.id("loops.redundant_rows")?)?;
    let id = format!("rigid-body.a02_n{n}.{scheme}");
    let energy = match run(&mut fixture, 10.0) {
        Ok(energy) => energy,
        // The long row of windows is reported, not judged.
        Err(e) if n != 2 => return Ok(vec![Figure::skipped(format!("{id}.place"), e)]),
        Err(e) => return Ok(vec![Figure::new(format!("{id}.place"), f64::NAN, Limit::AtMost(1e-4), e)]),
    };
    let rows = table(&format!("ref_A02_N{n}.csv"))?;
    let row = row_at(&rows, 10.0)?;
    let (p, q) = pose(&fixture.states()?[0]);
    let place = (p + q * Vector3::y() - Vector3::new(row[1], row[2], 0.0)).norm();
    let limit = if n == 2 { Limit::AtMost(1e-4) } else { Limit::None };
    let what = format!("{n} four-bar windows through their singular pose, 10 s, 1 ms: error of B0, m");
    Ok(vec![
        Figure::new(format!("{id}.place"), place, limit, what),
        Figure::new(format!("{id}.energy"), energy[0], Limit::None, "the same: largest |ΔE|, J"),
        Figure::new(
            format!("{id}.redundant"),
            redundant,
            Limit::Equal(3.0 * n as f64),
            "the same: redundant rows",
        ),
    ])
}

/// A03: seven bodies, rates up to 1140 rad/s.
fn squeezer(context: &Context, scheme: &str) -> Outcome<Vec<Figure>> {
    let (text, beta) = squeezer_model(context, scheme)?;
    // The step is free here: rates reach 1140 rad/s.
    let h = if scheme == "energy-momentum" { 1e-5 } else { 5e-6 };
    let mut fixture = Fixture::new(&text, ORIGIN, h)?;
    let id = format!("rigid-body.a03.{scheme}");
    let target = fixture.id("j_k1.torque_target")?;
    fixture.set(&[target], &[0.033])?;
    let angle = fixture.id("j_k1.angle")?;
    let start = fixture.energy().mechanical();
    let mut balance = 0.0_f64;
    let done = fixture.run(0.03, |fixture| {
        let work = 0.033 * (fixture.get(angle)? - beta);
        balance = larger(balance, (fixture.energy().mechanical() - start - work).abs());
        Ok(())
    });
    if let Err(e) = done {
        return Ok(vec![Figure::new(format!("{id}.beta"), f64::NAN, Limit::AtMost(1e-4), e)]);
    }
    let rows = table("ref_A03.csv")?;
    let error = (fixture.get(angle)? - row_at(&rows, 0.03)?[1]).abs();
    let what = format!("Andrews' squeezer at {} us: error of the driven angle at 0.03 s, rad", 1e6 * h);
    Ok(vec![
        Figure::new(format!("{id}.beta"), error, Limit::AtMost(1e-4), what),
        Figure::new(format!("{id}.balance"), balance, Limit::None, "the same: largest |energy - work|, J"),
    ])
}

/// Andrews' squeezer as parameters of a robot, and the driven angle at the start.
fn squeezer_model(context: &Context, scheme: &str) -> Outcome<(String, f64)> {
    let (d, da, e, ea, rr, ra) = (0.028, 0.0115, 0.02, 0.01421, 0.007, 0.00092);
    let (ss, sa, sb, sc, sd) = (0.035, 0.01874, 0.01043, 0.018, 0.02);
    let (ta, tb, u, ua, ub, zf, zt, fa) = (0.02308, 0.00916, 0.04, 0.01228, 0.00449, 0.02, 0.04, 0.01421);
    let [beta, theta, gamma, phi, delta, omega, epsilon] = [
        -0.0617138900142764,
        0.0,
        0.455279819163070,
        0.222668390165886,
        0.487364979543843,
        -0.222668390165886,
        1.230547444549821,
    ];
    let (a, b, c) = ([-0.06934, -0.00227, 0.0], [-0.03635, 0.03273, 0.0], [0.014, 0.072, 0.0]);
    let flat = |i: f64| [i; 3];
    // Frames: x along the rod of K1, K5; the axes of the table for the others.
    let file = Urdf::in_world()
        .body("k1", 0.04325, [ra, 0.0, 0.0], flat(2.194e-6))
        .body("k2", 0.00365, [-da, 0.0, 0.0], flat(4.410e-7))
        .body("k3", 0.02373, [sb, -sa, 0.0], flat(5.255e-6))
        .body("k4", 0.00706, [0.0, -(e - ea), 0.0], flat(5.667e-7))
        .body("k5", 0.07050, [ta, tb, 0.0], flat(1.169e-5))
        .body("k6", 0.00706, [zf - fa, 0.0, 0.0], flat(5.667e-7))
        .body("k7", 0.05498, [ub, -ua, 0.0], flat(1.912e-5))
        .joint("continuous", ["world", "k1"], ORIGIN, Z)
        .joint("continuous", ["k1", "k2"], [rr, 0.0, 0.0], Z)
        .joint("continuous", ["world", "k3"], b, Z)
        .joint("continuous", ["world", "k5"], a, Z)
        .joint("continuous", ["k5", "k4"], [zt, 0.0, 0.0], Z)
        .joint("continuous", ["world", "k7"], a, Z)
        .joint("continuous", ["k7", "k6"], [0.0, -u, 0.0], Z)
        .write(&context.scratch, "squeezer.urdf")?;
    let at_e = |body: &str, point: [f64; 3]| {
        format!(
            r#"{{"name": "{body}_e", "kind": "revolute", "links": ["k3", "{body}"], "axis": [0, 0, 1],
            "origin": [0, {}, 0], "origin_2": {point:?}}}"#,
            -ss
        )
    };
    let more = format!(
        r#", "motor": {{"*": "off", "j_k1": "torque"}}, "max_torque": 1.0,
        "joints": {{"j_k1": {beta}, "j_k2": {theta}, "j_k3": {gamma}, "j_k5": {delta}, "j_k4": {phi}, "j_k7": {epsilon},
        "j_k6": {omega}}}, "loop": [{}, {}, {}],
        "spring": [{{"name": "s", "links": ["k3", "world"], "origin": [{sd}, {}, 0], "origin_2": {c:?},
        "stiffness": 4530, "rest_length": 0.07785}}]"#,
        at_e("k2", [-d, 0.0, 0.0]),
        at_e("k4", [0.0, -e, 0.0]),
        at_e("k6", [zf, 0.0, 0.0]),
        -sc,
    );
    let text = format!(r#"{{"model": "{file}", "fixed_base": true, "integrator": "{scheme}"{more}}}"#);
    Ok((text, beta))
}

/// A04: five rods, six revolute joints, one redundant row.
fn bricard(context: &Context, scheme: &str) -> Outcome<Vec<Figure>> {
    let along = (0.01 + 0.01) / 12.0;
    let across = (1.0 + 0.01) / 12.0;
    let places: [[f64; 3]; 6] =
        [ORIGIN, X, [1.0, -1.0, 0.0], [1.0, -1.0, 1.0], [0.0, -1.0, 1.0], [0.0, 0.0, 1.0]];
    let axes = [Y, Z, X, Y, Z, X];
    let mut file = Urdf::in_world();
    let mut parent = "world".to_owned();
    let mut last = ORIGIN;
    for k in 0..5 {
        let rod: [f64; 3] = std::array::from_fn(|i| places[k + 1][i] - places[k][i]);
        let name = format!("rod{k}");
        let place: [f64; 3] = std::array::from_fn(|i| places[k][i] - last[i]);
        file = file
            .body(&name, 1.0, rod.map(|x| 0.5 * x), rod.map(|x| if x == 0.0 { across } else { along }))
            .joint("continuous", [&parent, &name], place, axes[k]);
        (parent, last) = (name, places[k]);
    }
    let file = file.write(&context.scratch, "bricard.urdf")?;
    let more = r#", "loop": [{"name": "close", "kind": "revolute", "links": ["world", "rod4"], "origin": [0, 0, 1],
        "axis": [1, 0, 0]}]"#;
    let mut fixture = Fixture::new(&parameters(&file, scheme, more), [0.0, -G, 0.0], 1e-3)?;
    let redundant = fixture.get(fixture.id("loops.redundant_rows")?)?;
    let id = format!("rigid-body.a04.{scheme}");
    let energy = match run(&mut fixture, 10.0) {
        Ok(energy) => energy,
        Err(e) => return Ok(vec![Figure::new(format!("{id}.place"), f64::NAN, Limit::AtMost(1e-3), e)]),
    };
    let rows = table("ref_A04.csv")?;
    let row = row_at(&rows, 10.0)?;
    let (p, q) = pose(&fixture.states()?[2]);
    let place = (p + q * Vector3::z() - Vector3::new(row[2], row[3], row[4])).norm();
    Ok(vec![
        Figure::new(
            format!("{id}.place"),
            place,
            Limit::AtMost(1e-3),
            "Bricard's mechanism, 10 s, 1 ms: error of P3, m",
        ),
        Figure::new(format!("{id}.energy"), energy[0], Limit::None, "the same: largest |ΔE|, J"),
        Figure::new(format!("{id}.redundant"), redundant, Limit::Equal(1.0), "the same: redundant rows"),
    ])
}

/// A05: flyball governor with stiff spring-dampers.
fn governor(context: &Context, scheme: &str) -> Outcome<Vec<Figure>> {
    let thin = 0.3 * (1e-4 + 1e-4) / 12.0;
    let long = 0.3 * (1.0 + 1e-4) / 12.0;
    let cube = 3.0 * 0.02 / 12.0;
    let alpha = PI / 6.0;
    // Rod (0.3 kg) and point mass (5 kg) at its end as one body; frame at the hinge, x outwards along the rod.
    let com = (0.3 * 0.5 + 5.0) / 5.3;
    let about = long + 0.3 * (com - 0.5) * (com - 0.5) + 5.0 * (1.0 - com) * (1.0 - com);
    let file = Urdf::in_world()
        .body("shaft", 0.3, [0.0, 0.0, 0.5], [long, long, thin])
        .body("slider", 3.0, ORIGIN, [cube; 3])
        .body("right", 5.3, [com, 0.0, 0.0], [thin, about, about])
        .body("left", 5.3, [-com, 0.0, 0.0], [thin, about, about])
        .joint("continuous", ["world", "shaft"], ORIGIN, Z)
        .joint("prismatic", ["shaft", "slider"], ORIGIN, Z)
        .joint("continuous", ["shaft", "right"], [0.05, 0.0, 1.0], Y)
        .joint("continuous", ["shaft", "left"], [-0.05, 0.0, 1.0], [0.0, -1.0, 0.0])
        .write(&context.scratch, "governor.urdf")?;
    let spring = |name: &str, x: f64| {
        format!(
            r#"{{"name": "spring_{name}", "links": ["slider", "{name}"], "origin": [{}, 0, 0],
            "origin_2": [{}, 0, 0], "stiffness": 8e5, "damping": 4e4, "rest_length": 0.5}}"#,
            0.05 * x,
            0.5 * x
        )
    };
    let more = format!(
        r#", "joints": {{"j_right": {alpha}, "j_left": {alpha}, "j_slider": 0.5}},
        "joint_rates": {{"j_shaft": {}}}, "spring": [{}, {}]"#,
        2.0 * PI,
        spring("right", 1.0),
        spring("left", -1.0)
    );
    let mut fixture = Fixture::new(&parameters(&file, scheme, &more), [0.0, 0.0, -G], 1e-3)?;
    let id = format!("rigid-body.a05.{scheme}");
    if let Err(e) = run(&mut fixture, 10.0) {
        return Ok(vec![Figure::new(format!("{id}.slider"), f64::NAN, Limit::AtMost(1e-4), e)]);
    }
    let rows = table("ref_A05.csv")?;
    let row = row_at(&rows, 10.0)?;
    let error = (fixture.get(fixture.id("j_slider.angle")?)? - row[2]).abs();
    let what = "flyball governor, 10 s, 1 ms: error of the slider's height, m";
    let angle = (fixture.get(fixture.id("j_right.angle")?)? - row[1]).abs();
    Ok(vec![
        Figure::new(format!("{id}.slider"), error, Limit::AtMost(1e-4), what),
        Figure::new(format!("{id}.alpha"), angle, Limit::None, "the same: error of the arm's angle, rad"),
    ])
}
