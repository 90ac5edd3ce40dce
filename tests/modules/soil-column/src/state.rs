//! The committed columns, their numbered copies, and the answer of a trial.

use crate::ColumnLaw;
use terraglue_subsystem::{Energy, Error, Port, Result};

/// Version of the serialised form.
const VERSION: u64 = 1;

/// A column's committed state.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Column {
    key: u64,
    /// Depth of the foot, m; < 0 above the ground.
    z: f64,
    /// Largest depth since the foot came down, m.
    pub(crate) z_max: f64,
    /// Tangential force on the body, world, N.
    tangential: [f64; 3],
}

impl Column {
    /// Committed tangential force along t1 and t2 of a port, N.
    pub(crate) fn tangential(&self, port: &Port) -> [f64; 2] {
        [1, 2].map(|c| port.direction(c).iter().zip(self.tangential).map(|(d, f)| d * f).sum())
    }

    /// Takes the depth and the tangential force at t + h. A foot above the initial ground starts anew.
    pub(crate) fn commit(&mut self, port: &Port, z: f64, tangential: [f64; 2]) {
        if z <= 0.0 {
            *self = Self { key: self.key, z, ..Self::default() };
            return;
        }
        let (d1, d2) = (port.direction(1), port.direction(2));
        self.tangential = [0, 1, 2].map(|k| d1[k] * tangential[0] + d2[k] * tangential[1]);
        (self.z, self.z_max) = (z, self.z_max.max(z));
    }
}

/// Answer of a port in the last trial.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Answer {
    pub(crate) x_n: f64,
    pub(crate) t_n: f64,
    pub(crate) t_t: [f64; 2],
    /// Tangential displacement, m.
    pub(crate) moved: [f64; 2],
    /// dF/dz, N/m; 0 where the normal force was given.
    pub(crate) slope: f64,
    /// dz/dF, m/N; 0 where the motion was given.
    pub(crate) compliance: f64,
    /// Size of the elastic trial force where the foot slides, N, else 0.
    pub(crate) sliding_trial: f64,
    /// The wrench was given without a motion.
    pub(crate) force_alone: bool,
}

impl Answer {
    /// Entry (row, column) of the port's block of the interface Jacobian.
    pub(crate) fn derivative(&self, law: &ColumnLaw, row: usize, column: usize) -> f64 {
        let bound = law.mu * self.t_n.max(0.0);
        let sliding = self.sliding_trial > 0.0;
        let direction = self.t_t.map(|t| if bound > 0.0 { t / bound } else { 0.0 });
        let same = f64::from(u8::from(row == column));
        match (row, column) {
            (0, 0) if self.compliance > 0.0 => self.compliance,
            (0, 0) => self.slope,
            (1 | 2, 1 | 2) if self.force_alone => same / law.k_t,
            (1 | 2, 0) if self.force_alone || !sliding => 0.0,
            // T_t = mu·T_n·d: with T_n given dT_t/dT_n, with the motion given d(−T_t)/dX_n.
            (1 | 2, 0) if self.compliance > 0.0 => law.mu * direction[row - 1],
            (1 | 2, 0) => law.mu * direction[row - 1] * self.slope,
            (1 | 2, 1 | 2) if sliding => {
                law.k_t * bound / self.sliding_trial * (same - direction[row - 1] * direction[column - 1])
            }
            (1 | 2, 1 | 2) => law.k_t * same,
            _ => 0.0,
        }
    }
}

/// All columns in ascending order of key, work done on them, and saved copies.
#[derive(Default)]
pub(crate) struct States {
    columns: Vec<Column>,
    work: f64,
    slots: Vec<(Vec<Column>, f64, bool)>,
}

impl States {
    pub(crate) fn new(slots: u32) -> Self {
        Self { slots: (0..slots).map(|_| (Vec::with_capacity(16), 0.0, false)).collect(), ..Self::default() }
    }

