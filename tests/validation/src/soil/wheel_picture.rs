//! `cargo xtask pictures`: pressure and shear below a driven wheel, as an SVG file for docs/soil-laws.md.

use super::STILL;
use super::automaton::{Soil, automaton_on};
use super::panel::Panel;
use super::rows::STIFF;
use super::rows::eight;
use super::wheel_rig::Bench;
use super::wong_reece::wheel_on;
use crate::process::{Outcome, root, write};
use std::borrow::{Borrow, BorrowMut};
use std::fmt::Write;
use terraglue::soil_fit::Rim;
use terraglue_soil_law::ShearLaw;
use terraglue_subsystem::Subsystem;

/// Radius and width, m, and load, N.
const WHEEL: [f64; 2] = [0.092, 0.107];
const LOAD: f64 = 64.7;
const SLIP: f64 = 0.2;
const SPACING: f64 = 0.0025;
/// Length of the ground and way of the axle, m.
const GROUND: f64 = 0.6;
const WAY: f64 = 0.24;
/// Largest pressure of the colours and axes, Pa.
const HIGHEST: f64 = 18e3;

/// The soil with its nodes open to be looked at.
struct Open(Soil);

impl Borrow<dyn Subsystem> for Open {
    fn borrow(&self) -> &(dyn Subsystem + 'static) {
        &self.0
    }
}

impl BorrowMut<dyn Subsystem> for Open {
    fn borrow_mut(&mut self) -> &mut (dyn Subsystem + 'static) {
        &mut self.0
    }
}

/// Nodes below the wheel: places ahead of and beside the axle (m), pressure and driving shear stress (Pa).
struct Contact {
    nodes: Vec<([f64; 2], [f64; 2])>,
    sinkage: f64,
}

fn drive(config: &str) -> Contact {
    let size = (GROUND / SPACING) as u32 + 1;
    let open = Open(automaton_on(config, size, SPACING));
    let mut bench = Bench::new(open, WHEEL, LOAD, -0.5 * WAY);
    let sinkage = bench.drive(SLIP, WAY, 0.02).sinkage;
    let ground = bench.soil.0.ground();
    let law = ShearLaw::new(0.0, 0.5, 1.0, STIFF);
    let lattice = *ground.heights.lattice();
    let all = (0..size as i32).flat_map(|j| (0..size as i32).map(move |i| [i, j]));
    let nodes = all.filter_map(|[i, j]| {
        let state = ground.nodes.get(i, j);
        let [x, y] = lattice.position(i, j);
        let stresses = [state.pressure, -law.stiffness * state.shear.elastic[0]];
        (state.pressure > 0.0).then_some(([x - bench.axle[0], y], stresses))
    });
    Contact { nodes: nodes.collect(), sinkage }
}

/// White over yellow and red to black.
fn colour(share: f64) -> String {
    let s = share.clamp(0.0, 1.0);
    let part = |from: f64, to: f64| (255.0 * (1.0 - ((s - from) / (to - from)).clamp(0.0, 1.0))).round();
    format!("rgb({},{},{})", part(0.6, 1.2), part(0.2, 0.85), part(0.0, 0.35))
}

fn draw_map(out: &mut String, contact: &Contact) {
    let panel = Panel { at: [60.0, 40.0], size: [280.0, 280.0], low: [-0.07; 2], high: [0.07; 2] };
    for ([x, y], [pressure, _]) in &contact.nodes {
        let [left, top] = panel.place([x - 0.5 * SPACING, y + 0.5 * SPACING]);
        let side = SPACING / 0.14 * 280.0;
        let fill = colour(pressure / HIGHEST);
        let _ = writeln!(
            out,
            "<rect x='{left:.2}' y='{top:.2}' width='{:.2}' height='{:.2}' fill='{fill}'/>",
            side + 0.2,
            side + 0.2
        );
    }
    panel.axes(
        out,
        [0.02, 0.02],
        [1e3, 1e3],
        ["ahead of the axle (mm), the wheel rolls to the right", "across (mm)"],
    );
    panel.line(out, &[[0.0, -0.07], [0.0, 0.07]], "stroke='#666' stroke-dasharray='2 3'");
    for k in 0..=60 {
        let share = f64::from(k) / 60.0;
        let y = 320.0 - 280.0 * share;
        let _ = writeln!(
            out,
            "<rect x='352' y='{:.1}' width='12' height='4.9' fill='{}'/>",
            y - 4.7,
            colour(share)
        );
    }
    for kpa in [0.0, 6.0, 12.0, 18.0] {
        let y = 324.0 - 280.0 * kpa * 1e3 / HIGHEST;
        let _ = writeln!(out, "<text x='368' y='{y:.0}'>{kpa}</text>");
    }
    out.push_str("<text x='352' y='30'>kPa</text>\n");
}

