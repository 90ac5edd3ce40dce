//! PEND, DP and FB: mechanisms in a plane, cut at one point and glued there.

use super::answers::Answers;
use super::extrapolate::{common_step, extrapolate, steps_to};
use super::fixture::{Setting, build, list, read, step, subsystem, wrench};
use super::parameters::Parameters;
use crate::process::Outcome;
use terraglue_numerics::extremes::larger;

/// Standard gravity of the reference cases along −y, m/s².
pub const GRAVITY: [f64; 3] = [0.0, -9.81, 0.0];

/// A rigid body: mass, moment of inertia, x, y and angle of its centre, and their rates.
#[derive(Clone, Copy, Debug)]
pub struct Body {
    /// kg.
    pub mass: f64,
    /// kg m².
    pub inertia: f64,
    /// m, m, rad.
    pub pose: [f64; 3],
    /// m/s, m/s, rad/s.
    pub rate: [f64; 3],
}

impl Body {
    /// A uniform rod from a to b, at rest; its angle is that of the vector.
    pub fn rod(mass: f64, a: [f64; 2], b: [f64; 2]) -> Self {
        let d = [b[0] - a[0], b[1] - a[1]];
        let pose = [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1]), d[1].atan2(d[0])];
        Self { mass, inertia: mass * (d[0] * d[0] + d[1] * d[1]) / 12.0, pose, rate: [0.0; 3] }
    }
}

/// body, body or −1 for the world, x, y.
pub type Pin = [f64; 4];

/// Bodies with pins as a subsystem.
pub fn bodies(name: &str, integrator: &str, bodies: &[Body], pins: &[Pin]) -> String {
    let flat = |f: fn(&Body) -> [f64; 3]| list(&bodies.iter().flat_map(f).collect::<Vec<_>>());
    let keys = [
        ("mass_kg", list(&bodies.iter().map(|b| b.mass).collect::<Vec<_>>())),
        ("inertia_kg_m2", list(&bodies.iter().map(|b| b.inertia).collect::<Vec<_>>())),
        ("pose", flat(|b| b.pose)),
        ("rate", flat(|b| b.rate)),
        ("pins", list(&pins.concat())),
    ];
    subsystem(name, "planar-bodies", &keys) + integrator + "\n"
}

/// Generalized-α with ρ∞ = 0.8.
pub const ALPHA: &str = "integrator = \"generalized-alpha\"\nrho = 0.8";

/// A mechanism in two parts and as one.
#[derive(Clone, Debug)]
pub struct Mechanism {
    /// Bodies and pins of side 1.
    pub first: (Vec<Body>, Vec<Pin>),
    /// Bodies and pins of side 2.
    pub second: (Vec<Body>, Vec<Pin>),
    /// Bodies that are glued, by number in their parts.
    pub glued: (usize, usize),
    /// Where.
    pub at: [f64; 2],
    /// Also the angle.
    pub weld: bool,
}

impl Mechanism {
    /// Both parts and their glue.
    pub fn cut(&self, setting: &Setting, integrator: &str) -> String {
        let components = if self.weld { "[\"x\", \"y\", \"rz\"]" } else { "[\"x\", \"y\"]" };
        let glue = format!(
            "[[glue]]\nside_1 = \"first.b{}\"\nside_2 = \"second.b{}\"\nat_m = [{:?}, {:?}, 0.0]\ncomponents = {components}\n",
            self.glued.0, self.glued.1, self.at[0], self.at[1]
        );
        setting.text()
            + &bodies("first", integrator, &self.first.0, &self.first.1)
            + &bodies("second", integrator, &self.second.0, &self.second.1)
            + &glue
    }

    /// The same uncut; a weld is refused.
    pub fn whole(&self, setting: &Setting, integrator: &str) -> String {
        let n = self.first.0.len() as f64;
        let shift = |b: f64| if b < 0.0 { b } else { b + n };
        let mut pins = self.first.1.clone();
        pins.extend(self.second.1.iter().map(|p| [shift(p[0]), shift(p[1]), p[2], p[3]]));
        pins.push([self.glued.0 as f64, self.glued.1 as f64 + n, self.at[0], self.at[1]]);
        let all = [self.first.0.as_slice(), self.second.0.as_slice()].concat();
        setting.text() + &bodies("all", integrator, &all, &pins)
    }

    /// A uniform rod hanging at the origin, θ from the downward vertical, cut at the share f and welded. The bodies'
    /// angle is θ.
    pub fn pendulum(length: f64, mass: f64, theta: f64, f: f64) -> Self {
        let along = |s: f64| [s * theta.sin(), -s * theta.cos()];
        let rod = |from: f64, to: f64| {
            let mut rod = Body::rod(mass * (to - from), along(from * length), along(to * length));
            rod.pose[2] = theta;
            rod
        };
        Self {
            first: (vec![rod(0.0, f)], vec![[0.0, -1.0, 0.0, 0.0]]),
            second: (vec![rod(f, 1.0)], Vec::new()),
            glued: (0, 0),
            at: along(f * length),
            weld: true,
        }
    }

