//! The process of the host is the same before and after: loading and every call leave it alone.

use crate::definition::Test;
use crate::finding::{Stop, Verdict};
use crate::fixture::script;
use crate::scope::{Area, Level};
use crate::test_context::TestContext;
use terraglue_host::Process;

/// The test whose output the watching process looks at.
pub const OUTPUT: &str = "host-output";

const fn test(name: &'static str, promise: &'static str, run: fn(&TestContext) -> Verdict) -> Test {
    let after = &["steps"];
    Test { name, area: Area::Library, level: Level::Quick, kinds: &[], after, promise, run }
}

/// Tests before an instance takes its first step: the effect of a changed mode on its numbers is the same finding.
pub const AT_LOADING: &[Test] = {
    let promise = "loading leaves rounding, denormal numbers and traps as they were";
    &[Test { after: &["loads"], ..test("host-loading", promise, floating_point_loading) }]
};

/// The other tests of this area.
pub const TESTS: &[Test] = {
    &[
        test("host-floating-point", "rounding, denormal numbers and traps stay as they were", floating_point),
        test("host-signals", "no signal handler is set", |context| {
            untouched(context, "signal handlers", |p| p.signals.clone())
        }),
        test("host-locale", "the locale stays", |context| {
            untouched(context, "the locale", |p| p.locale.clone())
        }),
        test("host-directory", "the working directory stays", |context| {
            untouched(context, "the working directory", |p| p.directory.clone())
        }),
        test("host-environment", "environment variables and umask stay", |context| {
            untouched(context, "the environment", |p| p.environment.clone())
        }),
        test("host-threads", "no thread is left behind", |context| {
            untouched(context, "threads", |p| p.threads.clone())
        }),
        test("host-files", "no file is left open", |context| {
            untouched(context, "open files", |p| p.files.clone())
        }),
        test(OUTPUT, "nothing is printed: lines go through the host's log", output),
    ]
};

fn untouched(context: &TestContext, what: &str, look: fn(&Process) -> String) -> Verdict {
    context.needs_a_library("it cannot touch that of the host, nothing is lost")?;
    let before = look(&Process::now());
    let module = context.module()?;
    let then = |call: &str| {
        let now = look(&Process::now());
        if now == before {
            return Ok(());
        }
        let got = format!("{what} changed from {before} to {now}");
        Err(Stop::fail(call, "the process of the host", got, "no change"))
    };
    then("loading")?;
    let instance = context.instance_on(&module, crate::fixture::Flat::LEVEL)?;
    then("instantiate")?;
    let (_, instance) = script(instance, 60, 0)?;
    then("a run of 60 steps")?;
    drop(instance);
    then("free")
}

/// Alone, since after it every answer can be another: a library built with -ffast-math is one finding.
fn floating_point_loading(context: &TestContext) -> Verdict {
    context.needs_a_library("it cannot touch that of the host, nothing is lost")?;
    let before = Process::now().floating_point;
    context.own_module()?;
    let now = Process::now().floating_point;
    if now == before {
        return Ok(());
    }
    let got = format!("the floating-point mode changed from {before} to {now}");
    let expected =
        "no change; libraries that are linked with -ffast-math or -Ofast flush denormal numbers to 0";
    Err(Stop::fail("loading", "the process of the host", got, expected))
}

/// On this thread, in which the library is loaded and called.
fn floating_point(context: &TestContext) -> Verdict {
    untouched(context, "the floating-point mode", |p| p.floating_point.clone())
}

/// The process that watches this one sees its output.
fn output(context: &TestContext) -> Verdict {
    let (_, instance) = script(context.instance()?, 60, 0)?;
    drop(instance);
    Ok(())
}
