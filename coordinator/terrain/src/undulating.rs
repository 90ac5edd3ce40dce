//! Rolling ground: a sum of waves of random direction and phase with the spectrum of natural terrain.

use super::grid::Grid;
use super::random::SplitMix64;
use std::f64::consts::TAU;
use terraglue_diagnostics::error::Result;
use terraglue_ground::Lattice;
use terraglue_scenario::InputError;

/// Number of waves; a multiple of those that are added side by side.
const WAVES: u32 = 64;

/// Exponent of the amplitude over the wavelength: the Hurst exponent of a self-affine surface, about 0.95 for
/// the lunar highlands (Rosenburg et al., 2011, from laser altimetry).
const HURST: f64 = 0.95;

struct Wave {
    kx: f64,
    ky: f64,
    phase: f64,
    amplitude: f64,
}

/// Waves of lengths between the two, one from each of 64 bands of equal ratio; the heights on the lattice are
/// then centred, blended to 0 within `flat_radius` (fully flat) … twice that, and scaled to `rms` exactly.
pub fn build(lattice: Lattice, rms: f64, wavelengths: [f64; 2], seed: u64, flat_radius: f64) -> Result<Grid> {
    check(&lattice, wavelengths)?;
    let mut heights = vec![0.0; lattice.node_count()];
    let waves: Vec<Wave> = waves(wavelengths, seed).collect();
    waves.as_chunks().0.iter().for_each(|some| add_waves(&mut heights, &lattice, some));
    let mean = heights.iter().sum::<f64>() / heights.len() as f64;
    heights.iter_mut().for_each(|h| *h -= mean);
    if flat_radius > 0.0 {
        flatten(&mut heights, &lattice, flat_radius);
    }
    let actual = (heights.iter().map(|h| h * h).sum::<f64>() / heights.len() as f64).sqrt();
    if rms > 0.0 && actual <= 0.0 {
        let message = format!("flat_radius_m = {flat_radius} flattens the whole ground, so no rms_m is left");
        return Err(InputError::plain(message, Some("make it smaller than half the ground".into())).into());
    }
    let scale = if actual > 0.0 { rms / actual } else { 0.0 };
    heights.iter_mut().for_each(|h| *h *= scale);
    Ok(Grid { lattice, heights })
}

fn check(lattice: &Lattice, [shortest, longest]: [f64; 2]) -> Result {
    let help = if !(shortest > 0.0 && longest >= shortest && longest.is_finite()) {
        "the shortest first, both positive".to_owned()
    } else if shortest < 2.0 * lattice.spacing {
        format!("a lattice of {} m shows waves from {} m on", lattice.spacing, 2.0 * lattice.spacing)
    } else {
        return Ok(());
    };
    let message = format!("wavelengths_m = [{shortest}, {longest}] cannot be shown");
    Err(InputError::plain(message, Some(help)).into())
}

fn waves([shortest, longest]: [f64; 2], seed: u64) -> impl Iterator<Item = Wave> {
    let mut random = SplitMix64::new(seed);
    let ratio = libm::log(longest / shortest);
    (0..WAVES).map(move |n| {
        let band = (f64::from(n) + random.unit()) / f64::from(WAVES);
        let wavelength = shortest * libm::exp(ratio * band);
        let heading = TAU * random.unit();
        let k = TAU / wavelength;
        Wave {
            kx: k * libm::cos(heading),
            ky: k * libm::sin(heading),
            phase: TAU * random.unit(),
            amplitude: libm::pow(wavelength, HURST),
        }
    })
}

/// Waves that are added side by side: each waits for its own product only.
const ABREAST: usize = 8;

/// Waves on their way along a row, the same part of all of them side by side.
#[derive(Clone, Copy)]
struct Phasors {
    re: [f64; ABREAST],
    im: [f64; ABREAST],
}

impl Phasors {
    /// Turned by the angles of which c and s are cosine and sine.
    fn turned(&self, [c, s]: &[[f64; ABREAST]; 2]) -> Self {
        let Self { re, im } = self;
        Self {
            re: std::array::from_fn(|k| re[k] * c[k] - im[k] * s[k]),
            im: std::array::from_fn(|k| re[k] * s[k] + im[k] * c[k]),
        }
    }
}

/// Adds some waves row by row; along a row the phasor of each turns by a constant angle, so that a node costs a product.
fn add_waves(heights: &mut [f64], lattice: &Lattice, waves: &[Wave; ABREAST]) {
    let turns = [libm::cos, libm::sin].map(|part| waves.each_ref().map(|w| part(w.kx * lattice.spacing)));
    for (j, row) in heights.chunks_exact_mut(lattice.size[0] as usize).enumerate() {
        let [x, y] = lattice.position(0, j as i32);
        let at = |part: fn(f64) -> f64| {
            waves.each_ref().map(|w| w.amplitude * part(w.kx * x + w.ky * y + w.phase))
        };
        let mut phasors = Phasors { re: at(libm::cos), im: at(libm::sin) };
        for h in row {
            *h = phasors.im.iter().fold(*h, |h, im| h + im);
            phasors = phasors.turned(&turns);
        }
    }
}

fn flatten(heights: &mut [f64], lattice: &Lattice, radius: f64) {
    for (j, row) in heights.chunks_exact_mut(lattice.size[0] as usize).enumerate() {
        for (i, h) in row.iter_mut().enumerate() {
            let [x, y] = lattice.position(i as i32, j as i32);
            let u = (((x * x + y * y).sqrt() - radius) / radius).clamp(0.0, 1.0);
            *h *= u * u * (3.0 - 2.0 * u);
        }
    }
}
