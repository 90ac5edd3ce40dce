//! Chosen variables of every step in memory: what a sweep or a program that drives a testbed itself wants, at the cost
//! of one read per subsystem and step. Files are the business of [`super::Recorder`].

use std::io::Write;
use terraglue_diagnostics::{Error, Result};
use terraglue_engine::Testbed;
use terraglue_host::Instance;
use terraglue_subsystem::{ValueType, ValuesMut};

/// Values of chosen f64 variables over time.
///
/// ```no_run
/// # use std::path::Path;
/// use terraglue_engine::testbed::{Options, Testbed};
/// use terraglue_recording::Trace;
/// use terraglue_scenario::Scenario;
/// let scenario = Scenario::load(Path::new("scenarios/moon_walk.toml"), &[])?;
/// let mut testbed = Testbed::build(&scenario, &Options::default())?;
/// let mut trace = Trace::new(&testbed, &["robot.body.z"])?;
/// for _ in 0..10 {
///     testbed.step()?;
///     trace.take(&testbed)?;
/// }
/// assert_eq!(trace.rows().count(), 10);
/// # Ok::<(), terraglue_diagnostics::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Trace {
    names: Vec<String>,
    /// Runs of neighbouring columns that belong to one subsystem.
    reads: Vec<Read>,
    /// Time and values of every row.
    values: Vec<f64>,
}

#[derive(Clone, Debug)]
struct Read {
    slot: usize,
    ids: Vec<u32>,
}

impl Trace {
    /// For the variables with these full names, in this order.
    ///
    /// # Errors
    /// [`Error::Simulation`]: a name that does not exist, with the nearest one, or that is no f64.
    pub fn new(testbed: &Testbed, names: &[&str]) -> Result<Self> {
        let wrong = |message: String| Error::Simulation { time_s: testbed.t_s(), message };
        let mut reads: Vec<Read> = Vec::new();
        for name in names {
            let Some(found) = testbed.signals().directory.find(name) else {
                let hint =
                    testbed.signals().directory.hint(name).map(|h| format!("; {h}")).unwrap_or_default();
                return Err(wrong(format!("cannot record `{name}`: there is no such variable{hint}")));
            };
            let variable = found.describe(testbed.instances());
            if variable.value_type != ValueType::F64 {
                return Err(wrong(format!("cannot record `{name}`: it is no f64")));
            }
            match reads.last_mut().filter(|r| r.slot == found.slot()) {
                Some(read) => read.ids.push(variable.id),
                None => reads.push(Read { slot: found.slot(), ids: vec![variable.id] }),
            }
        }
        Ok(Self { names: names.iter().map(|n| (*n).to_owned()).collect(), reads, values: Vec::new() })
    }

    /// Room for so many rows, so that taking them does not allocate.
    pub fn reserve(&mut self, rows: usize) {
        self.values.reserve(rows * self.width());
    }

    fn width(&self) -> usize {
        1 + self.names.len()
    }

    /// Adds a row of the committed values.
    ///
    /// # Errors
    /// The error of a subsystem whose values cannot be read.
    pub fn take(&mut self, testbed: &Testbed) -> Result {
        let instances: &[Instance] = testbed.instances();
        let row = self.values.len();
        self.values.push(testbed.t_s());
        for read in &self.reads {
            let first = self.values.len();
            self.values.resize(first + read.ids.len(), f64::NAN);
            let got = instances[read.slot].get(&read.ids, ValuesMut::F64(&mut self.values[first..]));
            if got.is_err() {
                self.values.truncate(row);
                return got;
            }
        }
        Ok(())
    }

    /// Names of the columns after the time.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Time and values of every row.
    pub fn rows(&self) -> impl Iterator<Item = (f64, &[f64])> {
        self.values.chunks_exact(self.width()).map(|row| (row[0], &row[1..]))
    }

    /// Forgets all rows, keeps their room.
    pub fn clear(&mut self) {
        self.values.clear();
    }

    /// Writes all rows as CSV; numbers read back to the same bits.
    ///
    /// # Errors
    /// Of the writer.
    pub fn write_csv(&self, mut out: impl Write) -> std::io::Result<()> {
        writeln!(out, "t,{}", self.names.join(","))?;
        self.rows().try_for_each(|(t, row)| {
            write!(out, "{t}")?;
            row.iter().try_for_each(|x| write!(out, ",{x}"))?;
            writeln!(out)
        })
    }
}
