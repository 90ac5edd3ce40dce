//! A monotone relation between the impulse of an axis and its rate, piecewise linear.
//!
//! Everything that acts along the free axis of a joint (motor law, supply and torque limits, gear losses, friction,
//! springs, armature, end stops, brake) never gives more impulse at a higher rate. Such a relation is a maximal
//! monotone graph: lines λ = a − s·u between kinks, and vertical pieces where the impulse may jump. Minimum,
//! maximum and sum of such graphs are such graphs again, so a drive is built from its parts without a special case
//! for any pair of them. On a line the axis is a row u + λ/s = a/s of the step's linear system (no row where s = 0),
//! on a vertical piece a rigid row; the right piece is found by an active set over all axes.

use terraglue_subsystem::Result;
use terraglue_subsystem::bytes::{self, Persist};

/// Most kinks of a curve; parts add up to 19.
const KINKS: usize = 24;

/// λ = at_zero − slope·u. An infinite `at_zero` lies beyond an end stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Line {
    pub at_zero: f64,
    pub slope: f64,
}

impl Line {
    pub const ZERO: Self = Self { at_zero: 0.0, slope: 0.0 };

    pub const fn level(at_zero: f64) -> Self {
        Self { at_zero, slope: 0.0 }
    }

    pub fn at(&self, u: f64) -> f64 {
        if self.at_zero.is_finite() { self.at_zero - self.slope * u } else { self.at_zero }
    }

    fn plus(&self, other: &Self) -> Self {
        if self.at_zero.is_finite() && other.at_zero.is_finite() {
            Self { at_zero: self.at_zero + other.at_zero, slope: self.slope + other.slope }
        } else {
            Self::level(if self.at_zero.is_finite() { other.at_zero } else { self.at_zero })
        }
    }

    fn times(&self, factor: f64) -> Self {
        if self.at_zero.is_finite() {
            Self { at_zero: factor * self.at_zero, slope: factor * self.slope }
        } else {
            *self
        }
    }
}

/// Identity of a piece or a kink of a curve; the next step starts looking there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Tag {
    /// The motor follows its law.
    Law,
    /// At the largest or smallest torque.
    High,
    Low,
    /// At the largest or smallest voltage of the supply.
    SupplyHigh,
    SupplyLow,
    /// At the largest or smallest current.
    CurrentHigh,
    CurrentLow,
    /// Held by the losses of the gear.
    Gear,
    /// Held by friction.
    Friction,
    /// At an end stop.
    LowerLimit,
    UpperLimit,
    /// Held by the brake.
    Brake,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Piece {
    line: Line,
    tag: Tag,
}

/// Position of an axis on a curve.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Mode {
    /// Not known yet.
    Free,
    /// On line number `index`.
    Line { index: usize, tag: Tag },
    /// On the vertical piece of kink number `index`.
    Kink { index: usize, tag: Tag },
}

impl Mode {
    pub fn tag(self) -> Option<Tag> {
        match self {
            Self::Free => None,
            Self::Line { tag, .. } | Self::Kink { tag, .. } => Some(tag),
        }
    }
}

/// Rates nearer than this to a kink count as at it, rad/s or m/s.
pub(crate) const RATE_TOLERANCE: f64 = 1e-10;

/// The graph: line i holds between kinks i − 1 and i.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Curve {
    count: usize,
    kinks: [(f64, Tag); KINKS],
    pieces: [Piece; KINKS + 1],
}

impl Curve {
    /// One line.
    pub fn line(line: Line, tag: Tag) -> Self {
        Self { count: 0, kinks: [(0.0, tag); KINKS], pieces: [Piece { line, tag }; KINKS + 1] }
    }

    /// Becomes one line.
    pub fn assign_line(&mut self, line: Line, tag: Tag) {
        self.count = 0;
        self.pieces[0] = Piece { line, tag };
    }

