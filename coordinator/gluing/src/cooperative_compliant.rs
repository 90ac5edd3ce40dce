//! The paper's single pass made exact for soils that yield: the soil iterates against the bodies' estimate.
//!
//! x1 = x_free + G1·T replaces the bodies, so they are evaluated once, in step 4; the soil as often as it takes
//! (one to five times). Exact for bodies that are linear within the step, whatever the law or branch of the soil.
//! Otherwise, as when a motor is at its limit under T* and not under T1, the estimate is taken again about T1. For one
//! contact on a linear branch T = (f_n + κ·T*)/(1 + κ), κ = K·G1. The iteration is that of [`super::iterative`].

use super::follow::{PASSES, can_repeat, followed};
use super::interface_problem::InterfaceProblem;
use super::iterative::{Form, Limits, TtForm, XtForm};
use super::memory::{Recall, Remember};
use super::{Needs, Outcome, Strategy};
use terraglue_diagnostics::Result;
use terraglue_host::Instance;
use terraglue_scenario::GluingSpec;
use terraglue_subsystem::Capabilities;

/// Name in the scenario.
pub const NAME: &str = terraglue_scenario::StrategyKind::CooperativeCompliant.name();

/// The strategy with its buffers.
#[derive(Debug)]
pub struct CooperativeCompliant {
    form: Option<Form>,
    limits: Limits,
    tt: TtForm,
    xt: XtForm,
    kappa: f64,
    /// X1 as the estimate says, before the bodies move.
    said: Vec<f64>,
}

impl CooperativeCompliant {
    /// From the scenario's `[gluing]`.
    pub fn new(spec: &GluingSpec) -> Self {
        Self {
            form: Form::read(spec),
            limits: Limits::read(spec),
            tt: TtForm::default(),
            xt: XtForm::default(),
            kappa: 0.0,
            said: Vec::new(),
        }
    }
}

impl Strategy for CooperativeCompliant {
    fn name(&self) -> &'static str {
        NAME
    }

    fn needs(&self) -> Needs {
        let soil = Form::need(self.form) | Capabilities::RETRY;
        Needs { first: Capabilities::FORCE, second: Capabilities::FORCE, grounds: soil }
    }

    fn refuses(&self, problem: &InterfaceProblem) -> Option<String> {
        super::joints_refused(NAME, problem).or_else(|| super::body_contacts_refused(NAME, problem))
    }

    fn remember(&self, out: &mut Vec<u64>) {
        out.put(self.kappa);
    }

    fn recall(&mut self, kept: &mut Recall) {
        self.kappa = kept.number();
    }

    fn solve(&mut self, problem: &mut InterfaceProblem, instances: &mut [Instance]) -> Result<Outcome> {
        problem.estimate_forces(instances)?;
        problem.solve_compatibility(true, instances)?;
        problem.report.evaluations_soil = 0; // the start is not an evaluation of the iteration
        let form = Form::choose(self.form, self.kappa, problem, instances);
        self.xt.reserve(problem.n());
        let mut left = 0.0;
        for pass in 1..=PASSES {
            problem.predict_from_estimate();
            problem.report.xt_form = form == Form::Xt;
            left = match form {
                Form::Tt => self.tt.solve_predicted(&self.limits, problem, instances)?,
                Form::Xt => self.xt.solve_predicted(&self.limits, problem, instances)?,
            };
            self.kappa = problem.report.kappa_max;
            // a residual that is no number does not pass
            if !(left <= self.limits.threshold(problem)) {
                return Ok(self.limits.give_up(problem, "the soil against the estimate: |Λ·e|", left));
            }
            self.said.clone_from(&problem.first.x);
            problem.advance_bodies(instances)?;
            if pass == PASSES || followed(problem, &self.said) || !can_repeat(problem, instances) {
                break;
            }
            problem.estimate_again(instances)?;
        }
        Ok(match form {
            Form::Tt => self.tt.conclude(left, problem),
            Form::Xt => self.xt.conclude(left, problem),
        })
    }
}
