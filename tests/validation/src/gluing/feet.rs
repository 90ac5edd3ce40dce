//! Feet on soil columns: the single pass made exact, falls, and six feet that share one body.

use super::extrapolate::steps_to;
use super::fixture::{Setting, build, build_with, list, read, step, wrench};
use super::foot::{Foot, until_up};
use super::six_feet::{Table, columns};
use super::{Context, Figure, Limit};
use crate::process::{Outcome, read as read_file, root};
use terraglue::Testbed;
use terraglue::scenario::JacobianChoice;
use terraglue_numerics::extremes::{larger, smaller};

const GRAVITY: [f64; 3] = [0.0, 0.0, -9.81];

/// All figures of the part.
pub fn figures(_: &Context) -> Outcome<Vec<Figure>> {
    let mut all = printed_values()?;
    all.extend(compliant_equals_iterative()?);
    all.extend(clamped_pass()?);
    all.extend(falls()?);
    all.extend(full_newton()?);
    all.extend(mass_ratios()?);
    all.push(diagonal_control()?);
    all.extend(indeterminate_estimate()?);
    all.extend(fixed_point_contraction()?);
    Ok(all)
}

fn setting(strategy: &'static str, h: f64) -> Setting {
    Setting { strategy, ..Setting::iterative(h, GRAVITY) }
}

fn lunar() -> Foot {
    Foot {
        mass: 5.0,
        gravity: 9.81,
        speed: 0.5,
        stiffness: 8340.0,
        exponent: 1.0,
        unloading: 2e5,
        depth: 0.0,
    }
}

/// One step of `cooperative-compliant` on the loading branch: T = (f_n + κ·T*)/(1 + κ).
fn printed_values() -> Outcome<Vec<Figure>> {
    let wanted = [(0.001, 87.5059), (0.005, 102.0403), (0.01, 114.2283), (0.02, 119.6774), (0.05, 96.0229)];
    let foot = Foot { depth: 0.01, ..lunar() };
    wanted
        .iter()
        .map(|(h, wanted)| {
            let text = foot.text(&setting("cooperative-compliant", *h), "implicit-euler", "");
            let mut testbed = build(&text)?;
            step(&mut testbed, 1, |_| Ok(()))?;
            let t = wrench(&testbed, 0, 0);
            let what = format!("T of one step of {h} s: {t:.6} N against {wanted}");
            Ok(Figure::new(format!("gluing.compliant.h{h}"), (t - wanted).abs(), Limit::AtMost(5.1e-5), what))
        })
        .collect()
}

/// Steps both testbeds and answers the largest relative difference of a force, and the fewest active feet in T*.
fn apart(mut a: Testbed, mut b: Testbed, steps: u64) -> Outcome<(f64, usize)> {
    let (mut worst, mut fewest): (f64, usize) = (0.0, usize::MAX);
    step(&mut a, steps, |a| {
        b.step().map_err(|e| e.to_string())?;
        for (p, q) in a.report().ports.iter().zip(&b.report().ports) {
            worst = larger(worst, (p.wrench[0] - q.wrench[0]).abs() / p.wrench[0].abs().max(1.0));
        }
        fewest = smaller(fewest, a.report().ports.iter().filter(|p| p.t_star_n > 0.0).count());
        Ok(())
    })?;
    Ok((worst, fewest))
}

