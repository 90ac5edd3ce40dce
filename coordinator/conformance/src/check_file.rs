//! The file beside a module: `lib…_plugin.check.toml` gives parameters for the check and switches tests off.
//!
//! ```toml
//! [parameters]
//! model = "../models/hexapod.urdf"     # relative to this file's folder
//! [off]
//! rotation = "the lattice of this soil is not square"
//! ```

use serde_json::Value;
use std::path::{Path, PathBuf};
use terraglue_host::value_of;

/// Content of the file.
#[derive(Clone, Debug, Default)]
pub struct CheckFile {
    /// Parameters by dotted name.
    pub parameters: Vec<(String, Value)>,
    /// Tests that are switched off, with the reason.
    pub off: Vec<(String, String)>,
    /// Folder of relative paths.
    pub folder: Option<PathBuf>,
}

impl CheckFile {
    /// The file beside a module; nothing where there is none.
    ///
    /// # Errors
    /// It is not TOML, or has other tables, with its path.
    pub fn beside(module: &Path) -> Result<Self, String> {
        let path = module.with_extension("check.toml");
        if !path.is_file() {
            return Ok(Self::default());
        }
        let wrong = |why: String| format!("{}: {why}", path.display());
        let text = std::fs::read_to_string(&path).map_err(|e| wrong(e.to_string()))?;
        let document: toml_edit::DocumentMut = text.parse().map_err(|e| wrong(format!("{e}")))?;
        let mut out = Self { folder: path.parent().map(Path::to_owned), ..Self::default() };
        for (key, item) in document.iter() {
            let table = item.as_table_like().ok_or_else(|| wrong(format!("`{key}` is no table")))?;
            match key {
                "parameters" => {
                    for (name, value) in table.iter() {
                        let value = value.as_value().and_then(value_of);
                        let value =
                            value.ok_or_else(|| wrong(format!("`{name}` has no value of a parameter")))?;
                        out.parameters.push((name.to_owned(), value));
                    }
                }
                "off" => {
                    for (name, value) in table.iter() {
                        let reason = value.as_str().filter(|r| !r.trim().is_empty());
                        let reason =
                            reason.ok_or_else(|| wrong(format!("`{name}` is off without a reason")))?;
                        out.off.push((name.to_owned(), reason.to_owned()));
                    }
                }
                other => {
                    return Err(wrong(format!("unknown table `{other}`; there are [parameters] and [off]")));
                }
            }
        }
        Ok(out)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parameters_and_reasons_are_read_and_mistakes_named() {
        let folder = tempfile::tempdir().expect("folder");
        let module = folder.path().join("libx_plugin.so");
        let write =
            |text: &str| std::fs::write(folder.path().join("libx_plugin.check.toml"), text).expect("written");
        assert!(CheckFile::beside(&module).expect("none").off.is_empty());
        write("[parameters]\nn = 1.5\ncells = [1, 2]\n[off]\nrotation = \"hexagonal cells\"\n");
        let read = CheckFile::beside(&module).expect("good");
        assert_eq!(read.off, [("rotation".to_owned(), "hexagonal cells".to_owned())]);
        assert_eq!(read.parameters[1].1, serde_json::json!([1, 2]));
        for (text, why) in [("[off]\nx = \"\"", "without a reason"), ("[of]\n", "unknown table"), ("x", "x")]
        {
            write(text);
            let told = CheckFile::beside(&module).expect_err(text);
            assert!(told.contains(why) && told.contains("libx_plugin.check.toml"), "{told}");
        }
    }
}
