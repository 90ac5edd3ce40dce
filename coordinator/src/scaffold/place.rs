//! Where the program and the crates of the interface lie, as a new folder has to name them.

use std::path::{Path, PathBuf};

/// What a new module refers to outside its folder.
#[derive(Clone, Debug)]
pub struct Place {
    /// How a command line calls this program.
    pub program: String,
    /// Folder with the crates `plugin` and `subsystem`; None: not found.
    pub interfaces: Option<PathBuf>,
}

impl Place {
    /// From the environment: `TERRAGLUE_INTERFACES`, the source tree that the program was built in or lies in, and
    /// `../lib/terraglue/interfaces` beside an installed program.
    pub fn here() -> Self {
        let program = std::env::current_exe().unwrap_or_else(|_| "terraglue".into());
        let named = std::env::var_os("TERRAGLUE_INTERFACES").map(PathBuf::from);
        let around = program.ancestors().skip(1).map(|folder| folder.join("interfaces"));
        let beside = program.parent().map(|folder| folder.join("../lib/terraglue/interfaces"));
        let built = Path::new(env!("CARGO_MANIFEST_DIR")).join("../interfaces");
        let mut all = named.into_iter().chain(beside).chain(around).chain([built]);
        let interfaces = all.find(|folder| folder.join("plugin/Cargo.toml").is_file());
        let interfaces = interfaces.map(|folder| folder.canonicalize().unwrap_or(folder));
        Self { program: spoken(&program), interfaces }
    }
}

/// `terraglue` where the path finds this very program, else its full path.
fn spoken(program: &Path) -> String {
    let name = program.file_name().unwrap_or_default();
    let path = std::env::var_os("PATH").unwrap_or_default();
    let first = std::env::split_paths(&path).map(|folder| folder.join(name)).find(|file| file.is_file());
    let same = first.and_then(|file| file.canonicalize().ok()) == program.canonicalize().ok();
    if same { name.to_string_lossy().into_owned() } else { program.to_string_lossy().into_owned() }
}