fn compliant_equals_iterative() -> Outcome<Vec<Figure>> {
    let figure = |name: &str, worst: f64, what: &str| {
        let what = format!("largest difference of a force from `iterative`, relative to max(1 N, T); {what}");
        Figure::new(format!("gluing.compliant.{name}"), worst, Limit::AtMost(1e-10), what)
    };
    let mut all = Vec::new();
    let both = |text: &dyn Fn(&Setting) -> String, h: f64| {
        Ok::<_, String>((
            build(&text(&setting("cooperative-compliant", h)))?,
            build(&text(&setting("iterative", h)))?,
        ))
    };
    let foot = |s: &Setting| lunar().text(s, "implicit-euler", "");
    let (a, b) = both(&foot, 0.001)?;
    all.push(figure("one_foot", apart(a, b, 100)?.0, "one foot on linear soil, 100 steps of 1 ms"));
    let k = [15383.3; 6];
    let linear = [("K", list(&k)), ("n", list(&[1.0])), ("k_u", list(&k.map(|k| 40.0 * k)))];
    let table = Table::standard("implicit-euler", 0.3);
    let (a, b) = both(&|s: &Setting| table.text(s, &linear), 0.005)?;
    all.push(figure("six_feet", apart(a, b, 40)?.0, "six feet on linear soil, 40 steps of 5 ms"));
    // rolling so fast that one side lifts
    let rolling = Table { start: [0.002, 0.0, 0.0, 0.1, 1.5, 0.0], ..table.clone() };
    let (a, b) = both(&|s: &Setting| rolling.text(s, &linear), 0.005)?;
    let (worst, fewest) = apart(a, b, 1)?;
    all.push(figure("inactive", worst, "three of six feet without force in T*"));
    let what = "feet with a force in T* in that case";
    all.push(Figure::new("gluing.compliant.inactive.active", fewest as f64, Limit::Equal(3.0), what));
    // every column at its deepest point, where loading and unloading meet
    let mut kink = linear.to_vec();
    kink.push(("z_start", list(&[0.006; 6])));
    let resting = Table { start: [0.006, 0.0, 0.0, 0.0, 0.0, 0.0], ..table };
    let (a, b) = both(&|s: &Setting| resting.text(s, &kink), 0.005)?;
    all.push(figure("kink", apart(a, b, 40)?.0, "from the kink between loading and unloading, 40 steps"));
    let foot = |s: &Setting| Foot { depth: 0.01, speed: 0.0, ..lunar() }.text(s, "implicit-euler", "");
    let (a, b) = both(&foot, 0.001)?;
    all.push(figure("kink_one_foot", apart(a, b, 100)?.0, "one foot from the kink, 100 steps of 1 ms"));
    Ok(all)
}

/// The plain pass at rising κ: no rebound, but too deep.
fn clamped_pass() -> Outcome<Vec<Figure>> {
    let mut all = Vec::new();
    let exact = 0.01946325823806;
    for kappa in [0.01, 0.1, 0.5, 1.0, 5.0, 20.0, 150.0f64] {
        let h = (kappa * 5.0 / 8340.0).sqrt();
        let mut testbed = build(&lunar().text(&setting("cooperative", h), "implicit-euler", ""))?;
        let (mut up, mut count): (f64, u32) = (0.0, 0);
        while count < 40 || testbed.t_s() < 0.3 {
            testbed.step().map_err(|e| e.to_string())?;
            up = larger(up, -read(&testbed, "foot.heave_rate")?);
            count += 1;
        }
        let error = read(&testbed, "soil.max_sinkage")? / exact - 1.0;
        let id = |name: &str| format!("gluing.clamped.kappa{kappa}.{name}");
        let what = format!("largest upward speed of a foot in the plain pass, h = {h:.4} s, m/s");
        all.push(Figure::new(id("rebound"), up, Limit::AtMost(1e-12), what));
        all.push(Figure::new(id("sinkage"), error, Limit::None, "relative error of its sinkage"));
    }
    Ok(all)
}

