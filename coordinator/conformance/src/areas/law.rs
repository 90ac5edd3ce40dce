//! Tests of the functions of a law that is a module: values, slopes, arrays, state. The tests of a soil come on top of
//! these, with the law in the soil that comes with the program.

use super::values::not_told;
use crate::definition::Test;
use crate::finding::{Stop, Verdict};
use crate::fixture::LawFixture;
use crate::scope::{Area, Level};
use crate::test_context::TestContext;
use std::time::Instant;
use terraglue_host::described;
use terraglue_subsystem::Kind;

const fn test(
    name: &'static str,
    area: Area,
    level: Level,
    after: &'static [&'static str],
    promise: &'static str,
    run: fn(&TestContext) -> Verdict,
) -> Test {
    Test { name, area, level, kinds: &[Kind::Law], after, promise, run }
}

/// The tests of this area. One mistake is to be one finding: first that a law can be called at all, then that it answers numbers, then
/// that they are the same again, then what they mean.
pub const TESTS: &[Test] = {
    use Area::{Library, LifeCycle, Numbers, Physics, Resources, State};
    use Level::{Quick, Standard};
    const ANSWERS: &[&str] = &["law-answers"];
    &[
        test(
            "law-opens",
            LifeCycle,
            Quick,
            &["schema"],
            "its functions can be had with usual numbers",
            opens,
        ),
        test(
            "law-described",
            Library,
            Standard,
            &["law-opens"],
            "its section names the functions that it has",
            described_functions,
        ),
        test(
            "law-arrays",
            LifeCycle,
            Quick,
            &["law-opens"],
            "0, 1, 7 and 1000 nodes are answered, and nothing beyond them is touched",
            arrays,
        ),
        test(
            "law-answers",
            Numbers,
            Quick,
            &["law-arrays"],
            "finite values and slopes over the range of depths, sizes, slips",
            answers,
        ),
        test(
            "law-same-again",
            Numbers,
            Quick,
            ANSWERS,
            "the same call gives the same bytes, on any thread",
            same_again,
        ),
        test(
            "law-node-by-node",
            Numbers,
            Quick,
            &["law-same-again"],
            "many nodes at once get what each gets alone",
            node_by_node,
        ),
        test(
            "law-shear-slopes",
            Numbers,
            Quick,
            ANSWERS,
            "the slopes of the shear stress are its derivatives",
            shear_slopes,
        ),
        test("law-no-tension", Physics, Quick, ANSWERS, "the pressure is never negative", no_tension),
        test(
            "law-slope",
            Numbers,
            Quick,
            &["law-no-tension"],
            "the slope of the pressure is its derivative",
            slope,
        ),
        test(
            "law-rises",
            Physics,
            Quick,
            &["law-no-tension"],
            "the pressure does not fall with the depth",
            rises,
        ),
        test(
            "law-carries",
            Physics,
            Quick,
            &["law-no-tension"],
            "it carries something within the first metre",
            carries,
        ),
        test(
            "law-starts-at-zero",
            Physics,
            Quick,
            &["law-carries"],
            "the pressure fades out at the surface",
            starts_at_zero,
        ),
        test(
            "law-shear-rises",
            Physics,
            Quick,
            ANSWERS,
            "the shear stress falls neither with pressure nor with slip",
            shear_rises,
        ),
        test(
            "law-shear-bound",
            Physics,
            Quick,
            &["law-shear-rises"],
            "the shear stress ends at its strength",
            shear_bound,
        ),
        test(
            "law-friction-reached",
            Physics,
            Quick,
            &["law-shear-bound"],
            "far slipped soil reaches c + p tan(phi) where it has these numbers",
            friction_reached,
        ),
        test(
            "law-state-kept-apart",
            State,
            Quick,
            ANSWERS,
            "the committed state is read, never written",
            state_apart,
        ),
        test(
            "law-state-fresh",
            Physics,
            Quick,
            &["law-state-kept-apart", "law-no-tension"],
            "untouched ground has its surface at 0",
            state_fresh,
        ),
        test(
            "law-unloads",
            Physics,
            Quick,
            &["law-state-fresh"],
            "a pressed node is unloaded where the law says that its surface is",
            unloads,
        ),
        test(
            "law-cycles",
            Physics,
            Quick,
            &["law-unloads", "law-rises"],
            "no path of a node gains energy",
            cycles,
        ),
        test(
            "law-pause",
            Physics,
            Quick,
            &["law-same-again", "law-state-kept-apart"],
            "a step of no length changes nothing",
            pause,
        ),
        test(
            "law-time-per-node",
            Resources,
            Standard,
            ANSWERS,
            "a node takes less than a microsecond",
            time_per_node,
        ),
    ]
};

