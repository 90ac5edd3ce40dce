//! Tests of the file: symbols, table, description, schema.

use crate::definition::Test;
use crate::finding::{Stop, Verdict};
use crate::scope::{Area, Level};
use crate::test_context::TestContext;
use terraglue_fmi::elf::exported_symbols;
use terraglue_host::{LoadedModule, described, table_of};
use terraglue_plugin::abi::{TG_ABI_MAJOR, TG_ABI_MINOR, TgSubsystem};
use terraglue_subsystem::{Parameter, ParameterType, unit::Unit};

const fn test(
    name: &'static str,
    after: &'static [&'static str],
    promise: &'static str,
    run: fn(&TestContext) -> Verdict,
) -> Test {
    Test { name, area: Area::Library, level: Level::Quick, kinds: &[], after, promise, run }
}

/// The tests of this area.
pub const TESTS: &[Test] = {
    &[
        test("loads", &[], "the library loads with every symbol resolved, and its table can be used", loads),
        test("exports", &["loads"], "it exports the entry symbol only", exports),
        test("handshake", &["loads"], "the table states its size and versions truly", handshake),
        test(
            "description",
            &["loads"],
            "its section describes it, and the table shows the same text",
            description,
        ),
        test("schema", &["loads"], "names, units, ranges and defaults of its parameters agree", schema),
        test("schema-again", &["schema"], "it describes itself the same way every time", schema_again),
    ]
};

fn loads(context: &TestContext) -> Verdict {
    let module = LoadedModule::load(&context.path).map_err(|e| {
        Stop::fail("loading", context.path.display().to_string(), e.to_string(), "a module that can be used")
    })?;
    match context.missing_path(module.schema()) {
        Some(name) => Err(Stop::Warning(format!(
            "the parameter `{name}` is the path of a file: give one with --set {name}=FILE or in the file beside the module"
        ))),
        None => Ok(()),
    }
}

fn exports(context: &TestContext) -> Verdict {
    context.needs_a_library("it has no symbols that could clash, nothing is lost")?;
    let bytes = std::fs::read(&context.path).unwrap_or_default();
    let Some(names) = exported_symbols(&bytes) else {
        return Err(Stop::Skip("its symbol table cannot be read: names that clash are not found".into()));
    };
    let others: Vec<_> = names.iter().filter(|n| *n != terraglue_plugin::ENTRY).map(String::as_str).collect();
    if others.is_empty() {
        return Ok(());
    }
    let some = others.iter().take(5).copied().collect::<Vec<_>>().join(", ");
    Err(Stop::fail(
        "loading",
        "the symbol table of the library",
        format!("{} more exported symbols: {some}", others.len()),
        "`terraglue_subsystem` alone; make the others static, or build with -fvisibility=hidden",
    ))
}

fn handshake(context: &TestContext) -> Verdict {
    context.needs_a_library("the program brings its side of the table, nothing is lost")?;
    let table = table_of(&context.path)
        .map_err(|e| Stop::fail("terraglue_subsystem", "no arguments", e.to_string(), "a table"))?;
    let whole = size_of::<TgSubsystem>() as u32;
    let given = "the table";
    if table.abi_minor > TG_ABI_MINOR {
        return Err(Stop::Warning(format!(
            "it was built for ABI {TG_ABI_MAJOR}.{}; what is newer than {TG_ABI_MAJOR}.{TG_ABI_MINOR} is not used",
            table.abi_minor
        )));
    }
    if table.abi_minor == TG_ABI_MINOR && table.size != whole {
        let expected = format!("{whole} bytes: `.size = sizeof table`");
        return Err(Stop::fail(
            "terraglue_subsystem",
            given,
            format!("a size of {} bytes", table.size),
            expected,
        ));
    }
    if !table.id_is_set {
        return Err(Stop::fail("terraglue_subsystem", given, "`id` is null", "the name of the module"));
    }
    Ok(())
}

