//! The generic iterative T-T strategy (Tseng and Hulbert 2001; Wang, Ma and Hulbert 2003), full Newton.
//!
//! Every trial starts from the committed state. Two forms of one iteration, at position level with an
//! end-of-step hold:
//! - `tt`: wrenches in, motions out on both sides; T ← T − Λ·e with e = x1 − x2 along the normals, where
//!   Λ = (G1 + G2)⁻¹ is full and unilateral contact is an active set on the linearised problem;
//! - `xt`: the soil takes the motion and answers the wrench; r = T − F(X1(T)), J = I + K·G1.
//!
//! `auto` takes X-T where the soil takes motion only, or where κ = λmax(K·G1) of the step before is ≤ 10 with shear or
//! moments at the ports and ≤ 0.3 without; T-T otherwise, and the other one on failure. With normal forces alone Λ is
//! symmetric, the line search of T-T cannot cycle, and six feet take at most 9 evaluations where X-T took 20 at the kink of
//! unloading; the same holds for a κ that is not known yet. With laws of shear X-T is the quicker one: it iterates with the full Newton matrix against the linearised bodies, so it is not bound to the
//! κ < 1 of its fixed point: on `moon_walk`, κ up to 9, it takes 7 evaluations of a soil per step where T-T takes 21 and
//! more. The start is the co-operational answer min(T*, F), never the T of the step before, which
//! lands on the wrong side of the unloading kink by rounding.

pub(super) mod friction;
mod tt;
mod xt;

pub(super) use tt::TtForm;
pub(super) use xt::XtForm;

use super::glue::ConstraintKind;
use super::interface_problem::InterfaceProblem;
use super::memory::{Recall, Remember};
use super::{Needs, Outcome, Strategy};
use terraglue_diagnostics::Result;
use terraglue_host::Instance;
use terraglue_numerics::dense;
use terraglue_scenario::{FormChoice, GluingSpec, StartChoice};
use terraglue_subsystem::Capabilities;

/// Name in the scenario.
pub const NAME: &str = terraglue_scenario::StrategyKind::Iterative.name();

/// Largest κ at which `auto` prefers the X-T form where ports carry shear or moments.
const KAPPA_XT: f64 = 10.0;
/// The same where they carry normal forces only.
const KAPPA_XT_NORMAL: f64 = 0.3;

/// Which of the two forms runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Form {
    Tt,
    Xt,
}

/// Limits of both forms of the iteration.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    /// τ of the stopping rule.
    pub tolerance: f64,
    pub max_iterations: u32,
}

impl Form {
    /// From `gluing.form`; none: `auto`.
    pub fn read(spec: &GluingSpec) -> Option<Self> {
        match spec.form {
            FormChoice::Tt => Some(Self::Tt),
            FormChoice::Xt => Some(Self::Xt),
            FormChoice::Auto => None,
        }
    }

    /// Capabilities that a soil needs.
    pub fn need(form: Option<Self>) -> Capabilities {
        match form {
            Some(Self::Tt) => Capabilities::FORCE,
            Some(Self::Xt) => Capabilities::MOTION,
            None => Capabilities::default(),
        }
    }

    /// The form for the soils of a group: as asked, else by what they offer, what the ports carry and κ of the step before
    /// (0: none was formed).
    pub fn choose(
        form: Option<Self>,
        kappa: f64,
        problem: &InterfaceProblem,
        instances: &[Instance],
    ) -> Self {
        let takes = |c| problem.ground_slots().all(|s| instances[s].capabilities().has(c));
        match form {
            _ if problem.needs_linearisation() => Self::Tt,
            Some(form) => form,
            None if !takes(Capabilities::FORCE) => Self::Xt,
            None if !takes(Capabilities::MOTION) => Self::Tt,
            None if problem.conditions.kinds.contains(&ConstraintKind::Law) => {
                if kappa > KAPPA_XT {
                    Self::Tt
                } else {
                    Self::Xt
                }
            }
            None if kappa > KAPPA_XT_NORMAL || kappa == 0.0 => Self::Tt,
            None => Self::Xt,
        }
    }
}

impl Limits {
    /// From the scenario's `[gluing]`.
    pub fn read(spec: &GluingSpec) -> Self {
        Self { tolerance: spec.tolerance, max_iterations: spec.max_iterations }
    }

    /// τ·max(T_ref, |T|∞), N.
    pub fn threshold(&self, problem: &InterfaceProblem) -> f64 {
        self.tolerance * problem.t_ref.max(dense::max_norm(&problem.t))
    }

