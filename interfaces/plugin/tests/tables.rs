//! Tables that cannot be used are refused before anything in them is called, and tables of another minor version
//! are accepted.
#![allow(unsafe_code, missing_docs, clippy::unwrap_used)]

mod everything;

use everything::Everything;
use std::mem::offset_of;
use terraglue_plugin::abi::*;
use terraglue_plugin::{ForeignModule, TableError, table};

fn refused(change: impl FnOnce(&mut TgSubsystem)) -> TableError {
    let mut table = table::<Everything>("everything-plugin", b"\0");
    change(&mut table);
    // SAFETY: a table of our own that is not called after this function.
    unsafe { ForeignModule::new(&raw const table) }.unwrap_err()
}

#[test]
fn each_fault_has_its_own_error() {
    // SAFETY: null is allowed.
    assert_eq!(unsafe { ForeignModule::new(std::ptr::null()) }.unwrap_err(), TableError::Null);
    let version = refused(|t| t.abi_major = TG_ABI_MAJOR + 1);
    assert_eq!(version, TableError::Version { found: [TG_ABI_MAJOR + 1, TG_ABI_MINOR] });
    assert!(version.to_string().contains(&format!("ABI {}.{TG_ABI_MINOR}", TG_ABI_MAJOR + 1)), "{version}");
    let needed = offset_of!(TgSubsystem, set_ports) as u32;
    assert_eq!(refused(|t| t.size = 40), TableError::Truncated { size: 40, needed });
    assert_eq!(refused(|t| t.kind = 9), TableError::Kind(9));
    assert_eq!(refused(|t| t.advance = None), TableError::Missing("advance"));
    assert_eq!(refused(|t| t.last_error = None), TableError::Missing("last_error"));
}

#[test]
fn entries_beyond_the_size_of_an_older_table_count_as_null() {
    let mut table = table::<Everything>("everything-plugin", b"\0");
    table.size = offset_of!(TgSubsystem, solve_compatibility) as u32;
    // SAFETY: a table of our own; Everything keeps the contract.
    let module = unsafe { ForeignModule::new(&raw const table) }.unwrap();
    let host = std::sync::Arc::new(terraglue_subsystem::Standalone::default());
    let config = terraglue_subsystem::Config::parse(r#"{"fault": "none", "start": 0}"#).unwrap();
    let error = module.instantiate(&config, host).err().unwrap().to_string();
    assert!(error.contains("needs ground"), "{error}");
}

#[test]
fn a_capability_without_its_function_is_refused_by_name() {
    struct Flat;
    impl terraglue_subsystem::Terrain for Flat {
        fn origin(&self) -> [f64; 2] {
            [0.0; 2]
        }
        fn spacing(&self) -> f64 {
            1.0
        }
        fn size(&self) -> [u32; 2] {
            [2, 2]
        }
        fn heights(
            &self,
            _: i64,
            _: i64,
            _: usize,
            _: usize,
            out: &mut [f64],
        ) -> terraglue_subsystem::TerrainTile {
            out.fill(0.0);
            terraglue_subsystem::TerrainTile::Uniform(0.0)
        }
    }
    let mut table = table::<Everything>("everything-plugin", b"\0");
    table.restore_state = None;
    // SAFETY: a table of our own; Everything keeps the contract.
    let module = unsafe { ForeignModule::new(&raw const table) }.unwrap();
    let host = terraglue_subsystem::Standalone { terrain: Some(Box::new(Flat)), ..Default::default() };
    let config = terraglue_subsystem::Config::parse(r#"{"fault": "none", "start": 0}"#).unwrap();
    let error = module.instantiate(&config, std::sync::Arc::new(host)).err().unwrap().to_string();
    assert!(error.contains("`restore_state`") && error.contains("null"), "{error}");
}

#[test]
fn the_version_in_the_section_is_that_of_the_table() {
    assert_eq!(terraglue_plugin::abi_version!(), format!("{TG_ABI_MAJOR}.{TG_ABI_MINOR}"));
}

#[test]
fn asking_again_for_the_schema_gives_the_same_text() {
    let table = table::<Everything>("everything-plugin", b"\0");
    let schema = table.schema.unwrap();
    // SAFETY: the function of our own table.
    let (first, second) = unsafe { (schema(), schema()) };
    assert!(!first.is_null());
    assert_eq!(first, second);
}
