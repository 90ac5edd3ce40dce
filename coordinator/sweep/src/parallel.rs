//! Parallel coordinates: an axis for each varied key and figure, a line for each case, as inline SVG.

use crate::collect::{Collected, Row};
use std::fmt::Write;
use terraglue_recording::report::html::{escape, number};

/// Most lines; of more cases some are left out evenly.
const MOST_LINES: usize = 1000;
/// Most axes of figures.
const MOST_FIGURES: usize = 4;
const HEIGHT: f64 = 300.0;
const TOP: f64 = 34.0;
const BOTTOM: f64 = 22.0;
const SPACE: f64 = 150.0;
const MARGIN: f64 = 75.0;

/// The place of a case on an axis.
type Place = Box<dyn Fn(&Row) -> Option<f64>>;

/// An axis and its values.
struct Axis {
    title: String,
    /// Words from below to above, where its values are no numbers.
    words: Vec<String>,
    low: f64,
    high: f64,
    value: Place,
}

/// The diagram of the cases that have figures; none of fewer than two axes or cases.
pub fn diagram(all: &Collected) -> Option<String> {
    let rows: Vec<&Row> = all.rows.iter().filter(|row| row.is_done()).collect();
    let keys = (0..all.keys.len()).map(|k| of_key(all, k, &rows));
    let figures = all.shown.iter().take(MOST_FIGURES).map(|name| of_figure(name, &rows));
    let axes: Vec<Axis> = keys.chain(figures).flatten().collect();
    if axes.len() < 2 || rows.len() < 2 {
        return None;
    }
    let width = 2.0 * MARGIN + SPACE * (axes.len() - 1) as f64;
    let mut out = format!(
        "<svg viewBox=\"0 0 {width} {HEIGHT}\" style=\"max-width:{width}px;width:100%\" font-size=\"12\" fill=\"currentColor\" role=\"img\" aria-label=\"parallel coordinates\">"
    );
    let every = rows.len().div_ceil(MOST_LINES);
    for row in rows.iter().step_by(every) {
        line(&mut out, row, &axes);
    }
    for (k, axis) in axes.iter().enumerate() {
        draw(&mut out, axis, MARGIN + SPACE * k as f64);
    }
    out.push_str("</svg>");
    if every > 1 {
        let _ = write!(out, "<p class=\"hint\">One of {every} cases is drawn.</p>");
    }
    Some(out)
}

fn of_key(all: &Collected, k: usize, rows: &[&Row]) -> Option<Axis> {
    let title = all.keys[k].clone();
    let is_number = rows.iter().all(|row| row.values[k].parse::<f64>().is_ok());
    if is_number {
        return axis(title, rows, Box::new(move |row| row.values[k].parse().ok()));
    }
    let mut words: Vec<String> = rows.iter().map(|row| row.values[k].clone()).collect();
    words.sort();
    words.dedup();
    let names = words.clone();
    let place = move |row: &Row| names.iter().position(|word| *word == row.values[k]).map(|n| n as f64);
    Some(Axis { words, ..axis(title, rows, Box::new(place))? })
}

fn of_figure(name: &str, rows: &[&Row]) -> Option<Axis> {
    let own = name.to_owned();
    axis(name.to_owned(), rows, Box::new(move |row| row.figure(&own)))
}

/// An axis over the values of all rows; none where they are all equal.
fn axis(title: String, rows: &[&Row], value: Place) -> Option<Axis> {
    let values = rows.iter().filter_map(|row| value(row)).filter(|x| x.is_finite());
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
    (low < high).then_some(Axis { title, words: Vec::new(), low, high, value })
}

impl Axis {
    fn share(&self, row: &Row) -> Option<f64> {
        (self.value)(row).filter(|x| x.is_finite()).map(|x| (x - self.low) / (self.high - self.low))
    }
}

fn height(share: f64) -> f64 {
    TOP + (HEIGHT - TOP - BOTTOM) * (1.0 - share)
}

/// A line through the axes where the case has values; its colour is that of the last axis, from blue over grey to red.
fn line(out: &mut String, row: &Row, axes: &[Axis]) {
    let points: Vec<String> = axes
        .iter()
        .enumerate()
        .filter_map(|(k, axis)| {
            Some(format!("{:.1},{:.1}", MARGIN + SPACE * k as f64, height(axis.share(row)?)))
        })
        .collect();
    let share = axes.last().and_then(|axis| axis.share(row)).unwrap_or(0.5);
    let hue = if share < 0.5 { 215 } else { 5 };
    let strength = (200.0 * (share - 0.5).abs()).round();
    let _ = write!(
        out,
        "<polyline points=\"{}\" fill=\"none\" stroke=\"hsl({hue} {strength}% 50%)\" stroke-opacity=\"0.55\"><title>case {}</title></polyline>",
        points.join(" "),
        row.number
    );
}

fn draw(out: &mut String, axis: &Axis, x: f64) {
    let (top, bottom) = (height(1.0), height(0.0));
    let _ = write!(
        out,
        "<line x1=\"{x}\" y1=\"{top}\" x2=\"{x}\" y2=\"{bottom}\" stroke=\"currentColor\"/><text x=\"{x}\" y=\"13\" text-anchor=\"middle\">{}</text>",
        escape(short(&axis.title))
    );
    let mut mark = |y: f64, text: &str| {
        let _ = write!(
            out,
            "<text x=\"{}\" y=\"{:.1}\" text-anchor=\"start\">{}</text>",
            x + 5.0,
            y + 4.0,
            escape(text)
        );
    };
    if axis.words.is_empty() {
        mark(top, &number(axis.high, 3));
        mark(bottom, &number(axis.low, 3));
        return;
    }
    for (k, word) in axis.words.iter().enumerate() {
        mark(height(k as f64 / (axis.words.len() - 1) as f64), word);
    }
}

/// The end of a long name: it is more informative than the beginning.
fn short(title: &str) -> &str {
    const MOST: usize = 22;
    let from = title.char_indices().rev().nth(MOST - 1).map_or(0, |(k, _)| k);
    &title[from..]
}
