//! Nothing depends on where the world's origin lies, how a frame is turned, or in which order feet come.

use super::physics_soil::dragged;
use crate::definition::Test;
use crate::finding::{Stop, Verdict};
use crate::fixture::{Flat, Foot, Moved, SoilFixture, dot};
use crate::scope::{Area, Level};
use crate::test_context::TestContext;
use terraglue_subsystem::Kind;

const fn test(name: &'static str, promise: &'static str, run: fn(&TestContext) -> Verdict) -> Test {
    let (area, level, after) = (Area::Physics, Level::Quick, &["steps"]);
    Test { name, area, level, kinds: &[Kind::Soil], after, promise, run }
}

/// The tests of this area.
pub const TESTS: &[Test] = {
    &[
        test("translation", "the same foot elsewhere on the same ground meets the same force", translation),
        test("height", "the same ground higher up gives the same force", height),
        test("quarter-turn", "a drag along y is a drag along x, turned", quarter_turn),
        test("any-turn", "no direction along the ground is special", any_turn),
        test("port-frame", "tangents turned about the normal give the same force in the world", port_frame),
        test("far-feet", "feet far apart do not feel each other", far_feet),
    ]
};

/// Whether two forces in the world agree to a share of the first.
fn agree(given: &str, a: [f64; 3], b: [f64; 3], share: f64) -> Verdict {
    let gap: [f64; 3] = std::array::from_fn(|k| a[k] - b[k]);
    if dot(gap, gap).sqrt() <= share * dot(a, a).sqrt() + 1e-9 {
        return Ok(());
    }
    Err(Stop::fail("advance", given, format!("{b:.6?} N"), format!("{a:.6?} N within {share:e}")))
}

fn translation(context: &TestContext) -> Verdict {
    let here = dragged(context, Foot::sphere(0.0, 0.0), Flat::LEVEL, [1.0, 0.0])?;
    let there = dragged(context, Foot::sphere(-0.17, 0.12), Flat::LEVEL, [1.0, 0.0])?;
    agree("a sphere dragged along x, 17 and 12 cells away", here.force, there.force, 1e-5)?;
    let moved = Flat { middle: [3.0, -2.0], ..Flat::LEVEL };
    let with_it = dragged(context, Foot::sphere(3.0, -2.0), moved, [1.0, 0.0])?;
    agree("the same with the ground around (3, -2)", here.force, with_it.force, 1e-5)
}

fn height(context: &TestContext) -> Verdict {
    let here = dragged(context, Foot::sphere(0.0, 0.0), Flat::LEVEL, [1.0, 0.0])?;
    let high = Flat { height: 1.25, ..Flat::LEVEL };
    let there = dragged(context, Foot::sphere(0.0, 0.0).lifted(1.25), high, [1.0, 0.0])?;
    agree("a sphere dragged along x with everything 1.25 m higher", here.force, there.force, 1e-5)
}

fn quarter_turn(context: &TestContext) -> Verdict {
    let along = |d| dragged(context, Foot::sphere(0.0, 0.0), Flat::LEVEL, d).map(|m: Moved| m.force);
    let x = along([1.0, 0.0])?;
    let y = along([0.0, 1.0])?;
    agree("a drag along y, turned back by 90 degrees", x, [y[1], -y[0], y[2]], 1e-2)?;
    let back = along([-1.0, 0.0])?;
    agree("a drag along -x, turned back by 180 degrees", x, [-back[0], -back[1], back[2]], 1e-2)
}

fn any_turn(context: &TestContext) -> Verdict {
    let along = |d| dragged(context, Foot::sphere(0.0, 0.0), Flat::LEVEL, d).map(|m: Moved| m.force);
    let x = along([1.0, 0.0])?;
    let (s, c) = (0.5, 0.75f64.sqrt());
    let f = along([c, s])?;
    // The lattice below the foot is another one.
    agree("a drag at 30 degrees, turned back", x, [c * f[0] + s * f[1], c * f[1] - s * f[0], f[2]], 0.15)
}

/// The tangents of a port are a matter of bookkeeping.
fn port_frame(context: &TestContext) -> Verdict {
    let run = |foot: Foot, angle: f64| {
        let mut fixture = SoilFixture::new(context, &[foot])?;
        fixture.turn = angle;
        fixture.drag([0.0, 0.0, -0.006], 30)?;
        fixture.drag([0.003, 0.002, 0.0], 10)
    };
    let sphere = || Foot::sphere(0.0, 0.0);
    let given = "a dragged sphere with the port's tangents turned by 0.7 rad";
    agree(given, run(sphere(), 0.0)?.force, run(sphere(), 0.7)?.force, 1e-6)?;
    // By a right angle, so that the half lengths of the plate are those of the same plate.
    let (plain, turned) =
        (run(Foot::plate(0.0, 0.0), 0.0)?, run(Foot::plate(0.0, 0.0), std::f64::consts::FRAC_PI_2)?);
    agree("a dragged plate with the port's tangents turned by 90 degrees", plain.force, turned.force, 1e-6)?;
    let scale = 0.05 * dot(plain.force, plain.force).sqrt();
    let gap: [f64; 3] = std::array::from_fn(|k| plain.moment[k] - turned.moment[k]);
    if dot(gap, gap).sqrt() > 1e-5 * scale + 1e-9 {
        let got = format!("a moment of {:?} N m", turned.moment);
        let given = "a dragged plate with the port's tangents turned by 90 degrees";
        return Err(Stop::fail("advance", given, got, format!("{:?} N m", plain.moment)));
    }
    Ok(())
}

fn far_feet(context: &TestContext) -> Verdict {
    let feet = [Foot::sphere(-0.3, -0.2), Foot::plate(0.3, 0.2)];
    let velocities = [[0.05, 0.0, -0.2], [0.0, -0.05, -0.15]];
    let run = |which: &[usize]| {
        let feet: Vec<_> = which.iter().map(|k| feet[*k].clone()).collect();
        let v: Vec<_> = which.iter().map(|k| velocities[*k]).collect();
        let mut fixture = SoilFixture::new(context, &feet)?;
        (0..30).try_for_each(|_| fixture.go(&v, 1e-3).map(drop))?;
        Ok::<_, Stop>(fixture.moved.clone())
    };
    let both = run(&[0, 1])?;
    for (k, together) in both.iter().enumerate() {
        let alone = run(&[k])?[0];
        agree(&format!("foot {k} beside another, 70 cm away"), alone.force, together.force, 2e-2)?;
    }
    Ok(())
}
