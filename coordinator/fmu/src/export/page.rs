//! Files of an FMU for people: a page, a licence, an icon.

use std::fmt::Write;
use terraglue_fmi::export::{About, Opened};
use terraglue_subsystem::Causality;

/// Licence of the library in an FMU.
pub const LICENSE: &str = include_str!("../../../../LICENSE-MIT");

/// A page that lists the variables.
pub fn page(opened: &Opened, about: &About) -> String {
    let mut rows = String::new();
    for entry in &opened.layout.entries {
        let v = &opened.subsystem.variables()[entry.variable];
        let dims: String =
            v.dims.iter().filter(|_| entry.element.is_none()).map(|d| format!("[{d}]")).collect();
        let role = match v.causality {
            Causality::Parameter => "parameter",
            Causality::Input => "input",
            Causality::Output => "output",
            Causality::Local => "local",
        };
        let cells =
            [escaped(&entry.name), format!("{:?}{dims}", v.value_type), escaped(&v.unit), role.into()];
        let cells: String = cells.iter().map(|c| format!("<td>{c}</td>")).collect();
        // writing to a String does not fail
        let _ = writeln!(rows, "<tr>{cells}<td>{}</td></tr>", escaped(&v.help));
    }
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{name}</title><style>\n\
         body {{ font-family: sans-serif; max-width: 70em; margin: 2em auto; }} td {{ padding: 0 1em 0 0; }}\n\
         </style></head><body>\n<h1>{name}</h1>\n<p>{what}. Made by {tool}.</p>\n\
         <p>SI units; the world has z up. A pose that is set before a step is where the foot is at its end, and the \
         foot goes there on a straight line; a pose set during the initialisation is where it is at the start. Outputs \
         are those of the last step. A step may have any length: the FMU divides it into steps of {step} s or \
         less.</p>\n<table>\n<tr><th>name<th>type<th>unit<th>role<th>what</tr>\n{rows}</table>\n</body></html>\n",
        name = escaped(&about.name),
        what = escaped(&about.description),
        tool = escaped(&about.tool),
        step = about.step_s,
    )
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// Side of the icon, pixels.
const SIDE: u32 = 64;

/// A ball in soft ground, as PNG.
pub fn icon() -> Result<Vec<u8>, png::EncodingError> {
    let colour = |x: f64, y: f64| -> [u8; 3] {
        let (dx, dy) = (x - 32.0, y - 28.0);
        let distance = (dx * dx + dy * dy).sqrt();
        let ground = if dx.abs() < 24.0 { 38.0 + 6.0 * (1.0 - (dx / 24.0).powi(2)) } else { 38.0 };
        match (distance < 16.0, y > ground) {
            (true, _) => [70, 90, 120],
            (_, true) => [176, 142, 98],
            _ => [244, 246, 248],
        }
    };
    let pixels = (0..SIDE * SIDE).flat_map(|k| colour(f64::from(k % SIDE) + 0.5, f64::from(k / SIDE) + 0.5));
    let rgb: Vec<u8> = pixels.collect();
    let mut out = Vec::new();
    let mut encoder = png::Encoder::new(&mut out, SIDE, SIDE);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.write_header()?.write_image_data(&rgb)?;
    Ok(out)
}
