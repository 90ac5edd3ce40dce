//! Making, using, mixing up and ending instances.

use crate::definition::Test;
use crate::finding::{Stop, Verdict};
use crate::fixture::{Flat, Foot, SoilFixture, script};
use crate::scope::{Area, Level};
use crate::test_context::TestContext;
use terraglue_host::probe_odd_calls;
use terraglue_subsystem::{Config, Kind};

const fn test(
    name: &'static str,
    level: Level,
    kinds: &'static [Kind],
    after: &'static [&'static str],
    promise: &'static str,
    run: fn(&TestContext) -> Verdict,
) -> Test {
    Test { name, area: Area::LifeCycle, level, kinds, after, promise, run }
}

/// The tests of this area.
pub const TESTS: &[Test] = {
    use Level::{Quick, Standard};
    const SOIL: &[Kind] = &[Kind::Soil];
    &[
        test(
            "instantiates",
            Quick,
            &[],
            // A soil with a law that is wrong finds the same mistake again.
            &[
                "loads",
                "law-slope",
                "law-shear-slopes",
                "law-node-by-node",
                "law-rises",
                "law-starts-at-zero",
                "law-friction-reached",
                "law-cycles",
                "law-pause",
            ],
            "an instance can be made from usual parameters",
            instantiates,
        ),
        test(
            "steps",
            Quick,
            &[],
            &["instantiates", "host-loading"],
            "a run of a tenth of a second answers every call",
            steps,
        ),
        test(
            "many-instances",
            Standard,
            &[],
            &["steps"],
            "a thousand instances (in Python forty; thorough: five times that) can be made and ended",
            many,
        ),
        test("two-instances", Quick, &[], &["steps"], "two instances do not feel each other", two),
        test(
            "new-is-fresh",
            Quick,
            &[],
            &["steps"],
            "an instance made after others have run starts afresh",
            fresh,
        ),
        test(
            "odd-calls",
            Quick,
            &[],
            &["steps"],
            "null and wrong arguments are answered by a status",
            odd_calls,
        ),
        test(
            "wrong-config",
            Quick,
            &[],
            &["instantiates"],
            "parameters that make no sense are refused with a text",
            wrong_config,
        ),
        test("no-contact", Quick, SOIL, &["steps"], "a step without any port works", no_contact),
        test("come-and-go", Quick, SOIL, &["steps"], "feet may come, go and return", come_and_go),
        test(
            "thousand-feet",
            Standard,
            SOIL,
            &["steps"],
            "a thousand feet are carried, or refused by a status",
            thousand,
        ),
    ]
};

fn instantiates(context: &TestContext) -> Verdict {
    context.instance().map(drop)
}

fn steps(context: &TestContext) -> Verdict {
    script(context.instance()?, 100, 0).map(drop)
}

fn many(context: &TestContext) -> Verdict {
    let module = context.module()?;
    // Each in Python is a process.
    let count =
        if module.is_python() { 40 } else { 1000 } * if context.level == Level::Thorough { 5 } else { 1 };
    for _ in 0..count {
        context.instance_on(&module, Flat::LEVEL)?;
    }
    Ok(())
}

fn two(context: &TestContext) -> Verdict {
    let module = context.module()?;
    let (alone, _) = script(context.instance_on(&module, Flat::LEVEL)?, 40, 1)?;
    // The same run while others live, are made and end.
    let (first, second) =
        (context.instance_on(&module, Flat::LEVEL)?, context.instance_on(&module, Flat::LEVEL)?);
    let (_, _second) = script(second, 25, 4)?;
    let (beside, _) = script(first, 40, 1)?;
    same("a run beside another instance", &alone, &beside)
}

fn fresh(context: &TestContext) -> Verdict {
    let module = context.module()?;
    let (first, _) = script(context.instance_on(&module, Flat::LEVEL)?, 30, 2)?;
    for variant in 3..6 {
        script(context.instance_on(&module, Flat::LEVEL)?, 20, variant)?;
    }
    let (again, _) = script(context.instance_on(&module, Flat::LEVEL)?, 30, 2)?;
    same("the same run by an instance made later", &first, &again)
}

