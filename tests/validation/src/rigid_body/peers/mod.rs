//! The same cases on other engines, measured in the same run: MuJoCo and Rapier, installed by name.
//!
//! Only in the long run with timing; where an engine cannot be had its line has `skip`.

mod mujoco;
mod rapier;
mod table;

pub use table::comparison;

use crate::process::{Outcome, root};
use crate::{Context, Figure, Limit};
use std::path::PathBuf;
use std::process::Command;

/// Makes the program of a peer, ready to be started.
type Make = fn() -> Outcome<Command>;

/// All figures of the peers; none of them is judged.
pub fn figures(context: &Context) -> Outcome<Vec<Figure>> {
    if !context.timing || context.quick {
        return Ok(Vec::new());
    }
    let engines: [(&str, &str, Make); 2] =
        [("mujoco", "MuJoCo", || mujoco::command(&[])), ("rapier", "Rapier", rapier::command)];
    let measured = |(id, name, command): (&str, &str, Make)| {
        let id = format!("rigid-body.peer.{id}");
        let figures = command().and_then(|mut c| measure(&mut c, &id, name));
        figures.unwrap_or_else(|why| vec![Figure::skipped(id, why)])
    };
    Ok(engines.into_iter().flat_map(measured).collect())
}

/// What MuJoCo's steps of the walking hexapod on rigid ground cost.
pub fn mujoco_gait() -> Outcome<Vec<Figure>> {
    measure(&mut mujoco::command(&["gait"])?, "rigid-body.peer.mujoco", "MuJoCo")
}

/// Runs a peer that prints lines `name<TAB>value<TAB>what`.
fn measure(command: &mut Command, id: &str, name: &str) -> Outcome<Vec<Figure>> {
    let output = command.output().map_err(|e| format!("{name} did not start: {e}"))?;
    if !output.status.success() {
        let text = String::from_utf8_lossy(&output.stderr);
        return Err(format!("{name} did not run: {}", text.trim().lines().last().unwrap_or("")));
    }
    let figure = |line: &str| {
        let mut fields = line.split('\t');
        let (which, value, what) = (fields.next()?, fields.next()?.parse().ok()?, fields.next()?);
        Some(peer_figure(format!("{id}.{which}"), value, format!("{name}: {what}")))
    };
    Ok(String::from_utf8_lossy(&output.stdout).lines().filter_map(figure).collect())
}

/// A value that is not a number is reported as such and fails nothing: it is the peer's.
fn peer_figure(id: String, value: f64, what: String) -> Figure {
    if value.is_finite() {
        Figure::new(id, value, Limit::None, what).noisy()
    } else {
        Figure::skipped(id, format!("{what}: {value}"))
    }
}

/// A file of the reference cases.
fn reference(name: &str) -> PathBuf {
    root().join("tests/reference/multibody").join(name)
}
