//! Search path of modules.

use super::python;
use std::path::{Path, PathBuf};

/// Folders in the order in which they are searched.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SearchPath {
    folders: Vec<PathBuf>,
}

impl SearchPath {
    /// These folders and no others.
    pub fn only(folders: Vec<PathBuf>) -> Self {
        Self { folders }
    }

    /// `module_path` (the option `--module-path`), `TERRAGLUE_MODULE_PATH`, the scenario's folder, the user's
    /// folder, and beside the program: `deps`, its own folder, `../lib/terraglue`. `deps` comes before the
    /// folder itself because cargo's copy beside the program can be stale.
    pub fn standard(module_path: &[PathBuf], scenario_folder: &Path) -> Self {
        let mut folders = module_path.to_vec();
        if let Some(paths) = std::env::var_os("TERRAGLUE_MODULE_PATH") {
            folders.extend(std::env::split_paths(&paths).filter(|p| !p.as_os_str().is_empty()));
        }
        folders.push(if scenario_folder.as_os_str().is_empty() {
            ".".into()
        } else {
            scenario_folder.into()
        });
        folders.extend(user_folder());
        if let Some(exe) = std::env::current_exe().ok().and_then(|e| e.parent().map(Path::to_path_buf)) {
            folders.extend([exe.join("deps"), exe.clone(), exe.join("../lib/terraglue")]);
        }
        let mut unique: Vec<PathBuf> = Vec::with_capacity(folders.len());
        for folder in folders {
            if !unique.contains(&folder) {
                unique.push(folder);
            }
        }
        Self { folders: unique }
    }

    /// The folders.
    pub fn folders(&self) -> &[PathBuf] {
        &self.folders
    }

    /// The first file of a module of this name.
    pub fn locate(&self, name: &str) -> Option<PathBuf> {
        let [library, source] = [file_name(name), python_name(name)];
        self.folders.iter().find_map(|f| {
            let found = Some(f.join(&library)).filter(|p| p.is_file());
            found.or_else(|| Some(f.join(&source)).filter(|p| python::describes_module(p)))
        })
    }

    /// All modules that can be found, by name; the first of each name as `locate` would find it.
    pub(super) fn all(&self) -> Vec<(String, PathBuf)> {
        let mut first = self.every();
        first.dedup_by(|later, earlier| later.0 == earlier.0);
        first
    }

    /// All files of modules, by name, those of one name in the order of the search.
    pub(super) fn every(&self) -> Vec<(String, PathBuf)> {
        let mut found: Vec<(String, PathBuf)> = Vec::new();
        for entry in self.folders.iter().filter_map(|f| std::fs::read_dir(f).ok()).flatten().flatten() {
            if let Some(name) = entry.file_name().to_str().and_then(module_name) {
                found.push((name, entry.path()));
            }
            let path = entry.path();
            if let Some(stem) = path.file_stem().and_then(|s| s.to_str())
                && python::describes_module(&path)
            {
                found.push((stem.replace('_', "-"), path));
            }
        }
        // Stable: the order of the search stays among files of one name.
        found.sort_by(|a, b| a.0.cmp(&b.0));
        found
    }
}

/// `soil-bekker` → `libsoil_bekker_plugin.so`.
pub(super) fn file_name(module: &str) -> String {
    format!(
        "{}{}_plugin{}",
        std::env::consts::DLL_PREFIX,
        module.replace('-', "_"),
        std::env::consts::DLL_SUFFIX
    )
}

/// `my-soil` → `my_soil.py`.
pub(super) fn python_name(module: &str) -> String {
    format!("{}.py", module.replace('-', "_"))
}

/// `libsoil_bekker_plugin.so` → `soil-bekker`; None: not the file of a module.
pub(super) fn module_name(file: &str) -> Option<String> {
    let stem = file.strip_prefix(std::env::consts::DLL_PREFIX)?.strip_suffix(std::env::consts::DLL_SUFFIX)?;
    Some(stem.strip_suffix("_plugin")?.replace('_', "-"))
}

/// Whether the value of `module` is a path.
pub fn is_path(module: &str) -> bool {
    module.contains('/') || module.ends_with(std::env::consts::DLL_SUFFIX) || module.ends_with(".py")
}

/// A path below a folder without steps on the spot: ./cut.so, not ././cut.so.
pub(super) fn below(folder: &Path, path: &str) -> PathBuf {
    folder.join(path).components().collect()
}

fn user_folder() -> Option<PathBuf> {
    let data = std::env::var_os("XDG_DATA_HOME").filter(|d| !d.is_empty()).map(PathBuf::from);
    let data = data.or_else(|| Some(PathBuf::from(std::env::var_os("HOME")?).join(".local/share")))?;
    Some(data.join("terraglue/modules"))
}

/// The name that is most like one that was not found.
pub(super) fn nearest(name: &str, names: impl Iterator<Item = String>) -> Option<String> {
    let names: Vec<String> = names.collect();
    terraglue_diagnostics::nearest(name, names.iter().map(String::as_str)).map(str::to_owned)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_files_correspond() {
        assert_eq!(file_name("soil-bekker"), "libsoil_bekker_plugin.so");
        assert_eq!(module_name("libsoil_bekker_plugin.so").as_deref(), Some("soil-bekker"));
        assert_eq!(module_name("libm.so"), None);
        assert!(is_path("./libx_plugin.so") && is_path("x.so") && !is_path("soil-bekker"));
    }

    #[test]
    fn order_of_the_search() {
        let path = SearchPath::standard(&["first".into()], Path::new("scenarios"));
        assert_eq!(path.folders()[0], Path::new("first"));
        let at = |end: &str| path.folders().iter().position(|f| f.ends_with(end)).expect(end);
        assert!(at("scenarios") < at("terraglue/modules"));
        assert!(at("terraglue/modules") < at("lib/terraglue"));
    }
}
