//! Free bodies: the intermediate axis over a minute, and a box that tumbles through the air.

use crate::process::Outcome;
use crate::rigid_body::fixture::{Fixture, model, pose, table};
use crate::{Context, Figure, Limit};
use nalgebra::Vector3;
use terraglue_numerics::extremes::larger;

fn body(mass: f64, inertia: [f64; 3]) -> String {
    let [x, y, z] = inertia;
    format!(
        r#"<robot name="body"><link name="body"><inertial><mass value="{mass}"/>
        <inertia ixx="{x}" iyy="{y}" izz="{z}" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>"#
    )
}

/// All of them.
pub fn figures(context: &Context) -> Outcome<Vec<Figure>> {
    let mut all = intermediate_axis(context)?;
    all.extend(boxes(context)?);
    Ok(all)
}

fn intermediate_axis(context: &Context) -> Outcome<Vec<Figure>> {
    let inertia = [0.1, 0.2, 0.3];
    let file = model(&context.scratch, "racket.urdf", &body(1.0, inertia))?;
    let parameters = format!(r#"{{"model": "{file}", "rotation_rate_rad_s": [0.01, 10.0, 0.01]}}"#);
    let mut fixture = Fixture::new(&parameters, [0.0; 3], 1e-3)?;
    let momentum = |fixture: &Fixture| -> Outcome<(Vector3<f64>, f64)> {
        let state = fixture.states()?[0];
        let q = pose(&state).1;
        let local = q.inverse_transform_vector(&Vector3::from(state.angular_velocity));
        Ok((q * Vector3::from(inertia).component_mul(&local), local.y))
    };
    let (e0, (l0, mut last)) = (fixture.energy().kinetic, momentum(&fixture)?);
    let (mut energy, mut turn, mut flips) = (0.0_f64, 0.0_f64, 0);
    fixture.run(60.0, |fixture| {
        energy = larger(energy, (fixture.energy().kinetic / e0 - 1.0).abs());
        let (l, rate) = momentum(fixture)?;
        turn = larger(turn, (l - l0).norm() / l0.norm());
        flips += usize::from(rate * last < 0.0);
        last = rate;
        Ok(())
    })?;
    let id = "rigid-body.dzhanibekov";
    Ok(vec![
        Figure::new(format!("{id}.energy"), energy, Limit::AtMost(1e-8), "free body, 60 s: largest |ΔE|/E"),
        Figure::new(format!("{id}.momentum"), turn, Limit::AtMost(1e-10), "the same: largest |ΔL|/L"),
        Figure::new(
            format!("{id}.flips"),
            flips as f64,
            Limit::Equal(22.0),
            "sign changes of the middle rate",
        ),
    ])
}

/// Error of orientation (rad), position (m) and energy (relative) of the box after ten seconds.
fn tumble(file: &str, integrator: &str, h: f64) -> Outcome<[f64; 3]> {
    let parameters = format!(
        r#"{{"model": "{file}", "integrator": "{integrator}", "velocity_m_s": [-2, 2, 8],
        "rotation_rate_rad_s": [0.1, 5, 0.1]}}"#
    );
    let mut fixture = Fixture::new(&parameters, [0.0, 0.0, -9.8], h)?;
    let e0 = fixture.energy().mechanical();
    fixture.run(10.0, |_| Ok(()))?;
    let rows = table("ref_boxes_complex.csv")?;
    let row = rows.last().filter(|r| r.len() == 8).ok_or("the table of the box is cut")?;
    let expected =
        nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(row[1], row[2], row[3], row[4]));
    let (position, q) = pose(&fixture.states()?[0]);
    let exact = Vector3::new(-20.0, 20.0, 80.0 - 490.0);
    Ok([q.angle_to(&expected), (position - exact).norm(), (fixture.energy().mechanical() / e0 - 1.0).abs()])
}

fn boxes(context: &Context) -> Outcome<Vec<Figure>> {
    let text = body(10.0, [0.808_333_33, 0.683_333_33, 0.141_666_67]);
    let file = model(&context.scratch, "box.urdf", &text)?;
    let mut all = Vec::new();
    for integrator in ["symplectic-euler", "generalized-alpha", "energy-momentum"] {
        let first = integrator == "symplectic-euler";
        let steps = [1e-3, 5e-4, 2.5e-4];
        let errors: Vec<[f64; 3]> =
            steps.iter().map(|h| tumble(&file, integrator, *h)).collect::<Outcome<_>>()?;
        let id = format!("rigid-body.box.{integrator}");
        // The box turns about its middle axis, where rounding grows e-fold every 0.26 s: finer steps show that alone.
        let observed = |k: usize| 0.5 * (errors[0][k] / errors[2][k]).log2();
        let what = format!(
            "tumbling box, 10 s, order of the orientation; errors {:.2e} {:.2e} {:.2e} rad at 1, 1/2, 1/4 ms",
            errors[0][0], errors[1][0], errors[2][0]
        );
        all.push(Figure::new(format!("{id}.rotation_order"), observed(0), Limit::AtLeast(1.75), what));
        let what = "the same: position at 10 s and 1 ms, m (first order: g·t·h/2)";
        let limit = Limit::AtMost(if first { 0.5 * 9.8 * 10.0 * 1e-3 * 1.01 } else { 1e-8 });
        all.push(Figure::new(format!("{id}.position"), errors[0][1], limit, what));
        let what = "the same: |ΔE|/E after 10 s at 1 ms";
        let limit = if first { Limit::None } else { Limit::AtMost(1e-6) };
        all.push(Figure::new(format!("{id}.energy"), errors[0][2], limit, what));
    }
    Ok(all)
}