/// Whether two runs gave the same bits.
pub fn same(given: &str, a: &[u64], b: &[u64]) -> Verdict {
    let Some(k) = (0..a.len().max(b.len())).find(|k| a.get(*k) != b.get(*k)) else { return Ok(()) };
    let value =
        |bits: Option<&u64>| bits.map_or("nothing".to_owned(), |b| format!("{:e}", f64::from_bits(*b)));
    let got = format!("{} instead of {} (number {k} of {})", value(b.get(k)), value(a.get(k)), a.len());
    Err(Stop::fail("a run", given, got, "the same bytes"))
}

fn odd_calls(context: &TestContext) -> Verdict {
    context.needs_a_library("no null pointer can reach it, nothing is lost")?;
    let module = context.module()?;
    let config = context.config(module.schema()).with_defaults(module.schema());
    probe_odd_calls(&context.path, &config, &context.services()).map_err(|(call, got)| {
        Stop::fail(call, "null or wrong arguments", got, "TG_REFUSED, TG_ERROR or TG_UNSUPPORTED")
    })
}

fn wrong_config(context: &TestContext) -> Verdict {
    let module = context.module()?;
    let needs_any = module.schema().parameters.iter().any(|p| p.default.is_null() && !p.optional);
    let mut odd = vec![];
    for p in module.schema().parameters.iter().filter(|p| !p.name.contains(['.', '*'])) {
        // Parameters that the host refuses do not reach the module; these do.
        odd.push(format!("{{\"{}\": []}}", p.name));
    }
    if needs_any {
        odd.push("{}".to_owned());
    }
    for text in odd {
        let config = Config::parse(&text).unwrap_or_default();
        if let Err(error) = module.instantiate("checked", config, &context.services())
            && error.to_string().ends_with("no reason given")
        {
            return Err(Stop::fail(
                "instantiate",
                text,
                "a failure without a text",
                "last_error(NULL) says why",
            ));
        }
    }
    // The module is usable afterwards.
    context.instance().map(drop)
}

fn no_contact(context: &TestContext) -> Verdict {
    let mut fixture = SoilFixture::new(context, &[Foot::sphere(0.0, 0.0).lifted(0.3)])?;
    for _ in 0..5 {
        fixture.go(&[[0.1, 0.0, 0.0]], 1e-3)?;
    }
    Ok(())
}

fn come_and_go(context: &TestContext) -> Verdict {
    let mut fixture = SoilFixture::new(
        context,
        &[Foot::sphere(-0.1, 0.0).lifted(-1e-3), Foot::sphere(0.1, 0.0).lifted(7e-3)],
    )?;
    for k in 0..120 {
        let up = if (k / 20) % 2 == 0 { 0.4 } else { -0.4 };
        fixture.go(&[[0.0, 0.0, up], [0.0, 0.0, -up]], 1e-3)?;
    }
    Ok(())
}

fn thousand(context: &TestContext) -> Verdict {
    let place = |k: usize| Foot::sphere(-0.4 + 0.025 * (k % 32) as f64, -0.4 + 0.025 * (k / 32) as f64);
    let feet: Vec<_> = (0..1000).map(place).collect();
    let mut fixture = SoilFixture::new(context, &feet)?;
    let down = vec![[0.0, 0.0, -0.1]; feet.len()];
    match (0..3).try_for_each(|_| fixture.go(&down, 1e-3).map(drop)) {
        // A status is an answer: the soil says how many it carries.
        Err(Stop::Fail(finding)) if finding.call == "set_ports" && finding.got != "no reason given" => {
            Err(Stop::Warning(format!("it refuses a thousand feet: {}", finding.got)))
        }
        other => other,
    }
}
