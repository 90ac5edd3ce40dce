//! Interface Jacobians by differences: all columns of a member in one exchange, members side by side, and ports of a soil
//! that lie apart in one trial. They give the motion that analytic ones give.

use glue_cases::{MassChain, PowerColumns, TableOnFeet};
use std::cell::Cell;
use std::marker::PhantomData;
use std::sync::Arc;
use terraglue::host::Library;
use terraglue::testbed::Options;
use terraglue::{Testbed, scenario::Scenario};
use terraglue_numerics::extremes::larger;
use terraglue_subsystem::{
    Batch, BodyState, Capabilities, Config, Energy, Host, Input, Law, Level, Module, Motion, Response,
    Result, Scene, Schema, Step, Subsystem, Values, ValuesMut, Variable,
};

thread_local! {
    /// Exchanges with all columns, and trials in them.
    static BATCHES: Cell<(u32, u32)> = const { Cell::new((0, 0)) };
}

/// A module that does not provide its derivatives.
struct Mute<M>(PhantomData<M>);

struct MuteSubsystem(Box<dyn Subsystem>);

impl<M: Module> Module for Mute<M> {
    fn schema() -> Schema {
        M::schema()
    }

    fn instantiate(config: &Config, host: Arc<dyn Host>) -> Result<Box<dyn Subsystem>> {
        Ok(Box::new(MuteSubsystem(M::instantiate(config, host)?)))
    }
}

impl Subsystem for MuteSubsystem {
    fn capabilities(&self) -> Capabilities {
        Capabilities(self.0.capabilities().0 & !Capabilities::DERIVATIVES.0)
    }

    fn set_ports(&mut self, step: &Step, laws: &mut [Law], now: &mut Response) -> Result {
        self.0.set_ports(step, laws, now)
    }

    fn advance(&mut self, step: &Step, input: &Input, out: &mut Response) -> Result {
        self.0.advance(step, input, out)
    }

    fn advance_batch(&mut self, step: &Step, t: &[f64], out: &mut Batch) -> Result {
        let trials = t.len() as u32 / step.n.max(1);
        BATCHES.with(|b| b.set((b.get().0 + 1, b.get().1 + trials)));
        self.0.advance_batch(step, t, out)
    }

    fn interface_jacobian(&mut self, _: &Step, _: Level, _: &mut [f64]) -> Result {
        panic!("it said that it has none");
    }

    fn commit(&mut self, step: &Step, t: &[f64], partner: &Motion) -> Result {
        self.0.commit(step, t, partner)
    }

    fn save_state(&mut self, slot: u32) -> Result {
        self.0.save_state(slot)
    }

    fn restore_state(&mut self, slot: u32) -> Result {
        self.0.restore_state(slot)
    }

    fn variables(&self) -> &[Variable] {
        self.0.variables()
    }

    fn get(&self, ids: &[u32], out: ValuesMut) -> Result {
        self.0.get(ids, out)
    }

    fn set(&mut self, ids: &[u32], values: Values) -> Result {
        self.0.set(ids, values)
    }

    fn scene(&self) -> Scene {
        self.0.scene()
    }

    fn body_states(&self, out: &mut [BodyState]) -> Result {
        self.0.body_states(out)
    }

    fn energy(&self) -> Energy {
        self.0.energy()
    }
}

fn build(text: &str, library: &Library) -> Testbed {
    let scenario = Scenario::parse(text, "test.toml", &[]).unwrap_or_else(|e| panic!("{e}: {:?}", e.help));
    let options = Options { threads: 1, ..Options::default() };
    Testbed::build_with(&scenario, &options, library).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

/// Trials for differences and Jacobians of a step.
fn step(testbed: &mut Testbed) -> (u32, u32) {
    testbed.step().unwrap_or_else(|e| panic!("{e}"));
    let report = testbed.report();
    (report.evaluations_jacobian, report.jacobian_refreshes)
}

fn read(testbed: &Testbed, names: &[&str]) -> Vec<f64> {
    names.iter().map(|n| testbed.read(n).unwrap_or_else(|| panic!("no variable {n}"))).collect()
}

fn apart(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).fold(0.0, |m, (a, b)| larger(m, (a - b).abs()))
}

