//! Which files a kind of module has in which language, and what is filled into them.

use super::{Scaffold, ScaffoldError};

/// Paths and texts of the crates that a module in Rust is made of.
const CRATES: &[(&str, &str)] = include!(concat!(env!("OUT_DIR"), "/crates.rs"));

/// Kinds of modules.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Ground.
    Soil,
    /// Bodies.
    Robot,
    /// Signals.
    Controller,
    /// Pressure and shear of a soil.
    Law,
    /// Observer of the other subsystems.
    Sensor,
}

/// In which language.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Language {
    /// Rust.
    Rust,
    /// C11.
    C,
    /// C++17.
    Cpp,
    /// Python 3.8 or later.
    Python,
    /// Text in a scenario.
    Scenario,
}

impl Kind {
    /// All, in the order in which they are listed.
    pub const ALL: [Self; 5] = [Self::Soil, Self::Robot, Self::Controller, Self::Law, Self::Sensor];

    /// As a word of the command line.
    pub fn word(self) -> &'static str {
        match self {
            Self::Soil => "soil",
            Self::Robot => "robot",
            Self::Controller => "controller",
            Self::Law => "law",
            Self::Sensor => "sensor",
        }
    }

    fn starts(self) -> &'static str {
        match self {
            Self::Soil => "It starts as flat ground that yields like a spring and holds a foot by friction.",
            Self::Robot => "It starts as a ball that falls and rests with T* = m g.",
            Self::Controller => "It starts as a motor target that goes smoothly to a set-point.",
            Self::Law => "It starts as Bekker's law that stiffens with the depth.",
            Self::Sensor => "It starts as a range finder on the arm of a robot.",
        }
    }

    fn place_of_physics(self, source: &str) -> String {
        match self {
            Self::Soil => format!(
                "Your physics goes into `law` of `{source}`, what it has to remember into the state of a foot."
            ),
            Self::Robot => {
                format!("Your bodies go into `move` or `moved` of `{source}`: forces in, motion out.")
            }
            Self::Controller => {
                format!("Your control law goes into `control` of `{source}`: inputs in, outputs out.")
            }
            Self::Law => format!("Your physics goes into `pressure` and `shear` of `{source}`."),
            Self::Sensor => {
                format!("Your measurement goes into `measure` of `{source}`: what is seen in, outputs out.")
            }
        }
    }
}

impl Language {
    /// All.
    pub const ALL: [Self; 5] = [Self::Rust, Self::C, Self::Cpp, Self::Python, Self::Scenario];

    /// As people write it.
    pub fn title(self) -> &'static str {
        match self {
            Self::Rust => "Rust",
            Self::C => "C",
            Self::Cpp => "C++",
            Self::Python => "Python",
            Self::Scenario => "a scenario",
        }
    }

    /// As a word of the command line.
    pub fn word(self) -> &'static str {
        match self {
            Self::Rust => "rust",
            Self::C => "c",
            Self::Cpp => "cpp",
            Self::Python => "python",
            Self::Scenario => "scenario",
        }
    }
}