/// Peak sinkage with both integrators at 1 ms, and two controls of the single pass.
fn falls() -> Outcome<Vec<Figure>> {
    let text = read_file(&root().join("tests/reference/gluing/acceptance.csv"))?;
    let soils = [
        ("lunar_n1", 1.0, 8340.0, 2e5, 3e-4),
        ("sand_n1.1", 1.1, 15383.3, 4e5, 3e-4),
        ("clay_n0.5", 0.5, 8240.5, 2e5, 2e-2),
        ("snow_n1.6", 1.6, 2404.2, 5e4, 3e-4),
    ];
    let mut all = Vec::new();
    for (name, exponent, stiffness, unloading, limit) in soils {
        let foot = Foot { stiffness, exponent, unloading, ..lunar() };
        let row = text.lines().find(|l| l.starts_with(&format!("FOOT-{name},")) && l.contains(",z_max,"));
        let z_max: f64 = row
            .and_then(|l| l.split(",z_max,").nth(1)?.split(',').next()?.parse().ok())
            .ok_or_else(|| format!("no z_max of {name}"))?;
        let error = |integrator: &str| {
            let mut testbed = build(&foot.text(&setting("iterative", 0.001), integrator, ""))?;
            until_up(&mut testbed)?;
            Ok::<_, String>(read(&testbed, "soil.max_sinkage")? / z_max - 1.0)
        };
        let (second, first) = (error("newmark")?, error("implicit-euler")?);
        let what = "relative error of the peak sinkage, trapezoidal rule, h = 1 ms";
        all.push(Figure::new(format!("gluing.fall.{name}"), second.abs(), Limit::AtMost(limit), what));
        let what = format!("implicit Euler: {:.2} %", 100.0 * first);
        let id = format!("gluing.fall.{name}.euler");
        all.push(if name == "lunar_n1" {
            let what = format!("{what}, less −2.80 %, in %");
            Figure::new(id, (100.0 * first + 2.80).abs(), Limit::AtMost(0.14), what)
        } else {
            Figure::new(id, 100.0 * first, Limit::None, what)
        });
    }
    let run = |further: &str| {
        let mut testbed = build(&lunar().text(&setting("cooperative", 0.001), "implicit-euler", further))?;
        let mut up: f64 = 0.0;
        step(&mut testbed, 300, |testbed| {
            up = larger(up, -read(testbed, "foot.heave_rate")?);
            Ok(())
        })?;
        Ok::<_, String>((up, read(&testbed, "soil.max_sinkage")?))
    };
    let what = "largest upward speed of the co-operational pass, h = 1 ms, m/s";
    all.push(Figure::new("gluing.fall.cooperative.rebound", run("")?.0, Limit::AtMost(1e-12), what));
    let what = "control: sinkage under a soil that answers T* itself, m";
    let sinkage = run("echo_estimate = true")?.1.abs();
    all.push(Figure::new("gluing.fall.echo.sinkage", sinkage, Limit::AtMost(1e-12), what));
    Ok(all)
}

/// Steps a table and counts the evaluations of the soil: mean and most. The check of a step is an evaluation.
fn count(text: &str, steps: u64) -> Outcome<(Testbed, f64, u32)> {
    let mut testbed = build(text)?;
    let (mut sum, mut most) = (0, 0);
    step(&mut testbed, steps, |testbed| {
        let e = testbed.report().evaluations_soil.max(testbed.report().evaluations_bodies);
        sum += e;
        most = larger(most, e);
        Ok(())
    })?;
    Ok((testbed, f64::from(sum) / steps as f64, most))
}

/// The rows `tt_full` of `table6_iterations.csv`.
fn full_newton() -> Outcome<Vec<Figure>> {
    let text = read_file(&root().join("tests/reference/gluing/table6_iterations.csv"))?;
    let mut all = Vec::new();
    for line in text.lines().filter(|l| l.contains(",tt_full,")) {
        let f: Vec<&str> = line.split(',').collect();
        let number = |k: usize| f[k].parse::<f64>().map_err(|e| format!("{line}: {e}"));
        let (factor, h, rock) = (number(0)?, number(1)?, !f[2].is_empty());
        let duration = if h < 0.002 { 0.02 } else { 0.1 };
        for form in ["tt", "auto"] {
            let gluing = format!("tolerance = 1e-10\nform = \"{form}\"\nmax_iterations = 60");
            let table = Table::standard("implicit-euler", 0.3);
            let text = table.text(&Setting { gluing, ..setting("iterative", h) }, &columns(factor, rock));
            let (testbed, mean, most) = count(&text, steps_to(duration, h))?;
            let rock = if rock { ".rock" } else { "" };
            let id = |name: &str| format!("gluing.six_feet.{form}.K{factor}.h{h}{rock}.{name}");
            let heave = (read(&testbed, "table.heave")? - number(8)?).abs();
            let t0 = (wrench(&testbed, 0, 0) - number(9)?).abs();
            let what = format!("evaluations per step; the reference needs {} and {}", f[5], f[6]);
            all.push(Figure::new(id("mean"), mean, Limit::AtMost(6.0), what));
            let what = "most evaluations of a step";
            all.push(Figure::new(id("most"), f64::from(most), Limit::AtMost(12.0), what));
            all.push(Figure::new(
                id("heave"),
                heave,
                Limit::AtMost(1e-9),
                "difference of the heave at the end, m",
            ));
            all.push(Figure::new(
                id("T0"),
                t0,
                Limit::AtMost(1e-6),
                "difference of T of foot 0 at the end, N",
            ));
        }
    }
    Ok(all)
}

