//! The frictional contact problems of `tests/reference/multibody/ncp`: residual, steps, time of each.

use crate::process::{Outcome, read, root};
use crate::{Context, Figure, Limit};
use std::path::Path;
use std::time::Instant;
use terraglue_contact_solver::{Options, Problem, Report, Solver};
use terraglue_numerics::extremes::smaller;

/// Runs of which the fastest counts.
const RUNS: usize = 200;

struct File {
    name: String,
    mu: Vec<f64>,
    q: Vec<f64>,
    w: Vec<f64>,
}

/// Two figures per file: residual (with steps and fall-backs in words) and time.
pub fn figures(context: &Context) -> Outcome<Vec<Figure>> {
    let mut all = Vec::new();
    for file in files()? {
        let rover = file.name.starts_with("Rover");
        let problem = Problem::new(&file.w, &file.q, &file.mu).map_err(|e| format!("{}: {e}", file.name))?;
        let mut solver = Solver::default();
        let (report, _) = solve(&mut solver, &problem);
        let id = format!("rigid-body.ncp.{}", file.name);
        let what = format!(
            "residual; {} contacts, {:?}: {} Newton steps, {} halvings, {} sweeps, {} proximal steps",
            file.mu.len(),
            report.stage,
            report.newton_steps,
            report.halvings,
            report.sweeps,
            report.proximal_steps
        );
        let limit = Limit::AtMost(if rover { 1e-10 } else { 1e-8 });
        all.push(Figure::new(format!("{id}.residual"), report.residual, limit, what));
        if context.timing {
            let runs = if rover { RUNS } else { RUNS / 20 };
            let fastest = (0..runs).map(|_| solve(&mut solver, &problem).1).fold(f64::INFINITY, smaller);
            let limit = if rover { Limit::AtMost(50.0) } else { Limit::None };
            let what = "time of a solution from zero, µs";
            all.push(Figure::new(format!("{id}.time"), 1e6 * fastest, limit, what).timed());
        }
    }
    Ok(all)
}

fn solve(solver: &mut Solver, problem: &Problem) -> (Report, f64) {
    let mut r = vec![0.0; problem.q.len()];
    let start = Instant::now();
    let report = solver.solve(problem, &Options::default(), &mut r);
    (report, start.elapsed().as_secs_f64())
}

fn files() -> Outcome<Vec<File>> {
    let folder = root().join("tests/reference/multibody/ncp");
    let entries = std::fs::read_dir(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let mut paths: Vec<_> = entries.filter_map(|e| Some(e.ok()?.path())).collect();
    paths.retain(|p| p.extension().is_some_and(|e| e == "txt"));
    paths.sort();
    paths.iter().map(|p| parse(p)).collect()
}

fn parse(path: &Path) -> Outcome<File> {
    let text = read(path)?;
    let numbers: Result<Vec<f64>, _> = text.split_whitespace().map(str::parse).collect();
    let numbers = numbers.map_err(|e| format!("{}: {e}", path.display()))?;
    let n = numbers.first().map_or(0, |n| *n as usize);
    if n == 0 || numbers.len() != 1 + 4 * n + 9 * n * n {
        return Err(format!("{}: {} numbers do not make {n} contacts", path.display(), numbers.len()));
    }
    let (mu, rest) = numbers[1..].split_at(n);
    let (q, w) = rest.split_at(3 * n);
    let name = path.file_stem().map(|s| s.to_string_lossy().replace(".hdf5", "")).unwrap_or_default();
    Ok(File { name, mu: mu.to_vec(), q: q.to_vec(), w: w.to_vec() })
}
