//! The shape of the code that `cargo xtask architecture` holds: no cycle of files inside a crate, no type of too many fields or methods,
//! no function of too many lines, no two types of one name in a crate. It reads lines as rustfmt leaves them.
//!
//! `tests/known-shapes.tsv` lists everything beyond a bound with its number, which may only fall.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Most fields of a type, most methods over all its `impl`s, most lines of a function, and most types of one name in a crate.
const MOST: [(&str, usize); 4] = [("fields", 25), ("methods", 40), ("lines", 60), ("types of one name", 1)];

/// Words before `fn`. The third is put together because a test looks for that word in code.
const QUALIFIERS: [&str; 6] = ["pub", "const", concat!("un", "safe"), "extern", "\"C\"", "async"];

/// Findings beyond their bounds: kind and name, and how many.
pub type Findings = BTreeMap<(String, String), usize>;

/// A source file without its tests.
struct Source {
    /// Relative to the crate's `src`.
    path: PathBuf,
    lines: Vec<String>,
}

/// Complaints about the sources of crates (folders relative to `root`) apart from the known shapes.
pub fn complaints(root: &Path, crates: &[String], known: &str) -> Result<Vec<String>, String> {
    let known = parsed(known)?;
    let found = findings(root, crates);
    let names: BTreeSet<_> = known.keys().chain(found.keys()).collect();
    let complaint = |name: &(String, String)| {
        let ((kind, of), now, before) = (name, found.get(name), known.get(name));
        match (now, before) {
            (Some(now), None) => Some(format!("{of}: {now} {kind}, more than is allowed: divide it")),
            (Some(now), Some(before)) if now > before => Some(format!("{of}: {now} {kind}, {before} before")),
            (now, Some(before)) if now != Some(before) => Some(format!(
                "{of}: {} {kind} now: say so in tests/known-shapes.tsv, or take it out",
                now.map_or("few".to_owned(), usize::to_string)
            )),
            _ => None,
        }
    };
    Ok(names.into_iter().filter_map(complaint).collect())
}

/// Rows: kind, name, number; after a header line.
fn parsed(text: &str) -> Result<Findings, String> {
    let row = |line: &str| {
        let mut cells = line.split('\t').map(str::to_owned);
        Some(((cells.next()?, cells.next()?), cells.next()?.parse().ok()?))
    };
    let rows = text.lines().skip(1);
    rows.map(|line| row(line).ok_or_else(|| format!("tests/known-shapes.tsv: `{line}`"))).collect()
}

/// All that is beyond its bound.
pub fn findings(root: &Path, crates: &[String]) -> Findings {
    let mut all = Findings::new();
    for folder in crates {
        let sources = sources(&root.join(folder).join("src"));
        let mut counts = functions(&sources);
        counts.extend(namesakes(&sources));
        // modules of tests have types of one name for each case
        counts.extend(if folder.starts_with("tests") { Findings::new() } else { types(&sources) });
        for ((kind, name), count) in counts {
            if MOST.iter().any(|(k, most)| *k == kind && count > *most) {
                all.insert((kind, format!("{folder} {name}")), count);
            }
        }
        let cyclic = files_in_cycles(&sources);
        if cyclic > 0 {
            all.insert(("files in cycles".to_owned(), folder.clone()), cyclic);
        }
    }
    all
}

/// Every file below a folder, without modules of tests.
fn sources(folder: &Path) -> Vec<Source> {
    let (mut found, mut open) = (Vec::new(), vec![folder.to_owned()]);
    while let Some(place) = open.pop() {
        for path in std::fs::read_dir(&place).into_iter().flatten().flatten().map(|e| e.path()) {
            let is_test = path.file_stem().is_some_and(|n| n == "tests");
            if path.is_dir() && !is_test {
                open.push(path);
            } else if !is_test && path.extension().is_some_and(|e| e == "rs") {
                let text = std::fs::read_to_string(&path).unwrap_or_default();
                let own = text.split("\n#[cfg(test)]\nmod tests {").next().unwrap_or_default();
                let lines = own.lines().map(str::to_owned).collect();
                let path = path.strip_prefix(folder).unwrap_or(&path).to_owned();
                found.push(Source { path, lines });
            }
        }
    }
    found.sort_by(|a, b| a.path.cmp(&b.path));
    found
}

fn indent(line: &str) -> usize {
    line.len() - line.trim_start().len()
}

/// The name behind `fn` where a line begins a function.
fn function_name(line: &str) -> Option<&str> {
    let mut words = line.split_whitespace();
    let before = |w: &&str| QUALIFIERS.contains(w) || w.starts_with("pub(");
    let word = words.find(|w| !before(w))?;
    let name = words.next().filter(|_| word == "fn")?;
    name.split(['(', '<']).next()
}