fn description(context: &TestContext) -> Verdict {
    let Some(section) = described(&context.path) else {
        return Err(Stop::fail(
            "loading",
            "the section .terraglue",
            "there is none",
            "a description: TG_DESCRIBE(name, version) in C, export_subsystem! in Rust",
        ));
    };
    let module = context.own_module()?;
    if module.is_python() {
        return named_as_its_file(context, &section.name);
    }
    let kind = format!("{:?}", module.schema().kind).to_lowercase();
    if !section.kind.is_empty() && section.kind != kind {
        let got = format!("the section says `kind={}`, the schema `{kind}`", section.kind);
        return Err(Stop::fail("schema", "the section .terraglue", got, "the same kind in both"));
    }
    let (named, own) = (section.name.trim_end_matches("-plugin"), &module.schema().name);
    if named != own {
        let got = format!("the section names `{}`, the schema `{own}`", section.name);
        return Err(Stop::fail("schema", "the section .terraglue", got, "the same name in both"));
    }
    let table = table_of(&context.path)
        .map_err(|e| Stop::fail("terraglue_subsystem", "", e.to_string(), "a table"))?;
    match table.description {
        Some(text) if terraglue_host::Description::parse(&text).as_ref() == Some(&section) => Ok(()),
        Some(_) => {
            let got = "the text of the table is not that of the section";
            Err(Stop::fail(
                "terraglue_subsystem",
                "`description`",
                got,
                "the same text before and after loading",
            ))
        }
        None => {
            let got = "`description` is null";
            Err(Stop::fail("terraglue_subsystem", "the table", got, ".description = tg_description"))
        }
    }
}

/// A scenario that names a module in Python finds it by its file.
fn named_as_its_file(context: &TestContext, name: &str) -> Verdict {
    let stem = context.path.file_stem().and_then(|s| s.to_str()).unwrap_or_default();
    if name.replace('-', "_") == stem {
        return Ok(());
    }
    let got = format!("the docstring names `{name}`, the file is {stem}.py");
    Err(Stop::fail("loading", "the docstring", got, "the same name, with `_` for `-` in that of the file"))
}

fn schema(context: &TestContext) -> Verdict {
    let module = context.own_module()?;
    let schema = module.schema();
    let wrong = |p: &Parameter, got: String, expected: &str| {
        Err(Stop::fail("schema", format!("parameter `{}`", p.name), got, expected))
    };
    if schema.help.trim().is_empty() {
        return Err(Stop::fail("schema", "the module", "its help is empty", "one line for people"));
    }
    let mut names: Vec<&str> = Vec::new();
    for p in &schema.parameters {
        if names.contains(&p.name.as_str()) {
            return wrong(p, "it is listed twice".into(), "every name once");
        }
        names.push(&p.name);
        if p.help.trim().is_empty() {
            return wrong(p, "its help is empty".into(), "one line for people");
        }
        if let Err(e) = Unit::parse(&p.unit) {
            return wrong(
                p,
                format!("its unit `{}`: {e}", p.unit),
                "SI symbols separated by spaces, e.g. \"N m\"",
            );
        }
        if let (Some(min), Some(max)) = (p.min, p.max)
            && min > max
        {
            return wrong(p, format!("its range runs from {min} to {max}"), "min ≤ max");
        }
        default_fits(p)?;
    }
    Ok(())
}

/// Type and range of a default.
fn default_fits(p: &Parameter) -> Verdict {
    let d = &p.default;
    let right_type = d.is_null()
        || match p.parameter_type {
            ParameterType::Number => d.is_number(),
            ParameterType::Integer => d.is_i64() || d.is_u64(),
            ParameterType::Bool => d.is_boolean(),
            ParameterType::Text | ParameterType::Path => d.is_string(),
            ParameterType::Numbers | ParameterType::Tables => d.is_array(),
            ParameterType::NumberTable => d.is_object(),
            ParameterType::NumberByName => d.is_number() || d.is_object(),
            ParameterType::TextByName => d.is_string() || d.is_object(),
        };
    let fail = |expected: String| {
        Err(Stop::fail("schema", format!("parameter `{}`", p.name), format!("its default is {d}"), expected))
    };
    if !right_type {
        return fail(format!("a value of the type {:?}", p.parameter_type));
    }
    if let Some(x) = d.as_f64() {
        let low = p.min.is_some_and(|min| x < min || (p.above_min && x <= min));
        if low || p.max.is_some_and(|max| x > max) {
            return fail(format!("a value inside its own range, {:?} to {:?}", p.min, p.max));
        }
    }
    match d.as_str() {
        Some(text) if !p.choices.is_empty() && !p.choices.iter().any(|c| c == text) => {
            fail(format!("one of its own choices: {}", p.choices.join(", ")))
        }
        _ => Ok(()),
    }
}

fn schema_again(context: &TestContext) -> Verdict {
    let first = context.own_module()?;
    drop(context.instance());
    for _ in 0..3 {
        let again = context.own_module()?;
        if again.schema() != first.schema() {
            return Err(Stop::fail("schema", "asked again", "another text", "the same text as at first"));
        }
    }
    Ok(())
}
