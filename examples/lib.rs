//! What the examples share: where the scenarios of the repository are.

use std::path::PathBuf;

/// A scenario that comes with the repository.
pub fn scenario(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../scenarios").join(name).with_extension("toml")
}
