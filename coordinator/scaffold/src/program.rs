//! How a command line calls this program.

use std::path::Path;

/// `terraglue` where the path finds this very program, else its full path.
pub fn spoken_program() -> String {
    spoken(&std::env::current_exe().unwrap_or_else(|_| "terraglue".into()))
}

fn spoken(program: &Path) -> String {
    let name = program.file_name().unwrap_or_default();
    let path = std::env::var_os("PATH").unwrap_or_default();
    let first = std::env::split_paths(&path).map(|folder| folder.join(name)).find(|file| file.is_file());
    let same = first.and_then(|file| file.canonicalize().ok()) == program.canonicalize().ok();
    if same { name.to_string_lossy().into_owned() } else { program.to_string_lossy().into_owned() }
}
