//! A heavy top on a fixed tip against its equations in Euler angles: order of convergence.

use crate::process::Outcome;
use crate::rigid_body::fixture::{Fixture, G, model, pose};
use crate::{Context, Figure, Limit};
use nalgebra::Vector3;
use terraglue_numerics::extremes::larger;

/// Moments about the tip across and along the axis, kg m².
const ACROSS: f64 = 0.002;
const ALONG: f64 = 0.001;
const MASS: f64 = 0.5;
/// From the tip to the centre of mass, m.
const LENGTH: f64 = 0.05;
/// Spin about the axis, rad/s.
const SPIN: f64 = 200.0;
/// Tilt of the axis at the start.
const TILT: f64 = std::f64::consts::FRAC_PI_6;
const DURATION: f64 = 5.0;

/// Tilt θ and azimuth φ after a time from rest of both, spin ψ̇: the momenta about the axis and the vertical are constant
/// (Goldstein, Poole and Safko 2002, section 5.7); classical Runge–Kutta with 25 µs, exact to 1e-10 rad.
fn exact(t: f64) -> [f64; 2] {
    let (axis, vertical) = (ALONG * SPIN, ALONG * SPIN * TILT.cos());
    let slope = |y: [f64; 3]| {
        let (s, c) = y[0].sin_cos();
        let precession = (vertical - axis * c) / (ACROSS * s * s);
        let moment = MASS * G * LENGTH * s + ACROSS * precession * precession * s * c - axis * precession * s;
        [y[1], moment / ACROSS, precession]
    };
    let along = |y: [f64; 3], k: [f64; 3], by: f64| -> [f64; 3] { std::array::from_fn(|i| y[i] + by * k[i]) };
    let n = (t / 25e-6).round() as usize;
    let h = t / n as f64;
    let mut y = [TILT, 0.0, 0.0];
    for _ in 0..n {
        let k1 = slope(y);
        let k2 = slope(along(y, k1, 0.5 * h));
        let k3 = slope(along(y, k2, 0.5 * h));
        let k4 = slope(along(y, k3, h));
        y = std::array::from_fn(|i| y[i] + h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]));
    }
    [y[0], y[2]]
}

/// Results of a run.
struct TopRun {
    /// Angle between the axis and the exact one at the end, rad.
    axis: f64,
    /// Largest |ΔE|, J.
    energy: f64,
}

fn run(file: &str, scheme: &str, h: f64, exact: &Vector3<f64>) -> Outcome<TopRun> {
    let start = Vector3::new(TILT.sin(), 0.0, TILT.cos());
    let rate = SPIN * start;
    let text = format!(
        r#"{{"model": "{file}", "integrator": "{scheme}", "rotation_rate_rad_s": [{}, 0, {}],
        "loop": [{{"name": "tip", "kind": "spherical", "links": ["top", "world"], "origin": [0, 0, 0]}}]}}"#,
        rate.x, rate.z
    );
    let mut fixture = Fixture::new(&text, [0.0, 0.0, -G], h)?;
    let before = fixture.energy().mechanical();
    let mut energy = 0.0_f64;
    fixture.run(DURATION, |fixture| {
        energy = larger(energy, (fixture.energy().mechanical() - before).abs());
        Ok(())
    })?;
    let axis = pose(&fixture.states()?[0]).1 * start;
    Ok(TopRun { axis: axis.angle(exact), energy })
}

/// All of them.
pub fn figures(context: &Context) -> Outcome<Vec<Figure>> {
    let across = ACROSS - MASS * LENGTH * LENGTH;
    let (x, z) = (LENGTH * TILT.sin(), LENGTH * TILT.cos());
    let text = format!(
        r#"<robot name="top"><link name="top"><inertial><origin xyz="{x} 0 {z}" rpy="0 {TILT} 0"/>
        <mass value="{MASS}"/><inertia ixx="{across}" iyy="{across}" izz="{ALONG}" ixy="0" ixz="0" iyz="0"/>
        </inertial></link></robot>"#
    );
    let file = model(&context.scratch, "top.urdf", &text)?;
    let [tilt, azimuth] = exact(DURATION);
    let exact = Vector3::new(tilt.sin() * azimuth.cos(), tilt.sin() * azimuth.sin(), tilt.cos());
    let mut all = Vec::new();
    for scheme in ["symplectic-euler", "generalized-alpha", "energy-momentum"] {
        let first = scheme == "symplectic-euler";
        let steps = [1e-3, 5e-4, 2.5e-4];
        let runs: Vec<TopRun> =
            steps.iter().map(|h| run(&file, scheme, *h, &exact)).collect::<Outcome<_>>()?;
        let [a, b, c] = [0, 1, 2].map(|k| runs[k].axis);
        let id = format!("rigid-body.heavy_top.{scheme}");
        let what = format!(
            "heavy top, 5 s, order of the axis over three steps; errors {a:.2e} {b:.2e} {c:.2e} rad at 1, 1/2, 1/4 ms"
        );
        let order = 0.5 * (a / c).log2();
        let least = Limit::AtLeast(if first { 0.9 } else { 1.9 });
        all.push(Figure::new(format!("{id}.order"), order, least, what));
        let exact_energy = scheme == "energy-momentum";
        let limit = if exact_energy { Limit::AtMost(1e-9) } else { Limit::None };
        all.push(Figure::new(
            format!("{id}.energy"),
            runs[0].energy,
            limit,
            "the same: largest |ΔE| at 1 ms, J",
        ));
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_reference_of_the_top_is_that_of_an_independent_integration() {
        let [tilt, azimuth] = super::exact(5.0);
        assert!((tilt.to_degrees() - 30.101_572_271_727_7).abs() < 1e-8, "{tilt}");
        assert!((azimuth - 6.206_008_757_089_35).abs() < 1e-9, "{azimuth}");
    }
}
