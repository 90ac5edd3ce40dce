//! FOOT: one foot falls on power-law soil, goes down, and comes off.

use super::answers::Answers;
use super::fixture::{Setting, build, list, read, subsystem, wrench};
use super::parameters::Parameters;
use crate::process::Outcome;
use terraglue::Testbed;
use terraglue_numerics::extremes::larger;

/// A foot and its soil.
#[derive(Clone, Copy, Debug)]
pub struct Foot {
    /// kg.
    pub mass: f64,
    /// m/s², down.
    pub gravity: f64,
    /// Downward speed at the start, m/s.
    pub speed: f64,
    /// N/mⁿ.
    pub stiffness: f64,
    /// Exponent.
    pub exponent: f64,
    /// N/m.
    pub unloading: f64,
    /// Depth at the start, to which the soil has been pressed, m.
    pub depth: f64,
}

impl Foot {
    /// From the text of a case.
    pub fn read(p: Parameters) -> Outcome<Self> {
        Ok(Self {
            mass: p.number("m")?,
            gravity: p.optional("g").unwrap_or(9.81),
            speed: p.number("v0")?,
            stiffness: p.number("K")?,
            exponent: p.number("n")?,
            unloading: p.number("ku")?,
            depth: 0.0,
        })
    }

    /// The scenario; `further` are lines of the soil's table.
    pub fn text(&self, setting: &Setting, integrator: &str, further: &str) -> String {
        let foot = subsystem(
            "foot",
            "table-on-feet",
            &[
                ("mass_kg", format!("{:?}", self.mass)),
                ("start", list(&[self.depth, 0.0, 0.0, self.speed])),
                ("integrator", format!("{integrator:?}")),
            ],
        );
        let soil = subsystem(
            "soil",
            "power-columns",
            &[
                ("K", list(&[self.stiffness])),
                ("n", list(&[self.exponent])),
                ("k_u", list(&[self.unloading])),
                ("z_start", list(&[self.depth])),
            ],
        );
        let glue = "[[glue]]\nkind = \"contact\"\nside_1 = \"foot.foot0\"\nside_2 = \"soil.c0\"\n";
        let world = Setting { gravity: [0.0, 0.0, -self.gravity], ..setting.clone() };
        world.text() + &foot + &soil + further + "\n" + glue
    }

    fn static_sinkage(&self) -> f64 {
        (self.mass * self.gravity / self.stiffness).powf(1.0 / self.exponent)
    }

    /// A step that resolves the first contact: a part of the time to sink by the static depth.
    fn step(&self) -> f64 {
        let z = self.static_sinkage();
        let stiff = self.exponent * self.mass * self.gravity / z;
        let period = (self.mass / stiff.max(self.unloading)).sqrt();
        let fine = if self.exponent < 1.0 { 4000.0 } else { 500.0 };
        // a round number, so that the time of a step is exact enough to count by
        let exponent = (period / fine).log10().floor();
        10f64.powf(exponent).max(1e-7)
    }
}

/// Figures from touch-down to lift-off.
#[derive(Clone, Copy, Debug, Default)]
struct Fall {
    z_max: f64,
    f_max: f64,
    t_z_max: f64,
    v_rebound: f64,
    t_lift_off: f64,
    print: f64,
    dissipated: f64,
    v_up: f64,
}

/// Between the last two steps, where a quantity passes zero: share of the step before the second.
fn crossing(before: f64, now: f64) -> f64 {
    if before == now { 0.0 } else { now / (now - before) }
}

fn fall(foot: &Foot, h: f64) -> Outcome<Fall> {
    let mut testbed = build(&foot.text(&Setting::iterative(h, [0.0; 3]), "newmark", ""))?;
    let mut out = Fall::default();
    let (mut v, mut f) = ([foot.speed; 2], [0.0; 3]);
    for _ in 0..4_000_000u32 {
        testbed.step().map_err(|e| e.to_string())?;
        let t = testbed.t_s();
        v = [v[1], read(&testbed, "foot.heave_rate")?];
        f = [f[1], f[2], wrench(&testbed, 0, 0)];
        out.f_max = larger(out.f_max, f[2]);
        if out.t_z_max == 0.0 && v[1] <= 0.0 {
            out.t_z_max = t - h * crossing(v[0], v[1]);
        }
        if f[2] > 0.0 {
            out.v_up = larger(out.v_up, -v[1]);
        } else if out.t_z_max > 0.0 {
            // the force falls on a straight line to zero in the last step
            let share = (f[1] / (f[0] - f[1])).min(1.0);
            out.t_lift_off = t - h + share * h;
            out.v_rebound = -(v[0] + share * (v[1] - v[0]));
            break;
        }
    }
    (out.z_max, out.print) = (read(&testbed, "soil.max_sinkage")?, read(&testbed, "soil.print")?);
    out.dissipated = testbed.energy().dissipated;
    Ok(out)
}

/// The deepest point from a given start: until the foot comes to rest.
fn deepest(foot: &Foot, h: f64) -> Outcome<f64> {
    let mut testbed = build(&foot.text(&Setting::iterative(h, [0.0; 3]), "newmark", ""))?;
    until_up(&mut testbed)?;
    read(&testbed, "soil.max_sinkage")
}

/// Steps until the foot moves up.
pub fn until_up(testbed: &mut Testbed) -> Outcome {
    for _ in 0..4_000_000u32 {
        testbed.step().map_err(|e| e.to_string())?;
        if read(testbed, "foot.heave_rate")? <= 0.0 {
            return Ok(());
        }
    }
    Err("the foot sinks for ever".into())
}

/// Statics: implicit Euler with long steps of a foot of the same weight and a thousandth of the mass, so that inertia
/// does not carry it beyond its place of rest.
fn at_rest(foot: &Foot) -> Outcome<f64> {
    let light = Foot { speed: 0.0, mass: 1e-3 * foot.mass, gravity: 1e3 * foot.gravity, ..*foot };
    let mut testbed = build(&light.text(&Setting::iterative(1.0, [0.0; 3]), "implicit-euler", ""))?;
    for _ in 0..4 {
        testbed.step().map_err(|e| e.to_string())?;
    }
    read(&testbed, "foot.heave")
}

/// The quantities of the table.
pub fn answer(p: Parameters, rows: &[(Option<f64>, String)]) -> Outcome<Answers> {
    let foot = Foot::read(p)?;
    let h = foot.step();
    let run = fall(&foot, h)?;
    let mut values = Vec::new();
    for (_, name) in rows {
        values.push(match name.as_str() {
            "z_static" => at_rest(&foot)?,
            "z_max" => run.z_max,
            "F_max" => run.f_max,
            "t_zmax" => run.t_z_max,
            "v_rebound" => run.v_rebound,
            "t_liftoff" => run.t_lift_off,
            "z_perm" => run.print,
            "E_diss" => run.dissipated,
            "v_up_peak" => run.v_up,
            "zmax_sudden_release" => deepest(&Foot { speed: 0.0, ..foot }, h)?,
            other => return Err(format!("FOOT has no quantity `{other}`")),
        });
    }
    let tolerance = if foot.exponent < 1.0 { 5e-3 } else { 1e-3 };
    let note = format!("iterative, Newmark 1/4, 1/2, h = {h} s");
    Ok(Answers { values, tolerance: vec![tolerance; rows.len()], relative: true, note })
}
