//! Archives and descriptions changed at random: every one is read or refused with an error that names the file, none
//! makes the readers panic, hang or leave anything behind.
//!
//! The changes follow from a seed, so a failure repeats. `TERRAGLUE_FUZZ_ROUNDS` makes it longer (the default suits a
//! test run), `TERRAGLUE_FUZZ_SEED` another one; `TERRAGLUE_FUZZ_KEEP=FOLDER` keeps the first input of each kind of
//! answer, which is how the files of `tests/hostile-archives/corpus` came about. They are replayed first.

use hostile_archives::mutations::Mutations;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use terraglue_fmi::{Fmu, Limits};

fn number(name: &str, otherwise: u64) -> u64 {
    std::env::var(name).ok().and_then(|t| t.parse().ok()).unwrap_or(otherwise)
}

/// The kind of answer of the readers: their text without numbers and names.
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
    let mut kinds = BTreeSet::new();
    let rounds = usize::try_from(number("TERRAGLUE_FUZZ_ROUNDS", 800)).expect("rounds");
    for bytes in Mutations::new(number("TERRAGLUE_FUZZ_SEED", 0x9e37_79b9_7f4a_7c15)).take(rounds) {
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
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("x.fmu");
    let corpus = hostile_archives::corpus().expect("the corpus");
    assert!(corpus.len() >= 30, "{} files", corpus.len());
    let kinds: BTreeSet<String> = corpus.iter().map(|(_, bytes)| answer(&path, bytes)).collect();
    assert!(
        kinds.len() * 10 >= corpus.len() * 8,
        "{} kinds of answers from {} files",
        kinds.len(),
        corpus.len()
    );
}
