//! Runs against a reference: the error of the reported body, and the order at which it falls with the step.

use crate::{CompareRow, Orders};
use std::path::Path;
use terraglue_diagnostics::error::{Error, Result};
use terraglue_recording::Summary;
use terraglue_recording::at;
use terraglue_recording::{PoseSeries, Recording};

/// Fills in the error of every row that simulates the same as `like` (of all rows where that is none) against a recording.
///
/// # Errors
/// The recording cannot be read.
pub fn judge(rows: &mut [CompareRow], like: Option<&CompareRow>, folder: &Path) -> Result {
    let reference = open(folder)?;
    let Some((_, truth)) = reference.reported_body() else { return Ok(()) };
    for row in rows.iter_mut().filter(|r| like.is_none_or(|l| l.is_like(r)) && !r.is_reference) {
        let Some(own) = row.folder.as_deref().and_then(|f| Recording::open(f).ok()) else { continue };
        let Some((_, poses)) = own.reported_body() else { continue };
        // a run that ended early was not far off for long: its error would look better than it is
        row.reference_error_m = largest_distance(poses, truth).filter(|_| row.error.is_none());
    }
    orders(rows);
    let truth = if folder.is_dir() { Summary::read(folder).ok() } else { None };
    if let Some(truth) = truth {
        figure_orders(rows, like, &truth);
    }
    Ok(())
}

/// Orders of the figures of whole runs, where the reference has them too.
fn figure_orders(rows: &mut [CompareRow], like: Option<&CompareRow>, truth: &Summary) {
    type Figure = fn(&Summary) -> Option<f64>;
    type Place = fn(&mut Orders) -> &mut Option<f64>;
    let all: [(Figure, Place); 3] = [
        (|s| s.mean_sinkage_m, |o| &mut o.sinkage),
        (|s| s.energy.energies.soil_heat_j, |o| &mut o.heat),
        (|s| s.motion.path_m, |o| &mut o.path),
    ];
    for (figure, place) in all {
        let Some(known) = figure(truth) else { continue };
        let error = |r: &CompareRow| {
            let whole = r.failure().is_none() && !r.is_reference && like.is_none_or(|l| l.is_like(r));
            let own = r.summary.as_ref().filter(|_| whole).and_then(figure)?;
            // what agrees to rounding and the tolerance of the iterations has no order
            Some((own - known).abs()).filter(|e| *e > 1e-9 * known.abs().max(1e-3))
        };
        let orders = orders_of(rows, error);
        for (row, order) in rows.iter_mut().zip(orders) {
            if order.is_some() {
                *place(&mut row.orders) = order;
            }
        }
    }
}

/// The recording of a results folder, or a recording as a file.
pub(crate) fn open(path: &Path) -> Result<Recording> {
    if path.is_dir() {
        return Recording::open(path);
    }
    let bytes = terraglue_subsystem::files::read(path).map_err(at(path))?;
    Recording::read(&bytes).ok_or_else(|| Error::File {
        path: path.display().to_string(),
        source: std::io::Error::new(std::io::ErrorKind::InvalidData, "is not an MCAP recording"),
    })
}

/// Largest distance of two bodies over the times that both know, m; the reference is read between its records.
fn largest_distance(own: &PoseSeries, truth: &PoseSeries) -> Option<f64> {
    let (first, last) = (truth.t_s.first()?, truth.t_s.last()?);
    let inside = |t: &f64| *t >= first - 1e-9 && *t <= last + 1e-9;
    let distance = |(t, p): (&f64, &[f64; 3])| {
        let after = truth.t_s.partition_point(|x| x < t).clamp(1, truth.t_s.len() - 1);
        let (a, b) = (truth.t_s[after - 1], truth.t_s[after]);
        let share = if b > a { ((t - a) / (b - a)).clamp(0.0, 1.0) } else { 0.0 };
        let (from, to) = (truth.position[after - 1], truth.position[after]);
        let square: f64 = (0..3).map(|k| p[k] - from[k] - share * (to[k] - from[k])).map(|d| d * d).sum();
        square.sqrt()
    };
    if truth.t_s.len() < 2 {
        return None;
    }
    own.t_s.iter().zip(&own.position).filter(|(t, _)| inside(t)).map(distance).reduce(f64::max)
}

