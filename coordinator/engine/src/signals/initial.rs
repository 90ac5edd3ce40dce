//! Values that are connected at the start: passed on in the order in which they depend on each other, loops of numbers by Newton.
//!
//! FMUs answer with outputs that depend on inputs of the same time while they initialise. A chain is settled by
//! passing values on until nothing changes. Values that still change form a loop: r(u) = y(u) − u = 0 over all connected
//! inputs, Newton with the Jacobian by directional derivatives where all subsystems of a column know them, else by
//! differences.

use super::connection::{Link, derivatives};
use super::discrete::Discrete;
use crate::graph::{components, in_loops};
use terraglue_diagnostics::{Error, Result};
use terraglue_host::Instance;
use terraglue_numerics::dense::Lu;

/// Iterations of Newton before a loop counts as without a solution.
const ITERATIONS: u32 = 50;
/// Relative size of a residual at which it counts as solved.
const SOLVED: f64 = 1e-12;
/// A loop whose smallest pivot is below this share of the largest has no solution of its own.
const SINGULAR: f64 = 1e-9;
/// Relative step of a difference.
const DIFFERENCE: f64 = 1e-7;

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
        if largest(&y, &u) <= SOLVED * scale(&y) {
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
    for _ in 0..ITERATIONS {
        if size(&residual) <= SOLVED * scale(&u) {
            return write(links, instances, &u);
        }
        let jacobian = differences(links, instances, &u, &residual, known)?;
        let Some(step) = solve(&jacobian, &residual) else { break };
        let mut share = 1.0;
        let (mut best, there) = (None, size(&residual));
        // The full step, halved while it makes things worse.
        for _ in 0..20 {
            let new: Vec<f64> = u.iter().zip(&step).map(|(u, d)| u - share * d).collect();
            let r = residual_at(links, instances, &new)?;
            if size(&r) < there || size(&r) <= SOLVED * scale(&new) {
                best = Some((new, r));
                break;
            }
            share *= 0.5;
        }
        let Some((new, r)) = best else { break };
        (u, residual) = (new, r);
    }
    if size(&residual) <= 1e-10 * scale(&u) {
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
fn solve(columns: &[Vec<f64>], right: &[f64]) -> Option<Vec<f64>> {
    let (n, mut lu, mut x) = (right.len(), Lu::default(), right.to_vec());
    let full = lu.factor(n, |r, c| columns[c][r]) == n && lu.weakest() >= SINGULAR;
    full.then(|| {
        lu.solve(&mut x);
        x
    })
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
    let left = size(residual);
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
    let misses = |k: usize| residual[k].is_nan() || residual[k].abs() > 1e-10 * scale(u);
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

fn size(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |m, x| if x.is_nan() { f64::INFINITY } else { f64::max(m, x.abs()) })
}

fn scale(values: &[f64]) -> f64 {
    size(values).max(1.0)
}

fn largest(a: &[f64], b: &[f64]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, |m, x| if x.is_nan() { f64::INFINITY } else { m.max(x) })
}
