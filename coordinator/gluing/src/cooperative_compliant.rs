//! The paper's single pass made exact for soils that yield: the soil iterates against the bodies' estimate.
//!
//! x1 = x_free + G1·T stands in for the bodies, so they are evaluated once, in step 4; the soil as often as it takes
//! (one to five times). Exact for bodies that are linear within the step, whatever the law or branch of the soil.
//! Where they are not, as a motor is at its limit under T* and not under T1, the estimate is taken again about T1.
//! For one contact on a linear branch T = (f_n + κ·T*)/(1 + κ), κ = K·G1. The iteration is that of [`super::iterative`].

use super::exchange::Exchange;
use super::follow::{PASSES, can_repeat, followed};
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

    fn refuses(&self, exchange: &Exchange) -> Option<String> {
        super::joints_refused(NAME, exchange).or_else(|| super::body_contacts_refused(NAME, exchange))
    }

    fn remember(&self, out: &mut Vec<u64>) {
        out.put(self.kappa);
    }

    fn recall(&mut self, kept: &mut Recall) {
        self.kappa = kept.number();
    }

    fn solve(&mut self, exchange: &mut Exchange, instances: &mut [Instance]) -> Result<Outcome> {
        exchange.estimate_forces(instances)?;
        exchange.solve_compatibility(true, instances)?;
        exchange.report.evaluations_soil = 0; // the start is not an evaluation of the iteration
        let form = Form::choose(self.form, self.kappa, exchange, instances);
        let mut left = 0.0;
        for pass in 1..=PASSES {
            exchange.predict_from_estimate();
            exchange.report.xt_form = form == Form::Xt;
            left = match form {
                Form::Tt => self.tt.solve_predicted(&self.limits, exchange, instances)?,
                Form::Xt => self.xt.solve_predicted(&self.limits, exchange, instances)?,
            };
            self.kappa = exchange.report.kappa_max;
            // a residual that is no number does not pass
            if !(left <= self.limits.threshold(exchange)) {
                return Ok(self.limits.give_up(exchange, "the soil against the estimate: |Λ·e|", left));
            }
            self.said.clone_from(&exchange.x1);
            exchange.advance_bodies(instances)?;
            if pass == PASSES || followed(exchange, &self.said) || !can_repeat(exchange, instances) {
                break;
            }
            exchange.estimate_again(instances)?;
        }
        Ok(match form {
            Form::Tt => self.tt.conclude(left, exchange),
            Form::Xt => self.xt.conclude(left, exchange),
        })
    }
}
