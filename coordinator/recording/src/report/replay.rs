//! Data of the 3-D replay: shapes as they were recorded, poses and forces at the times of the poses, and what became of the ground.
//! Thinned, so that all of it stays within 3 MB; the ground itself is that of the map.

use crate::messages::GluingRecord;
use crate::reader::{GroundChange, GroundRecord, PoseSeries, Recording};
use crate::report::figure::packed;
use crate::report::node_values;
use base64::Engine;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use foxglove::Encode;
use foxglove::messages::{SceneEntity, SceneUpdate};
use prost::Message;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::io::{Result, Write};
use terraglue_scenario::PageSpec;

/// Place of the replay in the page.
pub(crate) const FRAME: &str = r#"<div class="replay" id="replay"></div>"#;

/// Most poses of all bodies together.
const MOST_POSES: usize = 85_000;
/// Most nodes that change, counted as often as they do.
const MOST_CHANGES: usize = 250_000;
/// Most bytes of meshes before they are deflated; the largest ones are left out first.
const MOST_MESHES: usize = 2_500_000;

/// Everything the replay shows; `None` where no body with a shape ever had a pose.
pub(crate) fn data(recording: &Recording) -> Result<Option<Value>> {
    let drawn = recording.entities.iter().filter(|(frame, _)| recording.poses.contains_key(*frame));
    let (entities, left_out) = within(drawn.map(|(_, entity)| entity).collect());
    let frames: Vec<&str> = entities.iter().map(|e| e.frame_id.as_str()).collect();
    let Some(times) = times(recording, &frames) else { return Ok(None) };
    let schema = SceneUpdate::get_schema().map(|s| s.data.into_owned()).unwrap_or_default();
    let scene = SceneUpdate { deletions: Vec::new(), entities: entities.into_iter().cloned().collect() };
    let poses = poses(recording, &frames, &times)?;
    Ok(Some(json!({
        "t": packed(&times), "frames": frames, "poses": poses, "left_out": left_out,
        "page": PageSpec::of_text(recording.header.get("scenario_text")),
        "metres_per_newton": recording.metres_per_newton,
        "body": recording.reported_body().map(|(frame, _)| frame),
        "scene": deflated(&scene.encode_to_vec())?, "schema": deflated(&schema)?,
        "forces": forces(&recording.gluing, &times)?, "ground": ground(recording)?,
    })))
}

/// The entities without the largest meshes that do not fit, and how many meshes those are.
fn within(entities: Vec<&SceneEntity>) -> (Vec<&SceneEntity>, usize) {
    let size = |e: &SceneEntity| e.triangles.iter().map(Message::encoded_len).sum::<usize>();
    let mut by_size: Vec<(usize, &str)> = entities.iter().map(|e| (size(e), e.id.as_str())).collect();
    by_size.sort_unstable();
    let mut room = MOST_MESHES;
    let fits = |(bytes, id): &(usize, &str)| {
        room = room.checked_sub(*bytes)?;
        Some((*id).to_owned())
    };
    let kept: Vec<String> = by_size.iter().map_while(fits).collect();
    let left_out = entities.len() - kept.len();
    (entities.into_iter().filter(|e| kept.contains(&e.id)).collect(), left_out)
}

/// Times that are shown: those of the body with the most poses, thinned.
fn times(recording: &Recording, frames: &[&str]) -> Option<Vec<f64>> {
    let all = frames.iter().filter_map(|frame| recording.poses.get(*frame));
    let longest = &all.max_by_key(|series| series.t_s.len())?.t_s;
    let every = (longest.len() * frames.len()).div_ceil(MOST_POSES).max(1);
    let last = longest.last().filter(|_| !(longest.len() - 1).is_multiple_of(every));
    Some(longest.iter().step_by(every).chain(last).copied().collect())
}

/// x, y, z, w, x, y, z of all frames one after another, each at all times.
fn poses(recording: &Recording, frames: &[&str], times: &[f64]) -> Result<Vec<Value>> {
    let mut columns: [Vec<f64>; 7] = Default::default();
    for frame in frames {
        let series = &recording.poses[*frame];
        let mut before = [0.0; 4];
        for t in times {
            let row = at(&series.t_s, *t);
            let (position, turned) = (series.position[row], near(before, series, row));
            before = turned;
            columns.iter_mut().zip(position.iter().chain(&turned)).for_each(|(column, x)| column.push(*x));
        }
    }
    columns.iter().map(|column| node_values::pack(column)).collect()
}

/// Of the two quaternions of an orientation that which is nearer to the one before: the way between them is short.
fn near(before: [f64; 4], series: &PoseSeries, row: usize) -> [f64; 4] {
    let q = series.orientation[row];
    let same = before.iter().zip(&q).map(|(a, b)| a * b).sum::<f64>() >= 0.0;
    if same { q } else { q.map(|x| -x) }
}

