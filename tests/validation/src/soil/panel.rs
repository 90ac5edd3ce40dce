//! A panel of a drawing with axes, for the pictures of docs/.

use std::fmt::Write;

/// A panel of a picture: origin in the picture, its size, and the coordinates at its corners.
pub struct Panel {
    /// Upper left corner in the picture.
    pub at: [f64; 2],
    /// Width and height in the picture.
    pub size: [f64; 2],
    /// Coordinates of the lower left corner.
    pub low: [f64; 2],
    /// Coordinates of the upper right corner.
    pub high: [f64; 2],
}

impl Panel {
    /// Place of a point in the picture.
    pub fn place(&self, p: [f64; 2]) -> [f64; 2] {
        let share = |k: usize| (p[k] - self.low[k]) / (self.high[k] - self.low[k]);
        [self.at[0] + share(0) * self.size[0], self.at[1] + (1.0 - share(1)) * self.size[1]]
    }

    /// A curve.
    pub fn line(&self, out: &mut String, points: &[[f64; 2]], style: &str) {
        let text: Vec<String> =
            points.iter().map(|p| self.place(*p)).map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
        let _ = writeln!(out, "<polyline fill='none' {style} points='{}'/>", text.join(" "));
    }

    /// Axes with ticks every `step`, labelled in `scale` units.
    pub fn axes(&self, out: &mut String, step: [f64; 2], scale: [f64; 2], labels: [&str; 2]) {
        let [x0, y0] = self.at;
        let [w, h] = self.size;
        let _ = writeln!(out, "<rect x='{x0}' y='{y0}' width='{w}' height='{h}' fill='none' stroke='#999'/>");
        for k in 0..2 {
            let first = (self.low[k] / step[k]).ceil() as i32;
            let last = (self.high[k] / step[k] + 1e-9).floor() as i32;
            for tick in first..=last {
                let value = f64::from(tick) * step[k];
                let mut p = self.low;
                p[k] = value;
                let [x, y] = self.place(p);
                let (x, y, anchor) = if k == 0 { (x, y + 16.0, "middle") } else { (x - 6.0, y + 4.0, "end") };
                let _ = writeln!(
                    out,
                    "<text x='{x:.1}' y='{y:.1}' text-anchor='{anchor}'>{}</text>",
                    (value * scale[k]).round()
                );
            }
        }
        let _ = writeln!(
            out,
            "<text x='{}' y='{}' text-anchor='middle'>{}</text><text transform='translate({},{}) rotate(-90)' \
             text-anchor='middle'>{}</text>",
            x0 + 0.5 * w,
            y0 + h + 34.0,
            labels[0],
            x0 - 38.0,
            y0 + 0.5 * h,
            labels[1]
        );
    }
}