/// Four masses in a row, each a subsystem, held together by three joints.
fn row(jacobian: &str) -> String {
    let mut text = format!(
        "[time]\nstep_s = 0.01\nduration_s = 10.0\n[world]\ngravity_m_s2 = [0.0, 0.0, 0.0]\n[gluing]\n\
         strategy = \"iterative\"\njacobian = \"{jacobian}\"\n"
    );
    for (k, name) in ["a", "b", "c", "d"].iter().enumerate() {
        text += &format!(
            "[{name}]\nmodule = \"mass-chain\"\nmass_kg = [{}.0]\nspring_n_m = [{}.0]\nposition_m = [1.0]\n\
             integrator = \"newmark\"\n",
            k + 1,
            100 * (k + 1) * (k + 1)
        );
    }
    for pair in ["ab", "bc", "cd"] {
        let (a, b) = pair.split_at(1);
        text += &format!("[[glue]]\nside_1 = \"{a}.m0\"\nside_2 = \"{b}.m0\"\ncomponents = \"x\"\n");
    }
    text
}

#[test]
fn members_are_differenced_side_by_side_in_one_exchange_each() {
    let names = ["a.m0.x", "b.m0.x", "c.m0.x", "d.m0.x"];
    let analytic = terraglue::library().with::<MassChain>();
    let mute = terraglue::library().with::<Mute<MassChain>>();
    let mut truth = build(&row("analytic"), &analytic);
    let mut other = build(&row("finite-differences"), &mute);
    for k in 0..50 {
        truth.step().unwrap_or_else(|e| panic!("{e}"));
        BATCHES.with(|b| b.set((0, 0)));
        let (trials, refreshes) = step(&mut other);
        let (exchanges, own) = BATCHES.with(Cell::get);
        // the outer masses carry one joint, the inner ones two: two evaluations side by side instead of three of all four.
        // The first step has the forces of the start before it.
        if k > 0 {
            assert_eq!((trials, refreshes, exchanges, own), (2, 1, 4, 6));
        }
        let off = apart(&read(&truth, &names), &read(&other, &names));
        assert!(off <= 1e-8, "{off} m");
    }
    // a member that knows its derivatives is not differenced because its partner does not
    let mixed = terraglue::library().with::<MassChain>().with::<Mute<TableOnFeet>>();
    let mut mixed = build(&row("analytic"), &mixed);
    assert_eq!(step(&mut mixed).0, 0);
}

/// A table on six columns of soil.
fn table(form: &str) -> String {
    let mut text = format!(
        "[time]\nstep_s = 0.002\nduration_s = 10.0\n[gluing]\nstrategy = \"iterative\"\nform = \"{form}\"\ntolerance = 1e-11\n\
         [table]\nmodule = \"table-on-feet\"\nmass_kg = 60.0\nroll_inertia_kg_m2 = 2.0\npitch_inertia_kg_m2 = 4.0\n\
         feet_m = [0.4, 0.3, 0.0, 0.3, -0.4, 0.3, 0.4, -0.3, 0.0, -0.3, -0.4, -0.3]\noffset_m = [0.05, 0.02]\n\
         start = [0.0, 0.0, 0.0, 0.3, 0.0, 0.0]\nintegrator = \"implicit-euler\"\n\
         [soil]\nmodule = \"power-columns\"\nK = [15e3, 7e3, 30e3, 23e3, 12e3, 18e3]\nn = [1.1]\nk_u = [6e5, 3e5, 12e5, 9e5, 5e5, 7e5]\n"
    );
    for k in 0..6 {
        text +=
            &format!("[[glue]]\nkind = \"contact\"\nside_1 = \"table.foot{k}\"\nside_2 = \"soil.c{k}\"\n");
    }
    text
}

#[test]
fn ports_that_lie_apart_on_a_soil_cost_one_trial_together() {
    let names = ["table.heave", "table.roll", "table.pitch"];
    for form in ["tt", "xt"] {
        let mut truth =
            build(&table(form), &terraglue::library().with::<TableOnFeet>().with::<PowerColumns>());
        let mute = terraglue::library().with::<TableOnFeet>().with::<Mute<PowerColumns>>();
        let mut other = build(&table(form), &mute);
        for _ in 0..40 {
            truth.step().unwrap_or_else(|e| panic!("{e}"));
            let (trials, refreshes) = step(&mut other);
            // six columns of the Jacobian
            assert!(trials > 0 && trials <= refreshes, "{form}: {trials} trials for {refreshes} Jacobians");
            let off = apart(&read(&truth, &names), &read(&other, &names));
            assert!(off <= 1e-8, "{form}: {off}");
        }
    }
}