/// The last row at or before a time; the first where there is none.
fn at(t_s: &[f64], t: f64) -> usize {
    t_s.partition_point(|own| *own <= t).saturating_sub(1)
}

/// How many forces there are at each time, and where they act (m) and what they are (N).
fn forces(gluing: &[GluingRecord], times: &[f64]) -> Result<Value> {
    let own: Vec<f64> = gluing.iter().map(|g| g.t).collect();
    let mut counts = Vec::with_capacity(times.len());
    let mut columns: [Vec<f64>; 6] = Default::default();
    for t in times {
        let before = columns[0].len();
        for port in gluing.get(at(&own, *t)).map_or(&[][..], |g| &g.ports) {
            let axis = |k: usize| -> f64 {
                port.frame.iter().skip(k).step_by(3).zip(&port.wrench).map(|(n, w)| n * w).sum()
            };
            let force = [axis(0), axis(1), axis(2)];
            if force.iter().any(|f| *f != 0.0) {
                let values = [port.origin.x, port.origin.y, port.origin.z].into_iter().chain(force);
                columns.iter_mut().zip(values).for_each(|(column, x)| column.push(x));
            }
        }
        counts.push((columns[0].len() - before) as f64);
    }
    let columns = columns.iter().map(|column| node_values::pack(column)).collect::<Result<Vec<Value>>>()?;
    Ok(json!({ "counts": packed(&counts), "columns": columns }))
}

/// Times of changes, how many nodes change at each, which nodes (differences modulo 2^32), and what height they get.
fn ground(recording: &Recording) -> Result<Value> {
    let Some(ground) = recording.final_ground.as_ref().filter(|g| !g.height.is_empty()) else {
        return Ok(Value::Null);
    };
    let finest = ground.spacing / 64.0;
    let mut apart_s = 0.0;
    let kept = loop {
        let kept = changes(ground, recording, apart_s, finest);
        if kept.iter().map(|(_, nodes)| nodes.len()).sum::<usize>() <= MOST_CHANGES || apart_s > 1e3 {
            break kept;
        }
        apart_s = f64::max(0.2, 2.0 * apart_s);
    };
    let times: Vec<f64> = kept.iter().map(|(t, _)| *t).collect();
    let counts: Vec<f64> = kept.iter().map(|(_, nodes)| nodes.len() as f64).collect();
    let all = || kept.iter().flat_map(|(_, nodes)| nodes);
    let mut before = 0_u32;
    let mut places = Vec::new();
    for node in all().map(|(node, _)| *node) {
        places.extend_from_slice(&node.wrapping_sub(before).to_le_bytes());
        before = node;
    }
    let heights: Vec<f64> = all().map(|(_, z)| f64::from(*z)).collect();
    Ok(json!({
        "t": packed(&times), "counts": packed(&counts), "nodes": deflated(&places)?,
        "heights": node_values::pack(&heights)?,
    }))
}

/// Nodes (of those that the page knows) with their heights.
type Changed = BTreeMap<u32, f32>;

/// Changes of the ground, collected over pieces of time; a node that returns to its last reported height is omitted.
fn changes(ground: &GroundRecord, recording: &Recording, apart_s: f64, finest: f64) -> Vec<(f64, Changed)> {
    let stride = node_values::stride(ground.size);
    let columns = ground.size[0].div_ceil(stride);
    let mut told: BTreeMap<u32, f32> = BTreeMap::new();
    let mut pieces: Vec<(f64, Changed)> = Vec::new();
    for GroundChange { t_s, nodes } in &recording.ground_changes {
        if pieces.last().is_none_or(|(from, _)| t_s - from > apart_s) {
            pieces.push((*t_s, Changed::new()));
        }
        for (node, was, z) in nodes {
            let (i, j) = (*node as usize % ground.size[0], *node as usize / ground.size[0]);
            if !i.is_multiple_of(stride) || !j.is_multiple_of(stride) {
                continue;
            }
            let key = (j / stride * columns + i / stride) as u32;
            let known = told.entry(key).or_insert(*was);
            if f64::from((*z - *known).abs()) > finest {
                *known = *z;
                pieces.iter_mut().next_back().map(|(_, changed)| changed.insert(key, *z));
            }
        }
    }
    pieces.retain(|(_, changed)| !changed.is_empty());
    pieces
}

/// Deflated, as base64.
fn deflated(bytes: &[u8]) -> Result<String> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(bytes)?;
    Ok(base64::engine::general_purpose::STANDARD.encode(encoder.finish()?))
}
