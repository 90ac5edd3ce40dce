//! Time of a call to a module in Python: 64 numbers there and (four times) 64 back, through its process.

use super::super::timing::median;
use super::super::{Context, Figure, Limit};
use crate::process::Outcome;
use std::time::Instant;
use terraglue::host::{HostServices, Isolation, LoadedModule};
use terraglue::subsystem::{Config, Input, Response, Step};

const NUMBERS: usize = 64;
const CALLS: usize = 4000;
const MODULE: &str = r#""""Gives back what it gets.

[module]
name = "echo"
kind = "robot"
"""
import terraglue as tg


class Echo(tg.Subsystem):
    def advance(self, step, input, out):
        out.x[:] = out.v[:] = out.a[:] = out.t[:] = input.t
"#;

/// A module that fails in `advance` half a second after the start.
const FAULTY: &str = r#""""Fails.

[module]
name = "faulty"
kind = "controller"
"""
import os
import terraglue as tg


class Faulty(tg.Subsystem):
    def advance(self, step, input, out):
        if step.t > 0.25:
            FAULT
"#;

/// Statements that fail, and the expected message of each.
const FAULTS: [(&str, &str); 3] = [
    ("1 / 0", "ZeroDivisionError"),
    ("os.kill(os.getpid(), 9)", "signal 9"),
    ("[0 for _ in iter(int, 1)]", "did not answer"),
];

/// How many of three faults are reported with name, function and time.
pub fn faults(context: &Context, out: &mut Vec<Figure>) -> Outcome {
    let mut told = 0;
    for (k, (statement, words)) in FAULTS.iter().enumerate() {
        let file = context.scratch.join(format!("faulty{k}.py"));
        std::fs::write(&file, FAULTY.replace("FAULT", statement)).map_err(|e| e.to_string())?;
        let module = LoadedModule::load(&file).map_err(|e| e.to_string())?;
        let services = HostServices::new(1, &context.scratch);
        let isolation = Isolation { step_timeout_s: 1.0, ..Isolation::default() };
        let made = module.instantiate_isolated("mine", Config::default(), &services, isolation);
        let mut instance = made.map_err(|e| e.to_string())?;
        let input = Input::Force { t: &[], motion: None };
        let failure = (0..).find_map(|index| {
            let step = Step::free(0.1 * index as f64, 0.1, index);
            let [x, v, a, t] = &mut [[0.0; 0]; 4];
            let mut answer = Response { x, v, a, t, reached: 0.0, flags: 0 };
            instance.advance(&step, &input, &mut answer).err()
        });
        let text = failure.map_or_else(String::new, |e| e.to_string());
        told += u32::from(["mine", "advance", "t = 0.3", words].iter().all(|part| text.contains(part)));
    }
    let what = "faults of a module in Python – raising, killed, hanging – told with name, function and time";
    out.push(Figure::new("plugins.python.faults", f64::from(told), Limit::Equal(3.0), what));
    Ok(())
}

/// Median and 99th percentile of the time of a call.
pub fn figures(context: &Context, out: &mut Vec<Figure>) -> Outcome {
    let file = context.scratch.join("echo.py");
    std::fs::write(&file, MODULE).map_err(|e| format!("{}: {e}", file.display()))?;
    let module = LoadedModule::load(&file).map_err(|e| e.to_string())?;
    let services = HostServices::new(1, &context.scratch);
    let made = module.instantiate("echo", Config::default(), &services);
    let mut instance = made.map_err(|e| e.to_string())?;
    let sent: [f64; NUMBERS] = std::array::from_fn(|k| k as f64);
    let mut got = [[0.0; NUMBERS]; 4];
    let mut times = Vec::with_capacity(CALLS);
    for index in 0..CALLS as u64 {
        let step = Step { n: NUMBERS as u32, ..Step::free(0.0, 1e-3, index) };
        let input = Input::Force { t: &sent, motion: None };
        let [x, v, a, t] = &mut got;
        let mut answer = Response { x, v, a, t, reached: 0.0, flags: 0 };
        let start = Instant::now();
        instance.advance(&step, &input, &mut answer).map_err(|e| e.to_string())?;
        times.push(1e6 * start.elapsed().as_secs_f64());
        if got.iter().any(|g| g != &sent) {
            return Err("a module in Python gives back other numbers than it got".into());
        }
    }
    let mut times = times.split_off(CALLS / 10);
    times.sort_by(f64::total_cmp);
    let p99 = times[times.len() * 99 / 100];
    let what = "call of a module in Python, 64 numbers there and back, µs";
    out.push(Figure::new(
        "plugins.python.median",
        median(times),
        Limit::AtMost(25.0),
        format!("{what}, median"),
    ));
    out.push(Figure::new("plugins.python.p99", p99, Limit::AtMost(80.0), format!("{what}, 99th percentile")));
    Ok(())
}
