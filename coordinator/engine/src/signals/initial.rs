//! Values that are connected at the start: passed on in the order in which they depend on each other, loops of numbers by Newton.
//!
//! FMUs answer with outputs that depend on inputs of the same time while they initialise. A chain is settled by
//! passing values on until nothing changes. Values that still change form a loop: r(u) = y(u) − u = 0 over all connected
//! inputs, Newton with the Jacobian by directional derivatives where all subsystems of a column know them, else by
//! differences. Values have different units, so each counts relative to what balances the Jacobian (Osborne, "On pre-conditioning of matrices", 1960).

use super::connection::{Link, derivatives};
use super::discrete::Discrete;
use crate::graph::{components, in_loops};
use terraglue_diagnostics::{Error, Result};
use terraglue_host::Instance;
use terraglue_numerics::dense::Lu;
use terraglue_numerics::extremes::larger;

/// Iterations of Newton before a loop counts as without a solution.
const ITERATIONS: u32 = 50;
/// Relative size of a residual at which it counts as solved.
const SOLVED: f64 = 1e-12;
/// A loop whose smallest pivot is below this share of the largest has no solution of its own.
const SINGULAR: f64 = 1e-9;
/// Relative step of a difference.
const DIFFERENCE: f64 = 1e-7;
/// Passes over a matrix that balance it.
const SWEEPS: u32 = 10;

/// Settles all connected start values.
///
/// # Errors
/// A loop without a solution, with its members and the residual that was left.
pub fn initialize(links: &mut [Link], instances: &mut [Instance]) -> Result {
    let mut u = read(links, instances)?;
    let start = u.clone();
    for _ in 0..=u.len() {
        write(links, instances, &u)?;
        let y = read(links, instances)?;
        if y.iter().zip(&u).all(|(y, u)| (y - u).abs() <= SOLVED * y.abs()) {
            return write(links, instances, &y);
        }
        if y.iter().any(|x| !x.is_finite() || x.abs() > 1e100) {
            break;
        }
        u = y;
    }
    // A diverged iterate is no start for Newton. Derivatives that are wrong lead nowhere: differences may.
    match newton(links, instances, start.clone(), true) {
        Err(Error::Simulation { .. }) => newton(links, instances, start, false),
        solved => solved,
    }
}

/// Passes all discrete values on once, and answers which are others than before. A value that cannot be read yet, as its `map` has no entry
/// for it, is left to the first step.
///
/// # Errors
/// A value that a subsystem refuses.
pub fn initialize_discrete(links: &mut [Discrete], instances: &mut [Instance]) -> Result<Vec<usize>> {
    let read = links.iter_mut().enumerate();
    let new = read.filter_map(|(k, link)| link.read_anew(instances).unwrap_or(false).then_some(k));
    let new: Vec<usize> = new.collect();
    new.iter().try_for_each(|k| links[*k].pass_on(instances))?;
    Ok(new)
}

/// `known`: with the derivatives that subsystems provide.
fn newton(links: &mut [Link], instances: &mut [Instance], mut u: Vec<f64>, known: bool) -> Result {
    let mut residual = residual_at(links, instances, &u)?;
    let (first, mut units) = (residual.clone(), vec![1.0; u.len()]);
    let near = |residual: &[f64], u: &[f64], units: &[f64], share: f64| {
        size(residual, units) <= share * size(u, units).max(size(&first, units))
    };
    for _ in 0..ITERATIONS {
        let jacobian = differences(links, instances, &u, &residual, known)?;
        units = balanced(&jacobian);
        if near(&residual, &u, &units, SOLVED) {
            return write(links, instances, &u);
        }
        let Some(step) = solve(&jacobian, &residual, &units) else { break };
        let mut share = 1.0;
        let (mut best, there) = (None, size(&residual, &units));
        // The full step, halved while it makes things worse.
        for _ in 0..20 {
            let new: Vec<f64> = u.iter().zip(&step).map(|(u, d)| u - share * d).collect();
            let r = residual_at(links, instances, &new)?;
            if size(&r, &units) < there || near(&r, &new, &units, SOLVED) {
                best = Some((new, r));
                break;
            }
            share *= 0.5;
        }
        let Some((new, r)) = best else { break };
        (u, residual) = (new, r);
    }
    if near(&residual, &u, &units, 1e-10) {
        return write(links, instances, &u);
    }
    Err(unsolved(links, instances, &u, &residual)?)
}

