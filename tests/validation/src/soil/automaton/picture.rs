//! `cargo xtask pictures`: the crater of a foot next to its pressure–sinkage curve, as an SVG file for docs/soil.md.

use super::feet::{Feet, instance};
use super::field::Function;
use super::machine::Machine;
use crate::process::{Outcome, root, write};
use crate::soil::fixture::LUNAR;
use crate::soil::panel::Panel;
use std::fmt::Write;
use std::sync::Arc;
use terraglue_soil_cellular_automaton::SoilCellularAutomaton;
use terraglue_subsystem::{Geometry, Pose};

const RADIUS: f64 = 0.05;
const DEPTH: f64 = 0.03;
const STRIDE: f64 = 1e-4;
const SPACING: f64 = 0.005;
/// n, k_c and k_φ of lunar_nominal_Apollo; b of a disc is its radius.
const LAW: [f64; 3] = [1.0, 1400.0, 820e3];

/// A disc pressed into level ground: pressure (Pa) by sinkage (m), the section while it stands and when it has gone (m).
struct Print {
    curve: Vec<[f64; 2]>,
    standing: Vec<[f64; 2]>,
    left: Vec<[f64; 2]>,
}

fn press() -> Print {
    let terrain = Function { size: [121; 2], spacing: SPACING, height: |_, _| 0.0 };
    let machine = Arc::new(Machine::new(Box::new(terrain), 1));
    let mut fixture = Feet::new(instance::<SoilCellularAutomaton>(LUNAR, machine));
    let at = |depth: f64| Pose { position: [0.0, 0.0, 0.1 - depth], ..Pose::IDENTITY };
    fixture.add(&Geometry::Cylinder { half_length: 0.1, radius: RADIUS }, at(0.0));
    let area = std::f64::consts::PI * RADIUS * RADIUS;
    let curve = (1..=(DEPTH / STRIDE).round() as u32)
        .map(|k| {
            let depth = STRIDE * f64::from(k);
            fixture.step(|_| at(depth));
            [depth, fixture.force(0)[2] / area]
        })
        .collect();
    (0..3000).for_each(|_| fixture.step(|_| at(DEPTH)));
    let section = |fixture: &Feet| {
        let heights = &fixture.soil.ground().heights;
        (20..=100).map(|i| [heights.lattice().position(i, 60)[0], heights.height(i, 60)]).collect()
    };
    let standing = section(&fixture);
    fixture.lift_and_rest(60_000);
    Print { curve, standing, left: section(&fixture) }
}

/// The picture as SVG text.
fn draw(print: &Print) -> String {
    let mut out = String::from(
        "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 860 330' font-family='sans-serif' font-size='12'>\n\
         <rect width='860' height='330' fill='white'/>\n",
    );
    let section = Panel { at: [60.0, 40.0], size: [400.0, 230.0], low: [-0.2, -0.05], high: [0.2, 0.065] };
    section.axes(&mut out, [0.05, 0.02], [1e3, 1e3], ["x (mm)", "height (mm), not to scale"]);
    let foot = [[-RADIUS, 0.06], [-RADIUS, -DEPTH], [RADIUS, -DEPTH], [RADIUS, 0.06]];
    section.line(&mut out, &foot, "stroke='#888' stroke-dasharray='2 3'");
    section.line(&mut out, &print.standing, "stroke='#c60' stroke-width='1.2' stroke-dasharray='6 3'");
    section.line(&mut out, &print.left, "stroke='#06c' stroke-width='2'");
    let curve = Panel { at: [540.0, 40.0], size: [290.0, 230.0], low: [0.0, 0.0], high: [0.03, 3e4] };
    curve.axes(&mut out, [0.01, 5e3], [1e3, 1e-3], ["sinkage (mm)", "pressure (kPa)"]);
    let [n, k_c, k_phi] = LAW;
    let law: Vec<[f64; 2]> = (0..=60)
        .map(|k| 0.0005 * f64::from(k))
        .map(|z| [z, (k_c / RADIUS + k_phi) * libm::pow(z, n)])
        .collect();
    curve.line(&mut out, &law, "stroke='#bbb' stroke-width='6'");
    curve.line(&mut out, &print.curve, "stroke='#06c' stroke-width='2'");
    for (x, y, colour, text) in [
        (60, 28, "#06c", "crater and rim when the foot has gone"),
        (300, 28, "#c60", "while it stands (dashed)"),
        (540, 28, "#06c", "automaton, material moving"),
        (725, 28, "#888", "p = (k_c/b + k_φ) zⁿ"),
    ] {
        let _ = writeln!(out, "<text x='{x}' y='{y}' fill='{colour}'>{text}</text>");
    }
    out + "</svg>\n"
}

/// Writes the picture.
pub fn write_picture() -> Outcome {
    write(&root().join("docs/images/automaton_crater.svg"), &draw(&press()))
}
