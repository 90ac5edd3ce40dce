//! TABLE: a body on six feet: statics, a fall, and one step on yielding soil.

use super::answers::Answers;
use super::extrapolate::{common_step, steps_to};
use super::fixture::{Setting, build, list, read, step, subsystem, wrench};
use super::parameters::Parameters;
use crate::process::Outcome;
use terraglue_numerics::extremes::larger;

/// Where the feet stand, m.
pub const FEET: [[f64; 2]; 6] = [[0.4, 0.3], [0.0, 0.3], [-0.4, 0.3], [0.4, -0.3], [0.0, -0.3], [-0.4, -0.3]];
const GRAVITY: [f64; 3] = [0.0, 0.0, -9.81];

/// The body.
#[derive(Clone, Debug)]
pub struct Table {
    /// x, y of the feet.
    pub feet: Vec<f64>,
    /// x, y of the centre of mass.
    pub offset: Vec<f64>,
    /// kg.
    pub mass: f64,
    /// Heave (down), roll, pitch and their rates at the start.
    pub start: [f64; 6],
    /// Integrator.
    pub integrator: &'static str,
}

impl Table {
    /// The body of all cases.
    pub fn standard(integrator: &'static str, speed: f64) -> Self {
        Self {
            feet: FEET.concat(),
            offset: vec![0.05, 0.02],
            mass: 60.0,
            start: [0.0, 0.0, 0.0, speed, 0.0, 0.0],
            integrator,
        }
    }

    /// The scenario with the lines of the soil's table.
    pub fn text(&self, setting: &Setting, soil: &[(&str, String)]) -> String {
        let mut text = Setting { gravity: GRAVITY, ..setting.clone() }.text();
        text += &subsystem(
            "table",
            "table-on-feet",
            &[
                ("mass_kg", format!("{:?}", self.mass)),
                ("roll_inertia_kg_m2", "2.0".into()),
                ("pitch_inertia_kg_m2", "4.0".into()),
                ("feet_m", list(&self.feet)),
                ("offset_m", list(&self.offset)),
                ("start", list(&self.start)),
                ("integrator", format!("{:?}", self.integrator)),
            ],
        );
        text += &subsystem("soil", "power-columns", soil);
        for i in 0..self.feet.len() / 2 {
            text += &format!(
                "[[glue]]\nkind = \"contact\"\nside_1 = \"table.foot{i}\"\nside_2 = \"soil.c{i}\"\n"
            );
        }
        text
    }

    /// Σ T, and the second and third component of JᵀT.
    pub fn resultant(&self, t: &[f64]) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for (foot, t) in self.feet.chunks_exact(2).zip(t) {
            sum[0] += t;
            sum[1] += t * (foot[1] - self.offset[1]);
            sum[2] -= t * (foot[0] - self.offset[0]);
        }
        sum
    }
}

/// K, n and k_u of the columns of TABLE-D with all stiffnesses times a factor; foot 0 may stand on rock.
pub fn columns(factor: f64, rock: bool) -> Vec<(&'static str, String)> {
    let mut k = [1.0, 0.5, 2.0, 1.5, 0.8, 1.2].map(|s| 15383.3 * factor * s);
    let mut n = [1.1; 6];
    let mut k_u = k.map(|k| 40.0 * k);
    if rock {
        (k[0], n[0], k_u[0]) = (1e7, 1.0, 4e7);
    }
    vec![("K", list(&k)), ("n", list(&n)), ("k_u", list(&k_u))]
}

/// The three forms of the table.
pub fn answer(case: &str, p: Parameters, rows: &[(Option<f64>, String)]) -> Outcome<Answers> {
    let offset = p.numbers("offset").or_else(|_| p.numbers("off"))?;
    let feet = p.numbers("xy").unwrap_or_else(|_| FEET.concat());
    let mass = p.optional("M").unwrap_or(60.0);
    let start = [0.0, 0.0, 0.0, p.optional("v0").unwrap_or(0.0), 0.0, 0.0];
    let table = Table { feet, offset, mass, start, integrator: "implicit-euler" };
    match case.get(6..7) {
        Some("S") => statics(&table, &p.numbers("K")?, rows),
        Some("D") => falling(&table, p, rows),
        _ => yielding(&table, p, rows),
    }
}

