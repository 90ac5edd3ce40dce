//! Theory of soil strength: inclined loads, inclined faces, walls, loose soil, steep slopes.
//!
//! Closed formulas without a fitted number: bearing capacity (Terzaghi 1943; Sokolovskii 1965; Vesić 1973), passive earth
//! pressure (Rankine 1857), plates pushed into granular media at all angles (Li, Zhang and Goldman 2013).

use std::f64::consts::{FRAC_PI_4, PI};

/// Cohesion, angle of internal friction and weight of a soil.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Strength {
    /// Cohesion c, Pa.
    pub cohesion: f64,
    /// Angle of internal friction φ, rad.
    pub phi: f64,
    /// Weight per volume γ, N/m³.
    pub weight: f64,
}

impl Strength {
    /// K_p = tan²(45° + φ/2), the coefficient of passive earth pressure on a smooth vertical wall (Rankine 1857).
    pub fn passive_coefficient(&self) -> f64 {
        let t = libm::tan(FRAC_PI_4 + 0.5 * self.phi);
        t * t
    }

    /// [a, b] of the passive stress a + b·z at the depth z (m) on a wall that is pushed into level soil, Pa and Pa/m: a =
    /// 2c√K_p, b = γK_p (Rankine 1857, with the cohesion of Bell 1915).
    pub fn passive(&self) -> [f64; 2] {
        let k = self.passive_coefficient();
        [2.0 * self.cohesion * k.sqrt(), self.weight * k]
    }

    /// c·cot φ, the pressure that counts as much as the cohesion, Pa; at most 10⁹ Pa where there is hardly any friction.
    pub fn cohesive_pressure(&self) -> f64 {
        (self.cohesion / libm::tan(self.phi)).min(1e9)
    }

    /// Height of a vertical face that the cohesion holds, m: H_c = (4c/γ)·tan(45° + φ/2) (Rankine 1857; Terzaghi 1943,
    /// eq. 54, without tension cracks). Infinite without weight.
    pub fn critical_height(&self) -> f64 {
        if self.cohesion == 0.0 {
            return 0.0;
        }
        4.0 * self.cohesion / self.weight * libm::tan(FRAC_PI_4 + 0.5 * self.phi)
    }

    /// The same soil loose, as soil that fails by local shear is to be counted: c' = ⅔·c, tan φ' = ⅔·tan φ (Terzaghi 1943,
    /// art. 46).
    pub fn loosened(&self) -> Self {
        let phi = libm::atan(2.0 / 3.0 * libm::tan(self.phi));
        Self { cohesion: 2.0 / 3.0 * self.cohesion, phi, weight: self.weight }
    }

    /// Modulus of loose soil over that of the bed, from the width term of bearing capacity: N_γ(φ')/N_γ(φ).
    pub fn loose_share(&self) -> f64 {
        width_factor(self.loosened().phi) / width_factor(self.phi)
    }

    /// Critical height of loose soil at rest over that of the bed, H_c(c', φ')/H_c(c, φ): 0.55 at 35°.
    pub fn loose_wall_share(&self) -> f64 {
        let tan = |phi: f64| libm::tan(FRAC_PI_4 + 0.5 * phi);
        2.0 / 3.0 * tan(self.loosened().phi) / tan(self.phi)
    }
}

/// N_q = e^(π·tan φ)·tan²(45° + φ/2), the depth factor of bearing capacity (Prandtl 1921, Reissner 1924).
pub fn depth_factor(phi: f64) -> f64 {
    let t = libm::tan(FRAC_PI_4 + 0.5 * phi);
    libm::exp(PI * libm::tan(phi)) * t * t
}

/// N_γ = 2(N_q + 1)·tan φ, the width factor of bearing capacity (Vesić 1973, eq. 15).
pub fn width_factor(phi: f64) -> f64 {
    2.0 * (depth_factor(phi) + 1.0) * libm::tan(phi)
}

/// Reduction of the bearing capacity under a load that is inclined because the contact carries shear.
///
/// The capacity at the depth z below a contact of the radius b is γ(z·N_q·i_q + 0.6·b·N_γ·i_γ), of which a level load finds
/// γ(z·N_q + 0.6·b·N_γ) (Terzaghi 1943, art. 50, for discs). i_q = N_q(δ)/N_q(0) is exact for weightless soil with a
/// surcharge, from slip lines: N_q(δ) = cos δ·(cos δ + √(sin²φ − sin²δ))/(1 − sin φ)·e^((π − δ − arcsin(sin δ/sin φ))·tan φ)
/// (Sokolovskii 1965). i_γ = i_q^(3/2): the exponents of both are m and m + 1 with m = 2 (Vesić 1975, eqs. 3.28, 3.29).
/// tan δ = τ/(σ + c·cot φ), at most tan φ, where the contact slides and i_q is 0.33, 0.15, 0.09 and 0.05 at φ = 20°, 30°,
/// 35° and 40°.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inclination {
    sin_phi: f64,
    tan_phi: f64,
    depth: f64,
    width: f64,
}

impl Inclination {
    /// For the angle of internal friction `phi`, rad.
    pub fn new(phi: f64) -> Self {
        let (depth, width) = (depth_factor(phi), 0.6 * width_factor(phi));
        Self { sin_phi: libm::sin(phi), tan_phi: libm::tan(phi), depth, width }
    }

    /// Part of its capacity that the soil keeps at the depth z (m) under a contact of the radius b (m); `tan` = tan δ.
    pub fn factor(&self, tan: f64, z: f64, b: f64) -> f64 {
        if tan <= 0.0 {
            return 1.0;
        }
        let i = self.of_depth(tan);
        let (depth, width) = (self.depth * z.max(0.0), self.width * b);
        (depth * i + width * i * i.sqrt()) / (depth + width)
    }

