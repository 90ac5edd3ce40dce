//! Archives and descriptions that lie, lead elsewhere or are too large: each is refused with one error before any code
//! of it runs, and nothing is written outside the temporary folder nor left in it. Odd but legal ones are read.

use std::io::{Cursor, Write};
use std::path::{Path, PathBuf};
use terraglue_fmi::{Error, Fmu, Limits};
use zip::write::SimpleFileOptions;

const GOOD: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="m" guid="g">
<CoSimulation modelIdentifier="m"/>
<ModelVariables>
<ScalarVariable name="x" valueReference="0" causality="output"><Real/></ScalarVariable>
</ModelVariables>
<ModelStructure><Outputs><Unknown index="1"/></Outputs></ModelStructure>
</fmiModelDescription>"#;

const GOOD_3: &str = r#"<fmiModelDescription fmiVersion="3.0" modelName="m" instantiationToken="g">
<CoSimulation modelIdentifier="m"/>
<ModelVariables>
<Float64 name="x" valueReference="1" causality="output"/>
</ModelVariables>
<ModelStructure><Output valueReference="1"/></ModelStructure>
</fmiModelDescription>"#;

type Entry<'a> = (&'a str, &'a [u8], u32);

/// An archive with entries of these names, contents and modes.
fn archive(entries: &[Entry]) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
    for (name, bytes, mode) in entries {
        let options = SimpleFileOptions::default()
            .compression_method(zip::CompressionMethod::Deflated)
            .unix_permissions(*mode);
        zip.start_file(*name, options).expect("an entry");
        zip.write_all(bytes).expect("bytes");
    }
    let mut bytes = zip.finish().expect("an archive").into_inner();
    // The writer knows files only: the kind of an entry stands in the upper half of its attributes.
    let mut at = 0;
    for (name, _, mode) in entries {
        let found = (at..bytes.len() - 4).find(|k| bytes[*k..].starts_with(b"PK\x01\x02")).expect("a header");
        assert!(bytes[found + 46..].starts_with(name.as_bytes()), "{name}");
        if mode >> 12 != 0 {
            bytes[found + 38..found + 42].copy_from_slice(&(mode << 16).to_le_bytes());
        }
        at = found + 4;
    }
    bytes
}

fn unit(description: &str) -> Vec<u8> {
    archive(&[("modelDescription.xml", description.as_bytes(), 0o644)])
}

/// A folder of its own for the archive; what lies beside it must not change.
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

fn refusal(bytes: &[u8]) -> String {
    refusal_within(bytes, Limits::default())
}

/// Replaces the one place in the archive's directory where `from` stands.
fn patched(mut bytes: Vec<u8>, header: &[u8], offset: usize, new: &[u8]) -> Vec<u8> {
    let at = bytes.windows(header.len()).rposition(|w| w == header).expect("a header") + offset;
    bytes[at..at + new.len()].copy_from_slice(new);
    bytes
}

const DIRECTORY: &[u8] = b"PK\x01\x02";
const LOCAL: &[u8] = b"PK\x03\x04";

#[test]
fn names_that_lead_elsewhere_are_refused() {
    let good: Entry = ("modelDescription.xml", GOOD.as_bytes(), 0o644);
    for (name, says) in [
        ("../evil", "leads out"),
        ("resources/../../evil", "leads out"),
        ("resources/..\\..\\evil", "leads out"),
        ("/evil", "absolute"),
        ("C:/evil", "absolute"),
        ("\\\\host\\evil", "absolute"),
    ] {
        let text = refusal(&archive(&[good, (name, b"x", 0o644)]));
        assert!(text.contains(says), "{name}: {text}");
    }
}

#[test]
fn links_and_devices_are_refused() {
    let good: Entry = ("modelDescription.xml", GOOD.as_bytes(), 0o644);
    let text = refusal(&archive(&[good, ("resources/link", b"/etc/passwd", 0o120_777)]));
    assert!(text.contains("symbolic link"), "{text}");
    for mode in [0o010_644, 0o020_644, 0o060_644, 0o140_644] {
        let text = refusal(&archive(&[good, ("resources/odd", b"", mode)]));
        assert!(text.contains("neither a file nor a folder"), "{mode:o}: {text}");
    }
}

