//! A derivative that a module gives against one-sided differences of its answers.

use super::finding::{Stop, Verdict};
use terraglue_subsystem::Port;

/// Names of the components of a port.
const NAMES: [&str; 6] = ["n", "t1", "t2", "mn", "mt1", "mt2"];

/// The given derivative and the range of the differences, entry by entry.
pub struct Columns {
    n: usize,
    given: Vec<f64>,
    forward: Vec<f64>,
    backward: Vec<f64>,
    rows: Vec<bool>,
}

impl Columns {
    /// Differences of `answer` around `at`, each component moved by `delta` both ways, and by a thousandth of it: a
    /// corner may lie between the two.
    ///
    /// # Errors
    /// The module failed.
    pub fn of(
        given: &[f64],
        mut answer: impl FnMut(&[f64]) -> Verdict<Vec<f64>>,
        at: &[f64],
        delta: f64,
    ) -> Verdict<Self> {
        let n = at.len();
        let middle = answer(at)?;
        let (mut forward, mut backward) = (vec![0.0; n * n], vec![0.0; n * n]);
        for j in 0..n {
            let column = j * n..(j + 1) * n;
            let (high, low) = (&mut forward[column.clone()], &mut backward[column]);
            high.fill(f64::NEG_INFINITY);
            low.fill(f64::INFINITY);
            for step in [delta, -delta, 1e-3 * delta, -1e-3 * delta] {
                let mut moved = at.to_vec();
                moved[j] += step;
                // The increment after rounding.
                let step = moved[j] - at[j];
                let there = answer(&moved)?;
                for i in 0..n {
                    let slope = (there[i] - middle[i]) / step;
                    (high[i], low[i]) = (high[i].max(slope), low[i].min(slope));
                }
            }
        }
        Ok(Self { n, given: given.to_vec(), forward, backward, rows: vec![true; n] })
    }

    /// Only these components, as rows and as columns.
    pub fn only(mut self, components: &[usize]) -> Self {
        self.rows = (0..self.n).map(|i| components.contains(&i)).collect();
        self
    }
}

/// Compares: at a kink the two differences disagree, and anything between them is right.
///
/// # Errors
/// The worst entry, by the names of its components.
pub fn compare(ports: &[Port], columns: &Columns, after: &str, t: f64) -> Verdict {
    const TOLERANCE: f64 = 2e-3;
    let Columns { n, given, forward, backward, rows } = columns;
    // Forces and moments have different units: an entry is small against the diagonal entries of its row and column.
    let diagonal = |i: usize| forward[i * n + i].abs().max(backward[i * n + i].abs());
    let largest = (0..*n).map(diagonal).fold(0.0, f64::max);
    let size = |i: usize| diagonal(i).max(1e-4 * largest);
    let mut worst: Option<(f64, usize, usize)> = None;
    for (i, j) in (0..*n).flat_map(|i| (0..*n).map(move |j| (i, j))).filter(|(i, j)| rows[*i] && rows[*j]) {
        let k = j * n + i;
        let (low, high) = (forward[k].min(backward[k]), forward[k].max(backward[k]));
        let share = if i == j { TOLERANCE } else { 5.0 * TOLERANCE };
        let room = share * (size(i) * size(j)).sqrt() + 0.1 * (high - low);
        let beyond = (low - given[k]).max(given[k] - high).max(0.0) / room.max(f64::MIN_POSITIVE);
        if beyond > worst.map_or(1.0, |(b, ..)| b) {
            worst = Some((beyond, i, j));
        }
    }
    let Some((_, i, j)) = worst else { return Ok(()) };
    let k = j * n + i;
    let name = |at: usize| {
        let found = ports.iter().enumerate().find(|(_, p)| p.range().contains(&at));
        found.map_or(format!("component {at}"), |(number, port)| {
            let c = port.components().find(|(place, _)| *place == at).map_or("?", |(_, c)| NAMES[c]);
            format!("{c} of port {number}")
        })
    };
    let entry = format!("the entry of {} to {} after a {after} at t = {t:.3} s", name(i), name(j));
    let expected = match (forward[k], backward[k]) {
        (f, b) if (f - b).abs() <= 1e-3 * (f.abs() + b.abs()) => {
            format!("{:.6e}, by differences", 0.5 * (f + b))
        }
        (f, b) => format!("between {b:.6e} and {f:.6e}, by one-sided differences"),
    };
    Err(Stop::fail("interface_jacobian", entry, format!("{:.6e}", given[k]), expected))
}
