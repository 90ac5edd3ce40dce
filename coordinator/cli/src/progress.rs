//! The progress bar: simulated time and real-time factor, when standard error is a terminal.

use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use terraglue_diagnostics::Result;
use terraglue_engine::observer::{Event, Observer, View};

/// A bar over `simulated_s` seconds of `steps` steps; hidden where nobody looks.
pub fn bar(steps: u64, quiet: bool) -> ProgressBar {
    if quiet || !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template("{bar:32} {percent:>3} %  {msg}  {eta} left");
    ProgressBar::new(steps).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}

/// Delay of the first message about work that takes time, its period without a terminal, and its period on one.
const FIRST_LINE: Duration = Duration::from_secs(2);
/// See [`FIRST_LINE`].
const SAY_EVERY: Duration = Duration::from_secs(60);
/// See [`FIRST_LINE`].
const DRAW_EVERY: Duration = Duration::from_millis(200);

/// While this lives, work that takes longer than two seconds is reported: on a terminal in the bar, else in lines.
pub struct Waiting {
    done: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Waiting {
    /// Shows the text of `what` while it lasts.
    pub fn new(quiet: bool, bar: ProgressBar, what: impl Fn() -> String + Send + 'static) -> Self {
        let done = Arc::new(AtomicBool::new(quiet));
        let ended = Arc::clone(&done);
        let wait = move || {
            let start = Instant::now();
            let mut next = FIRST_LINE;
            while !ended.load(Ordering::Relaxed) {
                let waited = start.elapsed();
                if waited < next {
                    std::thread::park_timeout(next - waited);
                    continue;
                }
                let text = format!("{} ({} s so far)", what(), waited.as_secs());
                if bar.is_hidden() {
                    eprintln!("note: {text}");
                    next = waited + SAY_EVERY;
                } else {
                    bar.set_message(text);
                    bar.tick();
                    next = waited + DRAW_EVERY;
                }
            }
        };
        let spawn = || std::thread::Builder::new().name("progress".into()).spawn(wait).ok();
        Self { done, thread: if quiet { None } else { spawn() } }
    }

    /// While inputs and modules are loaded.
    pub fn loading(quiet: bool) -> Self {
        let bar = match quiet || !std::io::stderr().is_terminal() {
            true => ProgressBar::hidden(),
            false => ProgressBar::new_spinner(),
        };
        Self::new(quiet, bar, || "loading robots, soils and modules".into())
    }

    /// From the end of loading to that of the first step; `standing`: see [`terraglue_engine::testbed::Options`]; `label`
    /// precedes the text.
    pub fn standing(quiet: bool, bar: &ProgressBar, standing: Arc<AtomicU64>, label: &str) -> Self {
        let label = label.to_owned();
        Self::new(quiet, bar.clone(), move || match f64::from_bits(standing.load(Ordering::Relaxed)) {
            0.0 => format!("{label}the first step"),
            t => format!("{label}before the start the robot comes to rest on the ground: t = {t:.3} s"),
        })
    }
}

impl Drop for Waiting {
    fn drop(&mut self) {
        self.done.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            thread.thread().unpark();
            // it ends by itself; a panic of it is none of the run's
            drop(thread.join());
        }
    }
}

/// Moves a bar along with a run.
pub struct Progress {
    /// Reports the work up to the end of the first step.
    waiting: Option<Waiting>,
    bar: ProgressBar,
    /// When the first step was done, and its time, s.
    since: Option<(Instant, f64)>,
    duration_s: f64,
    label: String,
}

impl Progress {
    /// Follows a run of `duration_s` seconds; `label` precedes the time.
    pub fn new(bar: ProgressBar, duration_s: f64, label: &str) -> Self {
        Self { waiting: None, bar, since: None, duration_s, label: label.into() }
    }

    /// The same; `waiting` ends with the first step.
    pub fn after(self, waiting: Waiting) -> Self {
        Self { waiting: Some(waiting), ..self }
    }
}

impl Observer for Progress {
    fn stepped(&mut self, view: &View) -> Result {
        drop(self.waiting.take());
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

    fn event(&mut self, event: &Event) -> Result {
        self.bar.println(format!("{}t = {:.3} s: {}", self.label, event.t_s, event.what));
        Ok(())
    }
}
