//! Archives and descriptions changed at random: every one is read or refused with an error that names the file, none
//! makes the readers panic, hang or leave anything behind.
//!
//! The changes follow from a seed, so a failure repeats. `TERRAGLUE_FUZZ_ROUNDS` makes it longer (the default suits a
//! test run), `TERRAGLUE_FUZZ_SEED` another one; `TERRAGLUE_FUZZ_KEEP=FOLDER` keeps the first input of each kind of
//! answer, which is how the files of `corpus/` came about. They are replayed first.

use std::collections::BTreeSet;
use std::io::{Cursor, Write};
use std::path::{Path, PathBuf};
use terraglue_fmi::{Fmu, Limits};
use zip::write::SimpleFileOptions;

/// Descriptions that are changed; one of each version with all that the readers know.
const DESCRIPTIONS: [&str; 2] = [include_str!("corpus/two.xml"), include_str!("corpus/three.xml")];
const TERMINALS: &str = include_str!("corpus/terminals.xml");

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

fn number(name: &str, otherwise: u64) -> u64 {
    std::env::var(name).ok().and_then(|t| t.parse().ok()).unwrap_or(otherwise)
}

fn archive(description: &[u8], terminals: &[u8], deflate: bool) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
    let method = if deflate { zip::CompressionMethod::Deflated } else { zip::CompressionMethod::Stored };
    let options = SimpleFileOptions::default().compression_method(method);
    let files: [(&str, &[u8]); 3] = [
        ("modelDescription.xml", description),
        ("terminalsAndIcons/terminalsAndIcons.xml", terminals),
        ("resources/a.txt", b"a"),
    ];
    for (name, bytes) in files {
        zip.start_file(name, options).expect("an entry");
        zip.write_all(bytes).expect("bytes");
    }
    zip.finish().expect("an archive").into_inner()
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

/// What the readers say, without numbers and names: the kind of answer.
fn answer(path: &Path, bytes: &[u8]) -> String {
    std::fs::write(path, bytes).expect("written");
    let limits = Limits { total: 1 << 24, description: 1 << 22, ..Limits::default() };
    let text = match Fmu::open_within(path, limits) {
        Ok(fmu) => format!("read, {} problems", fmu.description().problems.len().min(3)),
        Err(error) => {
            let text = error.to_string();
            assert!(text.contains("x.fmu") && text.len() < 2000, "{text}");
            text
        }
    };
    let quoted = text.split(['`', '"']).step_by(2).collect::<String>();
    quoted.chars().filter(|c| !c.is_ascii_digit()).collect()
}

#[test]
fn changed_archives_and_descriptions_are_read_or_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("x.fmu");
    let keep = std::env::var_os("TERRAGLUE_FUZZ_KEEP").map(PathBuf::from);
    let mut random = Random(number("TERRAGLUE_FUZZ_SEED", 0x9e37_79b9_7f4a_7c15));
    let mut kinds = BTreeSet::new();
    for round in 0..number("TERRAGLUE_FUZZ_ROUNDS", 800) {
        let mut description = DESCRIPTIONS[random.below(2)].as_bytes().to_vec();
        let mut terminals = TERMINALS.as_bytes().to_vec();
        let deflate = random.below(2) == 0;
        let bytes = match round % 4 {
            0 | 1 => {
                change(&mut description, &mut random);
                archive(&description, &terminals, deflate)
            }
            2 => {
                change(&mut terminals, &mut random);
                archive(&description, &terminals, deflate)
            }
            _ => {
                let mut bytes = archive(&description, &terminals, deflate);
                change(&mut bytes, &mut random);
                bytes
            }
        };
        let kind = answer(&path, &bytes);
        if kinds.insert(kind)
            && let Some(keep) = &keep
        {
            std::fs::write(keep.join(format!("{:03}.fmu", kinds.len())), &bytes).expect("kept");
        }
    }
    assert!(kinds.len() > 30, "only {} kinds of answers: {kinds:#?}", kinds.len());
    let left: Vec<_> = std::fs::read_dir(folder.path()).expect("a folder").flatten().collect();
    assert_eq!(left.len(), 1, "nothing beside the archive");
}

#[test]
fn the_corpus_is_read_or_refused_as_before() {
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus");
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("x.fmu");
    let mut names: Vec<PathBuf> = std::fs::read_dir(corpus)
        .expect("the corpus")
        .flatten()
        .map(|e| e.path())
        .filter(|p| p.extension().is_some_and(|e| e == "fmu"))
        .collect();
    names.sort();
    assert!(names.len() >= 30, "{} files", names.len());
    let mut kinds = BTreeSet::new();
    for name in &names {
        kinds.insert(answer(&path, &std::fs::read(name).expect("a file")));
    }
    assert!(
        kinds.len() * 10 >= names.len() * 8,
        "{} kinds of answers from {} files",
        kinds.len(),
        names.len()
    );
}
