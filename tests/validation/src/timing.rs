//! CPU time against a calibration loop of the same run, so that figures of different machines can be compared.

use std::hint::black_box;
use std::time::Instant;

/// Median of an odd number of measurements.
pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

/// CPU time of this thread so far, s.
pub fn cpu_s() -> f64 {
    let t = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    t.tv_sec as f64 + 1e-9 * t.tv_nsec as f64
}

/// Time of one million dependent multiply-adds, s: the median of five.
pub fn calibration_s() -> f64 {
    median((0..5).map(|_| one_loop_s()).collect())
}

fn one_loop_s() -> f64 {
    let start = Instant::now();
    let mut x = black_box(0.5_f64);
    for _ in 0..1_000_000 {
        x = x * 1.000_000_1 + 1e-9;
    }
    black_box(x);
    start.elapsed().as_secs_f64()
}
