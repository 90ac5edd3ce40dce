//! `cargo xtask architecture`: the table and the drawing of the crates in `docs/architecture.md`, from their manifests.
//!
//! A crate stands one floor above the highest of those that it uses, so every arrow of the drawing runs down. The shape of the code
//! (cycles of files, large types, long functions) is checked as well.

use crate::shape;
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::path::Path;
use xtask_start::process::{Outcome, between, cargo, read, root, write};

/// Folders whose crates are drawn.
const HOUSE: [&str; 3] = ["interfaces", "modules", "coordinator"];
/// Most floors of the house.
const MOST_FLOORS: usize = 8;
/// Most lines of source of a crate, tests included.
const MOST_LINES: usize = 10_000;

/// A crate of the workspace.
struct Room {
    folder: String,
    sentence: String,
    /// Names of the crates of the house that it uses.
    uses: BTreeSet<String>,
    lines: usize,
}

type Rooms = BTreeMap<String, Room>;

/// Writes the generated parts of the page; with `check` fails where they differ.
pub fn run(check: bool) -> Outcome {
    let rooms = rooms()?;
    let floors = floors(&rooms)?;
    limits(&rooms, &floors)?;
    shapes(&rooms)?;
    let path = root().join("docs/architecture.md");
    let page = read(&path)?;
    let fresh = replaced(&page, "crates", &table(&rooms, &floors))?;
    let fresh = replaced(&fresh, "drawing", &drawing(&rooms, &floors))?;
    match (check, fresh == page) {
        (_, true) => Ok(()),
        (true, false) => Err("docs/architecture.md is out of date: cargo xtask architecture".into()),
        (false, false) => write(&path, &fresh),
    }
}

fn rooms() -> Outcome<Rooms> {
    let output = cargo(&["metadata", "--no-deps", "--format-version", "1", "--offline"])
        .output()
        .map_err(|e| format!("cargo metadata: {e}"))?;
    let metadata: Value =
        serde_json::from_slice(&output.stdout).map_err(|e| format!("cargo metadata: {e}"))?;
    let packages = metadata["packages"].as_array().ok_or("cargo metadata lists no packages")?;
    let mut rooms: Rooms = packages.iter().filter_map(room).collect();
    let names: BTreeSet<String> = rooms.keys().cloned().collect();
    rooms.values_mut().for_each(|room| room.uses.retain(|name| names.contains(name)));
    Ok(rooms)
}

fn room(package: &Value) -> Option<(String, Room)> {
    let manifest = Path::new(package["manifest_path"].as_str()?);
    let folder = manifest.parent()?.strip_prefix(root().canonicalize().ok()?).ok()?;
    let folder = folder.to_str()?.to_owned();
    let inside = HOUSE.iter().any(|h| folder == *h || folder.starts_with(&format!("{h}/")));
    // thin libraries that only export a module
    if !inside || folder.ends_with("/plugin") && folder.starts_with("modules") {
        return None;
    }
    let dependencies = package["dependencies"].as_array()?;
    let used = dependencies.iter().filter(|d| d["kind"].is_null());
    let uses = used.filter_map(|d| d["name"].as_str().map(str::to_owned)).collect();
    let sentence = package["description"].as_str().unwrap_or_default().to_owned();
    let lines = lines_below(&root().join(&folder).join("src"));
    Some((package["name"].as_str()?.to_owned(), Room { folder, sentence, uses, lines }))
}

fn lines_below(folder: &Path) -> usize {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let lines = |path: &Path| match path.is_dir() {
        true => lines_below(path),
        false if path.extension().is_some_and(|e| e == "rs") => {
            std::fs::read_to_string(path).map_or(0, |text| text.lines().count())
        }
        false => 0,
    };
    entries.map(|entry| lines(&entry.path())).sum()
}

/// Floor of every crate, from 1.
fn floors(rooms: &Rooms) -> Outcome<BTreeMap<&str, usize>> {
    let mut floors: BTreeMap<&str, usize> = BTreeMap::new();
    while floors.len() < rooms.len() {
        let known = floors.len();
        for (name, room) in rooms {
            let below: Option<Vec<usize>> =
                room.uses.iter().map(|used| floors.get(used.as_str()).copied()).collect();
            if let Some(below) = below {
                floors.insert(name, below.into_iter().max().unwrap_or(0) + 1);
            }
        }
        if floors.len() == known {
            return Err("the crates use each other in a circle".into());
        }
    }
    Ok(floors)
}

fn limits(rooms: &Rooms, floors: &BTreeMap<&str, usize>) -> Outcome {
    let top = floors.values().copied().max().unwrap_or(0);
    if top > MOST_FLOORS {
        return Err(format!("the house has {top} floors, more than {MOST_FLOORS}"));
    }
    for (name, room) in rooms {
        if room.lines > MOST_LINES {
            return Err(format!("{name} has {} lines, more than {MOST_LINES}: split it", room.lines));
        }
        let allowed = |used: &&String| {
            let used = &rooms[used.as_str()].folder;
            let family = |folder: &str| folder.split('/').take(2).collect::<Vec<_>>().join("/");
            match () {
                () if room.folder.starts_with("interfaces") => used.starts_with("interfaces"),
                () if room.folder.starts_with("modules") => {
                    used.starts_with("interfaces") || family(used) == family(&room.folder)
                }
                () => true,
            }
        };
        if let Some(used) = room.uses.iter().find(|used| !allowed(used)) {
            return Err(format!("{name} must not use {used}"));
        }
    }
    Ok(())
}

