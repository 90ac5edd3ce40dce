//! The names that a law may use: quantities that change during a run, and parameters with unit and range.

use super::error::ExpressionError;
use super::{Binary, Function};

/// Role of a symbol.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Differs from node to node: depth, pressure, shear displacement. Derivatives are taken by it.
    Variable,
    /// Differs from contact to contact: its size.
    Contact,
    /// The same everywhere.
    Parameter,
}

/// A name with its meaning.
#[derive(Clone, Debug, PartialEq)]
pub struct Symbol {
    /// Name.
    pub name: String,
    /// Unit; its exponents may name pure parameters, e.g. N/m^(n+2).
    pub unit: String,
    /// Meaning.
    pub role: Role,
    /// Value of a parameter in SI; for the others somewhere inside the range.
    pub value: f64,
    /// Smallest and largest value over which the law must make sense, SI.
    pub range: [f64; 2],
}

impl Symbol {
    /// A symbol of any role.
    pub fn new(name: &str, unit: &str, role: Role, value: f64, range: [f64; 2]) -> Self {
        Self { name: name.into(), unit: unit.into(), role, value, range }
    }

    /// A constant parameter: its range is its value.
    pub fn fixed(name: &str, unit: &str, value: f64) -> Self {
        Self::new(name, unit, Role::Parameter, value, [value; 2])
    }

    /// Reads `VALUE [UNIT] [[MIN, MAX]]`, e.g. `820e3 N/m^(n+2) [1e5, 1e7]` or `0.5`.
    ///
    /// # Errors
    /// [`ExpressionError`] with the place in the text.
    pub fn parse(name: &str, text: &str) -> Result<Self, Box<ExpressionError>> {
        let wrong = |span, message: String| {
            let error = ExpressionError::new(text, span, message);
            error.help("write VALUE UNIT [MIN, MAX], e.g. \"820e3 N/m^(n+2) [1e5, 1e7]\"")
        };
        if name.is_empty() || !name.chars().all(|c| c.is_alphanumeric() || c == '_') {
            return Err(wrong(
                0..0,
                format!("`{name}` is no name for a parameter: use letters, digits and _"),
            ));
        }
        let (head, range) = match text.split_once('[') {
            Some((head, range)) => (head, Some(range)),
            None => (text, None),
        };
        let length = head.trim_start().find(char::is_whitespace).unwrap_or(head.trim_start().len());
        let (number, unit) = head.trim_start().split_at(length);
        let Some(value) = number.parse::<f64>().ok().filter(|v| v.is_finite()) else {
            return Err(wrong(0..number.len(), format!("`{name}` = `{number}` is not a number")));
        };
        let mut symbol = Self::fixed(name, unit.trim(), value);
        if let Some(range) = range {
            let span = head.len()..text.len();
            let numbers = range.trim_end().strip_suffix(']').and_then(|r| r.split_once(','));
            let numbers = numbers.and_then(|(a, b)| a.trim().parse().ok().zip(b.trim().parse().ok()));
            match numbers {
                Some((min, max)) if min <= value && value <= max => symbol.range = [min, max],
                Some((min, max)) => {
                    return Err(wrong(
                        span,
                        format!("`{name}` = {value} is outside its range {min} … {max}"),
                    ));
                }
                None => {
                    return Err(wrong(span, format!("the range of `{name}` is not of the form [MIN, MAX]")));
                }
            }
        }
        Ok(symbol)
    }

    /// Value number k of a few over the range, the own value first.
    pub fn sample(&self, k: usize) -> f64 {
        const SHARES: [f64; 4] = [0.0, 1.0, 0.381_966, 0.763_932];
        match k.checked_sub(1).and_then(|k| SHARES.get(k)) {
            Some(share) => self.range[0] + share * (self.range[1] - self.range[0]),
            None => self.value,
        }
    }
}

impl Function {
    /// f(x).
    #[inline]
    pub fn value(self, x: f64) -> f64 {
        match self {
            Self::Exp => libm::exp(x),
            Self::Expm1 => libm::expm1(x),
            Self::Ln => libm::log(x),
            Self::Sqrt => x.sqrt(),
            Self::Abs => x.abs(),
            Self::Sin => libm::sin(x),
            Self::Cos => libm::cos(x),
            Self::Tan => libm::tan(x),
            Self::Atan => libm::atan(x),
            Self::Tanh => libm::tanh(x),
        }
    }

    /// f'(x), where y = f(x).
    #[inline]
    pub fn slope(self, x: f64, y: f64) -> f64 {
        match self {
            Self::Exp => y,
            Self::Expm1 => y + 1.0,
            Self::Ln => 1.0 / x,
            Self::Sqrt => 0.5 / y,
            Self::Abs => 1.0_f64.copysign(x),
            Self::Sin => libm::cos(x),
            Self::Cos => -libm::sin(x),
            Self::Tan => 1.0 + y * y,
            Self::Atan => 1.0 / (1.0 + x * x),
            Self::Tanh => 1.0 - y * y,
        }
    }
}

impl Binary {
    /// a ∘ b.
    #[inline]
    pub fn value(self, a: f64, b: f64) -> f64 {
        match self {
            Self::Add => a + b,
            Self::Sub => a - b,
            Self::Mul => a * b,
            Self::Div => a / b,
            Self::Pow => libm::pow(a, b),
            Self::Min => a.min(b),
            Self::Max => a.max(b),
        }
    }
}