#[test]
fn names_that_clash_are_refused() {
    let good: Entry = ("modelDescription.xml", GOOD.as_bytes(), 0o644);
    let both = archive(&[good, ("a", b"x", 0o644), ("a/b", b"x", 0o644)]);
    assert!(refusal(&both).contains("file and a folder"));
    let slashes = archive(&[good, ("a/b", b"x", 0o644), ("a\\b", b"x", 0o644)]);
    assert!(refusal(&slashes).contains("occurs twice"));
    // The same name twice: the writer refuses it, so the second is renamed afterwards, in both headers.
    let mut twin = archive(&[good, ("aaaa", b"x", 0o644), ("aaab", b"y", 0o644)]);
    for at in (0..twin.len() - 4).filter(|k| twin[*k..].starts_with(b"aaab")).collect::<Vec<_>>() {
        twin[at + 3] = b'a';
    }
    assert!(refusal(&twin).contains("twice"));
}

#[test]
fn a_file_that_is_listed_twice_with_the_same_content_is_one_file() {
    let good: Entry = ("modelDescription.xml", GOOD.as_bytes(), 0o644);
    let mut twin = archive(&[good, ("aaaa", b"x", 0o644), ("aaab", b"x", 0o644)]);
    for at in (0..twin.len() - 4).filter(|k| twin[*k..].starts_with(b"aaab")).collect::<Vec<_>>() {
        twin[at + 3] = b'a';
    }
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("twin.fmu");
    std::fs::write(&path, &twin).expect("written");
    let fmu = Fmu::open(&path).expect("a unit");
    assert_eq!(std::fs::read(fmu.folder().join("aaaa")).expect("extracted"), b"x");
}

#[test]
fn bombs_are_refused_before_they_are_unpacked() {
    let zeros = vec![0_u8; 40 << 20];
    let bomb =
        archive(&[("modelDescription.xml", GOOD.as_bytes(), 0o644), ("resources/zeros", &zeros, 0o644)]);
    assert!(bomb.len() < 1 << 20);
    let strict = Limits { ratio: 1.0 / 100.0, ..Limits::default() };
    assert!(refusal_within(&bomb, strict).contains("bomb"));
    assert!(
        refusal_within(&bomb, Limits { total: 1 << 20, ..Limits::default() }).contains("more than 1048576")
    );
    assert!(refusal_within(&bomb, Limits { entries: 1, ..Limits::default() }).contains("has 2 entries"));
    let text = refusal_within(&unit(GOOD), Limits { description: 100, ..Limits::default() });
    assert!(text.contains("more than 100"), "{text}");
}

#[test]
fn lies_about_sizes_are_found_out() {
    let data: Vec<u8> = (0..100_000_u32).flat_map(u32::to_le_bytes).collect();
    let entries =
        [("modelDescription.xml", GOOD.as_bytes(), 0o644), ("resources/data", data.as_slice(), 0o644)];
    for (stated, says) in [(10_u32, "more than the 10 bytes"), (500_000, "states 500000")] {
        let lie = patched(archive(&entries), DIRECTORY, 24, &stated.to_le_bytes());
        let text = refusal(&lie);
        assert!(text.contains(says) || text.contains("unpacked"), "{text}");
    }
    let huge = patched(archive(&entries), DIRECTORY, 24, &0xffff_fff0_u32.to_le_bytes());
    let text = refusal(&huge);
    assert!(text.contains("bomb") || text.contains("more than"), "{text}");
}

#[test]
fn broken_archives_are_refused() {
    let good = unit(GOOD);
    for bytes in [Vec::new(), b"PK".to_vec(), b"no archive at all".to_vec(), good[..good.len() - 30].to_vec()]
    {
        refusal(&bytes);
    }
    for cut in (1..good.len()).step_by(37) {
        refusal(&good[..cut]);
    }
    let encrypted = patched(patched(good.clone(), DIRECTORY, 8, &[1, 0]), LOCAL, 6, &[1, 0]);
    assert!(refusal(&encrypted).contains("encrypted"));
    let method = patched(patched(good, DIRECTORY, 10, &[12, 0]), LOCAL, 8, &[12, 0]);
    assert!(refusal(&method).contains("method"));
    let place = Place::new();
    assert!(Fmu::open(place.folder.path()).is_err() && Fmu::open(Path::new("/dev/zero")).is_err());
}

