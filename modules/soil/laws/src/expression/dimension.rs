//! Dimensions of a law: whether sums add like to like and the result is a pressure.
//!
//! Exponents may depend on parameters: k_φ of Bekker's law has the unit N/m^(n+2), so k_φ·zⁿ is a pressure for
//! every n. They are therefore checked at several values of the pure parameters, those of the scenario and some
//! inside their ranges: an identity that holds at all of them is taken for one.

use super::error::ExpressionError;
use super::parse::{Binary, Function, Item, Tree};
use super::symbol::{Role, Symbol};
use terraglue_subsystem::unit::Unit;

/// Exponents of kg, m, s, A, K, mol, cd; angles are pure numbers here.
pub type Dimension = [f64; 7];

/// A pressure.
pub const PRESSURE: Dimension = [1.0, -1.0, -2.0, 0.0, 0.0, 0.0, 0.0];
const PURE: Dimension = [0.0; 7];
const NAMES: [&str; 7] = ["kg", "m", "s", "A", "K", "mol", "cd"];

fn same(a: &Dimension, b: &Dimension) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9)
}

fn combine(a: &Dimension, b: &Dimension, sign: f64) -> Dimension {
    std::array::from_fn(|k| a[k] + sign * b[k])
}

/// In words, with Pa where it fits: `Pa m^-1`, `m^2`, `a pure number`.
pub fn describe(d: &Dimension) -> String {
    let mut rest = *d;
    let mut parts = Vec::new();
    if (d[0] - 1.0).abs() < 1e-9 && (d[2] + 2.0).abs() < 1e-9 {
        rest = combine(d, &PRESSURE, -1.0);
        parts.push("Pa".to_owned());
    }
    for (name, exponent) in NAMES.iter().zip(rest) {
        if (exponent - 1.0).abs() < 1e-9 {
            parts.push((*name).to_owned());
        } else if exponent.abs() > 1e-9 {
            parts.push(format!("{name}^{}", (exponent * 1e6).round() / 1e6));
        }
    }
    if parts.is_empty() { "a pure number".into() } else { parts.join(" ") }
}

/// Checks a law at several values of its parameters: like is added to like, functions take pure numbers, the
/// result has the dimension `result`.
pub fn check(tree: &Tree, symbols: &[Symbol], result: &Dimension) -> Result<(), Box<ExpressionError>> {
    for sample in 0..SAMPLES {
        let values: Vec<f64> = symbols.iter().map(|s| s.sample(sample)).collect();
        let dimensions = dimensions_of(tree, symbols, &values)?;
        let got = dimensions[tree.root()];
        if !same(&got, result) {
            let message = format!("the law is {}, it must be {}", describe(&got), describe(result));
            return Err(tree
                .error(tree.root(), message)
                .help("terms and their dimensions: ".to_owned() + &terms(tree, &dimensions)));
        }
    }
    Ok(())
}

/// Number of values of the parameters that are tried.
pub const SAMPLES: usize = 5;

fn terms(tree: &Tree, dimensions: &[Dimension]) -> String {
    let mut seen = Vec::new();
    for (k, (item, _)) in tree.items.iter().enumerate() {
        let text = format!("{} is {}", tree.part(k), describe(&dimensions[k]));
        if matches!(item, Item::Symbol(_)) && !seen.contains(&text) {
            seen.push(text);
        }
    }
    seen.join(", ")
}

fn dimensions_of(
    tree: &Tree,
    symbols: &[Symbol],
    values: &[f64],
) -> Result<Vec<Dimension>, Box<ExpressionError>> {
    let mut out: Vec<Dimension> = Vec::with_capacity(tree.items.len());
    for (k, (item, _)) in tree.items.iter().enumerate() {
        let d = match *item {
            Item::Number(_) => PURE,
            Item::Symbol(s) => unit_dimension(&symbols[s], symbols, values)?.0,
            Item::Negate(a) => out[a],
            Item::Call(Function::Abs, a) => out[a],
            Item::Call(Function::Sqrt, a) => out[a].map(|e| 0.5 * e),
            Item::Call(_, a) => pure(tree, a, &out[a])?,
            Item::Binary(Binary::Mul, a, b) => combine(&out[a], &out[b], 1.0),
            Item::Binary(Binary::Div, a, b) => combine(&out[a], &out[b], -1.0),
            Item::Binary(Binary::Pow, a, b) => power(tree, symbols, values, [a, b], &out)?,
            Item::Binary(_, a, b) => like(tree, [k, a, b], &out)?,
        };
        out.push(d);
    }
    Ok(out)
}

