//! Tree to program: constants are folded, equal parts are computed once, 1 − e^x becomes −expm1(x).

use super::parse::{Binary, Function, Item, Tree};
use super::program::{LONGEST, Operation};

/// Operations in the order in which they are computed; operands are numbers of earlier ones.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Builder {
    operations: [Operation; LONGEST],
    length: usize,
    /// More operations were requested than there is room.
    full: bool,
}

/// Binding of a symbol.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Binding {
    /// Variable number k.
    Variable(u8),
    /// A value.
    Constant(f64),
}

impl Builder {
    /// Nothing yet.
    pub fn new() -> Self {
        Self { operations: [Operation::Constant(0.0); LONGEST], length: 0, full: false }
    }

    /// The operations of a tree and the number of its root; `None`: too long.
    pub fn of(tree: &Tree, bind: impl Fn(usize) -> Binding) -> Option<(Self, u8)> {
        let mut builder = Self::new();
        let mut places: Vec<u8> = Vec::with_capacity(tree.items.len());
        for (item, _) in &tree.items {
            let place = match *item {
                Item::Number(x) => builder.constant(x),
                Item::Symbol(s) => builder.bound(bind(s)),
                Item::Negate(a) => builder.scale(places[a], -1.0),
                Item::Call(f, a) => builder.function(f, places[a]),
                Item::Binary(o, a, b) => builder.binary(o, places[a], places[b]),
            };
            places.push(place);
        }
        let root = places.last().copied()?;
        (!builder.full).then_some((builder, root))
    }

    /// The same operations with variables bound anew, e.g. one to a constant. Shorter, never longer; allocates nothing.
    pub fn rebind(&self, root: u8, bind: impl Fn(u8) -> Binding) -> (Self, u8) {
        let mut out = Self::new();
        let mut places = [0u8; LONGEST];
        for k in 0..self.length {
            places[k] = match self.operations[k] {
                Operation::Constant(x) => out.constant(x),
                Operation::Variable(v) => out.bound(bind(v)),
                Operation::Add(a, b) => out.binary(Binary::Add, places[a as usize], places[b as usize]),
                Operation::AddConstant(a, c) => out.add_constant(places[a as usize], c),
                Operation::Sub(a, b) => out.binary(Binary::Sub, places[a as usize], places[b as usize]),
                Operation::Mul(a, b) => out.binary(Binary::Mul, places[a as usize], places[b as usize]),
                Operation::Scale(a, c) => out.scale(places[a as usize], c),
                Operation::Div(a, b) => out.binary(Binary::Div, places[a as usize], places[b as usize]),
                Operation::Power(a, c) => out.power(places[a as usize], c),
                Operation::PowerOf(a, b) => out.binary(Binary::Pow, places[a as usize], places[b as usize]),
                Operation::Min(a, b) => out.binary(Binary::Min, places[a as usize], places[b as usize]),
                Operation::Max(a, b) => out.binary(Binary::Max, places[a as usize], places[b as usize]),
                Operation::Function(f, a) => out.function(f, places[a as usize]),
            };
        }
        (out, places[root as usize])
    }

    /// The operations.
    pub fn operations(&self) -> &[Operation] {
        &self.operations[..self.length]
    }

    fn bound(&mut self, binding: Binding) -> u8 {
        match binding {
            Binding::Variable(v) => self.push(Operation::Variable(v)),
            Binding::Constant(x) => self.constant(x),
        }
    }

    /// An equal operation is not computed twice.
    fn push(&mut self, operation: Operation) -> u8 {
        if let Some(k) = self.operations().iter().position(|o| o.same(&operation)) {
            return k as u8;
        }
        if self.length == LONGEST {
            self.full = true;
            return 0;
        }
        self.operations[self.length] = operation;
        self.length += 1;
        (self.length - 1) as u8
    }

    fn constant(&mut self, x: f64) -> u8 {
        self.push(Operation::Constant(x))
    }

    fn value(&self, k: u8) -> Option<f64> {
        match self.operations[k as usize] {
            Operation::Constant(x) => Some(x),
            _ => None,
        }
    }

    fn scale(&mut self, a: u8, c: f64) -> u8 {
        match self.operations[a as usize] {
            Operation::Constant(x) => self.constant(x * c),
            _ if c == 1.0 => a,
            Operation::Scale(inner, d) => self.scale(inner, c * d),
            _ => self.push(Operation::Scale(a, c)),
        }
    }

    fn add_constant(&mut self, a: u8, c: f64) -> u8 {
        match self.operations[a as usize] {
            Operation::Constant(x) => self.constant(x + c),
            _ if c == 0.0 => a,
            Operation::Function(Function::Exp, e) if c == -1.0 => self.function(Function::Expm1, e),
            Operation::Scale(inner, s) if s == -1.0 && c == 1.0 => match self.operations[inner as usize] {
                Operation::Function(Function::Exp, e) => {
                    let e = self.function(Function::Expm1, e);
                    self.scale(e, -1.0)
                }
                _ => self.push(Operation::AddConstant(a, c)),
            },
            _ => self.push(Operation::AddConstant(a, c)),
        }
    }

    fn power(&mut self, a: u8, c: f64) -> u8 {
        match self.value(a) {
            Some(x) => self.constant(libm::pow(x, c)),
            None if c == 0.0 => self.constant(1.0),
            None if c == 1.0 => a,
            None if c == 2.0 => self.push(Operation::Mul(a, a)),
            None if c == 0.5 => self.push(Operation::Function(Function::Sqrt, a)),
            None => self.push(Operation::Power(a, c)),
        }
    }

    fn function(&mut self, f: Function, a: u8) -> u8 {
        match self.value(a) {
            Some(x) => self.constant(f.value(x)),
            None => self.push(Operation::Function(f, a)),
        }
    }

    fn binary(&mut self, o: Binary, a: u8, b: u8) -> u8 {
        match (o, self.value(a), self.value(b)) {
            (_, Some(x), Some(y)) => self.constant(o.value(x, y)),
            (Binary::Add, _, Some(c)) => self.add_constant(a, c),
            (Binary::Add, Some(c), _) => self.add_constant(b, c),
            (Binary::Sub, _, Some(c)) => self.add_constant(a, -c),
            (Binary::Sub, Some(c), _) => {
                let negative = self.scale(b, -1.0);
                self.add_constant(negative, c)
            }
            (Binary::Mul, _, Some(c)) => self.scale(a, c),
            (Binary::Mul, Some(c), _) => self.scale(b, c),
            (Binary::Div, _, Some(c)) if c != 0.0 => self.scale(a, 1.0 / c),
            (Binary::Pow, _, Some(c)) => self.power(a, c),
            (Binary::Add, ..) => self.push(Operation::Add(a, b)),
            (Binary::Sub, ..) => self.push(Operation::Sub(a, b)),
            (Binary::Mul, ..) => self.push(Operation::Mul(a, b)),
            (Binary::Div, ..) => self.push(Operation::Div(a, b)),
            (Binary::Pow, ..) => self.push(Operation::PowerOf(a, b)),
            (Binary::Min, ..) => self.push(Operation::Min(a, b)),
            (Binary::Max, ..) => self.push(Operation::Max(a, b)),
        }
    }
}

impl Default for Builder {
    fn default() -> Self {
        Self::new()
    }
}
