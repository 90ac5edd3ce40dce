//! `cargo xtask install PREFIX`: bin, lib/terraglue, include and share/terraglue below a prefix; `cargo xtask dist`: the same,
//! with the documentation, as an archive.

use crate::process::{Outcome, cargo, command, must, read, root, target};
use std::path::Path;

/// The library inside exported FMUs.
const FMU_LIBRARY: &str = "libterraglue_fmu_library.so";

/// Builds in the release profile and copies the files for users; `built`: an existing build in this profile.
pub fn install(prefix: &Path, built: Option<&str>) -> Outcome {
    if built.is_none() {
        build()?;
    }
    lay_out(prefix, built.unwrap_or("release"))?;
    println!("installed below {}", prefix.display());
    Ok(())
}

/// Writes `target/dist/terraglue-VERSION-ARCHITECTURE.tar.gz`; `built`: from an existing build in this profile.
pub fn dist(built: Option<&str>) -> Outcome {
    if built.is_none() {
        build()?;
    }
    let name = format!("terraglue-{}-{}-linux", env!("CARGO_PKG_VERSION"), std::env::consts::ARCH);
    let dist = target().join("dist");
    let folder = dist.join(&name);
    if folder.exists() {
        std::fs::remove_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    }
    lay_out(&folder, built.unwrap_or("release"))?;
    for page in ["README.md", "CHANGELOG.md", "LICENSE-MIT", "LICENSE-APACHE"] {
        copy(&root().join(page), &folder.join(page))?;
    }
    copy_tree(&root().join("docs"), &folder.join("docs"))?;
    let archive = dist.join(format!("{name}.tar.gz")).display().to_string();
    must(&mut command(
        "tar",
        &[
            "--sort=name",
            "--owner=0",
            "--group=0",
            "-czf",
            &archive,
            "-C",
            &dist.display().to_string(),
            &name,
        ],
    ))?;
    println!("{archive}");
    Ok(())
}

fn build() -> Outcome {
    must(&mut cargo(&[
        "build",
        "--release",
        "--package",
        "terraglue-cli",
        "--package",
        "terraglue-fmu-library",
    ]))
}

/// Copies the files built in a profile and those that belong to them.
fn lay_out(prefix: &Path, profile: &str) -> Outcome {
    let release = target().join(profile);
    copy(&release.join("terraglue"), &prefix.join("bin/terraglue"))?;
    for plugin in plugins(&root().join("modules"))? {
        let file = format!("lib{}.so", plugin.replace('-', "_"));
        // The copy in deps is always fresh; the one next to the program is not after `cargo build -p`.
        let built = [release.join("deps").join(&file), release.join(&file)];
        let built = built.iter().find(|f| f.is_file()).ok_or_else(|| format!("{file} was not built"))?;
        copy(built, &prefix.join("lib/terraglue").join(&file))?;
    }
    copy(&release.join(FMU_LIBRARY), &prefix.join("lib/terraglue").join(FMU_LIBRARY))?;
    copy_files(&root().join("interfaces/plugin/include"), &prefix.join("include"))?;
    copy_tree(&root().join("models"), &prefix.join("share/terraglue/models"))?;
    copy_files(&root().join("scenarios"), &prefix.join("share/terraglue/scenarios"))
}

/// Packages of the plugins that the program brings: all below modules/ that make a dynamic library.
fn plugins(folder: &Path) -> Outcome<Vec<String>> {
    let entries = std::fs::read_dir(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let mut found = Vec::new();
    for path in entries.flatten().map(|e| e.path()).filter(|p| p.is_dir()) {
        let manifest = path.join("Cargo.toml");
        if manifest.is_file() && read(&manifest)?.contains("crate-type = [\"cdylib\"]") {
            found.push(package(&manifest)?);
        }
        found.extend(plugins(&path)?);
    }
    Ok(found)
}

/// The name of a package.
fn package(manifest: &Path) -> Outcome<String> {
    let text = read(manifest)?;
    let name = text.lines().find_map(|line| line.strip_prefix("name = \"")?.strip_suffix('"'));
    name.map(str::to_owned).ok_or_else(|| format!("{}: no name", manifest.display()))
}

fn copy_tree(from: &Path, to: &Path) -> Outcome {
    copy_files(from, to)?;
    let entries = std::fs::read_dir(from).map_err(|e| format!("{}: {e}", from.display()))?;
    let mut folders = entries.flatten().filter(|e| e.path().is_dir());
    folders.try_for_each(|e| copy_tree(&e.path(), &to.join(e.file_name())))
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
