//! The integral of the stresses below a rim (`terraglue::soil_fit::Rim`) on the soils of the figures, and against a table.

use super::rows::{SoilRow, eight};
use crate::process::{Outcome, read, root};
use crate::{Context, Figure, Limit};
use terraglue::soil_fit::Rim;

/// Points that the table's digits need.
const POINTS: usize = 2000;

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
pub fn wheel_on(soil: &SoilRow, [radius, width]: [f64; 2], peak: [f64; 2]) -> Rim {
    Rim {
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

fn is_met(rows: &[SoilRow], line: &str) -> Option<bool> {
    let cells: Vec<&str> = line.split(',').collect();
    let number = |k: usize| cells.get(k)?.parse::<f64>().ok();
    let [radius, width, load] = wheel_of(cells[0])?;
    let soil = rows.iter().find(|r| Some(&r.name) == cells.get(1))?;
    let state = wheel_on(soil, [radius, width], [0.4, 0.15]).under(load, number(2)?);
    let printed =
        [(state.sinkage, 1e5, number(3)?), (state.pull, 1e3, number(4)?), (state.torque, 1e4, number(5)?)];
    Some(printed.iter().all(|(mine, digits, theirs)| (mine * digits).round() == (theirs * digits).round()))
}