    /// The end of an iteration that did not reach its threshold; `measure` (N) is what was left.
    pub fn give_up(&self, problem: &mut InterfaceProblem, what: &str, measure: f64) -> Outcome {
        problem.report.residual = measure / problem.t_ref;
        Outcome::NotConverged(format!(
            "{what} = {measure:.3e} N after {} iterations, tolerance {:.3e} N",
            self.max_iterations,
            self.threshold(problem)
        ))
    }
}

/// The strategy with its buffers.
#[derive(Debug)]
pub struct Iterative {
    form: Option<Form>,
    from_estimate: bool,
    limits: Limits,
    tt: tt::TtForm,
    xt: xt::XtForm,
    start: Vec<f64>,
    kappa: f64,
}

impl Iterative {
    /// From the scenario's `[gluing]`.
    pub fn new(spec: &GluingSpec) -> Self {
        Self {
            form: Form::read(spec),
            from_estimate: spec.start == StartChoice::Estimate,
            limits: Limits::read(spec),
            tt: tt::TtForm::new(spec.jacobian),
            xt: xt::XtForm::default(),
            start: Vec::new(),
            kappa: 0.0,
        }
    }

    fn run(
        &mut self,
        form: Form,
        problem: &mut InterfaceProblem,
        instances: &mut [Instance],
    ) -> Result<Outcome> {
        problem.t.copy_from_slice(&self.start);
        problem.report.xt_form = form == Form::Xt;
        let outcome = match form {
            Form::Tt => self.tt.solve(&self.limits, problem, instances)?,
            Form::Xt => self.xt.solve(&self.limits, problem, instances)?,
        };
        self.kappa = problem.report.kappa_max;
        Ok(outcome)
    }
}

impl Strategy for Iterative {
    fn name(&self) -> &'static str {
        NAME
    }

    fn needs(&self) -> Needs {
        let bodies = Capabilities::FORCE | Capabilities::RETRY;
        Needs { first: bodies, second: bodies, grounds: Form::need(self.form) | Capabilities::RETRY }
    }

    fn remember(&self, out: &mut Vec<u64>) {
        out.put(self.kappa);
        self.tt.remember(out);
    }

    fn recall(&mut self, kept: &mut Recall) {
        self.kappa = kept.number();
        self.tt.recall(kept);
    }

    fn solve(&mut self, problem: &mut InterfaceProblem, instances: &mut [Instance]) -> Result<Outcome> {
        if problem.needs_linearisation() {
            // joints start from the force of the step before, contacts from the soil's own
            problem.start_from_last();
            self.start.clear();
            self.start.extend_from_slice(&problem.t);
            return self.run(Form::Tt, problem, instances);
        }
        problem.estimate_forces(instances)?;
        if self.from_estimate {
            problem.solve_compatibility(true, instances)?;
            problem.report.evaluations_soil = 0; // the start is not an evaluation of the iteration
        } else {
            problem.t.fill(0.0);
        }
        self.start.clear();
        self.start.extend_from_slice(&problem.t);
        let first = Form::choose(self.form, self.kappa, problem, instances);
        self.xt.reserve(problem.n());
        let outcome = self.run(first, problem, instances)?;
        if outcome == Outcome::Converged || self.form.is_some() {
            return Ok(outcome);
        }
        let other = if first == Form::Tt { Form::Xt } else { Form::Tt };
        let needed = if other == Form::Tt { Capabilities::FORCE } else { Capabilities::MOTION };
        if problem.ground_slots().any(|s| !instances[s].capabilities().has(needed)) {
            return Ok(outcome);
        }
        self.run(other, problem, instances)
    }
}

/// Power iteration (three products) for λmax of K·G on the start vector of ones; an estimate for the report.
fn largest_eigenvalue(k: &[f64], g: &[f64], x: &mut Vec<f64>, y: &mut Vec<f64>, n: usize) -> f64 {
    x.clear();
    x.resize(n, 1.0);
    let mut value = 0.0;
    for _ in 0..3 {
        let norm = dense::max_norm(x);
        if norm == 0.0 {
            return 0.0;
        }
        x.iter_mut().for_each(|v| *v /= norm);
        y.clear();
        y.resize(n, 0.0);
        dense::multiply_add(g, x, y);
        x.fill(0.0);
        dense::multiply_add(k, y, x);
        value = dense::max_norm(x);
    }
    value
}
