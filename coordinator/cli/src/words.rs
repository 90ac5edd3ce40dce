//! Values of options that clap does not read by itself.

use terraglue_conformance::Level;

/// The levels as words of the command line.
pub fn level(word: &str) -> std::result::Result<Level, String> {
    Level::ALL.into_iter().find(|l| l.word() == word).ok_or_else(|| "quick, standard or thorough".into())
}

/// A time limit of the command line, s.
pub fn seconds(word: &str) -> std::result::Result<f64, String> {
    let above_zero = word.parse::<f64>().ok().filter(|s| s.is_finite() && *s > 0.0);
    above_zero.ok_or_else(|| "a number of seconds above 0".into())
}
