//! Paths of the mesh files that a robot file names: plain paths, `file://`, `package://` and `model://`.

use std::path::{Path, PathBuf};

/// Folders to which a robot file's names of files are relative.
#[derive(Clone, Debug, PartialEq, Default)]
pub(crate) struct Folders {
    /// Folder of the robot file.
    pub beside: PathBuf,
    /// Folders of packages by name, from the scenario.
    pub packages: Vec<(String, PathBuf)>,
    /// Folders that hold packages, or are one: those of `ROS_PACKAGE_PATH`.
    pub package_path: Vec<PathBuf>,
}

impl Folders {
    /// The file; else the places that were tried and a way out.
    pub fn find(&self, name: &str) -> Result<PathBuf, String> {
        let (tried, way_out) = match name.split_once("://") {
            None => (vec![self.beside.join(name)], "paths are relative to the robot file".to_owned()),
            Some(("file", path)) => (vec![PathBuf::from(path)], "`file://` names a whole path".to_owned()),
            Some(("package" | "model", rest)) => {
                let (package, path) = rest.split_once('/').unwrap_or((rest, ""));
                let folders = self.package(package);
                let tried = folders.into_iter().map(|f| f.join(path)).collect();
                (tried, format!("say where the package is: packages = {{ {package} = \"FOLDER\" }}"))
            }
            Some((scheme, _)) => {
                return Err(format!(
                    "`{scheme}://` cannot be read; write a path relative to the robot file or package://PACKAGE/PATH"
                ));
            }
        };
        if let Some(found) = tried.iter().find(|p| p.is_file()) {
            return Ok(found.clone());
        }
        // There, and yet no file that can be read whole: opening it gives the reason.
        if let Some(other) = tried.iter().find(|p| p.exists())
            && let Err(why) = terraglue_subsystem::files::open(other)
        {
            return Err(format!(
                "`{}` cannot be read: {why}; a mesh is an STL, OBJ or COLLADA file",
                other.display()
            ));
        }
        let list: Vec<String> = tried.iter().map(|p| p.display().to_string()).collect();
        Err(format!("there is no such file; tried: {}; {way_out}", list.join(", ")))
    }

    /// Folders that may be the package, in the order in which they count.
    fn package(&self, name: &str) -> Vec<PathBuf> {
        let given = self.packages.iter().filter(|(n, _)| n == name).map(|(_, f)| f.clone());
        let mut folders: Vec<PathBuf> = given.collect();
        let whole = std::path::absolute(&self.beside).unwrap_or_else(|_| self.beside.clone());
        for above in whole.ancestors() {
            if is_package(above, name) {
                folders.push(above.to_path_buf());
            }
            // A neighbour of the package in which the robot file lies.
            let beside = above.join(name);
            if beside.join("package.xml").is_file() {
                folders.push(beside);
            }
        }
        for folder in &self.package_path {
            folders.push(if is_package(folder, name) { folder.clone() } else { folder.join(name) });
        }
        if folders.is_empty() {
            // Nothing was found: show where it was looked for.
            folders.extend(whole.ancestors().filter(|a| a.parent().is_some()).map(|a| a.join(name)));
        }
        folders.dedup();
        folders
    }
}

/// Whether a folder is the package: by the name in its `package.xml`, else by its own.
fn is_package(folder: &Path, name: &str) -> bool {
    let own = folder.file_name().is_some_and(|f| f == name);
    match terraglue_subsystem::files::read_text(&folder.join("package.xml")) {
        Ok(text) => own || named(&text).as_deref() == Some(name),
        Err(_) => own,
    }
}

fn named(package_xml: &str) -> Option<String> {
    let document = roxmltree::Document::parse(package_xml).ok()?;
    let name = document.root_element().children().find(|n| n.has_tag_name("name"))?;
    name.text().map(|t| t.trim().to_owned())
}