fn residual_at(links: &mut [Link], instances: &mut [Instance], u: &[f64]) -> Result<Vec<f64>> {
    write(links, instances, u)?;
    Ok(read(links, instances)?.iter().zip(u).map(|(y, u)| y - u).collect())
}

/// dr/du, column by column.
fn differences(
    links: &mut [Link],
    instances: &mut [Instance],
    u: &[f64],
    residual: &[f64],
    by_derivatives: bool,
) -> Result<Vec<Vec<f64>>> {
    let mut columns = Vec::with_capacity(u.len());
    let mut at = u.to_vec();
    let places: Vec<[usize; 2]> =
        links.iter().enumerate().flat_map(|(l, link)| (0..link.count()).map(move |e| [l, e])).collect();
    for (k, [l, e]) in places.into_iter().enumerate() {
        if by_derivatives && let Some(mut column) = known(links, instances, l, e)? {
            column[k] -= 1.0;
            columns.push(column);
            continue;
        }
        let delta = DIFFERENCE * u[k].abs().max(1.0);
        at[k] = u[k] + delta;
        let exact = at[k] - u[k];
        let r = residual_at(links, instances, &at)?;
        columns.push(r.iter().zip(residual).map(|(new, old)| (new - old) / exact).collect());
        at[k] = u[k];
        write(links, instances, u)?;
    }
    Ok(columns)
}

/// dy/du of entry `e` of link `l`, where it is known without trying.
fn known(links: &[Link], instances: &[Instance], l: usize, e: usize) -> Result<Option<Vec<f64>>> {
    let mut column = vec![0.0; links.iter().map(Link::count).sum()];
    Ok(derivatives(links.iter(), instances, (&links[l], e), &mut column)?.then_some(column))
}

/// The step of Newton; none where the Jacobian is singular.
fn solve(columns: &[Vec<f64>], right: &[f64], units: &[f64]) -> Option<Vec<f64>> {
    let (n, mut lu) = (right.len(), Lu::default());
    let mut x: Vec<f64> = right.iter().zip(units).map(|(r, unit)| r / unit).collect();
    let full = lu.factor(n, |r, c| columns[c][r] * units[c] / units[r]) == n && lu.weakest() >= SINGULAR;
    full.then(|| {
        lu.solve(&mut x);
        x.iter_mut().zip(units).for_each(|(x, unit)| *x *= unit);
        x
    })
}

/// Units in which rows and columns of a matrix are about as large as each other.
fn balanced(columns: &[Vec<f64>]) -> Vec<f64> {
    let n = columns.len();
    let mut units = vec![1.0; n];
    for _ in 0..SWEEPS {
        for k in 0..n {
            let others = || (0..n).filter(|i| *i != k);
            let column: f64 = others().map(|i| columns[k][i].abs() * units[k] / units[i]).sum();
            let row: f64 = others().map(|i| columns[i][k].abs() * units[i] / units[k]).sum();
            let by = (row / column).sqrt();
            if by.is_finite() && by > 0.0 {
                units[k] *= by;
            }
        }
    }
    units
}

