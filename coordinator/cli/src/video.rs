//! `terraglue video`: a run as a video, picture by picture in simulated time. A browser that is found on this machine draws the replay
//! of the report and encodes it; or it hands the pictures to ffmpeg, where that is installed.

use super::Exit;
use super::browser::{Room, Running, browser, failed, on_path, without_window};
use super::interrupt::Interrupt;
use super::output::outln;
use super::progress::bar;
use super::shot_arguments::sight;
use super::video_arguments::VideoArguments;
use super::webm::{Video, WebmFile};
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};
use terraglue_diagnostics::{Error, Result};
use terraglue_recording::{Recording, at, report};
use terraglue_scenario::InputError;
use terraglue_serve::{PageHost, Posted};

/// A browser that gives no picture for so long hangs.
const LONGEST: Duration = Duration::from_secs(180);
/// How often the browser and Ctrl-C are looked at.
const LOOK_EVERY: Duration = Duration::from_millis(100);
/// Script that the document loads beside the report.
const SCRIPT: &str = "<script type=\"module\" src=\"video.js\"></script>\n</body>";

/// Makes the video.
pub fn video(arguments: &VideoArguments) -> Result<Exit> {
    let interrupt = Interrupt::listen();
    let browser = browser("draw the pictures")?;
    let makes = Encoders::of(arguments)?;
    let recording = Recording::open(&arguments.folder)?;
    let times = times(arguments, &recording)?;
    let count = ((times[1] - times[0]) / arguments.speed * f64::from(arguments.fps) + 1e-6) as u64 + 1;
    let document = report::render(&recording, None)?.replacen("</body>", SCRIPT, 1);
    drop(recording);
    let room = Room::new()?;
    let (host, posted) = PageHost::start(document)?;
    let (width, height) = arguments.size;
    let encoder = if makes.browser { "own" } else { "none" };
    let sight = sight(arguments.camera.as_deref(), arguments.ground.as_deref());
    let address = format!(
        "{}#t={t}&from={t}{sight}&alone&width={width}&height={height}&fps={}&speed={}&count={count}&encoder={encoder}",
        host.address(),
        arguments.fps,
        arguments.speed,
        t = times[0],
    );
    let mut command = without_window(&browser, &room, arguments.size);
    let mut running = Running(command.arg(address).spawn().map_err(at(&browser))?);
    interrupt.run();
    let film = Film { arguments, makes, count };
    let ended = film.take(&posted, &mut |waited| {
        if interrupt.flag().load(Ordering::Relaxed) {
            return Err(None);
        }
        let ended = running.0.try_wait().map_err(|e| Some(at(&browser)(e)))?;
        match ended {
            Some(_) => Err(Some(failed(&browser, "ended before the video was whole"))),
            None if waited > LONGEST => Err(Some(failed(&browser, "makes no pictures"))),
            None => Ok(()),
        }
    });
    match ended {
        Ok(()) => {
            outln!("video: {} ({count} pictures)", arguments.output.display());
            Ok(Exit::Done)
        }
        Err(why) => {
            // half a video is none
            let _ = std::fs::remove_file(&arguments.output);
            why.map_or(Ok(Exit::Interrupted), Err)
        }
    }
}

/// First and last simulated time, s.
fn times(arguments: &VideoArguments, recording: &Recording) -> Result<[f64; 2]> {
    let end = recording.end_s();
    let (from, to) = (arguments.from, arguments.to.unwrap_or(end).min(end));
    if from.is_finite() && to.is_finite() && 0.0 <= from && from < to {
        return Ok([from, to]);
    }
    let message = format!("there is nothing to see from t = {from} s to t = {to} s");
    let help = format!("the recording goes from 0 to {end} s: choose with --from and --to");
    Err(InputError::plain(message, Some(help)).into())
}

/// Who may encode.
struct Encoders {
    browser: bool,
    ffmpeg: Option<PathBuf>,
}

impl Encoders {
    fn of(arguments: &VideoArguments) -> Result<Self> {
        let is_webm = arguments.output.extension().is_some_and(|own| own.eq_ignore_ascii_case("webm"));
        let browser = is_webm && arguments.encoder != "ffmpeg";
        let ffmpeg = if arguments.encoder == "browser" { None } else { on_path(&["ffmpeg"]) };
        let output = arguments.output.display();
        let refused = |message: String, help: &str| InputError::plain(message, Some(help.into())).into();
        match (browser, &ffmpeg) {
            (false, None) if is_webm => Err(refused(
                "ffmpeg is not found on this machine".into(),
                "install it, e.g. `apt-get install ffmpeg`; or let the browser encode: --encoder browser",
            )),
            (false, None) => Err(refused(
                format!("{output}: a browser encodes WebM only, and ffmpeg is not used or not found"),
                "end the name of the file in .webm, or install ffmpeg, e.g. `apt-get install ffmpeg`",
            )),
            _ => Ok(Self { browser, ffmpeg }),
        }
    }
}

