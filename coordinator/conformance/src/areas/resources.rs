//! Memory, threads and time.

use super::life_cycle::same;
use crate::definition::Test;
use crate::finding::{Stop, Verdict};
use crate::fixture::{Flat, Runner, script};
use crate::scope::{Area, Level};
use crate::test_context::TestContext;
use rustix::time::{ClockId, clock_gettime};
use terraglue_host::{AllocationCounter, heap_in_use};

const fn test(
    name: &'static str,
    level: Level,
    after: &'static [&'static str],
    promise: &'static str,
    run: fn(&TestContext) -> Verdict,
) -> Test {
    Test { name, area: Area::Resources, level, kinds: &[], after, promise, run }
}

/// The tests of this area.
pub const TESTS: &[Test] = {
    use Level::{Quick, Standard};
    &[
        test("no-allocation", Quick, &["steps"], "once it runs, a step allocates nothing", no_allocation),
        test("no-leak-steps", Quick, &["steps"], "memory does not grow with the number of steps", leak_steps),
        test(
            "no-leak-instances",
            Standard,
            &["steps"],
            "memory does not grow with instances that have ended",
            leak_instances,
        ),
        test(
            "four-threads",
            Standard,
            &["same-again"],
            "four instances on four threads give the bytes of one",
            four_threads,
        ),
        test(
            "time-per-step",
            Quick,
            &["steps"],
            "a step with two feet takes less than a millisecond",
            time_per_step,
        ),
    ]
};

/// Reason to skip for a module in Python.
const MEMORY: &str = "its memory is not watched";

/// The same way again and again: nothing new appears after the first two rounds.
fn no_allocation(context: &TestContext) -> Verdict {
    context.needs_a_library(MEMORY)?;
    let module = context.module()?;
    let Some(counter) = AllocationCounter::new(&context.path) else {
        return Err(Stop::Skip("its calls of malloc cannot be counted on this platform".into()));
    };
    let mut runner = Runner::new(context.instance_on(&module, Flat::LEVEL)?)?;
    let start = runner.place();
    for _ in 0..2 {
        runner.run(0..80, 0)?;
        runner.put_back(&start);
    }
    let before = counter.count();
    runner.run(0..80, 0)?;
    match counter.count() - before {
        0 => Ok(()),
        n => Err(Stop::fail(
            "a run of 80 steps",
            "a way gone twice before",
            format!("{n} allocations"),
            "none",
        )),
    }
}

fn leak_steps(context: &TestContext) -> Verdict {
    context.needs_a_library(MEMORY)?;
    let mut runner = Runner::new(context.instance()?)?;
    let start = runner.place();
    let round = || {
        for _ in 0..5 {
            runner.run(0..80, 0)?;
            runner.put_back(&start);
        }
        Ok::<_, Stop>(heap_in_use())
    };
    match growth(round)? {
        0..3_200 => Ok(()),
        grown => Err(Stop::fail(
            "a run of 400 steps",
            "the third time",
            format!("{grown} bytes more in use"),
            "no growth",
        )),
    }
}

fn leak_instances(context: &TestContext) -> Verdict {
    context.needs_a_library(MEMORY)?;
    let module = context.module()?;
    let round = || {
        for _ in 0..40 {
            script(context.instance_on(&module, Flat::LEVEL)?, 3, 0)?;
        }
        Ok::<_, Stop>(heap_in_use())
    };
    match growth(round)? {
        0..640 => Ok(()),
        grown => Err(Stop::fail(
            "free",
            "40 instances after a run each",
            format!("{grown} bytes still in use"),
            "all memory back",
        )),
    }
}

/// Bytes by which the heap grows in every round after the first. The allocator keeps some of what is freed in lists of
/// its own, so one round proves little: the smallest growth of three counts.
fn growth(mut round: impl FnMut() -> Verdict<Option<usize>>) -> Verdict<usize> {
    let mut sizes = Vec::new();
    for _ in 0..4 {
        let size = round()?;
        sizes.push(size.ok_or_else(|| Stop::Skip("the heap cannot be measured with this C library".into()))?);
    }
    Ok(sizes.windows(2).skip(1).map(|w| w[1].saturating_sub(w[0])).min().unwrap_or(0))
}

fn four_threads(context: &TestContext) -> Verdict {
    let module = context.module()?;
    let (alone, _) = script(context.instance_on(&module, Flat::LEVEL)?, 60, 0)?;
    for round in 0..context.count(4) {
        let together: Vec<Verdict<Vec<u64>>> = std::thread::scope(|scope| {
            let run = || script(context.instance_on(&module, Flat::LEVEL)?, 60, 0).map(|(bits, _)| bits);
            let jobs: Vec<_> = (0..4).map(|_| scope.spawn(run)).collect();
            let panicked = || Stop::fail("a run", "on one of four threads", "a panic", "an answer");
            jobs.into_iter().map(|job| job.join().map_err(|_| panicked())?).collect()
        });
        for bits in together {
            same(&format!("round {} of four instances on four threads", round + 1), &alone, &bits?)?;
        }
    }
    Ok(())
}

fn time_per_step(context: &TestContext) -> Verdict {
    let mut runner = Runner::new(context.instance()?)?;
    runner.run(0..20, 0)?;
    let now = || {
        let t = clock_gettime(ClockId::ThreadCPUTime);
        t.tv_sec as f64 + 1e-9 * t.tv_nsec as f64
    };
    let mut times = Vec::new();
    for k in 20..80 {
        let start = now();
        runner.step(k, 0, 0, &mut Vec::new())?;
        times.push(now() - start);
    }
    times.sort_by(f64::total_cmp);
    let median = times[times.len() / 2];
    if median < 1e-3 {
        return Ok(());
    }
    Err(Stop::Warning(format!("a step takes {:.2} ms of processor time (median of 60)", 1e3 * median)))
}
