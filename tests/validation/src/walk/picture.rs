//! `cargo xtask pictures`: the picture of the README, `scenarios/moon_walk.toml` from above, as an SVG file. It shows the map of the
//! run's report: ground, footprints and path.

use super::SCENARIO;
use crate::columns;
use crate::process::{Outcome, read, root, run_scenario, write};
use crate::soil::Panel;
use base64::Engine;
use serde_json::Value;
use std::fmt::Write;
use std::path::Path;

const FILE: &str = "docs/images/moon_walk.svg";
/// Colours of the legs, as many as a hexapod has.
const COLOURS: [&str; 6] = ["#06c", "#c60", "#084", "#b22", "#74b", "#088"];
/// Margin beyond prints and path, m.
const AIR: f64 = 0.15;

/// Walks and draws.
pub fn write_picture(program: &Path) -> Outcome {
    let scratch = tempfile::tempdir().map_err(|e| format!("temporary folder: {e}"))?;
    let folder = scratch.path().join("walk");
    run_scenario(program, "the picture of the walk", SCENARIO, &folder, &["--csv"])?;
    let map = map(&folder.join("report.html"))?;
    let track = columns(&folder.join("variables.csv"), |n| n == "robot.body.x" || n == "robot.body.y")?;
    let path: Vec<[f64; 2]> = track[0].1.iter().zip(&track[1].1).map(|(x, y)| [*x, *y]).collect();
    write(&root().join(FILE), &draw(&map, &path).ok_or("the report of the walk has no map as it was")?)
}

/// The data of the map inside a report.
fn map(report: &Path) -> Outcome<Value> {
    let text = read(report)?;
    let data = text.split_once("id=\"data\">").and_then(|(_, rest)| rest.split_once("</script>"));
    let (data, _) = data.ok_or_else(|| format!("{} holds no data", report.display()))?;
    let mut data: Value = serde_json::from_str(data).map_err(|e| format!("{}: {e}", report.display()))?;
    Ok(data["map"].take())
}

/// Numbers as the page holds them: base64 of little-endian f32.
fn unpacked(value: &Value) -> Option<Vec<f64>> {
    let bytes = base64::engine::general_purpose::STANDARD.decode(value.as_str()?).ok()?;
    Some(bytes.as_chunks().0.iter().map(|b| f64::from(f32::from_le_bytes(*b))).collect())
}

/// A footprint: its outline and its leg.
fn print(value: &Value) -> Option<(Vec<[f64; 2]>, usize)> {
    let outline =
        unpacked(&value["x"])?.into_iter().zip(unpacked(&value["y"])?).map(|(x, y)| [x, y]).collect();
    Some((outline, value["leg"].as_u64()? as usize))
}

fn draw(map: &Value, path: &[[f64; 2]]) -> Option<String> {
    let prints: Vec<_> = map["marks"].as_array()?.iter().map(print).collect::<Option<_>>()?;
    let points = || prints.iter().flat_map(|p| p.0.iter().copied()).chain(path.iter().copied());
    let low = [0, 1].map(|k| points().map(|p| p[k]).fold(f64::INFINITY, f64::min) - AIR);
    let high = [0, 1].map(|k| points().map(|p| p[k]).fold(f64::NEG_INFINITY, f64::max) + AIR);
    let width = 1000.0;
    let height = width * (high[1] - low[1]) / (high[0] - low[0]);
    let panel = Panel { at: [70.0, 40.0], size: [width, height], low, high };
    let mut out = String::new();
    let _ = writeln!(
        out,
        "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 1090 {:.0}' font-family='sans-serif' font-size='14'>\n\
         <rect width='100%' height='100%' fill='#fff'/>\n<clipPath id='frame'><rect x='70' y='40' width='{width}' \
         height='{height:.1}'/></clipPath>",
        height + 130.0
    );
    ground(&mut out, map, &panel)?;
    for (outline, leg) in &prints {
        let style = format!("stroke='{}' stroke-width='2'", COLOURS[leg % COLOURS.len()]);
        let closed: Vec<[f64; 2]> = outline.iter().chain(outline.first()).copied().collect();
        panel.line(&mut out, &closed, &style);
    }
    panel.line(&mut out, path, "stroke='#111' stroke-width='2.5'");
    panel.axes(&mut out, [0.5, 0.2], [100.0, 100.0], ["x (cm)", "y (cm)"]);
    for (k, leg) in map["legs"].as_array()?.iter().enumerate() {
        let (x, colour) = (70 + 60 * k, COLOURS[k % COLOURS.len()]);
        let _ = writeln!(out, "<text x='{x}' y='26' fill='{colour}'>{}</text>", leg.as_str()?);
    }
    out += "<text x='440' y='26'>path of the body</text>\n";
    scale(&mut out, &map["scale"], height + 90.0)?;
    Some(out + "</svg>\n")
}

/// The picture of the whole ground, where its corners lie; the frame shows a part of it.
fn ground(out: &mut String, map: &Value, panel: &Panel) -> Option<()> {
    let corner = |k: usize| Some([map["x"][k].as_f64()?, map["y"][k].as_f64()?]);
    let ([left, bottom], [right, top]) = (panel.place(corner(0)?), panel.place(corner(1)?));
    let image = map["image"].as_str()?;
    let _ = writeln!(
        out,
        "<g clip-path='url(#frame)'><image x='{left:.1}' y='{top:.1}' width='{:.1}' height='{:.1}' \
         preserveAspectRatio='none' href='{image}'/></g>",
        right - left,
        bottom - top
    );
    Some(())
}

/// The scale of colours.
fn scale(out: &mut String, scale: &Value, y: f64) -> Option<()> {
    let stops = scale["stops"].as_array()?;
    let width = 240.0 / stops.len() as f64;
    for (k, stop) in stops.iter().enumerate() {
        let x = 760.0 + width * k as f64;
        let _ = writeln!(
            out,
            "<rect x='{x:.1}' y='{y:.1}' width='{:.1}' height='10' fill='{}'/>",
            width + 0.2,
            stop[1].as_str()?
        );
    }
    let millimetres = |key: &str| Some((1e3 * scale[key].as_f64()?).round());
    let _ = writeln!(
        out,
        "<text x='750' y='{:.1}' text-anchor='end'>sinkage (mm) {}</text><text x='1006' y='{:.1}'>{}</text>",
        y + 10.0,
        millimetres("low")?,
        y + 10.0,
        millimetres("high")?
    );
    Some(())
}
