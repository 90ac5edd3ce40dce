//! Finds the body of each contact of a soil. A soil numbers its contacts and has no names for them: equal forces identify the
//! body, so that a plot has the names and colours of the map.

use crate::reader::Recording;
use crate::report::footprints::Leg;
use crate::table::Table;

/// Forces that differ by less than this share, summed over a run, are the same.
const SAME: f64 = 1e-3;
/// Times of two channels that are the same, s.
const AT_ONCE_S: f64 = 1e-9;

/// Contacts by the names that their variables begin with, and the number of the leg that each is under.
pub(crate) struct Owners<'a> {
    legs: &'a [Leg],
    found: Vec<(&'a str, usize)>,
}

impl<'a> Owners<'a> {
    /// Looks at the normal forces of all contacts.
    pub fn new(recording: &'a Recording, legs: &'a [Leg]) -> Self {
        let tables = recording.variables.values();
        let contacts = tables.flat_map(|table| table.names.iter().map(move |name| (table, name)));
        let found = contacts.filter_map(|(table, name)| {
            let contact = name.strip_suffix(".normal_force")?;
            let leg = legs.iter().position(|leg| is_under(recording, leg, table, name))?;
            Some((contact, leg))
        });
        Self { legs, found: found.collect() }
    }

    /// Name and colour of the curve of a contact; its own name and `otherwise` where the body is not known.
    pub fn of(&self, contact: &str, otherwise: usize) -> (String, usize) {
        match self.found.iter().find(|(name, _)| *name == contact) {
            Some((_, leg)) => (self.legs[*leg].body.clone(), *leg),
            None => (contact.to_owned(), otherwise),
        }
    }
}

/// Whether a contact has the normal force of a leg at all times at which both are known.
fn is_under(recording: &Recording, leg: &Leg, table: &Table, name: &str) -> bool {
    let Some(force) = table.column(name) else { return false };
    let (mut sum, mut difference) = (0.0, 0.0);
    for (t, force) in table.t_s.iter().zip(force) {
        let row = recording.gluing.partition_point(|g| g.t < t - AT_ONCE_S);
        if recording.gluing.get(row).is_some_and(|g| g.t <= t + AT_ONCE_S) {
            sum += force.abs();
            difference += (force - leg.normal_n[row]).abs();
        }
    }
    sum > 0.0 && difference < SAME * sum
}