    pub(crate) fn len(&self) -> usize {
        self.columns.len()
    }

    pub(crate) fn column(&self, index: usize) -> &Column {
        &self.columns[index]
    }

    pub(crate) fn column_mut(&mut self, index: usize) -> &mut Column {
        &mut self.columns[index]
    }

    /// Index of the column of a key. A new key goes in at its place; ports come in ascending order of key, so
    /// that the indices handed out before it in the same step stay.
    pub(crate) fn find_or_add(&mut self, key: u64) -> usize {
        self.columns.binary_search_by_key(&key, |c| c.key).unwrap_or_else(|place| {
            self.columns.insert(place, Column { key, ..Column::default() });
            place
        })
    }

    pub(crate) fn book(&mut self, work: f64) {
        self.work += work;
    }

    pub(crate) fn max_sinkage(&self) -> f64 {
        self.columns.iter().map(|c| c.z_max).fold(0.0, f64::max)
    }

    pub(crate) fn energy(&self, law: &ColumnLaw) -> Energy {
        let stored = |c: &Column| {
            let (force, _) = law.force(c.z_max, c.z);
            let tangential: f64 = c.tangential.iter().map(|t| t * t).sum();
            // The unloading branch from here to the free depth, and the tangential spring.
            0.5 * force * (c.z - law.free_depth(c.z_max)).max(0.0) + 0.5 * tangential / law.k_t
        };
        let potential: f64 = self.columns.iter().map(stored).sum();
        Energy { potential, port_work: self.work, dissipated: self.work - potential, ..Energy::default() }
    }

    fn slot(&mut self, slot: u32) -> Result<&mut (Vec<Column>, f64, bool)> {
        let count = self.slots.len();
        self.slots
            .get_mut(slot as usize)
            .ok_or_else(|| Error::Refused(format!("slot {slot} of {count} slots")))
    }

    pub(crate) fn save(&mut self, slot: u32) -> Result {
        let columns = std::mem::take(&mut self.columns);
        let work = self.work;
        let result = self.slot(slot).map(|to| {
            to.0.clone_from(&columns);
            (to.1, to.2) = (work, true);
        });
        self.columns = columns;
        result
    }

    pub(crate) fn restore(&mut self, slot: u32) -> Result {
        let from = std::mem::take(self.slot(slot)?);
        let filled = from.2;
        if filled {
            self.columns.clone_from(&from.0);
            self.work = from.1;
        }
        *self.slot(slot)? = from;
        if filled { Ok(()) } else { Err(Error::Refused(format!("slot {slot} was never saved"))) }
    }

    pub(crate) fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = VERSION.to_le_bytes().to_vec();
        bytes.extend(self.work.to_le_bytes());
        for c in &self.columns {
            bytes.extend(c.key.to_le_bytes());
            for value in [c.z, c.z_max].iter().chain(&c.tangential) {
                bytes.extend(value.to_le_bytes());
            }
        }
        bytes
    }

    pub(crate) fn read_bytes(&mut self, bytes: &[u8]) -> Result {
        let (words, rest) = bytes.as_chunks::<8>();
        if !rest.is_empty() || words.len() < 2 || (words.len() - 2) % 6 != 0 {
            return Err(Error::Refused(format!("{} bytes are no state of soil columns", bytes.len())));
        }
        let version = u64::from_le_bytes(words[0]);
        if version != VERSION {
            return Err(Error::Refused(format!("state of version {version}, this module reads {VERSION}")));
        }
        self.work = f64::from_le_bytes(words[1]);
        self.columns.clear();
        for c in words[2..].chunks_exact(6) {
            let value = |k: usize| f64::from_le_bytes(c[k]);
            self.columns.push(Column {
                key: u64::from_le_bytes(c[0]),
                z: value(1),
                z_max: value(2),
                tangential: [value(3), value(4), value(5)],
            });
        }
        Ok(())
    }
}
