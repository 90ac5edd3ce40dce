//! Rigid wheel on soil by integration of the stresses below the rim (Wong and Reece 1967, J. Terramechanics 4),
//! with Bekker's pressure and the shear of Janosi and Hanamoto: what wheels on the soils are held against.
//!
//! Angles are counted from the lowest point of the rim, positive where soil enters. The wheel enters the soil at θ_f
//! = arccos(1 − h/r) and leaves it at 0, or a little behind where the soil springs back; the largest stress lies at θ_m =
//! (a0 + a1·s)·θ_f.

use super::rows::{Row, eight};
use crate::process::{Outcome, read, root};
use crate::validate::{Context, Figure, Limit};

/// Points that the table's digits need.
const POINTS: usize = 2000;

/// A wheel on a soil.
#[derive(Clone, Copy, Debug)]
pub struct Wheel {
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

/// What a wheel does at a sinkage, per integral.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct State {
    /// Sinkage, m.
    pub sinkage: f64,
    /// Vertical force, N.
    pub load: f64,
    /// Drawbar pull, N.
    pub pull: f64,
    /// Torque, N m.
    pub torque: f64,
}

impl Wheel {
    /// The state in which the wheel carries `load` (N) at the slip `s`, by bisection.
    pub fn under(&self, load: f64, slip: f64) -> State {
        let (mut low, mut high) = (0.0, self.radius);
        for _ in 0..80 {
            let h = 0.5 * (low + high);
            if self.at(h, slip).load < load { low = h } else { high = h }
        }
        self.at(0.5 * (low + high), slip)
    }

    /// The integrals at the sinkage h (m) and the slip `s`.
    pub fn at(&self, h: f64, slip: f64) -> State {
        let front = (1.0 - h / self.radius).acos();
        let middle = ((self.peak[0] + self.peak[1] * slip) * front).clamp(0.0, front);
        let mut sum = State { sinkage: h, ..State::default() };
        // squares of the variable take the kinks at both ends out
        let law =
            |theta: f64| self.modulus * (self.radius * (theta.cos() - front.cos()).max(0.0)).powf(self.n);
        self.add(&mut sum, [front, middle], &law, [front, slip]);
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
        State { load: area * sum.load, pull: area * sum.pull, torque: area * self.radius * sum.torque, ..sum }
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
        sum: &mut State,
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

/// Radius, width (m) and load (N) of a wheel of the reference table.
pub fn wheel_of(name: &str) -> Option<[f64; 3]> {
    match name {
        "Ishigami_r092_b107_W64.7" => Some([0.092, 0.107, 64.7]),
        "r150_b120_W64" => Some([0.15, 0.12, 64.0]),
        "HIT_r157_b165_W80" => Some([0.1573, 0.165, 80.0]),
        _ => None,
    }
}

/// The wheel on a soil of the table with the peak `[a0, a1]`.
pub fn wheel_on(soil: &Row, [radius, width]: [f64; 2], peak: [f64; 2]) -> Wheel {
    Wheel {
        radius,
        width,
        modulus: soil.modulus(width),
        n: soil.value("n"),
        cohesion: soil.value("c_pa"),
        friction: soil.value("phi_rad").tan(),
        shear: soil.value("K_m"),
        peak,
        unloading: f64::INFINITY,
        points: POINTS,
    }
}

/// The check of this code: lines of the reference table (a0 = 0.4, a1 = 0.15) with a digit that differs.
pub fn figures(_: &Context) -> Outcome<Vec<Figure>> {
    let rows = eight()?;
    let text = read(&root().join("tests/reference/terramechanics/wongreece_wheel.csv"))?;
    let mut different = 0;
    for line in text.lines().skip(1) {
        different += u32::from(!is_met(&rows, line).ok_or_else(|| format!("cannot read `{line}`"))?);
    }
    let what =
        "of 84 lines of wongreece_wheel.csv, those in which a printed digit differs from our integration";
    Ok(vec![Figure::new("soil.wong_reece.different_lines", f64::from(different), Limit::Equal(0.0), what)])
}

fn is_met(rows: &[Row], line: &str) -> Option<bool> {
    let cells: Vec<&str> = line.split(',').collect();
    let number = |k: usize| cells.get(k)?.parse::<f64>().ok();
    let [radius, width, load] = wheel_of(cells[0])?;
    let soil = rows.iter().find(|r| Some(&r.name) == cells.get(1))?;
    let state = wheel_on(soil, [radius, width], [0.4, 0.15]).under(load, number(2)?);
    let printed =
        [(state.sinkage, 1e5, number(3)?), (state.pull, 1e3, number(4)?), (state.torque, 1e4, number(5)?)];
    Some(printed.iter().all(|(mine, digits, theirs)| (mine * digits).round() == (theirs * digits).round()))
}
