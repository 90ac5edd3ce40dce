//! Modules that were built with the header of an earlier minor version load and step as those of today.

use super::{compile, compile_with, drive, services};
use crate::{Instance, LoadedModule};
use std::path::Path;
use terraglue_subsystem::{Capabilities, Config};

const SOURCE: &str = include_str!("../../../../tests/modules/soil-elastic-c/soil_elastic.c");
/// The header as version 3.0 had it; never changed.
const HEADER: &str = include_str!("../../../../tests/abi/terraglue-3.0.h");

fn soil(library: &Path) -> Instance {
    let module = LoadedModule::load(library).expect("loads");
    module.instantiate("soil", Config::default(), &services()).expect("instance")
}

#[test]
fn a_module_of_3_0_gives_the_bits_of_one_of_today() {
    let folder = tempfile::tempdir().expect("folder");
    std::fs::write(folder.path().join("terraglue.h"), HEADER).expect("written");
    let older = compile_with(folder.path(), folder.path(), "older", SOURCE, &[]);
    let newer = compile(folder.path(), "newer", SOURCE, &[]);
    let (mut older, mut newer) = (soil(&older), soil(&newer));
    assert_eq!(drive(&mut older), drive(&mut newer));
    assert!(!older.capabilities().has(Capabilities::SEES));
    assert!(older.scene().joints.is_empty() && older.subsystem().streams().is_empty());
    let mut shown = vec![false; older.scene().shapes.len()];
    crate::shape_visibility(&older, &mut shown).expect("all are shown");
    assert!(shown.iter().all(|s| *s));
}

#[test]
fn the_kept_header_is_that_of_3_0() {
    assert!(HEADER.contains("#define TG_ABI_MAJOR 3\n") && HEADER.contains("#define TG_ABI_MINOR 0\n"));
    assert!(!HEADER.contains("observe"));
}
