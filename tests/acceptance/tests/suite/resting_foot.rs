//! A foot at rest: the soil carries exactly its weight and it does not creep.

use std::sync::Arc;
use terraglue::Testbed;
use terraglue::testbed::Options;
use terraglue_acceptance::{SOILS, build, foot, scenario, steps};
use terraglue_numerics::extremes::larger;
use terraglue_soil_bekker::SoilBekker;
use terraglue_subsystem::{
    Capabilities, Config, Estimate, Host, Input, Law, Module, Motion, Response, Result, Schema, Step,
    Subsystem,
};

const WEIGHT: f64 = 5.0 * 9.81;

/// Largest relative error of T1_n against the weight and largest motion over 1000 steps after settling.
fn rest(text: &str, settle_steps: usize) -> (f64, f64, f64) {
    let mut testbed = build(&scenario(text)).unwrap_or_else(|e| panic!("{e}"));
    steps(&mut testbed, settle_steps);
    let start = testbed.read("foot.ball.z").expect("height");
    let (mut error, mut drift) = (0.0_f64, 0.0_f64);
    for _ in 0..1000 {
        steps(&mut testbed, 1);
        let t1: f64 = testbed.report().ports.iter().map(|p| p.wrench[0]).sum();
        error = larger(error, (t1 / WEIGHT - 1.0).abs());
        drift = larger(drift, (testbed.read("foot.ball.z").expect("height") - start).abs());
    }
    (error, drift, 0.03 - start)
}

#[test]
fn both_strategies_on_both_soils() {
    for strategy in ["cooperative", "iterative"] {
        for soil in SOILS {
            // stiff enough that the rebound of the landing dies within the time: the soil itself damps none of it
            let soil = &format!("{soil}\nelastic_stiffness_pa_m = 4e8");
            let (error, drift, sinkage) = rest(&foot(strategy, soil), 3000);
            println!("{strategy} {soil}: error {error:e}, drift {drift:e} m, sinkage {sinkage} m");
            assert!(error <= 1e-8, "{strategy}, {soil}: relative error {error:e}");
            assert!(drift <= 1e-9, "{strategy}, {soil}: drift {drift:e} m");
            assert!(sinkage > 1e-3, "{strategy}, {soil}: sinkage {sinkage} m");
        }
    }
}

/// A driven foot goes 1 cm into the soil within 0.1 s and stands there.
#[test]
fn a_driven_foot_that_stands_keeps_its_force() {
    let forces = ["cooperative", "iterative"].map(|strategy| {
        let text = format!(
            "event = [{{ at_s = 0.0, set = {{ \"feet.position[1,3]\" = 0.02 }} }}]
[time]
step_s = 0.001
duration_s = 1.0
[terrain]
kind = \"flat\"
size_m = [1.0, 1.0]
spacing_m = 0.01
[gluing]
strategy = \"{strategy}\"
[soil]
module = \"soil-bekker\"
parameters = \"LETE_sand\"
[feet]
module = \"feet\"
position_m = [0.0, 0.0, 0.035]
duration_s = 0.1
"
        );
        let mut testbed = build(&scenario(&text)).unwrap_or_else(|e| panic!("{e}"));
        let mut told = || {
            steps(&mut testbed, 150);
            // its drive carries any reaction of the soil
            let gap = testbed.report().max_action_reaction_gap_n;
            assert!(gap <= 1e-6, "{strategy}: action and reaction differ by {gap:e} N");
            testbed.read("feet.force[1,3]").expect("a force")
        };
        let [early, late] = [told(), told()];
        assert_eq!(early, late, "{strategy}");
        early
    });
    assert!(forces[0] > 100.0 && (forces[0] / forces[1] - 1.0).abs() < 1e-9, "{forces:?}");
}

#[test]
fn columns_hold_the_foot_to_a_picometre() {
    for strategy in ["cooperative", "iterative"] {
        let soil = "[soil]\nmodule = \"soil-column\"";
        let (error, drift, sinkage) = rest(&foot(strategy, soil), 3000);
        println!("{strategy} columns: error {error:e}, drift {drift:e} m, sinkage {sinkage} m");
        assert!(error <= 1e-8, "{strategy}: relative error {error:e}");
        assert!(drift <= 1e-12, "{strategy}: drift {drift:e} m");
    }
}

/// The negative control: a soil that hands the rigid estimate back, T1 = T*.
struct Unyielding(Box<dyn Subsystem>);

impl Module for Unyielding {
    fn schema() -> Schema {
        Schema { name: "soil-unyielding".into(), ..SoilBekker::schema() }
    }
    fn instantiate(config: &Config, host: Arc<dyn Host>) -> Result<Box<dyn Subsystem>> {
        Ok(Box::new(Self(SoilBekker::instantiate(config, host)?)))
    }
}

impl Subsystem for Unyielding {
    fn capabilities(&self) -> Capabilities {
        Capabilities::SOLVE | Capabilities::FORCE
    }
    fn set_ports(&mut self, step: &Step, laws: &mut [Law], now: &mut Response) -> Result {
        self.0.set_ports(step, laws, now)
    }
    fn solve_compatibility(&mut self, step: &Step, estimate: &Estimate, out: &mut Response) -> Result {
        out.t.copy_from_slice(estimate.t_star);
        [&mut *out.x, &mut *out.v, &mut *out.a].into_iter().for_each(|values| values.fill(0.0));
        out.reached = step.t + step.h;
        Ok(())
    }
    fn advance(&mut self, step: &Step, input: &Input, out: &mut Response) -> Result {
        self.0.advance(step, input, out)
    }
    fn commit(&mut self, step: &Step, t: &[f64], partner: &Motion) -> Result {
        self.0.commit(step, t, partner)
    }
}

#[test]
fn the_negative_control_never_sinks() {
    let soil = "[soil]\nmodule = \"soil-unyielding\"\nparameters = \"lunar_nominal_Apollo\"";
    let library = terraglue::library().with::<Unyielding>();
    let built = Testbed::build_with(&scenario(&foot("cooperative", soil)), &Options::default(), &library);
    let mut testbed = built.unwrap_or_else(|e| panic!("{e}"));
    for _ in 0..2000 {
        steps(&mut testbed, 1);
        let sinkage = 0.03 - testbed.read("foot.ball.z").expect("height");
        assert!(sinkage.abs() < 1e-9, "sank by {sinkage} m");
    }
}
