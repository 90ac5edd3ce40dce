//! Which field something was copied from: generations of tiles mean the same contents only in the field that counted them.

use std::sync::Arc;

/// Distinguishes fields, so that a generation means the same contents only in the field that counted it. A copy of a
/// field is another field.
#[derive(Debug, Default)]
pub(crate) struct Identity(Arc<()>);

impl Clone for Identity {
    fn clone(&self) -> Self {
        Self::default()
    }
}

/// The field from which a snapshot was last filled, and the generation of each of its tiles then.
#[derive(Clone, Debug, Default)]
pub(crate) struct Origin {
    field: Option<Arc<()>>,
    generations: Vec<u64>,
}

impl Origin {
    /// From now on that of this field; knowledge of another one's tiles is discarded.
    pub fn set(&mut self, field: &Identity) {
        if !self.is(field) {
            self.generations.clear();
            self.field = Some(field.0.clone());
        }
    }

    /// Whether it was filled from this field.
    pub fn is(&self, field: &Identity) -> bool {
        self.field.as_ref().is_some_and(|own| Arc::ptr_eq(own, &field.0))
    }

    /// Whether entry k is known to hold the contents of `generation`.
    pub fn holds(&self, k: usize, generation: u64) -> bool {
        self.generations.get(k) == Some(&generation)
    }

    /// Entry k holds the contents of `generation`; entries become known in their order.
    pub fn note(&mut self, k: usize, generation: u64) {
        match self.generations.get_mut(k) {
            Some(place) => *place = generation,
            None => self.generations.push(generation),
        }
    }

    /// Only the first `count` entries are left.
    pub fn truncate(&mut self, count: usize) {
        self.generations.truncate(count);
    }

    /// Generation of entry k.
    pub fn generation(&self, k: usize) -> Option<u64> {
        self.generations.get(k).copied()
    }
}
