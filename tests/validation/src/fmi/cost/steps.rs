//! CPU time per FMU and step of a testbed, and of the bare loop in C in the same run.

use super::super::{built, fmus};
use crate::process::{Outcome, command, must, read, root};
use crate::timing::cpu_s;
use crate::{Figure, Limit};
use std::path::Path;
use terraglue::recording::Trace;
use terraglue_numerics::extremes::smaller;

const LOOP: &str = "tests/validation/src/fmi/cost/bare_loop.c";
const ROUNDS: u32 = 15;
/// Times that both are measured, one after the other; the least counts, because others use the machine too.
const TURNS: u32 = 3;
/// µs that a testbed may cost beyond the loop in C.
const ALLOWED: f64 = 0.1;

/// How many FMUs, and how they are joined.
pub struct FmuCase {
    pub name: &'static str,
    pub fmus: usize,
    pub pair: bool,
}

/// Cases that are measured, here and with other masters.
pub const CASES: [FmuCase; 4] = [
    FmuCase { name: "one", fmus: 1, pair: false },
    FmuCase { name: "pair", fmus: 2, pair: true },
    FmuCase { name: "chain_10", fmus: 10, pair: false },
    FmuCase { name: "chain_50", fmus: 50, pair: false },
];

/// A manner of running a case.
#[derive(Clone, Copy)]
struct Manner {
    record: bool,
    save: bool,
}

/// Nothing recorded, no step taken back.
const BLIND: Manner = Manner { record: false, save: false };

/// Cost of a step of a case in a testbed, µs of CPU per FMU.
pub fn blind(folder: &Path, case: &FmuCase) -> Outcome<f64> {
    testbed(folder, case, BLIND)
}

pub fn figures(folder: &Path) -> Outcome<Vec<Figure>> {
    fmus::build(folder, "cheap", &[("u", 'i', 1.0), ("y", 'o', 0.0)], "", "v[1] += h * v[0];")?;
    // the outputs of a chain depend on the inputs of the same time
    fmus::build(folder, "through", &[("u", 'i', 1.0), ("y", 'o', 0.0)], "v[1] = 0.5 * v[0];", "")?;
    let program = folder.join("bare_loop");
    read(&root().join(LOOP))?;
    must(command("cc", &["-O2", "-w", LOOP, "-ldl", "-o"]).arg(&program))?;
    let mut all = Vec::new();
    for case in &CASES {
        all.extend(compared(folder, &program, case, "", BLIND)?);
    }
    for case in &CASES {
        all.extend(compared(folder, &program, case, "recorded.", Manner { record: true, ..BLIND })?);
    }
    all.extend(compared(folder, &program, &CASES[0], "rollback.", Manner { save: true, ..BLIND })?);
    Ok(all)
}

fn compared(
    folder: &Path,
    program: &Path,
    case: &FmuCase,
    prefix: &str,
    manner: Manner,
) -> Outcome<Vec<Figure>> {
    let (mut bare, mut ours) = (f64::INFINITY, f64::INFINITY);
    for _ in 0..TURNS {
        bare = smaller(bare, bare_loop(folder, program, case, manner)?);
        ours = smaller(ours, testbed(folder, case, manner)?);
    }
    let id = |which: &str| format!("fmi.cost.{prefix}{}.{which}", case.name);
    let with = match (manner.record, manner.save) {
        (true, _) => "one output of each recorded in memory",
        (_, true) => "each step can be taken back",
        _ => "nothing recorded",
    };
    let what = |who: &str| format!("µs of CPU per FMU and step, {with}: {who}");
    Ok(vec![
        Figure::new(id("bare_loop"), bare, Limit::None, what("a loop in C")),
        Figure::new(id("step"), ours, Limit::None, what("a testbed")),
        Figure::new(id("above"), ours - bare, Limit::AtMost(ALLOWED), what("a testbed beyond the loop in C")),
    ])
}

/// The FMU of a case.
pub fn fmu(case: &FmuCase) -> &'static str {
    if case.fmus > 2 { "through" } else { "cheap" }
}

fn bare_loop(folder: &Path, program: &Path, case: &FmuCase, manner: Manner) -> Outcome<f64> {
    let word = |on: bool, words: [&'static str; 2]| if on { words[0] } else { words[1] };
    let mut child = command(program, &[]);
    child.arg(folder.join(format!("{}.so", fmu(case)))).arg(case.fmus.to_string());
    child.arg(word(case.pair, ["pair", "chain"]));
    child.args([word(manner.record, ["record", "blind"]), word(manner.save, ["save", "go"])]);
    let output = child.output().map_err(|e| format!("the loop in C: {e}"))?;
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let first = text.split_whitespace().next().and_then(|t| t.parse().ok());
    first.ok_or_else(|| format!("the loop in C ended with {}: {text}", output.status))
}

/// The same FMUs and connections as a scenario.
pub fn scenario(case: &FmuCase, rollback: bool) -> String {
    let fmu = fmu(case);
    let tables = (0..case.fmus).map(|k| format!("[u{k:02}]\nfmu = \"{fmu}.fmu\"\nrollback = {rollback}\n"));
    let joined = if case.pair { case.fmus } else { case.fmus - 1 };
    let join = (0..joined).map(|k| {
        let next = (k + 1) % case.fmus;
        format!("[[connect]]\nfrom = \"u{k:02}.y\"\nto = \"u{next:02}.u\"\n")
    });
    let head = "[time]\nstep_s = 0.001\nduration_s = 10000.0\n".to_owned();
    head + &tables.chain(join).collect::<String>()
}

fn testbed(folder: &Path, case: &FmuCase, manner: Manner) -> Outcome<f64> {
    let mut testbed = built(folder, &scenario(case, manner.save))?;
    let names: Vec<String> = (0..case.fmus).map(|k| format!("u{k:02}.y")).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let mut trace = Trace::new(&testbed, &names).map_err(|e| e.to_string())?;
    let steps = 40_000 / case.fmus;
    trace.reserve(steps);
    let mut best = f64::INFINITY;
    for _ in 0..ROUNDS {
        trace.clear();
        let start = cpu_s();
        for _ in 0..steps {
            testbed.step().map_err(|e| e.to_string())?;
            if manner.record {
                trace.take(&testbed).map_err(|e| e.to_string())?;
            }
        }
        best = smaller(best, (cpu_s() - start) * 1e6 / (steps * case.fmus) as f64);
    }
    Ok(best)
}
