//! Data of the map: picture of the ground, outlines of what stands still, footprints and tracks, path of the body; the page's script draws
//! and zooms it.

use crate::prints::Print;
use crate::reader::{GroundRecord, Recording};
use crate::report::figure::packed;
use crate::report::footprints::Leg;
use crate::report::outlines::{self, Outline};
use crate::report::{node_values, picture};
use base64::Engine;
use serde_json::{Value, json};
use terraglue_diagnostics::error::{Error, Result};
use terraglue_page::colour_map::Palette;

/// Place of the map in the page.
pub(crate) const FRAME: &str = r#"<div class="map" id="map">
<div class="map-bar"><span class="legend" id="map-legend"></span><span class="spacer"></span>
<span class="readout" id="map-readout">point at the ground to read height and sinkage</span>
<button type="button" data-view="track">track</button><button type="button" data-view="whole">whole ground</button></div>
<div class="map-body"><svg id="map-svg" role="img" aria-label="Ground from above, coloured by sinkage"></svg></div>
<div class="map-scale" id="map-scale"></div>
<p class="hint">Drag a rectangle to zoom, double-click to go back. Outlines: what was in the ground, one colour per foot or wheel;
bands: where it rolled or slid. Dashed lines: what stands still, from above. Light comes from the upper left.</p></div>"#;

/// Most footprints that are drawn.
const MOST_PRINTS: usize = 4000;

/// Everything the map shows; `None` where nothing but paths would be there.
pub(crate) fn data(recording: &Recording, legs: &[Leg]) -> Result<Option<Value>> {
    let ground = recording.final_ground.as_ref().filter(|g| !g.height.is_empty());
    let outlines = outlines::of(recording);
    if ground.is_none() && outlines.is_empty() {
        return Ok(None);
    }
    let (image, scale) = ground.map(|g| image(recording, g)).transpose()?.unwrap_or_default();
    let extent = |axis: usize| ground.map_or_else(|| around(recording, &outlines, axis), |g| extent(g, axis));
    let all = || legs.iter().enumerate();
    let marks: Vec<Value> = all()
        .flat_map(|(k, leg)| leg.single().map(move |print| mark(recording, k, leg, print)))
        .take(MOST_PRINTS)
        .collect();
    let tracks: Vec<Value> = all()
        .flat_map(|(k, leg)| leg.tracks().filter_map(move |prints| track(recording, k, leg, prints)))
        .take(MOST_PRINTS)
        .collect();
    let nodes = ground.map(node_values::of).transpose().map_err(|e| unmade(recording, &e.to_string()))?;
    let names: Vec<&str> = legs.iter().map(|l| l.body.as_str()).collect();
    Ok(Some(json!({
        "image": image, "x": extent(0), "y": extent(1),
        "legs": names, "marks": marks, "tracks": tracks, "nodes": nodes, "path": path(recording), "scale": scale,
        "outlines": outlines.iter().map(line).collect::<Vec<_>>(),
    })))
}

fn unmade(recording: &Recording, why: &str) -> Error {
    Error::Simulation { time_s: recording.end_s(), message: format!("picture of the ground: {why}") }
}

/// Where something pressed and stayed: its outline from above and when.
fn mark(recording: &Recording, leg: usize, of: &Leg, print: &Print) -> Value {
    let outline = of.footprint(recording, print);
    let ground = recording.final_ground.as_ref();
    let depth = ground.and_then(|g| g.sinkage.get(g.node_near(print.at)?).copied());
    json!({
        "leg": leg, "x": axis(&outline, 0), "y": axis(&outline, 1), "depth": depth,
        "from": print.from_s, "to": print.to_s, "force": print.largest_n,
    })
}

/// Where something rolled or slid: the line of its places, as wide as it is across the line, and its outline at the end.
fn track(recording: &Recording, leg: usize, of: &Leg, prints: &[Print]) -> Option<Value> {
    let (first, last) = (prints.first()?, prints.last()?);
    let line: Vec<[f64; 2]> = prints.iter().map(|p| p.at).collect();
    let outline = of.footprint(recording, last);
    let before = prints[prints.len() - 2].at;
    let way = [last.at[0] - before[0], last.at[1] - before[1]];
    let across = outline.iter().map(|p| (p[1] * way[0] - p[0] * way[1]) / way[0].hypot(way[1]));
    let (low, high) = across.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
    let force = prints.iter().map(|p| p.largest_n).fold(0.0, f64::max);
    Some(json!({
        "leg": leg, "x": axis(&line, 0), "y": axis(&line, 1), "width": high - low,
        "end": { "x": axis(&outline, 0), "y": axis(&outline, 1) },
        "from": first.from_s, "to": last.to_s, "force": force,
    }))
}

fn axis(points: &[[f64; 2]], axis: usize) -> String {
    packed(&points.iter().map(|p| p[axis]).collect::<Vec<f64>>())
}

/// Picture of the ground and the scale of its colours.
fn image(recording: &Recording, ground: &GroundRecord) -> Result<(Value, Value)> {
    let (low, high) = picture::range(ground);
    let scale = f64::max(high, -low);
    let png = picture::draw(ground, scale).map_err(|e| unmade(recording, &e.to_string()))?;
    let image = base64::engine::general_purpose::STANDARD.encode(png);
    Ok((json!(format!("data:image/png;base64,{image}")), scale_bar(low, high, scale)))
}

/// From edge to edge of the ground along an axis, m.
fn extent(ground: &GroundRecord, axis: usize) -> [f64; 2] {
    let (first, half) = (ground.origin[axis], 0.5 * ground.spacing);
    [first - half, first + (ground.size[axis] as f64 - 0.5) * ground.spacing]
}

/// Range of a map without ground along an axis, m: outlines and path with a margin.
fn around(recording: &Recording, outlines: &[Outline], axis: usize) -> [f64; 2] {
    let path =
        recording.reported_body().into_iter().flat_map(|(_, p)| p.position.iter().map(move |p| p[axis]));
    let lines = outlines.iter().flat_map(|o| o.points.iter().map(move |p| p[axis]));
    let (low, high) =
        path.chain(lines).fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
    [low - 0.2, high + 0.2]
}

fn line(outline: &Outline) -> Value {
    let points = &outline.points;
    json!({ "name": outline.frame.replacen('/', ".", 1), "x": axis(points, 0), "y": axis(points, 1) })
}

fn path(recording: &Recording) -> Value {
    let Some((_, poses)) = recording.reported_body() else { return Value::Null };
    let axis = |k: usize| poses.position.iter().map(|p| p[k]).collect::<Vec<f64>>();
    // Thinning by row number keeps x and y together.
    let every = poses.t_s.len().div_ceil(2000).max(1);
    let pick = |values: Vec<f64>| {
        let last = values.last().copied();
        let mut picked: Vec<f64> = values.into_iter().step_by(every).collect();
        picked.extend(last);
        packed(&picked)
    };
    json!({ "x": pick(axis(0)), "y": pick(axis(1)) })
}

fn scale_bar(low: f64, high: f64, scale: f64) -> Value {
    if scale <= 0.0 {
        return Value::Null;
    }
    let palette = Palette::default();
    let stops: Vec<Value> = (0..=24)
        .map(|k| {
            let share = f64::from(k) / 24.0;
            json!([share, palette.hex((low + share * (high - low)) / scale)])
        })
        .collect();
    json!({ "low": low, "high": high, "stops": stops })
}
