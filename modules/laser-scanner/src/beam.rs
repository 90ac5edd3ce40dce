//! A beam with an extent: the rays that stand for its cross-section, and the returns that their hits make.
//!
//! The light of a beam is that of a Gaussian, w wide where it has fallen to 1/e². Seven rays stand for it, one in the middle with half of the light
//! and six at w with a twelfth each: Stroud's rule for that weight, exact to the fifth degree (Stroud, "Approximate calculation of multiple
//! integrals", 1971, E2^r² 5-1). Hits along the pulse that are nearer to each other than it can resolve come back as one, at the mean of their
//! distances by their light: so edges have points between the surfaces in front and behind, as real scans have.

use terraglue_numerics::rotation::{cross, length};
use terraglue_subsystem::RayHit;

/// Which return of a pulse is reported.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Returns {
    /// That with the most light.
    Strongest,
    /// The nearest one.
    First,
    /// The farthest one.
    Last,
}

impl Returns {
    /// Names in scenarios.
    pub const NAMES: [&'static str; 3] = ["strongest", "first", "last"];

    /// By its name.
    pub fn named(name: &str) -> Option<Self> {
        let place = Self::NAMES.iter().position(|n| *n == name)?;
        [Self::Strongest, Self::First, Self::Last].get(place).copied()
    }
}

/// A beam and what is made of its light.
///
/// ```
/// use terraglue_laser_scanner::Beam;
/// assert_eq!(Beam::LINE.rays(), 1);
/// assert_eq!(Beam { divergence_rad: 3e-3, ..Beam::LINE }.rays(), 7);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beam {
    /// Full angle at which the light has fallen to 1/e², rad; 0: a line.
    pub divergence_rad: f64,
    /// Hits that are nearer to each other along the beam come back as one, m.
    pub pulse_m: f64,
    /// Least share of the light that must come back.
    pub threshold: f64,
    /// Which return is reported.
    pub returns: Returns,
}

/// The share of the light that one ray has, and what of it is left behind the surfaces that it has passed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Light {
    /// Number of the beam among those that are cast together.
    pub beam: usize,
    /// When the beam is fired, s.
    pub time: f64,
    /// Distance of the start of the ray from the scanner, m.
    pub from: f64,
    /// Share of the light of the beam.
    pub share: f64,
}

/// Light of a beam that comes back from one place.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Echo {
    pub beam: usize,
    /// When the beam was fired, s.
    pub time: f64,
    /// From the scanner, m.
    pub distance: f64,
    /// Cosine of the angle of incidence.
    pub cosine: f64,
    /// Share of the light of the beam that comes back.
    pub light: f64,
    pub hit: RayHit,
}

impl Beam {
    /// A line, of which every hit is reported.
    pub const LINE: Self =
        Self { divergence_rad: 0.0, pulse_m: 0.6, threshold: 0.0, returns: Returns::Strongest };

    /// Rays that stand for it.
    pub fn rays(&self) -> usize {
        if self.divergence_rad > 0.0 { 7 } else { 1 }
    }

    /// Directions of its rays and their shares of the light; the first one is `direction`, a unit vector.
    pub fn samples(&self, direction: [f64; 3]) -> impl Iterator<Item = ([f64; 3], f64)> {
        let radius = libm::tan(0.5 * self.divergence_rad);
        // any two directions across, by the axis that the beam is farthest from
        let [x, y, z] = direction.map(f64::abs);
        let axis = if z <= x.min(y) {
            [0.0, 0.0, 1.0]
        } else if y <= x {
            [0.0, 1.0, 0.0]
        } else {
            [1.0, 0.0, 0.0]
        };
        let u = unit(cross(axis, direction));
        let v = cross(direction, u);
        let rays = self.rays();
        (0..rays).map(move |k| {
            if k == 0 {
                return (direction, if rays == 1 { 1.0 } else { 0.5 });
            }
            let angle = std::f64::consts::TAU * k as f64 / 6.0;
            let (s, c) = (radius * libm::sin(angle), radius * libm::cos(angle));
            (unit([0, 1, 2].map(|i| direction[i] + c * u[i] + s * v[i])), 1.0 / 12.0)
        })
    }

