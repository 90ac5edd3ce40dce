//! From the true distance of a ray to the reported range: noise, bias, limits and drop-out, each drawn from the number of the ray.

use terraglue_numerics::random::{mixed, normal, uniform};

/// Errors of a ray.
///
/// ```
/// use terraglue_laser_scanner::RayErrors;
/// let exact = RayErrors::NONE;
/// assert_eq!(exact.range(1, 5, 12.0, 0.9), Some(12.0));
/// let lossy = RayErrors { drop_out: 1.0, ..exact };
/// assert_eq!(lossy.range(1, 5, 12.0, 0.9), None);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayErrors {
    /// Deviation of a range at the scanner, m.
    pub noise_m: f64,
    /// Growth of that deviation with range, m/m.
    pub noise_per_m: f64,
    /// Deviation of azimuth and of elevation, rad.
    pub angle_rad: f64,
    /// Added to all ranges, m.
    pub bias_m: f64,
    /// Deviation of what is added to all ranges of a beam, m.
    pub beam_bias_m: f64,
    /// Smallest and largest range that is reported, m.
    pub limits_m: [f64; 2],
    /// Probability that a ray is lost.
    pub drop_out: f64,
    /// Probability per metre of range that a ray is lost, in addition, 1/m.
    pub drop_out_per_m: f64,
    /// Probability that a ray along a surface is lost: it grows with (1 − cos i)² of the angle of incidence i.
    pub drop_out_grazing: f64,
}

/// Channels of a ray that are drawn apart.
const RANGE: u64 = 1;
const LOSS: u64 = 2;
const AZIMUTH: u64 = 3;
const ELEVATION: u64 = 4;
const BEAM: u64 = 5;

impl RayErrors {
    /// None at all, 0.3 … 120 m.
    pub const NONE: Self = Self {
        noise_m: 0.0,
        noise_per_m: 0.0,
        angle_rad: 0.0,
        bias_m: 0.0,
        beam_bias_m: 0.0,
        limits_m: [0.3, 120.0],
        drop_out: 0.0,
        drop_out_per_m: 0.0,
        drop_out_grazing: 0.0,
    };

    /// Range that the ray with this number reports of a surface at a distance, m, under this cosine of the angle of incidence;
    /// none: it is lost.
    pub fn range(&self, seed: u64, ray: u64, distance: f64, cosine: f64) -> Option<f64> {
        let place = mixed(ray);
        let lost = self.loss(distance, cosine) > uniform(seed ^ LOSS, place);
        let spread = self.noise_m + self.noise_per_m * distance;
        let noise = if spread > 0.0 { spread * normal(seed ^ RANGE, place) } else { 0.0 };
        let told = distance + self.bias_m + noise;
        let [near, far] = self.limits_m;
        (!lost && told >= near && told <= far).then_some(told)
    }

    /// Probability that a ray is lost.
    pub fn loss(&self, distance: f64, cosine: f64) -> f64 {
        let grazing = 1.0 - cosine.abs().min(1.0);
        self.drop_out + self.drop_out_per_m * distance + self.drop_out_grazing * grazing * grazing
    }

    /// What is added to all ranges of a beam, m: drawn once for a scanner, as a calibration leaves it.
    pub fn of_beam(&self, seed: u64, ring: u32) -> f64 {
        if self.beam_bias_m == 0.0 {
            return 0.0;
        }
        self.beam_bias_m * normal(seed ^ BEAM, mixed(u64::from(ring)))
    }

    /// By how much a ray looks aside, in azimuth and in elevation, rad.
    pub fn angles(&self, seed: u64, ray: u64) -> [f64; 2] {
        if self.angle_rad == 0.0 {
            return [0.0; 2];
        }
        let place = mixed(ray);
        [AZIMUTH, ELEVATION].map(|channel| self.angle_rad * normal(seed ^ channel, place))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_out_of_range_is_not_told() {
        let errors = RayErrors { limits_m: [1.0, 10.0], ..RayErrors::NONE };
        assert_eq!(errors.range(1, 1, 0.5, 1.0), None);
        assert_eq!(errors.range(1, 1, 11.0, 1.0), None);
        assert_eq!(errors.range(1, 1, f64::INFINITY, 1.0), None);
        assert_eq!(errors.range(1, 1, f64::NAN, 1.0), None);
    }
}
