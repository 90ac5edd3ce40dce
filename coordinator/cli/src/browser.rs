//! A browser that is found on this machine and draws without a window, for pictures and videos of runs.

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use terraglue_diagnostics::{Error, Result};
use terraglue_recording::at;
use terraglue_scenario::InputError;

/// Names a browser other than those that are searched for.
pub const BROWSER: &str = "TERRAGLUE_CHROMIUM";
/// Programs that draw pages, by name, in this order.
const BROWSERS: [&str; 5] =
    ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome"];

/// The first of these programs that is on the path.
pub fn on_path(names: &[&str]) -> Option<PathBuf> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let folders: Vec<PathBuf> = std::env::split_paths(&path).collect();
    let mut places = names.iter().flat_map(|name| folders.iter().map(move |folder| folder.join(name)));
    places.find(|place| place.is_file())
}

/// The browser that is named, else the first that is found; `what` it is wanted for.
pub fn browser(what: &str) -> Result<PathBuf> {
    if let Some(named) = std::env::var_os(BROWSER).filter(|name| !name.is_empty()) {
        return Ok(named.into());
    }
    on_path(&BROWSERS).ok_or_else(|| {
        let help = format!(
            "install one, e.g. `apt-get install chromium`, or name its program in {BROWSER}; or open the report of the run"
        );
        InputError::plain(format!("no browser is found on this machine that could {what}"), Some(help)).into()
    })
}

/// Error about a browser that failed at `what`, and the way out.
pub fn failed(browser: &Path, what: &str) -> Error {
    let message = format!("`{}` {what}", browser.display());
    InputError::plain(message, Some(format!("name another browser in {BROWSER}"))).into()
}

/// A folder for the page and for what the browser keeps; gone when it is dropped.
pub struct Room(PathBuf);

impl Room {
    /// A new one.
    ///
    /// # Errors
    /// The folder for temporary files cannot be written.
    pub fn new() -> Result<Self> {
        let path = std::env::temp_dir().join(format!("terraglue-page-{}", std::process::id()));
        std::fs::create_dir_all(&path).map_err(at(&path))?;
        Ok(Self(path))
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.0
    }
}

impl Drop for Room {
    fn drop(&mut self) {
        // what stays behind is in the folder of the system for such files
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// The browser without a window of this size, in pixels; it is not started yet.
pub fn without_window(browser: &Path, room: &Room, (width, height): (u32, u32)) -> Command {
    let mut command = Command::new(browser);
    command.args(["--headless", "--hide-scrollbars", "--force-device-scale-factor=1", "--no-first-run"]);
    // without a graphics card; with one it is as fast as it need be
    command.args(["--use-angle=swiftshader", "--enable-unsafe-swiftshader"]);
    // a browser refuses its sandbox to the administrator
    if rustix::process::geteuid().is_root() {
        command.arg("--no-sandbox");
    }
    let mut profile = std::ffi::OsString::from("--user-data-dir=");
    profile.push(room.path().join("profile"));
    command.arg(profile).arg(format!("--window-size={width},{height}"));
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    command
}

/// A process that ends with this.
pub struct Running(pub Child);

impl Drop for Running {
    fn drop(&mut self) {
        // it may have ended by itself
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}
