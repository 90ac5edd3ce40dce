//! `cargo xtask install PREFIX`: bin, lib/terraglue, include and share/terraglue below a prefix.

use crate::process::{Outcome, cargo, must, root, target};
use std::path::Path;
use terraglue::scenario::SHIPPED_MODULES;

/// The library inside exported units.
const UNIT: &str = "libterraglue_unit.so";

/// Builds in the release profile and copies what a user needs.
pub fn install(prefix: &Path) -> Outcome {
    must(&mut cargo(&["build", "--release", "--package", "terraglue", "--package", "terraglue-unit"]))?;
    let release = target().join("release");
    copy(&release.join("terraglue"), &prefix.join("bin/terraglue"))?;
    for module in SHIPPED_MODULES {
        let file = format!("lib{}_plugin.so", module.replace('-', "_"));
        // The copy in deps is always fresh; the one beside the program is not after `cargo build -p`.
        let built = [release.join("deps").join(&file), release.join(&file)];
        let built = built.iter().find(|f| f.is_file()).ok_or_else(|| format!("{file} was not built"))?;
        copy(built, &prefix.join("lib/terraglue").join(&file))?;
    }
    copy(&release.join(UNIT), &prefix.join("lib/terraglue").join(UNIT))?;
    copy_files(&root().join("interfaces/plugin/include"), &prefix.join("include"))?;
    copy_files(&root().join("models"), &prefix.join("share/terraglue/models"))?;
    copy_files(&root().join("scenarios"), &prefix.join("share/terraglue/scenarios"))?;
    println!("installed below {}", prefix.display());
    Ok(())
}

fn copy_files(from: &Path, to: &Path) -> Outcome {
    let entries = std::fs::read_dir(from).map_err(|e| format!("{}: {e}", from.display()))?;
    for entry in entries.flatten().filter(|e| e.path().is_file()) {
        copy(&entry.path(), &to.join(entry.file_name()))?;
    }
    Ok(())
}

fn copy(from: &Path, to: &Path) -> Outcome {
    let made = to.parent().map_or(Ok(()), std::fs::create_dir_all);
    let copied = made.and_then(|()| std::fs::copy(from, to));
    copied.map(drop).map_err(|e| format!("{} to {}: {e}", from.display(), to.display()))
}
