//! Files that are no modules, and modules that misbehave, made by the system's C compiler: each its own message.

use super::{compile, services, step_of};
use crate::{Description, Library, LoadError, LoadedModule, SearchPath};
use std::path::{Path, PathBuf};
use terraglue_subsystem::{Config, Input, Level, Motion, Response, Step};

/// A module whose functions are given by macros; what is not given works.
const MODULE: &str = r#"
#include <stddef.h>
#include <stdlib.h>
#include "terraglue.h"
#ifndef MAJOR
#define MAJOR TG_ABI_MAJOR
TG_DESCRIBE("odd", "0.1.0");
#else
static const char *tg_description = NULL;
#endif
#ifndef ADVANCE
#define ADVANCE return TG_OK;
#endif
#ifndef SCHEMA
#define SCHEMA "{\"name\":\"odd\",\"kind\":\"soil\",\"help\":\"h\",\"parameters\":[]}"
#endif
#ifndef FREE
#define FREE destroy
#endif
static const char *schema(void) { return SCHEMA; }
static tg_status instantiate(const tg_host *h, const char *c, void **self) {
    (void)h; (void)c; *self = malloc(8); return TG_OK;
}
__attribute__((unused)) static void destroy(void *self) { free(self); }
static uint32_t capabilities(void *self) { (void)self; return TG_CAN_FORCE; }
static tg_status advance(void *self, const tg_step *s, const tg_input *in, tg_response *out) {
    (void)self; (void)in; (void)s;
    for (uint32_t k = 0; k < s->n; k++) out->x[k] = out->v[k] = out->a[k] = out->t[k] = 0.0;
    ADVANCE
    return TG_OK;
}
static const char *last_error(void *self) { (void)self; return "out of sand"; }
static const tg_subsystem table = {
    .size = sizeof table, .abi_major = MAJOR, .kind = TG_SOIL, .id = "odd", .schema = schema,
    .instantiate = instantiate, .free = FREE, .capabilities = capabilities, .advance = advance,
    .last_error = last_error,
};
const tg_subsystem *terraglue_subsystem(void) { (void)tg_description; return &table; }
"#;

fn odd(folder: &Path, defines: &[&str]) -> PathBuf {
    compile(folder, "odd", MODULE, defines)
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("folder")
}

fn message(path: &Path) -> String {
    LoadedModule::load(path).expect_err("refused").to_string()
}

#[test]
fn files_that_are_no_library() {
    let folder = folder();
    let path = folder.path().join("libtext_plugin.so");
    let missing = LoadedModule::load(&path).expect_err("missing");
    assert!(matches!(missing, LoadError::MissingFile { .. }), "{missing}");
    std::fs::write(&path, "just text").expect("written");
    let text = message(&path);
    assert!(text.ends_with("is not a shared library: it has no ELF header"), "{text}");
    std::fs::write(&path, "").expect("written");
    assert!(message(&path).ends_with("the file is empty"));
    // A library that was cut off must not reach the system's loader, which would end the process.
    let whole = std::fs::read(odd(folder.path(), &[])).expect("library");
    for length in [20, whole.len() / 4, whole.len() / 2, whole.len() - 1] {
        std::fs::write(&path, &whole[..length]).expect("written");
        let text = message(&path);
        assert!(text.ends_with(&format!("it is cut off after {length} bytes")), "{text}");
    }
    // Whole, but for another machine: the system would only say that there is no such file.
    let mut foreign = whole;
    foreign[0x12] = 0x28;
    std::fs::write(&path, &foreign).expect("written");
    let other = LoadedModule::load(&path).expect_err("another machine");
    assert!(other.to_string().contains("another kind of machine (ELF number 40)"), "{other}");
}

#[test]
fn a_library_without_the_symbol() {
    let folder = folder();
    let path = compile(folder.path(), "plain", "int answer(void) { return 42; }", &[]);
    let text = message(&path);
    assert!(text.contains("no Terraglue module") && text.contains("undefined symbol"), "{text}");
}

/// Version of the ABI that this program speaks.
fn abi() -> String {
    format!("{}.{}", terraglue_plugin::abi::TG_ABI_MAJOR, terraglue_plugin::abi::TG_ABI_MINOR)
}

#[test]
fn a_wrong_version_with_and_without_a_section() {
    let folder = folder();
    let text = message(&odd(folder.path(), &["MAJOR=9"]));
    let wanted = format!("built for ABI 9.0, this program speaks ABI {}", abi());
    assert!(text.contains(&wanted), "{text}");
    let path = compile(
        folder.path(),
        "future",
        "__attribute__((section(\".terraglue\"), used)) static const char d[] = \"terraglue module\\nname=f\\nabi=7.3\\n\";\
         __attribute__((constructor)) static void run(void) { __builtin_trap(); }",
        &[],
    );
    // Found by the section: the constructor, which would end the process, never runs.
    let text = message(&path);
    assert!(text.contains("built for ABI 7.3"), "{text}");
}

