//! Time of laws as text and as modules against the same law built in, over a patch of forty nodes; the exactness of their
//! slopes; the price of a call through the table.

use super::super::timing::{cpu_s, median};
use super::super::{Context, Figure, Limit};
use crate::process::{Outcome, root};
use std::hint::black_box;
use std::path::Path;
use std::process::Command;
use std::sync::Arc;
use terraglue::host::{HostServices, Instance, LoadedModule, law};
use terraglue::subsystem::{Terrain, TerrainTile, ValuesMut};
use terraglue_numerics::extremes::larger;
use terraglue_soil_bekker::SoilBekker;
use terraglue_soil_law::{
    PluginLaw, PressureLaw, ShearLaw, ShearResponse, ShearState, Sheared, SoilExpressions, SoilParameters,
    first_loading,
};
use terraglue_subsystem::Config;

const NODES: usize = 40;
const ROUNDS: usize = 4000;
/// A loose lunar soil (Apollo, nominal).
const SOIL: &str = r#"{"n": 1.1, "k_c": 1400.0, "k_phi": 820000.0, "c_pa": 170.0, "phi_rad": 0.61, "K_m": 0.018,
    "elastic_stiffness_pa_m": 4e8, "law": {"pressure": "(k_c/b + k_phi)*z^n", "shear": "(c + sigma*tan(phi))*(1 - exp(-j/K))"}}"#;
/// The same, stiffer with the depth: no power law any more.
const STIFFENING: &str = "(k_c/b + k_phi)*z^n*(1 + z/K)";

/// The slopes of a law as text and as a module.
pub fn slope(context: &Context, out: &mut Vec<Figure>) -> Outcome {
    let config = Config::parse(SOIL).map_err(|e| e.to_string())?;
    let soil = SoilParameters::from_config(&config, 1.62).map_err(|e| e.to_string())?;
    let rust = context.program.with_file_name("deps").join("liblaw_bekker_plugin.so");
    slopes(&soil, &plugin(&rust, &config)?, out)
}

/// The ratios, and the price of the table.
pub fn figures(context: &Context, out: &mut Vec<Figure>) -> Outcome {
    let config = Config::parse(SOIL).map_err(|e| e.to_string())?;
    let soil = SoilParameters::from_config(&config, 1.62).map_err(|e| e.to_string())?;
    let texts = SoilExpressions::from_config(&config).map_err(|e| e.to_string())?.ok_or("no texts")?;
    let pressure = texts.pressure(&soil).map_err(|e| e.to_string())?.ok_or("no pressure law")?;
    let shear = texts.shear(&soil).map_err(|e| e.to_string())?.ok_or("no shear law")?;
    let (press_built_in, slide_built_in) = (soil.pressure(), soil.shear());
    let mut compare = |name: &str, what: &str, limit: f64, pressure: &PressureLaw, shear: &ShearLaw| {
        for (part, ratio) in [
            ("pressure", over(|| press(pressure), || press(&press_built_in))),
            ("shear", over(|| slide(shear), || slide(&slide_built_in))),
        ] {
            let what = format!("time of the {part} law {what} over built in, {NODES} nodes");
            out.push(Figure::new(format!("plugins.{name}.{part}"), ratio, Limit::AtMost(limit), what));
        }
    };
    let (text, text_shear) = (PressureLaw::Expression(pressure), soil.shear().with_expression(shear));
    compare("expression", "as text", 1.3, &text, &text_shear);
    let deps = context.program.with_file_name("deps");
    let rust = plugin(&deps.join("liblaw_bekker_plugin.so"), &config)?;
    let c = plugin(&compiled(context)?, &config)?;
    for (name, what, law) in [("law-rust", "as a module in Rust", &rust), ("law-c", "as a module in C", &c)] {
        let shear = soil.shear().with_plugin(law.clone()).map_err(|e| e.to_string())?;
        compare(name, what, 1.1, &PressureLaw::Plugin(law.clone()), &shear);
    }
    table(context, &deps, out)
}

fn plugin(path: &Path, config: &Config) -> Outcome<PluginLaw> {
    let module = LoadedModule::load(path).map_err(|e| e.to_string())?;
    let services = HostServices::new(1, Path::new("."));
    Ok(PluginLaw::new(law::open(&module, config, "law", &services)?))
}

/// The law in C, by the system's compiler.
pub fn compiled(context: &Context) -> Outcome<std::path::PathBuf> {
    let library = context.scratch.join("liblaw_bekker_c_plugin.so");
    let mut cc = Command::new("cc");
    cc.args(["-std=c11", "-O2", "-fPIC", "-shared", "-I"]).arg(root().join("interfaces/plugin/include"));
    cc.arg(root().join("tests/modules/law-bekker-c/law_bekker.c")).arg("-o").arg(&library).arg("-lm");
    let done = cc.status().map_err(|e| format!("cannot start `cc`: {e}"))?;
    if done.success() { Ok(library) } else { Err("the law in C does not compile".into()) }
}