/// Depths from a tenth of a millimetre to half a metre.
fn depths() -> Vec<f64> {
    (0..60).map(|k| 1e-4 * 5000f64.powf(f64::from(k) / 59.0)).collect()
}

/// Pressures from 1 Pa to 1 MPa.
fn loads() -> Vec<f64> {
    (0..24).map(|k| 1e6f64.powf(f64::from(k) / 23.0)).collect()
}

/// Sizes of contacts, m.
const SIZES: [f64; 5] = [2e-3, 0.02, 0.05, 0.3, 2.0];
/// Slips, m.
const SLIPS: [f64; 6] = [0.0, 1e-5, 1e-3, 0.01, 0.1, 1.0];

/// Whether a slope lies between two one-sided differences: at a kink they differ, and anything between is right.
fn agrees(slope: f64, near: [f64; 2], tolerance: f64) -> bool {
    slope >= near[0].min(near[1]) - tolerance && slope <= near[0].max(near[1]) + tolerance
}

fn opens(context: &TestContext) -> Verdict {
    LawFixture::open(context).map(|_| ())
}

fn described_functions(context: &TestContext) -> Verdict {
    let law = LawFixture::open(context)?;
    let has = [("pressure", law.has_pressure()), ("shear", law.has_shear())];
    let words: Vec<&str> = has.iter().filter(|(_, has)| *has).map(|(word, _)| *word).collect();
    let section = described(&context.path).unwrap_or_default();
    if !section.is_whole() {
        return Err(not_told(&["kind=law".into(), format!("can={}", words.join(" "))]));
    }
    match section.other_words(&words) {
        None => Ok(()),
        Some((got, expected)) => Err(Stop::fail("the table", "the section .terraglue", got, expected)),
    }
}

fn answers(context: &TestContext) -> Verdict {
    let mut law = LawFixture::open(context)?;
    for b in SIZES {
        law.press(b, 1e-3, &depths())?;
    }
    for slip in SLIPS {
        law.drag(&loads(), slip)?;
    }
    Ok(())
}

fn arrays(context: &TestContext) -> Verdict {
    let mut law = LawFixture::open(context)?;
    for n in [0, 1, 7, 1000] {
        let depths: Vec<f64> = (0..n).map(|k| 1e-3 + 1e-5 * k as f64).collect();
        law.press(0.05, 1e-3, &depths)?;
        let loads: Vec<f64> = (0..n).map(|k| 100.0 + k as f64).collect();
        law.drag(&loads, 0.01)?;
    }
    Ok(())
}

fn node_by_node(context: &TestContext) -> Verdict {
    let mut law = LawFixture::open(context)?;
    let close = |a: f64, b: f64| (a - b).abs() <= 1e-13 * a.abs().max(b.abs());
    let depths = depths();
    let (p, slope) = law.press(0.05, 1e-3, &depths)?;
    for (k, z) in depths.iter().enumerate() {
        let (one, one_slope) = law.press(0.05, 1e-3, &[*z])?;
        if !(one.is_empty() || close(one[0], p[k]) && close(one_slope[0], slope[k])) {
            let given = format!("z = {z:.5} m as node {k} of {}, and alone", depths.len());
            let got = format!("{} and {} Pa, slopes {} and {}", p[k], one[0], slope[k], one_slope[0]);
            return Err(Stop::fail("pressure", given, got, "the same: nodes do not feel each other"));
        }
    }
    let loads = loads();
    let many = law.drag(&loads, 0.01)?;
    for (k, load) in loads.iter().enumerate() {
        let one = law.drag(&[*load], 0.01)?;
        if !(0..3).all(|c| one[c].is_empty() || close(one[c][0], many[c][k])) {
            let given = format!("sigma = {load:.1} Pa as node {k} of {}, and alone", loads.len());
            return Err(Stop::fail(
                "shear",
                given,
                "different answers",
                "the same: nodes do not feel each other",
            ));
        }
    }
    Ok(())
}

