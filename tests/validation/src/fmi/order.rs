//! Connections of FMUs against closed forms: the order of a step, loops that are iterated, inputs along a line. Chains and other loops are
//! measured by `error_over_cost.rs`.

use super::{built, fmus};
use crate::process::Outcome;
use crate::{Figure, Limit};
use std::path::Path;
use terraglue_numerics::extremes::larger;

/// Stiffness of the spring on a mass of 1 kg, N/m.
const K: f64 = 40.0;
/// Place of the mass at the start, m.
const X0: f64 = 0.1;
/// End of a run, s.
const END: f64 = 2.0;

pub fn figures(folder: &Path) -> Outcome<Vec<Figure>> {
    let mass = [("f", 'i', -K * X0), ("x", 's', X0), ("v", 's', 0.0)];
    // one semi-implicit step per communication step, as in many simple FMUs; and the exact motion under a force that is held
    fmus::build(folder, "simple", &mass, "", "v[2] += h * v[0]; v[1] += h * v[2];")?;
    fmus::build(folder, "mass", &mass, "", "v[1] += h * v[2] + 0.5 * h * h * v[0]; v[2] += h * v[0];")?;
    fmus::build(
        folder,
        "spring",
        &[("x", 'i', X0), ("f", 'o', -K * X0)],
        &format!("v[1] = -{K:?} * v[0];"),
        "",
    )?;
    let structure = off(&oscillate(folder, "simple", 0.01, ["", ""])?);
    let late = off(&oscillate(folder, "simple", 0.01, [JACOBI, JACOBI])?);
    let iterated = oscillate(folder, "mass", 0.01, [ITERATE, ITERATE])?;
    let ends = off(&oscillate(folder, "mass", 0.01, [ENDS, ENDS])?);
    let line = off(&oscillate(folder, "mass", 0.01, ["", LINE])?);
    let percent = |share: f64| 100.0 * share;
    let what = |how: &str| {
        format!("mass and spring as two FMUs, 10 ms, x after 2 s against the closed form, %: {how}")
    };
    let mut all = vec![
        Figure::new(
            "fmi.order.structure",
            percent(structure),
            Limit::AtMost(0.5),
            what("in the order of the structure"),
        ),
        Figure::new("fmi.order.jacobi", percent(late), Limit::None, what("each connection late by a step")),
        Figure::new("fmi.order.linear", percent(line), Limit::None, what("the force along a line")),
        Figure::new(
            "fmi.order.iterate",
            percent(off(&iterated)),
            Limit::AtMost(0.01),
            what("the loop iterated"),
        ),
        Figure::new(
            "fmi.order.iterate.amplitude",
            percent((iterated.amplitude / X0 - 1.0).abs()),
            Limit::AtMost(0.01),
            "mass and spring as two FMUs, 10 ms, the loop iterated: amplitude after 2 s against the one of the start, %",
        ),
    ];
    all.push(Figure::new(
        "fmi.order.iterate_ends",
        percent(ends),
        Limit::None,
        what("the loop iterated, values at the ends of steps alone"),
    ));
    all.extend(pushed(folder)?);
    all.push(beside(folder)?);
    all.extend(newton(folder)?);
    Ok(all)
}

const JACOBI: &str = "order = \"jacobi\"\n";
const ITERATE: &str = "order = \"iterate\"\n";
const ENDS: &str = "order = \"iterate-ends\"\n";
const LINE: &str = "extrapolate = \"linear\"\n";

/// The mass at the end of a run.
struct MassEnd {
    /// m.
    x: f64,
    /// Of an oscillation with its energy, m.
    amplitude: f64,
}

/// Distance from the closed form, relative to it.
fn off(end: &MassEnd) -> f64 {
    let exact = X0 * (K.sqrt() * END).cos();
    ((end.x - exact) / exact).abs()
}

/// A mass on a spring; `how` of the connections to the spring and to the mass.
fn oscillate(folder: &Path, mass: &str, step_s: f64, how: [&str; 2]) -> Outcome<MassEnd> {
    oscillate_with(folder, mass, step_s, how, "")
}

