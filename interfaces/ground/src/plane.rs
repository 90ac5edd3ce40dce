//! Height and normal of the ground below a footprint: a weighted least-squares plane through nearby nodes.

use crate::Surface;

/// A plane through (x, y, height) with an upward unit normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Height at the point that was asked for, m.
    pub height: f64,
    /// Upward unit normal, world.
    pub normal: [f64; 3],
}

/// Nodes along a half axis of the fit; larger footprints are sampled every few nodes.
const HALF_SAMPLES: f64 = 4.0;
/// Nodes that are read at once.
const ROW: usize = 32;

/// Fits a plane to the ground around (x, y) within `radius` (m, raised to two cells).
///
/// Weights (1 − d²/R²)² fall to zero at the rim, so the plane moves smoothly with the point. The fit is the
/// least-squares solution of z = c₀ + c₁·dx + c₂·dy about the weighted centroid; on a plane it is exact.
/// Near the border only nodes of the lattice count; outside it the answer is level at the nearest node.
pub fn fit_plane<S: Surface + ?Sized>(surface: &S, x: f64, y: f64, radius: f64) -> Plane {
    let lattice = surface.lattice();
    let reach = radius.max(2.0 * lattice.spacing) + 0.5 * lattice.spacing;
    let stride = ((reach / lattice.spacing / HALF_SAMPLES).ceil() as i32).max(1);
    let (i0, i1) = lattice.cell_range(0, x - reach, x + reach);
    let (j0, j1) = lattice.cell_range(1, y - reach, y + reach);
    let mut sums = Sums::default();
    // Multiples of the stride: the sample points stay put while the footprint moves over them.
    let first = |k: i32| k.div_euclid(stride) * stride + if k.rem_euclid(stride) > 0 { stride } else { 0 };
    let mut heights = [0.0; ROW];
    for j in (first(j0)..=j1).step_by(stride as usize) {
        let mut read = first(i0)..first(i0);
        for i in (first(i0)..=i1).step_by(stride as usize) {
            if i >= read.end {
                read = i..(i + ROW as i32).min(i1 + 1);
                surface.heights(i, j, &mut heights[..read.len()]);
            }
            let p = lattice.position(i, j);
            let (dx, dy) = (p[0] - x, p[1] - y);
            let w = 1.0 - (dx * dx + dy * dy) / (reach * reach);
            if w > 0.0 {
                sums.add(w * w, dx, dy, heights[(i - read.start) as usize]);
            }
        }
    }
    sums.plane().unwrap_or_else(|| level(surface, x, y))
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
    fn add(&mut self, w: f64, x: f64, y: f64, height: f64) {
        if self.w == 0.0 {
            self.base = height;
        }
        let z = height - self.base;
        self.w += w;
        self.x += w * x;
        self.y += w * y;
        self.z += w * z;
        self.xx += w * x * x;
        self.xy += w * x * y;
        self.yy += w * y * y;
        self.xz += w * x * z;
        self.yz += w * y * z;
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
