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
        let mut impulses = vec![0.0; file.q.len()];
        let (report, _) = solve(&mut solver, &problem, &mut impulses);
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
        all.push(Figure::new(format!("{id}.residual"), residual(&file, &impulses), limit, what));
        if context.timing {
            let runs = if rover { RUNS } else { RUNS / 20 };
            let fastest =
                (0..runs).map(|_| solve(&mut solver, &problem, &mut impulses).1).fold(f64::INFINITY, smaller);
            let limit = if rover { Limit::AtMost(50.0) } else { Limit::None };
            let what = "time of a solution from zero, µs";
            all.push(Figure::new(format!("{id}.time"), 1e6 * fastest, limit, what).timed());
        }
    }
    Ok(all)
}

/// Report and time, s, of a solution from zero; the impulses are written to `r`.
fn solve(solver: &mut Solver, problem: &Problem, r: &mut [f64]) -> (Report, f64) {
    r.fill(0.0);
    let start = Instant::now();
    let report = solver.solve(problem, &Options::default(), r);
    (report, start.elapsed().as_secs_f64())
}

/// ‖r − P_K(r − û)‖ / ‖q‖ of impulses, from the numbers of the file alone: u = W·r + q, û = u + μ‖u_t‖ along the normal (De Saxcé and
/// Feng 1998), P_K the projection on Coulomb's cone.
fn residual(file: &File, r: &[f64]) -> f64 {
    let row = |i: usize| file.w[i * r.len()..][..r.len()].iter().zip(r).map(|(w, r)| w * r).sum::<f64>();
    let mut square = 0.0;
    for (contact, mu) in file.mu.iter().enumerate() {
        let own = [0, 1, 2].map(|c| 3 * contact + c);
        let u = own.map(|i| file.q[i] + row(i));
        let [normal, first, second] =
            [r[own[0]] - u[0] - mu * u[1].hypot(u[2]), r[own[1]] - u[1], r[own[2]] - u[2]];
        let slide = first.hypot(second);
        let (along, share) = if slide <= mu * normal {
            (normal, 1.0)
        } else if mu * slide <= -normal {
            (0.0, 0.0)
        } else {
            let along = (normal + mu * slide) / (1.0 + mu * mu);
            (along, mu * along / slide)
        };
        let projected = [along, share * first, share * second];
        square += own.iter().zip(projected).map(|(i, p)| (r[*i] - p).powi(2)).sum::<f64>();
    }
    (square / file.q.iter().map(|q| q * q).sum::<f64>()).sqrt()
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
