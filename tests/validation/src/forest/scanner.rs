//! F1: the ranges of a scanner against the parameters of its errors, over a million rays.

use super::{Context, Figure, Limit};
use crate::process::Outcome;
use terraglue_laser_scanner::RayErrors;

/// Limit of a mean in its standard errors.
const STANDARD_ERRORS: f64 = 3.0;

pub fn figures(_: &Context) -> Outcome<Vec<Figure>> {
    let errors = RayErrors {
        noise_m: 0.02,
        noise_per_m: 0.001,
        angle_rad: 2e-4,
        bias_m: 0.013,
        drop_out: 0.02,
        drop_out_per_m: 0.001,
        drop_out_grazing: 0.3,
        beam_bias_m: 0.03,
        ..RayErrors::NONE
    };
    let (rays, distance, cosine) = (1_000_000_u64, 20.0, 0.5);
    let told: Vec<f64> = (0..rays).filter_map(|k| errors.range(11, k, distance, cosine)).collect();
    let (n, all) = (told.len() as f64, rays as f64);
    let loss = errors.loss(distance, cosine);
    let spread = errors.noise_m + errors.noise_per_m * distance;
    let off = |value: f64, wanted: f64, standard: f64| ((value - wanted) / standard).abs();
    let (mean, deviation) = moments(&told);
    let angles: Vec<f64> = (0..rays).flat_map(|k| errors.angles(11, k)).collect();
    let (angle_mean, angle_deviation) = moments(&angles);
    let two = 2.0 * all;
    let biases: Vec<f64> = (0..10_000).map(|ring| errors.of_beam(11, ring)).collect();
    let (bias_mean, bias_deviation) = moments(&biases);
    let beams = biases.len() as f64;
    let figure = |id: &str, value: f64, what: &str| {
        let what = format!("{what}, in standard errors, over 1e6 rays at 20 m and 60°");
        Figure::new(format!("forest.scanner.{id}"), value, Limit::AtMost(STANDARD_ERRORS), what)
    };
    Ok(vec![
        figure("range", off(mean, distance + errors.bias_m, spread / n.sqrt()), "F1 mean of the range"),
        figure("noise", off(deviation, spread, spread / (2.0 * n).sqrt()), "F1 deviation of the range"),
        figure("lost", off(1.0 - n / all, loss, (loss * (1.0 - loss) / all).sqrt()), "F1 share of lost rays"),
        figure(
            "beams",
            off(bias_mean, 0.0, errors.beam_bias_m / beams.sqrt()),
            "F1 mean of the biases of 10,000 beams",
        ),
        figure(
            "beam_biases",
            off(bias_deviation, errors.beam_bias_m, errors.beam_bias_m / (2.0 * beams).sqrt()),
            "F1 deviation of the biases of 10,000 beams",
        ),
        figure("aside", off(angle_mean, 0.0, errors.angle_rad / two.sqrt()), "F1 mean of the angles"),
        figure(
            "angles",
            off(angle_deviation, errors.angle_rad, errors.angle_rad / (2.0 * two).sqrt()),
            "F1 deviation of the angles",
        ),
    ])
}

/// Mean and deviation.
fn moments(all: &[f64]) -> (f64, f64) {
    let n = all.len() as f64;
    let mean = all.iter().sum::<f64>() / n;
    (mean, (all.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / n).sqrt())
}
