//! The inverse of a law: where a curve, given by a function of the depth that answers pressure and slope, meets a line or a
//! pressure.

use terraglue_subsystem::Result;

/// Smallest depth at which a law is evaluated, m.
const SHALLOWEST: f64 = 1e-9;
/// Largest depth at which a law is evaluated, m.
const DEEPEST: f64 = 1e3;
/// Steps at most.
const STEPS: usize = 200;
/// Newton steps after which every other step is a bisection: where a law bends sharply Newton's jump to and fro.
const QUICK: usize = 20;

/// Whether step number `k` halves the bracket, regardless of Newton.
fn halves(k: usize) -> bool {
    k >= QUICK && k.is_multiple_of(2)
}

/// Depth where the law meets the elastic line k_u·z from above, m; 0 where it starts below it.
pub fn elastic_limit(law: &impl Fn(f64) -> Result<(f64, f64)>, k_u: f64) -> Result<f64> {
    if law(SHALLOWEST)?.0 <= k_u * SHALLOWEST {
        return Ok(0.0);
    }
    // ln(p/(k_u z)) over ln z is a straight line for a power law: one Newton step then hits
    root_in_logarithms([SHALLOWEST, DEEPEST], SHALLOWEST, false, |z| {
        let (p, slope) = law(z)?;
        Ok((p / (k_u * z), slope * z / p - 1.0))
    })
}

/// Depth at which the law gives the pressure `p` > 0, m, sought from `guess` on.
pub fn depth(law: &impl Fn(f64) -> Result<(f64, f64)>, p: f64, shallowest: f64, guess: f64) -> Result<f64> {
    let shallowest = shallowest.max(SHALLOWEST);
    if law(shallowest)?.0 >= p {
        return Ok(shallowest);
    }
    let start = if guess > shallowest && guess < DEEPEST { guess } else { shallowest.max(0.01) };
    root_in_logarithms([shallowest, DEEPEST], start, true, |z| {
        let (value, slope) = law(z)?;
        Ok((value / p, slope * z / value))
    })
}

/// Root of ln f over ln z between the bounds, where f crosses 1, upwards or not; `f` answers f and d ln f / d ln z.
fn root_in_logarithms(
    [mut low, mut high]: [f64; 2],
    start: f64,
    rising: bool,
    f: impl Fn(f64) -> Result<(f64, f64)>,
) -> Result<f64> {
    let mut z = start;
    for k in 0..STEPS {
        let (ratio, exponent) = f(z)?;
        if ratio == 1.0 {
            return Ok(z);
        }
        if (ratio < 1.0) == rising {
            low = z
        } else {
            high = z
        }
        let mut next = z * libm::pow(ratio, -1.0 / exponent);
        if halves(k) || !(next > low && next < high) {
            next = (low * high).sqrt();
        }
        if (next - z).abs() <= 1e-15 * z {
            return Ok(next);
        }
        z = next;
    }
    Ok(z)
}
