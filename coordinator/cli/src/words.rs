//! Values of options that clap does not read by itself.

use chrono::DateTime;
use terraglue_conformance::Level;

/// `generationDateAndTime` (FMI 3.0.2, 2.4.1).
pub const DATE: &str = "%Y-%m-%dT%H:%M:%SZ";

/// The levels as words of the command line.
pub fn level(word: &str) -> std::result::Result<Level, String> {
    Level::ALL.into_iter().find(|l| l.word() == word).ok_or_else(|| "quick, standard or thorough".into())
}

/// A time limit of the command line, s.
pub fn seconds(word: &str) -> std::result::Result<f64, String> {
    let above_zero = word.parse::<f64>().ok().filter(|s| s.is_finite() && *s > 0.0);
    above_zero.ok_or_else(|| "a number of seconds above 0".into())
}

/// A date and a time of any time zone, in the form of FMI.
pub fn parse_time(text: &str) -> Result<String, String> {
    let time = DateTime::parse_from_rfc3339(text);
    let time = time.map_err(|e| format!("{e}; a date and a time are wanted, as 2026-11-27T12:00:00Z"))?;
    Ok(time.to_utc().format(DATE).to_string())
}