fn draw_stresses(out: &mut String, [moving, denser]: [&Contact; 2], wheel: &Rim) {
    let panel = Panel { at: [470.0, 40.0], size: [350.0, 280.0], low: [-10.0, 0.0], high: [45.0, HIGHEST] };
    panel.axes(
        out,
        [10.0, 3e3],
        [1.0, 1e-3],
        ["angle from the lowest point (°), soil enters on the right", "stress (kPa)"],
    );
    let state = wheel.under(LOAD, SLIP);
    for (k, style) in [(0, "stroke='#f2b98a' stroke-width='6'"), (1, "stroke='#9cc4ee' stroke-width='6'")] {
        let at = |degrees: f64| [degrees, wheel.stresses(state.sinkage, SLIP, degrees.to_radians())[k]];
        let line: Vec<[f64; 2]> = (-20..=225).map(|k| at(0.2 * f64::from(k))).collect();
        panel.line(out, &line, style);
    }
    for (contact, hollow) in [(moving, true), (denser, false)] {
        for ([x, _], stresses) in contact.nodes.iter().filter(|(at, _)| at[1].abs() < 0.5 * SPACING) {
            let degrees = (x / WHEEL[0]).asin().to_degrees();
            for (stress, colour) in stresses.iter().zip(["#c60", "#06c"]) {
                let [px, py] = panel.place([degrees, *stress]);
                let fill = if hollow { "none" } else { colour };
                let _ = writeln!(
                    out,
                    "<circle cx='{px:.1}' cy='{py:.1}' r='2.6' fill='{fill}' stroke='{colour}' stroke-width='0.8'/>"
                );
            }
        }
    }
    for (y, colour, text) in [
        (58, "#c60", "normal stress, middle row"),
        (74, "#06c", "shear stress, middle row"),
        (90, "#555", "full: soil becomes denser in place"),
        (106, "#555", "hollow: 75 % of it moves"),
        (122, "#555", "lines: Wong and Reece"),
    ] {
        let _ = writeln!(out, "<text x='658' y='{y}' font-size='11' fill='{colour}'>{text}</text>");
    }
    let _ = writeln!(
        out,
        "<text x='470' y='30'>sinkage: full {:.1} mm, hollow {:.1} mm, line {:.1} mm</text>",
        1e3 * denser.sinkage,
        1e3 * moving.sinkage,
        1e3 * state.sinkage
    );
}

/// Writes the picture.
pub fn write_picture() -> Outcome {
    let soils = eight()?;
    let soil = soils.iter().find(|row| row.name == "lunar_nominal").ok_or("no lunar soil")?;
    let moving = drive(&soil.config);
    let denser = drive(&soil.with(STILL));
    let wheel = Rim { unloading: STIFF, ..wheel_on(soil, WHEEL, [0.0; 2]) };
    let mut out = String::from(
        "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 840 380' font-family='sans-serif' font-size='12'>\n\
         <rect width='840' height='380' fill='white'/>\n\
         <text x='60' y='30'>pressure from above, where soil moves</text>\n",
    );
    draw_map(&mut out, &moving);
    draw_stresses(&mut out, [&moving, &denser], &wheel);
    write(&root().join("docs/images/wheel_pressure.svg"), &(out + "</svg>\n"))
}
