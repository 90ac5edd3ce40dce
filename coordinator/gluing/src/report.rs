//! Report of a strategy on one step; the same for all strategies, so that they can be compared.

use terraglue_subsystem::{Figure, Overlay};

/// Height of the letters of an overlay, m.
const LETTERS_M: f64 = 0.02;

/// Figures of one step of one group. Reused from step to step: no allocation once the ports are known.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StepReport {
    /// Evaluations (`advance` or `solve_compatibility`) of the bodies.
    pub evaluations_bodies: u32,
    /// Evaluations of the soils.
    pub evaluations_soil: u32,
    /// Of these, evaluations spent in line searches.
    pub evaluations_line_search: u32,
    /// Of these, evaluations spent on finite differences.
    pub evaluations_jacobian: u32,
    /// Fresh interface Jacobians.
    pub jacobian_refreshes: u32,
    /// Communication steps that the nominal step was made of.
    pub parts: u32,
    /// Number of halvings of the step.
    pub halvings: u32,
    /// Whether the strategy reached its tolerance (a single pass always does).
    pub converged: bool,
    /// Whether what ran, in this step, was a single pass: it has no tolerance, and takes the motion of one side for that
    /// of the other, so that neither convergence nor the gap of a contact is meaningful.
    pub single_pass: bool,
    /// Whether joints were glued, whose gap is measured whatever the strategy.
    pub joints: bool,
    /// Whether the X-T form ran (else T-T, or a single pass).
    pub xt_form: bool,
    /// Largest |x1 − x2| along n over the ports that were closed after the commit before, m, with the surface under the
    /// body as the soil reports it, so it includes the effect of the lattice on a sliding foot.
    pub max_gap_m: f64,
    /// Largest difference of the wrench on the two sides along n, N.
    pub max_action_reaction_gap_n: f64,
    /// |Λe|∞ / T_ref at the end.
    pub residual: f64,
    /// Ratio of the last two residuals of a fixed point or Newton on forces; 0 where there were none.
    pub contraction: f64,
    /// max(|min(T, L·w)|) over unilateral ports at the end, N.
    pub complementarity_n: f64,
    /// Largest eigenvalue estimate of K·G1.
    pub kappa_max: f64,
    /// Largest |T* − T1| along n, N.
    pub estimate_gap_n: f64,
    /// |Work on side 1 + work on side 2| in the step, J, each by the wrench that acted there: on a body the wrench that it
    /// received, on a soil that of its own law at the motion committed. Energy stored by springs of the glue, and heat of its
    /// dampers and of friction between bodies, is subtracted. NaN where a soil keeps no energy ledger.
    pub interface_work_error_j: f64,
    /// Σ |T·x1| over the ports in the step, J: how much work went through them.
    pub port_work_path_j: f64,
    /// Energy that springs of the glue took up in the step, J.
    pub glue_stored_j: f64,
    /// Energy that dampers of the glue, and friction between glued bodies, turned into heat in the step, J.
    pub glue_heat_j: f64,
    /// Rank of Λ and its size, for the last Jacobian; 0 when none was formed.
    pub rank: (u32, u32),
    /// Condition of Λ by its pivots; 0 when none was formed.
    pub condition: f64,
    /// All ports of the step.
    pub ports: Vec<PortReport>,
}

impl StepReport {
    /// Whether [`StepReport::max_gap_m`] is the distance of the sides.
    pub fn has_gap(&self) -> bool {
        self.joints || !self.single_pass
    }

    /// The residual of every port that carries a force, in words where it lies: the gap x1 − x2 along n after commit, m. Empty
    /// where [`StepReport::has_gap`] is false.
    pub fn overlays(&self) -> Vec<Overlay> {
        let carries = |p: &&PortReport| p.wrench.iter().any(|w| *w != 0.0);
        let text = |p: &PortReport| Figure::Text {
            at: p.origin,
            height: LETTERS_M,
            text: format!("{:.1e} m", p.gap_m),
        };
        let overlay = |p: &PortReport| Overlay {
            layer: "residual".into(),
            frame: Overlay::WORLD,
            colour: [0.9, 0.9, 0.2, 1.0],
            figure: text(p),
        };
        let shown = self.ports.iter().filter(carries).filter(|_| self.has_gap());
        shown.map(overlay).collect()
    }
}

/// One port at the end of the step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PortReport {
    /// Stable key.
    pub key: u64,
    /// Index of the body's subsystem in the view.
    pub subsystem: u32,
    /// Index of the body in its scene.
    pub body: u32,
    /// Id of the shape.
    pub shape: u32,
    /// World origin, m.
    pub origin: [f64; 3],
    /// n, t1, t2 in the world.
    pub frame: [f64; 9],
    /// Committed wrench on the body: n, t1, t2, mn, mt1, mt2 (zero where not carried).
    pub wrench: [f64; 6],
    /// T*_n, N.
    pub t_star_n: f64,
    /// Signed gap x1 − x2 along n after commit, m; > 0 apart.
    pub gap_m: f64,
}

impl StepReport {
    /// Adds what another group, or a later part of the same step, did: counts and work add up, the worst of the other
    /// figures stays. Ports are appended.
    pub fn add(&mut self, other: &Self) {
        self.add_cost(other);
        self.halvings = self.halvings.max(other.halvings);
        self.converged &= other.converged;
        self.single_pass |= other.single_pass;
        self.joints |= other.joints;
        self.xt_form |= other.xt_form;
        self.max_gap_m = self.max_gap_m.max(other.max_gap_m);
        self.max_action_reaction_gap_n = self.max_action_reaction_gap_n.max(other.max_action_reaction_gap_n);
        self.residual = self.residual.max(other.residual);
        self.contraction = self.contraction.max(other.contraction);
        self.complementarity_n = self.complementarity_n.max(other.complementarity_n);
        self.kappa_max = self.kappa_max.max(other.kappa_max);
        self.estimate_gap_n = self.estimate_gap_n.max(other.estimate_gap_n);
        self.interface_work_error_j += other.interface_work_error_j;
        self.port_work_path_j += other.port_work_path_j;
        self.glue_stored_j += other.glue_stored_j;
        self.glue_heat_j += other.glue_heat_j;
        let missing = |rank: (u32, u32)| rank.1 - rank.0.min(rank.1);
        let weaker = self.rank.1 == 0 || missing(other.rank) > missing(self.rank);
        if other.rank.1 > 0 && weaker {
            self.rank = other.rank;
        }
        self.condition = self.condition.max(other.condition);
        self.ports.extend_from_slice(&other.ports);
    }

    /// Adds what another part cost and nothing else: of a part that did not converge and is repeated in halves.
    pub fn add_cost(&mut self, other: &Self) {
        self.evaluations_bodies += other.evaluations_bodies;
        self.evaluations_soil += other.evaluations_soil;
        self.evaluations_line_search += other.evaluations_line_search;
        self.evaluations_jacobian += other.evaluations_jacobian;
        self.jacobian_refreshes += other.jacobian_refreshes;
    }

    /// A trial of side 2 that was counted as an evaluation served a difference.
    pub(super) fn count_soil_difference(&mut self) {
        self.evaluations_soil -= 1;
        self.evaluations_jacobian += 1;
    }

    /// Back to zero; the storage for ports stays.
    pub fn clear(&mut self) {
        let mut ports = std::mem::take(&mut self.ports);
        ports.clear();
        *self = Self { ports, ..Self::default() };
    }
}
