//! Arguments of `terraglue shot`.

use clap::Args;
use std::path::PathBuf;

/// Arguments of `shot`.
#[derive(Args, Debug, Clone)]
pub struct ShotArguments {
    /// Folder of the run, e.g. runs/moon_walk.
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
    /// Simulated time, s [default: the end].
    #[arg(long, value_name = "S")]
    pub time: Option<f64>,
    /// From where: follow, side, top, front; or follow,YAW,PITCH,DISTANCE in rad and m [default: as `[page]` says, else follow].
    #[arg(long)]
    pub camera: Option<String>,
    /// Colours of the ground: sinkage, height, slope, plain [default: as `[page]` says, else sinkage].
    #[arg(long, value_parser = ["sinkage", "height", "slope", "plain"])]
    pub ground: Option<String>,
    /// Width and height in pixels.
    #[arg(long, value_name = "WxH", default_value = "1400x900", value_parser = size)]
    pub size: (u32, u32),
    /// File to write (PNG).
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
}

/// Part of the address of a page with camera and ground, where they are given.
pub fn sight(camera: Option<&str>, ground: Option<&str>) -> String {
    let said = [("camera", camera), ("ground", ground)];
    said.into_iter().filter_map(|(key, value)| Some(format!("&{key}={}", value?))).collect()
}

/// Width and height.
///
/// # Errors
/// The text is no size.
pub fn size(text: &str) -> std::result::Result<(u32, u32), String> {
    let parsed = text.split_once('x').and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
    parsed.filter(|(w, h)| *w >= 16 && *h >= 16).ok_or_else(|| "give it as 1400x900".into())
}
