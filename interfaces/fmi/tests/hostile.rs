//! Archives and descriptions that lie, lead elsewhere or are too large: each is refused with one error before any code
//! of it runs, and nothing is written outside the temporary folder nor left in it. Odd but legal ones are read.
//! `cargo xtask validate fmi` checks the messages of the program, with a library that reports whether its code ran.

use hostile_archives::{MANY, refused, unloadable, usable};
use std::path::{Path, PathBuf};
use terraglue_fmi::{Error, Fmu, FmuInstance, InstanceOptions, Limits};

/// Stands for a library; nobody loads it here.
const LIBRARY: &[u8] = b"library";

/// A folder of its own for the archive; the files next to it must not change.
struct Place {
    folder: tempfile::TempDir,
}

impl Place {
    fn new() -> Self {
        Self { folder: tempfile::tempdir().expect("a folder") }
    }

    fn write(&self, bytes: &[u8]) -> PathBuf {
        let path = self.folder.path().join("x.fmu");
        std::fs::write(&path, bytes).expect("written");
        path
    }

    fn names(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.folder.path()).expect("a folder").flatten();
        entries.map(|e| e.file_name().to_string_lossy().into_owned()).collect()
    }
}

fn refusal_within(bytes: &[u8], limits: Limits) -> String {
    let place = Place::new();
    let path = place.write(bytes);
    let error = Fmu::open_within(&path, limits).expect_err("must be refused");
    assert!(!matches!(error, Error::Call { .. }), "{error}");
    assert_eq!(place.names(), ["x.fmu"], "nothing beside the archive");
    let text = error.to_string();
    assert!(text.contains("x.fmu") && text.len() < 2000, "{text}");
    text
}

#[test]
fn what_lies_or_leads_elsewhere_is_refused() {
    let cases = refused(LIBRARY);
    assert!(cases.len() > 80, "{} cases", cases.len());
    for case in cases {
        let text = refusal_within(&case.bytes, Limits::default());
        assert!(text.contains(case.says), "{}: {text}", case.name);
    }
}

#[test]
fn what_is_no_file_is_refused() {
    let place = Place::new();
    assert!(Fmu::open(place.folder.path()).is_err() && Fmu::open(Path::new("/dev/zero")).is_err());
}

#[test]
fn a_description_is_refused_with_its_line() {
    let text = |name: &str| {
        let case = refused(LIBRARY).into_iter().find(|case| case.name.contains(name)).expect("the case");
        refusal_within(&case.bytes, Limits::default())
    };
    assert!(text("as valueReference=\"-1\"").contains("modelDescription.xml:5"));
    assert!(text("a variable twice").contains("modelDescription.xml:5"));
    assert!(text("boss").contains("modelDescription.xml:5"));
}

#[test]
fn more_than_the_limits_is_refused() {
    let plain = &usable(LIBRARY)[0].bytes;
    let limits = |change: fn(&mut Limits)| {
        let mut limits = Limits::default();
        change(&mut limits);
        refusal_within(plain, limits)
    };
    assert!(limits(|l| l.total = 100).contains("more than 100"));
    assert!(limits(|l| l.entries = 1).contains("has 3 entries"));
    assert!(limits(|l| l.description = 100).contains("more than 100"));
}

#[test]
fn archives_that_were_cut_are_refused() {
    let plain = &usable(LIBRARY)[0].bytes;
    for cut in 1..plain.len() {
        refusal_within(&plain[..cut], Limits::default());
    }
}

/// Outcome of loading an FMU whose archive is good but whose library is not.
fn loading(bytes: &[u8]) -> String {
    let place = Place::new();
    let fmu = Fmu::open(&place.write(bytes)).expect("a good archive");
    let folder = fmu.folder().to_owned();
    let options = InstanceOptions::new("x", Box::new(|_| {}));
    let error = FmuInstance::instantiate(&fmu, options).expect_err("no library");
    drop(fmu);
    assert!(!folder.exists(), "the folder goes");
    error.to_string()
}

#[test]
fn libraries_that_are_none_are_refused() {
    for case in unloadable(LIBRARY) {
        let text = loading(&case.bytes);
        assert!(text.contains(case.says), "{}: {text}", case.name);
    }
}

#[test]
fn odd_but_legal_fmus_are_read() {
    for case in usable(LIBRARY) {
        let place = Place::new();
        let fmu = Fmu::open(&place.write(&case.bytes)).unwrap_or_else(|e| panic!("{}: {e}", case.name));
        let d = fmu.description();
        if let Some(name) = case.name.strip_prefix("the name ") {
            assert_eq!(d.identifier, name);
            let told = d.problems.iter().any(|p| p.contains(name) && p.contains("no identifier of C"));
            assert!(told, "{:?}", d.problems);
        }
        match case.name.as_str() {
            "20 000 variables" => assert_eq!(d.variables.len(), MANY + 1),
            "a file listed twice" => {
                assert_eq!(std::fs::read(fmu.folder().join("resources/a")).expect("extracted"), b"x");
            }
            _ => {}
        }
    }
}

/// Good FMUs, changed at every few places: an error or an FMU, never a panic.
#[test]
fn damaged_bytes_never_do_harm() {
    for case in usable(LIBRARY).into_iter().take(2) {
        let place = Place::new();
        for at in (0..case.bytes.len()).step_by(3) {
            for flip in [0x01_u8, 0x80] {
                let mut damaged = case.bytes.clone();
                damaged[at] ^= flip;
                drop(Fmu::open(&place.write(&damaged)));
            }
        }
    }
}
