//! The past of a run: messages at a time, all messages of a topic, and variables over time, from the file and from what it does not
//! have yet.

use crate::ground;
use crate::hub::Hub;
use crate::topics::is_own;
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use terraglue_diagnostics::Result;
use terraglue_recording::{ColumnReader, Stored, nanoseconds};

/// Largest answer of `/messages`, bytes.
const MOST_BYTES: usize = 64 << 20;

/// Appends a message: channel (u32), time (ns, u64), length (u32), all little-endian, then its bytes.
fn frame(message: &Stored, out: &mut Vec<u8>) {
    out.extend(u32::from(message.channel).to_le_bytes());
    out.extend(message.time_ns.to_le_bytes());
    out.extend((message.data.len() as u32).to_le_bytes());
    out.extend(&message.data);
}

/// Of each channel the last message at or before a time.
fn last(hub: &Hub, channels: &[u16], time_ns: u64) -> Result<Vec<Stored>> {
    let mut found = Vec::new();
    let mut rest: BTreeSet<u16> = channels.iter().copied().collect();
    hub.with_tail(|tail| {
        for message in tail.iter().rev().filter(|m| m.time_ns <= time_ns) {
            if rest.remove(&message.channel) {
                found.push(Stored::clone(message));
            }
        }
    });
    let rest: Vec<u16> = rest.into_iter().collect();
    found.extend(hub.with_file(|file| file.last(&rest, time_ns))?.unwrap_or_default());
    Ok(found)
}

/// The last messages of these topics at a time, as frames. `/ground/tiles` is made of the tiles of the recording.
///
/// # Errors
/// The recording cannot be read.
pub fn at(hub: &Hub, topics: &[&str], t_s: f64) -> Result<Vec<u8>> {
    let time_ns = nanoseconds(t_s);
    let channels = hub.channels(|topic| topics.contains(&topic) && !is_own(topic));
    let mut found = last(hub, &channels, time_ns)?;
    found.sort_by_key(|message| message.channel);
    let mut out = Vec::new();
    found.iter().for_each(|message| frame(message, &mut out));
    if topics.contains(&"/ground/tiles") {
        let tiles = last(hub, &hub.channels(ground::is_tile), time_ns)?;
        hub.ground_of(tiles.iter()).iter().for_each(|message| frame(message, &mut out));
    }
    Ok(out)
}

/// Gives all messages of these channels in their order, each once.
fn each(hub: &Hub, channels: &[u16], mut take: impl FnMut(&Stored)) -> Result {
    let own = |m: &&Arc<Stored>| channels.contains(&m.channel);
    // in one look: the tail moves on
    let (first, newer): (Option<u32>, Vec<Arc<Stored>>) = hub.with_tail(|tail| {
        (tail.iter().next().map(|m| m.sequence), tail.iter().filter(own).cloned().collect())
    });
    let in_file = |m: &Stored| first.is_none_or(|first| m.sequence < first);
    hub.with_file(|file| {
        file.each(channels, [0, u64::MAX], |message| {
            if in_file(message) {
                take(message);
            }
        })
    })?;
    newer.iter().for_each(|message| take(message));
    Ok(())
}

/// All messages of a topic, as frames; the last ones where they are too many.
///
/// # Errors
/// The recording cannot be read.
pub fn messages(hub: &Hub, topic: &str) -> Result<Vec<u8>> {
    let channels = hub.channels(|own| own == topic);
    let mut out = Vec::new();
    each(hub, &channels, |message| {
        if out.len() + message.data.len() > MOST_BYTES {
            out.clear();
        }
        frame(message, &mut out);
    })?;
    Ok(out)
}

/// Readers of the topics in which these variables are, with their places in `names`.
fn readers(hub: &Hub, names: &[&str]) -> BTreeMap<u16, (ColumnReader, Vec<(usize, usize)>)> {
    let mut readers = BTreeMap::new();
    for topic in hub.topics() {
        let Some(reader) = ColumnReader::of(&topic) else { continue };
        let places: Vec<(usize, usize)> = names
            .iter()
            .enumerate()
            .filter_map(|(k, name)| Some((k, reader.names().iter().position(|own| own == name)?)))
            .collect();
        if !places.is_empty() {
            readers.insert(topic.channel, (reader, places));
        }
    }
    readers
}

/// Values of variables over time, at most about so many points: `{names, t, values}` with a list for each variable.
///
/// # Errors
/// The recording cannot be read.
pub fn history(hub: &Hub, names: &[&str], points: usize) -> Result<Value> {
    let mut readers = readers(hub, names);
    let channels: Vec<u16> = readers.keys().copied().collect();
    let mut now = vec![f64::NAN; names.len()];
    let mut rows: BTreeMap<u64, Vec<f64>> = BTreeMap::new();
    each(hub, &channels, |message| {
        let Some((reader, places)) = readers.get_mut(&message.channel) else { return };
        let Some(values) = reader.read(&message.data) else { return };
        places.iter().for_each(|(k, column)| now[*k] = values[*column]);
        rows.insert(message.time_ns, now.clone());
    })?;
    let every = rows.len().div_ceil(points.max(2)).max(1);
    let end = rows.len().saturating_sub(1);
    let kept: Vec<(&u64, &Vec<f64>)> =
        rows.iter().enumerate().filter(|(k, _)| k % every == 0 || *k == end).map(|(_, row)| row).collect();
    let t: Vec<f64> = kept.iter().map(|(time_ns, _)| **time_ns as f64 / 1e9).collect();
    let of = |k: usize| kept.iter().map(|(_, row)| json!(row[k])).collect::<Value>();
    let values: Vec<Value> = (0..names.len()).map(of).collect();
    Ok(json!({ "names": names, "t": t, "values": values }))
}

/// Values of variables at a time.
///
/// # Errors
/// The recording cannot be read.
pub fn values(hub: &Hub, names: &[String], t_s: f64) -> Result<Vec<(String, Value)>> {
    let list: Vec<&str> = names.iter().map(String::as_str).collect();
    let mut readers = readers(hub, &list);
    let channels: Vec<u16> = readers.keys().copied().collect();
    let mut found = Vec::new();
    for message in last(hub, &channels, nanoseconds(t_s))? {
        let Some((reader, places)) = readers.get_mut(&message.channel) else { continue };
        let Some(values) = reader.read(&message.data) else { continue };
        found.extend(places.iter().map(|(k, column)| (names[*k].clone(), json!(values[*column]))));
    }
    Ok(found)
}
