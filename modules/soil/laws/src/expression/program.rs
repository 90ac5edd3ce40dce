//! A law as a short list of operations on a few registers, with exact derivatives (forward mode, Wengert 1964).
//!
//! Plain data of fixed size: made, copied and evaluated without allocation. A batch runs each operation over a
//! chunk of nodes, so that the list is read once per chunk.

use super::parse::Function;

/// Most operations of a law after constants are folded.
pub const LONGEST: usize = 32;
/// Registers.
const REGISTERS: usize = 12;
/// Nodes that are evaluated together.
pub const CHUNK: usize = 32;

/// One operation; operands are registers (numbers of operations while it is built).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Operation {
    /// A value.
    Constant(f64),
    /// Variable number k.
    Variable(u8),
    /// a + b.
    Add(u8, u8),
    /// a + c.
    AddConstant(u8, f64),
    /// a − b.
    Sub(u8, u8),
    /// a·b.
    Mul(u8, u8),
    /// a·c.
    Scale(u8, f64),
    /// a/b.
    Div(u8, u8),
    /// a^c.
    Power(u8, f64),
    /// a^b.
    PowerOf(u8, u8),
    /// The smaller.
    Min(u8, u8),
    /// The larger.
    Max(u8, u8),
    /// f(a).
    Function(Function, u8),
}

impl Operation {
    /// Equal bit for bit.
    pub(super) fn same(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Constant(a), Self::Constant(b)) => a.to_bits() == b.to_bits(),
            _ => self == other,
        }
    }

    fn operands(&self) -> [Option<u8>; 2] {
        match *self {
            Self::Constant(_) | Self::Variable(_) => [None, None],
            Self::AddConstant(a, _) | Self::Scale(a, _) | Self::Power(a, _) | Self::Function(_, a) => {
                [Some(a), None]
            }
            Self::Add(a, b)
            | Self::Sub(a, b)
            | Self::Mul(a, b)
            | Self::Div(a, b)
            | Self::PowerOf(a, b)
            | Self::Min(a, b)
            | Self::Max(a, b) => [Some(a), Some(b)],
        }
    }

    fn with_operands(mut self, place: impl Fn(u8) -> u8) -> Self {
        match &mut self {
            Self::Constant(_) | Self::Variable(_) => {}
            Self::AddConstant(a, _) | Self::Scale(a, _) | Self::Power(a, _) | Self::Function(_, a) => {
                *a = place(*a);
            }
            Self::Add(a, b)
            | Self::Sub(a, b)
            | Self::Mul(a, b)
            | Self::Div(a, b)
            | Self::PowerOf(a, b)
            | Self::Min(a, b)
            | Self::Max(a, b) => (*a, *b) = (place(*a), place(*b)),
        }
        self
    }
}

/// A law ready to be evaluated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Program {
    steps: [(Operation, u8); LONGEST],
    length: usize,
    registers: usize,
}

impl Program {
    /// Drops operations that the root does not need and assigns registers; `None`: too many are needed at once.
    pub fn new(operations: &[Operation], root: u8) -> Option<Self> {
        let mut last_use = [0usize; LONGEST];
        let mut needed = [false; LONGEST];
        needed[root as usize] = true;
        last_use[root as usize] = usize::MAX;
        for k in (0..operations.len()).rev().filter(|k| *k <= root as usize) {
            if !needed[k] {
                continue;
            }
            for operand in operations[k].operands().into_iter().flatten() {
                needed[operand as usize] = true;
                last_use[operand as usize] = last_use[operand as usize].max(k);
            }
        }
        let mut place = [0u8; LONGEST];
        let mut holder = [None::<usize>; REGISTERS];
        let mut out = Self { steps: [(Operation::Constant(0.0), 0); LONGEST], length: 0, registers: 0 };
        for k in (0..operations.len()).filter(|k| needed[*k]) {
            let free = |h: &Option<usize>| h.is_none_or(|held| last_use[held] < k);
            let to = holder.iter().position(free)?;
            holder[to] = Some(k);
            place[k] = to as u8;
            let step = operations[k].with_operands(|o| place[o as usize]);
            out.steps[out.length] = (step, to as u8);
            out.length += 1;
            out.registers = out.registers.max(to + 1);
        }
        Some(out)
    }

