//! The grounds of several runs side by side: small pictures in one scale of colours.

use base64::Engine;
use std::fmt::Write;
use terraglue_page::colour_map::Palette;
use terraglue_recording::REPORT;
use terraglue_recording::report::html::{escape, number, with_prefix};
use terraglue_recording::report::picture;
use terraglue_recording::{GroundRecord, Recording};

/// Longest side of a picture, pixels.
const SIDE: usize = 480;
/// Share of the scale of colours by which a node counts as touched.
const TOUCHED: f64 = 0.01;
/// Nodes around what was touched that are shown too.
const AIR: usize = 12;

/// Pictures of the grounds at the end; of each run its name, its folder and its recording. None where no run has ground.
pub(crate) fn pictures(runs: &[(&str, String, &Recording)]) -> Option<String> {
    let grounds =
        || runs.iter().filter_map(|(_, _, r)| r.final_ground.as_ref()).filter(|g| !g.height.is_empty());
    let ranges = grounds().map(picture::range);
    let (low, high) = ranges.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))?;
    let scale = f64::max(high, -low);
    let shown = common_touched(grounds(), TOUCHED * scale);
    let mut out = String::from("<div style=\"display:flex;flex-wrap:wrap;gap:1em\">");
    for (name, folder, recording) in runs {
        let Some(ground) = recording.final_ground.as_ref().filter(|g| !g.height.is_empty()) else { continue };
        let ground = shown.map(|shown| part(ground, shown));
        let ground = ground.as_ref().or(recording.final_ground.as_ref())?;
        let Ok(png) = picture::draw_within(ground, scale, SIDE) else { continue };
        let image = base64::engine::general_purpose::STANDARD.encode(png);
        let _ = write!(
            out,
            "<figure style=\"margin:0;flex:1 1 18em;max-width:{SIDE}px\"><a href=\"{}/{REPORT}\"><img alt=\"ground of {name}\" \
             style=\"width:100%\" src=\"data:image/png;base64,{image}\"></a><figcaption>{name}</figcaption></figure>",
            escape(folder),
            name = escape(name)
        );
    }
    out.push_str("</div>");
    let _ = write!(out, "<p class=\"hint\">{}</p>", legend([low, high], scale, shown.is_some()));
    Some(out)
}

/// The scale of colours in words and patches.
fn legend([low, high]: [f64; 2], scale: f64, is_part: bool) -> String {
    let mut out = String::from("The ground at the end from above, coloured by sinkage, in one scale:");
    let palette = Palette::default();
    for share in [low / scale.max(1e-12), 0.0, 0.25, 0.5, 0.75, 1.0].into_iter().filter(|s| s * scale <= high)
    {
        let (value, unit) = with_prefix(share * scale, "m", 2);
        let text = if share == 0.0 { number(0.0, 1) } else { format!("{value}\u{a0}{unit}") };
        let _ = write!(
            out,
            " <span style=\"background:{};padding:0 .7em\"></span>\u{a0}{text}",
            palette.hex(share)
        );
    }
    if is_part {
        out.push_str(". All show the part of the ground that any of the runs has touched.");
    }
    out
}

/// Nodes i0 ≤ i < i1, j0 ≤ j < j1.
type Nodes = [[usize; 2]; 2];

/// The part of equal lattices in which any ground has sunk or risen by more than so much, m; none where lattices differ.
fn common_touched<'a>(
    grounds: impl Iterator<Item = &'a GroundRecord> + Clone,
    touched_m: f64,
) -> Option<Nodes> {
    let first = grounds.clone().next()?;
    if grounds.clone().any(|g| g.size != first.size || g.origin != first.origin || g.spacing != first.spacing)
    {
        return None;
    }
    let mut found = [[usize::MAX, 0]; 2];
    for ground in grounds {
        for (k, _) in ground.sinkage.iter().enumerate().filter(|(_, s)| f64::from(s.abs()) > touched_m) {
            for (range, n) in found.iter_mut().zip([k % ground.size[0], k / ground.size[0]]) {
                *range = [range[0].min(n), range[1].max(n + 1)];
            }
        }
    }
    let [x, y] = found;
    if x[0] >= x[1] {
        return None;
    }
    let wider = |range: [usize; 2], n: usize| [range[0].saturating_sub(AIR), (range[1] + AIR).min(n)];
    Some([wider(x, first.size[0]), wider(y, first.size[1])])
}

/// A part of a ground.
fn part(ground: &GroundRecord, [[i0, i1], [j0, j1]]: Nodes) -> GroundRecord {
    let cut = |values: &[f32]| {
        let rows = (j0..j1).map(|j| j * ground.size[0]);
        rows.flat_map(|row| values[row + i0..row + i1].iter().copied()).collect()
    };
    let origin = [(0, i0), (1, j0)].map(|(axis, n)| ground.origin[axis] + n as f64 * ground.spacing);
    GroundRecord {
        origin,
        size: [i1 - i0, j1 - j0],
        height: cut(&ground.height),
        sinkage: cut(&ground.sinkage),
        ..ground.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 40 × 30 nodes at 1 cm with a print of 2 cm depth around node (20, 10).
    fn pressed(depth: f32) -> GroundRecord {
        let size = [40, 30];
        let mut sinkage = vec![0.0_f32; 1200];
        (9..12).for_each(|j| (19..22).for_each(|i| sinkage[j * 40 + i] = depth));
        let height = sinkage.iter().map(|s| -s).collect();
        GroundRecord { t_s: 1.0, origin: [0.0; 2], spacing: 0.01, size, height, sinkage }
    }

    fn of(ground: GroundRecord) -> Recording {
        let mut recording = Recording::default();
        recording.final_ground = Some(ground);
        recording
    }

    #[test]
    fn all_pictures_show_the_same_part_in_the_same_scale() {
        let (one, two) = (of(pressed(0.02)), of(pressed(0.01)));
        let both = [("a<b", "one".to_owned(), &one), ("b", "two".to_owned(), &two)];
        let html = pictures(&both).expect("grounds");
        assert!(html.contains("a&lt;b") && html.matches("<img").count() == 2, "{html}");
        assert!(html.contains("20\u{a0}mm") && html.contains("href=\"two/report.html\""));
        let grounds = [pressed(0.02), pressed(0.01)];
        assert_eq!(common_touched(grounds.iter(), 2e-4), Some([[7, 34], [0, 24]]));
        let cut = part(&grounds[0], [[7, 34], [0, 24]]);
        assert_eq!((cut.size, cut.sinkage.len(), cut.origin), ([27, 24], 648, [0.07, 0.0]));
        assert!(pictures(&[("c", String::new(), &Recording::default())]).is_none());
    }
}