    /// Becomes a line between the levels ± `bound`.
    pub fn assign_bounded(&mut self, line: Line, bound: f64) {
        let Line { at_zero, slope } = line;
        if slope <= 0.0 {
            let tag = match at_zero {
                a if a > bound => Tag::High,
                a if a < -bound => Tag::Low,
                _ => Tag::Law,
            };
            return self.assign_line(Line::level(at_zero.min(bound).max(-bound)), tag);
        }
        self.assign_line(Line::level(bound), Tag::High);
        self.push(((at_zero - bound) / slope, Tag::High), line, Tag::Law);
        self.push(((at_zero + bound) / slope, Tag::Low), Line::level(-bound), Tag::Low);
    }

    /// Becomes another one; only the parts in use are copied.
    pub fn assign(&mut self, other: &Self) {
        self.count = other.count;
        self.kinks[..self.count].copy_from_slice(&other.kinks[..self.count]);
        self.pieces[..=self.count].copy_from_slice(&other.pieces[..=self.count]);
    }

    /// Any impulse at one rate.
    pub fn rigid(rate: f64, tag: Tag) -> Self {
        let mut curve = Self::line(Line::level(f64::INFINITY), tag);
        curve.push((rate, tag), Line::level(f64::NEG_INFINITY), tag);
        curve
    }

    /// Straight between points in ascending order of the rate, level beyond them.
    pub fn polygon(points: &[(f64, f64)], tag: Tag) -> Self {
        let (Some(first), Some(last)) = (points.first(), points.last()) else {
            return Self::line(Line::ZERO, tag);
        };
        let mut curve = Self::line(Line::level(first.1), tag);
        for pair in points.windows(2) {
            let ((u, a), (v, b)) = (pair[0], pair[1]);
            let slope = (a - b) / (v - u);
            curve.push((u, tag), Line { at_zero: a + slope * u, slope }, tag);
        }
        curve.push((last.0, tag), Line::level(last.1), tag);
        curve
    }

    /// Tag of the line at a rate.
    pub fn tag_at(&self, u: f64) -> Tag {
        self.pieces[self.index_at(u)].tag
    }

    /// Adds a kink on the right and the line behind it.
    pub fn push(&mut self, kink: (f64, Tag), line: Line, tag: Tag) {
        if self.count < KINKS {
            self.kinks[self.count] = kink;
            self.count += 1;
            self.pieces[self.count] = Piece { line, tag };
        }
    }

    fn range(&self, i: usize) -> (f64, f64) {
        let low = if i == 0 { f64::NEG_INFINITY } else { self.kinks[i - 1].0 };
        let high = if i == self.count { f64::INFINITY } else { self.kinks[i].0 };
        (low, high)
    }

    /// Index of the line at a rate; at a kink the one on its left.
    fn index_at(&self, u: f64) -> usize {
        self.kinks[..self.count].partition_point(|k| k.0 < u)
    }

    /// Makes sure that there is a kink at `u`; its number.
    fn split(&mut self, u: f64, tag: Tag) -> usize {
        let i = self.index_at(u);
        if i < self.count && self.kinks[i].0 == u || self.count == KINKS {
            return i.min(self.count.saturating_sub(1));
        }
        self.kinks.copy_within(i..self.count, i + 1);
        self.pieces.copy_within(i..=self.count, i + 1);
        self.kinks[i] = (u, tag);
        self.count += 1;
        i
    }

