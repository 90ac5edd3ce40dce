//! Loops of connections at the start: solved to 1e-10, or refused by name.

use super::{built, fmus, testbed};
use crate::process::Outcome;
use crate::{Figure, Limit};
use std::path::Path;
use terraglue_numerics::extremes::{larger, smaller};

const HEAD: &str = "[time]\nstep_s = 0.1\nduration_s = 0.1\n";

pub fn figures(folder: &Path) -> Outcome<Vec<Figure>> {
    let fmu = |name: &str, calc: &str| {
        fmus::build(folder, name, &[("u", 'i', 0.5), ("w", 'i', 0.5), ("y", 'o', 0.0)], calc, "")
    };
    fmu("gain", "v[2] = 3 - 2 * v[0];")?;
    fmu("sum", "v[2] = 1 + 0.5 * v[0];")?;
    fmu("one", "v[2] = 1 + v[0];")?;
    fmu("same", "v[2] = v[0];")?;
    // x = cos(y), y = 0.5 + 0.2·z², z = exp(−x) + 0.3·y
    fmu("cosine", "v[2] = cos(v[0]);")?;
    fmu("square", "v[2] = 0.5 + 0.2 * v[0] * v[0];")?;
    fmu("mixed", "v[2] = exp(-v[0]) + 0.3 * v[1];")?;
    let linear = solved(folder, &[("a", "gain"), ("b", "sum")], &[("b.y", "a.u"), ("a.y", "b.u")], |y| {
        [(y[0] - (3.0 - 2.0 * y[1])).abs(), (y[1] - (1.0 + 0.5 * y[0])).abs()].into_iter().fold(0.0, larger)
    })?;
    let three = solved(
        folder,
        &[("x", "cosine"), ("y", "square"), ("z", "mixed")],
        &[("y.y", "x.u"), ("z.y", "y.u"), ("x.y", "z.u"), ("y.y", "z.w")],
        |v| {
            let [x, y, z] = [v[0], v[1], v[2]];
            let left = [x - y.cos(), y - 0.5 - 0.2 * z * z, z - (-x).exp() - 0.3 * y];
            left.into_iter().map(f64::abs).fold(0.0, larger)
        },
    )?;
    let (asked, named) = (asked(folder)?, is_refused(folder));
    Ok(vec![
        Figure::new(
            "fmi.loop.linear",
            linear,
            Limit::AtMost(1e-10),
            "loop of two FMUs at the start: residual",
        ),
        Figure::new(
            "fmi.loop.three",
            three,
            Limit::AtMost(1e-10),
            "loop of three equations at the start: residual",
        ),
        Figure::new(
            "fmi.loop.derivatives",
            asked,
            Limit::AtLeast(1.0),
            "a loop that only directional derivatives can solve: times that each FMU was asked for them",
        ),
        Figure::new(
            "fmi.loop.refused",
            f64::from(u8::from(named)),
            Limit::Equal(1.0),
            "a loop without solution is refused with the names of its connections (1: yes)",
        ),
    ])
}

/// How often a loop evaluated the directional derivatives of each of two FMUs.
fn asked(folder: &Path) -> Outcome<f64> {
    // outputs in steps of 1e-4, which no difference of 1e-7 can see
    let coarse = |name: &str, calc: &str, slope: &str| {
        let all = [("u", 'i', 0.5), ("asked", 'o', 0.0), ("y", 'o', 0.0)];
        fmus::build_with_slope(folder, name, &all, (calc, ""), slope)
    };
    coarse("coarse", "v[2] = floor(1e4 * (3 - 2 * v[0])) / 1e4;", "-2.0")?;
    coarse("fine", "v[2] = 1 + 0.5 * v[0];", "0.5")?;
    let text = scenario(&[("a", "coarse"), ("b", "fine")], &[("b.y", "a.u"), ("a.y", "b.u")]);
    let solved_so = built(folder, &text)?;
    Ok(smaller(solved_so.read("a.asked").unwrap_or(f64::NAN), solved_so.read("b.asked").unwrap_or(f64::NAN)))
}

/// Whether a loop without solution is refused with the names of its connections.
fn is_refused(folder: &Path) -> bool {
    let text = scenario(&[("a", "one"), ("b", "same")], &[("b.y", "a.u"), ("a.y", "b.u")]);
    let said = testbed(folder, &text).err().map(|e| e.to_string()).unwrap_or_default();
    ["a.y → b.u", "b.y → a.u", "no solution"].iter().all(|word| said.contains(word))
}

fn scenario(all: &[(&str, &str)], connections: &[(&str, &str)]) -> String {
    let fmus: String = all.iter().map(|(name, fmu)| format!("[{name}]\nfmu = \"{fmu}.fmu\"\n")).collect();
    let connect =
        connections.iter().map(|(from, to)| format!("[[connect]]\nfrom = \"{from}\"\nto = \"{to}\"\n"));
    format!("{HEAD}{fmus}{}", connect.collect::<String>())
}

/// Residual of the equations for the outputs `y` of all FMUs.
fn solved(
    folder: &Path,
    all: &[(&str, &str)],
    connections: &[(&str, &str)],
    left: impl Fn(&[f64]) -> f64,
) -> Outcome<f64> {
    let testbed = testbed(folder, &scenario(all, connections)).map_err(|e| e.to_string())?;
    let outputs: Vec<f64> =
        all.iter().map(|(name, _)| testbed.read(&format!("{name}.y")).unwrap_or(f64::NAN)).collect();
    Ok(left(&outputs))
}
