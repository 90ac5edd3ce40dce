//! Rigid wheel on soil by integration of the stresses below the rim (Wong and Reece 1967, J. Terramechanics 4),
//! with Bekker's pressure and the shear of Janosi and Hanamoto: the model that wheels are fitted with and compared with.
//!
//! Angles are counted from the lowest point of the rim, positive where soil enters. The wheel enters the soil at θ_f
//! = arccos(1 − h/r) and leaves it at 0, or a little behind where the soil springs back; the largest stress lies at θ_m =
//! (a0 + a1·s)·θ_f.

/// A wheel on a soil.
#[derive(Clone, Copy, Debug)]
pub struct Rim {
    /// Radius, m.
    pub radius: f64,
    /// Width, m.
    pub width: f64,
    /// k_c/b + k_φ, Pa/mⁿ.
    pub modulus: f64,
    /// Exponent n.
    pub n: f64,
    /// Cohesion, Pa.
    pub cohesion: f64,
    /// tan φ.
    pub friction: f64,
    /// Shear deformation modulus K, m.
    pub shear: f64,
    /// a0 and a1.
    pub peak: [f64; 2],
    /// Stiffness with which the soil springs back behind the lowest point, Pa/m; infinite: the wheel leaves it there.
    pub unloading: f64,
    /// Points of Simpson's rule on each side of the largest stress, even.
    pub points: usize,
}

/// State of a wheel at a sinkage, per integral.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rolling {
    /// Sinkage, m.
    pub sinkage: f64,
    /// Vertical force, N.
    pub load: f64,
    /// Drawbar pull, N.
    pub pull: f64,
    /// Torque, N m.
    pub torque: f64,
}

impl Rim {
    /// The state in which the wheel carries `load` (N) at the slip `s`: a bracketed secant (Illinois) in the sinkage. A wheel that
    /// not even its radius of sinkage carries stands that deep.
    pub fn under(&self, load: f64, slip: f64) -> Rolling {
        let missing = |h: f64| self.at(h, slip).load - load;
        let (mut low, mut high) = (0.0, self.radius);
        let (mut below, mut above, mut side) = (-load, missing(high), 0);
        if above <= 0.0 {
            return self.at(high, slip);
        }
        for _ in 0..100 {
            let guess = (low * above - high * below) / (above - below);
            let h = if guess > low && guess < high { guess } else { 0.5 * (low + high) };
            let now = missing(h);
            if now.abs() <= 1e-12 * load || high - low <= 1e-15 * self.radius {
                return self.at(h, slip);
            }
            // the end that stays for a second time counts half
            if now < 0.0 {
                (low, below, above, side) = (h, now, if side < 0 { 0.5 * above } else { above }, -1);
            } else {
                (high, above, below, side) = (h, now, if side > 0 { 0.5 * below } else { below }, 1);
            }
        }
        self.at(0.5 * (low + high), slip)
    }

    /// The integrals at the sinkage h (m) and the slip `s`.
    pub fn at(&self, h: f64, slip: f64) -> Rolling {
        let front = (1.0 - h / self.radius).acos();
        let middle = ((self.peak[0] + self.peak[1] * slip) * front).clamp(0.0, front);
        let mut sum = Rolling { sinkage: h, ..Rolling::default() };
        // squares of the variable take the kinks at both ends out
        let law =
            |theta: f64| self.modulus * (self.radius * (theta.cos() - front.cos()).max(0.0)).powf(self.n);
        self.add(&mut sum, [front, middle], law, [front, slip]);
        let share = (front - middle) / middle.max(f64::MIN_POSITIVE);
        self.add(&mut sum, [0.0, middle], |theta| law(front - theta * share), [front, slip]);
        // the soil springs back behind the lowest point, where the stress is largest without a shifted peak
        let largest = if middle > 0.0 { 0.0 } else { law(0.0) };
        let rear = -(1.0 - largest / self.unloading / self.radius).acos();
        let back = |theta: f64| (largest - self.unloading * self.radius * (1.0 - theta.cos())).max(0.0);
        if rear < 0.0 {
            self.add(&mut sum, [rear, 0.0], back, [front, slip]);
        }
        let area = self.radius * self.width;
        Rolling {
            load: area * sum.load,
            pull: area * sum.pull,
            torque: area * self.radius * sum.torque,
            ..sum
        }
    }

    /// Normal and shear stress at the angle `theta` of a wheel sunk by h (m) at the slip `s`, without a shifted peak, Pa.
    pub fn stresses(&self, h: f64, slip: f64, theta: f64) -> [f64; 2] {
        let front = (1.0 - h / self.radius).acos();
        let height = |angle: f64| self.radius * (theta.cos() - angle.cos()).max(0.0);
        let largest = self.modulus * h.powf(self.n);
        let sigma = if theta >= 0.0 {
            self.modulus * height(front).powf(self.n)
        } else {
            (largest - self.unloading * self.radius * (1.0 - theta.cos())).max(0.0)
        };
        let j = self.radius * (front - theta - (1.0 - slip) * (front.sin() - theta.sin()));
        let mobilised = if sigma > 0.0 { 1.0 - (-j / self.shear).exp() } else { 0.0 };
        [sigma, (self.cohesion + sigma * self.friction) * mobilised]
    }

    /// Adds the integrals between `end`, where the stress vanishes, and `middle`; `stress` is the normal one.
    fn add(
        &self,
        sum: &mut Rolling,
        [end, middle]: [f64; 2],
        stress: impl Fn(f64) -> f64,
        [front, slip]: [f64; 2],
    ) {
        let width = middle - end;
        if width == 0.0 {
            return;
        }
        let points = self.points;
        for k in 0..=points {
            let t = k as f64 / points as f64;
            let weight = if k == 0 || k == points { 1.0 } else { 2.0 + 2.0 * (k % 2) as f64 };
            let weight = weight / (3.0 * points as f64) * 2.0 * t * width.abs();
            let theta = end + width * t * t;
            let sigma = stress(theta);
            let j = self.radius * (front - theta - (1.0 - slip) * (front.sin() - theta.sin()));
            let tau = (self.cohesion + sigma * self.friction) * (1.0 - (-j / self.shear).exp());
            sum.load += weight * (sigma * theta.cos() + tau * theta.sin());
            sum.pull += weight * (tau * theta.cos() - sigma * theta.sin());
            sum.torque += weight * tau;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A wheel of `wongreece_wheel.csv` on lunar soil at slip 0.2, with the shifted peak and without.
    #[test]
    fn the_table_is_met() {
        let rim = |peak| Rim {
            radius: 0.092,
            width: 0.107,
            modulus: 1400.0 / 0.107 + 820e3,
            n: 1.0,
            cohesion: 170.0,
            friction: 35f64.to_radians().tan(),
            shear: 0.018,
            peak,
            unloading: f64::INFINITY,
            points: 400,
        };
        for (peak, sinkage, pull) in [([0.4, 0.15], 23.37e-3, -2.58), ([0.0; 2], 18.26e-3, 3.69)] {
            let state = rim(peak).under(64.7, 0.2);
            assert!((state.load - 64.7).abs() < 1e-9, "{state:?}");
            assert!((state.sinkage - sinkage).abs() < 6e-6 && (state.pull - pull).abs() < 6e-3, "{state:?}");
        }
        assert_eq!(rim([0.0; 2]).under(1e9, 0.2).sinkage, 0.092);
    }
}
