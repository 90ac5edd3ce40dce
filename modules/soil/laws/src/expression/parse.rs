//! Text to tree: numbers, names, + − * / ^, parentheses and functions, by precedence climbing.

use super::error::ExpressionError;
use std::ops::Range;

type Result<T> = std::result::Result<T, Box<ExpressionError>>;

/// A function of one argument.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Function {
    /// e^x.
    Exp,
    /// e^x − 1, accurate for small x; made from `exp(x) - 1`, and may be written.
    Expm1,
    /// Natural logarithm.
    Ln,
    /// Square root.
    Sqrt,
    /// |x|.
    Abs,
    /// Sine.
    Sin,
    /// Cosine.
    Cos,
    /// Tangent.
    Tan,
    /// Arc tangent.
    Atan,
    /// Hyperbolic tangent.
    Tanh,
}

const FUNCTIONS: [(&str, Function); 11] = [
    ("exp", Function::Exp),
    ("expm1", Function::Expm1),
    ("ln", Function::Ln),
    ("log", Function::Ln),
    ("sqrt", Function::Sqrt),
    ("abs", Function::Abs),
    ("sin", Function::Sin),
    ("cos", Function::Cos),
    ("tan", Function::Tan),
    ("atan", Function::Atan),
    ("tanh", Function::Tanh),
];

/// An operation on two operands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Binary {
    /// a + b.
    Add,
    /// a − b.
    Sub,
    /// a·b.
    Mul,
    /// a/b.
    Div,
    /// a^b.
    Pow,
    /// The smaller.
    Min,
    /// The larger.
    Max,
}

/// A node of the tree; operands are indices of earlier nodes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Item {
    /// A number.
    Number(f64),
    /// Number k in the list of symbols.
    Symbol(usize),
    /// −a.
    Negate(usize),
    /// f(a).
    Call(Function, usize),
    /// a ∘ b.
    Binary(Binary, usize, usize),
}

/// A parsed text; the last node is the root.
#[derive(Clone, Debug, PartialEq)]
pub struct Tree {
    /// The text.
    pub text: String,
    /// Nodes with the bytes that they come from, operands first.
    pub items: Vec<(Item, Range<usize>)>,
}

/// Deepest nesting; a text is written by people.
const DEEPEST: usize = 40;
/// Longest text, bytes.
const LONGEST: usize = 2000;

impl Tree {
    /// Reads a text; `names` are the symbols that it may use.
    ///
    /// # Errors
    /// [`ExpressionError`] with the place in the text.
    pub fn parse(text: &str, names: &[&str]) -> Result<Self> {
        if text.len() > LONGEST {
            let message = format!("the text has {} characters, at most {LONGEST} are read", text.len());
            return Err(ExpressionError::new(text, 0..1, message));
        }
        let mut parser = Parser { text, names, at: 0, items: Vec::new() };
        parser.sum(0)?;
        parser.space();
        match parser.peek() {
            None => Ok(Self { text: text.into(), items: parser.items }),
            Some(c) => Err(parser.unexpected(c)),
        }
    }

    /// Index of the root.
    pub fn root(&self) -> usize {
        self.items.len() - 1
    }

    /// The part of the text that a node comes from.
    pub fn part(&self, k: usize) -> &str {
        self.text.get(self.items[k].1.clone()).unwrap_or_default()
    }

    /// An error at a node.
    pub fn error(&self, k: usize, message: impl Into<String>) -> Box<ExpressionError> {
        ExpressionError::new(&self.text, self.items[k].1.clone(), message)
    }

    /// Whether a symbol is used.
    pub fn uses(&self, symbol: usize) -> bool {
        self.items.iter().any(|(item, _)| *item == Item::Symbol(symbol))
    }
}

struct Parser<'a> {
    text: &'a str,
    names: &'a [&'a str],
    at: usize,
    items: Vec<(Item, Range<usize>)>,
}