    fn steps(&self) -> &[(Operation, u8)] {
        &self.steps[..self.length]
    }

    /// (c, n) of a law that is c·x^n of variable 0.
    pub fn power_law(&self) -> Option<(f64, f64)> {
        let mut law = None;
        for (step, _) in self.steps() {
            law = match (law, *step) {
                (None, Operation::Variable(0)) => Some((1.0, 1.0)),
                (Some((1.0, 1.0)), Operation::Power(_, n)) => Some((1.0, n)),
                (Some((1.0, 1.0)), Operation::Mul(a, b)) if a == b => Some((1.0, 2.0)),
                (Some((1.0, 1.0)), Operation::Function(Function::Sqrt, _)) => Some((1.0, 0.5)),
                (Some((1.0, n)), Operation::Scale(_, c)) => Some((c, n)),
                _ => return None,
            };
        }
        law
    }

    /// The value at the variables `x` and its derivative by each of them.
    #[inline]
    pub fn eval<const N: usize>(&self, x: [f64; N]) -> (f64, [f64; N]) {
        let mut v = [0.0; REGISTERS];
        let mut d = [[0.0; N]; REGISTERS];
        let mut last = 0;
        for (step, to) in self.steps() {
            let (value, slope) = scalar(step, &x, &v, &d);
            last = *to as usize;
            (v[last], d[last]) = (value, slope);
        }
        (v[last], d[last])
    }

    /// Value and slope of a law of one variable.
    #[inline]
    pub fn depth(&self, z: f64) -> (f64, f64) {
        let (p, [slope]) = self.eval([z]);
        (p, slope)
    }

    /// Values and derivatives of a law of D variables at the places `x`, one array per variable.
    pub fn eval_all<const D: usize>(&self, x: [&[f64]; D], out: &mut [f64], mut slopes: [&mut [f64]; D]) {
        let mut first = 0;
        while first < out.len() {
            let n = CHUNK.min(out.len() - first);
            let range = first..first + n;
            let x = x.map(|x| {
                let mut all = [x[first]; CHUNK];
                all[..n].copy_from_slice(&x[range.clone()]);
                all
            });
            let mut lanes = Lanes { by: 0, v: [0.0; CHUNK], d: [[0.0; CHUNK]; D] };
            match self.registers {
                0..=3 => self.chunk::<3, D>(n, &x, &mut lanes),
                4..=6 => self.chunk::<6, D>(n, &x, &mut lanes),
                _ => self.chunk::<REGISTERS, D>(n, &x, &mut lanes),
            }
            out[range.clone()].copy_from_slice(&lanes.v[..n]);
            for (slope, d) in slopes.iter_mut().zip(&lanes.d) {
                slope[range.clone()].copy_from_slice(&d[..n]);
            }
            first += n;
        }
    }

    fn chunk<const R: usize, const D: usize>(&self, n: usize, x: &[[f64; CHUNK]; D], out: &mut Lanes<D>) {
        let mut registers = [Lanes { by: 0, v: [0.0; CHUNK], d: [[0.0; CHUNK]; D] }; R];
        let mut last = 0;
        for (step, to) in self.steps() {
            last = *to as usize;
            if last < R {
                step.lanes(n, x, &mut registers, last);
            }
        }
        *out = registers[last];
        for i in 0..D {
            if !out.is_by(i) {
                out.d[i] = [0.0; CHUNK];
            }
        }
    }
}

/// A value with its derivatives by D variables at [`CHUNK`] places.
#[derive(Clone, Copy)]
struct Lanes<const D: usize> {
    /// Bit i: it depends on variable i; where it does not the derivative is not written.
    by: u8,
    v: [f64; CHUNK],
    d: [[f64; CHUNK]; D],
}

impl<const D: usize> Lanes<D> {
    #[inline(always)]
    fn is_by(&self, i: usize) -> bool {
        self.by & (1 << i) != 0
    }

