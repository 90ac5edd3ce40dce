//! Another recording beside the run that is shown: its robot as a ghost in the view, its variables in the oscilloscope.

use crate::hub::Hub;
use crate::protocol;
use serde_json::{Value, json};
use std::path::Path;
use std::sync::Arc;
use terraglue_diagnostics::Result;

/// A recording that is looked at only.
#[derive(Clone)]
pub struct Beside {
    /// Where its messages are read.
    pub(crate) hub: Arc<Hub>,
    /// Name of its folder.
    pub name: String,
    /// First and last time, s.
    times: [f64; 2],
}

impl Beside {
    /// Of a results folder.
    ///
    /// # Errors
    /// There is no recording, or it cannot be read.
    pub fn open(folder: &Path) -> Result<Self> {
        let (hub, _) = Hub::new(false);
        hub.open(folder, false)?;
        let opened =
            hub.with_file(|file| Ok((file.topics().cloned().collect::<Vec<_>>(), file.times_ns())))?;
        let (topics, times) = opened.unwrap_or_default();
        topics.into_iter().for_each(|topic| hub.announce(topic));
        let times = times.unwrap_or_default().map(|ns| ns as f64 / 1e9);
        let whole = std::path::absolute(folder).unwrap_or_else(|_| folder.to_owned());
        let name = whole.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
        Ok(Self { hub, name, times })
    }

    /// Name, times and channels, with which the page reads its messages.
    pub(crate) fn about(&self) -> Value {
        let channels = protocol::advertise(&self.hub.topics())["channels"].take();
        json!({ "name": self.name, "from_s": self.times[0], "to_s": self.times[1], "channels": channels })
    }
}
