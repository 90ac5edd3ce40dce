//! Holds a run back to real time, or a multiple of it, and measures how fast it goes.

use std::time::{Duration, Instant};

/// Time over which the real-time factor is taken.
const WINDOW: Duration = Duration::from_secs(1);

/// The pace of a run.
pub struct Clock {
    factor: Option<f64>,
    /// When the pace began, and the simulated time then, s.
    since: (Instant, f64),
    /// The same for the factor that is shown.
    measured: (Instant, f64),
    rtf: f64,
}

impl Clock {
    /// From simulated time `t_s` on.
    pub fn new(factor: Option<f64>, t_s: f64) -> Self {
        let now = (Instant::now(), t_s);
        Self { factor, since: now, measured: now, rtf: f64::NAN }
    }

    /// Times real time; none: as fast as it goes.
    pub fn factor(&self) -> Option<f64> {
        self.factor
    }

    /// Another pace, or from another time on.
    pub fn set(&mut self, factor: Option<f64>, t_s: f64) {
        *self = Self { rtf: self.rtf, ..Self::new(factor, t_s) };
    }

    /// How long to wait until time `t_s` is due; what cannot keep pace is not made up for later.
    pub fn wait(&mut self, t_s: f64) -> Option<Duration> {
        let factor = self.factor?;
        let due = Duration::try_from_secs_f64((t_s - self.since.1) / factor).unwrap_or_default();
        let gone = self.since.0.elapsed();
        if gone > due + Duration::from_millis(200) {
            self.since = (Instant::now(), t_s);
        }
        due.checked_sub(gone).filter(|left| !left.is_zero())
    }

    /// Simulated over wall time in the last second; NaN before it is known.
    pub fn rtf(&mut self, t_s: f64) -> f64 {
        let gone = self.measured.0.elapsed();
        if gone >= WINDOW {
            self.rtf = (t_s - self.measured.1) / gone.as_secs_f64();
            self.measured = (Instant::now(), t_s);
        }
        self.rtf
    }
}