/// The same beside other FMUs.
fn oscillate_with(folder: &Path, mass: &str, step_s: f64, how: [&str; 2], more: &str) -> Outcome<MassEnd> {
    let text = format!(
        "[time]\nstep_s = {step_s}\nduration_s = {END}\n[mass]\nfmu = \"{mass}.fmu\"\n[spring]\nfmu = \"spring.fmu\"\n\
         [[connect]]\nfrom = \"mass.x\"\nto = \"spring.x\"\n{}[[connect]]\nfrom = \"spring.f\"\nto = \"mass.f\"\n{}{more}",
        how[0], how[1]
    );
    let mut testbed = built(folder, &text)?;
    while testbed.t_s() < END - 0.5 * step_s {
        testbed.step().map_err(|e| e.to_string())?;
    }
    let read = |name: &str| testbed.read(name).unwrap_or(f64::NAN);
    let (x, v) = (read("mass.x"), read("mass.v"));
    Ok(MassEnd { x, amplitude: (x * x + v * v / K).sqrt() })
}

/// Order of the error of a mass that starts with a speed, from steps of 40 ms to steps of 20 ms.
fn pushed(folder: &Path) -> Outcome<Vec<Figure>> {
    const V0: f64 = 0.3;
    let mass = [("f", 'i', -K * X0), ("x", 's', X0), ("v", 's', V0)];
    let step = "v[1] += h * v[2] + 0.5 * h * h * v[0]; v[2] += h * v[0];";
    fmus::build(folder, "pushed", &mass, "", step)?;
    let exact = X0 * (K.sqrt() * END).cos() + V0 / K.sqrt() * (K.sqrt() * END).sin();
    let error =
        |step_s: f64, how| oscillate(folder, "pushed", step_s, [how, how]).map(|end| (end.x - exact).abs());
    let order = |how| -> Outcome<f64> { Ok((error(0.04, how)? / error(0.02, how)?).log2()) };
    let what = |how| {
        format!(
            "mass with a speed at the start, and its spring, as two FMUs: order of the error of the place after 2 s, {how}"
        )
    };
    Ok(vec![
        Figure::new(
            "fmi.order.iterate.order",
            order(ITERATE)?,
            Limit::AtLeast(3.8),
            what("the loop iterated"),
        ),
        Figure::new(
            "fmi.order.iterate_ends.order",
            order(ENDS)?,
            Limit::AtLeast(1.9),
            what("with values at the ends of steps alone"),
        ),
    ])
}

/// A mass that also tells its acceleration, which follows the force at once, to a display: the largest change of place and speed by that.
fn beside(folder: &Path) -> Outcome<Figure> {
    let mass = [("f", 'i', -K * X0), ("x", 's', X0), ("v", 's', 0.0), ("a", 'o', -K * X0)];
    let step = "v[1] += h * v[2] + 0.5 * h * h * v[0]; v[2] += h * v[0];";
    fmus::build(folder, "mass_with_acceleration", &mass, "v[3] = v[0];", step)?;
    fmus::build(folder, "display", &[("u", 'i', 0.0), ("y", 'o', 0.0)], "v[1] = v[0];", "")?;
    let mut worst = 0.0;
    for how in [["", ""], [JACOBI, JACOBI], [ITERATE, ITERATE], [ENDS, ENDS], ["", LINE]] {
        let alone = oscillate(folder, "mass", 0.01, how)?;
        let display =
            "[display]\nfmu = \"display.fmu\"\n[[connect]]\nfrom = \"mass.a\"\nto = \"display.u\"\n";
        for more in ["", display] {
            let shown = oscillate_with(folder, "mass_with_acceleration", 0.01, how, more)?;
            worst = larger(worst, (shown.x - alone.x).abs());
            worst = larger(worst, (shown.amplitude - alone.amplitude).abs());
        }
    }
    let what = "mass and spring as two FMUs: change of place and amplitude after 2 s, m, by an acceleration beside them, shown or not";
    Ok(Figure::new("fmi.order.beside", worst, Limit::Equal(0.0), what))
}

