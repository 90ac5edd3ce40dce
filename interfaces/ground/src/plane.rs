//! Height and normal of the ground below a footprint: a weighted least-squares plane through nearby nodes.

use crate::Surface;

/// A plane through (x, y, height) with an upward unit normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Height at the queried point, m.
    pub height: f64,
    /// Upward unit normal, world.
    pub normal: [f64; 3],
}

/// Nodes along a half axis of the fit; larger footprints are sampled every few nodes.
const HALF_SAMPLES: f64 = 4.0;
/// Nodes along an axis at most: those of both half axes, the one between them, and one for rounding.
const SAMPLES: usize = 2 * HALF_SAMPLES as usize + 2;
/// Nodes that are read at once.
const ROW: usize = 32;

/// Fits a plane to the ground around (x, y) within `radius` (m, raised to two cells).
///
/// Weights (1 − d²/R²)² fall to zero at the rim, so the plane moves smoothly with the point. The fit is the
/// least-squares solution of z = c₀ + c₁·dx + c₂·dy about the weighted centroid; on a plane it is exact.
/// Near the border only nodes of the lattice count; outside it the answer is level at the nearest node.
pub fn fit_plane<S: Surface + ?Sized>(surface: &S, x: f64, y: f64, radius: f64) -> Plane {
    PlaneFit::new(surface, radius).at(x, y)
}

/// Fits of planes within one radius; heights read for one serve the next where it samples the same nodes.
pub struct PlaneFit<'a, S: Surface + ?Sized> {
    surface: &'a S,
    /// Radius of the weights, m.
    reach: f64,
    stride: i32,
    /// First sample along x and y, and how many there are.
    first: [i32; 2],
    count: [usize; 2],
    heights: [[f64; SAMPLES]; SAMPLES],
}

impl<'a, S: Surface + ?Sized> PlaneFit<'a, S> {
    /// Fits within `radius`.
    pub fn new(surface: &'a S, radius: f64) -> Self {
        let spacing = surface.lattice().spacing;
        let reach = radius.max(2.0 * spacing) + 0.5 * spacing;
        let stride = ((reach / spacing / HALF_SAMPLES).ceil() as i32).max(1);
        Self { surface, reach, stride, first: [0; 2], count: [0; 2], heights: [[0.0; SAMPLES]; SAMPLES] }
    }

    /// The plane at (x, y): see [`fit_plane`].
    pub fn at(&mut self, x: f64, y: f64) -> Plane {
        self.sample([x, y]);
        let (lattice, [columns, rows]) = (self.surface.lattice(), self.count);
        let shrink = 1.0 / (self.reach * self.reach);
        let mut across = [0.0; SAMPLES];
        for (k, dx) in across[..columns].iter_mut().enumerate() {
            *dx = lattice.position(self.first[0] + k as i32 * self.stride, 0)[0] - x;
        }
        let mut sums = Sums { base: self.heights[0][0], ..Sums::default() };
        for (k, heights) in self.heights[..rows].iter().enumerate() {
            let dy = lattice.position(0, self.first[1] + k as i32 * self.stride)[1] - y;
            sums.add_row(dy, shrink, &across[..columns], &heights[..columns]);
        }
        sums.plane().unwrap_or_else(|| level(self.surface, x, y))
    }

    /// Reads the samples around a place, unless they are there.
    fn sample(&mut self, at: [f64; 2]) {
        let (lattice, stride) = (self.surface.lattice(), self.stride);
        // Multiples of the stride: the sample points stay put while the footprint moves over them.
        let start =
            |k: i32| k.div_euclid(stride) * stride + if k.rem_euclid(stride) > 0 { stride } else { 0 };
        let [i, j] = [0, 1].map(|axis| {
            let (low, high) = lattice.cell_range(axis, at[axis] - self.reach, at[axis] + self.reach);
            let low = start(low);
            let count = if low > high { 0 } else { ((high - low) / stride) as usize + 1 };
            (low, count.min(SAMPLES))
        });
        let (first, count) = ([i.0, j.0], [i.1, j.1]);
        if (first, count) == (self.first, self.count) {
            return;
        }
        (self.first, self.count) = (first, count);
        for (row, heights) in self.heights[..count[1]].iter_mut().enumerate() {
            let j = first[1] + row as i32 * stride;
            read_every(self.surface, (first[0], j), stride, &mut heights[..count[0]]);
        }
    }
}

/// Heights of every so many nodes of a row.
fn read_every<S: Surface + ?Sized>(surface: &S, (i, j): (i32, i32), stride: i32, out: &mut [f64]) {
    if stride == 1 {
        return surface.heights(i, j, out);
    }
    let stride = stride as usize;
    let mut heights = [0.0; ROW];
    let at_once = ((ROW - 1) / stride + 1).min(out.len().max(1));
    for (part, out) in out.chunks_mut(at_once).enumerate() {
        let read = &mut heights[..(out.len() - 1) * stride + 1];
        surface.heights(i + (part * at_once * stride) as i32, j, read);
        out.iter_mut().zip(read.iter().step_by(stride)).for_each(|(out, height)| *out = *height);
    }
}

fn level<S: Surface + ?Sized>(surface: &S, x: f64, y: f64) -> Plane {
    let [u, v] = surface.lattice().coordinates(x, y);
    Plane { height: surface.height(u.round() as i32, v.round() as i32), normal: [0.0, 0.0, 1.0] }
}

/// Weighted moments of the sampled points; heights relative to the first one, against cancellation.
#[derive(Default)]
struct Sums {
    base: f64,
    w: f64,
    x: f64,
    y: f64,
    z: f64,
    xx: f64,
    xy: f64,
    yy: f64,
    xz: f64,
    yz: f64,
}

impl Sums {
    /// Adds the points of a row at `y`; `shrink`: 1/R².
    fn add_row(&mut self, y: f64, shrink: f64, x: &[f64], heights: &[f64]) {
        let (mut w, mut wx, mut wxx, mut wz, mut wxz) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for (x, height) in x.iter().zip(heights) {
            let near = (1.0 - (x * x + y * y) * shrink).max(0.0);
            let (weight, z) = (near * near, height - self.base);
            w += weight;
            wx += weight * x;
            wxx += weight * x * x;
            wz += weight * z;
            wxz += weight * x * z;
        }
        self.w += w;
        self.x += wx;
        self.y += w * y;
        self.z += wz;
        self.xx += wxx;
        self.xy += wx * y;
        self.yy += w * y * y;
        self.xz += wxz;
        self.yz += wz * y;
    }

    fn plane(&self) -> Option<Plane> {
        let (mx, my, mz) = (self.x / self.w, self.y / self.w, self.z / self.w);
        let xx = self.xx - self.w * mx * mx;
        let yy = self.yy - self.w * my * my;
        let xy = self.xy - self.w * mx * my;
        let xz = self.xz - self.w * mx * mz;
        let yz = self.yz - self.w * my * mz;
        let determinant = xx * yy - xy * xy;
        // `>` also refuses NaN: no node in reach, or all in one row.
        let solvable = determinant > 1e-9 * xx * yy && xx > 0.0 && yy > 0.0;
        solvable.then(|| {
            let b = (xz * yy - yz * xy) / determinant;
            let c = (yz * xx - xz * xy) / determinant;
            let length = (1.0 + b * b + c * c).sqrt();
            Plane {
                height: self.base + mz - b * mx - c * my,
                normal: [-b / length, -c / length, 1.0 / length],
            }
        })
    }
}
