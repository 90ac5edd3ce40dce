//! OSC-A and OSC-R: two masses on springs, cut between them and glued by a spring or rigidly.

use super::answers::Answers;
use super::extrapolate::{common_step, extrapolate, steps_to};
use super::fixture::{Setting, build, list, read, step, subsystem, wrench};
use super::parameters::Parameters;
use crate::process::Outcome;
use terraglue_numerics::extremes::larger;

/// Masses, springs and dampers to the ground, start, and the glue between the masses.
#[derive(Clone, Debug)]
pub struct Oscillator {
    /// kg.
    pub m: [f64; 2],
    /// N/m.
    pub k: [f64; 2],
    /// N s/m.
    pub c: [f64; 2],
    /// m.
    pub x: [f64; 2],
    /// m/s.
    pub v: [f64; 2],
    /// Spring and damper between them; none: rigid.
    pub coupling: Option<(f64, f64)>,
    /// Integrator of both.
    pub integrator: &'static str,
}

impl Oscillator {
    /// The case of Schüller et al. (2022).
    pub fn schueller(integrator: &'static str) -> Self {
        let k = 4.0 * std::f64::consts::PI * std::f64::consts::PI;
        let (k, zero) = ([k, k], [0.0, 0.0]);
        Self {
            m: [1.0, 1.0],
            k,
            c: zero,
            x: [1.0, 0.0],
            v: zero,
            coupling: Some((4.0 * k[0], 0.0)),
            integrator,
        }
    }

    /// Two masses glued rigidly.
    pub fn rigid(m: [f64; 2], k: [f64; 2], c: [f64; 2], x: f64, v: f64) -> Self {
        Self { m, k, c, x: [x, x], v: [v, v], coupling: None, integrator: "newmark" }
    }

    fn half(&self, name: &str, i: usize) -> String {
        let one = |x: f64| list(&[x]);
        let keys = [
            ("mass_kg", one(self.m[i])),
            ("spring_n_m", one(self.k[i])),
            ("damper_n_s_m", one(self.c[i])),
            ("position_m", one(self.x[i])),
            ("velocity_m_s", one(self.v[i])),
            ("integrator", format!("{:?}", self.integrator)),
        ];
        subsystem(name, "mass-chain", &keys)
    }

    /// Two subsystems and their glue.
    pub fn cut(&self, setting: &Setting) -> String {
        let spring = match self.coupling {
            Some((k, 0.0)) => format!("compliance_m_n = {:?}\n", 1.0 / k),
            Some((k, c)) => format!("compliance_m_n = {:?}\ndamping_n_s_m = {c:?}\n", 1.0 / k),
            None => String::new(),
        };
        let glue = format!("[[glue]]\nside_1 = \"a.m0\"\nside_2 = \"b.m0\"\ncomponents = [\"x\"]\n{spring}");
        setting.text() + &self.half("a", 0) + &self.half("b", 1) + &glue
    }

    /// One subsystem, nothing glued; a rigid joint is one mass.
    pub fn whole(&self, setting: &Setting) -> String {
        let both = |v: [f64; 2], join: fn(f64, f64) -> f64| {
            if self.coupling.is_some() { list(&v) } else { list(&[join(v[0], v[1])]) }
        };
        let sum = |a: f64, b: f64| a + b;
        let first = |a: f64, _: f64| a;
        let (kc, cc) = self.coupling.unwrap_or_default();
        let keys = [
            ("mass_kg", both(self.m, sum)),
            ("spring_n_m", both(self.k, sum)),
            ("damper_n_s_m", both(self.c, sum)),
            ("position_m", both(self.x, first)),
            ("velocity_m_s", both(self.v, first)),
            ("coupling_n_m", format!("{kc:?}")),
            ("coupling_n_s_m", format!("{cc:?}")),
            ("integrator", format!("{:?}", self.integrator)),
        ];
        setting.text() + &subsystem("all", "mass-chain", &keys)
    }
}

/// The two forms of the table.
pub fn answer(p: Parameters, rows: &[(Option<f64>, String)]) -> Outcome<Answers> {
    let pair = |a: &str, b: &str| Ok::<_, String>([p.number(a)?, p.number(b)?]);
    let (m, k, c) = (pair("m1", "m2")?, pair("k1", "k2")?, pair("c1", "c2")?);
    let case = if p.optional("kc").is_some() {
        let (x, v) = (p.numbers("x0")?, p.numbers("v0")?);
        let coupling = Some((p.number("kc")?, p.optional("cc").unwrap_or(0.0)));
        Oscillator { m, k, c, x: [x[0], x[1]], v: [v[0], v[1]], coupling, integrator: "newmark" }
    } else {
        Oscillator::rigid(m, k, c, p.number("x0")?, p.number("v0")?)
    };
    let times: Vec<f64> = rows.iter().filter_map(|r| r.0).collect();
    let stiffest = (k[0] / m[0]).max(k[1] / m[1]).max(case.coupling.map_or(0.0, |kc| kc.0 / m[0].min(m[1])));
    let h = common_step(&times, (0.1 / stiffest.sqrt().max(1.0)).min(0.01));
    let limits = extrapolate(h, &[2, 4, 6], |h| {
        let mut testbed = build(&case.cut(&Setting::iterative(h, [0.0; 3])))?;
        let mut out = vec![f64::NAN; rows.len()];
        let last = times.iter().fold(0.0_f64, |m, t| larger(m, *t));
        let mut count = 0;
        step(&mut testbed, steps_to(last, h), |testbed| {
            count += 1;
            for (value, (t, name)) in out.iter_mut().zip(rows) {
                if t.is_some_and(|t| steps_to(t, h) == count) {
                    *value = match name.as_str() {
                        "x" | "x1" => read(testbed, "a.m0.x")?,
                        "v" | "v1" => read(testbed, "a.m0.v")?,
                        "x2" => read(testbed, "b.m0.x")?,
                        "v2" => read(testbed, "b.m0.v")?,
                        "T_on_1" => wrench(testbed, 0, 0),
                        other => return Err(format!("OSC has no quantity `{other}`")),
                    };
                }
            }
            Ok(())
        })?;
        Ok(out)
    })?;
    Ok(Answers::extrapolated(limits, h, 3, "Newmark 1/4, 1/2"))
}

impl Oscillator {
    /// The first mass on a spring with a damper to the world, which are glue.
    pub fn on_a_spring(&self, setting: &Setting, k: f64, c: f64) -> String {
        let glue = format!(
            "[[glue]]\nside_1 = \"a.m0\"\nside_2 = \"world\"\nat_m = [0.0, 0.0, 0.0]\ncomponents = [\"x\"]\n\
             compliance_m_n = {:?}\ndamping_n_s_m = {c:?}\n",
            1.0 / k
        );
        setting.text() + &self.half("a", 0) + &glue
    }
}