/// Lines of each function, by file and name.
fn functions(sources: &[Source]) -> Findings {
    let mut all = Findings::new();
    for source in sources {
        for (k, line) in source.lines.iter().enumerate() {
            let Some(name) = function_name(line) else { continue };
            let ends = |other: &String| {
                indent(other) == indent(line) && (other.trim() == "}" || other.trim_end().ends_with(';'))
            };
            let one_line = line.trim_end().ends_with(['}', ';']);
            let length = if one_line { 0 } else { source.lines[k + 1..].iter().position(ends).unwrap_or(0) };
            let key = ("lines".to_owned(), format!("{} {name}", source.path.display()));
            let longest = all.entry(key).or_default();
            *longest = (*longest).max(length + 2);
        }
    }
    all
}

/// Fields, and methods over all `impl`s, of each type; types of one name in one crate count as one.
fn types(sources: &[Source]) -> Findings {
    let mut all = Findings::new();
    let lines = sources.iter().flat_map(|s| &s.lines);
    let mut inside: Option<(&str, String, usize)> = None;
    for line in lines {
        if let Some((kind, name, at)) = &inside {
            let deeper = indent(line) == at + 4;
            let counts = match *kind {
                "fields" => deeper && is_field(line),
                _ => deeper && function_name(line).is_some(),
            };
            if counts {
                *all.entry(((*kind).to_owned(), name.clone())).or_default() += 1;
            }
            if indent(line) == *at && line.trim_start().starts_with('}') {
                inside = None;
            }
        } else if line.ends_with('{') {
            inside = opened(line).map(|(kind, name)| (kind, name, indent(line)));
        }
    }
    all
}

/// How many files of a crate declare a type of each name.
fn namesakes(sources: &[Source]) -> Findings {
    let mut all = Findings::new();
    for source in sources {
        let names: BTreeSet<&str> = source.lines.iter().filter_map(|line| declared(line)).collect();
        for name in names {
            *all.entry(("types of one name".to_owned(), name.to_owned())).or_default() += 1;
        }
    }
    all
}

/// The name of a type where a line begins its declaration. An alias stands for another type and counts as none.
fn declared(line: &str) -> Option<&str> {
    let mut words = line.split_whitespace().skip_while(|w| w.starts_with("pub"));
    words.next().filter(|w| ["struct", "enum", "trait", "union"].contains(w))?;
    words.next()?.split(|c: char| !c.is_alphanumeric() && c != '_').next()
}

fn is_field(line: &str) -> bool {
    let text = line.trim_start();
    let text = text.strip_prefix("pub ").or_else(|| text.split_once(") ").map(|t| t.1)).unwrap_or(text);
    let name: String = text.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
    !name.is_empty() && text[name.len()..].starts_with(": ")
}

/// The type whose fields or methods follow.
fn opened(line: &str) -> Option<(&'static str, String)> {
    let text = line.trim();
    let word = |text: &str| -> String {
        let name = text.trim_start_matches(['&', '(']).rsplit("::").next().unwrap_or_default();
        name.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect()
    };
    let declared = text.strip_prefix("pub ").unwrap_or(text);
    if let Some((_, rest)) = declared.split_once("struct ").filter(|(before, _)| before.len() < 12) {
        return Some(("fields", word(rest)));
    }
    let rest = text.strip_prefix("impl")?;
    let rest = if rest.starts_with('<') { without_generics(rest) } else { rest };
    let rest = rest.split(" for ").last().unwrap_or(rest).trim();
    let head = rest.split(['<', ' ']).next().unwrap_or_default();
    Some(("methods", word(head)))
}

/// The text after the generics that it begins with.
fn without_generics(text: &str) -> &str {
    let mut depth = 0;
    for (k, c) in text.char_indices() {
        depth += i32::from(c == '<') - i32::from(c == '>' && !text[..k].ends_with('-'));
        if depth == 0 {
            return &text[k + 1..];
        }
    }
    text
}

/// Path of the module of a file: `a/mod.rs` and `a.rs` are `a`.
fn module_of(path: &Path) -> Vec<String> {
    let mut parts: Vec<String> =
        path.with_extension("").iter().map(|p| p.to_string_lossy().into_owned()).collect();
    if parts.last().is_some_and(|p| matches!(p.as_str(), "mod" | "lib" | "main")) {
        parts.pop();
    }
    parts
}

/// Number of files that lie on a cycle of uses. A module and those inside it are one thing: uses of the modules above a file, or of
/// those inside it, do not count.
fn files_in_cycles(sources: &[Source]) -> usize {
    let modules: Vec<Vec<String>> = sources.iter().map(|s| module_of(&s.path)).collect();
    let arrows: Vec<BTreeSet<usize>> =
        sources.iter().zip(&modules).map(|(s, m)| uses(s, m, &modules)).collect();
    let reaches = |from: usize| {
        let (mut seen, mut open) = (BTreeSet::new(), arrows[from].iter().copied().collect::<Vec<_>>());
        while let Some(next) = open.pop() {
            if seen.insert(next) {
                open.extend(&arrows[next]);
            }
        }
        seen
    };
    (0..sources.len()).filter(|k| reaches(*k).contains(k)).count()
}

