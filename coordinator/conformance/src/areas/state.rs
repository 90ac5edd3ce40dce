//! Saving, going back, trying without leaving a trace.

use super::life_cycle::same;
use crate::definition::Test;
use crate::finding::{Stop, Verdict};
use crate::fixture::{Runner, committed};
use crate::other_process::{RemoteRun, in_other_process};
use crate::scope::{Area, Level};
use crate::test_context::TestContext;
use terraglue_subsystem::Capabilities;

const fn test(
    name: &'static str,
    level: Level,
    after: &'static [&'static str],
    promise: &'static str,
    run: fn(&TestContext) -> Verdict,
) -> Test {
    Test { name, area: Area::State, level, kinds: &[], after, promise, run }
}

/// The tests of this area.
pub const TESTS: &[Test] = {
    use Level::{Quick, Standard};
    &[
        test(
            "trials-invisible",
            Quick,
            &["steps"],
            "trials leave the committed state alone",
            trials_invisible,
        ),
        test(
            "trials-repeat",
            Quick,
            &["steps"],
            "a trial answers the same whatever was tried before it",
            trials_repeat,
        ),
        test("save-restore", Quick, &["trials-repeat"], "a saved state replays byte for byte", save_restore),
        test("slots", Quick, &["save-restore"], "every slot keeps its own state", slots),
        test("save-is-invisible", Quick, &["save-restore"], "saving changes nothing", save_invisible),
        test(
            "serialize",
            Quick,
            &["trials-repeat"],
            "a serialized state goes on in another instance",
            serialize,
        ),
        test("serialize-process", Standard, &["serialize"], "and in another process", serialize_process),
        test(
            "serialize-garbage",
            Quick,
            &["serialize"],
            "cut or random bytes are refused, and nothing has changed",
            garbage,
        ),
        test("poisoned-memory", Quick, &["steps"], "nothing is read that was not written first", poisoned),
    ]
};

fn runner(context: &TestContext) -> Verdict<Runner> {
    Runner::new(context.instance()?)
}

fn needs(runner: &Runner, what: Capabilities, cost: &str) -> Verdict {
    if runner.instance().capabilities().has(what) { Ok(()) } else { Err(Stop::Skip(cost.into())) }
}

const NO_RETRY: &str = "no repeatable trials: only single-pass strategies can use it";
const NO_STATE: &str = "no save and restore: no snapshots, no going back";
const NO_BYTES: &str = "no serialize: a run cannot go on another day or in another process";

fn trials_invisible(context: &TestContext) -> Verdict {
    let mut tried = runner(context)?;
    needs(&tried, Capabilities::RETRY, NO_RETRY)?;
    for k in 0..40 {
        let before = committed(tried.instance())?;
        tried.try_only(k, 3)?;
        same("committed values after trials", &before, &committed(tried.instance())?)?;
        tried.step(k, 0, 0, &mut Vec::new())?;
    }
    Ok(())
}

fn trials_repeat(context: &TestContext) -> Verdict {
    let (mut plain, mut tried) = (runner(context)?, runner(context)?);
    needs(&tried, Capabilities::RETRY, NO_RETRY)?;
    for k in 0..60 {
        let (mut a, mut b) = (Vec::new(), Vec::new());
        plain.step(k, 0, 0, &mut a)?;
        tried.step(k, 0, 1 + k % 4, &mut b)?;
        same(&format!("step {k} after {} other trials", 1 + k % 4), &a, &b)?;
    }
    same(
        "the committed state after a run with other trials",
        &committed(plain.instance())?,
        &committed(tried.instance())?,
    )
}

fn save_restore(context: &TestContext) -> Verdict {
    let mut runner = runner(context)?;
    needs(&runner, Capabilities::STATE, NO_STATE)?;
    for (from, to) in [(10, 50), (50, 90)] {
        runner.run(from - 10..from, 0)?;
        let (place, before) = (runner.place(), committed(runner.instance())?);
        runner.instance_mut().save_state(1)?;
        let first = runner.run(from..to, 0)?;
        // Disturb: another way, then back.
        runner.put_back(&place);
        runner.run(from..from + 15, 3)?;
        runner.put_back(&place);
        runner.instance_mut().restore_state(1)?;
        same("committed values after restore_state", &before, &committed(runner.instance())?)?;
        let again = runner.run(from..to, 0)?;
        same(&format!("steps {from} to {to}, again after restore_state"), &first, &again)?;
        runner.put_back(&place);
        runner.instance_mut().restore_state(1)?;
        runner.run(from..to, 0)?;
    }
    Ok(())
}