/// Why there is no video: an error, or none where the user stopped it.
type Stopped = Option<Error>;

struct Film<'a> {
    arguments: &'a VideoArguments,
    makes: Encoders,
    count: u64,
}

impl Film<'_> {
    /// Takes what the page posts until it is whole. `goes_on` is asked now and then, with the time since the last picture.
    fn take(
        &self,
        posted: &Receiver<Posted>,
        goes_on: &mut dyn FnMut(Duration) -> std::result::Result<(), Stopped>,
    ) -> std::result::Result<(), Stopped> {
        let bar = bar(self.count, self.arguments.quiet);
        let mut writer = None;
        let mut last = Instant::now();
        loop {
            match posted.recv_timeout(LOOK_EVERY) {
                Ok(post) => {
                    last = Instant::now();
                    match (post.kind.as_str(), &mut writer) {
                        ("begin", none) => *none = Some(self.writer(&post).map_err(Some)?),
                        ("picture" | "raw", Some(writer)) => {
                            writer.picture(&post).map_err(Some)?;
                            bar.inc(1);
                        }
                        ("end", Some(_)) => break,
                        ("failed", _) => return Err(Some(refused(&String::from_utf8_lossy(&post.body)))),
                        (kind, _) => log::debug!("the page posted `{kind}`"),
                    }
                }
                Err(RecvTimeoutError::Timeout) => goes_on(last.elapsed())?,
                Err(RecvTimeoutError::Disconnected) => return Err(Some(refused("the page is gone"))),
            }
        }
        bar.finish_and_clear();
        writer.map_or(Ok(()), Writer::end).map_err(Some)
    }

    fn writer(&self, begin: &Posted) -> Result<Writer> {
        let said: serde_json::Value = serde_json::from_slice(&begin.body).unwrap_or_default();
        let (size, fps, output) = (self.arguments.size, self.arguments.fps, &self.arguments.output);
        match (said["codec"].as_str(), &self.makes.ffmpeg) {
            (Some(codec), _) => {
                let file = File::create(output).map_err(at(output))?;
                let video = Video { codec, size, fps, count: self.count };
                Ok(Writer::Webm(WebmFile::begin(file, output, &video)?))
            }
            (None, Some(ffmpeg)) => encoding(ffmpeg, size, fps, output),
            (None, None) => {
                let help = "install ffmpeg, e.g. `apt-get install ffmpeg`, or name another browser in TERRAGLUE_CHROMIUM";
                let message = "this browser encodes no video, and ffmpeg is not found on this machine";
                Err(InputError::plain(message, Some(help.into())).into())
            }
        }
    }
}

fn refused(reason: &str) -> Error {
    let help = "open the report of the run: it says what its view cannot show";
    InputError::plain(format!("no video: {reason}"), Some(help.into())).into()
}

/// Where the pictures go.
enum Writer {
    Webm(WebmFile<File>),
    Ffmpeg(Running, PathBuf),
}

/// An ffmpeg that waits for pictures.
fn encoding(ffmpeg: &Path, (width, height): (u32, u32), fps: u32, output: &Path) -> Result<Writer> {
    let mut command = Command::new(ffmpeg);
    command.args(["-y", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgba"]);
    command.args(["-s", &format!("{width}x{height}"), "-r", &fps.to_string(), "-i", "-"]);
    command.args(["-pix_fmt", "yuv420p"]).arg(std::path::absolute(output).map_err(at(output))?);
    command.stdin(Stdio::piped()).stdout(Stdio::null());
    Ok(Writer::Ffmpeg(Running(command.spawn().map_err(at(ffmpeg))?), output.to_owned()))
}

impl Writer {
    fn picture(&mut self, post: &Posted) -> Result {
        match self {
            Self::Webm(file) => file.picture(post.time_us, post.is_whole, &post.body),
            Self::Ffmpeg(running, path) => match &mut running.0.stdin {
                Some(pipe) => pipe.write_all(&post.body).map_err(at(path)),
                None => Ok(()),
            },
        }
    }

    fn end(self) -> Result {
        match self {
            Self::Webm(file) => file.end().map(drop),
            Self::Ffmpeg(mut running, path) => {
                drop(running.0.stdin.take());
                let status = running.0.wait().map_err(at(&path))?;
                if status.success() {
                    return Ok(());
                }
                let message = format!("ffmpeg could not write {}: {status}", path.display());
                Err(InputError::plain(message, Some("what it said stands above".into())).into())
            }
        }
    }
}