fn same_again(context: &TestContext) -> Verdict {
    // more nodes than those of which the host keeps what a module in Python answered
    let (many_depths, many_loads) = (depths().repeat(2), loads().repeat(3));
    let run = |law: &mut LawFixture| -> Verdict<Vec<u64>> {
        let (p, slope) = law.press(0.05, 1e-3, &many_depths)?;
        let [a, b, c] = law.drag(&many_loads, 0.02)?;
        Ok([p, slope, a, b, c].iter().flatten().map(|x| x.to_bits()).collect())
    };
    let mut law = LawFixture::open(context)?;
    let first = run(&mut law)?;
    let again = run(&mut law)?;
    let elsewhere = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..4).map(|_| scope.spawn(|| run(&mut LawFixture::open(context)?))).collect();
        threads.into_iter().map(|t| t.join()).collect::<Vec<_>>()
    });
    let differs = |where_: &str| {
        let given = format!("{} depths and {} pressures, {where_}", many_depths.len(), many_loads.len());
        Err(Stop::fail("pressure, shear", given, "other bytes", "the same bytes"))
    };
    if again != first {
        return differs("twice");
    }
    for bits in elsewhere {
        if !bits.is_ok_and(|bits| bits.is_ok_and(|bits| bits == first)) {
            return differs("on four threads at once");
        }
    }
    Ok(())
}

fn slope(context: &TestContext) -> Verdict {
    let mut law = LawFixture::open(context)?;
    for b in [0.02, 0.3] {
        for z in depths() {
            let d = 1e-6 * z;
            let around = [z - 2.0 * d, z - d, z, z + d, z + 2.0 * d];
            let (p, slope) = law.press(b, 1e-3, &around)?;
            if p.is_empty() {
                return Err(Stop::Skip("it has no pressure function: that of the soil acts".into()));
            }
            let near = [(p[2] - p[1]) / d, (p[3] - p[2]) / d];
            let scale = p[2] / z;
            if !agrees(slope[2], near, 1e-6 * scale) {
                let got = format!("a slope of {:.9e} Pa/m", slope[2]);
                let expected = format!("{:.9e} Pa/m, by differences", 0.5 * (near[0] + near[1]));
                return Err(Stop::fail("pressure", format!("z = {z:.6} m, b = {b} m"), got, expected));
            }
        }
    }
    Ok(())
}

fn shear_slopes(context: &TestContext) -> Verdict {
    let mut law = LawFixture::open(context)?;
    for slip in [1e-4, 3e-3, 0.02, 0.2] {
        for load in loads() {
            let (d, e) = (1e-5 * load, 1e-5 * slip);
            let [tau, by_load, _] = law.drag(&[load - d, load, load + d], slip)?;
            if tau.is_empty() {
                return Err(Stop::Skip("it has no shear function: that of the soil acts".into()));
            }
            let near = [(tau[1] - tau[0]) / d, (tau[2] - tau[1]) / d];
            let given = format!("sigma = {load:.3} Pa, j = {slip} m");
            if !agrees(by_load[1], near, 1e-6 * (tau[1] / load).max(1e-6)) {
                let got = format!("a derivative by the pressure of {:.9e}", by_load[1]);
                let expected = format!("{:.9e}, by differences", 0.5 * (near[0] + near[1]));
                return Err(Stop::fail("shear", given, got, expected));
            }
            let [before, _, _] = law.drag(&[load], slip - e)?;
            let [after, _, _] = law.drag(&[load], slip + e)?;
            let [now, _, by_slip] = law.drag(&[load], slip)?;
            let near = [(now[0] - before[0]) / e, (after[0] - now[0]) / e];
            if !agrees(by_slip[0], near, 1e-6 * (now[0] / slip).max(1e-6)) {
                let got = format!("a derivative by the slip of {:.9e} Pa/m", by_slip[0]);
                let expected = format!("{:.9e} Pa/m, by differences", 0.5 * (near[0] + near[1]));
                return Err(Stop::fail("shear", given, got, expected));
            }
        }
    }
    Ok(())
}

fn no_tension(context: &TestContext) -> Verdict {
    let mut law = LawFixture::open(context)?;
    for b in SIZES {
        let depths = depths();
        let (p, _) = law.press(b, 1e-3, &depths)?;
        if let Some(k) = p.iter().position(|p| *p < 0.0) {
            let given = format!("z = {:.6} m, b = {b} m", depths[k]);
            return Err(Stop::fail("pressure", given, format!("{} Pa", p[k]), ">= 0: soil does not pull"));
        }
    }
    Ok(())
}

fn rises(context: &TestContext) -> Verdict {
    let mut law = LawFixture::open(context)?;
    for b in SIZES {
        let depths = depths();
        let (p, _) = law.press(b, 1e-3, &depths)?;
        if let Some(k) = (1..p.len()).find(|k| p[*k] < p[k - 1] * (1.0 - 1e-12)) {
            let given = format!("z from {:.5} to {:.5} m, b = {b} m", depths[k - 1], depths[k]);
            let got = format!("the pressure falls from {:.4e} to {:.4e} Pa", p[k - 1], p[k]);
            return Err(Stop::fail("pressure", given, got, "no fall: a foot would have no unique depth"));
        }
    }
    Ok(())
}

