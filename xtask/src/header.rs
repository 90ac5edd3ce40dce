//! `cargo xtask header [--check]`: writes `interfaces/plugin/include/terraglue.h` from the Rust definitions of the
//! C ABI, or checks that the file is up to date.

use cbindgen::{Builder, Config, DocumentationStyle, Language, Style};
use std::path::{Path, PathBuf};

/// Files of the ABI in the order in which the header shows them.
const SOURCES: [&str; 8] = ["constants", "step", "variable", "scene", "law", "host", "sight", "table"];

const PROLOGUE: &str = include_str!("header_prologue.txt");
const EPILOGUE: &str = include_str!("header_epilogue.txt");

/// Writes the header, or with `check` compares it. The error explains the remedy.
pub fn run(check: bool) -> Result<(), String> {
    let path = interface().join("include/terraglue.h");
    let fresh = generate()?;
    let now = std::fs::read_to_string(&path).unwrap_or_default();
    if now == fresh {
        return Ok(());
    }
    if check {
        return Err(format!(
            "{} is not what the Rust definitions say: run `cargo xtask header`",
            path.display()
        ));
    }
    let folder = path.parent().ok_or("the header has no folder")?;
    std::fs::create_dir_all(folder)
        .and_then(|()| std::fs::write(&path, fresh))
        .map_err(|e| format!("{}: {e}", path.display()))
}

fn interface() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../interfaces/plugin")
}

/// Text of the header.
fn generate() -> Result<String, String> {
    let sources = SOURCES.map(|name| interface().join("src/abi").join(name).with_extension("rs"));
    let mut config = Config {
        language: Language::C,
        cpp_compat: true,
        header: Some(PROLOGUE.trim_end().into()),
        trailer: Some(EPILOGUE.trim_end().into()),
        no_includes: true,
        sys_includes: vec!["stddef.h".into(), "stdint.h".into()],
        documentation_style: DocumentationStyle::C,
        style: Style::Type,
        usize_is_size_t: true,
        line_length: 100,
        tab_width: 4,
        ..Config::default()
    };
    for source in &sources {
        let text = std::fs::read_to_string(source).map_err(|e| format!("{}: {e}", source.display()))?;
        for name in type_names(&text) {
            config.export.rename.insert(name.into(), snake_case(name));
            config.export.include.push(name.into());
        }
    }
    let builder = sources.iter().fold(Builder::new().with_config(config), |b, s| b.with_src(s));
    let mut bytes = Vec::new();
    builder.generate().map_err(|e| format!("the definitions of the ABI: {e}"))?.write(&mut bytes);
    let text = String::from_utf8(bytes).map_err(|e| e.to_string())?;
    Ok(short_comments(&text))
}

/// Names of the types that a source file of the ABI defines; the type of the entry is spelled out in the epilogue.
fn type_names(source: &str) -> impl Iterator<Item = &str> {
    source
        .lines()
        .filter_map(|l| l.strip_prefix("pub struct ").or_else(|| l.strip_prefix("pub type ")))
        .filter_map(|rest| rest.split([' ', '{', '=', '<']).next())
        .filter(|name| *name != "TgEntry")
}

/// `TgFieldTile` → `tg_field_tile`.
fn snake_case(name: &str) -> String {
    let mut out = String::new();
    for (k, c) in name.chars().enumerate() {
        if c.is_ascii_uppercase() && k > 0 {
            out.push('_');
        }
        out.push(c.to_ascii_lowercase());
    }
    out
}

/// Comments without lines that hold nothing but `/*` and `*/`.
fn short_comments(text: &str) -> String {
    let (mut out, mut lines) = (String::new(), text.lines().peekable());
    while let Some(line) = lines.next() {
        let indent = &line[..line.len() - line.trim_start().len()];
        if line.trim() != "/*" {
            out.extend([line, "\n"]);
            continue;
        }
        let comment: Vec<&str> = lines.by_ref().map(str::trim).take_while(|l| *l != "*/").collect();
        out.extend([indent, "/* ", &comment.join(&format!("\n{indent} * ")).replace("* \n", "*\n"), " */\n"]);
        // A constant and its comment stand without a gap to the next ones.
        if let Some(next) = lines.peek().filter(|l| l.starts_with("#define")).copied() {
            out.extend([next, "\n"]);
            lines.next();
            lines.next_if(|l| l.is_empty());
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_header_is_fresh() {
        run(true).expect("include/terraglue.h is fresh");
    }

    #[test]
    fn names_become_those_of_c() {
        assert_eq!(snake_case("TgFieldTile"), "tg_field_tile");
        let names: Vec<_> =
            type_names("pub struct TgA {\npub type TgB = i32;\npub type TgEntry = x;").collect();
        assert_eq!(names, ["TgA", "TgB"]);
    }

    #[test]
    fn every_file_of_the_abi_is_in_the_header() {
        let folder = interface().join("src/abi");
        for entry in std::fs::read_dir(folder).expect("folder of the ABI").flatten() {
            let stem = entry.path().file_stem().and_then(|s| s.to_str().map(String::from)).expect("name");
            assert!(SOURCES.contains(&stem.as_str()) || stem == "mod" || stem == "layout", "{stem}");
        }
    }
}
