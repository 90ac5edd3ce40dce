//! The ground as a PNG: colour by sinkage, hill shading by height.

use crate::reader::GroundRecord;
use terraglue_page::colour_map::Palette;

/// Longest side of the picture, pixels.
const LONGEST_SIDE: usize = 1600;
/// Light from the upper left, 45° above the horizon, as maps do.
const LIGHT: [f64; 3] = [-0.5, 0.5, std::f64::consts::FRAC_1_SQRT_2];

/// Range of sinkage in a ground: (most heave ≤ 0, deepest ≥ 0), m.
pub fn range(ground: &GroundRecord) -> (f64, f64) {
    ground
        .sinkage
        .iter()
        .fold((0.0, 0.0), |(low, high), s| (f64::min(low, f64::from(*s)), f64::max(high, f64::from(*s))))
}

/// Draws the ground, north up; `scale_m` is the sinkage of the last colour. Returns PNG bytes.
pub(crate) fn draw(ground: &GroundRecord, scale_m: f64) -> Result<Vec<u8>, png::EncodingError> {
    draw_within(ground, scale_m, LONGEST_SIDE)
}

/// The same with no side longer than so many pixels.
///
/// # Errors
/// The picture has no pixel.
pub fn draw_within(
    ground: &GroundRecord,
    scale_m: f64,
    longest: usize,
) -> Result<Vec<u8>, png::EncodingError> {
    let [nx, ny] = ground.size;
    let stride = nx.max(ny).div_ceil(longest).max(1);
    let (width, height) = (nx.div_ceil(stride), ny.div_ceil(stride));
    let (relief, palette) = (Relief::new(ground, stride), Palette::default());
    let mut rgb = Vec::with_capacity(width * height * 3);
    for row in (0..height).rev() {
        for column in 0..width {
            let (i, j) = (column * stride, row * stride);
            let share = strongest(ground, i, j, stride) / scale_m.max(1e-12);
            let mut lab = palette.colour(share);
            lab[0] *= 0.68 + 0.32 * relief.light(i, j) / LIGHT[2];
            rgb.extend_from_slice(&palette.to_rgb(lab));
        }
    }
    encode(&rgb, width as u32, height as u32)
}

/// Sinkage of largest magnitude in a block of nodes: a print is never lost between pixels.
fn strongest(ground: &GroundRecord, i0: usize, j0: usize, stride: usize) -> f64 {
    let [nx, ny] = ground.size;
    let mut strongest = 0.0_f32;
    for j in j0..(j0 + stride).min(ny) {
        for s in &ground.sinkage[j * nx + i0..j * nx + (i0 + stride).min(nx)] {
            if s.abs() > strongest.abs() {
                strongest = *s;
            }
        }
    }
    f64::from(strongest)
}

/// Slopes of the ground, exaggerated so that gentle terrain still shows.
struct Relief<'a> {
    ground: &'a GroundRecord,
    stride: usize,
    exaggeration: f64,
}

impl<'a> Relief<'a> {
    fn new(ground: &'a GroundRecord, stride: usize) -> Self {
        let mut relief = Self { ground, stride, exaggeration: 1.0 };
        let [nx, ny] = ground.size;
        let (mut sum, mut n) = (0.0, 0.0);
        for j in (0..ny).step_by(stride * 4) {
            for i in (0..nx).step_by(stride * 4) {
                let [sx, sy] = relief.slope(i, j);
                sum += sx * sx + sy * sy;
                n += 1.0;
            }
        }
        let rms = (sum / f64::max(n, 1.0)).sqrt();
        relief.exaggeration = (0.35 / rms.max(1e-9)).clamp(1.0, 6.0);
        relief
    }

    fn slope(&self, i: usize, j: usize) -> [f64; 2] {
        let [nx, ny] = self.ground.size;
        let z = |i: usize, j: usize| f64::from(self.ground.height[j * nx + i]);
        let across = |lo: usize, hi: usize| (hi - lo).max(1) as f64 * self.ground.spacing;
        let (w, e) = (i.saturating_sub(self.stride), (i + self.stride).min(nx - 1));
        let (s, n) = (j.saturating_sub(self.stride), (j + self.stride).min(ny - 1));
        [(z(e, j) - z(w, j)) / across(w, e), (z(i, n) - z(i, s)) / across(s, n)]
    }

    /// Lambert's cosine of the light on the surface, 0 … 1.
    fn light(&self, i: usize, j: usize) -> f64 {
        let [sx, sy] = self.slope(i, j).map(|s| s * self.exaggeration);
        // Walls of prints must not swallow the colour: steep slopes are drawn as if they were 45° at most.
        let flatten = 1.0 / (1.0 + sx * sx + sy * sy).sqrt();
        let (sx, sy) = (sx * flatten, sy * flatten);
        let length = (sx * sx + sy * sy + 1.0).sqrt();
        ((-sx * LIGHT[0] - sy * LIGHT[1] + LIGHT[2]) / length).clamp(0.0, 1.0)
    }
}

fn encode(rgb: &[u8], width: u32, height: u32) -> Result<Vec<u8>, png::EncodingError> {
    let mut out = Vec::new();
    let mut encoder = png::Encoder::new(&mut out, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Fast);
    encoder.write_header()?.write_image_data(rgb)?;
    Ok(out)
}
