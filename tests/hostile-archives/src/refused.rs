//! Archives and descriptions that must be refused before anything of them is written or runs.

use crate::descriptions::{THREE, TWO, entries, fmu, with};
use crate::zip::{Entry, archive};
use crate::{Case, DESCRIPTION};

/// All of them.
#[must_use]
pub fn refused(library: &[u8]) -> Vec<Case> {
    let mut all = names(library);
    all.extend(kinds(library));
    all.extend(clashes(library));
    all.extend(sizes(library));
    all.extend(broken(library));
    let described = descriptions();
    all.extend(described.map(|(name, text, says)| Case::new(name, fmu(text.as_bytes(), library), says)));
    all.extend(encodings(library));
    all
}

fn names(library: &[u8]) -> Vec<Case> {
    let long = "n".repeat(300);
    let deep = "d/".repeat(70) + "n";
    let all = [
        ("../evil", "leads out"),
        ("resources/../../evil", "leads out"),
        ("resources/..\\..\\evil", "leads out"),
        ("resources/./../../evil", "leads out"),
        ("/evil", "absolute"),
        ("C:/evil", "absolute"),
        ("C:evil", "absolute"),
        ("\\\\host\\evil", "absolute"),
        ("resources/e\0vil", ""),
        ("", ""),
        (&long, "no usable name"),
        (&deep, "no usable name"),
    ];
    let case = |(name, says): (&str, _)| {
        let short: String = name.chars().take(20).collect();
        Case::new(format!("name {short:?}"), with(library, [Entry::file(name, b"x")]), says)
    };
    all.map(case).to_vec()
}

fn kinds(library: &[u8]) -> Vec<Case> {
    let odd = "neither a file nor a folder";
    let all = [
        ("link", 0o120_777, "symbolic link"),
        ("pipe", 0o010_644, odd),
        ("character device", 0o020_644, odd),
        ("block device", 0o060_644, odd),
        ("socket", 0o140_644, odd),
    ];
    let case = |(name, mode, says)| {
        let entry = Entry::file("resources/odd", b"/etc/passwd").with(|e| e.mode = mode);
        Case::new(name, with(library, [entry]), says)
    };
    all.map(case).to_vec()
}

fn clashes(library: &[u8]) -> Vec<Case> {
    let file = |name, bytes: &str| Entry::file(name, bytes.as_bytes());
    let all = [
        ("file and folder", vec![file("a", "x"), file("a/b", "x")], "file and a folder"),
        ("both slashes", vec![file("a/b", "x"), file("a\\b", "x")], "occurs twice"),
        ("twice", vec![file("a", "x"), file("a", "y")], "twice"),
        ("another way", vec![file("a/b", "x"), file("a/./b", "x")], "occurs twice"),
        ("two descriptions", vec![file(DESCRIPTION, THREE)], "twice"),
    ];
    all.map(|(name, entries, says)| Case::new(name, with(library, entries), says)).to_vec()
}

fn sizes(library: &[u8]) -> Vec<Case> {
    let data: Vec<u8> = (0..100_000_u32).flat_map(u32::to_le_bytes).collect();
    let data = |size| Entry::file("resources/data", &data).with(|e| e.size = size);
    let zeros = |name: &str, size| Entry::blown_up(name, 0, size);
    let overlapping = |k: usize| {
        Entry::file("", &[7; 10]).with(|e| {
            (e.name, e.shared, e.size) = (format!("resources/{k}").into_bytes(), k > 0, 1 << 20);
            e.packed = vec![0; 2000];
        })
    };
    let lie = zeros("resources/zeros", 1 << 30).with(|e| e.size = 10);
    let all = [
        ("3 GiB of zeros", vec![zeros("resources/zeros", 3 << 30)], "bomb"),
        (
            "3 GiB in twelve files",
            (0..12).map(|k| zeros(&format!("resources/{k}"), 1 << 28)).collect(),
            "bomb",
        ),
        ("1 GiB of zeros that states 10 bytes", vec![lie], "more than the 10 bytes"),
        ("data that states less", vec![data(10)], "more than the 10 bytes"),
        ("data that states more", vec![data(500_000)], "states 500000"),
        ("data that states 4 GiB", vec![data(0xffff_fff0)], "bomb"),
        ("entries that share their bytes", (0..5000).map(overlapping).collect(), "bomb"),
        ("wrong check sum", vec![Entry::file("resources/a", b"text").with(|e| e.crc ^= 1)], "checksum"),
    ];
    let mut all = all.map(|(name, entries, says)| Case::new(name, with(library, entries), says)).to_vec();
    let blanks = Entry::blown_up(DESCRIPTION, b' ', 300 << 20);
    all.push(Case::new("a description of 300 MiB", archive(&[blanks]), "bomb"));
    all
}

fn broken(library: &[u8]) -> Vec<Case> {
    let good = fmu(TWO.as_bytes(), library);
    let changed = |change: fn(&mut Entry)| {
        archive(&entries(TWO.as_bytes(), library).into_iter().map(|e| e.with(change)).collect::<Vec<_>>())
    };
    let mut all = vec![
        Case::new("empty file", Vec::new(), "zip"),
        Case::new("two letters", b"PK".to_vec(), "zip"),
        Case::new("text", b"no archive at all".to_vec(), "zip"),
        Case::new("encrypted", changed(|e| e.flags = 1), "encrypted"),
        Case::new("unknown method", changed(|e| e.method = 12), "method"),
        Case::new("no description", archive(&[Entry::file("readme", b"")]), "no modelDescription.xml"),
    ];
    for tenth in 1..10 {
        let cut = good[..good.len() * tenth / 10].to_vec();
        all.push(Case::new(format!("cut at {tenth} tenths"), cut, ""));
    }
    all.push(Case::new("without its last bytes", good[..good.len() - 30].to_vec(), ""));
    all
}