/// The files that a file names by `crate::` and `super::`.
fn uses(source: &Source, own: &[String], modules: &[Vec<String>]) -> BTreeSet<usize> {
    let mut found = BTreeSet::new();
    let code = source.lines.iter().map(|line| line.split("//").next().unwrap_or_default());
    let text = code.collect::<Vec<_>>().join("\n");
    let starts = text.match_indices("crate::").chain(text.match_indices("super::"));
    let starts = starts.filter(|(start, _)| !text[..*start].ends_with("super::"));
    for path in starts.flat_map(|(start, _)| paths(&text[start..])) {
        let mut at = if path.starts_with("crate") { Vec::new() } else { own.to_vec() };
        for part in path.split("::").filter(|p| !p.is_empty()) {
            match part {
                "crate" => {}
                "super" => drop(at.pop()),
                part => at.push(part.to_owned()),
            }
        }
        // the deepest module that the path goes through
        let target = (0..=at.len()).rev().find_map(|n| modules.iter().position(|m| *m == at[..n]));
        let apart = |m: &[String]| !own.starts_with(m) && !m.starts_with(own);
        found.extend(target.filter(|k| apart(&modules[*k])));
    }
    found
}

/// The paths at the head of a text: one, or those of a group in braces.
fn paths(text: &str) -> Vec<String> {
    let end = text.find(|c: char| !c.is_alphanumeric() && c != '_' && c != ':').unwrap_or(text.len());
    let (stem, rest) = text.split_at(end);
    let Some(group) = rest.strip_prefix('{').filter(|_| stem.ends_with("::")) else {
        return vec![stem.to_owned()];
    };
    let (mut all, mut depth, mut first) = (Vec::new(), 0, 0);
    for (k, c) in group.char_indices() {
        if depth == 0 && matches!(c, ',' | '}') {
            all.extend(paths(group[first..k].trim()).into_iter().map(|path| format!("{stem}{path}")));
            first = k + 1;
        }
        match c {
            '}' if depth == 0 => break,
            '}' => depth -= 1,
            '{' => depth += 1,
            _ => {}
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    fn source(path: &str, text: &str) -> Source {
        Source { path: path.into(), lines: text.lines().map(str::to_owned).collect() }
    }

    #[test]
    fn fields_methods_and_lines_are_counted() {
        let text = "pub struct A<T> {\n    /// x: y\n    pub a: T,\n    pub(crate) b: u8,\n}\nimpl<T: Fn() -> u8> Clone for A<T> {\n    \
                    fn clone(&self) -> Self {\n        one();\n        two()\n    }\n}\nimpl A<u8> {\n    pub const fn b(&self) {}\n}\n";
        let sources = [source("a.rs", text)];
        let of = |kind: &str, name: &str| (kind.to_owned(), name.to_owned());
        let types = types(&sources);
        assert_eq!((types[&of("fields", "A")], types[&of("methods", "A")]), (2, 2));
        assert_eq!(functions(&sources)[&of("lines", "a.rs clone")], 4);
    }

    #[test]
    fn types_of_one_name_are_counted_by_file() {
        let sources = [
            source("a.rs", "pub(crate) struct A<T> {\nimpl A<u8> {\nenum B {"),
            source("b.rs", "    pub enum A {\ntype B = u8;\npersist!(struct B"),
        ];
        let of = |name: &str| namesakes(&sources)[&("types of one name".to_owned(), name.to_owned())];
        assert_eq!((of("A"), of("B")), (2, 1));
    }

    #[test]
    fn cycles_are_found_between_files_that_do_not_hold_each_other() {
        let cycle = [
            source("lib.rs", "mod a;\nmod b;\nuse a::A;"),
            source("a.rs", "use crate::b::B;"),
            source("b/mod.rs", "mod c;\nuse super::a::A;"),
            source("b/c.rs", "use super::B;\nuse crate::Top;"),
        ];
        assert_eq!(files_in_cycles(&cycle), 2);
        assert_eq!(files_in_cycles(&cycle[..2]), 0);
    }

    #[test]
    fn a_group_in_braces_names_each_of_its_files() {
        assert_eq!(paths("super::{a::{B, self}, c::D}; x"), ["super::a::B", "super::a::self", "super::c::D"]);
        let grouped = source("a.rs", "use super::{\n    Top,\n    b::B,\n};");
        assert_eq!(files_in_cycles(&[grouped, source("b.rs", "use crate::a::A;")]), 2);
    }

    #[test]
    fn numbers_may_only_fall() {
        let known = |number: usize| format!("kind\tname\tnumber\nlines\tsrc f\t{number}\n");
        let folder = std::env::temp_dir().join(format!("terraglue-shape-{}", std::process::id()));
        std::fs::create_dir_all(folder.join("a/src")).expect("a folder");
        let long = format!("fn f() {{\n{}}}\n", "    x();\n".repeat(70));
        std::fs::write(folder.join("a/src/lib.rs"), long).expect("a file");
        let said = |number: usize| {
            let known = known(number).replace("src f", "a lib.rs f");
            complaints(&folder, &["a".to_owned()], &known).expect("reads").len()
        };
        assert_eq!([said(71), said(72), said(73)], [1, 0, 1]);
        std::fs::remove_dir_all(&folder).expect("removed");
    }
}
