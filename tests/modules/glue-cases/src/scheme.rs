//! One-step integrators of second-order systems in one form.
//!
//! (1 − α_m)·a⁺ + α_m·a = (1 − α_f)·q̈⁺ + α_f·q̈, q⁺ = q + h·v + h²·(b0·a + b1·a⁺), v⁺ = v + h·(g0·a + g1·a⁺), with the
//! equation of motion at t⁺ for q̈⁺. Generalized-α: Arnold and Brüls (2007); Newmark is α_m = α_f = 0.

use terraglue_subsystem::{Config, Error, Parameter, ParameterType, Result};

/// Coefficients of an integrator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scheme {
    alpha_m: f64,
    alpha_f: f64,
    b: [f64; 2],
    g: [f64; 2],
    /// Exact for a free mass under a force that is constant or linear in the step (sub-cycling in the limit).
    pub exact: bool,
}

/// q, v, the auxiliary a and q̈ of one coordinate.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Coordinate {
    /// Position.
    pub q: f64,
    /// Rate.
    pub v: f64,
    /// Auxiliary acceleration of generalized-α.
    pub a: f64,
    /// Acceleration by the equation of motion.
    pub qdd: f64,
}

/// q⁺ = q_0 + q_1·q̈⁺ and v⁺ = v_0 + v_1·q̈⁺ of one coordinate.
#[derive(Clone, Copy, Debug, Default)]
pub struct Linear {
    /// Position without the new acceleration.
    pub q0: f64,
    /// Rate without the new acceleration.
    pub v0: f64,
}

impl Scheme {
    /// Newmark with β = ¼, γ = ½.
    pub const NEWMARK: Self =
        Self { alpha_m: 0.0, alpha_f: 0.0, b: [0.25, 0.25], g: [0.5, 0.5], exact: false };
    /// v⁺ = v + h·f⁺/m, z⁺ = z + h·v⁺.
    pub const IMPLICIT_EULER: Self =
        Self { alpha_m: 0.0, alpha_f: 0.0, b: [0.0, 1.0], g: [0.0, 1.0], exact: false };

    /// Generalized-α with the spectral radius ρ at infinity.
    pub fn generalized_alpha(rho: f64) -> Self {
        let (alpha_m, alpha_f) = ((2.0 * rho - 1.0) / (rho + 1.0), rho / (rho + 1.0));
        let gamma = 0.5 + alpha_f - alpha_m;
        let beta = 0.25 * (gamma + 0.5) * (gamma + 0.5);
        Self { alpha_m, alpha_f, b: [0.5 - beta, beta], g: [1.0 - gamma, gamma], exact: false }
    }

    /// The parameters that choose it.
    pub fn parameters() -> [Parameter; 2] {
        let names = ["newmark", "generalized-alpha", "implicit-euler", "exact"];
        [
            Parameter::of("integrator", ParameterType::Text, "Integrator").or("newmark").choices(&names),
            Parameter::number("rho", "", 0.8, "Spectral radius of generalized-alpha at infinity")
                .within(0.0, 1.0),
        ]
    }

    /// From the parameters.
    ///
    /// # Errors
    /// A key that is missing or has no sense.
    pub fn read(config: &Config) -> Result<Self> {
        Ok(match config.text("integrator")? {
            "newmark" => Self::NEWMARK,
            "generalized-alpha" => Self::generalized_alpha(config.number("rho")?),
            "implicit-euler" => Self::IMPLICIT_EULER,
            "exact" => Self { exact: true, ..Self::NEWMARK },
            other => return Err(Error::Refused(format!("unknown integrator `{other}`"))),
        })
    }

    /// dq⁺/dq̈⁺, s².
    pub fn q1(&self, h: f64) -> f64 {
        h * h * self.b[1] * self.share()
    }

    /// dv⁺/dq̈⁺, s.
    pub fn v1(&self, h: f64) -> f64 {
        h * self.g[1] * self.share()
    }

    fn share(&self) -> f64 {
        (1.0 - self.alpha_f) / (1.0 - self.alpha_m)
    }

    fn known(&self, c: &Coordinate) -> f64 {
        (self.alpha_f * c.qdd - self.alpha_m * c.a) / (1.0 - self.alpha_m)
    }

    /// The prediction of a coordinate before q̈⁺ is known.
    pub fn predict(&self, c: &Coordinate, h: f64) -> Linear {
        let known = self.known(c);
        Linear {
            q0: c.q + h * c.v + h * h * (self.b[0] * c.a + self.b[1] * known),
            v0: c.v + h * (self.g[0] * c.a + self.g[1] * known),
        }
    }

    /// q⁺ − q with q̈⁺, without the rounding of a difference of large numbers.
    pub fn displacement(&self, c: &Coordinate, h: f64, qdd: f64) -> f64 {
        h * c.v + h * h * (self.b[0] * c.a + self.b[1] * self.known(c)) + self.q1(h) * qdd
    }

    /// The coordinate at t⁺ with q̈⁺. A step of h = 0 sets the accelerations and nothing else.
    pub fn finish(&self, c: &Coordinate, h: f64, qdd: f64) -> Coordinate {
        if h == 0.0 {
            return Coordinate { a: qdd, qdd, ..*c };
        }
        let at = self.predict(c, h);
        let a = self.known(c) + self.share() * qdd;
        Coordinate { q: at.q0 + self.q1(h) * qdd, v: at.v0 + self.v1(h) * qdd, a, qdd }
    }
}
