//! First loading goes on straight where a user's law would be stiffer than unloading.
//!
//! Soil keeps the part of the work of first loading under its elastic line: ∫(1 − p'/k_u)·p dz becomes heat. Where p' > k_u
//! this is negative, so that pressing and releasing would yield energy. The pressure is therefore the largest one below the
//! law whose slope stays below k_u: where the law is too steep it follows a line, up to where the law comes back to it.

/// Largest slope of first loading over that of unloading.
pub(crate) const STIFFEST: f64 = 0.99;
/// Lines of a law; the last one does not end.
const LINES: usize = 3;
/// Depths at which a law is evaluated beyond the elastic limit, denser near 0.
const DEPTHS: usize = 63;
/// The deepest of them, m: no node remembers more.
const DEEPEST: f64 = 1.0;
/// First depth of evaluation of a law without elastic limit, m.
const SHALLOWEST: f64 = 1e-9;
/// Halvings of the distance between two depths.
const HALVINGS: usize = 60;

/// Pressures (Pa) and slopes (Pa/m) of a law at several depths (m); a value that is not finite ends the search.
type Look<'a> = dyn Fn(&[f64], &mut [f64], &mut [f64]) + 'a;

#[derive(Clone, Copy, Debug, PartialEq)]
struct Line {
    from: f64,
    p: f64,
    to: f64,
}

/// The lines of one curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Straight {
    slope: f64,
    lines: [Line; LINES],
}

/// A law at a row of depths.
struct DepthSamples {
    count: usize,
    z: [f64; DEPTHS + 1],
    p: [f64; DEPTHS + 1],
    slope: [f64; DEPTHS + 1],
}

impl DepthSamples {
    fn of(law: &Look, elastic_limit: f64) -> Self {
        let mut row = Self { count: 1, z: [0.0; _], p: [0.0; _], slope: [0.0; _] };
        row.z[0] = elastic_limit.max(SHALLOWEST);
        for k in 1..=DEPTHS {
            let share = k as f64 / DEPTHS as f64;
            let z = DEEPEST * share * share * share;
            if z > row.z[0] {
                row.z[row.count] = z;
                row.count += 1;
            }
        }
        let n = row.count;
        law(&row.z[..n], &mut row.p[..n], &mut row.slope[..n]);
        let finite = |k: &usize| row.p[*k].is_finite() && row.slope[*k].is_finite();
        row.count = (0..n).find(|k| !finite(k)).unwrap_or(n);
        row
    }

    /// Number k of the first depth from `first` on before or at which the law is steeper than `slope`.
    fn steep(&self, slope: f64, first: usize) -> Option<usize> {
        let rises = |k: usize| self.p[k] - self.p[k - 1] > slope * (self.z[k] - self.z[k - 1]);
        (first.max(1)..self.count).find(|k| self.slope[*k - 1] > slope || self.slope[*k] > slope || rises(*k))
    }
}

impl Straight {
    /// A law that needs none.
    pub(crate) const NONE: Self =
        Self { slope: 0.0, lines: [Line { from: f64::INFINITY, p: 0.0, to: f64::INFINITY }; LINES] };

    /// The lines of a law beyond its elastic limit (m) above unloading with `k_u` (Pa/m).
    pub(crate) fn find(law: &Look, elastic_limit: f64, k_u: f64) -> Self {
        let mut out = Self { slope: STIFFEST * k_u, ..Self::NONE };
        let row = DepthSamples::of(law, elastic_limit);
        let mut next = 1;
        for number in 0..LINES {
            let Some(k) = row.steep(out.slope, next) else { break };
            let from = onset(law, out.slope, &row, k);
            let line = Line { from, p: at(law, from).0, to: f64::INFINITY };
            let over = |z: f64, p: f64| line.p + out.slope * (z - from) >= p;
            let end = (k..row.count).find(|k| over(row.z[*k], row.p[*k]));
            out.lines[number] = line;
            let Some(end) = end.filter(|_| number + 1 < LINES) else { break };
            let start = row.z[end - 1].max(from);
            out.lines[number].to = halve(start, row.z[end], |z| !over(z, at(law, z).0));
            next = end + 1;
        }
        out
    }