#[test]
fn descriptions_that_break_the_standard_are_refused_with_their_line() {
    let with = |from: &str, to: &str| GOOD.replace(from, to);
    let variable =
        r#"<ScalarVariable name="x" valueReference="0" causality="output"><Real/></ScalarVariable>"#;
    let cases = [
        (with(r#"modelIdentifier="m""#, r#"modelIdentifier="$(touch evil)""#), "no identifier of C"),
        (with(r#"modelIdentifier="m""#, r#"modelIdentifier="../../lib/evil""#), "no identifier of C"),
        (with(r#"modelIdentifier="m""#, r#"modelIdentifier="..""#), "no identifier of C"),
        (with(r#"modelIdentifier="m""#, r#"modelIdentifier=".m""#), "no identifier of C"),
        (with(r#"modelIdentifier="m""#, r#"modelIdentifier="-m""#), "no identifier of C"),
        (with(r#"modelIdentifier="m""#, r#"modelIdentifier="m\m""#), "no identifier of C"),
        (with(r#"modelIdentifier="m""#, r#"modelIdentifier="a;b""#), "no identifier of C"),
        (with(r#"modelIdentifier="m""#, r#"modelIdentifier="a b""#), "no identifier of C"),
        (with(r#"modelIdentifier="m""#, r#"modelIdentifier="""#), "no identifier of C"),
        (with(r#"valueReference="0""#, r#"valueReference="-1""#), "4294967295"),
        (with(r#"valueReference="0""#, r#"valueReference="18446744073709551616""#), "4294967295"),
        (with(variable, &format!("{variable}{variable}")), "occurs twice"),
        (with(r#"name="x""#, r#"name="""#), "empty name"),
        (with("<Real/>", "<Quaternion/>"), "no type"),
        (with("<Real/>", r#"<Real start="one"/>"#), "numbers"),
        (with("<Real/>", r#"<Real declaredType="nowhere"/>"#), "does not exist"),
        (with(r#"causality="output""#, r#"causality="boss""#), "causality"),
        (with(r#"index="1""#, r#"index="9""#), "9"),
        (with(r#"fmiVersion="2.0""#, r#"fmiVersion="7""#), "fmiVersion"),
        (with(r#" guid="g""#, ""), "guid"),
        (with("</fmiModelDescription>", ""), "xml"),
        ("<a>".repeat(100_000), "nested"),
        (format!(r#"<!DOCTYPE a [<!ENTITY b "{}">]><a>&b;</a>"#, "c".repeat(100)), "DTD"),
        ("<nothing/>".into(), "no FMU"),
        (
            GOOD_3.replace(
                "</ModelVariables>",
                r#"<Float64 name="y" valueReference="2"><Dimension start="4294967296"/><Dimension start="4294967296"/></Float64></ModelVariables>"#,
            ),
            "elements",
        ),
        (
            GOOD_3.replace("</ModelVariables>", r#"<Float64 name="y" valueReference="1"/></ModelVariables>"#),
            "belongs to `x` already",
        ),
    ];
    for (description, says) in cases {
        let text = refusal(&unit(&description));
        assert!(text.contains(says) && text.contains("modelDescription.xml:"), "{says}: {text}");
    }
    let utf16: Vec<u8> = GOOD.encode_utf16().flat_map(u16::to_le_bytes).collect();
    for bytes in [utf16, b"\xff\xfe<\0".to_vec(), b"<a b=\"\xc3\x28\"/>".to_vec()] {
        let text = refusal(&archive(&[("modelDescription.xml", &bytes, 0o644)]));
        assert!(text.contains("UTF-"), "{text}");
    }
    assert!(refusal(&unit(&GOOD.replace("CoSimulation", "ModelExchange"))).contains("model exchange"));
    assert!(
        refusal(&unit(&GOOD_3.replace("CoSimulation", "ScheduledExecution"))).contains("scheduled execution")
    );
}

/// What happens to a unit whose archive is good but whose library is not.
fn loading(entries: &[Entry], description: &str) -> String {
    let mut all: Vec<Entry> = vec![("modelDescription.xml", description.as_bytes(), 0o644)];
    all.extend_from_slice(entries);
    let place = Place::new();
    let fmu = Fmu::open(&place.write(&archive(&all))).expect("a good archive");
    let folder = fmu.folder().to_owned();
    let options = terraglue_fmi::SlaveOptions {
        name: "x".into(),
        verbose: false,
        event_mode: false,
        intermediate: Vec::new(),
        followed: Vec::new(),
        sink: Box::new(|_| {}),
    };
    let error = terraglue_fmi::Slave::instantiate(&fmu, options).expect_err("no library");
    drop(fmu);
    assert!(!folder.exists(), "the folder goes");
    error.to_string()
}

#[test]
fn libraries_that_are_none_are_refused() {
    assert!(loading(&[], GOOD).contains("no library at all"));
    assert!(loading(&[("sources/m.c", b"", 0o644)], GOOD).contains("source code only"));
    assert!(loading(&[("binaries/win64/m.dll", b"MZ", 0o644)], GOOD).contains("win64"));
    let text = loading(&[("binaries/linux64/m.so", b"#!/bin/sh\ntouch evil\n", 0o755)], GOOD);
    assert!(text.contains("no ELF header"), "{text}");
    let mut arm = vec![0_u8; 64];
    arm[..5].copy_from_slice(b"\x7fELF\x02");
    arm[18] = 0xb7;
    assert!(loading(&[("binaries/linux64/m.so", &arm, 0o755)], GOOD).contains("another kind of machine"));
    let mut empty = arm;
    empty[18] = 62;
    assert!(loading(&[("binaries/x86_64-linux/m.so", &empty, 0o755)], GOOD_3).contains("cannot be loaded"));
}

#[test]
fn odd_but_legal_units_are_read() {
    let alias = r#"<ScalarVariable name="y" valueReference="0" causality="output"><Real/></ScalarVariable></ModelVariables>"#;
    let odd = [
        GOOD.replace("</ModelVariables>", alias),
        GOOD.replace(r#" guid="g""#, r#" guid="g" xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" xsi:n="m""#),
        GOOD.replace("<ModelStructure>", r#"<VendorAnnotations><Tool name="t"><x:y xmlns:x="u"/></Tool></VendorAnnotations><ModelStructure>"#),
        format!("\u{feff}{GOOD}"),
        GOOD_3.replace(r#"causality="output"/>"#, r#"causality="output"><Alias name="z"/></Float64>"#),
    ];
    for description in odd {
        let place = Place::new();
        let path = place.write(&unit(&description));
        Fmu::open(&path).unwrap_or_else(|e| panic!("{e}\n{description}"));
    }
    let place = Place::new();
    let folders = [
        ("./", b"".as_slice(), 0o040_755),
        ("modelDescription.xml", GOOD.as_bytes(), 0o644),
        ("resources/", b"", 0o040_755),
    ];
    Fmu::open(&place.write(&archive(&folders))).expect("entries of folders are legal");
}

#[test]
fn a_plain_file_name_as_identifier_is_taken_with_a_warning() {
    for name in ["tank-c", "2tank", "tank.v1", "Tank-Standalone.2"] {
        let place = Place::new();
        let text = GOOD.replace(r#"modelIdentifier="m""#, &format!(r#"modelIdentifier="{name}""#));
        let fmu = Fmu::open(&place.write(&unit(&text))).unwrap_or_else(|e| panic!("{e}"));
        let description = fmu.description();
        assert_eq!(description.identifier, name);
        let told = description.problems.iter().any(|p| p.contains(name) && p.contains("no identifier of C"));
        assert!(told, "{:?}", description.problems);
    }
}

#[test]
fn twenty_thousand_variables_are_read_in_one_pass() {
    let many: String = (0..20_000)
        .map(|k| {
            format!(
                "<ScalarVariable name=\"v{k}\" valueReference=\"{k}\"><Real start=\"1\"/></ScalarVariable>\n"
            )
        })
        .collect();
    let place = Place::new();
    let path = place.write(&unit(&GOOD.replace("</ModelVariables>", &format!("{many}</ModelVariables>"))));
    assert_eq!(Fmu::open(&path).expect("read").description().variables.len(), 20_001);
}

/// Good units, changed at every few places: an error or a unit, never a panic.
#[test]
fn damaged_bytes_never_do_harm() {
    for description in [GOOD, GOOD_3] {
        let bytes = unit(description);
        let place = Place::new();
        for at in (0..bytes.len()).step_by(11) {
            for flip in [0x01_u8, 0x80] {
                let mut damaged = bytes.clone();
                damaged[at] ^= flip;
                drop(Fmu::open(&place.write(&damaged)));
            }
        }
        for at in (0..description.len()).step_by(7) {
            for new in ["\"", "<", "&", "\u{0}", "9999999999999999999999"] {
                if description.is_char_boundary(at) {
                    let text = format!("{}{new}{}", &description[..at], &description[at + 1..]);
                    drop(Fmu::inspect(&place.write(&unit(&text))));
                }
            }
        }
    }
}
