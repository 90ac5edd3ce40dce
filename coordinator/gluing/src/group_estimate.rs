//! The answer of step 2 of the paper, packed over all ports of a group.

/// T*, x_free and G1 over the group's ports.
#[derive(Debug, Default)]
pub struct GroupEstimate {
    /// Rigid-contact wrench, packed.
    pub t_star: Vec<f64>,
    /// End-of-step displacement without contact wrenches, packed.
    pub x_free: Vec<f64>,
    /// dX1/dT, column-major n × n.
    pub g: Vec<f64>,
    /// Per port.
    pub active: Vec<u8>,
    /// Whether T* is the only solution.
    pub unique: bool,
}

impl GroupEstimate {
    /// Nothing estimated yet of n components of that many ports.
    pub(super) fn reset(&mut self, n: usize, ports: usize) {
        for (buffer, size) in [(&mut self.t_star, n), (&mut self.x_free, n), (&mut self.g, n * n)] {
            buffer.clear();
            buffer.resize(size, 0.0);
        }
        self.active.clear();
        self.active.resize(ports, 0);
        self.unique = true;
    }
}
