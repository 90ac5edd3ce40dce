//! `cargo xtask pictures`: sections through the rut of a wheel that runs askew, through the trench of a dragged foot, and through
//! prints whose walls stand or slide, as an SVG file for docs/soil.md.

use super::drive::{Drive, Move, Vertical, on_rim};
use super::fixture::{LUNAR, Shown};
use super::panel::Panel;
use super::plates::level;
use crate::process::{Outcome, root, write};
use std::fmt::Write;
use terraglue_ground::Surface;
use terraglue_soil_cellular_automaton::SoilCellularAutomaton;
use terraglue_subsystem::Geometry;

const SPACING: f64 = 0.005;
const NODES: u32 = 161;
const LEVEL: [f64; 4] = [1.0, 0.0, 0.0, 0.0];

type Line = Vec<[f64; 2]>;

/// Heights along x (`axis` 0) or y (1) where the other coordinate is `at`, m.
fn section(bench: &Drive, axis: usize, at: f64) -> Line {
    let surface = Shown::new(bench.soil.as_ref());
    let lattice = *surface.lattice();
    let across = ((at - lattice.origin[1 - axis]) / lattice.spacing).round() as i32;
    let point = |k: i32| {
        let [i, j] = if axis == 0 { [k, across] } else { [across, k] };
        [lattice.position(i, j)[axis], surface.height(i, j)]
    };
    (0..NODES as i32).map(point).collect()
}

fn bench(config: &str, geometry: Geometry, lies: [f64; 4], x: f64) -> Drive {
    Drive::new(level::<SoilCellularAutomaton>(config, NODES, SPACING), geometry, lies, [x, 0.0013])
}

/// The rut of a wheel at slip 0.2 under 64.7 N, across its way, behind it.
fn rut(degrees: f64) -> Line {
    const RADIUS: f64 = 0.092;
    let yaw = degrees.to_radians();
    let wheel = Geometry::Cylinder { half_length: 0.0535, radius: RADIUS };
    let mut bench = bench(LUNAR, wheel, on_rim(yaw), -0.15);
    let ahead = 5e-4;
    let turn = ahead * yaw.cos() / 0.8 / RADIUS;
    for _ in 0..640 {
        bench.step(&Move::rolling(ahead, turn, yaw, 64.7));
    }
    section(&bench, 1, 0.0)
}

/// The trench of a foot of 3 cm radius under 8 N that was dragged by 16 cm, along its way.
fn trench() -> Line {
    let mut bench = bench(LUNAR, Geometry::Sphere { radius: 0.03 }, LEVEL, -0.1);
    for k in 0..1100 {
        let ahead = if k < 300 { 0.0 } else { 2e-4 };
        let load = 8.0 * f64::from(k.min(300)) / 300.0;
        bench.step(&Move { ahead: [ahead, 0.0], vertical: Vertical::Load(load), turn: [0.0; 3] });
    }
    section(&bench, 0, 0.0013)
}

/// The print of a disc of 5 cm radius pressed 3 cm deep, after it has gone and the soil rests.
fn print(config: &str) -> Line {
    let mut bench = bench(config, Geometry::Cylinder { half_length: 0.05, radius: 0.05 }, LEVEL, 0.0);
    let mut go = |up: f64, steps: u32| {
        for _ in 0..steps {
            bench.step(&Move { ahead: [0.0; 2], vertical: Vertical::Up(up), turn: [0.0; 3] });
        }
    };
    go(-1e-4, 300);
    go(5e-3, 20);
    go(0.0, 6000);
    section(&bench, 0, 0.0)
}

/// Writes the picture.
pub fn write_picture() -> Outcome {
    let mut out = String::from(
        "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 1130 310' font-family='sans-serif' font-size='12'>\n\
         <rect width='1130' height='310' fill='white'/>\n",
    );
    let panel = |k: usize, low: [f64; 2], high: [f64; 2]| Panel {
        at: [60.0 + 370.0 * k as f64, 40.0],
        size: [300.0, 210.0],
        low,
        high,
    };
    let sliding = LUNAR.replacen('{', r#"{"critical_height_m":0.0,"#, 1);
    let drawings = [
        (
            panel(0, [-0.2, -0.07], [0.2, 0.03]),
            "across the way (mm)",
            vec![(rut(0.0), "#888", "wheel along its way"), (rut(15.0), "#06c", "yawed by 15°")],
        ),
        (
            panel(1, [-0.2, -0.06], [0.2, 0.06]),
            "along the way (mm)",
            vec![(trench(), "#06c", "trench of a dragged sphere, dragged to the right")],
        ),
        (
            panel(2, [-0.15, -0.05], [0.15, 0.03]),
            "x (mm)",
            vec![
                (print(LUNAR), "#06c", "walls held by 170 Pa"),
                (print(&sliding), "#c60", "walls that slide"),
            ],
        ),
    ];
    for (panel, along, lines) in &drawings {
        panel.axes(&mut out, [0.05, 0.02], [1e3, 1e3], [along, "height (mm), not to scale"]);
        for (k, (line, colour, text)) in lines.iter().enumerate() {
            let inside: Line =
                line.iter().copied().filter(|[x, _]| panel.low[0] <= *x && *x <= panel.high[0]).collect();
            panel.line(&mut out, &inside, &format!("stroke='{colour}' stroke-width='2'"));
            let x = panel.at[0] + 150.0 * k as f64;
            let _ = writeln!(out, "<text x='{x}' y='28' fill='{colour}'>{text}</text>");
        }
    }
    write(&root().join("docs/images/soil_moves.svg"), &(out + "</svg>\n"))
}