    /// i_q.
    fn of_depth(&self, tan: f64) -> f64 {
        let delta = libm::atan(tan.min(self.tan_phi));
        let (s, c) = (libm::sin(delta), libm::cos(delta));
        let ratio = (s / self.sin_phi).min(1.0);
        let root = self.sin_phi * (1.0 - ratio * ratio).max(0.0).sqrt();
        c * (c + root) / (1.0 + self.sin_phi) * libm::exp(-(delta + libm::asin(ratio)) * self.tan_phi)
    }
}

/// Normal stress on a face that is pressed into soil over that on a level one at the same depth; `cos` is the cosine of the angle
/// β between its normal and the vertical. It is the normal part, α_z·cos β + α_x·sin β, of the stress that Li, Zhang and
/// Goldman (2013, Science 339, eq. S1 with their mean coefficients) measured on plates that move straight down: 0.77, 0.55 and
/// 0.34 at 30°, 45° and 60°.
#[inline]
pub fn slope_factor(cos: f64) -> f64 {
    let c = cos.clamp(0.0, 1.0);
    let s2 = 1.0 - c * c;
    // cos 2β and sin 2β of the angle β of the plate; α_z = A00 + B01 + (A10 + B11 + B-11)·cos 2β,
    // α_x = (D10 − C11 + C-11)·sin 2β
    let level = 0.206 + 0.358 + 0.436 * (c * c - s2);
    level * c + 0.219 * 2.0 * c * s2
}

#[cfg(test)]
mod tests {
    use super::*;

    const SAND: Strength = Strength { cohesion: 1000.0, phi: 0.5, weight: 13e3 };

    /// The generic coefficients of resistive force theory as they are printed, for any plate and direction.
    fn plate(beta: f64, gamma: f64) -> [f64; 2] {
        let (c, s) = (
            |m: f64, n: f64| (2.0 * m * beta + n * gamma).cos(),
            |m: f64, n: f64| (2.0 * m * beta + n * gamma).sin(),
        );
        let z =
            0.206 + 0.169 * c(1.0, 0.0) + 0.212 * s(1.0, 1.0) + 0.358 * s(0.0, 1.0) + 0.055 * s(-1.0, 1.0);
        let x = -0.124 * c(1.0, 1.0) + 0.253 * c(0.0, 1.0) + 0.007 * c(-1.0, 1.0) + 0.088 * s(1.0, 0.0);
        [z, x]
    }

    #[test]
    fn the_slope_factor_is_the_normal_stress_of_plates_that_move_straight_down() {
        for k in 0..=90 {
            let beta = f64::from(k).to_radians();
            let [z, x] = plate(beta, std::f64::consts::FRAC_PI_2);
            let normal = z * beta.cos() + x * beta.sin();
            assert!((slope_factor(beta.cos()) - normal).abs() < 1e-12, "{k}");
        }
        assert!((slope_factor(1.0) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn factors_of_bearing_capacity_are_those_of_the_tables() {
        // Vesić 1973, table 1: N_γ at 20°, 30°, 35°, 40°
        for (degrees, table) in [(20.0_f64, 5.39), (30.0, 22.40), (35.0, 48.03), (40.0, 109.41)] {
            let n = width_factor(degrees.to_radians());
            assert!((n / table - 1.0).abs() < 2e-3, "{degrees}: {n}");
        }
        let phi = 30f64.to_radians();
        assert!((depth_factor(phi) - 18.40).abs() < 0.01);
        // deep below the contact the depth term is left: where it slides, a fan of 45° − φ/2 from the passive zone
        let n_q = |degrees: f64| {
            depth_factor(phi) * Inclination::new(phi).factor(degrees.to_radians().tan(), 1e9, 1e-3)
        };
        let slides = (1.0 + 0.5) * (2.0 * (FRAC_PI_4 - 0.5 * phi) * phi.tan()).exp();
        assert!(
            (n_q(30.0) - slides).abs() < 1e-6 && (n_q(0.0) - 18.40).abs() < 0.01,
            "{} {slides}",
            n_q(30.0)
        );
        let falls = (1..30).all(|k| n_q(f64::from(k)) < n_q(f64::from(k - 1)));
        assert!(falls && n_q(60.0) == n_q(30.0));
        let shallow = Inclination::new(phi).factor(phi.tan(), 0.0, 1.0);
        assert!((shallow - (slides / depth_factor(phi)).powf(1.5)).abs() < 1e-9);
    }

    #[test]
    fn a_wall_of_the_critical_height_is_where_active_pressure_balances() {
        // Rankine's active stress γzK_a − 2c√K_a has no resultant down to H_c
        let k_a = 1.0 / SAND.passive_coefficient();
        let h = SAND.critical_height();
        let resultant = 0.5 * SAND.weight * h * h * k_a - 2.0 * SAND.cohesion * k_a.sqrt() * h;
        assert!(resultant.abs() < 1e-9 * SAND.weight * h * h);
        assert_eq!(Strength { cohesion: 0.0, ..SAND }.critical_height(), 0.0);
    }

    #[test]
    fn loose_soil_stands_to_the_height_of_its_own_cohesion_and_friction() {
        for phi in [0.05, 0.5, 0.7] {
            let soil = Strength { phi, ..SAND };
            let ratio = soil.loosened().critical_height() / soil.critical_height();
            assert!((soil.loose_wall_share() - ratio).abs() < 1e-12, "{phi}");
        }
    }

    #[test]
    fn loose_soil_bears_a_part_of_what_the_bed_does() {
        for phi in [0.05, 0.2, 0.5, 0.6, 0.7] {
            let share = Strength { phi, ..SAND }.loose_share();
            assert!(share > 0.1 && share < 0.7, "{phi}: {share}");
        }
    }
}