/// Cycles of files, large types and long functions, of the crates of the house, of the validators and of these commands.
fn shapes(rooms: &Rooms) -> Outcome {
    let others = ["tests/validation", "xtask", "xtask/start"].map(str::to_owned);
    let folders: Vec<String> = rooms.values().map(|room| room.folder.clone()).chain(others).collect();
    let known = read(&root().join("tests/known-shapes.tsv"))?;
    let complaints = shape::complaints(&root(), &folders, &known)?;
    if complaints.is_empty() { Ok(()) } else { Err(complaints.join("\n       ")) }
}

fn table(rooms: &Rooms, floors: &BTreeMap<&str, usize>) -> String {
    let mut order: Vec<(&String, &Room)> = rooms.iter().collect();
    order.sort_by_key(|(name, room)| (std::cmp::Reverse(floors[name.as_str()]), room.folder.clone()));
    let mut text = String::from("| floor | folder | what | uses |\n|---|---|---|---|\n");
    for (name, room) in order {
        let uses: Vec<&str> = room.uses.iter().map(|used| short(used)).collect();
        let floor = floors[name.as_str()];
        // a `String` takes everything that is written into it
        let _ = writeln!(text, "| {floor} | `{}` | {} | {} |", room.folder, room.sentence, uses.join(", "));
    }
    text
}

/// A name without the prefix that all share.
fn short(name: &str) -> &str {
    name.strip_prefix("terraglue-").unwrap_or(name)
}

fn drawing(rooms: &Rooms, floors: &BTreeMap<&str, usize>) -> String {
    let mut text = String::from("```mermaid\nflowchart TD\n");
    let top = floors.values().copied().max().unwrap_or(0);
    for floor in (1..=top).rev() {
        let _ = writeln!(text, "  subgraph floor{floor}[\"floor {floor}\"]");
        for name in rooms.keys().filter(|name| floors[name.as_str()] == floor) {
            let _ = writeln!(text, "    {name}[{}]", short(name));
        }
        text.push_str("  end\n");
    }
    for (name, room) in rooms {
        for used in room.uses.iter().filter(|used| !is_implied(rooms, room, used)) {
            let _ = writeln!(text, "  {name} --> {used}");
        }
    }
    text + "```\n"
}

/// Whether a crate reaches another one through a third, too: such an arrow is not drawn.
fn is_implied(rooms: &Rooms, room: &Room, used: &str) -> bool {
    room.uses.iter().filter(|other| other.as_str() != used).any(|other| reaches(rooms, other, used))
}

fn reaches(rooms: &Rooms, from: &str, to: &str) -> bool {
    from == to || rooms[from].uses.iter().any(|next| reaches(rooms, next, to))
}

/// The page with the text between the marks of that name replaced.
fn replaced(page: &str, name: &str, text: &str) -> Outcome<String> {
    let marks = (format!("<!-- {name}: begin -->\n"), format!("<!-- {name}: end -->"));
    let fresh = between(page, (&marks.0, &marks.1), text);
    fresh.ok_or_else(|| format!("docs/architecture.md has no marks `{name}`"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn house(arrows: &[(&str, &[&str])]) -> Rooms {
        let room = |folder: &str, uses: &[&str]| Room {
            folder: folder.to_owned(),
            sentence: String::new(),
            uses: uses.iter().map(|u| (*u).to_owned()).collect(),
            lines: 1,
        };
        arrows.iter().map(|(folder, uses)| ((*folder).to_owned(), room(folder, uses))).collect()
    }

    #[test]
    fn arrows_run_down() {
        run(true).expect("docs/architecture.md is fresh");
    }

    #[test]
    fn a_crate_stands_above_all_that_it_uses() {
        let rooms = house(&[("coordinator/a", &["interfaces/b"]), ("interfaces/b", &[])]);
        let floors = floors(&rooms).expect("no circle");
        assert_eq!((floors["interfaces/b"], floors["coordinator/a"]), (1, 2));
        limits(&rooms, &floors).expect("allowed");
    }

    #[test]
    fn circles_and_arrows_between_families_are_refused() {
        let circle = house(&[("coordinator/a", &["coordinator/b"]), ("coordinator/b", &["coordinator/a"])]);
        assert!(floors(&circle).is_err());
        let across = house(&[("modules/soil/a", &["modules/gait"]), ("modules/gait", &[])]);
        assert!(limits(&across, &floors(&across).expect("no circle")).is_err());
        let up = house(&[("interfaces/a", &["modules/gait"]), ("modules/gait", &[])]);
        assert!(limits(&up, &floors(&up).expect("no circle")).is_err());
    }
}