/// Loops of three FMUs that feed each other at once: how often one of them makes a step, with and without directional derivatives.
fn newton(folder: &Path) -> Outcome<Vec<Figure>> {
    // gains of 3, −4 and 0.5; and x = cos(z + t), y = 0.5 + 0.2 x², z = exp(−y)
    let linear = [("v[2] + 3 * v[0]", "3"), ("2 - 4 * v[0]", "-4"), ("0.5 * v[0]", "0.5")];
    let curved = [
        ("cos(v[0] + v[2])", "-sin(v[0] + v[2])"),
        ("0.5 + 0.2 * v[0] * v[0]", "0.4 * v[0]"),
        ("exp(-v[0])", "-exp(-v[0])"),
    ];
    let mut all = Vec::new();
    // the second trial of a linear loop confirms the first; errors of 0.1 that are squared each time need five to reach 1e-10, and one more
    for (id, equations, most) in [("linear", linear, 2.0), ("curved", curved, 6.0)] {
        let (with, residual) = steps_of_a_loop(folder, &format!("{id}_newton"), &equations, true)?;
        let (without, _) = steps_of_a_loop(folder, &format!("{id}_plain"), &equations, false)?;
        let id = |end: &str| format!("fmi.order.newton.{id}{end}");
        let what = |what: &str| format!("loop of three FMUs, {what}");
        all.push(Figure::new(
            id(""),
            with,
            Limit::AtMost(most),
            what("trials of a step by Newton with directional derivatives"),
        ));
        all.push(Figure::new(
            id(".without"),
            without,
            Limit::None,
            what("trials of a step without derivatives"),
        ));
        all.push(Figure::new(
            id(".residual"),
            residual,
            Limit::AtMost(1e-9),
            what("what is left of the equations"),
        ));
    }
    Ok(all)
}

/// Trials of each step of a ring of three FMUs, and the residual of its equations at the end.
fn steps_of_a_loop(
    folder: &Path,
    kind: &str,
    equations: &[(&str, &str); 3],
    derivatives: bool,
) -> Outcome<(f64, f64)> {
    const STEPS: f64 = 5.0;
    // the count is no part of a state that is restored
    let step = "static double trials; v[1] = ++trials; v[2] += h;";
    let all = [("u", 'i', 0.1), ("trials", 'o', 0.0), ("t", 's', 0.0), ("asked", 'o', 0.0), ("y", 'o', 0.0)];
    let mut text = format!("[time]\nstep_s = 0.1\nduration_s = {}\n", 0.1 * STEPS);
    for (name, (right, slope)) in ["a", "b", "c"].iter().zip(equations) {
        let calc = format!("v[4] = {right};");
        let fmu = format!("{kind}_{name}");
        if derivatives {
            fmus::build_with_slope(folder, &fmu, &all, (&calc, step), slope)?;
        } else {
            fmus::build(folder, &fmu, &all, &calc, step)?;
        }
        text += &format!("[{name}]\nfmu = \"{fmu}.fmu\"\n");
    }
    for (from, to) in [("a", "b"), ("b", "c"), ("c", "a")] {
        text += &format!("[[connect]]\nfrom = \"{from}.y\"\nto = \"{to}.u\"\n{ITERATE}");
    }
    let mut testbed = built(folder, &text)?;
    testbed.run_until(0.1 * STEPS, &mut []).map_err(|e| e.to_string())?;
    let read = |name: &str| testbed.read(name).unwrap_or(f64::NAN);
    let [a, b, c] = ["a.y", "b.y", "c.y"].map(read);
    let taken = ["b.u", "c.u", "a.u"].map(read);
    let residual = [a, b, c].iter().zip(taken).map(|(y, u)| (y - u).abs()).fold(0.0, larger);
    Ok((read("a.trials") / STEPS, residual))
}
