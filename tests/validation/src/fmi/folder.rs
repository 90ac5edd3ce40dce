//! The FMUs in `TERRAGLUE_FMU_DIR`, in any subfolder: the Modelica Reference FMUs with their tables `NAME_out.csv`, and those of
//! other tools.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Why there is no figure.
pub const NOT_SET: &str = "TERRAGLUE_FMU_DIR is not set";

/// Reference FMUs that have no table of their own.
const WITHOUT_TABLE: [&str; 2] = ["Clocks", "Roberts"];

/// Files of the folder, in the order of the paths.
pub struct Fmus {
    /// Reference FMUs.
    pub reference: Vec<PathBuf>,
    /// Tables of the reference FMUs by name.
    pub tables: BTreeMap<String, PathBuf>,
    /// All other FMUs.
    pub third_party: Vec<PathBuf>,
}

/// The FMUs of the folder, where it is set.
pub fn fmus() -> Option<Fmus> {
    std::env::var_os("TERRAGLUE_FMU_DIR").map(|folder| below(Path::new(&folder)))
}

fn below(folder: &Path) -> Fmus {
    let mut files = Vec::new();
    collect(folder, &mut files);
    files.sort();
    let is = |p: &Path, e: &str| p.extension().is_some_and(|x| x == e);
    let tables: BTreeMap<String, PathBuf> = files
        .iter()
        .filter(|p| is(p, "csv"))
        .filter_map(|p| Some((stem(p).strip_suffix("_out")?.to_owned(), p.clone())))
        .collect();
    let known = |p: &PathBuf| tables.contains_key(&stem(p)) || WITHOUT_TABLE.contains(&stem(p).as_str());
    let all = files.into_iter().filter(|p| is(p, "fmu"));
    let (reference, third_party) = all.partition(known);
    Fmus { reference, tables, third_party }
}

/// Name of a file without its extension.
pub fn stem(path: &Path) -> String {
    path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default()
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() { collect(&path, files) } else { files.push(path) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fmus_with_a_table_are_reference_fmus() {
        let folder = tempfile::tempdir().expect("a folder");
        let names = ["a/Stair.fmu", "tables/Stair_out.csv", "Clocks.fmu", "b/pump.fmu", "b/readme.md"];
        for name in names {
            crate::process::write(&folder.path().join(name), "").expect("a file");
        }
        let fmus = below(folder.path());
        let stems = |all: &[PathBuf]| all.iter().map(|p| stem(p)).collect::<Vec<_>>();
        assert_eq!(
            (stems(&fmus.reference), stems(&fmus.third_party)),
            (vec!["Clocks".into(), "Stair".into()], vec!["pump".into()])
        );
        assert!(fmus.tables["Stair"].ends_with("tables/Stair_out.csv"));
    }
}
