//! Energy book of a subsystem, J.

/// Energies of the committed state and work done since the start, J.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Energy {
    /// Kinetic energy.
    pub kinetic: f64,
    /// Potential energy (gravity, springs, elastic soil), against a fixed reference.
    pub potential: f64,
    /// Energy turned into heat inside since the start (friction, plastic soil, numerical damping where known); ≥ 0.
    pub dissipated: f64,
    /// Work done **on** this subsystem through its ports since the start.
    pub port_work: f64,
    /// Mechanical work that its own motors have put in since the start (Σ τ·ω·h, signed).
    pub actuator_work: f64,
    /// Electrical energy that its motors have drawn since the start.
    pub electrical: f64,
}

impl Energy {
    /// Kinetic plus potential energy, J.
    pub fn mechanical(&self) -> f64 {
        self.kinetic + self.potential
    }
}
