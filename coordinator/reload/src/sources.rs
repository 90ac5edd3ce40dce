//! Whether files have changed, from their times and lengths.

use std::path::{Path, PathBuf};
use std::time::UNIX_EPOCH;
use terraglue_scenario::SubsystemSpec;

/// Stamp of a file or a folder of sources.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Stamp {
    files: u64,
    sum: u64,
}

/// Endings of files that a build depends on.
const SOURCES: [&str; 12] = ["c", "h", "cc", "cpp", "cxx", "hpp", "rs", "py", "f90", "toml", "mk", "in"];
/// Folders that hold what was built, or results.
const LEFT_OUT: [&str; 5] = ["target", "build", "runs", "node_modules", "__pycache__"];
/// Most files that are looked at.
const MOST: u64 = 2000;

impl Stamp {
    /// Of one file.
    pub fn of(file: &Path) -> Self {
        let mut stamp = Self::default();
        stamp.add(file);
        stamp
    }

    /// Of all that the build command of a subsystem depends on: `sources`, else the sources below the scenario's folder.
    /// Without a build command nothing is looked at.
    pub fn of_sources(spec: &SubsystemSpec, folder: &Path) -> Self {
        let mut stamp = Self::default();
        if spec.build.is_some() {
            let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
            let named: Vec<PathBuf> = match spec.sources.is_empty() {
                true => vec![folder.to_owned()],
                false => spec.sources.iter().map(|s| folder.join(s)).collect(),
            };
            named.iter().for_each(|path| stamp.add_all(path, true));
        }
        stamp
    }

    /// Whether there was no file.
    pub fn is_missing(&self) -> bool {
        self.files == 0
    }

    fn add(&mut self, file: &Path) {
        use std::os::unix::ffi::OsStrExt;
        let Ok(about) = std::fs::metadata(file) else { return };
        let since = about.modified().ok().and_then(|t| t.duration_since(UNIX_EPOCH).ok()).unwrap_or_default();
        self.files += 1;
        let mut bytes = file.as_os_str().as_bytes().to_vec();
        bytes.extend(since.as_nanos().to_le_bytes());
        bytes.extend(about.len().to_le_bytes());
        // Folders are listed in no order: a sum does not depend on it.
        self.sum = self.sum.wrapping_add(terraglue_diagnostics::fingerprint(&bytes));
    }

    fn add_all(&mut self, path: &Path, named: bool) {
        let name = path.file_name().and_then(|n| n.to_str()).unwrap_or_default();
        if path.is_dir() {
            let skipped = !named && (name.starts_with('.') || LEFT_OUT.contains(&name));
            let entries = (!skipped).then(|| std::fs::read_dir(path).ok()).flatten();
            for entry in entries.into_iter().flatten().flatten() {
                if self.files < MOST {
                    self.add_all(&entry.path(), false);
                }
            }
        } else if named || path.extension().and_then(|e| e.to_str()).is_some_and(|e| SOURCES.contains(&e)) {
            self.add(path);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sources_count_and_results_do_not() {
        let folder = tempfile::tempdir().expect("folder");
        let put = |name: &str, text: &str| {
            let path = folder.path().join(name);
            std::fs::create_dir_all(path.parent().expect("below")).expect("made");
            std::fs::write(path, text).expect("written");
        };
        let now = || {
            let mut stamp = Stamp::default();
            stamp.add_all(folder.path(), true);
            stamp
        };
        put("a.c", "1");
        put("src/b.rs", "1");
        let before = now();
        assert_eq!(before.files, 2);
        for other in ["runs/x.toml", "target/y.rs", "libx_plugin.so", ".git/z.c"] {
            put(other, "1");
            assert_eq!(now(), before, "{other}");
        }
        put("src/b.rs", "22");
        assert_ne!(now(), before);
        assert!(Stamp::of(&folder.path().join("none")).is_missing());
    }
}