/// A file of a new folder: its path with `my_module` for the name, what it is, and its text.
type File = (&'static str, &'static str, &'static str);

const HEADER: File = (
    "terraglue.h",
    "what a module looks like to C",
    include_str!("../../../interfaces/plugin/include/terraglue.h"),
);
const MAKEFILE: File =
    ("Makefile", "builds (`make`) and checks (`make check`)", include_str!("templates/Makefile.in"));
const BALL: File = ("ball.urdf", "the body that falls on it", include_str!("templates/ball.urdf.in"));
const CLASS: File = ("terraglue.hpp", "a thin class over it", include_str!("templates/terraglue.hpp.in"));
const ARM: File = ("arm.urdf", "the arm that it moves", include_str!("templates/arm.urdf.in"));
const PYTHON: [File; 2] = [
    (
        "terraglue.py",
        "what a module in Python is made of; the program brings its own copy",
        terraglue_host::isolation::SDK,
    ),
    (
        "test_my_module.py",
        "puts the module through the checker (`python3 -m pytest`)",
        include_str!("templates/check.py.in"),
    ),
];
const RUST: [File; 2] = [
    ("Cargo.toml", "build file", include_str!("templates/Cargo.toml.in")),
    (
        "tests/check.rs",
        "puts the module through the checker (`cargo test`)",
        include_str!("templates/check.rs.in"),
    ),
];

const LAW: File =
    ("scenario.toml", "the law, and a ball that falls on it", include_str!("templates/scenario-law.toml.in"));

/// The source file of a kind in a language; None: not offered.
fn source(kind: Kind, language: Language) -> Option<File> {
    Some(match (kind, language) {
        (Kind::Law, Language::Scenario) => LAW,
        (_, Language::Scenario) => return None,
        (Kind::Law, Language::Python) => ("my_module.py", "the law", include_str!("templates/law.py.in")),
        (Kind::Law, Language::Rust) => ("src/lib.rs", "the law", include_str!("templates/law.rs.in")),
        (Kind::Law, Language::C) => ("my_module.c", "the law", include_str!("templates/law.c.in")),
        (Kind::Law, Language::Cpp) => ("my_module.cpp", "the law", include_str!("templates/law.cpp.in")),
        (Kind::Sensor, Language::Python) => {
            ("my_module.py", "the sensor", include_str!("templates/sensor.py.in"))
        }
        (Kind::Sensor, Language::Rust) => {
            ("src/lib.rs", "the sensor", include_str!("templates/sensor.rs.in"))
        }
        (Kind::Sensor, Language::C) => ("my_module.c", "the sensor", include_str!("templates/sensor.c.in")),
        (Kind::Sensor, Language::Cpp) => {
            ("my_module.cpp", "the sensor", include_str!("templates/sensor.cpp.in"))
        }
        (Kind::Soil, Language::Rust) => ("src/lib.rs", "the soil", include_str!("templates/soil.rs.in")),
        (Kind::Soil, Language::C) => ("my_module.c", "the soil", include_str!("templates/soil.c.in")),
        (Kind::Soil, Language::Cpp) => ("my_module.cpp", "the soil", include_str!("templates/soil.cpp.in")),
        (Kind::Soil, Language::Python) => ("my_module.py", "the soil", include_str!("templates/soil.py.in")),
        (Kind::Robot, Language::Python) => {
            ("my_module.py", "the robot", include_str!("templates/robot.py.in"))
        }
        (Kind::Controller, Language::Python) => {
            ("my_module.py", "the controller", include_str!("templates/controller.py.in"))
        }
        (Kind::Robot, Language::Rust) => ("src/lib.rs", "the robot", include_str!("templates/robot.rs.in")),
        (Kind::Robot, Language::C) => ("my_module.c", "the robot", include_str!("templates/robot.c.in")),
        (Kind::Robot, Language::Cpp) => {
            ("my_module.cpp", "the robot", include_str!("templates/robot.cpp.in"))
        }
        (Kind::Controller, Language::Rust) => {
            ("src/lib.rs", "the controller", include_str!("templates/controller.rs.in"))
        }
        (Kind::Controller, Language::C) => {
            ("my_module.c", "the controller", include_str!("templates/controller.c.in"))
        }
        (Kind::Controller, Language::Cpp) => {
            ("my_module.cpp", "the controller", include_str!("templates/controller.cpp.in"))
        }
    })
}

fn scenario(kind: Kind, language: Language) -> &'static [File] {
    match kind {
        Kind::Soil => {
            &[("scenario.toml", "a ball falls on it", include_str!("templates/scenario-soil.toml.in")), BALL]
        }
        Kind::Robot => {
            &[("scenario.toml", "it falls on a soil", include_str!("templates/scenario-robot.toml.in"))]
        }
        Kind::Law if language == Language::Scenario => &[BALL],
        Kind::Law => &[
            ("scenario.toml", "a ball falls on it", include_str!("templates/scenario-law-module.toml.in")),
            BALL,
        ],
        Kind::Controller => &[
            ("scenario.toml", "it moves an arm", include_str!("templates/scenario-controller.toml.in")),
            ARM,
        ],
        Kind::Sensor => {
            &[("scenario.toml", "it sits on an arm", include_str!("templates/scenario-sensor.toml.in")), ARM]
        }
    }
}

