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
        let places = self.places(names);
        self.push_at(t_s, &places, values);
    }

    /// The columns of some names, made where they are missing. A name that is empty has none: it is a variable that is not
    /// recorded.
    pub(crate) fn places(&mut self, names: &[String]) -> Vec<Option<usize>> {
        let mut guess = 0;
        let mut place = |name: &String| {
            let k = self.place(name, guess);
            guess = k + 1;
            k
        };
        names.iter().map(|name| (!name.is_empty()).then(|| place(name))).collect()
    }

    /// Appends a row of numbers by the columns that [`Table::places`] has found.
    pub(crate) fn push_at(&mut self, t_s: f64, places: &[Option<usize>], values: &[f64]) {
        let rows = self.t_s.len();
        self.t_s.push(t_s);
        for (place, value) in places.iter().zip(values) {
            if let Some(k) = place {
                // Missing bounds are infinite; nothing that is drawn or compared is.
                self.columns[*k].push(if value.is_finite() { *value } else { f64::NAN });
            }
        }
        self.columns.iter_mut().for_each(|c| c.resize(rows + 1, f64::NAN));
    }

    fn place(&mut self, name: &str, guess: usize) -> usize {
        if self.names.get(guess).is_some_and(|n| n == name) {
            return guess;
        }
        if let Some(k) = self.names.iter().position(|n| n == name) {
            return k;
        }
        self.names.push(name.to_owned());
        self.columns.push(vec![f64::NAN; self.t_s.len()]);
        self.names.len() - 1
    }
}
