//! Height and sinkage of the nodes of the ground for the text under the pointer: whole numbers of a small step, each as its
//! difference from the one before, deflated. Most of a ground is smooth, and most of its sinkage is zero.

use crate::reader::GroundRecord;
use base64::Engine;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use serde_json::{Value, json};
use std::io::Write;

/// Finest step, m: the text shows tenths of a millimetre.
const STEP_M: f64 = 2e-5;
/// Most nodes that are kept; of larger grounds every second, third … one.
const MOST_NODES: usize = 2_000_000;

/// As data of the page.
pub(crate) fn of(ground: &GroundRecord) -> std::io::Result<Value> {
    let [nx, ny] = ground.size;
    let stride = stride(ground.size);
    let pick = |values: &[f32]| -> Vec<f64> {
        let rows = values.chunks_exact(nx).step_by(stride);
        rows.flat_map(|row| row.iter().step_by(stride).map(|v| f64::from(*v))).collect()
    };
    Ok(json!({
        "origin": ground.origin, "spacing": ground.spacing * stride as f64,
        "size": [nx.div_ceil(stride), ny.div_ceil(stride)],
        "height": pack(&pick(&ground.height))?, "sinkage": pack(&pick(&ground.sinkage))?,
    }))
}

/// Every how many nodes one is kept.
pub(crate) fn stride([nx, ny]: [usize; 2]) -> usize {
    let mut stride = 1;
    while nx.div_ceil(stride) * ny.div_ceil(stride) > MOST_NODES {
        stride += 1;
    }
    stride
}

/// Lowest value, step, and the numbers.
pub(crate) fn pack(values: &[f64]) -> std::io::Result<Value> {
    let finite = || values.iter().copied().filter(|v| v.is_finite());
    let (low, high) = finite().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
    let low = if low.is_finite() { low } else { 0.0 };
    let step = f64::max(STEP_M, (high - low) / f64::from(u16::MAX));
    let mut differences = Vec::with_capacity(2 * values.len());
    let mut before = 0_u16;
    for value in values {
        // what is no number is drawn as the lowest
        let now = ((value - low) / step).round().clamp(0.0, f64::from(u16::MAX)) as u16;
        differences.extend_from_slice(&now.wrapping_sub(before).to_le_bytes());
        before = now;
    }
    // the fastest level: the page is a seventh larger than with the best one, which takes ten times as long
    let mut deflated = ZlibEncoder::new(Vec::new(), Compression::fast());
    deflated.write_all(&differences)?;
    let data = base64::engine::general_purpose::STANDARD.encode(deflated.finish()?);
    Ok(json!({ "low": low, "step": step, "data": data }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;

    fn unpacked(packed: &Value) -> Vec<f64> {
        let text = packed["data"].as_str().expect("text");
        let deflated = base64::engine::general_purpose::STANDARD.decode(text).expect("base64");
        let mut bytes = Vec::new();
        flate2::read::ZlibDecoder::new(&deflated[..]).read_to_end(&mut bytes).expect("zlib");
        let (low, step) = (packed["low"].as_f64().expect("low"), packed["step"].as_f64().expect("step"));
        let mut sum = 0_u16;
        let mut add = |pair: &[u8]| {
            sum = sum.wrapping_add(u16::from_le_bytes([pair[0], pair[1]]));
            low + step * f64::from(sum)
        };
        bytes.chunks_exact(2).map(&mut add).collect()
    }

    #[test]
    fn every_node_keeps_its_height_and_sinkage_to_the_hundredth_of_a_millimetre() {
        let [nx, ny] = [70, 50];
        let at = |k: usize| libm::sin(0.1 * (k % nx) as f64) * 0.3 - 0.002 * (k / nx) as f64;
        let height: Vec<f32> = (0..nx * ny).map(|k| at(k) as f32).collect();
        let sinkage: Vec<f32> = (0..nx * ny).map(|k| if k % 97 == 0 { 0.02 } else { 0.0 }).collect();
        let ground = GroundRecord { spacing: 0.01, size: [nx, ny], height, sinkage, ..Default::default() };
        let packed = of(&ground).expect("packed");
        for (name, values) in [("height", &ground.height), ("sinkage", &ground.sinkage)] {
            let read = unpacked(&packed[name]);
            assert_eq!(read.len(), values.len());
            for (read, value) in read.iter().zip(values) {
                assert!((read - f64::from(*value)).abs() < 1.01e-5, "{name}: {read} {value}");
            }
        }
        let bytes = packed["sinkage"]["data"].as_str().map_or(0, str::len);
        assert!(bytes < nx * ny / 4, "{bytes} characters of sinkage");
    }

    #[test]
    fn of_a_huge_ground_every_second_node_is_kept() {
        let size = [3000, 1001];
        let values = vec![0.5_f32; size[0] * size[1]];
        let ground = GroundRecord {
            spacing: 0.01,
            size,
            height: values.clone(),
            sinkage: values,
            ..Default::default()
        };
        let packed = of(&ground).expect("packed");
        assert_eq!((packed["size"][0].as_u64(), packed["size"][1].as_u64()), (Some(1500), Some(501)));
        assert_eq!(packed["spacing"].as_f64(), Some(0.02));
        assert_eq!(unpacked(&packed["height"]).len(), 1500 * 501);
    }
}
