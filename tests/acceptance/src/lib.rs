//! Helpers for tests of whole runs.

pub mod step_times;

use glue_cases::{MassChain, PlanarBodies, PowerColumns, TableOnFeet};
use terraglue::scenario::{GluingSpec, Scenario};
use terraglue::testbed::Options;
use terraglue::{Result, Testbed};

/// The repository.
pub const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

/// A scenario from its text, as if it lay in `scenarios/`.
pub fn scenario(text: &str) -> Scenario {
    let path = format!("{ROOT}/scenarios/test.toml");
    Scenario::parse(text, &path, &[]).unwrap_or_else(|e| panic!("{e}: {:?}", e.help))
}

/// A scenario from `scenarios/`, edited.
pub fn shipped(name: &str, sets: &[(&str, &str)]) -> Scenario {
    let path = format!("{ROOT}/scenarios/{name}.toml");
    let sets: Vec<_> = sets.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect();
    Scenario::load(path.as_ref(), &sets).unwrap_or_else(|e| panic!("{e}: {:?}", e.help))
}

/// Builds with one thread.
///
/// # Errors
/// As [`Testbed::build`].
pub fn build(scenario: &Scenario) -> Result<Testbed> {
    Testbed::build_with(scenario, &Options { threads: 1, ..Options::default() }, &terraglue::library())
}

/// Builds a scenario of the modules of the glue cases from its text, with one thread.
///
/// # Errors
/// As [`Testbed::build`], or a text that is no scenario.
pub fn glued(text: &str) -> Result<Testbed> {
    glued_with(text, |_| ())
}

/// The same with other settings of the gluing than a scenario can name.
///
/// # Errors
/// As [`glued`].
pub fn glued_with(text: &str, set: impl FnOnce(&mut GluingSpec)) -> Result<Testbed> {
    let mut scenario = Scenario::parse(text, "test.toml", &[])?;
    set(&mut scenario.gluing);
    let library = terraglue::library()
        .with::<MassChain>()
        .with::<PlanarBodies>()
        .with::<TableOnFeet>()
        .with::<PowerColumns>();
    Testbed::build_with(&scenario, &Options { threads: 1, ..Options::default() }, &library)
}

/// The value of a variable that there is.
pub fn read(testbed: &Testbed, name: &str) -> f64 {
    testbed.read(name).unwrap_or_else(|| panic!("no variable {name}"))
}

/// Steps n times.
pub fn steps(testbed: &mut Testbed, n: usize) {
    for _ in 0..n {
        testbed.step().unwrap_or_else(|e| panic!("{e}"));
    }
}

/// A foot of 5 kg on flat ground.
pub fn foot(strategy: &str, soil: &str) -> String {
    format!(
        r#"
[time]
step_s = 0.001
duration_s = 4.0
[world]
gravity_m_s2 = [0.0, 0.0, -9.81]
[terrain]
kind = "flat"
size_m = [0.6, 0.6]
spacing_m = 0.01
[gluing]
strategy = "{strategy}"
[foot]
module = "rigid-body"
model = "../tests/models/ball.urdf"
{soil}
"#
    )
}

/// The soil tables used in the tests.
pub const SOILS: [&str; 2] = [
    "[soil]\nmodule = \"soil-bekker\"\nparameters = \"lunar_nominal_Apollo\"",
    "[soil]\nmodule = \"soil-cellular-automaton\"\nparameters = \"lunar_nominal_Apollo\"",
];