    /// Depth from which the first line goes, m; infinite where there is none.
    #[inline]
    pub(crate) fn begin(&self) -> f64 {
        self.lines[0].from
    }

    /// Pressure and slope at the depth z, where the law answers `own`.
    #[inline]
    pub(crate) fn bend(&self, z: f64, own: (f64, f64)) -> (f64, f64) {
        match self.lines.iter().find(|line| z > line.from && z < line.to) {
            Some(line) => (line.p + self.slope * (z - line.from), self.slope),
            None => own,
        }
    }
}

fn at(law: &Look, z: f64) -> (f64, f64) {
    let (mut p, mut slope) = ([0.0], [0.0]);
    law(&[z], &mut p, &mut slope);
    (p[0], slope[0])
}

/// The last depth between two at which `holds`, which holds at the first.
fn halve(mut low: f64, mut high: f64, holds: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if !(middle > low && middle < high) {
            break;
        }
        if holds(middle) { low = middle } else { high = middle }
    }
    low
}

/// Depth before number k at which the law becomes steeper than `slope`.
fn onset(law: &Look, slope: f64, row: &DepthSamples, k: usize) -> f64 {
    let (before, after) = (row.z[k - 1], row.z[k]);
    if row.slope[k - 1] > slope || row.slope[k] <= slope {
        return before;
    }
    halve(before, after, |z| at(law, z).1 <= slope)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A law by its pressure and slope.
    fn each(own: impl Fn(f64) -> (f64, f64)) -> impl Fn(&[f64], &mut [f64], &mut [f64]) {
        move |z, p, slope| z.iter().zip(p).zip(slope).for_each(|((z, p), s)| (*p, *s) = own(*z))
    }

    /// Soft down to 2 cm, a hard layer of 5 mm, soft again.
    fn layered(z: f64) -> (f64, f64) {
        match z {
            z if z < 0.02 => (1e5 * z, 1e5),
            z if z < 0.025 => (2e3 + 1e8 * (z - 0.02), 1e8),
            z => (2e3 + 5e5 + 1e5 * (z - 0.025), 1e5),
        }
    }

    #[test]
    fn a_hard_layer_is_crossed_on_a_line_that_comes_back_to_the_law() {
        let straight = Straight::find(&each(layered), 0.0, 1e7);
        let [line, none, _] = straight.lines;
        assert!((line.from - 0.02).abs() < 1e-9 && none.from == f64::INFINITY, "{straight:?}");
        let to = (2e3 + 5e5 - 0.025e5 - line.p + 0.99e7 * line.from) / (0.99e7 - 1e5);
        assert!((line.to - to).abs() < 1e-9, "{} {to}", line.to);
        let mut before = 0.0;
        for k in 0..=4000 {
            let z = 2.5e-5 * f64::from(k);
            let (p, slope) = straight.bend(z, layered(z));
            assert!(
                p <= layered(z).0 + 1e-3 && p >= before && p - before <= 0.99e7 * 2.5e-5 + 1e-3,
                "{z}: {p}"
            );
            assert!(slope <= 0.99e7);
            before = p;
        }
    }

    #[test]
    fn a_step_between_the_depths_looked_at_is_found() {
        let step = |z: f64| (1e5 * z + 1e5 * libm::tanh(1e5 * (z - 0.1)), 1e5);
        let straight = Straight::find(&each(step), 0.0, 1e6);
        assert!(straight.begin() < 0.1 && straight.begin() > 0.08, "{straight:?}");
    }

    #[test]
    fn the_look_ends_where_a_law_has_no_answer() {
        let short = |z: f64| if z < 0.1 { (1e5 * z, 1e5) } else { (f64::NAN, f64::NAN) };
        assert_eq!(Straight::find(&each(short), 0.0, 1e6).begin(), f64::INFINITY);
    }
}