/// Soil columns with a lumped mass each.
fn mass_ratios() -> Outcome<Vec<Figure>> {
    let mut all = Vec::new();
    for ratio in [1e4, 1e3, 100.0, 10.0, 1.0, 0.1, 0.01, 1e-4] {
        let mut soil = columns(1.0, false);
        soil.push(("soil_mass_kg", list(&[60.0 / ratio; 6])));
        soil.push(("v_start", list(&[0.3; 6])));
        // |Λ·e| of columns of 600 t is 1e-8 N by the rounding of a millimetre alone
        let gluing = "tolerance = 1e-9\nform = \"tt\"\nmax_iterations = 60".into();
        let text = Table::standard("implicit-euler", 0.3)
            .text(&Setting { gluing, ..setting("iterative", 0.005) }, &soil);
        let (_, mean, most) = count(&text, 10)?;
        let id = |name: &str| format!("gluing.six_feet.mass_ratio{ratio}.{name}");
        let what = format!("evaluations per step, body of 60 kg on columns of {} kg", 60.0 / ratio);
        all.push(Figure::new(id("mean"), mean, Limit::AtMost(6.0), what));
        all.push(Figure::new(id("most"), f64::from(most), Limit::AtMost(12.0), "most evaluations of a step"));
    }
    Ok(all)
}

/// Λ without the coupling of the feet must fail on stiff soil.
fn diagonal_control() -> Outcome<Figure> {
    let gluing = "form = \"tt\"".into();
    let text = Table::standard("implicit-euler", 0.3)
        .text(&Setting { gluing, ..setting("iterative", 0.01) }, &columns(100.0, false));
    let mut testbed = build_with(&text, |gluing| gluing.jacobian = JacobianChoice::Diagonal)?;
    let said = step(&mut testbed, 10, |_| Ok(())).err().unwrap_or_default();
    let failed = f64::from(u8::from(said.contains("did not converge")));
    let what = format!("control: diagonal Λ fails at 100 times the stiffness and 10 ms: {said}");
    Ok(Figure::new("gluing.six_feet.diagonal.fails", failed, Limit::Equal(1.0), what))
}

/// T* of six feet has many solutions: the one of least norm, in whatever order the feet are glued.
fn indeterminate_estimate() -> Outcome<Vec<Figure>> {
    let wanted = [123.034, 104.640, 86.246, 109.954, 91.560, 73.166];
    let rigid = [("K", list(&[1.0; 6])), ("rigid", "true".into())];
    let order = |reverse: bool| -> Outcome<(Vec<f64>, Vec<f64>)> {
        let mut table = Table::standard("implicit-euler", 0.0);
        if reverse {
            table.feet = table.feet.chunks_exact(2).rev().flatten().copied().collect();
        }
        let mut testbed = build(&table.text(&setting("cooperative", 0.005), &rigid))?;
        step(&mut testbed, 1, |_| Ok(()))?;
        let mut t_star: Vec<f64> = testbed.report().ports.iter().map(|p| p.t_star_n).collect();
        let mut soft = columns(1.0, false);
        if reverse {
            for (_, value) in soft.iter_mut().filter(|(key, _)| *key != "n") {
                let mut numbers: Vec<&str> = value.trim_matches(['[', ']']).split(", ").collect();
                numbers.reverse();
                *value = format!("[{}]", numbers.join(", "));
            }
        }
        table.start[3] = 0.3;
        let mut testbed = build(&table.text(&setting("iterative", 0.005), &soft))?;
        step(&mut testbed, 20, |_| Ok(()))?;
        let mut t: Vec<f64> = (0..6).map(|i| wrench(&testbed, i, 0)).collect();
        if reverse {
            t_star.reverse();
            t.reverse();
        }
        Ok((t_star, t))
    };
    let (forward, backward) = (order(false)?, order(true)?);
    let largest = |a: &[f64], b: &[f64]| a.iter().zip(b).fold(0.0_f64, |m, (a, b)| larger(m, (a - b).abs()));
    let figure = |name: &str, value: f64, limit: f64, what: &str| {
        Figure::new(format!("gluing.estimate.{name}"), value, Limit::AtMost(limit), what)
    };
    let mut all = vec![
        figure(
            "least_norm",
            largest(&forward.0, &wanted),
            5.1e-4,
            "T* of six feet less that of least norm, N",
        ),
        figure("order", largest(&forward.0, &backward.0), 1e-8, "T* with the feet in the other order, N"),
        figure(
            "final",
            largest(&forward.1, &backward.1),
            1e-9,
            "T after 20 steps with the feet in the other order, N",
        ),
    ];
    all.extend(sweeps());
    Ok(all)
}