    /// Replaces every part above (true) or below (false) `by`.
    fn cut(&self, by: Line, mut choose: impl FnMut(Piece, bool, f64) -> Piece, tag: Tag) -> Self {
        let mut out: Option<Self> = None;
        let mut emit = |kink: (f64, Tag), piece: Piece| match &mut out {
            None => out = Some(Self { pieces: [piece; KINKS + 1], ..Self::line(piece.line, piece.tag) }),
            Some(curve) => {
                if curve.pieces[curve.count] != piece {
                    curve.push(kink, piece.line, piece.tag);
                }
            }
        };
        for i in 0..=self.count {
            let (low, high) = self.range(i);
            let piece = self.pieces[i];
            let start = if i == 0 { (low, tag) } else { self.kinks[i - 1] };
            let slopes = piece.line.slope - by.slope;
            let crossing = (piece.line.at_zero - by.at_zero) / slopes;
            if slopes != 0.0 && crossing > low && crossing < high {
                let inside = |a: f64, b: f64| middle(a, b);
                emit(start, choose(piece, slopes > 0.0, inside(low, crossing)));
                emit((crossing, tag), choose(piece, slopes < 0.0, inside(crossing, high)));
            } else {
                let u = middle(low, high);
                emit(start, choose(piece, piece.line.at(u) > by.at(u), u));
            }
        }
        out.unwrap_or(*self)
    }

    /// The smaller of the curve and a line.
    pub fn at_most(&self, line: Line, tag: Tag) -> Self {
        self.cut(line, |piece, above, _| if above { Piece { line, tag } } else { piece }, tag)
    }

    /// The larger of the curve and a line.
    pub fn at_least(&self, line: Line, tag: Tag) -> Self {
        self.cut(line, |piece, above, _| if above { piece } else { Piece { line, tag } }, tag)
    }

    /// All impulses times a factor that depends on their sign and that of the rate: `factor(driving)`.
    pub fn through_gear(&self, factor: impl Fn(bool) -> f64) -> Self {
        let mut split = *self;
        split.split(0.0, Tag::Gear);
        let scale = |piece: Piece, above: bool, u: f64| Piece {
            line: piece.line.times(factor(above == (u > 0.0))),
            ..piece
        };
        split.cut(Line::ZERO, scale, Tag::Gear)
    }

    /// All impulses times a factor.
    pub fn times(mut self, factor: f64) -> Self {
        self.pieces[..=self.count].iter_mut().for_each(|p| p.line = p.line.times(factor));
        self
    }

    /// The sum with a line.
    pub fn add_line(&mut self, line: Line) {
        self.pieces[..=self.count].iter_mut().for_each(|p| p.line = p.line.plus(&line));
    }

    /// The sum with a step from `left` down to `right` at the rate `u`.
    pub fn add_step(&mut self, u: f64, left: f64, right: f64, tag: Tag) {
        let k = self.split(u, tag);
        self.kinks[k].1 = tag;
        for (i, piece) in self.pieces[..=self.count].iter_mut().enumerate() {
            piece.line = piece.line.plus(&Line::level(if i <= k { left } else { right }));
        }
    }

    /// The sum with a curve.
    pub fn add(&mut self, other: &Self) {
        for (u, tag) in &other.kinks[..other.count] {
            self.split(*u, *tag);
        }
        for i in 0..=self.count {
            let (low, high) = self.range(i);
            let line = other.pieces[other.index_at(middle(low, high))].line;
            self.pieces[i].line = self.pieces[i].line.plus(&line);
        }
    }

    /// Impulses just left and just right of a rate: the largest and the smallest possible there.
    pub fn span(&self, u: f64) -> (f64, f64) {
        let left = self.kinks[..self.count].partition_point(|k| k.0 < u - RATE_TOLERANCE);
        let right = self.kinks[..self.count].partition_point(|k| k.0 <= u + RATE_TOLERANCE);
        (self.pieces[left].line.at(u), self.pieces[right].line.at(u))
    }

    /// Impulse at a rate; where there is a choice, the smallest in magnitude.
    pub fn value(&self, u: f64) -> f64 {
        let (high, low) = self.span(u);
        if low.is_finite() || high.is_finite() { 0.0_f64.max(low).min(high) } else { 0.0 }
    }

