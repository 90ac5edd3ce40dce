//! What a soil asks of a pressure–sinkage curve beyond its value: inverses and work of a curve given by a function of the
//! depth that answers pressure and slope.

/// Smallest depth at which a law is looked at, m.
const SHALLOWEST: f64 = 1e-9;
/// Largest depth that a law is asked for, m.
const DEEPEST: f64 = 1e3;
/// Steps at most.
const STEPS: usize = 200;
/// Newton steps after which every other step is a bisection: where a law bends sharply Newton's jump to and fro.
const QUICK: usize = 20;

/// Whether step number `k` halves the bracket, whatever Newton says.
fn halves(k: usize) -> bool {
    k >= QUICK && k % 2 == 0
}

/// Depth where the law meets the elastic line k_u·z from above, m; 0 where it starts below it.
pub fn elastic_limit(law: &impl Fn(f64) -> (f64, f64), k_u: f64) -> f64 {
    if law(SHALLOWEST).0 <= k_u * SHALLOWEST {
        return 0.0;
    }
    // ln(p/(k_u z)) over ln z is a straight line for a power law: one Newton step then hits
    root_in_logarithms([SHALLOWEST, DEEPEST], SHALLOWEST, false, |z| {
        let (p, slope) = law(z);
        (p / (k_u * z), slope * z / p - 1.0)
    })
}

/// Depth at which the law gives the pressure `p` > 0, m, sought from `guess` on.
pub fn depth(law: &impl Fn(f64) -> (f64, f64), p: f64, shallowest: f64, guess: f64) -> f64 {
    let shallowest = shallowest.max(SHALLOWEST);
    if law(shallowest).0 >= p {
        return shallowest;
    }
    let start = if guess > shallowest && guess < DEEPEST { guess } else { shallowest.max(0.01) };
    root_in_logarithms([shallowest, DEEPEST], start, true, |z| {
        let (value, slope) = law(z);
        (value / p, slope * z / value)
    })
}

/// Root of ln f over ln z between the bounds, where f crosses 1, upwards or not; `f` answers f and d ln f / d ln z.
fn root_in_logarithms(
    [mut low, mut high]: [f64; 2],
    start: f64,
    rising: bool,
    f: impl Fn(f64) -> (f64, f64),
) -> f64 {
    let mut z = start;
    for k in 0..STEPS {
        let (ratio, exponent) = f(z);
        if ratio == 1.0 {
            return z;
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
            return next;
        }
        z = next;
    }
    z
}

/// ∫p dz from `from` to `to` with three Gauss points: exact enough for the depth that a foot gains in a step.
pub fn work(law: &impl Fn(f64) -> (f64, f64), from: f64, to: f64) -> f64 {
    const POINTS: [(f64, f64); 3] =
        [(-0.774_596_669_241_483_4, 5.0 / 9.0), (0.0, 8.0 / 9.0), (0.774_596_669_241_483_4, 5.0 / 9.0)];
    let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
    POINTS.iter().map(|(x, weight)| weight * half * law(middle + half * x).0).sum()
}

/// Nodes that are asked for together.
const CHUNK: usize = 64;

/// z with k_u·(z − permanent) = p(z), beyond the elastic limit, of several nodes: see `PressureCurve::largest_depth`. `law`
/// answers pressures and slopes at a row of depths; `z` holds guesses and gets the answers.
pub fn largest_depths(
    law: &impl Fn(&[f64], &mut [f64], &mut [f64]),
    k_u: f64,
    limit: f64,
    permanent: &[f64],
    z: &mut [f64],
) {
    for (permanent, z) in permanent.chunks(CHUNK).zip(z.chunks_mut(CHUNK)) {
        largest_of_chunk(law, k_u, limit, permanent, z);
    }
}

fn largest_of_chunk(
    law: &impl Fn(&[f64], &mut [f64], &mut [f64]),
    k_u: f64,
    limit: f64,
    permanent: &[f64],
    z: &mut [f64],
) {
    let (mut low, mut high) = ([0.0; CHUNK], [DEEPEST; CHUNK]);
    let mut under_way: [usize; CHUNK] = std::array::from_fn(|i| i);
    for i in 0..z.len() {
        low[i] = permanent[i].max(limit);
        z[i] = z[i].clamp(low[i], high[i]);
    }
    let mut count = z.len();
    for k in 0..STEPS {
        if count == 0 {
            return;
        }
        let (mut at, mut p, mut slope) = ([0.0; CHUNK], [0.0; CHUNK], [0.0; CHUNK]);
        at.iter_mut().zip(&under_way[..count]).for_each(|(at, i)| *at = z[*i]);
        law(&at[..count], &mut p[..count], &mut slope[..count]);
        let mut left = 0;
        for m in 0..count {
            let i = under_way[m];
            let residual = k_u * (z[i] - permanent[i]) - p[m];
            if residual < 0.0 {
                low[i] = z[i]
            } else {
                high[i] = z[i]
            }
            let mut next = z[i] - residual / (k_u - slope[m]);
            if halves(k) || !(next >= low[i] && next <= high[i]) {
                next = 0.5 * (low[i] + high[i]);
            }
            if (next - z[i]).abs() > 1e-15 * z[i] {
                under_way[left] = i;
                left += 1;
            }
            z[i] = next;
        }
        count = left;
    }
}