fn statics(table: &Table, k: &[f64], rows: &[(Option<f64>, String)]) -> Outcome<Answers> {
    let h = 1.0;
    // as stiff when the force falls: the equilibrium does not depend on the way to it
    let mut testbed =
        build(&table.text(&Setting::iterative(h, GRAVITY), &[("K", list(k)), ("k_u", list(k))]))?;
    step(&mut testbed, 20, |_| Ok(()))?;
    let values = rows
        .iter()
        .map(|(_, name)| match foot_of(name) {
            Some(foot) => Ok(wrench(&testbed, foot, 0)),
            None => read(&testbed, &format!("table.{name}")),
        })
        .collect::<Outcome<_>>()?;
    let note = format!("iterative, implicit Euler with h = {h} s until inertia no longer counts");
    Ok(Answers { values, tolerance: vec![1e-9; rows.len()], relative: false, note })
}

fn foot_of(name: &str) -> Option<usize> {
    name.strip_prefix('T')?.parse().ok()
}

fn falling(table: &Table, p: Parameters, rows: &[(Option<f64>, String)]) -> Outcome<Answers> {
    let table = Table { integrator: "newmark", ..table.clone() };
    let (k, n) = (p.numbers("K")?, p.number("n")?);
    let ratio = p.optional("ku").unwrap_or(40.0);
    let k_u: Vec<f64> = k.iter().map(|k| ratio * k).collect();
    let soil = [("K", list(&k)), ("n", list(&[n])), ("k_u", list(&k_u))];
    let times: Vec<f64> = rows.iter().filter_map(|r| r.0).collect();
    let last = times.iter().fold(0.0_f64, |m, t| larger(m, *t));
    let stiffest = k_u.iter().sum::<f64>() / table.mass;
    let h = common_step(&times, 0.001 / stiffest.sqrt());
    let mut testbed = build(&table.text(&Setting::iterative(h, GRAVITY), &soil))?;
    let (mut values, mut peak, mut count) = (vec![f64::NAN; rows.len()], 0.0_f64, 0);
    step(&mut testbed, steps_to(last, h), |testbed| {
        count += 1;
        peak = larger(peak, read(testbed, "table.heave")?);
        for (value, (t, name)) in values.iter_mut().zip(rows) {
            if t.is_some_and(|t| steps_to(t, h) == count) {
                *value = match (name.as_str(), foot_of(name)) {
                    ("peak_heave", _) => peak,
                    (_, Some(foot)) => wrench(testbed, foot, 0),
                    _ => read(testbed, &format!("table.{name}"))?,
                };
            }
        }
        Ok(())
    })?;
    let tolerance = rows.iter().map(|(_, name)| match name.as_str() {
        "heave" | "peak_heave" => 1e-6,
        "roll" | "pitch" => 1e-5,
        _ => 2e-5,
    });
    let note = format!("iterative, Newmark 1/4, 1/2, h = {h:.3e} s");
    Ok(Answers { values, tolerance: tolerance.collect(), relative: false, note })
}

fn yielding(table: &Table, p: Parameters, rows: &[(Option<f64>, String)]) -> Outcome<Answers> {
    let (h, cap) = (p.number("h")?, p.numbers("cap")?);
    let soil = [("K", list(&vec![1.0; cap.len()])), ("cap", list(&cap)), ("rigid", "true".into())];
    let mut testbed = build(&table.text(&Setting::iterative(h, GRAVITY), &soil))?;
    step(&mut testbed, 1, |_| Ok(()))?;
    let t: Vec<f64> = (0..cap.len()).map(|i| wrench(&testbed, i, 0)).collect();
    let [sum, mx, my] = table.resultant(&t);
    let gap = |name: &str| {
        let foot: usize = name.strip_prefix("gap")?.parse().ok()?;
        testbed.report().ports.get(foot).map(|p| p.gap_m)
    };
    let values = rows
        .iter()
        .map(|(_, name)| match name.as_str() {
            "sumT" => Ok(sum),
            "Mx" => Ok(mx),
            "My" => Ok(my),
            other => gap(other).ok_or_else(|| format!("TABLE-BOX has no quantity `{other}`")),
        })
        .collect::<Outcome<_>>()?;
    let note = format!("iterative, implicit Euler, one step of {h} s");
    Ok(Answers { values, tolerance: vec![1e-9; rows.len()], relative: false, note })
}
