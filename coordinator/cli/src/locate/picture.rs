//! The picture of a match: trees of the map as circles, those that are seen as crosses, lines between partners, and the ellipse of the
//! error, three deviations wide and drawn ten times as large where it would be too small to see.

use std::fmt::Write;
use terraglue_tree_localisation::{Answer, Found, LocalTree, Pose2, TreeMap};

/// Edge of the picture, and what is left of it around, pixels.
const EDGE: f64 = 900.0;
const MARGIN: f64 = 30.0;

/// Draws the surroundings of the best pose; without one the trees that are seen alone.
pub fn svg(map: &TreeMap, local: &[LocalTree], answer: &Answer) -> String {
    let (best, title) = match answer {
        Answer::Located(found) => (Some(&found.found), "located".to_owned()),
        Answer::Ambiguous(reason, all) => (all.first(), format!("ambiguous: {reason}")),
        Answer::Lost(reason) => (None, format!("lost: {reason}")),
    };
    let pose = best.map_or(Pose2::default(), |f| f.pose);
    let reach = local.iter().map(|t| t.place[0].hypot(t.place[1])).fold(10.0, f64::max) + 3.0;
    let view = View { pose, scale: (0.5 * EDGE - MARGIN) / reach };
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {EDGE} {EDGE}\" font-family=\"sans-serif\" font-size=\"14\">\n\
         <rect width=\"{EDGE}\" height=\"{EDGE}\" fill=\"white\"/>\n"
    );
    if best.is_some() {
        for k in map.around([pose.x, pose.y], reach) {
            let [u, v] = view.of(map.trees()[k as usize].place);
            add(
                &mut out,
                format_args!("<circle cx=\"{u:.1}\" cy=\"{v:.1}\" r=\"5\" fill=\"none\" stroke=\"#2a6\"/>"),
            );
        }
    }
    for (seen, partner) in best.iter().flat_map(|f| &f.matches) {
        let (Some(seen), Some(partner)) = (local.get(*seen as usize), map.trees().get(*partner as usize))
        else {
            continue;
        };
        let ([a, b], [c, d]) = (view.of(pose.place(seen.place)), view.of(partner.place));
        let line =
            format_args!("<line x1=\"{a:.1}\" y1=\"{b:.1}\" x2=\"{c:.1}\" y2=\"{d:.1}\" stroke=\"#e80\"/>");
        add(&mut out, line);
    }
    for tree in local {
        let [u, v] = view.of(pose.place(tree.place));
        let path = format_args!(
            "<path d=\"M{:.1} {v:.1}h8m-4 -4v8\" stroke=\"#24c\" stroke-width=\"1.5\"/>",
            u - 4.0
        );
        add(&mut out, path);
    }
    if let Some(found) = best {
        ellipse(&mut out, &view, found);
    }
    let text = title.replace('&', "&amp;").replace('<', "&lt;");
    add(&mut out, format_args!("<text x=\"{MARGIN}\" y=\"20\">{text}</text>"));
    let bar = 5.0 * view.scale;
    let (y, right) = (EDGE - 12.0, MARGIN + bar);
    add(&mut out, format_args!("<path d=\"M{MARGIN} {y}H{right:.1}\" stroke=\"black\" stroke-width=\"2\"/>"));
    add(&mut out, format_args!("<text x=\"{:.1}\" y=\"{}\">5 m</text>", right + 6.0, y + 4.0));
    out + "</svg>\n"
}

fn add(out: &mut String, text: std::fmt::Arguments) {
    // a text takes all that is written
    let _ = writeln!(out, "{text}");
}

fn ellipse(out: &mut String, view: &View, found: &Found) {
    let (a, b, c) = (found.covariance[(0, 0)], found.covariance[(1, 1)], found.covariance[(0, 1)]);
    let root = (0.25 * (a - b) * (a - b) + c * c).sqrt();
    let [long, short] =
        [0.5 * (a + b) + root, 0.5 * (a + b) - root].map(|x| 3.0 * x.max(0.0).sqrt() * view.scale);
    let times = if long < 4.0 { 10.0 } else { 1.0 };
    let turn = -(0.5 * (2.0 * c).atan2(a - b)).to_degrees();
    let [u, v] = view.of([found.pose.x, found.pose.y]);
    let (long, short) = (times * long, times * short);
    add(
        out,
        format_args!(
            "<ellipse rx=\"{long:.1}\" ry=\"{short:.1}\" transform=\"translate({u:.1} {v:.1}) rotate({turn:.1})\" fill=\"none\" stroke=\"#c22\"/>"
        ),
    );
    let [x, y] = view.of(found.pose.place([2.0, 0.0]));
    add(out, format_args!("<path d=\"M{u:.1} {v:.1}L{x:.1} {y:.1}\" stroke=\"#c22\" stroke-width=\"2\"/>"));
}

/// From places of the map to the picture.
struct View {
    pose: Pose2,
    scale: f64,
}

impl View {
    fn of(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [0.5 * EDGE + self.scale * (x - self.pose.x), 0.5 * EDGE - self.scale * (y - self.pose.y)]
    }
}
