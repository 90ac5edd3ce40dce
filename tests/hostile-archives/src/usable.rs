//! Odd but legal FMUs: they run.

use crate::descriptions::{THREE, TWO, entries, fmu, with};
use crate::zip::{Entry, archive, stored};
use crate::{Case, LIBRARIES};

/// Variables of the case that has many.
pub const MANY: usize = 20_000;

/// All of them; the last has [`MANY`] variables more.
#[must_use]
pub fn usable(library: &[u8]) -> Vec<Case> {
    let alias = r#"<ScalarVariable name="y" valueReference="0" causality="output"><Real/></ScalarVariable></ModelVariables>"#;
    let foreign = r#" guid="g" xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" xsi:n="m""#;
    let notes =
        r#"<VendorAnnotations><Tool name="t"><x:y xmlns:x="u"/></Tool></VendorAnnotations><ModelStructure>"#;
    let named = r#"causality="output"><Alias name="z"/></Float64>"#;
    let described = [
        ("plain", TWO.to_owned()),
        ("plain, FMI 3.0", THREE.to_owned()),
        ("two names of one value", TWO.replacen("</ModelVariables>", alias, 1)),
        ("two names of one value, FMI 3.0", THREE.replacen(r#"causality="output"/>"#, named, 1)),
        ("foreign namespaces", TWO.replacen(r#" guid="g""#, foreign, 1)),
        ("annotations of a tool", TWO.replacen("<ModelStructure>", notes, 1)),
        ("a byte order mark", format!("\u{feff}{TWO}")),
    ];
    let mut all: Vec<Case> = described
        .into_iter()
        .map(|(name, text)| Case::new(name, fmu(text.as_bytes(), library), ""))
        .collect();
    let folders =
        ["./", "resources/", "binaries/"].map(|name| stored(name, b"").with(|e| e.mode = 0o040_755));
    all.push(Case::new("entries of folders", with(library, folders), ""));
    let twice = [Entry::file("resources/a", b"x"), Entry::file("resources/a", b"x")];
    all.push(Case::new("a file listed twice", with(library, twice), ""));
    all.extend(["tank-c", "2tank", "tank.v1"].map(|name| identified(name, library)));
    all.push(Case::new("20 000 variables", fmu(many().as_bytes(), library), ""));
    all
}

/// A file name that is no identifier of C.
fn identified(name: &str, library: &[u8]) -> Case {
    let text = TWO.replacen(r#"modelIdentifier="m""#, &format!(r#"modelIdentifier="{name}""#), 1);
    let mut all = entries(text.as_bytes(), library);
    for entry in &mut all {
        let renamed = LIBRARIES.iter().find(|own| own.as_bytes() == entry.name);
        if let Some(own) = renamed {
            entry.name = own.replace("m.so", &format!("{name}.so")).into_bytes();
        }
    }
    Case::new(format!("the name {name}"), archive(&all), "")
}

fn many() -> String {
    let variable = |k: usize| {
        format!("<ScalarVariable name=\"v{k}\" valueReference=\"{}\"><Real/></ScalarVariable>\n", k + 1)
    };
    let all: String = (0..MANY).map(variable).collect();
    TWO.replacen("</ModelVariables>", &format!("{all}</ModelVariables>"), 1)
}