fn descriptions() -> impl Iterator<Item = (String, String, &'static str)> {
    let changes = changes().into_iter().map(|(from, to, says)| {
        let text = if THREE.contains(from) && !TWO.contains(from) { THREE } else { TWO };
        (format!("{from} as {}", to.chars().take(60).collect::<String>()), text.replacen(from, &to, 1), says)
    });
    let laughs = (1..20).fold("<!ENTITY e0 \"ha\">".to_owned(), |all, k| {
        format!("{all}<!ENTITY e{k} \"{}\">", format!("&e{};", k - 1).repeat(10))
    });
    let twice = |text: &str, line: &str| text.replacen(line, &format!("{line}{line}"), 1);
    let variable =
        r#"<ScalarVariable name="x" valueReference="0" causality="output"><Real/></ScalarVariable>"#;
    let whole = [
        ("deep elements", "<a>".repeat(100_000), "nested"),
        ("entities", format!(r#"<!DOCTYPE a [<!ENTITY b "{}">]><a>&b;</a>"#, "c".repeat(100)), "DTD"),
        ("entities of entities", format!("<!DOCTYPE a [{laughs}]><a>&e19;</a>"), "DTD"),
        (
            "a file as entity",
            r#"<!DOCTYPE a [<!ENTITY b SYSTEM "file:///etc/passwd">]><a>&b;</a>"#.into(),
            "DTD",
        ),
        ("another document", "<nothing/>".into(), "no FMU"),
        ("no end", TWO.replace("</fmiModelDescription>", ""), "xml"),
        ("a variable twice", twice(TWO, variable), "occurs twice"),
        ("model exchange only", TWO.replace("CoSimulation", "ModelExchange"), "model exchange"),
        (
            "scheduled execution only",
            THREE.replace("CoSimulation", "ScheduledExecution"),
            "scheduled execution",
        ),
    ];
    changes.chain(whole.into_iter().map(|(name, text, says)| (name.to_owned(), text, says)))
}

/// Replacements in a good description, and the words of the refusal.
fn changes() -> Vec<(&'static str, String, &'static str)> {
    let identifier = r#"modelIdentifier="m""#;
    let bad = [
        "$(touch evil)",
        "`touch evil`",
        "../../lib/evil",
        "/lib/evil",
        "..",
        ".m",
        "-m",
        "m\\m",
        "a;b",
        "a b",
        "",
    ];
    let mut all: Vec<_> =
        bad.map(|name| (identifier, format!(r#"modelIdentifier="{name}""#), "no identifier of C")).to_vec();
    let add = |variable: &str| format!("{variable}</ModelVariables>");
    let end = "</ModelVariables>\n<ModelStructure><Output ";
    let more = |variable: &str| format!("{}\n<ModelStructure><Output ", add(variable));
    let sides = |n: &str| {
        format!(
            r#"<Float64 name="y" valueReference="2">{}</Float64>"#,
            format!(r#"<Dimension start="{n}"/>"#).repeat(2)
        )
    };
    let plain = [
        (
            r#"valueReference="0" causality="output""#,
            r#"valueReference="-1" causality="output""#,
            "4294967295",
        ),
        (
            r#"valueReference="0" causality="output""#,
            r#"valueReference="18446744073709551616" causality="output""#,
            "4294967295",
        ),
        (r#"name="x""#, r#"name="""#, "empty name"),
        ("<Real/>", "<Quaternion/>", "no type"),
        ("<Real/>", r#"<Real start="one"/>"#, "numbers"),
        ("<Real/>", r#"<Real declaredType="nowhere"/>"#, "does not exist"),
        (r#"causality="output"><Real"#, r#"causality="boss"><Real"#, "causality"),
        (r#"index="1""#, r#"index="9""#, "9"),
        (r#"fmiVersion="2.0""#, r#"fmiVersion="7""#, "fmiVersion"),
        (r#" guid="g""#, "", "guid"),
        (r#" instantiationToken="g""#, "", "instantiationToken"),
    ];
    all.extend(plain.map(|(from, to, says)| (from, to.to_owned(), says)));
    all.extend([
        (end, more(&sides("4294967296")), "elements"),
        (end, more(&sides("18446744073709551615")), "elements"),
        (end, more(&sides("18446744073709551616")), ""),
        (end, more(r#"<Float64 name="y" valueReference="1"/>"#), "belongs to `x` already"),
        (end, more(r#"<Float64 name="x" valueReference="2"/>"#), "occurs twice"),
    ]);
    all
}

fn encodings(library: &[u8]) -> Vec<Case> {
    let utf16: Vec<u8> = TWO.encode_utf16().flat_map(u16::to_le_bytes).collect();
    let all = [
        ("UTF-16", utf16),
        ("UTF-16 by its mark", b"\xff\xfe<\0".to_vec()),
        ("no UTF-8", b"<a b=\"\xc3\x28\"/>".to_vec()),
    ];
    all.map(|(name, bytes)| Case::new(name, fmu(&bytes, library), "UTF-")).to_vec()
}
