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
