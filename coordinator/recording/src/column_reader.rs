//! The variables in the messages of one channel, by their full names.

use crate::columns::{About, Columns};
use crate::tap::TopicInfo;
use crate::topics::{COLUMNS, SUBSYSTEM};

/// Reads the numbers of a topic of variables, `/<subsystem>` or `/<subsystem>/parameters`.
pub struct ColumnReader {
    names: Vec<String>,
    columns: Columns,
    values: Vec<f64>,
}

impl ColumnReader {
    /// The reader of a topic; none where it is not one of variables.
    pub fn of(topic: &TopicInfo) -> Option<Self> {
        let subsystem = topic.metadata.get(SUBSYSTEM)?;
        let about: Vec<About> = serde_json::from_str(topic.metadata.get(COLUMNS)?).ok()?;
        let names = about.iter().map(|a| format!("{subsystem}.{}", a.name)).collect();
        let columns = Columns::read(&about);
        Some(Self { names, values: vec![0.0; columns.count], columns })
    }

    /// Full names of the columns, `subsystem.variable`; elements of an array with their places.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// The numbers of a message, in the order of the names; none where it is damaged.
    pub fn read(&mut self, message: &[u8]) -> Option<&[f64]> {
        self.columns.decode(message, &mut self.values)?;
        Some(&self.values)
    }
}
