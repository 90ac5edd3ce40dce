//! Data of the map: picture of the ground, footprints, path of the body; the page's script draws and zooms it.

use crate::error::{Error, Result};
use crate::recording::reader::Recording;
use crate::recording::report::figure::packed;
use crate::recording::report::footprints::Leg;
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
Light comes from the upper left.</p></div>"#;

/// Most footprints that are drawn.
const MOST_PRINTS: usize = 4000;

/// Everything the map shows; `None` without ground.
pub(crate) fn data(recording: &Recording, legs: &[Leg]) -> Result<Option<Value>> {
    let Some(ground) = &recording.final_ground else { return Ok(None) };
    if ground.height.is_empty() {
        return Ok(None);
    }
    let (low, high) = picture::range(ground);
    let scale = f64::max(high, -low);
    let png = picture::draw(ground, scale).map_err(|e| Error::Simulation {
        time_s: ground.t_s,
        message: format!("picture of the ground: {e}"),
    })?;
    let image = base64::engine::general_purpose::STANDARD.encode(png);
    let half = 0.5 * ground.spacing;
    let extent = |axis: usize| {
        let first = ground.origin[axis];
        [first - half, first + (ground.size[axis] as f64 - 0.5) * ground.spacing]
    };
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
        "image": format!("data:image/png;base64,{image}"),
        "x": extent(0), "y": extent(1),
        "legs": names, "prints": prints, "path": path(recording),
        "scale": scale_bar(low, high, scale),
    })))
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