/// Slopes of a text and of a module against the closed form.
fn slopes(soil: &SoilParameters, module: &PluginLaw, out: &mut Vec<Figure>) -> Outcome {
    let own = serde_json::json!({"law": {"pressure": STIFFENING}}).to_string();
    let config = Config::parse(&own).map_err(|e| e.to_string())?;
    let texts = SoilExpressions::from_config(&config).map_err(|e| e.to_string())?.ok_or("no texts")?;
    let text = texts.pressure(soil).map_err(|e| e.to_string())?.ok_or("no pressure law")?;
    let b = 0.05;
    let (k, n, z_1) = (soil.k_c / b + soil.k_phi, soil.n, soil.K_m);
    let depths: Vec<f64> = (0..200).map(|i| 1e-4 + 1e-3 * f64::from(i)).collect();
    let worst = |law: &PressureLaw, closed: &dyn Fn(f64) -> f64| {
        let (mut p, mut slope) = (vec![0.0; depths.len()], vec![0.0; depths.len()]);
        let asked = law.curve(b, 4e8).and_then(|c| first_loading(&c, &depths, &mut p, &mut slope));
        if asked.is_err() {
            return f64::INFINITY;
        }
        depths.iter().zip(&slope).fold(0.0_f64, |m, (z, s)| larger(m, (s / closed(*z) - 1.0).abs()))
    };
    let bekker = |z: f64| k * n * libm::pow(z, n - 1.0);
    let stiffening = |z: f64| bekker(z) * (1.0 + z / z_1) + k * libm::pow(z, n) / z_1;
    let found = larger(
        worst(&PressureLaw::Expression(text), &stiffening),
        worst(&PressureLaw::Plugin(module.clone()), &bekker),
    );
    let what = "relative error of the slope of a text and of a module against the closed form, 200 depths";
    out.push(Figure::new("plugins.law.slope", found, Limit::AtMost(1e-12), what));
    Ok(())
}

/// Level ground.
struct Level;

impl Terrain for Level {
    fn origin(&self) -> [f64; 2] {
        [0.0; 2]
    }
    fn spacing(&self) -> f64 {
        0.1
    }
    fn size(&self) -> [u32; 2] {
        [11, 11]
    }
    fn heights(&self, _: i64, _: i64, _: usize, _: usize, out: &mut [f64]) -> TerrainTile {
        out.fill(0.0);
        TerrainTile::Uniform(0.0)
    }
}

/// Extra cost of reading a variable through the table of functions instead of `dyn`.
fn table(context: &Context, deps: &Path, out: &mut Vec<Figure>) -> Outcome {
    let services = HostServices { terrain: Some(Arc::new(Level)), ..HostServices::new(1, &context.scratch) };
    let made = |module: LoadedModule| -> Outcome<Instance> {
        let config = Config::parse(&SOIL.replace(", \"law\"", ", \"unused\"")).map_err(|e| e.to_string())?;
        module.instantiate("soil", config, &services).map_err(|e| e.to_string())
    };
    let linked = made(LoadedModule::builtin::<SoilBekker>())?;
    let file = LoadedModule::load(&deps.join("libsoil_bekker_plugin.so")).map_err(|e| e.to_string())?;
    let loaded = made(file)?;
    let time = |instance: &Instance| {
        let (start, mut x) = (cpu_s(), [0.0]);
        for _ in 0..100_000 {
            let _ = black_box(instance.subsystem().get(black_box(&[0]), ValuesMut::F64(&mut x)));
            black_box(&x);
        }
        1e9 * (cpu_s() - start) / 1e5
    };
    let more = median((0..21).map(|_| time(&loaded) - time(&linked)).collect());
    let what = "reading a variable through the table over `dyn`, panic guard included, ns more";
    out.push(Figure::new("plugins.call", more, Limit::AtMost(15.0), what));
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
    let (mut p, mut slope) = ([0.0; NODES], [0.0; NODES]);
    let Ok(curve) = law.curve(black_box(0.05), 4e8) else { return };
    for _ in 0..ROUNDS {
        let done = first_loading(&curve, black_box(&depth), &mut p, &mut slope);
        let _ = black_box((done, &p, &slope));
    }
}

/// Stress of nodes that slide a little further, as the soils ask for it.
fn slide(law: &ShearLaw) {
    let pressure: [f64; NODES] = std::array::from_fn(|k| 4000.0 + 10.0 * k as f64);
    let untouched = ShearState::default();
    let answer = |k: usize| law.respond(&untouched, pressure[k], [1e-4 * (k + 1) as f64, 0.0]);
    let states: [ShearState; NODES] = std::array::from_fn(|k| answer(k).unwrap_or_default().state);
    let mobilised = states.map(|state| law.mobilised(state.slip));
    let slide = [[2e-4, 1e-5]; NODES];
    let mut out = [ShearResponse::default(); NODES];
    for _ in 0..ROUNDS {
        let states = black_box(&states);
        if law.is_batched() {
            let nodes = Sheared { states, kept: &[], pressure: &pressure, slide: &slide };
            let _ = black_box(law.respond_many(&nodes, &mut out));
        } else {
            for k in 0..NODES {
                let answer = law.respond_kept(&states[k], &[], mobilised[k], pressure[k], slide[k]);
                out[k] = answer.unwrap_or_default();
            }
        }
        black_box(&out);
    }
}
