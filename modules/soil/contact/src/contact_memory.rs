//! Memory of contacts from commit to commit, by the keys of their ports: lists in ascending order of the keys.

/// Memory of one contact.
pub trait Remembered: Copy {
    /// Of a contact that was never seen.
    fn new(key: u64) -> Self;
    /// Key of its port.
    fn key(&self) -> u64;
    /// Energy that becomes heat when the contact leaves the soil, J.
    fn energy(&self) -> f64 {
        0.0
    }
}

/// Keeps the memory of a contact.
pub fn remember<T: Remembered>(all: &mut Vec<T>, new: T) {
    match all.binary_search_by_key(&new.key(), T::key) {
        Ok(k) => all[k] = new,
        Err(k) => all.insert(k, new),
    }
}

/// Memory of the contact `key`.
pub fn recall<T: Remembered>(all: &[T], key: u64) -> T {
    all.binary_search_by_key(&key, T::key).map_or_else(|_| T::new(key), |k| all[k])
}

/// Forgets the contacts that have left the soil; their energy becomes heat, J.
pub fn release<T: Remembered>(all: &mut Vec<T>, touching: impl Fn(u64) -> bool) -> f64 {
    let mut heat = 0.0;
    all.retain(|one| {
        let stays = touching(one.key());
        heat += if stays { 0.0 } else { one.energy() };
        stays
    });
    heat
}
