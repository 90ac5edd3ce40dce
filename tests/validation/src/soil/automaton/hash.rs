//! The same bits on any number of threads, after a rollback, and without the processor's newest instructions in the
//! C library.

use super::feet::{Feet, Wanderer, instance};
use super::machine::Machine;
use super::mass::{crowd, hills, wander};
use crate::process::Outcome;
use crate::soil::fixture::LUNAR;
use crate::{Context, Figure, Limit};
use std::sync::Arc;
use terraglue_soil_cellular_automaton::SoilCellularAutomaton;
use terraglue_subsystem::Subsystem;

/// Steps of a run, quick and otherwise.
const STEPS: [u32; 2] = [300, 3000];
/// Features withheld from the C library: fused multiply-add and wide vectors.
const WITHOUT: &str = "glibc.cpu.hwcaps=-FMA,-FMA4,-AVX,-AVX2,-AVX512F,-AVX512VL,-AVX2_Usable,-FMA_Usable";

/// Hills with heaps that slide for a long time, five bodies among them.
fn begin(threads: usize) -> (Feet, Vec<Wanderer>) {
    let mut terrain = hills(201);
    terrain.size = [201, 181];
    let smooth = terrain.height;
    let height = move |i: i64, j: i64| {
        let heap = (i % 64 - 32).abs() < 6 && (j % 64 - 32).abs() < 6;
        smooth(i, j) + if heap { 0.2 } else { 0.0 }
    };
    let terrain = super::field::Function { size: terrain.size, spacing: terrain.spacing, height };
    let machine = Arc::new(Machine::new(Box::new(terrain), threads));
    let mut fixture = Feet::new(instance::<SoilCellularAutomaton>(LUNAR, machine));
    let wanderers = crowd(&mut fixture, 0.9);
    (fixture, wanderers)
}

fn go(fixture: &mut Feet, wanderers: &mut [Wanderer], steps: u32) -> u64 {
    (0..steps).for_each(|_| wander(fixture, wanderers));
    fixture.hash()
}

fn plain(threads: usize, steps: u32) -> u64 {
    let (mut fixture, mut wanderers) = begin(threads);
    go(&mut fixture, &mut wanderers, steps)
}

/// Restores the middle twice: once after a few steps, once from the end.
fn rolled_back(steps: u32) -> Outcome<[u64; 2]> {
    let (mut fixture, mut wanderers) = begin(1);
    go(&mut fixture, &mut wanderers, steps / 2);
    fixture.soil.save_state(0).map_err(|e| e.to_string())?;
    let (middle, moment) = (wanderers.clone(), fixture.moment());
    let mut ends = [0; 2];
    for (end, more) in ends.iter_mut().zip([7, steps]) {
        go(&mut fixture, &mut wanderers, more);
        fixture.soil.restore_state(0).map_err(|e| e.to_string())?;
        wanderers.clone_from(&middle);
        fixture.return_to(&moment);
        *end = go(&mut fixture, &mut wanderers, steps - steps / 2);
    }
    Ok(ends)
}

/// Goes on in a new instance from the state that another one wrote as bytes.
fn restarted(steps: u32) -> Outcome<u64> {
    let (mut fixture, mut wanderers) = begin(1);
    go(&mut fixture, &mut wanderers, steps / 2);
    let bytes = fixture.soil.serialize().map_err(|e| e.to_string())?;
    let (mut other, _) = begin(1);
    other.soil.deserialize(&bytes).map_err(|e| e.to_string())?;
    other.return_to(&fixture.moment());
    Ok(go(&mut other, &mut wanderers, steps - steps / 2))
}

/// Prints the hash of the run on one thread: for a process with other settings.
pub fn print(quick: bool) {
    println!("{:016x}", plain(1, STEPS[usize::from(!quick)]));
}

/// This very program, also when cargo has put another one in its place since it started.
const OWN_PROGRAM: &str = "/proc/self/exe";

fn in_other_process(quick: bool) -> Outcome<u64> {
    let mut command = std::process::Command::new(OWN_PROGRAM);
    let output = command
        .arg("soil-hash")
        .args(quick.then_some("--quick"))
        .env("GLIBC_TUNABLES", WITHOUT)
        .output()
        .map_err(|e| format!("{OWN_PROGRAM}: {e}"))?;
    let text = String::from_utf8_lossy(&output.stdout);
    u64::from_str_radix(text.trim(), 16).map_err(|e| format!("`soil-hash` printed `{text}`: {e}"))
}

/// How many runs end in other bits than the first.
pub fn figures(context: &Context) -> Outcome<Vec<Figure>> {
    let steps = STEPS[usize::from(!context.quick)];
    let expected = plain(1, steps);
    let other = |hashes: &[u64]| hashes.iter().filter(|h| **h != expected).count() as f64;
    let figure = |id: &str, value: f64, what: &str| {
        let what = format!("{what} whose state after {steps} steps has other bits ({expected:016x})");
        Figure::new(format!("soil.automaton.hash.{id}"), value, Limit::Equal(0.0), what)
    };
    Ok(vec![
        figure("threads", other(&[plain(2, steps), plain(5, steps)]), "runs on 2 and 5 threads"),
        figure(
            "rollback",
            other(&rolled_back(steps)?),
            "runs rolled back and replayed, after 7 and after all steps,",
        ),
        figure("restart", other(&[restarted(steps)?]), "new instances that go on from written bytes"),
        figure(
            "processor",
            other(&[in_other_process(context.quick)?]),
            "processes with FMA and AVX2 switched off for the C library",
        ),
    ])
}
