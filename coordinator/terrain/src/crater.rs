//! A bowl with a raised rim, in closed form, whose steepest slope is bounded.

use terraglue_diagnostics::error::Result;
use terraglue_scenario::InputError;

/// Bounds above this are none: their tangent is only large.
const STEEPEST_RAD: f64 = 1.57;

/// A crater's height over the distance from its centre. The surrounding plain is at 0.
///
/// Both walls have the same shape: the slope grows linearly from 0, stays, and falls linearly to 0 (three
/// parabolas and lines that join without a kink). With the rounded parts each a share f of the width w, a wall
/// of height d has the slope d/(w·(1 − f)); f = 1/2, the smoothest, is taken where the bound allows it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Profile {
    radius: f64,
    floor: f64,
    crest: f64,
    inner: Wall,
    outer: Wall,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Wall {
    /// Width of the wall, m.
    width: f64,
    /// Height gained over it, m.
    height: f64,
    /// Share of the width over which the slope grows, and again falls.
    share: f64,
}

impl Profile {
    /// Crest of `diameter`, floor `depth` below it, crest `rim_height` above the plain, all m; no slope above
    /// `max_slope` (rad).
    ///
    /// # Errors
    /// Numbers that contradict each other; the error says which would fit.
    pub fn new(diameter: f64, depth: f64, rim_height: f64, max_slope: f64) -> Result<Self> {
        let sizes_fit = diameter > 0.0 && depth > 0.0 && rim_height >= 0.0 && max_slope > 0.0;
        if !sizes_fit || rim_height > depth {
            let message = format!(
                "a crater of `diameter_m` = {diameter}, `depth_m` = {depth} and `rim_height_m` = {rim_height} is no bowl"
            );
            let help = "positive numbers, the rim no higher than the crater is deep";
            return Err(InputError::plain(message, Some(help.into())).into());
        }
        let radius = 0.5 * diameter;
        let steepest = libm::tan(max_slope.min(STEEPEST_RAD));
        let share = (1.0 - depth / (radius * steepest)).min(0.5);
        if share <= 0.0 {
            return Err(too_steep(diameter, depth, max_slope).into());
        }
        let outer =
            Wall { width: (2.0 * rim_height / steepest).max(0.5 * radius), height: rim_height, share: 0.5 };
        Ok(Self {
            radius,
            floor: rim_height - depth,
            crest: rim_height,
            inner: Wall { width: radius, height: depth, share },
            outer,
        })
    }

    /// Height at distance r from the centre, m.
    pub fn height(&self, r: f64) -> f64 {
        if r <= self.radius {
            self.floor + self.inner.rise(r)
        } else if r < self.radius + self.outer.width {
            self.crest - self.outer.rise(r - self.radius)
        } else {
            0.0
        }
    }

    /// Tangent of the steepest slope.
    pub fn steepest(&self) -> f64 {
        self.inner.slope().max(self.outer.slope())
    }
}

impl Wall {
    fn slope(&self) -> f64 {
        self.height / (self.width * (1.0 - self.share))
    }

    /// Height gained at distance x from the foot of the wall, 0 ≤ x ≤ width.
    fn rise(&self, x: f64) -> f64 {
        let rounded = self.share * self.width;
        let rest = self.width - x;
        if x < rounded {
            0.5 * self.slope() * x * x / rounded
        } else if rest < rounded {
            self.height - 0.5 * self.slope() * rest * rest / rounded
        } else {
            self.slope() * (x - 0.5 * rounded)
        }
    }
}

fn too_steep(diameter: f64, depth: f64, max_slope: f64) -> Box<InputError> {
    let message = format!(
        "a crater of `diameter_m` = {diameter} and `depth_m` = {depth} is steeper than `max_slope_rad` = {max_slope}"
    );
    let slope = libm::tan(max_slope);
    let help = format!(
        "max_slope_rad above {:.4}, or depth_m below {:.4}, or diameter_m above {:.4}",
        libm::atan(2.0 * depth / diameter),
        0.5 * diameter * slope,
        2.0 * depth / slope
    );
    InputError::plain(message, Some(help))
}
