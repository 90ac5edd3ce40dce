//! Whether a law can be evaluated everywhere in the range of its names, by interval arithmetic.
//!
//! The box of all ranges is halved along the widest variable until every part is proved sound or a part is small
//! and still holds a division by zero, a root or power of a negative number, a logarithm of zero or a pole.

use super::error::ExpressionError;
use super::parse::{Binary, Function, Item, Tree};
use super::symbol::{Role, Symbol};

/// All values from the first to the second.
type Interval = [f64; 2];

/// Halvings until a part that is not proved counts as unsound.
const DEEPEST: u32 = 14;

/// Proves that every operation is defined and finite over the whole range, or names the first that is not.
pub fn check(tree: &Tree, symbols: &[Symbol]) -> Result<(), Box<ExpressionError>> {
    let mut ranges: Vec<Interval> = symbols.iter().map(|s| s.range).collect();
    prove(tree, symbols, &mut ranges, 0)
}

fn prove(
    tree: &Tree,
    symbols: &[Symbol],
    ranges: &mut [Interval],
    depth: u32,
) -> Result<(), Box<ExpressionError>> {
    let Err((k, reason)) = evaluate(tree, ranges) else { return Ok(()) };
    let width = |s: usize| {
        let whole = symbols[s].range[1] - symbols[s].range[0];
        if whole > 0.0 { (ranges[s][1] - ranges[s][0]) / whole } else { 0.0 }
    };
    let splits = (0..ranges.len()).filter(|s| symbols[*s].role != Role::Parameter && tree.uses(*s));
    let widest = splits.max_by(|a, b| width(*a).total_cmp(&width(*b)));
    let Some(s) = widest.filter(|s| depth < DEEPEST && width(*s) > 0.0) else {
        return Err(complain(tree, symbols, ranges, k, &reason));
    };
    let [low, high] = ranges[s];
    let middle = 0.5 * (low + high);
    for half in [[low, middle], [middle, high]] {
        ranges[s] = half;
        prove(tree, symbols, ranges, depth + 1)?;
    }
    ranges[s] = [low, high];
    Ok(())
}

fn complain(
    tree: &Tree,
    symbols: &[Symbol],
    ranges: &[Interval],
    k: usize,
    reason: &str,
) -> Box<ExpressionError> {
    let used = symbols.iter().zip(ranges).enumerate().filter(|(s, _)| tree.uses(*s));
    let place: Vec<String> = used
        .map(|(_, (symbol, [low, high]))| match low == high {
            true => format!("{} = {low}", symbol.name),
            false => format!("{} in {low:.6} … {high:.6}", symbol.name),
        })
        .collect();
    let message = format!("`{}`: {reason}, with {}", tree.part(k), place.join(", "));
    tree.error(k, message).help("keep it defined with max(…, small) or a narrower range")
}

/// The range of every node, or the first that is not defined with the reason.
fn evaluate(tree: &Tree, ranges: &[Interval]) -> Result<(), (usize, String)> {
    let mut out: Vec<Interval> = Vec::with_capacity(tree.items.len());
    for (k, (item, _)) in tree.items.iter().enumerate() {
        let value = match *item {
            Item::Number(x) => Ok([x, x]),
            Item::Symbol(s) => Ok(ranges[s]),
            Item::Negate(a) => Ok([-out[a][1], -out[a][0]]),
            Item::Call(f, a) => function(f, out[a]),
            Item::Binary(o, a, b) => binary(o, out[a], out[b]),
        };
        let value = value.map_err(|reason| (k, reason))?;
        if !(value[0].is_finite() && value[1].is_finite()) {
            return Err((k, "the value may be infinite".into()));
        }
        out.push(value);
    }
    Ok(())
}

fn hull(values: &[f64]) -> Interval {
    values.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |r, v| [r[0].min(*v), r[1].max(*v)])
}

fn function(f: Function, [low, high]: Interval) -> Result<Interval, String> {
    let ends = || [f.value(low), f.value(high)];
    match f {
        Function::Ln if low <= 0.0 => Err(format!("logarithm of a number that may be {low}")),
        Function::Sqrt if low < 0.0 => Err(format!("square root of a number that may be {low}")),
        Function::Abs if low < 0.0 && high > 0.0 => Ok([0.0, high.max(-low)]),
        Function::Abs => Ok(hull(&ends())),
        Function::Sin | Function::Cos => {
            // turning points at multiples of π (cos) or half a turn later (sin)
            let phase = if f == Function::Sin { 0.5 } else { 0.0 };
            let turn = |x: f64| (x / std::f64::consts::PI - phase).floor();
            if turn(low) == turn(high) { Ok(hull(&ends())) } else { Ok([-1.0, 1.0]) }
        }
        Function::Tan => {
            let branch = |x: f64| (x / std::f64::consts::PI - 0.5).floor();
            if branch(low) == branch(high) { Ok(ends()) } else { Err("the tangent has a pole there".into()) }
        }
        _ => Ok(ends()),
    }
}

fn binary(o: Binary, a: Interval, b: Interval) -> Result<Interval, String> {
    let corners = || [(a[0], b[0]), (a[0], b[1]), (a[1], b[0]), (a[1], b[1])].map(|(a, b)| o.value(a, b));
    match o {
        Binary::Add => Ok([a[0] + b[0], a[1] + b[1]]),
        Binary::Sub => Ok([a[0] - b[1], a[1] - b[0]]),
        Binary::Mul | Binary::Min | Binary::Max => Ok(hull(&corners())),
        Binary::Div if b[0] <= 0.0 && b[1] >= 0.0 => Err("division by a number that may be zero".into()),
        Binary::Div => Ok(hull(&corners())),
        Binary::Pow => power(a, b, &corners()),
    }
}

fn power(a: Interval, b: Interval, corners: &[f64]) -> Result<Interval, String> {
    let whole = b[0] == b[1] && b[0].fract() == 0.0;
    if a[0] < 0.0 && !whole {
        return Err(format!("power of a number that may be {}", a[0]));
    }
    if b[0] < 0.0 && a[0] <= 0.0 && a[1] >= 0.0 {
        return Err("negative power of a number that may be zero".into());
    }
    let mut out = hull(corners);
    if a[0] < 0.0 && a[1] > 0.0 {
        out = hull(&[out[0], out[1], 0.0]);
    }
    Ok(out)
}
