//! Scenarios as text, built with the subsystems of the reference cases, and stepped.

use crate::process::Outcome;
use glue_cases::{MassChain, PlanarBodies, PowerColumns, TableOnFeet};
use std::fmt::Write;
use terraglue::Testbed;
use terraglue::scenario::{GluingSpec, Scenario};
use terraglue::testbed::Options;
use terraglue_numerics::extremes::larger;

/// `[time]`, `[world]` and `[gluing]` of a case.
#[derive(Clone, Debug)]
pub struct Setting {
    /// Communication step, s.
    pub h: f64,
    /// Gravity, m/s².
    pub gravity: [f64; 3],
    /// Strategy.
    pub strategy: &'static str,
    /// Further lines of `[gluing]`.
    pub gluing: String,
}

impl Setting {
    /// `iterative` with a tolerance near rounding.
    pub fn iterative(h: f64, gravity: [f64; 3]) -> Self {
        Self { h, gravity, strategy: "iterative", gluing: "tolerance = 1e-11".into() }
    }

    /// The head of the scenario.
    pub fn text(&self) -> String {
        format!(
            "[time]\nstep_s = {:?}\nduration_s = {:?}\n[world]\ngravity_m_s2 = {:?}\n[gluing]\nstrategy = {:?}\n{}\n",
            self.h,
            self.h * 1000.0,
            self.gravity,
            self.strategy,
            self.gluing
        )
    }
}

/// A subsystem's table.
pub fn subsystem(name: &str, module: &str, keys: &[(&str, String)]) -> String {
    let mut text = format!("[{name}]\nmodule = \"{module}\"\n");
    for (key, value) in keys {
        let _ = writeln!(text, "{key} = {value}");
    }
    text
}

/// Numbers as a TOML array.
pub fn list(values: &[f64]) -> String {
    format!("{values:?}")
}

/// Builds a scenario.
pub fn build(text: &str) -> Outcome<Testbed> {
    build_with(text, |_| ())
}

/// The same with other settings of the gluing than a scenario can name.
pub fn build_with(text: &str, set: impl FnOnce(&mut GluingSpec)) -> Outcome<Testbed> {
    let mut scenario = Scenario::parse(text, "case.toml", &[]).map_err(|e| format!("{e}\n{text}"))?;
    set(&mut scenario.gluing);
    let library = terraglue::library()
        .with::<MassChain>()
        .with::<PlanarBodies>()
        .with::<TableOnFeet>()
        .with::<PowerColumns>();
    let options = Options { threads: 1, ..Options::default() };
    Testbed::build_with(&scenario, &options, &library).map_err(|e| format!("{e}\n{text}"))
}

/// A committed value.
pub fn read(testbed: &Testbed, name: &str) -> Outcome<f64> {
    testbed.read(name).ok_or_else(|| format!("no variable {name}"))
}

/// A component of the wrench of port k after the last step; component 0 is n or x.
pub fn wrench(testbed: &Testbed, port: usize, component: usize) -> f64 {
    testbed.report().ports.get(port).map_or(0.0, |p| p.wrench[component])
}

/// Steps `count` times.
pub fn step(testbed: &mut Testbed, count: u64, mut look: impl FnMut(&Testbed) -> Outcome) -> Outcome {
    for _ in 0..count {
        testbed.step().map_err(|e| e.to_string())?;
        look(testbed)?;
    }
    Ok(())
}

/// Evaluations of a run.
#[derive(Clone, Copy, Debug, Default)]
pub struct Tally {
    /// Steps.
    pub steps: u32,
    /// Evaluations of the bodies.
    pub bodies: u32,
    /// Largest number in one step.
    pub most: u32,
    /// Jacobian refreshes.
    pub refreshes: u32,
    /// Largest gap, m.
    pub gap: f64,
}

impl Tally {
    /// Adds the last step.
    pub fn add(&mut self, testbed: &Testbed) {
        let report = testbed.report();
        self.steps += 1;
        self.bodies += report.evaluations_bodies;
        self.most = larger(self.most, report.evaluations_bodies);
        self.refreshes += report.jacobian_refreshes;
        self.gap = larger(self.gap, report.max_gap_m);
    }

    /// Evaluations of the bodies per step.
    pub fn mean(&self) -> f64 {
        f64::from(self.bodies) / f64::from(self.steps.max(1))
    }
}