#[test]
fn tables_and_schemas_that_cannot_be_used() {
    // A folder each: the system keeps what it has loaded by file.
    let [table, empty, none] = [folder(), folder(), folder()];
    let text = message(&odd(table.path(), &["FREE=NULL"]));
    assert!(text.contains("required function `free`"), "{text}");
    let text = message(&odd(empty.path(), &["SCHEMA=\"{}\""]));
    assert!(text.contains("does not describe itself") && text.contains("missing field `name`"), "{text}");
    let text = message(&odd(none.path(), &["SCHEMA=NULL"]));
    assert!(text.contains("out of sand"), "{text}");
}

/// Message of the host for a step with the given body of `advance`.
fn step_message(advance: &str) -> String {
    let folder = folder();
    let module = LoadedModule::load(&odd(folder.path(), &[&format!("ADVANCE={advance}")])).expect("loads");
    let mut soil = module.instantiate("soil", Config::default(), &services()).expect("instance");
    let ports = [super::port(5, 0, 0.0)];
    let step = Step { t: 2.5, ..step_of(&ports, 3) };
    let [mut x, mut v, mut a, mut t] = [[0.0; 3]; 4];
    let mut out = Response { x: &mut x, v: &mut v, a: &mut a, t: &mut t, reached: 0.0, flags: 0 };
    let input = Input::Motion(Motion { x: &[0.0; 3], v: &[0.0; 3] });
    soil.advance(&step, &input, &mut out).expect_err("fails").to_string()
}

#[test]
fn answers_that_are_wrong_name_module_function_time_and_port() {
    assert_eq!(
        step_message("out->t[1] = 0.0 / 0.0;"),
        "soil (odd): advance failed at t = 2.5 s: t is NaN at component t1 of port 0 (key 0x5); every component \
         must be answered"
    );
    assert!(step_message("out->x[0] = 1.0 / 0.0;").contains("x is inf at component n"));
    assert_eq!(step_message("return TG_ERROR;"), "soil (odd): advance failed at t = 2.5 s: out of sand");
    assert!(step_message("return TG_UNSUPPORTED;").ends_with("not supported"));
    assert!(step_message("return 12345;").contains("unknown status 12345"));
    assert!(step_message("out->reached = 7.0; return TG_DISCARD;").contains("outside the step"));
    assert!(step_message("out->reached = s->t - 1.0;").contains("ended early"));
}

#[test]
fn a_capability_that_is_missing_is_an_error_of_the_call() {
    let folder = folder();
    let module = LoadedModule::load(&odd(folder.path(), &[])).expect("loads");
    let mut soil = module.instantiate("soil", Config::default(), &services()).expect("instance");
    let error =
        soil.interface_jacobian(&Step::free(0.0, 1e-3, 0), Level::Position, &mut []).expect_err("null");
    assert_eq!(error.to_string(), "soil (odd): interface_jacobian failed at t = 0 s: not supported");
}

#[test]
fn an_unknown_module_lists_where_it_was_looked_for_and_the_nearest_name() {
    let folder = folder();
    odd(folder.path(), &[]);
    let search = SearchPath::only(vec![folder.path().into(), "/nowhere/else".into()]);
    let error = Library::new().find("od", &search, Path::new(".")).expect_err("unknown");
    assert_eq!(error.nearest(), Some("odd"));
    let text = error.to_string();
    assert!(
        text.starts_with(
            "[TG01] no module `od`, did you mean `odd`?; looked for libod_plugin.so or od.py in:\n"
        ),
        "{text}"
    );
    assert!(
        text.contains(&folder.path().display().to_string()) && text.contains("\n  /nowhere/else"),
        "{text}"
    );
    let by_name = Library::new().find("odd", &search, Path::new(".")).expect("found");
    let by_path =
        Library::new().find("./libodd_plugin.so", &SearchPath::default(), folder.path()).expect("found");
    assert_eq!(by_name.schema(), by_path.schema());
    let listed = crate::available_modules(&search);
    assert_eq!((listed.len(), listed[0].name.as_str()), (1, "odd"));
    assert!(listed[0].schema.is_ok());
    let description = Description::read(&listed[0].path).expect("section");
    assert_eq!((description.name.as_str(), description.abi.as_str()), ("odd", abi().as_str()));
}
