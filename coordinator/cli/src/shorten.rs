//! Messages of a length that can be read, whatever the input holds: a file may be one line of a megabyte.

use miette::{NamedSource, SourceSpan};
use terraglue_scenario::InputError;

/// Longest message, and the parts of a longer one that are kept at its begin and its end, in bytes.
const LONGEST_TEXT: usize = 1200;
const HEAD: usize = 700;
const TAIL: usize = 300;
/// Longest line of a file that is shown, and the part of it before the marked place, in bytes.
const LONGEST_LINE: usize = 160;
const BEFORE: usize = 60;
/// Most lines of a file that are marked.
const MOST_LINES: usize = 8;

/// Longest number that stays as it is written, in characters: no sixteen digits of a usual size are longer.
const LONGEST_NUMBER: usize = 24;

/// A text with short numbers, and without its middle where it is too long.
pub fn text(text: &str) -> String {
    let text = numbers(text);
    if text.len() <= LONGEST_TEXT {
        return text;
    }
    let (head, tail) = (text.floor_char_boundary(HEAD), text.ceil_char_boundary(text.len() - TAIL));
    format!("{} … ({} characters) … {}", &text[..head], text[head..tail].chars().count(), &text[tail..])
}

/// The text with a power of ten in long numbers: 1e-300 has 300 digits.
fn numbers(text: &str) -> String {
    let (mut out, mut rest, mut before) = (String::with_capacity(text.len()), text, None);
    while let Some(at) = rest.find(|c: char| c.is_ascii_digit()) {
        out.push_str(&rest[..at]);
        before = rest[..at].chars().next_back().or(before);
        let end = rest[at..].find(|c: char| !(c.is_ascii_digit() || c == '.')).map_or(rest.len(), |n| at + n);
        let word = rest[at..end].trim_end_matches('.');
        let after = rest[at + word.len()..].chars().next();
        let is_part = |c: Option<char>| c.is_some_and(|c| c.is_alphanumeric() || "_/".contains(c));
        let number = word.parse::<f64>().ok().filter(|x| x.is_finite() && word.len() > LONGEST_NUMBER);
        match number.filter(|_| !is_part(before) && !is_part(after)) {
            Some(number) => out.push_str(&format!("{number:e}")),
            None => out.push_str(word),
        }
        before = word.chars().next_back();
        rest = &rest[at + word.len()..];
    }
    out + rest
}

/// An error whose texts and lines are short.
pub fn error(error: &InputError) -> InputError {
    let source = error.source_code.inner();
    let marked = error.span.map_or(0..0, |s| s.offset()..s.offset() + s.len());
    let (shown, marked) = lines(source, marked);
    InputError {
        message: text(&error.message),
        source_code: NamedSource::new(error.source_code.name(), shown),
        span: error.span.map(|_| SourceSpan::from(marked)),
        help: error.help.as_deref().map(text),
    }
}

/// The text with long lines cut around what is marked, and the mark in it.
fn lines(text: &str, marked: std::ops::Range<usize>) -> (String, std::ops::Range<usize>) {
    let mut out = String::with_capacity(text.len());
    let (mut start, mut end, mut begin, mut seen) = (None, 0, 0, 0);
    for line in text.split_inclusive('\n') {
        let body = line.trim_end_matches(['\n', '\r']);
        let own = |at: usize| at.clamp(begin, begin + body.len()) - begin;
        let touched = marked.start < begin + line.len() && (marked.end > begin || marked.start >= begin);
        let kept = window(body, if touched { own(marked.start) } else { 0 });
        let (before, after) =
            (if kept.start > 0 { "…" } else { "" }, if kept.end < body.len() { "…" } else { "" });
        let base = out.len() + before.len();
        let place = |at: usize| base + own(at).clamp(kept.start, kept.end) - kept.start;
        if touched && seen < MOST_LINES {
            start = start.or(Some(place(marked.start)));
            end = place(marked.end);
            seen += 1;
        }
        out.extend([before, &body[kept], after, &line[body.len()..]]);
        begin += line.len();
    }
    let start = start.unwrap_or(out.len());
    (out, start..end.max(start))
}

/// The part of a line that is shown: all of a short one.
fn window(line: &str, at: usize) -> std::ops::Range<usize> {
    if line.len() <= LONGEST_LINE {
        return 0..line.len();
    }
    let from = line.floor_char_boundary(at.saturating_sub(BEFORE));
    from..line.floor_char_boundary((from + LONGEST_LINE).min(line.len()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_short_stays() {
        let source = "a = 1\nb = 2\n\nc = 3";
        for marked in [0..5, 6..7, 12..12, 13..18, 18..18, 0..18] {
            assert_eq!(lines(source, marked.clone()), (source.to_owned(), marked));
        }
        assert_eq!(text("short"), "short");
    }

    #[test]
    fn long_numbers_have_a_power_of_ten() {
        let of = |x: f64| text(&format!("`h` = {x} m, more."));
        assert_eq!(of(1e-300), "`h` = 1e-300 m, more.");
        assert_eq!(of(-1.5e300), "`h` = -1.5e300 m, more.");
        for short in
            ["a.b.3.0000", "0.30000000000000004", "5.", "1_000", "é1 2.5 ende 3", "0.000012345678901234567"]
        {
            assert_eq!(text(short), short);
        }
        let hash = format!("{}a, /{}/x", "1".repeat(40), "2".repeat(40));
        assert_eq!(text(&hash), hash);
        assert_eq!(text(&format!("at most {:?} or {}.", 1e22, 1e25)), "at most 1e22 or 1e25.");
    }

    #[test]
    fn the_mark_stays_on_its_words_in_a_long_line() {
        let source = format!("first = 1\n{} here {}\nlast", "ä".repeat(5000), "z".repeat(5000));
        let at = source.find("here").expect("there");
        let (shown, marked) = lines(&source, at..at + 4);
        assert_eq!(&shown[marked], "here");
        assert!(shown.len() < 300 && shown.contains("first = 1") && shown.ends_with("last"), "{shown}");
        let (shown, marked) = lines(&source, 0..source.len());
        assert!(shown.len() < 300 && marked.end <= shown.len());
    }

    #[test]
    fn few_lines_are_marked_and_long_messages_lose_their_middle() {
        let (_, marked) = lines(&"x\n".repeat(1000), 0..2000);
        assert!(marked.len() <= 2 * MOST_LINES, "{marked:?}");
        let short = text(&format!("begin {} end", "é".repeat(100_000)));
        assert!(short.len() < LONGEST_TEXT && short.starts_with("begin") && short.ends_with("end"));
    }
}
