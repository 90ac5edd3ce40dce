//! Inputs that follow the line through the last two values of their source: exact on a line, of second order on a curve, and the same
//! after a snapshot and through an event within a step.

use std::sync::Arc;
use terraglue_engine::{Options, Testbed};
use terraglue_host::Library;
use terraglue_scenario::Scenario;
use terraglue_subsystem::*;

/// Tells t² and the integral of its input, which it holds over a step.
struct Integral {
    /// t, s; t²; the input; its integral.
    now: [f64; 4],
    variables: Vec<Variable>,
    saved: Vec<[f64; 4]>,
}

impl Module for Integral {
    fn schema() -> Schema {
        Schema {
            name: "integral".into(),
            kind: Kind::Controller,
            help: "Integrates".into(),
            parameters: Vec::new(),
        }
    }
    fn instantiate(_: &Config, host: Arc<dyn Host>) -> Result<Box<dyn Subsystem>> {
        let real = |id, name: &str, causality| Variable::real(id, name, "", causality, "");
        let variables = vec![
            real(1, "square", Causality::Output),
            real(2, "u", Causality::Input),
            real(3, "x", Causality::Output),
        ];
        Ok(Box::new(Self { now: [0.0; 4], variables, saved: vec![[0.0; 4]; host.slots() as usize] }))
    }
}

impl Subsystem for Integral {
    fn capabilities(&self) -> Capabilities {
        Capabilities::STATE
    }
    fn advance(&mut self, step: &Step, _: &Input, out: &mut Response) -> Result {
        let [_, _, u, x] = self.now;
        let t = step.t + step.h;
        self.now = [t, t * t, u, x + step.h * u];
        out.reached = t;
        Ok(())
    }
    fn save_state(&mut self, slot: u32) -> Result {
        self.saved[slot as usize] = self.now;
        Ok(())
    }
    fn restore_state(&mut self, slot: u32) -> Result {
        self.now = self.saved[slot as usize];
        Ok(())
    }
    fn variables(&self) -> &[Variable] {
        &self.variables
    }
    fn get(&self, ids: &[u32], out: ValuesMut) -> Result {
        let ValuesMut::F64(out) = out else { return Err(Error::Unsupported) };
        ids.iter().zip(out).for_each(|(id, out)| *out = self.now[*id as usize]);
        Ok(())
    }
    fn set(&mut self, ids: &[u32], values: Values) -> Result {
        let Values::F64(values) = values else { return Err(Error::Unsupported) };
        ids.iter().zip(values).for_each(|(id, value)| self.now[*id as usize] = *value);
        Ok(())
    }
}

fn testbed(step_s: f64, more: &str) -> Testbed {
    let text = format!(
        "[time]\nstep_s = {step_s}\nduration_s = 2.0\n[a]\nmodule = \"integral\"\n[b]\nmodule = \"integral\"\n\
         [[connect]]\nfrom = \"a.square\"\nto = \"b.u\"\nextrapolate = \"linear\"\n{more}"
    );
    let scenario = Scenario::parse(&text, "line.toml", &[]).unwrap();
    let library = Library::new().with::<Integral>();
    let mut testbed = Testbed::build_with(&scenario, &Options::default(), &library).unwrap();
    testbed.begin().unwrap();
    testbed
}

/// The integral after each step up to a time.
fn integral(testbed: &mut Testbed, until_s: f64) -> Vec<u64> {
    let mut all = Vec::new();
    while testbed.t_s() < until_s - 1e-9 {
        testbed.step().unwrap();
        all.push(testbed.read("b.x").unwrap().to_bits());
    }
    all
}

#[test]
fn a_curve_is_integrated_with_the_second_order() {
    let error = |h: f64| {
        let all = integral(&mut testbed(h, ""), 2.0);
        (f64::from_bits(*all.last().unwrap()) - 8.0 / 3.0).abs()
    };
    let (coarse, fine) = (error(0.02), error(0.01));
    assert!(((coarse / fine).log2() - 2.0).abs() < 0.1, "{coarse} {fine}");
}

#[test]
fn a_run_that_goes_on_from_a_snapshot_follows_the_same_line() {
    for more in ["", "[[event]]\nat_s = 1.23\nset = { \"a.u\" = 5.0 }\n"] {
        let mut testbed = testbed(0.1, more);
        integral(&mut testbed, 1.0);
        let kept = testbed.snapshot(0).unwrap();
        let first = integral(&mut testbed, 2.0);
        testbed.restore(&kept).unwrap();
        assert_eq!(integral(&mut testbed, 2.0), first, "{more}");
    }
}

#[test]
fn an_event_within_a_step_shortens_the_line() {
    // the event changes nothing that matters: the parts of the step together still follow the curve
    let plain = integral(&mut testbed(0.1, ""), 2.0);
    let cut = integral(&mut testbed(0.1, "[[event]]\nat_s = 1.23\nset = { \"a.u\" = 0.0 }\n"), 2.0);
    let [plain, cut] = [plain, cut].map(|all| f64::from_bits(*all.last().unwrap()));
    let exact = 8.0 / 3.0;
    assert!((cut - exact).abs() < 1.05 * (plain - exact).abs(), "{plain} {cut}");
}
