//! The kind of the file of a subsystem, by its name.

use std::path::Path;

/// Kind of the file that the value of `module` or `fmu` names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ModuleKind {
    /// A dynamic library, or a module that is linked into the program.
    Library,
    /// An FMU, `….fmu`.
    Fmu,
    /// A module in Python, `….py`.
    Python,
}

impl ModuleKind {
    /// The kind of a file or name as a scenario says it.
    pub fn of(module: &str) -> Self {
        let extension = Path::new(module).extension().unwrap_or_default();
        if extension.eq_ignore_ascii_case("fmu") {
            Self::Fmu
        } else if extension == "py" {
            Self::Python
        } else {
            Self::Library
        }
    }

    /// Whether a module of a scenario is an FMU.
    pub fn is_fmu(module: &str) -> bool {
        Self::of(module) == Self::Fmu
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_extension_says_it() {
        assert_eq!(ModuleKind::of("../units/Pump.FMU"), ModuleKind::Fmu);
        assert_eq!(ModuleKind::of("soil.py"), ModuleKind::Python);
        assert_eq!(ModuleKind::of("soil-bekker"), ModuleKind::Library);
        assert_eq!(ModuleKind::of("./libsoil.so"), ModuleKind::Library);
    }
}