fn carries(context: &TestContext) -> Verdict {
    let mut law = LawFixture::open(context)?;
    for b in SIZES {
        let (p, _) = law.press(b, 1e-3, &[0.5])?;
        if p.first().is_some_and(|p| *p <= 0.0) {
            let given = format!("z = 0.5 m, b = {b} m");
            return Err(Stop::fail("pressure", given, "0 Pa", "a pressure: the foot would fall for ever"));
        }
    }
    Ok(())
}

fn starts_at_zero(context: &TestContext) -> Verdict {
    let mut law = LawFixture::open(context)?;
    let (p, _) = law.press(0.05, 1e-3, &[1e-9, 1e-2])?;
    if p.len() == 2 && p[0] > 0.5 * p[1] {
        let got = format!("{:.4e} Pa; {:.4e} Pa at 1 cm", p[0], p[1]);
        return Err(Stop::fail(
            "pressure",
            "z = 1e-9 m, b = 0.05 m",
            got,
            "nearly nothing: a foot would be kicked at the touch",
        ));
    }
    Ok(())
}

fn shear_rises(context: &TestContext) -> Verdict {
    let mut law = LawFixture::open(context)?;
    let mut before = Vec::new();
    for slip in SLIPS {
        let loads = loads();
        let [tau, ..] = law.drag(&loads, slip)?;
        if let Some(k) = (1..tau.len()).find(|k| tau[*k] < tau[k - 1] * (1.0 - 1e-12)) {
            let got = format!("the stress falls from {:.4e} to {:.4e} Pa", tau[k - 1], tau[k]);
            let given = format!("sigma from {:.2} to {:.2} Pa, j = {slip} m", loads[k - 1], loads[k]);
            return Err(Stop::fail("shear", given, got, "no fall with the pressure"));
        }
        if let Some(k) = (0..before.len()).find(|k| tau[*k] < before[*k] * (1.0 - 1e-12)) {
            let got = format!("the stress falls from {:.4e} to {:.4e} Pa", before[k], tau[k]);
            let given = format!("sigma = {:.2} Pa, j up to {slip} m", loads[k]);
            return Err(Stop::fail(
                "shear",
                given,
                got,
                "no fall with the slip: the way back to it would not be unique",
            ));
        }
        before = tau;
    }
    Ok(())
}

fn shear_bound(context: &TestContext) -> Verdict {
    let mut law = LawFixture::open(context)?;
    for load in [100.0, 1e4] {
        let [near, ..] = law.drag(&[load], 10.0)?;
        let [far, ..] = law.drag(&[load], 100.0)?;
        if near.first().zip(far.first()).is_some_and(|(a, b)| *b > 1.5 * a) {
            let got = format!("{:.4e} Pa at j = 10 m, {:.4e} Pa at 100 m", near[0], far[0]);
            return Err(Stop::fail(
                "shear",
                format!("sigma = {load} Pa"),
                got,
                "a stress that ends at the strength",
            ));
        }
    }
    Ok(())
}

fn friction_reached(context: &TestContext) -> Verdict {
    let mut law = LawFixture::open(context)?;
    let (Some(c), Some(phi)) = (law.number("c_pa"), law.number("phi_rad")) else {
        return Err(Stop::Skip(
            "it has no numbers `c_pa` and `phi_rad`: the friction it reaches is not compared".into(),
        ));
    };
    for load in [1e3, 1e4, 1e5] {
        let [tau, ..] = law.drag(&[load], 100.0)?;
        let strength = c + load * phi.tan();
        if tau.first().is_some_and(|t| (t / strength - 1.0).abs() > 0.02) {
            let given = format!("sigma = {load} Pa, j = 100 m");
            let expected = format!("{strength:.5e} Pa = c_pa + sigma tan(phi_rad)");
            return Err(Stop::fail("shear", given, format!("{:.5e} Pa", tau[0]), expected));
        }
    }
    Ok(())
}

const NO_STATE: &str = "it keeps no state: unloading is elastic, by the soil";

fn state_apart(context: &TestContext) -> Verdict {
    let mut law = LawFixture::open(context)?;
    if law.doubles() == 0 {
        return Err(Stop::Skip(NO_STATE.into()));
    }
    // the fixture compares what it handed out with what it has afterwards
    let mut node = law.node();
    for depth in [0.01, 0.02, 0.015, 0.03] {
        node.commit(&mut law, 0.05, depth)?;
    }
    Ok(())
}

