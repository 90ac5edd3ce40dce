//! Which variables `[recording]` wants, and with how many digits.

use crate::snapshot::Snapshot;
use terraglue_diagnostics::error::Result;
use terraglue_engine::signals::pattern;
use terraglue_scenario::{Connection, RecordingSpec, Source, did_you_mean};

/// Whether a pattern names a variable, or a group in which it stands: `robot.*_j2` names `robot.LF_j2.angle`.
fn names(pattern: &str, variable: &str) -> bool {
    let ends = variable.match_indices(['.', '[']).map(|(k, _)| k).chain([variable.len()]);
    ends.into_iter().any(|end| pattern::matches(pattern, &variable[..end]))
}

/// Marks the columns that are recorded.
///
/// # Errors
/// A pattern that names no variable.
pub(crate) fn select(snapshot: &mut Snapshot, spec: &RecordingSpec, source: &Source) -> Result {
    let of = |s: &str, column: &str| format!("{s}.{column}");
    for (key, patterns) in [("include", &spec.include), ("exclude", &spec.exclude)] {
        for wrong in patterns {
            let all: Vec<String> = snapshot
                .subsystems
                .iter()
                .flat_map(|s| s.columns.iter().map(|c| of(&s.name, &c.name)))
                .collect();
            if !all.iter().any(|name| names(wrong, name)) {
                let message = format!("`{key}` names no variable: `{wrong}`");
                let help = did_you_mean(wrong, all.iter().map(String::as_str));
                return Err(source.error_at_value(&["recording", key], message, help).into());
            }
        }
    }
    for s in &mut snapshot.subsystems {
        let subsystem = &s.name;
        for column in &mut s.columns {
            let any = |patterns: &[String]| patterns.iter().any(|p| names(p, &of(subsystem, &column.name)));
            column.recorded = (spec.include.is_empty() || any(&spec.include)) && !any(&spec.exclude);
        }
    }
    Ok(())
}

/// Marks the inputs that no connection feeds: they keep their value, as parameters do, until an event or a fault changes it.
pub(crate) fn hold(snapshot: &mut Snapshot, connections: &[Connection]) {
    for s in &mut snapshot.subsystems {
        for column in s.columns.iter_mut().filter(|c| c.input) {
            let name = format!("{}.{}", s.name, column.name);
            let base = name.split('[').next().unwrap_or(&name);
            let fed = |to: &str| [name.as_str(), base].iter().any(|n| pattern::matches(to, n));
            column.held = !connections.iter().any(|c| fed(&c.to));
        }
    }
}

/// Numbers rounded to so many significant digits, in the binary places that hold them: what is left away is zero and
/// takes no room when compressed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Precision {
    /// Half of the last place that is kept, in places of all bits.
    half: u64,
    /// The bits that are kept.
    kept: u64,
}

/// Bits of the exponent: all are set in what is not finite.
const EXPONENT: u64 = 0x7ff << 52;

impl Precision {
    /// That holds this many decimal digits; from 16 on it holds all bits.
    pub fn digits(digits: u64) -> Self {
        // 2^(places + 1) ≥ 10^digits.
        let places = libm::ceil(digits as f64 * std::f64::consts::LOG2_10) as u32;
        let cleared = 53_u32.saturating_sub(places);
        Self { half: (1 << cleared) >> 1, kept: u64::MAX << cleared }
    }

    /// The nearest number that is held.
    pub fn of(self, value: f64) -> f64 {
        let bits = value.to_bits();
        // A carry out of the fraction counts the exponent up, as it should.
        let rounded = bits.wrapping_add(self.half) & self.kept;
        let infinite = bits & EXPONENT == EXPONENT || rounded & EXPONENT == EXPONENT;
        if infinite { value } else { f64::from_bits(rounded) }
    }
}

#[cfg(test)]
#[path = "../tests/unit/selection.rs"]
mod tests;
