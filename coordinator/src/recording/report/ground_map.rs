//! Data of the map: picture of the ground, outlines of what stands still, footprints, path of the body; the page's script draws
//! and zooms it.

use crate::error::{Error, Result};
use crate::recording::reader::{GroundRecord, Recording};
use crate::recording::report::figure::packed;
use crate::recording::report::footprints::Leg;
use crate::recording::report::outlines::{self, Outline};
use crate::recording::report::{colour_map, picture};
use base64::Engine;
use serde_json::{Value, json};

/// Place of the map in the page.
pub(crate) const FRAME: &str = r#"<div class="map" id="map">
<div class="map-bar"><span class="legend" id="map-legend"></span><span class="spacer"></span>
<span class="readout" id="map-readout">point at the ground to read coordinates</span>
<button type="button" data-view="track">track</button><button type="button" data-view="whole">whole ground</button></div>
<div class="map-body"><svg id="map-svg" role="img" aria-label="Ground from above, coloured by sinkage"></svg></div>
<div class="map-scale" id="map-scale"></div>
<p class="hint">Drag a rectangle to zoom, double-click to go back. Circles: where feet pressed, one colour per leg.
Dashed lines: what stands still, from above. Light comes from the upper left.</p></div>"#;

/// Most footprints that are drawn.
const MOST_PRINTS: usize = 4000;

/// Everything the map shows; `None` where nothing but paths would be there.
pub(crate) fn data(recording: &Recording, legs: &[Leg]) -> Result<Option<Value>> {
    let ground = recording.final_ground.as_ref().filter(|g| !g.height.is_empty());
    let outlines = outlines::of(recording);
    if ground.is_none() && outlines.is_empty() {
        return Ok(None);
    }
    let (image, scale) = ground.map(image).transpose()?.unwrap_or_default();
    let extent = |axis: usize| ground.map_or_else(|| around(recording, &outlines, axis), |g| extent(g, axis));
    let prints: Vec<Value> = legs
        .iter()
        .enumerate()
        .flat_map(|(k, leg)| {
            let radius = recording.radius(&leg.subsystem, &leg.body).unwrap_or(0.03);
            leg.prints
                .iter()
                .map(move |p| json!([p.at[0], p.at[1], radius, k, p.from_s, p.to_s, p.largest_n]))
        })
        .take(MOST_PRINTS)
        .collect();
    let names: Vec<&str> = legs.iter().map(|l| l.body.as_str()).collect();
    Ok(Some(json!({
        "image": image, "x": extent(0), "y": extent(1),
        "legs": names, "prints": prints, "path": path(recording), "scale": scale,
        "outlines": outlines.iter().map(line).collect::<Vec<_>>(),
    })))
}

/// Picture of the ground and the scale of its colours.
fn image(ground: &GroundRecord) -> Result<(Value, Value)> {
    let (low, high) = picture::range(ground);
    let scale = f64::max(high, -low);
    let png = picture::draw(ground, scale).map_err(|e| Error::Simulation {
        time_s: ground.t_s,
        message: format!("picture of the ground: {e}"),
    })?;
    let image = base64::engine::general_purpose::STANDARD.encode(png);
    Ok((json!(format!("data:image/png;base64,{image}")), scale_bar(low, high, scale)))
}

/// From edge to edge of the ground along an axis, m.
fn extent(ground: &GroundRecord, axis: usize) -> [f64; 2] {
    let (first, half) = (ground.origin[axis], 0.5 * ground.spacing);
    [first - half, first + (ground.size[axis] as f64 - 0.5) * ground.spacing]
}

/// What a map without ground shows along an axis: outlines and path with some air, m.
fn around(recording: &Recording, outlines: &[Outline], axis: usize) -> [f64; 2] {
    let path =
        recording.reported_body().into_iter().flat_map(|(_, p)| p.position.iter().map(move |p| p[axis]));
    let lines = outlines.iter().flat_map(|o| o.points.iter().map(move |p| p[axis]));
    let (low, high) =
        path.chain(lines).fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
    [low - 0.2, high + 0.2]
}

fn line(outline: &Outline) -> Value {
    let axis = |k: usize| packed(&outline.points.iter().map(|p| p[k]).collect::<Vec<f64>>());
    json!({ "name": outline.frame.replacen('/', ".", 1), "x": axis(0), "y": axis(1) })
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
    let stops: Vec<Value> = (0..=24)
        .map(|k| {
            let share = f64::from(k) / 24.0;
            json!([share, colour_map::hex((low + share * (high - low)) / scale)])
        })
        .collect();
    json!({ "low": low, "high": high, "stops": stops })
}
