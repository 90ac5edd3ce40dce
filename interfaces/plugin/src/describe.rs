//! The words with which a module describes itself in the section of its library, and how the text is put together.

use terraglue_subsystem::{Capabilities, LawModule, Variable};

/// Names of the capabilities of an instance.
pub const WORDS: [(Capabilities, &str); 13] = [
    (Capabilities::FORCE, "force"),
    (Capabilities::MOTION, "motion"),
    (Capabilities::ESTIMATE, "estimate"),
    (Capabilities::SOLVE, "solve"),
    (Capabilities::DERIVATIVES, "derivatives"),
    (Capabilities::RETRY, "retry"),
    (Capabilities::STATE, "state"),
    (Capabilities::SERIALIZE, "serialize"),
    (Capabilities::SUBCYCLES, "subcycles"),
    (Capabilities::FEEDTHROUGH, "feedthrough"),
    (Capabilities::FIXED_STEP, "fixed-step"),
    (Capabilities::SEES, "sees"),
    (Capabilities::HIDES, "hides"),
];

/// The words of a set of capabilities.
pub fn words(capabilities: Capabilities) -> Vec<&'static str> {
    WORDS.iter().filter(|(c, _)| capabilities.has(*c)).map(|(_, word)| *word).collect()
}

/// The words of a law: its functions.
pub const fn law_words<L: LawModule>() -> &'static str {
    match (L::PRESSURE, L::SHEAR) {
        (true, true) => "pressure shear",
        (true, false) => "pressure",
        (false, _) => "shear",
    }
}

/// A variable as the section has it: name, role, type with its dimensions, unit.
pub fn variable_line(v: &Variable) -> String {
    let role = format!("{:?}", v.causality).to_lowercase();
    let dims: String = v.dims.iter().map(|d| format!("[{d}]")).collect();
    let what = format!("{:?}{dims}", v.value_type).to_lowercase();
    format!("{} {role} {what} {}", v.name, v.unit).trim_end().to_owned()
}

/// Bytes of all parts.
pub const fn length(parts: &[&str]) -> usize {
    let (mut sum, mut k) = (0, 0);
    while k < parts.len() {
        sum += parts[k].len();
        k += 1;
    }
    sum
}

/// All parts one after the other.
pub const fn joined<const N: usize>(parts: &[&str]) -> [u8; N] {
    let (mut out, mut at, mut k) = ([0; N], 0, 0);
    while k < parts.len() {
        let part = parts[k].as_bytes();
        let mut i = 0;
        while i < part.len() {
            out[at] = part[i];
            (at, i) = (at + 1, i + 1);
        }
        k += 1;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use terraglue_subsystem::Causality;

    #[test]
    fn words_and_lines() {
        let all = WORDS.iter().fold(Capabilities::default(), |all, (c, _)| all | *c);
        assert_eq!(words(all).len(), Capabilities::NAMES.len());
        assert_eq!(words(Capabilities::FORCE | Capabilities::RETRY), ["force", "retry"]);
        let mut v = Variable::real(3, "leg.torque", "N m", Causality::Output, "");
        assert_eq!(variable_line(&v), "leg.torque output f64 N m");
        (v.unit, v.dims) = (String::new(), vec![2, 3]);
        assert_eq!(variable_line(&v), "leg.torque output f64[2][3]");
        const PARTS: &[&str] = &["ab", "", "c\n"];
        assert_eq!(&joined::<{ length(PARTS) }>(PARTS), b"abc\n");
    }
}