    /// f of one operand, which answers value and slope; places from n on are left out.
    #[inline(always)]
    fn one(&mut self, a: &Self, n: usize, f: impl Fn(f64) -> (f64, f64)) {
        let mut slope = [0.0; CHUNK];
        for l in 0..n {
            (self.v[l], slope[l]) = f(a.v[l]);
        }
        self.by = a.by;
        for i in (0..D).filter(|i| a.is_by(*i)) {
            (0..CHUNK).for_each(|l| self.d[i][l] = a.d[i][l] * slope[l]);
        }
    }

    /// p·x + q.
    #[inline(always)]
    fn affine(&mut self, a: &Self, p: f64, q: f64) {
        (0..CHUNK).for_each(|l| self.v[l] = p * a.v[l] + q);
        self.by = a.by;
        for i in (0..D).filter(|i| a.is_by(*i)) {
            (0..CHUNK).for_each(|l| self.d[i][l] = p * a.d[i][l]);
        }
    }

    /// f of two operands, which answers value and slopes.
    #[inline(always)]
    fn two(&mut self, [a, b]: [&Self; 2], n: usize, f: impl Fn(f64, f64) -> (f64, f64, f64)) {
        let (mut by_a, mut by_b) = ([0.0; CHUNK], [0.0; CHUNK]);
        for l in 0..n {
            (self.v[l], by_a[l], by_b[l]) = f(a.v[l], b.v[l]);
        }
        self.by = a.by | b.by;
        for i in 0..D {
            let d = &mut self.d[i];
            match (a.is_by(i), b.is_by(i)) {
                (true, true) => (0..CHUNK).for_each(|l| d[l] = by_a[l] * a.d[i][l] + by_b[l] * b.d[i][l]),
                (true, false) => (0..CHUNK).for_each(|l| d[l] = by_a[l] * a.d[i][l]),
                (false, true) => (0..CHUNK).for_each(|l| d[l] = by_b[l] * b.d[i][l]),
                (false, false) => {}
            }
        }
    }
}

impl Operation {
    /// The operation over n places of a chunk, into register `to`, which is none of its operands.
    #[inline(always)]
    fn lanes<const R: usize, const D: usize>(
        &self,
        n: usize,
        x: &[[f64; CHUNK]; D],
        r: &mut [Lanes<D>; R],
        to: usize,
    ) {
        match (*self, self.operands().map(|k| k.map(|k| (k as usize).min(R - 1)))) {
            (Self::Constant(c), _) => (r[to].by, r[to].v) = (0, [c; CHUNK]),
            (Self::Variable(k), _) => {
                let k = (k as usize).min(D - 1);
                (r[to].by, r[to].v, r[to].d[k]) = (1 << k, x[k], [1.0; CHUNK]);
            }
            (_, [Some(a), None]) => {
                if let Ok([a, out]) = r.get_disjoint_mut([a, to]) {
                    self.of_one(n, a, out);
                }
            }
            (_, [Some(a), Some(b)]) if a == b => {
                if let Ok([a, out]) = r.get_disjoint_mut([a, to]) {
                    self.of_two(n, [a, a], out);
                }
            }
            (_, [Some(a), Some(b)]) => {
                if let Ok([a, b, out]) = r.get_disjoint_mut([a, b, to]) {
                    self.of_two(n, [a, b], out);
                }
            }
            (_, [None, _]) => {}
        }
    }

    #[inline(always)]
    fn of_one<const D: usize>(&self, n: usize, a: &Lanes<D>, out: &mut Lanes<D>) {
        match *self {
            Self::AddConstant(_, c) => out.affine(a, 1.0, c),
            Self::Scale(_, c) => out.affine(a, c, 0.0),
            Self::Power(_, c) => out.one(a, n, |p| power(p, c)),
            Self::Function(f, _) => out.one(a, n, |p| {
                let value = f.value(p);
                (value, f.slope(p, value))
            }),
            _ => {}
        }
    }

