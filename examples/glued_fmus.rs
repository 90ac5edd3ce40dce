//! Two FMUs glued: two oscillators become one mass, and the whole has a closed form to hold the pair against.
//!
//! `cargo run --package terraglue-examples --example glued_fmus`
//!
//! Each FMU is a mass on a spring and a damper (`glued_fmus/oscillator.c`, compiled here by the C compiler of the machine). Neither
//! knows the other; the glue finds the force between them in every step. Glued without compliance they move like one
//! oscillator with the sums of the masses, springs and dampers. The FMUs integrate by the midpoint rule, so the error falls
//! with the square of the step.

use std::path::{Path, PathBuf};
use std::process::Command;
use terraglue::scenario::Scenario;
use terraglue::testbed::Testbed;
use terraglue_fmi::export::{Compression, Content, pack};
use terraglue_fmi::{Version, platform};

type Outcome<T = ()> = Result<T, Box<dyn std::error::Error>>;

/// Mass (kg), spring (N/m) and damper (N s/m) of the left and the right oscillator.
const SIDES: [[f64; 3]; 2] = [[1.0, 40.0, 0.3], [10.0, 1000.0, 0.1]];
/// Both start here, at rest, m.
const X0_M: f64 = 0.1;
/// Length of the run, s.
const DURATION_S: f64 = 2.0;

/// A folder that goes with this value.
struct Folder(PathBuf);

impl Folder {
    /// A new one among the temporary files.
    fn new() -> Outcome<Self> {
        let path = std::env::temp_dir().join(format!("terraglue-glued-fmus-{}", std::process::id()));
        std::fs::create_dir_all(&path)?;
        Ok(Self(path))
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Compiles the oscillator and packs it as `oscillator.fmu`.
fn build_fmu(folder: &Path) -> Outcome {
    let sources = Path::new(env!("CARGO_MANIFEST_DIR")).join("glued_fmus");
    let library = folder.join("oscillator.so");
    let compiler = std::env::var("CC").unwrap_or_else(|_| "cc".to_owned());
    // without fused operations, so that every machine gives the same numbers
    let flags = ["-O2", "-ffp-contract=off", "-shared", "-fPIC", "-o"];
    let compiled =
        Command::new(&compiler).args(flags).arg(&library).arg(sources.join("oscillator.c")).status()?;
    if !compiled.success() {
        return Err(format!("`{compiler}` does not compile the oscillator: {compiled}").into());
    }
    let place = format!("binaries/{}/oscillator.so", platform(Version::V2));
    let entries = [
        ("modelDescription.xml".to_owned(), Content::File(sources.join("modelDescription.xml"))),
        (place, Content::File(library)),
    ];
    Ok(pack(&folder.join("oscillator.fmu"), &entries, Compression::Deflate)?)
}

/// The scenario: both FMUs with their start values, the body of each by the names of its variables, and the glue.
fn scenario(folder: &Path, step_s: f64) -> Outcome<Scenario> {
    let side = |name: &str, [m, k, d]: [f64; 3]| {
        format!(
            "[{name}]\nfmu = \"oscillator.fmu\"\nm = {m:?}\nk = {k:?}\nd = {d:?}\nx = {X0_M:?}\n\
             [{name}.bodies.mass]\nposition = [\"x\"]\nvelocity = [\"v\"]\nforce = [\"f\"]\n"
        )
    };
    let text = format!(
        "[time]\nstep_s = {step_s:?}\nduration_s = {DURATION_S:?}\n[gluing]\nstrategy = \"iterative\"\n{}{}\
         [[glue]]\nside_1 = \"left.mass\"\nside_2 = \"right.mass\"\ncomponents = [\"x\"]\n",
        side("left", SIDES[0]),
        side("right", SIDES[1])
    );
    // the FMUs are beside the file of this name
    Ok(Scenario::parse(&text, &folder.join("pair.toml").to_string_lossy(), &[])?)
}

/// Place (m) of one oscillator with both masses, springs and dampers: x0·e^(−δt)·(cos ωt + δ/ω·sin ωt).
fn whole_m(t_s: f64) -> f64 {
    let [m, k, d] = [0, 1, 2].map(|i| SIDES[0][i] + SIDES[1][i]);
    let decay = d / (2.0 * m);
    let omega = (k / m - decay * decay).sqrt();
    X0_M * (-decay * t_s).exp() * ((omega * t_s).cos() + decay / omega * (omega * t_s).sin())
}

/// Largest distance (m) of the left mass from the closed form, of both masses from each other, and evaluations per step.
fn differences(folder: &Path, step_s: f64) -> Outcome<[f64; 3]> {
    let scenario = scenario(folder, step_s)?;
    let mut testbed = Testbed::build_with(&scenario, &terraglue_examples::options(), &terraglue::library())?;
    let [mut error, mut gap, mut evaluations] = [0.0; 3];
    while testbed.t_s() < DURATION_S - 0.5 * step_s {
        testbed.step()?;
        let [left, right] = ["left.x", "right.x"].map(|name| testbed.read(name).unwrap_or(f64::INFINITY));
        error = f64::max(error, (left - whole_m(testbed.t_s())).abs());
        gap = f64::max(gap, (left - right).abs());
        evaluations += f64::from(testbed.report().evaluations_bodies);
    }
    Ok([error, gap, evaluations / testbed.step_index() as f64])
}

/// The step (s) and its differences, for two steps.
fn table() -> Outcome<[(f64, [f64; 3]); 2]> {
    let folder = Folder::new()?;
    build_fmu(&folder.0)?;
    let row = |step_s: f64| Ok::<_, Box<dyn std::error::Error>>((step_s, differences(&folder.0, step_s)?));
    Ok([row(2e-3)?, row(1e-3)?])
}

fn main() -> Outcome {
    println!("step, s   from the closed form, m   between the masses, m   evaluations per step");
    for (step_s, [error, gap, evaluations]) in table()? {
        println!("{step_s:<9} {error:<25.2e} {gap:<23.2e} {evaluations:.2}");
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_pair_is_the_whole() {
        let [(_, [coarse, ..]), (_, [fine, gap, _])] = super::table().unwrap_or_else(|e| panic!("{e}"));
        // the midpoint rule: ω²h²/12 of the phase ωt = 20 rad, times the amplitude
        assert!(fine < 2e-5 && gap < 1e-12, "{fine} m, {gap} m");
        assert!((coarse / fine - 4.0).abs() < 0.1, "of the second order: {coarse} and {fine} m");
    }
}
