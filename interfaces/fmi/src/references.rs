//! Files about an FMU inside it (layered standard FMI-LS-REF 1.0.0-alpha.1): results of its default experiment, inputs, parameters, sources.

use crate::error::{Error, Result};
use crate::fmu::Fmu;
use roxmltree::Document;
use std::path::{Component, Path, PathBuf};

/// Folder of the standard in an archive.
pub const FOLDER: &str = "extra/org.fmi-standard.fmi-ls-ref";
/// Its list of files, in that folder.
pub const MANIFEST: &str = "fmi-ls-manifest.xml";

/// A file about an FMU.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Related {
    /// `result`, `experiment/smoke-test`, `parameter`, …
    pub role: String,
    /// MIME type.
    pub media_type: String,
    /// Path in the archive.
    pub path: PathBuf,
    /// One line for people.
    pub description: String,
}

/// The files that an FMU lists; none where it does not follow the standard. A file that is listed need not be there.
///
/// # Errors
/// A list that cannot be read, or a path out of the archive.
pub fn related(fmu: &Fmu) -> Result<Vec<Related>> {
    let path = fmu.folder().join(FOLDER).join(MANIFEST);
    let Ok(text) = std::fs::read_to_string(&path) else { return Ok(Vec::new()) };
    list(&text).map_err(|message| Error::Archive {
        path: fmu.path().into(),
        entry: Some(format!("{FOLDER}/{MANIFEST}")),
        message,
    })
}

fn list(text: &str) -> std::result::Result<Vec<Related>, String> {
    let document = Document::parse(text).map_err(|e| e.to_string())?;
    let mut all = Vec::new();
    for node in document.root_element().children().filter(|n| n.tag_name().name() == "Related") {
        let of = |name: &str| node.attribute(name).unwrap_or_default().trim().to_owned();
        let source = of("source");
        if source.contains(':') {
            continue; // a place outside the archive: nothing is fetched
        }
        let path = within(&source).ok_or_else(|| format!("`{source}` lies outside the archive"))?;
        let media_type = of("type");
        all.push(Related { role: of("role"), media_type, path, description: of("description") });
    }
    Ok(all)
}

/// A path relative to the folder of the standard as one of the archive.
fn within(source: &str) -> Option<PathBuf> {
    let mut path = PathBuf::from(FOLDER);
    for part in Path::new(source).components() {
        match part {
            Component::Normal(name) => path.push(name),
            Component::CurDir => {}
            Component::ParentDir if path.pop() => {}
            _ => return None,
        }
    }
    Some(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_found_below_the_archive_only() -> std::result::Result<(), String> {
        let one = |source: &str| {
            list(&format!(
                "<fmiReferences><Related type=\"text/csv\" source=\"{source}\" role=\"result\"/></fmiReferences>"
            ))
        };
        assert_eq!(one("a.csv")?[0].path, Path::new("extra/org.fmi-standard.fmi-ls-ref/a.csv"));
        assert_eq!(one("../../documentation/a.csv")?[0].path, Path::new("documentation/a.csv"));
        assert!(one("https://example.org/a.csv")?.is_empty());
        assert!(one("../../../a.csv").is_err() && one("/etc/passwd").is_err() && list("<a").is_err());
        Ok(())
    }
}
