//! The figures that are compared, each with the direction in which it is better.

use crate::CompareRow;
use terraglue_recording::Energies;
use terraglue_recording::Summary;
use terraglue_recording::report::html::{number, with_prefix, without_rounding};

/// Ways, which rounding makes longer than 0.
const WAYS: [&str; 2] = ["distance_m", "path_m"];

/// Which end of a column is the best.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Best {
    /// Errors and costs.
    Smallest,
    /// Progress.
    Largest,
    /// Nothing to be judged.
    Neither,
}

/// One figure.
pub(crate) struct FigureColumn {
    /// Name in the files.
    pub key: &'static str,
    /// Head over neighbouring columns; empty: none.
    pub group: &'static str,
    /// Head for people.
    pub title: &'static str,
    /// SI unit; empty for a pure number.
    pub unit: &'static str,
    pub best: Best,
    pub value: fn(&CompareRow) -> Option<f64>,
}

impl FigureColumn {
    /// Group and title in one line.
    pub fn name(&self) -> String {
        if self.group.is_empty() { self.title.into() } else { format!("{}, {}", self.group, self.title) }
    }
}

impl FigureColumn {
    /// Text of the cell of a row: the figure, that it is unknown or does not apply, or a dash.
    pub fn text(&self, row: &CompareRow) -> String {
        let value = (self.value)(row);
        let value = if WAYS.contains(&self.key) { value.map(without_rounding) } else { value };
        let Some(summary) = row.summary.as_ref().filter(|_| value.is_none()) else {
            return cell(value, self.unit);
        };
        match self.key {
            "max_gap_m" | "steps_not_converged" | "max_action_reaction_gap_n" => "not applicable".into(),
            "energy_balance_j" | "energy_drift_share" | "soil_heat_j" | "interface_work_error_j"
                if summary.energy.energies.drift_j.is_none() =>
            {
                "unknown".into()
            }
            _ => cell(None, self.unit),
        }
    }

    /// Whether any row has a value.
    pub fn is_shown(&self, rows: &[CompareRow]) -> bool {
        rows.iter().any(|row| self.text(row) != cell(None, self.unit))
    }
}

/// A figure with its unit in a suitable SI prefix.
pub(crate) fn cell(value: Option<f64>, unit: &str) -> String {
    match value {
        None => "–".into(),
        Some(v) if unit.is_empty() && v == v.trunc() && v.abs() < 1e6 => format!("{v}"),
        Some(v) if unit.is_empty() => number(v, 3),
        Some(v) => {
            let (text, unit) = with_prefix(v, unit, 3);
            format!("{text}\u{a0}{unit}")
        }
    }
}

fn of(row: &CompareRow, f: impl Fn(&Summary) -> f64) -> Option<f64> {
    row.summary.as_ref().map(f).filter(|v| v.is_finite())
}

fn energies(row: &CompareRow) -> Option<&Energies> {
    row.summary.as_ref().map(|s| &s.energy.energies)
}

/// Whether the strategy formed Λ.
fn formed(row: &CompareRow) -> bool {
    row.summary.as_ref().is_some_and(|s| s.gluing.condition_max > 0.0)
}

/// Whether it asks when to stop.
fn iterated(row: &CompareRow) -> bool {
    row.summary.as_ref().is_some_and(|s| s.gluing.form != "single pass")
}

macro_rules! column {
    ($key:literal, $group:literal, $title:literal, $unit:literal, $best:ident, $value:expr) => {
        FigureColumn {
            key: $key,
            group: $group,
            title: $title,
            unit: $unit,
            best: Best::$best,
            value: $value,
        }
    };
}

