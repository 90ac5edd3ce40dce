//! Two masses: everything about gluing in closed form.

use super::extrapolate::steps_to;
use super::fixture::{Setting, Tally, build, read, step, wrench};
use super::oscillator::Oscillator;
use super::{Context, Figure, Limit};
use crate::process::Outcome;
use terraglue_numerics::extremes::larger;

/// All figures of the part.
pub fn figures(_: &Context) -> Outcome<Vec<Figure>> {
    let mut all = values()?;
    all.extend(order_and_energy()?);
    all.extend(against_the_uncut()?);
    all.extend(mass_ratios()?);
    all.extend(fixed_point()?);
    all.extend(other_strategies()?);
    all.push(explicit_limit(0.0)?);
    all.push(explicit_limit(0.25)?);
    Ok(all)
}

fn setting(h: f64) -> Setting {
    Setting::iterative(h, [0.0; 3])
}

/// x1, x2 and T after one second.
fn after_one_second(text: &str, h: f64) -> Outcome<[f64; 3]> {
    let mut testbed = build(text)?;
    step(&mut testbed, steps_to(1.0, h), |_| Ok(()))?;
    Ok([read(&testbed, "a.m0.x")?, read(&testbed, "b.m0.x")?, wrench(&testbed, 0, 0)])
}

/// The values that Newmark and generalized-α give at 10 ms, computed by other programs.
fn values() -> Outcome<Vec<Figure>> {
    let wanted = [
        ("newmark", [0.999228632098135, 0.000769234009919, -157.670388315]),
        ("generalized-alpha", [0.999097968030, 0.000898590746, -157.629327475]),
    ];
    let mut all = Vec::new();
    for (integrator, wanted) in wanted {
        let got = after_one_second(&Oscillator::schueller(integrator).cut(&setting(0.01)), 0.01)?;
        for (k, name) in ["x1", "x2", "T"].iter().enumerate() {
            let difference = (got[k] - wanted[k]).abs() / wanted[k].abs().max(1.0);
            let what = format!("oscillator after 1 s, h = 10 ms: {} against {}", got[k], wanted[k]);
            let id = format!("gluing.oscillator.{integrator}.{name}");
            all.push(Figure::new(id, difference, Limit::AtMost(1e-9), what));
        }
    }
    Ok(all)
}

fn order_and_energy() -> Outcome<Vec<Figure>> {
    let case = Oscillator::schueller("newmark");
    // x1 passes zero at 0.25 s, so its error is that of the phase
    let phase = |h: f64| {
        let mut testbed = build(&case.cut(&setting(h)))?;
        step(&mut testbed, steps_to(0.25, h), |_| Ok(()))?;
        Ok::<_, String>((read(&testbed, "a.m0.x")?).abs())
    };
    let phases = [phase(0.01)?, phase(0.005)?, phase(0.0025)?];
    let slow = [(phases[0] / phases[1]).log2(), (phases[1] / phases[2]).log2()];
    let k = case.coupling.map_or(1.0, |c| c.0);
    let mut testbed = build(&case.cut(&setting(0.01)))?;
    let start = testbed.energy().kinetic + testbed.energy().potential + 0.5 * k;
    let mut worst: f64 = 0.0;
    step(&mut testbed, 100, |testbed| {
        let e = testbed.energy();
        let t = wrench(testbed, 0, 0);
        worst = larger(worst, (e.kinetic + e.potential + 0.5 * t * t / k - start).abs() / start);
        Ok(())
    })?;
    let lowest = slow[0].min(slow[1]);
    let highest = slow[0].max(slow[1]);
    let what = "observed order of x1(0.25 s) from 10, 5 and 2.5 ms";
    Ok(vec![
        Figure::new("gluing.oscillator.order.least", lowest, Limit::AtLeast(1.95), what),
        Figure::new("gluing.oscillator.order.most", highest, Limit::AtMost(2.05), what),
        Figure::new(
            "gluing.oscillator.energy",
            worst,
            Limit::AtMost(1e-11),
            "relative error of the energy over 1 s, Newmark, h = 10 ms",
        ),
    ])
}