/// Errors below this are rounding and the tolerance of the iterations, m; they have no order.
const NOISE_M: f64 = 1e-9;

/// Observed order of the place of the body.
fn orders(rows: &mut [CompareRow]) {
    let error = |r: &CompareRow| r.reference_error_m.filter(|e| r.error.is_none() && *e > NOISE_M);
    let orders = orders_of(rows, error);
    rows.iter_mut().zip(orders).for_each(|(row, order)| row.order = order);
}

/// Observed order of an error of each row against the row of the same strategy and thing with the next smaller step.
fn orders_of(rows: &[CompareRow], error: impl Fn(&CompareRow) -> Option<f64>) -> Vec<Option<f64>> {
    let order = |row: &CompareRow| {
        let own = error(row)?;
        let finer = |r: &&CompareRow| {
            r.strategy == row.strategy && r.is_like(row) && r.step_s < row.step_s * (1.0 - 1e-9)
        };
        let known = rows.iter().filter(finer).filter_map(|r| Some((r.step_s, error(r)?)));
        let (h, e) = known.max_by(|a, b| a.0.total_cmp(&b.0))?;
        Some((own / e).ln() / (row.step_s / h).ln()).filter(|order| order.is_finite())
    };
    rows.iter().map(order).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(t_s: &[f64], slope: f64) -> PoseSeries {
        PoseSeries {
            t_s: t_s.to_vec(),
            position: t_s.iter().map(|t| [slope * t, 0.0, 0.0]).collect(),
            orientation: Vec::new(),
        }
    }

    #[test]
    fn distances_are_read_between_the_records_of_the_reference() {
        let distance = largest_distance(&line(&[0.5, 1.0, 1.5, 9.0], 1.1), &line(&[0.0, 1.0, 2.0], 1.0));
        assert!((distance.expect("common times") - 0.15).abs() < 1e-12);
        assert_eq!(largest_distance(&line(&[5.0], 1.0), &line(&[0.0, 1.0], 1.0)), None);
    }

    #[test]
    fn the_orders_of_whole_runs_are_those_of_their_figures() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios/plate_sinkage.toml");
        let scenario = terraglue_scenario::Scenario::load(path.as_ref(), &[]).expect("good");
        let blank = terraglue_recording::SummaryObserver::new(&scenario);
        let summary = |sinkage: f64, heat: Option<f64>| {
            let mut s = blank.summary(1.0, 1.0, None, terraglue_recording::Status::Done);
            (s.mean_sinkage_m, s.energy.energies.soil_heat_j, s.motion.path_m) =
                (Some(sinkage), heat, Some(1.0));
            s
        };
        let row = |step_s: f64, s: Summary| CompareRow { step_s, summary: Some(s), ..CompareRow::default() };
        let mut rows = [
            row(0.002, summary(0.012, Some(3.0 + 16e-3))),
            row(0.001, summary(0.011, Some(3.0 + 4e-3))),
            row(0.0005, summary(0.0105, None)),
        ];
        figure_orders(&mut rows, None, &summary(0.010, Some(3.0)));
        let near = |order: Option<f64>, expected: f64| (order.expect("known") - expected).abs() < 1e-6;
        assert!(near(rows[0].orders.sinkage, 1.0) && near(rows[1].orders.sinkage, 1.0));
        assert!(near(rows[0].orders.heat, 2.0));
        // Unknown heat of the finer run, and a path that has arrived.
        assert_eq!((rows[1].orders.heat, rows[0].orders.path), (None, None));
    }

    #[test]
    fn the_order_is_that_of_the_next_smaller_step() {
        let row = |step_s: f64, error: f64| CompareRow {
            strategy: "a".into(),
            step_s,
            reference_error_m: Some(error),
            ..CompareRow::default()
        };
        let mut rows = vec![row(0.004, 16.0), row(0.001, 1.0), row(0.002, 4.0)];
        orders(&mut rows);
        assert!((rows[0].order.expect("finer") - 2.0).abs() < 1e-12);
        assert_eq!(rows[1].order, None);
    }
}