    /// The return that is reported of the echoes of one beam, which it sorts by distance; none: too little light comes back.
    pub(crate) fn reported(&self, echoes: &mut [Echo]) -> Option<Echo> {
        echoes.sort_by(|a, b| a.distance.total_cmp(&b.distance));
        let mut rest = &*echoes;
        let mut best: Option<Echo> = None;
        while let Some(first) = rest.first() {
            let near = rest.iter().take_while(|e| e.distance - first.distance <= self.pulse_m).count();
            let (own, behind) = rest.split_at(near);
            rest = behind;
            let told = joined(own);
            if told.light < self.threshold {
                continue;
            }
            match (self.returns, best) {
                (Returns::First, Some(_)) => break,
                (Returns::Strongest, Some(other)) if told.light <= other.light => {}
                _ => best = Some(told),
            }
        }
        best
    }
}

/// One echo of those that the pulse does not tell apart: the mean by light, on the surface that most of it comes from.
fn joined(own: &[Echo]) -> Echo {
    let strongest = own.iter().fold(own[0], |a, b| if b.light > a.light { *b } else { a });
    let light: f64 = own.iter().map(|e| e.light).sum();
    if own.len() == 1 || light <= 0.0 {
        return strongest;
    }
    let mean = |of: fn(&Echo) -> f64| own.iter().map(|e| e.light * of(e)).sum::<f64>() / light;
    Echo { light, distance: mean(|e| e.distance), cosine: mean(|e| e.cosine), ..strongest }
}

fn unit(v: [f64; 3]) -> [f64; 3] {
    let size = length(v);
    v.map(|x| x / size)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn echo(distance: f64, light: f64) -> Echo {
        Echo { beam: 0, time: 0.0, distance, cosine: 1.0, light, hit: RayHit { distance, ..RayHit::MISS } }
    }

    #[test]
    fn samples_are_unit_vectors_with_all_the_light_and_its_spread() {
        let beam = Beam { divergence_rad: 4e-3, ..Beam::LINE };
        for direction in [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [0.6, 0.0, -0.8]] {
            let all: Vec<_> = beam.samples(direction).collect();
            let dot = |a: [f64; 3], b: [f64; 3]| (0..3).map(|k| a[k] * b[k]).sum::<f64>();
            assert!((all.iter().map(|(_, share)| share).sum::<f64>() - 1.0).abs() < 1e-15);
            assert!(all.iter().all(|(d, _)| (dot(*d, *d) - 1.0).abs() < 1e-14));
            // mean square of the distance from the axis: w²/2 of a Gaussian beam
            let spread: f64 = all.iter().map(|(d, share)| share * (1.0 - dot(*d, direction).powi(2))).sum();
            assert!((spread - 0.5 * 2e-3_f64.powi(2)).abs() < 1e-10, "{spread}");
        }
    }

    #[test]
    fn the_return_that_is_asked_for_is_reported() {
        let of = |returns, threshold| {
            let beam = Beam { returns, threshold, ..Beam::LINE };
            beam.reported(&mut [echo(12.0, 0.1), echo(5.0, 0.05), echo(8.0, 0.2)]).map(|e| e.distance)
        };
        assert_eq!(of(Returns::Strongest, 0.0), Some(8.0));
        assert_eq!(of(Returns::First, 0.0), Some(5.0));
        assert_eq!(of(Returns::First, 0.06), Some(8.0));
        assert_eq!(of(Returns::Last, 0.0), Some(12.0));
        assert_eq!(of(Returns::Last, 0.15), Some(8.0));
        assert_eq!(of(Returns::Last, 0.3), None);
    }

    #[test]
    fn what_the_pulse_does_not_tell_apart_is_mixed() {
        let beam = Beam { pulse_m: 0.6, ..Beam::LINE };
        let told = beam.reported(&mut [echo(10.4, 0.1), echo(10.0, 0.3)]).expect("a return");
        assert!((told.distance - 10.1).abs() < 1e-12 && (told.light - 0.4).abs() < 1e-15);
        assert_eq!(told.hit.distance, 10.0);
    }
}
