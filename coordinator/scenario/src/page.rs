//! `[page]`: how the page of a run looks at first.

use super::keys::{CAMERAS, LAYERS};
use super::model::PageSpec;
use super::section::Section;
use super::subsystems::{check_reference, texts};
use terraglue_diagnostics::{InputError, did_you_mean};

/// Reads the table; `names` are those of the subsystems.
pub fn read(s: &Section, names: &[&str]) -> Result<PageSpec, Box<InputError>> {
    let page = PageSpec {
        camera: s.optional_text("camera"),
        ground: s.optional_text("ground"),
        layers: s.entry("layers").map(texts),
        plots: s.entry("plots").map(texts).unwrap_or_default(),
        select: s.optional_text("select"),
    };
    if let Some(camera) = &page.camera {
        check_camera(camera).map_err(|(message, help)| s.error("camera", message, help))?;
    }
    if let Some(layer) = page.layers.iter().flatten().find(|layer| !LAYERS.contains(&layer.as_str())) {
        let help = did_you_mean(layer, LAYERS.iter().copied());
        let help = help.or_else(|| Some(format!("the layers are {}", LAYERS.join(", "))));
        return Err(s.error("layers", format!("there is no layer `{layer}`"), help));
    }
    for name in page.plots.iter().flat_map(|plot| PageSpec::variables(plot)) {
        check_reference(name, names).map_err(|c| s.error("plots", c.message, c.help))?;
    }
    if let Some(part) = &page.select {
        check_reference(part, names).map_err(|c| s.error("select", c.message, c.help))?;
    }
    Ok(page)
}

/// A name, alone or with three numbers.
fn check_camera(text: &str) -> Result<(), (String, Option<String>)> {
    let (name, numbers) = text.split_once(',').unwrap_or((text, ""));
    if !CAMERAS.contains(&name) {
        let help = did_you_mean(name, CAMERAS.iter().copied());
        let help = help.or_else(|| Some(format!("the cameras are {}", CAMERAS.join(", "))));
        return Err((format!("there is no camera `{name}`"), help));
    }
    let read: Vec<Option<f64>> =
        numbers.split(',').map(|x| x.trim().parse().ok().filter(|x: &f64| x.is_finite())).collect();
    match read[..] {
        _ if numbers.is_empty() => Ok(()),
        [Some(_), Some(_), Some(away)] if away > 0.0 => Ok(()),
        _ => {
            let help =
                "after the name stand turn and height in rad and the distance in m: `side,-1.57,0.12,3`";
            Err((format!("`{text}` is no camera"), Some(help.into())))
        }
    }
}