fn slots(context: &TestContext) -> Verdict {
    let mut runner = runner(context)?;
    needs(&runner, Capabilities::STATE, NO_STATE)?;
    let slots = context.services().slots;
    let mut kept = Vec::new();
    for slot in 0..slots {
        runner.run(10 * slot as usize..10 * (slot as usize + 1), 0)?;
        runner.instance_mut().save_state(slot)?;
        kept.push(committed(runner.instance())?);
    }
    let mut random = context.random("slots");
    for _ in 0..3 * slots {
        let slot = (random.unit() * f64::from(slots)) as u32 % slots;
        runner.instance_mut().restore_state(slot)?;
        same(
            &format!("committed values after restore_state({slot})"),
            &kept[slot as usize],
            &committed(runner.instance())?,
        )?;
    }
    Ok(())
}

fn save_invisible(context: &TestContext) -> Verdict {
    let (mut plain, mut saved) = (runner(context)?, runner(context)?);
    needs(&saved, Capabilities::STATE, NO_STATE)?;
    for k in 0..50 {
        let (mut a, mut b) = (Vec::new(), Vec::new());
        plain.step(k, 0, 0, &mut a)?;
        saved.instance_mut().save_state((k % 3) as u32)?;
        saved.step(k, 0, 0, &mut b)?;
        same(&format!("step {k} after save_state"), &a, &b)?;
    }
    Ok(())
}

fn serialize(context: &TestContext) -> Verdict {
    let mut first = runner(context)?;
    needs(&first, Capabilities::SERIALIZE, NO_BYTES)?;
    first.run(0..45, 0)?;
    let (bytes, place) = (first.instance().serialize()?, first.place());
    let mut other = runner(context)?;
    other.run(0..7, 2)?;
    other.instance_mut().deserialize(&bytes)?;
    other.put_back(&place);
    same(
        "committed values of another instance after deserialize",
        &committed(first.instance())?,
        &committed(other.instance())?,
    )?;
    let again = other.instance().serialize()?;
    if again != bytes {
        let got = format!("{} bytes that differ from the {} given", again.len(), bytes.len());
        return Err(Stop::fail("serialize", "after deserialize of its own bytes", got, "the same bytes"));
    }
    same("steps 45 to 85 of another instance", &first.run(45..85, 0)?, &other.run(45..85, 0)?)
}

fn serialize_process(context: &TestContext) -> Verdict {
    let mut here = runner(context)?;
    needs(&here, Capabilities::SERIALIZE, NO_BYTES)?;
    here.run(0..45, 0)?;
    let folder = tempfile::tempdir().map_err(|e| Stop::Skip(format!("no folder: {e}")))?;
    let file = folder.path().join("state");
    std::fs::write(&file, here.instance().serialize()?).map_err(|e| Stop::Skip(format!("no file: {e}")))?;
    let mut bits = here.run(45..85, 0)?;
    bits.extend(committed(here.instance())?);
    let there = in_other_process(context, &RemoteRun { steps: 45..85, variant: 0, state: Some(file) }, &[])?;
    same("steps 45 to 85 in another process", &bits, &there)
}

fn garbage(context: &TestContext) -> Verdict {
    let mut runner = runner(context)?;
    needs(&runner, Capabilities::SERIALIZE, NO_BYTES)?;
    runner.run(0..30, 0)?;
    let bytes = runner.instance().serialize()?;
    let before = committed(runner.instance())?;
    let mut random = context.random("serialize-garbage");
    let mut bad: Vec<(String, Vec<u8>)> = Vec::new();
    for share in [0.0, 0.1, 0.5, 0.9] {
        let length = (share * bytes.len() as f64) as usize;
        bad.push((format!("the first {length} of {} bytes", bytes.len()), bytes[..length].to_vec()));
    }
    let noise: Vec<u8> = (0..bytes.len()).map(|_| (256.0 * random.unit()) as u8).collect();
    bad.push((format!("{} random bytes", noise.len()), noise));
    bad.push(("its own bytes and one more".into(), [&bytes[..], &[0]].concat()));
    for (given, bytes) in bad {
        if runner.instance_mut().deserialize(&bytes).is_ok() {
            return Err(Stop::fail("deserialize", given, "success", "TG_REFUSED"));
        }
        same(
            &format!("committed values after deserialize of {given}"),
            &before,
            &committed(runner.instance())?,
        )?;
    }
    runner.run(30..40, 0).map(drop)
}

fn poisoned(context: &TestContext) -> Verdict {
    let run = |pattern| in_other_process(context, &RemoteRun::fresh(90), &[("MALLOC_PERTURB_", pattern)]);
    let (zero, poison) = (run("0")?, run("165")?);
    same("the run with fresh memory filled with 0x5a instead of zeros", &zero, &poison)?;
    same("the run with fresh memory filled with 0xe7", &zero, &run("24")?)
}
