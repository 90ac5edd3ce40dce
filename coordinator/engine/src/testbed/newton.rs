//! Newton's step for loops of connections, from the directional derivatives of the FMUs.
//!
//! With the derivatives D of all outputs by all inputs of the loop, r = y − u at the guess u leads to the step d of (1 − D)·d = r (FMI 3.0,
//! section 2.2.11: directional derivatives at a communication point). D is what an output follows at once; that an input also acts through
//! the step is of the order of its length and left to the iteration around it.

use crate::signals::{Link, Links, derivatives};
use terraglue_diagnostics::Result;
use terraglue_host::Instance;
use terraglue_numerics::dense::Lu;
use terraglue_subsystem::Capabilities;

/// A matrix whose smallest pivot is below this share of the largest is not used.
const SINGULAR: f64 = 1e-9;

/// Most values of loops that are solved with derivatives: the cost of a step grows with their cube.
const MOST: usize = 300;

/// The linear system of all connections that pass values within a step among the members of a loop.
#[derive(Debug, Default)]
pub(super) struct Newton {
    /// Iterated connections first, then those that pass their values on at once.
    links: Vec<usize>,
    /// Values of the iterated ones.
    iterated: usize,
    /// D, column by column.
    columns: Vec<f64>,
    lu: Lu,
    step: Vec<f64>,
    /// Whether all members have derivatives.
    offered: bool,
}

impl Newton {
    /// For these iterated connections, and others among the same subsystems.
    pub fn new(iterated: impl Iterator<Item = usize>, links: &Links, members: &[usize]) -> Self {
        let mut own: Vec<usize> = iterated.collect();
        let values = |own: &[usize]| own.iter().map(|k| links.numbers[*k].count()).sum::<usize>();
        let iterated = values(&own);
        let among = |link: &Link| link.slots().iter().all(|slot| members.contains(slot));
        let others = links.numbers.iter().enumerate().filter(|(_, l)| l.is_within_the_step() && among(l));
        let others: Vec<usize> = others.map(|(k, _)| k).filter(|k| !own.contains(k)).collect();
        own.extend(others);
        let offered = !own.is_empty() && values(&own) <= MOST;
        Self { offered, links: own, iterated, ..Self::default() }
    }

    /// How it helps a loop of some members, in words.
    pub fn way(&self, instances: &[Instance], members: &[usize]) -> String {
        let lacks = |slot: &&usize| !instances[**slot].capabilities().has(Capabilities::DIRECTIONAL);
        match members.iter().find(lacks) {
            _ if self.links.is_empty() => String::new(),
            Some(slot) => format!("without derivatives, which `{}` does not have", instances[*slot].name()),
            None if !self.offered => format!("without derivatives, as it has more than {MOST} values"),
            None => "by Newton's steps with directional derivatives".into(),
        }
    }

    /// Turns the residual of the iterated connections, at the end of the step and, where it is as long again, in the middle, into the step of Newton;
    /// leaves it as it is where derivatives are missing.
    ///
    /// # Errors
    /// [`Error::Module`](terraglue_diagnostics::Error::Module): a subsystem fails.
    pub fn solve(&mut self, residual: &mut [f64], links: &Links, instances: &[Instance]) -> Result {
        if !(self.offered && self.factor(links, instances)?) {
            return Ok(());
        }
        for part in residual.chunks_exact_mut(self.iterated) {
            self.step.clear();
            self.step.extend_from_slice(part);
            self.step.resize(self.columns.len().isqrt(), 0.0);
            self.lu.solve(&mut self.step);
            part.copy_from_slice(&self.step[..part.len()]);
        }
        Ok(())
    }

    /// Factors 1 − D as it is now; false where a derivative is missing or the matrix is singular.
    fn factor(&mut self, links: &Links, instances: &[Instance]) -> Result<bool> {
        let link = |k: &usize| &links.numbers[*k];
        let size: usize = self.links.iter().map(|k| link(k).count()).sum();
        self.columns.resize(size * size, 0.0);
        let inputs = self.links.iter().flat_map(|k| (0..link(k).count()).map(move |entry| (link(k), entry)));
        for (column, (by, entry)) in self.columns.chunks_exact_mut(size).zip(inputs) {
            self.offered = derivatives(self.links.iter().map(link), instances, (by, entry), column)?;
            if !self.offered {
                return Ok(false);
            }
        }
        let columns = &self.columns;
        let entry = |r: usize, c: usize| f64::from(u8::from(r == c)) - columns[c * size + r];
        Ok(self.lu.factor(size, entry) == size && self.lu.weakest() >= SINGULAR)
    }
}