    #[inline(always)]
    fn of_two<const D: usize>(&self, n: usize, of: [&Lanes<D>; 2], out: &mut Lanes<D>) {
        match *self {
            Self::Add(..) => out.two(of, CHUNK, |p, q| (p + q, 1.0, 1.0)),
            Self::Sub(..) => out.two(of, CHUNK, |p, q| (p - q, 1.0, -1.0)),
            Self::Mul(..) => out.two(of, CHUNK, |p, q| (p * q, q, p)),
            Self::Div(..) => out.two(of, CHUNK, |p, q| (p / q, 1.0 / q, -p / (q * q))),
            Self::PowerOf(..) => out.two(of, n, power_of),
            Self::Min(..) => {
                out.two(of, CHUNK, |p, q| if p <= q { (p, 1.0, 0.0) } else { (q, 0.0, 1.0) });
            }
            Self::Max(..) => {
                out.two(of, CHUNK, |p, q| if p >= q { (p, 1.0, 0.0) } else { (q, 0.0, 1.0) });
            }
            _ => {}
        }
    }
}

/// x^c with its derivative; at 0 the limit from the right.
#[inline]
fn power(x: f64, c: f64) -> (f64, f64) {
    let value = libm::pow(x, c);
    let slope = if x != 0.0 {
        c * value / x
    } else if c > 1.0 {
        0.0
    } else {
        c * libm::pow(x, c - 1.0)
    };
    (value, slope)
}

/// a^b with its derivatives by a and by b.
#[inline]
fn power_of(a: f64, b: f64) -> (f64, f64, f64) {
    let (value, by_a) = power(a, b);
    (value, by_a, if a > 0.0 { value * libm::log(a) } else { 0.0 })
}

#[inline]
fn scalar<const N: usize>(
    step: &Operation,
    x: &[f64; N],
    v: &[f64; REGISTERS],
    d: &[[f64; N]; REGISTERS],
) -> (f64, [f64; N]) {
    let at = |k: u8| (v[k as usize], d[k as usize]);
    let times = |d: [f64; N], c: f64| d.map(|d| d * c);
    let sum = |a: [f64; N], p: f64, b: [f64; N], q: f64| std::array::from_fn(|k| a[k] * p + b[k] * q);
    match *step {
        Operation::Constant(c) => (c, [0.0; N]),
        Operation::Variable(k) => {
            (x[k as usize], std::array::from_fn(|i| if i == k as usize { 1.0 } else { 0.0 }))
        }
        Operation::Add(a, b) => (at(a).0 + at(b).0, sum(at(a).1, 1.0, at(b).1, 1.0)),
        Operation::AddConstant(a, c) => (at(a).0 + c, at(a).1),
        Operation::Sub(a, b) => (at(a).0 - at(b).0, sum(at(a).1, 1.0, at(b).1, -1.0)),
        Operation::Mul(a, b) => {
            let ((a, da), (b, db)) = (at(a), at(b));
            (a * b, sum(da, b, db, a))
        }
        Operation::Scale(a, c) => (at(a).0 * c, times(at(a).1, c)),
        Operation::Div(a, b) => {
            let ((a, da), (b, db)) = (at(a), at(b));
            (a / b, sum(da, 1.0 / b, db, -a / (b * b)))
        }
        Operation::Power(a, c) => {
            let (value, slope) = power(at(a).0, c);
            (value, times(at(a).1, slope))
        }
        Operation::PowerOf(a, b) => {
            let (value, by_a, by_b) = power_of(at(a).0, at(b).0);
            (value, sum(at(a).1, by_a, at(b).1, by_b))
        }
        Operation::Min(a, b) => {
            if at(a).0 <= at(b).0 {
                at(a)
            } else {
                at(b)
            }
        }
        Operation::Max(a, b) => {
            if at(a).0 >= at(b).0 {
                at(a)
            } else {
                at(b)
            }
        }
        Operation::Function(f, a) => {
            let value = f.value(at(a).0);
            (value, times(at(a).1, f.slope(at(a).0, value)))
        }
    }
}
