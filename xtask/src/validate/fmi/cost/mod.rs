//! What a unit costs per communication step, beside a bare loop in C, and an exchange with an isolated one.

use super::{built, units};
use crate::process::{Outcome, command, must, write};
use crate::validate::timing::median;
use crate::validate::{Figure, Limit};
use std::path::Path;
use std::time::Instant;
use terraglue::subsystem::ValuesMut;

const STEPS: u32 = 200_000;

/// Loads the library of a unit, steps it and reads its output; prints µs per step.
const LOOP: &str = r#"
#include <dlfcn.h>
#include <stdio.h>
#include <time.h>
int main(int n, char **a) {
    void *l = dlopen(a[1], RTLD_NOW);
    void *(*make)() = dlsym(l, "fmi2Instantiate");
    int (*step)(void *, double, double, int) = dlsym(l, "fmi2DoStep");
    int (*get)(void *, const unsigned *, size_t, double *) = dlsym(l, "fmi2GetReal");
    void *u = make("x", 1, "g", "", 0, 0, 0);
    double best = 1e9, y, sum = 0; unsigned r = 1;
    for (int k = 0; k < 7; k++) {
        struct timespec s, e; clock_gettime(CLOCK_THREAD_CPUTIME_ID, &s);
        for (int i = 0; i < 200000; i++) { step(u, i * 1e-3, 1e-3, 1); get(u, &r, 1, &y); sum += y; }
        clock_gettime(CLOCK_THREAD_CPUTIME_ID, &e);
        double t = (e.tv_sec - s.tv_sec) * 1e6 + (e.tv_nsec - s.tv_nsec) * 1e-3;
        if (t < best) best = t;
    }
    printf("%.6f %g\n", best / 200000, sum); return 0; }
"#;

pub fn figures(folder: &Path) -> Outcome<Vec<Figure>> {
    units::build(folder, "cheap", &[("u", 'i', 1.0), ("y", 'o', 0.0)], "", "v[1] += h * v[0];")?;
    let bare = bare_loop(folder)?;
    let ours = ours(folder)?;
    let isolated = exchange(folder)?;
    let what = "µs of CPU per step of one unit, no rollback: Testbed::step beyond a bare loop in C that steps and reads it";
    Ok(vec![
        Figure::new("fmi.cost.bare_loop", bare, Limit::None, "µs of CPU per step of the bare loop in C"),
        Figure::new("fmi.cost.step", ours, Limit::None, "µs of CPU per step of one unit in a testbed"),
        Figure::new("fmi.cost.above_bare_loop", ours - bare, Limit::AtMost(0.1), what),
        Figure::new(
            "fmi.cost.isolated_exchange",
            isolated,
            Limit::AtMost(15.0),
            "µs per exchange of 64 numbers with an isolated unit, median",
        ),
    ])
}

fn bare_loop(folder: &Path) -> Outcome<f64> {
    let (source, program) = (folder.join("loop.c"), folder.join("loop"));
    write(&source, LOOP)?;
    must(&mut command("cc", &["-O2", "-w", "-o"]).arg(&program).arg(&source).arg("-ldl"))?;
    let done = command(&program, &[]).arg(folder.join("cheap.so")).output();
    let text = done.map_err(|e| format!("the loop in C: {e}"))?.stdout;
    let text = String::from_utf8_lossy(&text).into_owned();
    text.split_whitespace()
        .next()
        .and_then(|t| t.parse().ok())
        .ok_or_else(|| format!("the loop in C says {text}"))
}

fn ours(folder: &Path) -> Outcome<f64> {
    let text =
        "[time]\nstep_s = 0.001\nduration_s = 10000.0\n[cheap]\nfmu = \"cheap.fmu\"\nrollback = false\n";
    let mut testbed = built(folder, text)?;
    let mut best = f64::INFINITY;
    for _ in 0..7 {
        let start = cpu_s();
        for _ in 0..STEPS {
            testbed.step().map_err(|e| e.to_string())?;
        }
        best = best.min((cpu_s() - start) * 1e6 / f64::from(STEPS));
    }
    Ok(best)
}

/// CPU time of this thread from the system's own account, s.
fn cpu_s() -> f64 {
    // utime and stime have ticks of 10 ms; the schedule's account counts nanoseconds.
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    text.split_whitespace().next().and_then(|t| t.parse::<f64>().ok()).unwrap_or(f64::NAN) * 1e-9
}

fn exchange(folder: &Path) -> Outcome<f64> {
    let names: Vec<String> = (0..64).map(|k| format!("y{k}")).collect();
    let variables: Vec<units::Variable> = names.iter().map(|n| (n.as_str(), 'o', 1.0)).collect();
    units::build(folder, "wide", &variables, "", "")?;
    let text = "[time]\nstep_s = 0.001\nduration_s = 1.0\n[wide]\nfmu = \"wide.fmu\"\nisolate = true\n";
    let testbed = built(folder, text)?;
    let ids: Vec<u32> = testbed.instances()[0].variables().iter().map(|v| v.id).collect();
    let mut out = vec![0.0; ids.len()];
    let mut times = Vec::new();
    for _ in 0..5001 {
        let start = Instant::now();
        testbed.instances()[0].get(&ids, ValuesMut::F64(&mut out)).map_err(|e| e.to_string())?;
        times.push(start.elapsed().as_secs_f64() * 1e6);
    }
    Ok(median(times))
}