fn pure(tree: &Tree, a: usize, d: &Dimension) -> Result<Dimension, Box<ExpressionError>> {
    if same(d, &PURE) {
        return Ok(PURE);
    }
    let message = format!("`{}` is {}, but a pure number is needed here", tree.part(a), describe(d));
    Err(tree.error(a, message))
}

/// Zero may be added to anything.
fn like(tree: &Tree, [k, a, b]: [usize; 3], out: &[Dimension]) -> Result<Dimension, Box<ExpressionError>> {
    let zero = |k: usize| tree.items[k].0 == Item::Number(0.0);
    if same(&out[a], &out[b]) || zero(b) {
        return Ok(out[a]);
    }
    if zero(a) {
        return Ok(out[b]);
    }
    let (left, right) = (tree.part(a), tree.part(b));
    let message = format!("`{left}` is {}, but `{right}` is {}", describe(&out[a]), describe(&out[b]));
    Err(tree.error(k, message))
}

fn power(
    tree: &Tree,
    symbols: &[Symbol],
    values: &[f64],
    [a, b]: [usize; 2],
    out: &[Dimension],
) -> Result<Dimension, Box<ExpressionError>> {
    pure(tree, b, &out[b])?;
    if same(&out[a], &PURE) {
        return Ok(PURE);
    }
    match constant(tree, symbols, values, b) {
        Some(exponent) => Ok(out[a].map(|e| e * exponent)),
        None => {
            let message = format!(
                "the exponent of `{}`, which is {}, must not change during the run",
                tree.part(a),
                describe(&out[a])
            );
            Err(tree.error(b, message).help("make the base a pure number, e.g. (z/b)^…"))
        }
    }
}

/// Value of a part that uses parameters and numbers only.
fn constant(tree: &Tree, symbols: &[Symbol], values: &[f64], k: usize) -> Option<f64> {
    Some(match tree.items[k].0 {
        Item::Number(x) => x,
        Item::Symbol(s) if symbols[s].role == Role::Parameter => values[s],
        Item::Symbol(_) => return None,
        Item::Negate(a) => -constant(tree, symbols, values, a)?,
        Item::Call(f, a) => f.value(constant(tree, symbols, values, a)?),
        Item::Binary(o, a, b) => {
            o.value(constant(tree, symbols, values, a)?, constant(tree, symbols, values, b)?)
        }
    })
}

/// Dimension and factor to SI of a symbol's unit, whose exponents may name pure parameters: N/m^(n+2).
pub fn unit_dimension(
    symbol: &Symbol,
    symbols: &[Symbol],
    values: &[f64],
) -> Result<(Dimension, f64), Box<ExpressionError>> {
    let text = symbol.unit.as_str();
    let names: Vec<&str> = symbols.iter().map(|s| s.name.as_str()).collect();
    let (mut dimension, mut factor, mut sign, mut at) = (PURE, 1.0, 1.0, 0);
    while at < text.len() {
        let rest = &text[at..];
        let length = rest.find([' ', '*', '.', '/', '^']).unwrap_or(rest.len());
        let name = &rest[..length];
        let from = at;
        at += length;
        let mut power = 1.0;
        if text[at..].starts_with('^') {
            let exponent = exponent_text(&text[at + 1..]);
            let tree = Tree::parse(exponent, &names).map_err(|e| in_unit(symbol, at + 1, *e))?;
            power = constant(&tree, symbols, values, tree.root()).unwrap_or(f64::NAN);
            at += 1 + exponent.len();
        }
        if !name.is_empty() {
            let unit = Unit::parse(name).map_err(|e| {
                let message = format!("in the unit of `{}`: {e}", symbol.name);
                ExpressionError::new(text, from..from + length, message)
            })?;
            for (sum, e) in dimension.iter_mut().zip(unit.exponents) {
                *sum += sign * power * f64::from(e);
            }
            factor *= libm::pow(unit.factor, sign * power);
        }
        match text[at..].chars().next() {
            Some('/') => (sign, at) = (-1.0, at + 1),
            Some(_) => at += 1,
            None => {}
        }
    }
    Ok((dimension, factor))
}

/// A number, a name, or an expression in parentheses.
fn exponent_text(rest: &str) -> &str {
    let end = if rest.starts_with('(') { rest.find(')').map(|k| k + 1) } else { rest.find([' ', '*', '/']) };
    &rest[..end.unwrap_or(rest.len())]
}

fn in_unit(symbol: &Symbol, offset: usize, error: ExpressionError) -> Box<ExpressionError> {
    let span = offset + error.span.start..offset + error.span.end;
    let message = format!("in the unit of `{}`: {}", symbol.name, error.message);
    ExpressionError::new(&symbol.unit, span, message)
}