    /// Two rods, the first pinned at the origin; angles from +x.
    pub fn double_pendulum(m: [f64; 2], l: [f64; 2], a: [f64; 2]) -> Self {
        let joint = [l[0] * a[0].cos(), l[0] * a[0].sin()];
        let end = [joint[0] + l[1] * a[1].cos(), joint[1] + l[1] * a[1].sin()];
        let (mut one, mut two) = (Body::rod(m[0], [0.0, 0.0], joint), Body::rod(m[1], joint, end));
        (one.pose[2], two.pose[2]) = (a[0], a[1]);
        Self {
            first: (vec![one], vec![[0.0, -1.0, 0.0, 0.0]]),
            second: (vec![two], Vec::new()),
            glued: (0, 0),
            at: joint,
            weld: false,
        }
    }

    /// Crank A–B and coupler B–C on side 1, rocker D–C on side 2, rods of one mass per length.
    pub fn four_bar([a, b, c, d]: [[f64; 2]; 4], density: f64) -> Self {
        let rod = |p: [f64; 2], q: [f64; 2]| {
            let length = ((q[0] - p[0]) * (q[0] - p[0]) + (q[1] - p[1]) * (q[1] - p[1])).sqrt();
            Body::rod(density * length, p, q)
        };
        Self {
            first: (vec![rod(a, b), rod(b, c)], vec![[0.0, -1.0, a[0], a[1]], [0.0, 1.0, b[0], b[1]]]),
            second: (vec![rod(d, c)], vec![[0.0, -1.0, d[0], d[1]]]),
            glued: (1, 0),
            at: c,
            weld: false,
        }
    }
}

/// The mechanism of a case and the variables behind its quantities.
fn mechanism(case: &str, p: Parameters) -> Outcome<Mechanism> {
    if case.starts_with("PEND") {
        return Ok(Mechanism::pendulum(p.number("L")?, p.number("m")?, p.number("th0")?, p.before("L")?));
    }
    if case.starts_with("DP") {
        let pair = |a: &str, b: &str| Ok::<_, String>([p.number(a)?, p.number(b)?]);
        return Ok(Mechanism::double_pendulum(pair("m1", "m2")?, pair("l1", "l2")?, pair("a1", "a2")?));
    }
    let points = p.numbers("D")?;
    let &[ax, ay, bx, by, cx, cy, dx, dy] = points.as_slice() else {
        return Err(format!("four points are needed, not `{}`", p.0));
    };
    Ok(Mechanism::four_bar([[ax, ay], [bx, by], [cx, cy], [dx, dy]], p.number("rho")?))
}

/// The three forms of the table.
pub fn answer(case: &str, p: Parameters, rows: &[(Option<f64>, String)]) -> Outcome<Answers> {
    let mechanism = mechanism(case, p)?;
    let times: Vec<f64> = rows.iter().filter_map(|r| r.0).collect();
    let last = times.iter().fold(0.0_f64, |m, t| larger(m, *t));
    let h = common_step(&times, 0.0025);
    let limits = extrapolate(h, &[2, 3, 4, 5], |h| {
        // rounding of a place of 1 m is 1e-8 N at the shortest of these steps
        let setting = Setting { gluing: "tolerance = 1e-8".into(), ..Setting::iterative(h, GRAVITY) };
        let mut testbed = build(&mechanism.cut(&setting, ALPHA))?;
        let mut out = vec![f64::NAN; rows.len()];
        let mut count = 0;
        step(&mut testbed, steps_to(last, h), |testbed| {
            count += 1;
            for (value, (t, name)) in out.iter_mut().zip(rows) {
                if t.is_some_and(|t| steps_to(t, h) == count) {
                    *value = match name.as_str() {
                        "theta" | "angle1" | "crank" => read(testbed, "first.b0.angle")?,
                        "thetadot" => read(testbed, "first.b0.omega")?,
                        "coupler" => read(testbed, "first.b1.angle")?,
                        "angle2" | "rocker(D->C)" => read(testbed, "second.b0.angle")?,
                        "Fx_on_1" | "Fx_on_rod1" | "Fx_on_coupler" => wrench(testbed, 0, 0),
                        "Fy_on_1" | "Fy_on_rod1" | "Fy_on_coupler" => wrench(testbed, 0, 1),
                        "Mz_on_1" => wrench(testbed, 0, 5),
                        other => return Err(format!("{case} has no quantity `{other}`")),
                    };
                }
            }
            Ok(())
        })?;
        Ok(out)
    })?;
    Ok(Answers::extrapolated(limits, h, 4, "generalized-alpha 0.8"))
}
