//! Finds and loads the shared library of an FMU.
#![allow(unsafe_code)] // Loading a library runs its constructors.

use crate::description::{ModelDescription, Version};
use crate::elf;
use crate::error::{Error, Result};
use crate::floating_point::Keep;
use libloading::os::unix::{Library, RTLD_GLOBAL, RTLD_LOCAL, RTLD_NOW};
use std::error::Error as _;
use std::mem::ManuallyDrop;
use std::path::{Path, PathBuf};

/// Library of an FMU in this process; unloaded when dropped, unless threads may still run in it.
#[derive(Debug)]
pub struct Loaded {
    pub library: ManuallyDrop<Library>,
    /// Threads of this process before it was loaded.
    threads: usize,
}

impl Drop for Loaded {
    fn drop(&mut self) {
        if threads() <= self.threads {
            // SAFETY: dropped once, here; no instance of the FMU is left.
            unsafe { ManuallyDrop::drop(&mut self.library) };
        }
    }
}

/// Number of threads of this process.
fn threads() -> usize {
    std::fs::read_dir("/proc/self/task").map_or(0, Iterator::count)
}

/// Name of this platform in an archive.
pub fn platform(version: Version) -> &'static str {
    match (version, cfg!(target_arch = "aarch64")) {
        (Version::V2, false) => "linux64",
        (Version::V3, false) => "x86_64-linux",
        (_, true) => "aarch64-linux",
    }
}

/// Entry of the archive that holds the library for this platform.
pub fn library_entry(description: &ModelDescription) -> String {
    format!("binaries/{}/{}.so", platform(description.version), description.identifier)
}

/// Platforms that an archive with these entries has a library for.
pub fn platforms<'a>(names: impl Iterator<Item = &'a str>) -> Vec<String> {
    let mut all: Vec<String> = names
        .filter_map(|n| n.strip_prefix("binaries/")?.split_once('/'))
        .filter(|(_, file)| !file.is_empty())
        .map(|(platform, _)| platform.to_owned())
        .collect();
    all.sort();
    all.dedup();
    all
}

/// Loads the library of the FMU of file `fmu`, extracted into `extracted`.
pub fn load(fmu: &Path, description: &ModelDescription, extracted: &Path) -> Result<Loaded> {
    let fail = |message: String| Error::Library { path: fmu.into(), message };
    let folder = extracted.join("binaries").join(platform(description.version));
    let name = format!("{}.so", description.identifier);
    let path = folder.join(&name);
    if !path.is_file() {
        return Err(fail(missing(description, extracted, &name)));
    }
    let bytes = std::fs::read(&path).map_err(|e| fail(format!("`{name}` cannot be loaded: {e}")))?;
    inspect(&bytes).map_err(|why| fail(format!("`{name}` cannot be loaded: {why}")))?;
    let threads = threads();
    let _mode = Keep::new();
    open(&path)
        .map(|library| Loaded { library: ManuallyDrop::new(library), threads })
        .map_err(|why| fail(format!("`{name}` cannot be loaded: {why}")))
}

fn missing(description: &ModelDescription, extracted: &Path, name: &str) -> String {
    let entries = std::fs::read_dir(extracted.join("binaries")).into_iter().flatten().flatten();
    let mut found: Vec<String> = entries.map(|e| e.file_name().to_string_lossy().into_owned()).collect();
    found.sort();
    let wanted = platform(description.version);
    let beside = std::fs::read_dir(extracted.join("binaries").join(wanted)).into_iter().flatten().flatten();
    let mut beside: Vec<String> = beside.map(|e| format!("`{}`", e.file_name().to_string_lossy())).collect();
    beside.sort();
    if !beside.is_empty() {
        let beside = beside.join(", ");
        return format!(
            "has no library `binaries/{wanted}/{name}`, which its modelIdentifier asks for; beside it is {beside}"
        );
    }
    let has = match (found.is_empty(), extracted.join("sources").is_dir()) {
        (true, true) => "it holds source code only".to_owned(),
        (true, false) => "it holds no library at all".to_owned(),
        (false, _) => format!("it holds libraries for {}", found.join(", ")),
    };
    format!("has no library `binaries/{wanted}/{name}` for this platform; {has}")
}

/// Whether bytes can be a library of this machine, as far as they show.
pub fn inspect(bytes: &[u8]) -> std::result::Result<(), String> {
    if !elf::is_elf(bytes) {
        return Err("it is no shared library (no ELF header)".into());
    }
    if let Some(machine) = elf::foreign_machine(bytes) {
        return Err(format!("it is made for another kind of machine (ELF number {machine})"));
    }
    // ET_DYN
    if let Some(kind) = bytes.get(16).filter(|kind| **kind != 3) {
        return Err(format!("it is no shared library (ELF type {kind})"));
    }
    match elf::mapped_length(bytes) {
        None => Err("it is no library for 64 bits, or its head is cut off".into()),
        Some(whole) if whole > bytes.len() => Err(format!("it is cut off after {} bytes", bytes.len())),
        Some(_) => Ok(()),
    }
}

/// Opens a library. Some FMUs forget to link the mathematics library, or that of Python: they get a second try with it.
fn open(path: &Path) -> std::result::Result<Library, String> {
    // SAFETY: the user requested this FMU; its constructors run.
    let once = || unsafe { Library::open(Some(path), RTLD_NOW | RTLD_LOCAL) };
    let first = match once() {
        Ok(library) => return Ok(library),
        Err(e) => cause(&e),
    };
    let Some((_, symbol)) = first.split_once("undefined symbol: ") else { return Err(first) };
    let forgotten = match symbol.starts_with("Py") || symbol.starts_with("_Py") {
        true => python(),
        false => Some("libm.so.6".into()),
    };
    // SAFETY: a library of the system.
    match forgotten.map(|path| unsafe { Library::open(Some(path), RTLD_NOW | RTLD_GLOBAL) }) {
        Some(Ok(library)) => std::mem::forget(library),
        _ => return Err(first),
    }
    once().map_err(|e| cause(&e))
}

/// The library of the interpreter `python3`, where it has one.
fn python() -> Option<PathBuf> {
    const ASK: &str =
        "import sysconfig as s; print(s.get_config_var('LIBDIR'), s.get_config_var('INSTSONAME'), sep='/')";
    let told = std::process::Command::new("python3").args(["-c", ASK]).output().ok()?;
    let path = PathBuf::from(String::from_utf8(told.stdout).ok()?.trim());
    (told.status.success() && path.to_string_lossy().contains(".so")).then_some(path)
}

/// The system's own words: the top message of libloading hides them.
fn cause(error: &libloading::Error) -> String {
    error.source().map_or_else(|| error.to_string(), ToString::to_string)
}