/// `iterative` and `monolithic` against the same masses in one subsystem.
fn against_the_uncut() -> Outcome<Vec<Figure>> {
    let mut all = Vec::new();
    for (integrator, damped) in [("newmark", 0.0), ("generalized-alpha", 0.0), ("newmark", 3.0)] {
        let mut case = Oscillator::schueller(integrator);
        case.coupling = case.coupling.map(|c| (c.0, damped));
        for strategy in ["iterative", "monolithic"] {
            let mut cut = build(&case.cut(&Setting { strategy, ..setting(0.01) }))?;
            let mut whole = build(&case.whole(&setting(0.01)))?;
            let mut worst: f64 = 0.0;
            step(&mut cut, 100, |cut| {
                whole.step().map_err(|e| e.to_string())?;
                for (a, b) in [("a.m0.x", "all.m0.x"), ("b.m0.x", "all.m1.x")] {
                    worst = larger(worst, (read(cut, a)? - read(&whole, b)?).abs());
                }
                Ok(())
            })?;
            let damper = if damped > 0.0 { ".damped" } else { "" };
            let id = format!("gluing.oscillator.{integrator}{damper}.{strategy}.against_uncut");
            let what = "largest difference from the oscillator in one subsystem over 1 s, m";
            all.push(Figure::new(id, worst, Limit::AtMost(1e-10), what));
        }
    }
    Ok(all)
}

fn ratio(r: f64) -> Oscillator {
    Oscillator::rigid([1.0, r], [400.0, 10.0 * r], [0.0, 0.0], 1.0, 0.0)
}

/// A linear problem takes one Newton step and one check, whatever the masses.
fn mass_ratios() -> Outcome<Vec<Figure>> {
    let mut all = Vec::new();
    for exponent in -4..=4 {
        let r = 10f64.powi(exponent);
        let default = Setting { gluing: String::new(), ..setting(0.01) };
        let mut testbed = build(&ratio(r).cut(&default))?;
        let mut tally = Tally::default();
        step(&mut testbed, 20, |testbed| {
            tally.add(testbed);
            Ok(())
        })?;
        let what = format!("evaluations per step of two masses glued rigidly, m2/m1 = {r}");
        all.push(Figure::new(
            format!("gluing.mass_ratio.1e{exponent}.evaluations"),
            tally.mean(),
            Limit::Equal(2.0),
            what,
        ));
    }
    Ok(all)
}

/// The fixed point of force and motion contracts by (4·m2/h² + k2)/(4·m1/h² + k1).
fn fixed_point() -> Outcome<Vec<Figure>> {
    let relaxed = |relaxation: &str| Setting {
        strategy: "relaxed",
        gluing: format!("relaxation = \"{relaxation}\"\nmax_iterations = 200\nmax_halvings = 0"),
        ..setting(0.01)
    };
    let mut all = Vec::new();
    let mut slow = build(&ratio(0.1).cut(&relaxed("none")))?;
    let mut tally = Tally::default();
    step(&mut slow, 20, |testbed| {
        tally.add(testbed);
        Ok(())
    })?;
    let what = "evaluations per step of the fixed point at m2/m1 = 0.1 (contraction 0.099)";
    all.push(Figure::new("gluing.fixed_point.0.1.evaluations", tally.mean(), Limit::AtMost(11.0), what));
    for (r, words) in [(1.0, "not converged within 200"), (10.0, "diverged"), (100.0, "diverged")] {
        let mut testbed = build(&ratio(r).cut(&relaxed("none")))?;
        let said = testbed.step().err().map(|e| e.to_string()).unwrap_or_default();
        let what = format!("whether m2/m1 = {r} says `{words}`: {said}");
        all.push(Figure::new(
            format!("gluing.fixed_point.{r}.says"),
            f64::from(u8::from(said.contains(words))),
            Limit::Equal(1.0),
            what,
        ));
        let contraction = testbed.report().contraction;
        let h2 = 0.01 * 0.01;
        let expected = (4.0 * r / h2 + 10.0 * r) / (4.0 / h2 + 400.0);
        let what = format!("difference of the contraction {contraction} from {expected}");
        all.push(Figure::new(
            format!("gluing.fixed_point.{r}.contraction"),
            (contraction - expected).abs(),
            Limit::AtMost(1e-4 * expected),
            what,
        ));
    }
    for relaxation in ["aitken", "anderson", "broyden"] {
        for r in [0.1, 1.0, 10.0, 1e4] {
            let mut testbed = build(&ratio(r).cut(&relaxed(relaxation)))?;
            let mut tally = Tally::default();
            let done = step(&mut testbed, 20, |testbed| {
                tally.add(testbed);
                Ok(())
            });
            let id = format!("gluing.fixed_point.{relaxation}.{r}.evaluations");
            all.push(match done {
                Ok(()) => Figure::new(id, tally.mean(), Limit::None, "evaluations per step"),
                Err(why) => Figure::skipped(id, why),
            });
        }
    }
    Ok(all)
}

