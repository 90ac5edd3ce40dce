//! Added mass: the cone of soil under a foot that moves with it.
//!
//! Soil below a flat or blunt foot locks into a cone with slip surfaces at 45° + φ/2 (Prandtl 1921) and is carried along; its
//! inertia resists a foot that is driven in fast (Aguilar and Goldman 2016, *Nature Physics* 12, 278, who measure about 60°). As the
//! foot sinks by z the cone grows, a frustum of that height at first: m(z) = c·ρ·⅓πR³·tan ψ·(1 − (1 − z/H)³), H = R·tan ψ, ψ = 45° + φ/2,
//! and m = c·ρ·⅓πR²H from z = H on. Its momentum m·w (w: speed into the soil) gives the force d(m·w)/dt. The soil does not
//! pull at the foot: where the foot stops or leaves, the cone loses its energy as heat.

use crate::contact_memory::Remembered;
use crate::patch_nodes::PatchNodes;
use crate::vectors::Stiffness;
use std::f64::consts::{FRAC_PI_3, PI};

/// The cone under one contact as of the last commit. Part of the committed state.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Carried {
    /// Key of the port.
    pub key: u64,
    /// Mass that moves with the foot, kg.
    pub mass: f64,
    /// Its speed into the soil, m/s.
    pub speed: f64,
}

impl Remembered for Carried {
    fn new(key: u64) -> Self {
        Self { key, ..Self::default() }
    }
    fn key(&self) -> u64 {
        self.key
    }
    /// Kinetic energy, J.
    fn energy(&self) -> f64 {
        0.5 * self.mass * self.speed * self.speed
    }
}

/// Parameters of a soil for its cones.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ConeMaterial {
    /// Mass of the cone per volume, the part that is counted times the density, kg/m³; 0: soil has no inertia.
    pub density: f64,
    /// tan ψ.
    pub slope: f64,
}

/// The cone under one contact during a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cone {
    /// As of the last commit.
    pub before: Carried,
    /// Mass of the whole cone, kg, and its height, m.
    full: [f64; 2],
    /// Depth of the lowest point at the start of the step, m.
    depth: f64,
    /// Middle of the contact from the port's origin along t1 and t2, m.
    arm: [f64; 2],
    /// Length of the step, s.
    h: f64,
}

/// Answer of a cone.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ConeAnswer {
    /// Force on the foot along n, N; < 0 where the cone is slowed down.
    pub force: f64,
    /// −d(force)/d(motion along n), N/m.
    pub stiffness: f64,
    /// The cone after the step.
    pub after: Carried,
}

impl Cone {
    /// Under the nodes of `range`; `None` where soil has no inertia.
    pub fn under(
        material: &ConeMaterial,
        nodes: &PatchNodes,
        range: std::ops::Range<usize>,
        before: Carried,
        h: f64,
    ) -> Option<Self> {
        if material.density <= 0.0 || h <= 0.0 {
            return None;
        }
        let (mut area, mut middle, mut depth) = (0.0, [0.0; 2], 0.0_f64);
        for k in range.filter(|k| nodes.depth[*k] > 0.0 && nodes.area[*k] > 0.0) {
            let a = nodes.area[k];
            area += a;
            middle = [middle[0] + a * nodes.arm[k][1], middle[1] + a * nodes.arm[k][2]];
            depth = depth.max(nodes.depth[k]);
        }
        let radius = (area / PI).sqrt();
        let height = radius * material.slope;
        let full = [material.density * FRAC_PI_3 * radius * radius * height, height];
        let arm = if area > 0.0 { middle.map(|m| m / area) } else { [0.0; 2] };
        Some(Self { before, full, depth, arm, h })
    }

    /// Direction of the motion that drives the cone: that of the middle of the contact along n.
    fn direction(&self) -> [f64; 6] {
        [1.0, 0.0, 0.0, 0.0, self.arm[1], -self.arm[0]]
    }

    /// Motion of the middle of the contact along n when the foot has moved by `x`, m.
    fn up(&self, x: &[f64; 6]) -> f64 {
        self.direction().iter().zip(x).map(|(g, x)| g * x).sum()
    }

    /// Mass when the lowest point lies at `depth` (m), and its slope, kg and kg/m.
    fn mass(&self, depth: f64) -> [f64; 2] {
        let [full, height] = self.full;
        let rest = if height > 0.0 { 1.0 - (depth / height).clamp(0.0, 1.0) } else { 1.0 };
        let mass = full * (1.0 - rest * rest * rest);
        let grows = height > 0.0 && depth > 0.0 && mass > self.before.mass;
        if grows { [mass, 3.0 * full * rest * rest / height] } else { [mass.max(self.before.mass), 0.0] }
    }

