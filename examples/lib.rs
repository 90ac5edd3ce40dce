//! Helpers of the examples: paths of the repository's scenarios and modules.

use std::path::PathBuf;
use terraglue::testbed::Options;

/// A scenario that comes with the repository.
pub fn scenario(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../scenarios").join(name).with_extension("toml")
}

/// The usual options; cargo lays examples one folder below the modules that it has built.
pub fn options() -> Options {
    let program = std::env::current_exe().unwrap_or_default();
    let built = program.ancestors().nth(2).map(|folder| folder.join("deps"));
    Options { module_paths: built.into_iter().collect(), ..Options::default() }
}
