//! `terraglue shot`: a picture of a run at a time, taken by a browser that is found on this machine. It opens the report, which
//! needs no server; the address gives time, camera and ground.

use super::Exit;
use super::browser::{Room, Running, browser, failed, without_window};
use super::output::outln;
use super::shot_arguments::{ShotArguments, sight};
use std::ffi::OsString;
use std::path::Path;
use std::time::{Duration, Instant};
use terraglue_diagnostics::Result;
use terraglue_recording::{Recording, at, report};

/// A browser that takes longer hangs.
const LONGEST: Duration = Duration::from_secs(120);
/// Time that passes in the page before the picture is taken, ms: it does not pass while the page is busy.
const PAGE_TIME_MS: u32 = 5000;

/// Takes the picture.
pub fn shot(arguments: &ShotArguments) -> Result<Exit> {
    let browser = browser("take the picture")?;
    let recording = Recording::open(&arguments.folder)?;
    let room = Room::new()?;
    let page = room.path().join("report.html");
    std::fs::write(&page, report::render(&recording, None)?).map_err(at(&page))?;
    let time = arguments.time.unwrap_or_else(|| recording.end_s());
    let output = std::path::absolute(&arguments.output).map_err(at(&arguments.output))?;
    let _ = std::fs::remove_file(&output);
    let sight = sight(arguments.camera.as_deref(), arguments.ground.as_deref());
    let address = format!("file://{}#t={time}{sight}&alone", page.display());
    take(&browser, &room, arguments.size, &output, &address)?;
    outln!("shot: {}", output.display());
    Ok(Exit::Done)
}

fn take(browser: &Path, room: &Room, size: (u32, u32), output: &Path, address: &str) -> Result {
    let mut screenshot = OsString::from("--screenshot=");
    screenshot.push(output);
    let mut command = without_window(browser, room, size);
    command.arg(format!("--virtual-time-budget={PAGE_TIME_MS}")).arg(screenshot).arg(address);
    let mut running = Running(command.spawn().map_err(at(browser))?);
    let begin = Instant::now();
    while running.0.try_wait().map_err(at(browser))?.is_none() && begin.elapsed() < LONGEST {
        std::thread::sleep(Duration::from_millis(20));
    }
    if output.is_file() { Ok(()) } else { Err(failed(browser, "took no picture")) }
}