    /// Its answer when the foot has moved by `x`.
    pub fn answer(&self, x: &[f64; 6]) -> ConeAnswer {
        let up = self.up(x);
        let momentum = self.before.mass * self.before.speed;
        let (key, h) = (self.before.key, self.h);
        if up >= 0.0 {
            let after = Carried { key, mass: self.before.mass, speed: 0.0 };
            return ConeAnswer { force: -momentum / h, stiffness: 0.0, after };
        }
        let [mass, slope] = self.mass(self.depth - up);
        let speed = -up / h;
        ConeAnswer {
            force: (mass * speed - momentum) / h,
            stiffness: (mass / h + slope * speed) / h,
            after: Carried { key, mass, speed },
        }
    }

    /// Adds the force to the wrench `sum` of the law; no more is taken than the law gives.
    pub fn add_to(&self, x: &[f64; 6], sum: &mut [f64; 6]) {
        let force = self.answer(x).force.max(-sum[0].max(0.0));
        sum.iter_mut().zip(self.direction()).for_each(|(s, g)| *s += g * force);
    }

    /// Adds the derivatives to those of the law's wrench, whose force along n is `law`, N.
    pub fn stiffen(&self, x: &[f64; 6], law: f64, sum: &mut Stiffness) {
        let (answer, g) = (self.answer(x), self.direction());
        let taken = answer.force < -law.max(0.0);
        let row = if taken {
            sum[0].map(|s| if law > 0.0 { -s } else { 0.0 })
        } else {
            g.map(|g| answer.stiffness * g)
        };
        for (values, g) in sum.iter_mut().zip(g) {
            values.iter_mut().zip(row).for_each(|(s, r)| *s += g * r);
        }
    }

    /// Work of the foot on the cone in the step, J, under the law's force `law` (N) along n, and the cone after it.
    pub fn worked(&self, x: &[f64; 6], law: f64) -> (f64, Carried) {
        let answer = self.answer(x);
        (-answer.force.max(-law.max(0.0)) * self.up(x), answer.after)
    }
}

terraglue_subsystem::persist!(Carried { key, mass, speed });

#[cfg(test)]
mod tests {
    use super::*;

    fn cone(mass: f64, speed: f64, depth: f64) -> Cone {
        let before = Carried { key: 1, mass, speed };
        Cone { before, full: [2.0, 0.05], depth, arm: [0.01, -0.02], h: 1e-3 }
    }

    #[test]
    fn work_is_kinetic_energy_and_heat_that_never_falls() {
        for (mass, speed, depth) in [(0.0, 0.0, 0.0), (0.3, 0.1, 0.002), (1.0, 0.4, 0.03), (2.0, 0.2, 0.08)] {
            for up in [-4e-4, -2e-4, -5e-5, 0.0, 1e-4] {
                let cone = cone(mass, speed, depth);
                for law in [0.0, 10.0, 1e4] {
                    let x = [up, 0.3, -0.2, 0.1, 0.0, 0.0];
                    let (work, after) = cone.worked(&x, law);
                    let heat = work - (after.energy() - cone.before.energy());
                    assert!(heat >= -1e-15, "{mass} {speed} {depth} {up}: {heat}");
                }
            }
        }
    }

    #[test]
    fn the_stiffness_is_the_slope_of_the_wrench() {
        let cone = cone(0.3, 0.1, 0.01);
        let x = [-2e-4, 1e-4, 0.0, 0.0, 2e-3, -1e-3];
        let mut stiffness = [[0.0; 6]; 6];
        cone.stiffen(&x, 1e3, &mut stiffness);
        for c in 0..6 {
            let at = |d: f64| {
                let (mut x, mut sum) = (x, [1e3, 0.0, 0.0, 0.0, 0.0, 0.0]);
                x[c] += d;
                cone.add_to(&x, &mut sum);
                sum
            };
            let [a, b] = [at(-1e-9), at(1e-9)];
            for r in 0..6 {
                let slope = -(b[r] - a[r]) / 2e-9;
                assert!((slope - stiffness[r][c]).abs() < 1e-3 * (1.0 + slope.abs()), "{r} {c}: {slope}");
            }
        }
    }
}
