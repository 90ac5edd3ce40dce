//! Arguments of `terraglue video`.

use crate::shot_arguments::size;
use clap::Args;
use std::path::PathBuf;

/// Arguments of `video`.
#[derive(Args, Debug, Clone)]
pub struct VideoArguments {
    /// Folder of the run, e.g. runs/moon_walk.
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
    /// Simulated time of the first picture, s.
    #[arg(long, value_name = "S", default_value_t = 0.0)]
    pub from: f64,
    /// Simulated time of the last picture, s [default: the end].
    #[arg(long, value_name = "S")]
    pub to: Option<f64>,
    /// Pictures per second of the video.
    #[arg(long, value_name = "N", default_value_t = 25, value_parser = clap::value_parser!(u32).range(1..=120))]
    pub fps: u32,
    /// Simulated seconds per second of the video, 0.001 to 1000.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, value_parser = speed)]
    pub speed: f64,
    /// From where: follow, side, top, front; or follow,YAW,PITCH,DISTANCE in rad and m [default: as `[page]` says, else follow].
    #[arg(long)]
    pub camera: Option<String>,
    /// Colours of the ground: sinkage, height, slope, plain [default: as `[page]` says, else sinkage].
    #[arg(long, value_parser = ["sinkage", "height", "slope", "plain"])]
    pub ground: Option<String>,
    /// Width and height in pixels, even numbers.
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = even_size)]
    pub size: (u32, u32),
    /// Who encodes: the browser (WebM), ffmpeg (any format that it knows by the name of the file); or what is there.
    #[arg(long, value_name = "WHO", default_value = "any", value_parser = ["any", "browser", "ffmpeg"])]
    pub encoder: String,
    /// No progress bar.
    #[arg(short, long)]
    pub quiet: bool,
    /// File to write: .webm, or with ffmpeg e.g. .mp4.
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
}

fn speed(text: &str) -> Result<f64, String> {
    let factor = text.parse::<f64>().ok().filter(|x| (1e-3..=1e3).contains(x));
    factor.ok_or_else(|| "a factor from 0.001 to 1000 is wanted".into())
}

fn even_size(text: &str) -> Result<(u32, u32), String> {
    let even = size(text)?;
    let fits = even.0 % 2 == 0 && even.1 % 2 == 0 && even.0.max(even.1) <= 8192;
    fits.then_some(even).ok_or_else(|| "encoders want even numbers up to 8192, e.g. 1280x720".into())
}