/// All figures in the order of the table.
pub(crate) const ALL: &[FigureColumn] = &[
    column!("step_s", "", "step", "s", Neither, |r| Some(r.step_s)),
    column!("reference_error_m", "", "error against the reference", "m", Smallest, |r| r.reference_error_m),
    column!("order", "", "observed order", "", Neither, |r| r.order),
    column!("order_sinkage", "observed order of", "mean sinkage", "", Neither, |r| r.orders.sinkage),
    column!("order_heat", "observed order of", "heat of the soil", "", Neither, |r| r.orders.heat),
    column!("order_path", "observed order of", "path", "", Neither, |r| r.orders.path),
    column!("evaluations_mean", "evaluations of bodies", "mean", "", Smallest, |r| of(r, |s| s
        .gluing
        .evaluations_mean)),
    column!("evaluations_p95", "evaluations of bodies", "95 %", "", Smallest, |r| {
        of(r, |s| f64::from(s.gluing.evaluations_p95))
    }),
    column!("evaluations_max", "evaluations of bodies", "max", "", Smallest, |r| {
        of(r, |s| f64::from(s.gluing.evaluations_max))
    }),
    column!("evaluations_soil_mean", "evaluations of soil or side 2", "mean", "", Smallest, |r| {
        of(r, |s| s.gluing.evaluations_soil_mean)
    }),
    column!(
        "cold_start_mean",
        "evaluations of soil or side 2",
        "mean without the estimate",
        "",
        Neither,
        |r| r.cold_start_mean
    ),
    column!("evaluations_soil_p95", "evaluations of soil or side 2", "95 %", "", Smallest, |r| {
        of(r, |s| f64::from(s.gluing.evaluations_soil_p95))
    }),
    column!("evaluations_soil_max", "evaluations of soil or side 2", "max", "", Smallest, |r| {
        of(r, |s| f64::from(s.gluing.evaluations_soil_max))
    }),
    column!("evaluations_jacobian_mean", "", "evaluations for differences", "", Smallest, |r| {
        of(r, |s| s.gluing.evaluations_jacobian_mean)
    }),
    column!("jacobian_refreshes_mean", "", "Jacobians per step", "", Smallest, |r| {
        of(r, |s| s.gluing.jacobian_refreshes_mean)
    }),
    column!("kappa_max", "", "largest κ", "", Neither, |r| of(r, |s| s.gluing.kappa_max)
        .filter(|k| *k > 0.0)),
    column!("rank_missing_max", "Λ", "short of full rank by", "", Neither, |r| {
        of(r, |s| f64::from(s.gluing.rank_missing_max)).filter(|_| formed(r))
    }),
    column!("condition_max", "Λ", "largest condition", "", Neither, |r| {
        of(r, |s| s.gluing.condition_max).filter(|_| formed(r))
    }),
    column!("max_residual", "", "largest |Λ·e|/T_ref", "", Smallest, |r| {
        of(r, |s| s.gluing.max_residual).filter(|_| iterated(r))
    }),
    column!("max_complementarity_n", "", "complementarity residual", "N", Smallest, |r| {
        of(r, |s| s.gluing.max_complementarity_n).filter(|_| formed(r))
    }),
    column!("steps_halved", "", "steps halved", "", Smallest, |r| of(r, |s| s.gluing.steps_halved as f64)),
    column!("steps_not_converged", "", "steps not converged", "", Smallest, |r| {
        r.summary.as_ref()?.gluing.steps_not_converged.map(|n| n as f64)
    }),
    column!("max_gap_m", "", "largest gap", "m", Smallest, |r| r.summary.as_ref()?.gluing.max_gap_m),
    column!("max_action_reaction_gap_n", "", "action–reaction gap", "N", Smallest, |r| {
        r.summary.as_ref()?.gluing.max_action_reaction_gap_n
    }),
    column!("max_estimate_gap_n", "", "largest |T* − T1|", "N", Neither, |r| of(r, |s| s
        .gluing
        .max_estimate_gap_n)),
    column!("max_sinkage_m", "", "deepest print", "m", Neither, |r| r.summary.as_ref()?.max_sinkage_m),
    column!("print_depth_m", "", "median print", "m", Neither, |r| {
        Some(r.summary.as_ref()?.print_depth?.median_m)
    }),
    column!("distance_m", "", "distance", "m", Largest, |r| r.summary.as_ref()?.motion.distance_m),
    column!("mean_sinkage_m", "", "mean sinkage", "m", Neither, |r| r.summary.as_ref()?.mean_sinkage_m),
    column!("path_m", "", "path", "m", Neither, |r| r.summary.as_ref()?.motion.path_m),
    column!("soil_heat_j", "", "heat of the soil", "J", Neither, |r| energies(r)?.soil_heat_j),
    column!("energy_balance_j", "", "drift of the energy ledger", "J", Neither, |r| energies(r)?.drift_j),
    column!("energy_drift_share", "", "drift over the motors' work", "", Neither, |r| {
        energies(r)?.drift_share()
    }),
    column!("interface_work_error_j", "", "interface work error", "J", Smallest, |r| {
        r.summary.as_ref()?.gluing.interface_work_error_j
    }),
    column!("exchange_per_step_s", "wall time per step", "exchange", "s", Smallest, |r| r
        .parts_s
        .map(|p| p[0])),
    column!("jacobian_per_step_s", "wall time per step", "Jacobians", "s", Smallest, |r| r
        .parts_s
        .map(|p| p[1])),
    column!("rest_per_step_s", "wall time per step", "all else", "s", Smallest, |r| r.parts_s.map(|p| p[2])),
    column!("cpu_per_step_s", "", "CPU time per step", "s", Smallest, |r| of(r, |s| s.cpu_per_step_s)),
];

/// For every row whether it holds the best figure of a column. Runs that did not reach their end do not
/// compete; where all are equal, none is marked.
pub(crate) fn best(column: &FigureColumn, rows: &[CompareRow]) -> Vec<bool> {
    let values: Vec<Option<f64>> =
        rows.iter().map(|r| r.failure().is_none().then(|| (column.value)(r)).flatten()).collect();
    let known = || values.iter().flatten().copied();
    let (low, high) = (known().fold(f64::INFINITY, f64::min), known().fold(f64::NEG_INFINITY, f64::max));
    if low >= high {
        return vec![false; rows.len()];
    }
    let wanted = match column.best {
        Best::Smallest => Some(low),
        Best::Largest => Some(high),
        Best::Neither => None,
    };
    values.iter().map(|v| wanted.is_some() && *v == wanted).collect()
}
