//! Small dense systems, solved by elimination with partial pivoting; row-major.

/// LU factors of an n × n matrix.
#[derive(Clone, Debug, Default)]
pub struct Dense {
    n: usize,
    a: Vec<f64>,
    order: Vec<usize>,
}

impl Dense {
    /// A matrix of zeros to be filled through [`Dense::add`].
    pub fn reset(&mut self, n: usize) {
        self.n = n;
        self.a.clear();
        self.a.resize(n * n, 0.0);
    }

    /// Adds to an entry.
    pub fn add(&mut self, row: usize, column: usize, value: f64) {
        self.a[row * self.n + column] += value;
    }

    /// Factors in place; false where a pivot vanishes.
    pub fn factor(&mut self) -> bool {
        let n = self.n;
        self.order.clear();
        for k in 0..n {
            let mut pivot = k;
            for row in k + 1..n {
                if self.a[row * n + k].abs() > self.a[pivot * n + k].abs() {
                    pivot = row;
                }
            }
            self.order.push(pivot);
            if self.a[pivot * n + k] == 0.0 {
                return false;
            }
            if pivot != k {
                (0..n).for_each(|c| self.a.swap(k * n + c, pivot * n + c));
            }
            for row in k + 1..n {
                let factor = self.a[row * n + k] / self.a[k * n + k];
                self.a[row * n + k] = factor;
                for c in k + 1..n {
                    self.a[row * n + c] -= factor * self.a[k * n + c];
                }
            }
        }
        true
    }

    /// Solves in place.
    pub fn solve(&self, b: &mut [f64]) {
        let n = self.n;
        for (k, pivot) in self.order.iter().enumerate() {
            b.swap(k, *pivot);
        }
        for row in 1..n {
            let sum: f64 = (0..row).map(|c| self.a[row * n + c] * b[c]).sum();
            b[row] -= sum;
        }
        for row in (0..n).rev() {
            let sum: f64 = (row + 1..n).map(|c| self.a[row * n + c] * b[c]).sum();
            b[row] = (b[row] - sum) / self.a[row * n + row];
        }
    }
}
