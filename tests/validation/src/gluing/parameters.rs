//! The text column `parameters` of a table of values: `m1=1.0 x0=(1.0, 0.0) K=15383.3*Kf*[1,.5,2]`.

use crate::process::Outcome;

/// The text of one case.
#[derive(Clone, Copy, Debug)]
pub struct Parameters<'a>(pub &'a str);

impl<'a> Parameters<'a> {
    /// The text after `key=`; the key stands at the start of a word.
    fn after(self, key: &str) -> Option<&'a str> {
        let mut from = 0;
        while let Some(at) = self.0[from..].find(key).map(|at| at + from) {
            let rest = &self.0[at + key.len()..];
            let word = at == 0 || !self.0[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_');
            if word && rest.starts_with('=') {
                return Some(rest[1..].trim_start());
            }
            from = at + key.len();
        }
        None
    }

    /// A number, if there is one.
    pub fn optional(self, key: &str) -> Option<f64> {
        let text = self.after(key)?;
        let end = text.find(|c: char| !(c.is_ascii_digit() || "+-.eE".contains(c))).unwrap_or(text.len());
        text[..end].trim_end_matches(['e', 'E', '+', '-']).parse().ok()
    }

    /// A number.
    pub fn number(self, key: &str) -> Outcome<f64> {
        self.optional(key).ok_or_else(|| format!("`{}` has no number `{key}`", self.0))
    }

    /// The first list in brackets or parentheses after the key: its numbers, nesting flattened. Factors before it,
    /// numbers or other keys, multiply it.
    pub fn numbers(self, key: &str) -> Outcome<Vec<f64>> {
        let missing = || format!("`{}` has no list `{key}`", self.0);
        let text = self.after(key).ok_or_else(missing)?;
        let open = text.find(['[', '(']).ok_or_else(missing)?;
        let mut factor = 1.0;
        for word in text[..open].split('*').map(str::trim).filter(|w| !w.is_empty()) {
            factor *= word.parse().or_else(|_| self.number(word))?;
        }
        let mut depth = 0;
        let end = text[open..].find(|c: char| {
            depth += i32::from("[(".contains(c)) - i32::from("])".contains(c));
            depth == 0
        });
        let inside = &text[open..open + end.ok_or_else(missing)?];
        let words = inside.split(|c: char| ",[]() ".contains(c)).filter(|w| !w.is_empty());
        words.map(|w| w.parse::<f64>().map(|x| factor * x).map_err(|_| missing())).collect()
    }

    /// The number that stands directly before a suffix, as in `cut at 0.5L`.
    pub fn before(self, suffix: &str) -> Outcome<f64> {
        let number = |at: usize| {
            let head = &self.0[..at];
            let start = head.rfind(|c: char| !(c.is_ascii_digit() || c == '.')).map_or(0, |k| k + 1);
            head[start..].parse().ok()
        };
        let found = self.0.match_indices(suffix).find_map(|(at, _)| number(at));
        found.ok_or_else(|| format!("`{}` has no number before `{suffix}`", self.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_forms_of_the_reference_table_are_read() {
        let p = Parameters("m=5.0 v0=0.5 K=15383.3*Kf*[1,.5] Kf=2.0 n=1.1 ku=40K0f off=(0.05, -0.02) h=1e-3");
        assert_eq!(p.number("v0"), Ok(0.5));
        assert_eq!(p.number("m"), Ok(5.0));
        assert_eq!(p.number("h"), Ok(1e-3));
        assert_eq!(p.number("ku"), Ok(40.0));
        assert_eq!(p.numbers("K"), Ok(vec![30766.6, 15383.3]));
        assert_eq!(p.numbers("off"), Ok(vec![0.05, -0.02]));
        assert_eq!(Parameters("welded cut at 0.5L (T").before("L"), Ok(0.5));
        assert_eq!(Parameters("A,B=[[0.0, 1.0], [2, 3]]").numbers("B"), Ok(vec![0.0, 1.0, 2.0, 3.0]));
        assert!(p.number("x0").is_err());
    }
}