/// The other strategies of joints on the cases they can glue.
fn other_strategies() -> Outcome<Vec<Figure>> {
    let mut all = Vec::new();
    let tight = "tolerance = 1e-11";
    for strategy in ["iterative", "monolithic", "semi-implicit", "xt-newton"] {
        let mut cut = build(&ratio(10.0).cut(&Setting { strategy, gluing: tight.into(), ..setting(0.01) }))?;
        let mut whole = build(&ratio(10.0).whole(&setting(0.01)))?;
        let mut worst: f64 = 0.0;
        step(&mut cut, 100, |cut| {
            whole.step().map_err(|e| e.to_string())?;
            worst = larger(worst, (read(cut, "a.m0.x")? - read(&whole, "all.m0.x")?).abs());
            Ok(())
        })?;
        let what = "largest difference of two masses glued rigidly from one mass over 1 s, m";
        all.push(Figure::new(format!("gluing.rigid.{strategy}"), worst, Limit::AtMost(1e-9), what));
    }
    // explicit and delayed strategies: the error over one second, and that it goes down with h
    for strategy in ["jacobi", "gauss-seidel"] {
        let error = |h: f64| {
            let text = Oscillator::schueller("newmark").cut(&Setting { strategy, ..setting(h) });
            let mut testbed = build(&text)?;
            let mut worst: f64 = 0.0;
            step(&mut testbed, steps_to(1.0, h), |testbed| {
                let t = testbed.t_s() * std::f64::consts::TAU;
                let exact = 0.5 * (t.cos() + (3.0 * t).cos());
                worst = larger(worst, (read(testbed, "a.m0.x")? - exact).abs());
                Ok(())
            })?;
            Ok::<_, String>(worst)
        };
        let (coarse, fine) = (error(0.001)?, error(0.0005)?);
        let what = format!("observed order of x1 over 1 s; error {fine:.2e} m at 0.5 ms");
        all.push(Figure::new(
            format!("gluing.oscillator.{strategy}.order"),
            (coarse / fine).log2(),
            Limit::AtLeast(0.9),
            what,
        ));
    }
    Ok(all)
}

/// Where the explicit pass (symplectic Euler, force of t) begins to grow: κ + 2·c·h/m = 4.
fn explicit_limit(damping: f64) -> Outcome<Figure> {
    let h = 0.01;
    let grows = |sum: f64| {
        // d = c·h/m, κ = h²·k/m
        let (d, kappa) = (damping, sum - 2.0 * damping);
        let mass = Oscillator::rigid([1.0, 1.0], [0.0, 0.0], [0.0, 0.0], 0.0, 1e-3);
        let text = Oscillator { integrator: "implicit-euler", ..mass }.on_a_spring(
            &Setting { strategy: "gauss-seidel", ..setting(h) },
            kappa / (h * h),
            d / h,
        );
        let mut testbed = build(&text)?;
        // beyond the limit the motion leaves the range of numbers, which is an error of the subsystem
        let ended = step(&mut testbed, 4000, |_| Ok(()));
        Ok::<_, String>(ended.is_err() || read(&testbed, "a.m0.x")?.abs() > 1.0)
    };
    let (mut low, mut high) = (3.5, 4.5);
    while high - low > 1e-4 {
        let middle = 0.5 * (low + high);
        if grows(middle)? { high = middle } else { low = middle }
    }
    let what =
        format!("where the explicit pass begins to grow, κ + 2·c·h/m = {low:.4}, less 4; c·h/m = {damping}");
    Ok(Figure::new(
        format!("gluing.explicit_limit.damping_{damping}"),
        (low - 4.0).abs(),
        Limit::AtMost(1e-3),
        what,
    ))
}
