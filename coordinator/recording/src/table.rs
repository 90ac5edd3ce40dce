//! A table of numbers by name over time.

/// Columns of equal length; row k belongs to time `t_s[k]`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// Simulated time, s.
    pub t_s: Vec<f64>,
    /// Names in the order of the first message.
    pub names: Vec<String>,
    /// One column per name; NaN where a message had no such number.
    pub columns: Vec<Vec<f64>>,
}

impl Table {
    /// A column by name.
    pub fn column(&self, name: &str) -> Option<&[f64]> {
        self.names.iter().position(|n| n == name).map(|k| self.columns[k].as_slice())
    }

    /// Appends a row of numbers by name.
    pub(crate) fn push(&mut self, t_s: f64, names: &[String], values: &[f64]) {
        let rows = self.t_s.len();
        self.t_s.push(t_s);
        let mut guess = 0;
        // A place without a name is a variable that is not recorded.
        for (name, value) in names.iter().zip(values).filter(|(name, _)| !name.is_empty()) {
            let k = self.place(name, guess, rows);
            guess = k + 1;
            self.columns[k].resize(rows, f64::NAN);
            // What has no bound is infinite; nothing that is drawn or compared is.
            self.columns[k].push(if value.is_finite() { *value } else { f64::NAN });
        }
        self.columns.iter_mut().for_each(|c| c.resize(rows + 1, f64::NAN));
    }

    fn place(&mut self, name: &str, guess: usize, rows: usize) -> usize {
        if self.names.get(guess).is_some_and(|n| n == name) {
            return guess;
        }
        if let Some(k) = self.names.iter().position(|n| n == name) {
            return k;
        }
        self.names.push(name.to_owned());
        self.columns.push(vec![f64::NAN; rows]);
        self.names.len() - 1
    }
}
