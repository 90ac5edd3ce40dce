//! Good archives whose library cannot be loaded.

use crate::descriptions::{THREE, TWO, fmu};
use crate::zip::{Entry, archive};
use crate::{Case, DESCRIPTION, LIBRARIES};

/// All of them.
#[must_use]
pub fn unloadable(library: &[u8]) -> Vec<Case> {
    let mut arm = vec![0_u8; 64];
    arm[..5].copy_from_slice(b"\x7fELF\x02");
    arm[18] = 0xb7;
    let mut empty = arm.clone();
    empty[18] = 62;
    let [two, three] = LIBRARIES;
    let half = &library[..library.len() / 2];
    let all: [(&str, &str, &[u8], &str); 7] = [
        ("source code only", "sources/m.c", b"", "source code only"),
        ("another system", "binaries/win64/m.dll", b"MZ", "win64"),
        ("a script", two, b"#!/bin/sh\ntouch evil\n", "no ELF header"),
        ("text", two, b"library", "no ELF header"),
        ("another kind of machine", two, &arm, "another kind of machine"),
        ("a header alone", three, &empty, "cannot be loaded"),
        ("half a library", three, half, "cannot be loaded"),
    ];
    let mut all: Vec<Case> = all
        .into_iter()
        // a caller without a library has no half of one
        .filter(|(_, _, bytes, says)| *says != "cannot be loaded" || !bytes.is_empty())
        .map(|(name, entry, bytes, says)| {
            let description = if entry == three { THREE } else { TWO };
            let entries = [Entry::file(DESCRIPTION, description.as_bytes()), Entry::file(entry, bytes)];
            Case::new(name, archive(&entries), says)
        })
        .collect();
    let alone = archive(&[Entry::file(DESCRIPTION, TWO.as_bytes())]);
    all.push(Case::new("no library", alone, "no library at all"));
    all
}

/// An FMU whose description has another token than its library knows, which only the library can detect.
#[must_use]
pub fn another_token(library: &[u8]) -> Case {
    let text = TWO.replacen(r#" guid="g""#, r#" guid="another""#, 1);
    Case::new("another token", fmu(text.as_bytes(), library), "is not mine")
}
