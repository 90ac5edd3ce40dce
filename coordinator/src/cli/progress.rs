//! The progress bar: simulated time and real-time factor, when standard error is a terminal.

use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::time::Instant;
use terraglue::Result;
use terraglue::observer::{Happening, Observer, View};

/// A bar over `simulated_s` seconds of `steps` steps; hidden where nobody looks.
pub fn bar(steps: u64, quiet: bool) -> ProgressBar {
    if quiet || !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template("{bar:32} {percent:>3} %  {msg}  {eta} left");
    ProgressBar::new(steps).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}

/// Moves a bar along with a run.
pub struct Progress {
    bar: ProgressBar,
    /// When the first step was done, and its time, s.
    since: Option<(Instant, f64)>,
    duration_s: f64,
    label: String,
}

impl Progress {
    /// Follows a run of `duration_s` seconds; `label` stands before the time.
    pub fn new(bar: ProgressBar, duration_s: f64, label: &str) -> Self {
        Self { bar, since: None, duration_s, label: label.into() }
    }
}

impl Observer for Progress {
    fn stepped(&mut self, view: &View) -> Result {
        self.bar.inc(1);
        let (start, from_s) = *self.since.get_or_insert_with(|| (Instant::now(), view.t_s));
        // Text only now and then: the bar itself draws at a bounded rate.
        if view.step_index.is_multiple_of(50) && !self.bar.is_hidden() {
            let factor = (view.t_s - from_s) / start.elapsed().as_secs_f64().max(1e-9);
            let text = format!(
                "{}t = {:.2} of {} s, {factor:.1} × real time",
                self.label, view.t_s, self.duration_s
            );
            self.bar.set_message(text);
        }
        Ok(())
    }

    fn happened(&mut self, happening: &Happening) -> Result {
        self.bar.println(format!("{}t = {:.3} s: {}", self.label, happening.t_s, happening.what));
        Ok(())
    }
}