/// Two sweeps of another solver give other T*, but the same motion.
fn sweeps() -> Vec<Figure> {
    let table = Table::standard("implicit-euler", 0.0);
    let (h, inertia) = (0.005, [60.0, 2.0, 4.0]);
    let row = |i: usize| {
        let (x, y) = (table.feet[2 * i], table.feet[2 * i + 1]);
        [1.0, y - table.offset[1], -(x - table.offset[0])]
    };
    let g = |i: usize, j: usize| h * h * (0..3).map(|k| row(i)[k] * row(j)[k] / inertia[k]).sum::<f64>();
    let solve = |order: [usize; 6]| {
        let mut t = [0.0; 6];
        for _ in 0..200_000 {
            let mut change: f64 = 0.0;
            for i in order {
                let w = (0..6).map(|j| g(i, j) * t[j]).sum::<f64>() - h * h * 9.81;
                let new = (t[i] - w / g(i, i)).max(0.0);
                change = larger(change, (new - t[i]).abs());
                t[i] = new;
            }
            if change < 1e-12 {
                break;
            }
        }
        t
    };
    let (a, b) = (solve([0, 1, 2, 3, 4, 5]), solve([5, 4, 3, 2, 1, 0]));
    let moved = |t: &[f64; 6], i: usize| (0..6).map(|j| g(i, j) * t[j]).sum::<f64>();
    let motion = (0..6).map(|i| (moved(&a, i) - moved(&b, i)).abs()).fold(0.0, larger);
    let force = (0..6).map(|i| (a[i] - b[i]).abs()).fold(0.0, larger);
    vec![
        Figure::new(
            "gluing.estimate.sweeps.force",
            force,
            Limit::AtLeast(1.0),
            "control: T* of two sweep orders of projected Gauss–Seidel differ, N",
        ),
        Figure::new(
            "gluing.estimate.sweeps.motion",
            motion,
            Limit::AtMost(1e-12),
            "their motion G·T* does not, m",
        ),
    ]
}

/// Force in, motion out on the body's side, the reverse on the soil's: contracts by κ = h²·K/m.
fn fixed_point_contraction() -> Outcome<Vec<Figure>> {
    [0.1, 0.5, 0.9]
        .iter()
        .map(|kappa: &f64| {
            let h = (kappa * 5.0 / 8340.0).sqrt();
            let gluing = "relaxation = \"none\"\nmax_iterations = 500\ntolerance = 1e-6".into();
            let foot = Foot { depth: 0.01, ..lunar() };
            let text = foot.text(&Setting { gluing, ..setting("relaxed", h) }, "implicit-euler", "");
            let mut testbed = build(&text)?;
            step(&mut testbed, 1, |_| Ok(()))?;
            let contraction = testbed.report().contraction;
            let what = format!("contraction of the fixed point, {contraction}, less κ = {kappa}");
            Ok(Figure::new(
                format!("gluing.fixed_point.kappa{kappa}"),
                (contraction - kappa).abs(),
                Limit::AtMost(1e-4),
                what,
            ))
        })
        .collect()
}