/// Files that a module in a language has beside its source.
fn beside_source(kind: Kind, language: Language) -> Vec<File> {
    match language {
        Language::Rust => RUST.to_vec(),
        Language::C => vec![HEADER, MAKEFILE],
        Language::Cpp if kind == Kind::Law => vec![HEADER, MAKEFILE],
        Language::Cpp => vec![HEADER, CLASS, MAKEFILE],
        Language::Python => PYTHON.to_vec(),
        Language::Scenario => Vec::new(),
    }
}

/// The command that builds a module, and the file that it makes.
fn build_of(language: Language, snake: &str) -> (&'static str, String) {
    let library = format!("lib{snake}_plugin.so");
    match language {
        Language::Rust => ("cargo build", format!("./target/debug/{library}")),
        Language::C | Language::Cpp => ("make", format!("./{library}")),
        Language::Python => ("@terraglue@ check scenario.toml", format!("./{snake}.py")),
        Language::Scenario => ("@terraglue@ check scenario.toml", String::new()),
    }
}

/// Variables of a Makefile, and the command that compiles.
fn compiler_of(language: Language) -> (&'static str, &'static str) {
    match language {
        Language::Cpp => (
            "CXXFLAGS ?= -std=c++17 -O2 -Wall -Wextra",
            "$(CXX) $(CXXFLAGS) -fvisibility=hidden -fPIC -shared $< -o $@",
        ),
        _ => ("CFLAGS ?= -std=c11 -O2 -Wall -Wextra", "$(CC) $(CFLAGS) -fPIC -shared $< -o $@ -lm"),
    }
}

/// The page that explains a folder.
fn page(kind: Kind, language: Language) -> File {
    match kind {
        Kind::Law if language == Language::Scenario => {
            ("README.md", "this page", include_str!("templates/README-law.md.in"))
        }
        _ => ("README.md", "this page", include_str!("templates/README.md.in")),
    }
}

/// Fills the templates.
pub(super) fn fill(
    kind: Kind,
    language: Language,
    name: &str,
    program: &str,
) -> Result<Scaffold, ScaffoldError> {
    let Some(source) = source(kind, language) else {
        let offered: Vec<_> =
            Language::ALL.iter().filter(|l| self::source(kind, **l).is_some()).map(|l| l.word()).collect();
        return Err(ScaffoldError::Language {
            kind: kind.word(),
            language: language.title(),
            offered: offered.join(", "),
        });
    };
    let mut files = vec![source];
    files.extend(beside_source(kind, language));
    files.extend(scenario(kind, language));
    let snake = name.replace('-', "_");
    let (build, module) = build_of(language, &snake);
    let rebuild = match language {
        Language::Python | Language::Scenario => String::new(),
        _ => format!(
            "build = \"{build}\"                  # what `run --watch` does on a change of the source\n"
        ),
    };
    let listing: Vec<_> = files.iter().map(|(path, what, _)| format!("* `{path}`: {what}")).collect();
    let (flags, compile) = compiler_of(language);
    let words = [
        ("@files@", listing.join("\n")),
        ("@variables@", flags.into()),
        ("@compile@", compile.into()),
        ("@source@", source.0.into()),
        ("@where@", kind.place_of_physics(source.0)),
        ("@starts@", kind.starts().into()),
        ("@kind@", kind.word().into()),
        ("@table@", if kind == Kind::Law { "soil.law.parameters".into() } else { kind.word().into() }),
        ("@language@", language.title().into()),
        (
            "@first@",
            if language == Language::Python { "See whether all names fit" } else { "Build it" }.into(),
        ),
        ("@build@", build.into()),
        ("@rebuild@", rebuild),
        ("@module@", module),
        ("@terraglue@", "terraglue".into()),
        ("my-module", name.into()),
        ("my_module", snake),
    ];
    files.push(page(kind, language));
    let replaced = |text: &str| words.iter().fold(text.to_owned(), |text, (word, by)| text.replace(word, by));
    let files = files.iter().map(|(path, _, text)| (replaced(path), replaced(text))).collect();
    let crates = if language == Language::Rust { CRATES } else { &[] };
    let build = build.replace("@terraglue@", program);
    Ok(Scaffold { files, crates, commands: [build, format!("{program} run scenario.toml")] })
}
