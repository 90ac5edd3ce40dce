//! `variables.csv`, all scalar variables over time, and `timing.csv`, what a clock measured.

use crate::layout::{TIMING, VARIABLES, at, other_at};
use crate::snapshot::{ScalarKind, Snapshot};
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use terraglue_diagnostics::error::{Error, Result};
use terraglue_host::kept_file::KeptFile;

/// Writes `t_s,robot.LF_j2.angle,…`, one row per recorded communication point.
pub(crate) struct VariablesCsv {
    path: PathBuf,
    rows: csv::Writer<KeptFile>,
    number: Vec<u8>,
}

impl VariablesCsv {
    /// Creates the file with its head line.
    pub fn create(folder: &Path, snapshot: &Snapshot) -> Result<Self> {
        let path = folder.join(VARIABLES);
        let mut rows = csv::Writer::from_writer(KeptFile::create(&path).map_err(at(&path))?);
        let names = snapshot.subsystems.iter().flat_map(|s| {
            s.columns.iter().filter(|c| c.recorded).map(move |c| format!("{}.{}", s.name, c.name))
        });
        rows.write_record(std::iter::once("t_s".to_owned()).chain(names)).map_err(other_at(&path))?;
        Ok(Self { path, rows, number: Vec::new() })
    }

    /// Goes on behind the first `length` bytes of the table of an earlier process.
    pub fn go_on(folder: &Path, length: u64) -> Result<Self> {
        let path = folder.join(VARIABLES);
        let rows = csv::Writer::from_writer(KeptFile::go_on(&path, length).map_err(at(&path))?);
        Ok(Self { path, rows, number: Vec::new() })
    }

    /// Hands everything to the operating system; the length of the table, bytes.
    pub fn length(&mut self) -> Result<u64> {
        self.flush()?;
        Ok(std::fs::metadata(&self.path).map_err(at(&self.path))?.len())
    }

    /// One row.
    pub fn row(&mut self, t_s: f64, snapshot: &Snapshot) -> Result {
        self.write(t_s, snapshot).map_err(|e| failed_at(&self.path, e))
    }

    fn write(&mut self, t_s: f64, snapshot: &Snapshot) -> csv::Result<()> {
        self.field(t_s, true)?;
        for scalars in &snapshot.subsystems {
            let all = scalars.columns.iter().zip(&scalars.values);
            for (column, value) in all.filter(|(column, _)| column.recorded) {
                self.field(*value, column.kind == ScalarKind::Real)?;
            }
        }
        self.rows.write_record(None::<&[u8]>)
    }

    fn field(&mut self, value: f64, real: bool) -> csv::Result<()> {
        self.number.clear();
        if !real {
            let _ = write!(self.number, "{}", value as i64);
        } else if value.is_finite() {
            let _ = serde_json::to_writer(&mut self.number, &value);
        } else {
            let _ = write!(self.number, "{value}");
        }
        self.rows.write_field(&self.number)
    }

    /// Hands everything to the operating system.
    pub fn flush(&mut self) -> Result {
        self.rows.flush().map_err(at(&self.path))
    }
}

/// An error with the file and, where the system has refused the write, its own words.
fn failed_at(path: &Path, error: csv::Error) -> Error {
    match error.into_kind() {
        csv::ErrorKind::Io(source) => at(path)(source),
        other => other_at(path)(format!("{other:?}")),
    }
}

/// Time spent in one part of the step loop.
#[derive(Clone, Debug, PartialEq)]
pub struct TimingRow {
    /// Part of the step, e.g. `estimate_forces`.
    pub section: String,
    /// Wall time in all steps, s.
    pub wall_s: f64,
    /// CPU time in all steps, s, where it was measured.
    pub cpu_s: Option<f64>,
    /// Steps.
    pub steps: u64,
}
terraglue_subsystem::persist!(TimingRow { section, wall_s, cpu_s, steps });

/// Writes `timing.csv`. Measured times are in no other file but `summary.json`.
///
/// # Errors
/// [`Error::File`](terraglue_diagnostics::Error::File): the file cannot be written.
pub fn write_timing(folder: &Path, rows: &[TimingRow]) -> Result {
    let path = folder.join(TIMING);
    let mut table = csv::Writer::from_writer(File::create(&path).map_err(at(&path))?);
    table
        .write_record(["section", "wall_s", "cpu_s", "steps", "wall_per_step_us"])
        .map_err(other_at(&path))?;
    for row in rows {
        let per_step = if row.steps == 0 { 0.0 } else { row.wall_s / row.steps as f64 * 1e6 };
        let cpu = row.cpu_s.map(|s| format!("{s:.6}")).unwrap_or_default();
        let fields = [
            &row.section,
            &format!("{:.6}", row.wall_s),
            &cpu,
            &row.steps.to_string(),
            &format!("{per_step:.3}"),
        ];
        table.write_record(fields).map_err(other_at(&path))?;
    }
    table.flush().map_err(at(&path))
}
