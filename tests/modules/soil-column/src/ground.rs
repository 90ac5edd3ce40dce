//! The ground at the start: the columns begin at its height below the foot.

use terraglue_subsystem::Terrain;

/// Heights of the initial ground; a plane at z = 0 where the scenario has no terrain.
#[derive(Default)]
pub struct Ground {
    origin: [f64; 2],
    spacing: f64,
    size: [usize; 2],
    heights: Vec<f64>,
}

impl Ground {
    /// Copies the terrain.
    pub fn new(terrain: Option<&dyn Terrain>) -> Self {
        let Some(terrain) = terrain else { return Self::default() };
        let size = terrain.size().map(|n| n as usize);
        let mut heights = vec![0.0; size[0] * size[1]];
        terrain.heights(0, 0, size[0], size[1], &mut heights);
        Self { origin: terrain.origin(), spacing: terrain.spacing(), size, heights }
    }

    /// Height at a point of the world by bilinear interpolation, m; outside as at the edge.
    pub fn height(&self, x: f64, y: f64) -> f64 {
        if self.heights.is_empty() {
            return 0.0;
        }
        let cell = |at: f64, axis: usize| {
            let last = self.size[axis] - 1;
            let u = ((at - self.origin[axis]) / self.spacing).clamp(0.0, last as f64);
            let low = (u as usize).min(last.saturating_sub(1));
            (low, (low + 1).min(last), u - low as f64)
        };
        let ((i0, i1, u), (j0, j1, w)) = (cell(x, 0), cell(y, 1));
        let h = |i: usize, j: usize| self.heights[j * self.size[0] + i];
        let mix = |a: f64, b: f64, s: f64| a + s * (b - a);
        mix(mix(h(i0, j0), h(i1, j0), u), mix(h(i0, j1), h(i1, j1), u), w)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn interpolates_inside_and_repeats_the_edge() {
        let ground = Ground {
            origin: [-1.0, 0.0],
            spacing: 0.5,
            size: [3, 2],
            heights: vec![0.0, 1.0, 2.0, 10.0, 11.0, 12.0],
        };
        assert_eq!(ground.height(-0.75, 0.0), 0.5);
        assert_eq!(ground.height(-0.75, 0.25), 5.5);
        assert_eq!(ground.height(9.0, 9.0), 12.0);
        assert_eq!(Ground::default().height(3.0, 4.0), 0.0);
    }
}
