//! One law five ways – built in, as text, as a module in Rust, C and Python: the plate curve and the sinkage of the walking robot;
//! and how long a new law is.

use super::super::{Context, Figure, Limit};
use super::{Kind, Language, scaffold, speed};
use crate::process::{Outcome, root};
use terraglue::scenario::Scenario;
use terraglue::testbed::{Options, Testbed};
use terraglue_numerics::extremes::larger;

/// A key of the scenario and its value.
type Set = (String, String);

/// All figures.
pub fn figures(context: &Context, out: &mut Vec<Figure>) -> Outcome {
    lines(out)?;
    let ways = ways(context)?;
    let mut worst = 0.0_f64;
    for soil in ["soil-bekker", "soil-cellular-automaton"] {
        let base = vec![set("soil.module", soil), set("terrain.spacing_m", "0.01")];
        let built_in = plates(&base)?;
        for (_, sets) in &ways {
            worst = larger(worst, difference(&built_in, &plates(&[&base[..], sets].concat())?));
        }
    }
    let what = "difference of the plate curve, a law as text and as modules against built in, both soils";
    out.push(Figure::new("plugins.laws.plate", worst, Limit::AtMost(1e-12), what));
    if !context.quick {
        let built_in = walk(&[])?;
        let mut worst = 0.0_f64;
        // A walk asks a law in Python too often.
        for (_, sets) in ways.iter().filter(|(way, _)| *way != "Python") {
            worst = larger(worst, difference(&built_in, &walk(sets)?));
        }
        let what = "relative difference of the sinkage of `moon_walk`, the same ways without Python";
        out.push(Figure::new("plugins.laws.walk", worst, Limit::AtMost(1e-9), what));
    }
    Ok(())
}

fn set(key: &str, value: impl std::fmt::Display) -> Set {
    (key.to_owned(), value.to_string())
}

fn ways(context: &Context) -> Outcome<Vec<(&'static str, Vec<Set>)>> {
    let module = |path: std::path::PathBuf| vec![set("soil.law.plugin", path.display())];
    let text = vec![
        set("soil.law.pressure", "(k_c/b + k_phi)*z^n"),
        set("soil.law.shear", "(c + sigma*tan(phi))*(1 - exp(-j/K))"),
    ];
    let rust = context.program.with_file_name("deps").join("liblaw_bekker_plugin.so");
    let python = root().join("tests/modules/law-bekker-python/law_bekker.py");
    Ok(vec![
        ("text", text),
        ("Rust", module(rust)),
        ("C", module(speed::compiled(context)?)),
        ("Python", module(python)),
    ])
}

fn built(name: &str, sets: &[Set]) -> Outcome<Testbed> {
    let path = root().join("scenarios").join(format!("{name}.toml"));
    let scenario = Scenario::load(&path, sets).map_err(|e| e.to_string())?;
    let options = Options { threads: 1, ..Options::default() };
    Testbed::build_with(&scenario, &options, &terraglue::library()).map_err(|e| e.to_string())
}

fn stepped(testbed: &mut Testbed, steps: usize) -> Outcome {
    (0..steps).try_for_each(|_| testbed.step().map(drop).map_err(|e| e.to_string()))
}

fn read(testbed: &Testbed, name: &str) -> Outcome<f64> {
    testbed.read(name).ok_or_else(|| format!("no variable {name}"))
}

/// Forces of both plates of the bevameter on their way into the soil, N.
fn plates(sets: &[Set]) -> Outcome<Vec<f64>> {
    let mut testbed = built("plate_sinkage", sets)?;
    let mut forces = Vec::new();
    for _ in 0..50 {
        stepped(&mut testbed, 20)?;
        for plate in ["small_plate", "large_plate"] {
            forces.push(read(&testbed, &format!("bevameter.{plate}.contact_normal"))?);
        }
    }
    Ok(forces)
}

/// Sinkage of the walking robot, m.
fn walk(sets: &[Set]) -> Outcome<Vec<f64>> {
    let mut testbed = built("moon_walk", sets)?;
    stepped(&mut testbed, 800)?;
    Ok(vec![read(&testbed, "soil.max_sinkage")?])
}

/// Largest difference over the largest value.
fn difference(a: &[f64], b: &[f64]) -> f64 {
    let scale = a.iter().fold(0.0_f64, |m, x| larger(m, x.abs()));
    a.iter().zip(b).fold(0.0_f64, |worst, (a, b)| larger(worst, (a - b).abs() / scale))
}

/// Lines of a new law, in a language and in a scenario.
fn lines(out: &mut Vec<Figure>) -> Outcome {
    let made = |language| scaffold(Kind::Law, language, "my-law", "terraglue").map_err(|e| e.to_string());
    let mut longest = 0;
    for language in [Language::Rust, Language::C, Language::Cpp, Language::Python] {
        let (_, source) = &made(language)?.files[0];
        longest = larger(longest, source.lines().count());
    }
    let what = "lines of a new law, the longest of four languages";
    out.push(Figure::new("plugins.law.lines", longest as f64, Limit::AtMost(40.0), what));
    let files = made(Language::Scenario)?.files;
    let law = files[0].1.split("[soil.law]").nth(1).and_then(|rest| rest.trim_start().split("\n\n").next());
    let count = law.ok_or("a new law in a scenario has no table [soil.law]")?.lines().count();
    let what = "lines of a new law in a scenario";
    out.push(Figure::new("plugins.law.lines.scenario", count as f64, Limit::AtMost(5.0), what));
    Ok(())
}