    /// (compliance, right-hand side) of the row of a mode; none: no row.
    pub fn row(&self, mode: Mode) -> Option<(f64, f64)> {
        match mode {
            Mode::Line { index, .. } => {
                let Line { at_zero, slope } = self.pieces[index].line;
                (slope > 0.0).then(|| (1.0 / slope, at_zero / slope))
            }
            Mode::Kink { index, .. } => Some((0.0, self.kinks[index].0)),
            Mode::Free => None,
        }
    }

    /// Impulse that acts from outside in a mode without a row.
    pub fn impulse(&self, mode: Mode) -> f64 {
        match mode {
            Mode::Line { index, .. } if self.pieces[index].line.slope <= 0.0 => {
                self.pieces[index].line.at_zero
            }
            _ => 0.0,
        }
    }

    fn on_line(&self, index: usize) -> Mode {
        Mode::Line { index, tag: self.pieces[index].tag }
    }

    fn on_kink(&self, index: usize) -> Mode {
        Mode::Kink { index, tag: self.kinks[index].1 }
    }

    fn is_vertical(&self, k: usize) -> bool {
        let u = self.kinks[k].0;
        let (left, right) = (self.pieces[k].line.at(u), self.pieces[k + 1].line.at(u));
        left - right > self.slack(k, k + 1)
    }

    /// Rounding of impulses near two lines.
    fn slack(&self, i: usize, k: usize) -> f64 {
        let size =
            |i: usize| Some(self.pieces[i].line.at_zero.abs()).filter(|a| a.is_finite()).unwrap_or(0.0);
        1e-13 * (size(i) + size(k))
    }

    /// Position of the axis at a rate.
    fn locate(&self, u: f64) -> Mode {
        let i = self.index_at(u);
        let line = |i: usize| self.pieces[i].line.at_zero;
        // beyond a stop: to the stop, past kinks of what acts beside it
        let up = (i..self.count).find(|k| line(k + 1) < f64::INFINITY);
        let down = (0..i).rev().find(|k| line(*k) > f64::NEG_INFINITY);
        match (line(i), up, down) {
            (f64::INFINITY, Some(k), _) | (f64::NEG_INFINITY, _, Some(k)) => self.on_kink(k),
            _ => self.on_line(i),
        }
    }

    /// The mode to begin with: the last one, nearest to the last rate.
    pub fn start(&self, last: Mode, rate: f64) -> Mode {
        let Some(wanted) = last.tag() else { return self.first(rate) };
        let kinks = (0..self.count).filter(|k| self.kinks[*k].1 == wanted && self.is_vertical(*k));
        let lines = (0..=self.count)
            .filter(|i| self.pieces[*i].tag == wanted && self.pieces[*i].line.at_zero.is_finite());
        let away = |i: usize| {
            let (low, high) = self.range(i);
            (low - rate).max(rate - high).max(0.0)
        };
        let lines = lines.map(|i| (self.on_line(i), away(i)));
        let kinks = kinks.map(|k| (self.on_kink(k), (self.kinks[k].0 - rate).abs()));
        let kinked = matches!(last, Mode::Kink { .. });
        let best = lines.chain(kinks).min_by(|a, b| {
            let same = |m: &Mode| matches!(m, Mode::Kink { .. }) != kinked;
            same(&a.0).cmp(&same(&b.0)).then(a.1.total_cmp(&b.1))
        });
        best.map_or_else(|| self.first(rate), |(mode, _)| mode)
    }

    /// Without memory: on the motor's law where it has one.
    fn first(&self, rate: f64) -> Mode {
        let law = (0..self.count).find(|k| self.kinks[*k].1 == Tag::Law && self.is_vertical(*k));
        match law {
            Some(k) => self.on_kink(k),
            None => self.start_on_law(rate),
        }
    }

    fn start_on_law(&self, rate: f64) -> Mode {
        let away = |i: &usize| {
            let (low, high) = self.range(*i);
            (low - rate).max(rate - high).max(0.0)
        };
        (0..=self.count)
            .filter(|i| self.pieces[*i].tag == Tag::Law && self.pieces[*i].line.at_zero.is_finite())
            .min_by(|a, b| away(a).total_cmp(&away(b)))
            .map_or_else(|| self.locate(rate), |i| self.on_line(i))
    }

