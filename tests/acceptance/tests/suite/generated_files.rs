//! Files of `docs/` that are made from code are up to date.

use std::path::Path;
use terraglue::scenario::{docs, schema};

fn read(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs").join(name);
    std::fs::read_to_string(path).expect("readable")
}

#[test]
fn the_scenario_schema_is_up_to_date() {
    assert!(read("scenario.schema.json") == schema::text(), "run `cargo xtask schema`");
}

#[test]
fn the_key_tables_are_up_to_date() {
    assert!(read("scenario.md").contains(&docs::keys_markdown()), "run `cargo xtask schema`");
}
