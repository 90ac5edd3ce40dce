//! The C ABI of a module: the table of functions, its header, and the conversion both ways.
//!
//! No Rust type and no panic crosses the border: [`abi`] holds plain C types, `export_subsystem!` wraps a Rust
//! [`terraglue_subsystem::Module`] into the table, [`ForeignModule`] makes any table, written in Rust or in C,
//! a module again. `include/terraglue.h` is the same for C; it is generated from [`abi`].
//!
//! ```ignore
//! //! The module my-soil as a dynamic library (crate-type = ["cdylib"]).
//! terraglue_plugin::export_subsystem!(my_soil::MySoil);
//! ```
//!
//! Unsafe code is needed here because pointers of foreign code are read and written; every block says why it is sound.
#![allow(unsafe_code)]

/// The examples of the README, which the tests compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

pub mod abi;
mod convert;
pub mod describe;
mod export;
mod field_table;
mod foreign;
mod hosted_law;
mod keep;
mod law;
mod scene_table;
mod text;

pub use export::{law_table, table};
pub use foreign::{ForeignModule, ForeignSubsystem, TableError};
pub use law::TableLaw;

/// Name of the one symbol that a module exports; its type is [`abi::TgEntry`].
pub const ENTRY: &str = "terraglue_subsystem";

/// Name of the section of the library that describes the module: lines `terraglue module`, `name=…`, `version=…`,
/// `abi=MAJOR.MINOR`, `kind=…`, `can=…`, a `variable=NAME ROLE TYPE UNIT` for each, `license=…`, `authors=…`, closed by
/// a zero byte. It can be read without running the library.
pub const SECTION: &str = ".terraglue";

/// A table that can be kept in a static.
#[doc(hidden)]
pub struct Table(pub abi::TgSubsystem);
// SAFETY: a table is constant and its pointers refer to constant memory.
unsafe impl Send for Table {}
// SAFETY: as above.
unsafe impl Sync for Table {}

/// Version of the ABI as a literal, for [`export_subsystem`].
#[doc(hidden)]
#[macro_export]
macro_rules! abi_version {
    () => {
        "3.1"
    };
}

/// Exports a type that implements [`terraglue_subsystem::Module`] as the module of this dynamic library.
///
/// The crate is a `cdylib` named `<module name>-plugin` and holds nothing else. After the type comes the section of the
/// library: the kind, the capabilities of an instance (the words of [`describe`]), and its variables, each as
/// `NAME ROLE TYPE UNIT`. A `*` in a name stands for a part that depends on parameters, units may have alternatives:
/// `*.torque output f64 N m | N`. `check-module` compares it with an instance.
///
/// ```ignore
/// terraglue_plugin::export_subsystem! {
///     MySoil,
///     kind: "soil",
///     can: "force motion derivatives retry state serialize",
///     variables: ["sinkage output f64 m"],
/// }
/// ```
#[macro_export]
macro_rules! export_subsystem {
    ($module:ty $(,)?) => {
        $crate::export_table!($crate::table::<$module>, [""]);
    };
    ($module:ty, kind: $kind:literal, can: $can:literal $(, variables: [$($variable:literal),* $(,)?])? $(,)?) => {
        $crate::export_table!(
            $crate::table::<$module>,
            [concat!("kind=", $kind, "\ncan=", $can, "\n" $($(, "variable=", $variable, "\n")*)?)]
        );
    };
}

/// Exports a type that implements [`terraglue_subsystem::LawModule`] as the law of this dynamic library.
#[macro_export]
macro_rules! export_law {
    ($law:ty) => {
        $crate::export_table!(
            $crate::law_table::<$law>,
            ["kind=law\ncan=", $crate::describe::law_words::<$law>(), "\n"]
        );
    };
}

/// The section, the entry and the refusal to be built without unwinding, for a function that makes the table and more
/// lines of the section.
#[doc(hidden)]
#[macro_export]
macro_rules! export_table {
    ($make:expr, [$($line:expr),*]) => {
        #[cfg(panic = "abort")]
        compile_error!(
            "[TG13] a module must be built with panic = \"unwind\": aborting would end the host; take panic = \"abort\" out of the profile"
        );

        /// Description of this library, readable without running it.
        #[allow(unsafe_code)]
        // SAFETY: a section of our own name; nothing else reads or writes it.
        #[unsafe(link_section = ".terraglue")]
        #[used]
        static TERRAGLUE_DESCRIPTION: [u8; $crate::describe::length(TERRAGLUE_LINES)] =
            $crate::describe::joined(TERRAGLUE_LINES);
        const TERRAGLUE_LINES: &[&str] = &[
            concat!(
                "terraglue module\nname=",
                env!("CARGO_PKG_NAME"),
                "\nversion=",
                env!("CARGO_PKG_VERSION"),
                "\nabi=",
                $crate::abi_version!(),
                "\nlicense=",
                env!("CARGO_PKG_LICENSE"),
                "\nauthors=",
                env!("CARGO_PKG_AUTHORS"),
                "\n"
            ),
            $($line,)*
            "\0",
        ];

        /// The entry that the host looks for.
        #[allow(unsafe_code)]
        // SAFETY: the only symbol of this name in the library; the type is `TgEntry`.
        #[unsafe(no_mangle)]
        pub extern "C" fn terraglue_subsystem() -> *const $crate::abi::TgSubsystem {
            static TABLE: ::std::sync::OnceLock<$crate::Table> = ::std::sync::OnceLock::new();
            let table =
                TABLE.get_or_init(|| $crate::Table($make(env!("CARGO_PKG_NAME"), &TERRAGLUE_DESCRIPTION)));
            &raw const table.0
        }
    };
}