#[cold]
fn unsolved(links: &mut [Link], instances: &mut [Instance], u: &[f64], residual: &[f64]) -> Result<Error> {
    let matrix = differences(links, instances, u, residual, false)?;
    // An input is in a loop where its own value comes back to it over other inputs.
    let n = u.len();
    let feeds = |from: usize, to: usize| (matrix[from][to] + f64::from(u8::from(from == to))).abs() > 1e-9;
    let pairs = (0..n).flat_map(|from| (0..n).map(move |to| [from, to]));
    let edges: Vec<[usize; 2]> = pairs.filter(|[from, to]| feeds(*from, *to)).collect();
    let numeric = in_loops(&components(n, &edges), &edges);
    let in_loop = if numeric.contains(&true) { numeric } else { around(links, instances.len(), residual, u) };
    let names: Vec<String> = links.iter().flat_map(|l| l.names(instances)).collect();
    let connections: Vec<&str> =
        names.iter().zip(&in_loop).filter(|(_, own)| **own).map(|(name, _)| name.as_str()).collect();
    let left = residual.iter().fold(0.0, |m, x| larger(m, x.abs()));
    let message = format!(
        "the loop of connections {} has no solution at the start; the values miss each other by {left:.3e}. Ways out: start values of these FMUs \
         nearer to a solution, or one connection less",
        connections.join(", ")
    );
    Ok(Error::Simulation { time_s: 0.0, message })
}

/// Values of the loops of subsystems in which values miss each other, where derivatives show no loop.
fn around(links: &[Link], count: usize, residual: &[f64], u: &[f64]) -> Vec<bool> {
    let edges: Vec<[usize; 2]> = links.iter().map(Link::slots).collect();
    let component = components(count, &edges);
    let slots: Vec<[usize; 2]> = links.iter().flat_map(|l| (0..l.count()).map(|_| l.slots())).collect();
    let misses = |k: usize| residual[k].is_nan() || residual[k].abs() > 1e-10 * u[k].abs().max(1e-10);
    let circle = |[from, to]: [usize; 2]| component[from] == component[to];
    let open = |k: usize| misses(k) && circle(slots[k]);
    let bad: Vec<usize> = (0..slots.len()).filter(|k| open(*k)).map(|k| component[slots[k][1]]).collect();
    let own = |k: usize| {
        if bad.is_empty() { misses(k) } else { circle(slots[k]) && bad.contains(&component[slots[k][1]]) }
    };
    (0..slots.len()).map(own).collect()
}

fn read(links: &mut [Link], instances: &mut [Instance]) -> Result<Vec<f64>> {
    let mut all = Vec::new();
    for link in links {
        all.extend_from_slice(link.read(instances)?);
    }
    Ok(all)
}

fn write(links: &mut [Link], instances: &mut [Instance], mut values: &[f64]) -> Result {
    for link in links {
        let (own, rest) = values.split_at(link.count());
        link.write(instances, own)?;
        values = rest;
    }
    Ok(())
}

/// The largest of some values, each in its unit; infinite where one is no number.
fn size(values: &[f64], units: &[f64]) -> f64 {
    let sizes = values.iter().zip(units).map(|(x, unit)| (x / unit).abs());
    sizes.fold(0.0, |m, x| if x.is_nan() { f64::INFINITY } else { f64::max(m, x) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn loops_of_mixed_units_are_balanced_and_solved() {
        // a = 1 − 5e4 b, b = 1e-5 (1 + a) and the same in other units
        for unit in [1.0, 1e-5, 1e-9, 1e7] {
            let columns = [vec![-1.0, 1e-5 * unit], vec![-5e4 / unit, -1.0]];
            let units = balanced(&columns);
            let [a, b] = [0, 1].map(|c| columns[c][1 - c].abs() * units[c] / units[1 - c]);
            assert!((a / b - 1.0).abs() < 1e-12, "{a} {b}");
            let x = solve(&columns, &[-1.0, -1e-5 * unit], &units).expect("regular");
            assert!((x[0] - 1.0 / 3.0).abs() < 1e-12 && (x[1] / unit - 4e-5 / 3.0).abs() < 1e-16, "{x:?}");
        }
        // what feeds nothing keeps its unit
        assert_eq!(balanced(&[vec![-1.0, 0.0], vec![3.0, -1.0]]), [1.0, 1.0]);
    }
}