    /// The mode on which (u, λ), the solution in `mode`, belongs.
    pub fn next(&self, mode: Mode, u: f64, lambda: f64) -> Mode {
        match mode {
            Mode::Free => self.locate(u),
            Mode::Kink { index, .. } => {
                let at = self.kinks[index].0;
                let (left, right) = (self.pieces[index].line.at(at), self.pieces[index + 1].line.at(at));
                let slack = self.slack(index, index + 1);
                if lambda > left + slack {
                    self.on_line(index)
                } else if lambda < right - slack {
                    self.on_line(index + 1)
                } else {
                    mode
                }
            }
            Mode::Line { index, .. } => {
                let (low, high) = self.range(index);
                if u > high {
                    self.walk(mode, index, u, 1)
                } else if u < low {
                    self.walk(mode, index, u, -1)
                } else {
                    mode
                }
            }
        }
    }

    /// From line `from` towards `u`: to the line there, or to the first vertical or steeper piece on the way. A
    /// solution found on a level line may lie far beyond a steep one and yet belong there.
    fn walk(&self, mode: Mode, from: usize, u: f64, direction: isize) -> Mode {
        let up = direction > 0;
        let mut i = from;
        loop {
            let end = if up { i == self.count } else { i == 0 };
            let k = if up { i } else { i.wrapping_sub(1) };
            if end || (self.kinks[k].0 - u) * direction as f64 >= 0.0 {
                break;
            }
            if self.is_vertical(k) {
                let near = (u - self.kinks[k].0).abs() <= RATE_TOLERANCE;
                return if near && i == from { mode } else { self.on_kink(k) };
            }
            i = i.wrapping_add_signed(direction);
            if self.pieces[i].line.slope > self.pieces[from].line.slope {
                break;
            }
        }
        // By how much the impulse is wrong on the line where it is now.
        let wrong = (self.pieces[i].line.at(u) - self.pieces[from].line.at(u)).abs();
        if wrong <= self.slack(i, from) { mode } else { self.on_line(i) }
    }
}

/// A rate between two others.
fn middle(low: f64, high: f64) -> f64 {
    match (low.is_finite(), high.is_finite()) {
        (true, true) => low + 0.5 * (high - low),
        (true, false) => low + low.abs().max(1.0),
        (false, true) => high - high.abs().max(1.0),
        (false, false) => 0.0,
    }
}

terraglue_subsystem::persist!(
    enum Tag {
        Law,
        High,
        Low,
        SupplyHigh,
        SupplyLow,
        CurrentHigh,
        CurrentLow,
        Gear,
        Friction,
        LowerLimit,
        UpperLimit,
        Brake,
    }
);

impl Persist for Mode {
    fn write(&self, out: &mut Vec<u8>) {
        let (name, place) = match self {
            Self::Free => (0_u8, None),
            Self::Line { index, tag } => (1, Some((*index, *tag))),
            Self::Kink { index, tag } => (2, Some((*index, *tag))),
        };
        (name, place).write(out);
    }
    fn read(from: &mut &[u8]) -> Result<Self> {
        match <(u8, Option<(usize, Tag)>)>::read(from)? {
            (0, None) => Ok(Self::Free),
            (1, Some((index, tag))) if index <= KINKS => Ok(Self::Line { index, tag }),
            (2, Some((index, tag))) if index < KINKS => Ok(Self::Kink { index, tag }),
            _ => Err(bytes::wrong("a motor has no such branch")),
        }
    }
}

/// Whether two rates count as the same.
pub(crate) fn at_rest(u: f64) -> bool {
    u.abs() <= RATE_TOLERANCE
}

#[cfg(test)]
#[path = "../../tests/unit/curve.rs"]
mod tests;