impl Parser<'_> {
    fn peek(&self) -> Option<char> {
        self.text[self.at..].chars().next()
    }

    fn space(&mut self) {
        let rest = &self.text[self.at..];
        self.at += rest.len() - rest.trim_start().len();
    }

    fn accept(&mut self, c: char) -> bool {
        self.space();
        let found = self.peek() == Some(c);
        self.at += if found { c.len_utf8() } else { 0 };
        found
    }

    fn push(&mut self, item: Item, from: usize) -> usize {
        self.items.push((item, from..self.at));
        self.items.len() - 1
    }

    fn deeper(&self, depth: usize) -> Result<()> {
        let message = "nested too deeply";
        if depth < DEEPEST { Ok(()) } else { Err(ExpressionError::new(self.text, self.at..self.at, message)) }
    }

    /// Start of the text of a node.
    fn start(&self, k: usize) -> usize {
        self.items[k].1.start
    }

    fn sum(&mut self, depth: usize) -> Result<usize> {
        self.deeper(depth)?;
        let mut left = self.product(depth)?;
        loop {
            let operation = if self.accept('+') {
                Binary::Add
            } else if self.accept('-') {
                Binary::Sub
            } else {
                return Ok(left);
            };
            let right = self.product(depth)?;
            left = self.push(Item::Binary(operation, left, right), self.start(left));
        }
    }

    fn product(&mut self, depth: usize) -> Result<usize> {
        let mut left = self.signed(depth)?;
        loop {
            let operation = if self.text[self.at..].trim_start().starts_with("**") {
                let message = "powers are written with ^";
                self.space();
                return Err(ExpressionError::new(self.text, self.at..self.at + 2, message));
            } else if self.accept('*') {
                Binary::Mul
            } else if self.accept('/') {
                Binary::Div
            } else {
                return Ok(left);
            };
            let right = self.signed(depth)?;
            left = self.push(Item::Binary(operation, left, right), self.start(left));
        }
    }

    /// −a^b is −(a^b).
    fn signed(&mut self, depth: usize) -> Result<usize> {
        self.deeper(depth)?;
        self.space();
        let from = self.at;
        if self.accept('-') {
            let operand = self.signed(depth + 1)?;
            return Ok(self.push(Item::Negate(operand), from));
        }
        self.power(depth)
    }

    /// Powers bind to the right: a^b^c is a^(b^c).
    fn power(&mut self, depth: usize) -> Result<usize> {
        let base = self.atom(depth)?;
        if !self.accept('^') {
            return Ok(base);
        }
        let exponent = self.signed(depth + 1)?;
        Ok(self.push(Item::Binary(Binary::Pow, base, exponent), self.start(base)))
    }

    fn atom(&mut self, depth: usize) -> Result<usize> {
        self.space();
        let from = self.at;
        match self.peek() {
            Some('(') => {
                self.at += 1;
                let inside = self.sum(depth + 1)?;
                self.close(from)?;
                self.items[inside].1 = from..self.at;
                Ok(inside)
            }
            Some(c) if c.is_ascii_digit() || c == '.' => self.number(),
            Some(c) if c.is_alphabetic() || c == '_' => self.name(depth),
            Some(c) => Err(self.unexpected(c)),
            None => Err(ExpressionError::new(self.text, from..from, "a value is missing at the end")),
        }
    }

    fn close(&mut self, from: usize) -> Result<()> {
        if self.accept(')') {
            return Ok(());
        }
        match self.peek() {
            Some(c) => Err(self.unexpected(c)),
            None => Err(ExpressionError::new(self.text, from..from + 1, "this parenthesis is not closed")),
        }
    }

    fn number(&mut self) -> Result<usize> {
        let from = self.at;
        let bytes = self.text.as_bytes();
        let mut end = from;
        while end < bytes.len() {
            let sign =
                matches!(bytes[end], b'+' | b'-') && matches!(bytes[end - 1], b'e' | b'E') && end > from;
            if !(bytes[end].is_ascii_digit() || matches!(bytes[end], b'.' | b'e' | b'E') || sign) {
                break;
            }
            end += 1;
        }
        self.at = end;
        match self.text[from..end].parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(self.push(Item::Number(value), from)),
            _ => Err(ExpressionError::new(self.text, from..end, "this is not a number")),
        }
    }

    fn name(&mut self, depth: usize) -> Result<usize> {
        let from = self.at;
        let rest = &self.text[from..];
        let length = rest.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(rest.len());
        self.at += length;
        let name = &rest[..length];
        if self.text[self.at..].trim_start().starts_with('(') {
            return self.call(name, from, depth);
        }
        if let Some(k) = self.names.iter().position(|n| *n == name) {
            return Ok(self.push(Item::Symbol(k), from));
        }
        if name == "pi" {
            return Ok(self.push(Item::Number(std::f64::consts::PI), from));
        }
        let error = ExpressionError::new(self.text, from..self.at, format!("unknown name `{name}`"));
        let near = self.names.iter().copied().min_by_key(|n| distance(n, name));
        Err(match near.filter(|n| distance(n, name) <= 1 + name.len() / 3) {
            Some(near) => error.help(format!("did you mean `{near}`?")),
            None => error.help(format!("names here: {}, pi", self.names.join(", "))),
        })
    }

    fn call(&mut self, name: &str, from: usize, depth: usize) -> Result<usize> {
        let named = from..self.at;
        let open = self.at;
        self.accept('(');
        let first = self.sum(depth + 1)?;
        if let Some((_, function)) = FUNCTIONS.iter().find(|(n, _)| *n == name) {
            if self.accept(',') {
                let message = format!("`{name}` takes one argument");
                return Err(ExpressionError::new(self.text, self.at - 1..self.at, message));
            }
            self.close(open)?;
            return Ok(self.push(Item::Call(*function, first), from));
        }
        let operation = match name {
            "min" => Binary::Min,
            "max" => Binary::Max,
            "pow" => Binary::Pow,
            _ => return Err(self.unknown_function(name, named)),
        };
        if !self.accept(',') {
            let message = format!("`{name}` takes two arguments");
            return Err(ExpressionError::new(self.text, named, message));
        }
        let second = self.sum(depth + 1)?;
        self.close(open)?;
        Ok(self.push(Item::Binary(operation, first, second), from))
    }

    fn unknown_function(&self, name: &str, span: Range<usize>) -> Box<ExpressionError> {
        let names: Vec<&str> = FUNCTIONS.iter().map(|f| f.0).chain(["min", "max", "pow"]).collect();
        let error = ExpressionError::new(self.text, span, format!("unknown function `{name}`"));
        if self.names.contains(&name) {
            return error.help(format!("`{name}` is a value: write {name}*(…) for a product"));
        }
        error.help(format!("functions: {}", names.join(", ")))
    }

    fn unexpected(&self, c: char) -> Box<ExpressionError> {
        let span = self.at..self.at + c.len_utf8();
        ExpressionError::new(self.text, span, format!("`{c}` is not expected here"))
    }
}

/// Levenshtein distance, for the nearest name.
fn distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.chars().enumerate() {
        let mut diagonal = std::mem::replace(&mut row[0], i + 1);
        for (j, y) in b.iter().enumerate() {
            let change = diagonal + usize::from(x != *y);
            diagonal = row[j + 1];
            row[j + 1] = change.min(diagonal + 1).min(row[j] + 1);
        }
    }
    row[b.len()]
}
