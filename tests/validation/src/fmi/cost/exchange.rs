//! An exchange of 64 numbers with an FMU in a process of its own.

use super::super::{built, fmus};
use crate::process::Outcome;
use crate::timing::median;
use crate::{Figure, Limit};
use std::path::Path;
use std::time::Instant;
use terraglue::subsystem::ValuesMut;

pub fn figure(folder: &Path) -> Outcome<Figure> {
    let names: Vec<String> = (0..64).map(|k| format!("y{k}")).collect();
    let variables: Vec<fmus::Variable> = names.iter().map(|n| (n.as_str(), 'o', 1.0)).collect();
    fmus::build(folder, "wide", &variables, "", "")?;
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
    let what = "µs per exchange of 64 numbers with an isolated FMU, wall time, median";
    Ok(Figure::new("fmi.cost.isolated_exchange", median(times), Limit::AtMost(15.0), what))
}