fn state_fresh(context: &TestContext) -> Verdict {
    let mut law = LawFixture::open(context)?;
    if law.doubles() == 0 {
        return Err(Stop::Skip(NO_STATE.into()));
    }
    let above = law.node().at(&mut law, 0.05, -1e-3)?;
    if above.0 > 0.0 {
        let got = format!("{} Pa", above.0);
        return Err(Stop::fail("pressure", "untouched ground, a foot 1 mm above it", got, "0"));
    }
    Ok(())
}

fn unloads(context: &TestContext) -> Verdict {
    let mut law = LawFixture::open(context)?;
    if law.doubles() == 0 {
        return Err(Stop::Skip(NO_STATE.into()));
    }
    for depth in [1e-3, 0.01, 0.1] {
        let mut node = law.node();
        node.commit(&mut law, 0.05, depth)?;
        let surface = node.permanent;
        let given =
            format!("a node pressed to {depth} m, which then says that its surface is at {surface:.6} m");
        if !(surface >= 0.0 && surface <= depth) {
            return Err(Stop::fail(
                "pressure",
                given,
                "a surface outside the print",
                "0 <= permanent <= depth",
            ));
        }
        let (p, _) = node.at(&mut law, 0.05, surface - 1e-6)?;
        if p > 1e-3 * law_scale(&mut law, depth)? {
            return Err(Stop::fail("pressure", given, format!("{p:.4e} Pa a micrometre above it"), "0"));
        }
    }
    Ok(())
}

fn law_scale(law: &mut LawFixture, depth: f64) -> Verdict<f64> {
    law.node().at(law, 0.05, depth).map(|(p, _)| p.max(1.0))
}

/// Random ways of a node from untouched ground; work is the integral of the pressure.
fn cycles(context: &TestContext) -> Verdict {
    let mut law = LawFixture::open(context)?;
    if !law.has_pressure() {
        return Err(Stop::Skip("it has no pressure function: that of the soil acts".into()));
    }
    let mut random = context.random("law-cycles");
    for _ in 0..context.count(10) {
        let mut node = law.node();
        let (mut depth, mut p, mut work, mut turned) = (0.0, 0.0, 0.0, 0.0);
        for turn in 0..12 {
            // the last turn lifts the foot off
            let to = if turn == 11 { -0.01 } else { 0.05 * random.unit() };
            for k in 1..=100 {
                let next = depth + (to - depth) * f64::from(k) / 100.0;
                let now = node.commit(&mut law, 0.05, next)?;
                let line = 0.5 * (p + now) * (next - node.last);
                // unloaded within the step: it gives out between nothing and the straight line
                let step = if now <= 0.0 && line < 0.0 { 0.0 } else { line };
                (work, turned, p, node.last) = (work + step, turned + line.abs(), now, next);
            }
            depth = to;
        }
        if work < -1e-3 * turned {
            let got = format!("{:.4e} J/m² more than was put in, of {turned:.4e} J/m² turned over", -work);
            return Err(Stop::fail("pressure", "a node pressed and released at random", got, "work >= 0"));
        }
    }
    Ok(())
}

fn pause(context: &TestContext) -> Verdict {
    let mut law = LawFixture::open(context)?;
    if law.doubles() == 0 {
        let (a, _) = law.press(0.05, 0.0, &depths())?;
        let (b, _) = law.press(0.05, 1e-3, &depths())?;
        return match a == b {
            true => Ok(()),
            false => Err(Stop::fail(
                "pressure",
                "h = 0 and h = 1 ms",
                "other pressures",
                "the same: without a state there is no rate",
            )),
        };
    }
    let mut node = law.node();
    node.commit(&mut law, 0.05, 0.01)?;
    let before = (node.state.clone(), node.permanent);
    node.commit_in(&mut law, 0.05, 0.01, 0.0)?;
    if before != (node.state.clone(), node.permanent) {
        let got = format!("the state goes from {:?} to {:?}", before.0, node.state);
        return Err(Stop::fail("pressure", "the same depth again, h = 0", got, "no change"));
    }
    Ok(())
}

fn time_per_node(context: &TestContext) -> Verdict {
    let mut law = LawFixture::open(context)?;
    let depths: Vec<f64> = (0..1000).map(|k| 1e-3 + 1e-5 * f64::from(k)).collect();
    let mut best = f64::INFINITY;
    for _ in 0..20 {
        let start = Instant::now();
        law.press(0.05, 1e-3, &depths)?;
        law.drag(&depths, 0.01)?;
        best = best.min(start.elapsed().as_secs_f64() / 1000.0);
    }
    if best < 1e-6 {
        return Ok(());
    }
    Err(Stop::Warning(format!(
        "{:.2} µs per node; a robot with six feet has some hundred nodes and ten trials per step",
        1e6 * best
    )))
}
