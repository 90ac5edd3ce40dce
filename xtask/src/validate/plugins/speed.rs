//! Time of a law written as text against the same law built in, over a patch of forty nodes.

use super::super::timing::{cpu_s, median};
use super::super::{Figure, Limit};
use crate::process::Outcome;
use std::hint::black_box;
use terraglue_soil_law::{PressureLaw, ShearLaw, ShearState, SoilExpressions, SoilParameters, pressures};
use terraglue_subsystem::Config;

const NODES: usize = 40;
const ROUNDS: usize = 4000;
/// A loose lunar soil (Apollo, nominal).
const SOIL: &str = r#"{"n": 1.1, "k_c": 1400.0, "k_phi": 820000.0, "c_pa": 170.0, "phi_rad": 0.61, "K_m": 0.018,
    "elastic_stiffness_pa_m": 4e8, "law": {"pressure": "(k_c/b + k_phi)*z^n", "shear": "(c + sigma*tan(phi))*(1 - exp(-j/K))"}}"#;

/// Both ratios.
pub fn figures(out: &mut Vec<Figure>) -> Outcome {
    let config = Config::parse(SOIL).map_err(|e| e.to_string())?;
    let soil = SoilParameters::from_config(&config, 1.62).map_err(|e| e.to_string())?;
    let texts = SoilExpressions::from_config(&config).map_err(|e| e.to_string())?.ok_or("no texts")?;
    let pressure = texts.pressure(&soil).map_err(|e| e.to_string())?.ok_or("no pressure law")?;
    let shear = texts.shear(&soil).map_err(|e| e.to_string())?.ok_or("no shear law")?;
    let what = "time of the pressure law as text over built in, 40 nodes";
    let built_in = soil.pressure();
    let ratio = over(|| press(&PressureLaw::Expression(pressure)), || press(&built_in));
    out.push(Figure::new("plugins.expression.pressure", ratio, Limit::AtMost(1.3), what));
    let what = "time of the shear law as text over built in, 40 nodes";
    let (built_in, text) = (soil.shear(), soil.shear().with_expression(shear));
    let ratio = over(|| slide(&text), || slide(&built_in));
    out.push(Figure::new("plugins.expression.shear", ratio, Limit::AtMost(1.3), what));
    Ok(())
}

/// Median of eleven ratios, each of two runs one after the other.
fn over(text: impl Fn(), built_in: impl Fn()) -> f64 {
    let time = |run: &dyn Fn()| {
        let start = cpu_s();
        run();
        cpu_s() - start
    };
    median((0..11).map(|_| time(&text) / time(&built_in)).collect())
}

/// Pressures and slopes of nodes in first loading.
fn press(law: &PressureLaw) {
    let depth: [f64; NODES] = std::array::from_fn(|k| 0.002 + 2e-4 * k as f64);
    let before = [0.0; NODES];
    let (mut p, mut slope) = ([0.0; NODES], [0.0; NODES]);
    let curve = law.curve(black_box(0.05), 4e8);
    for _ in 0..ROUNDS {
        pressures(&curve, black_box(&depth), &before, &before, &mut p, &mut slope);
        black_box((&p, &slope));
    }
}

/// Stress of nodes that slide a little further.
fn slide(law: &ShearLaw) {
    let states: [ShearState; NODES] =
        std::array::from_fn(|k| ShearState { elastic: [1e-6, 0.0], slip: 1e-4 * k as f64 });
    for _ in 0..ROUNDS {
        for (k, state) in black_box(&states).iter().enumerate() {
            black_box(law.respond(state, 4000.0 + 10.0 * k as f64, [2e-4, 1e-5]));
        }
    }
}
