//! Good archives and descriptions, changed at random; the changes follow from a seed.

use crate::DESCRIPTION;
use crate::zip::{Entry, archive, stored};

/// Descriptions that are changed; one of each version with all that readers know.
const DESCRIPTIONS: [&str; 2] = [include_str!("../corpus/two.xml"), include_str!("../corpus/three.xml")];
const TERMINALS: &str = include_str!("../corpus/terminals.xml");

/// Words that hurt readers.
const WORDS: [&str; 24] = [
    "",
    "0",
    "-1",
    "4294967296",
    "18446744073709551616",
    "1e999",
    "NaN",
    "-inf",
    "\u{0}",
    "..",
    "/",
    "&amp;",
    "&x;",
    "<",
    ">",
    "\"",
    "]]>",
    "<!DOCTYPE x [<!ENTITY x \"y\">]>",
    "true",
    "xmlns:a=\"b\"",
    "\u{feff}",
    "🦶",
    "99999999999",
    "start",
];

struct Random(u64);

impl Random {
    /// Whole number below `n`.
    fn below(&mut self, n: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 33) as usize % n.max(1)
    }
}

/// Changed archives, without end.
pub struct Mutations {
    random: Random,
    round: u64,
}

impl Mutations {
    /// Those of a seed, which is not 0.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self { random: Random(seed), round: 0 }
    }
}

impl Iterator for Mutations {
    type Item = Vec<u8>;

    fn next(&mut self) -> Option<Vec<u8>> {
        let random = &mut self.random;
        let mut description = DESCRIPTIONS[random.below(2)].as_bytes().to_vec();
        let mut terminals = TERMINALS.as_bytes().to_vec();
        let kind = self.round % 4;
        self.round += 1;
        match kind {
            0 | 1 => change(&mut description, random),
            2 => change(&mut terminals, random),
            _ => {}
        }
        let pack: fn(&str, &[u8]) -> Entry = if random.below(2) == 0 { Entry::file } else { stored };
        let files = [
            (DESCRIPTION, description.as_slice()),
            ("terminalsAndIcons/terminalsAndIcons.xml", &terminals),
            ("resources/a.txt", b"a"),
        ];
        let mut bytes = archive(&files.map(|(name, bytes)| pack(name, bytes)));
        if kind == 3 {
            change(&mut bytes, random);
        }
        Some(bytes)
    }
}

/// Changes a few places: words of the text for others, pieces cut, doubled or moved, bytes turned.
fn change(bytes: &mut Vec<u8>, random: &mut Random) {
    for _ in 0..=random.below(4) {
        let at = random.below(bytes.len());
        let length = random.below(40).min(bytes.len() - at);
        match random.below(6) {
            0 => drop(bytes.drain(at..at + length)),
            1 => {
                let piece = bytes[at..at + length].to_vec();
                let to = random.below(bytes.len());
                bytes.splice(to..to, piece);
            }
            2 if !bytes.is_empty() => bytes[at] ^= 1 << random.below(8),
            3 => {
                let word = WORDS[random.below(WORDS.len())];
                bytes.splice(at..at + length.min(8), word.bytes());
            }
            4 => replace_value(bytes, at, WORDS[random.below(WORDS.len())]),
            _ => bytes.truncate(at),
        }
    }
}

/// Puts `word` in the place of the next value in quotes.
fn replace_value(bytes: &mut Vec<u8>, from: usize, word: &str) {
    let quote = |from: usize| bytes[from..].iter().position(|b| *b == b'"').map(|k| from + k);
    if let Some(first) = quote(from)
        && let Some(last) = quote(first + 1)
    {
        bytes.splice(first + 1..last, word.bytes());
    }
}
