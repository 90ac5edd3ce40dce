//! Energy ledger of a subsystem, J.

/// Energies of the committed state and work done since the start, J.
///
/// A field that is not a number is *unknown*: the subsystem keeps no energy ledger. It is shown as "unknown" and makes every
/// sum that needs it unknown, which 0 would not. [`Energy::UNKNOWN`] knows nothing, [`Energy::default`] is an empty ledger.
///
/// For a subsystem whose ledger is whole, the change of kinetic + potential + dissipated since the start is
/// port_work + actuator_work. For a soil that reads: heat + elastic energy + gravitational energy of the material = work
/// at its ports.
///
/// ```
/// use terraglue_subsystem::Energy;
/// let falling = Energy { kinetic: 2.0, potential: -2.0, ..Energy::UNKNOWN };
/// assert_eq!(falling.mechanical(), 0.0);
/// assert!(!falling.is_known() && falling.balance().is_nan());
/// let soil = Energy { potential: 0.5, dissipated: 1.5, port_work: 2.0, ..Energy::default() };
/// assert_eq!(soil.balance(), 0.0);
/// ```
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Energy {
    /// Kinetic energy.
    pub kinetic: f64,
    /// Potential energy against a fixed reference: gravity, springs; of a soil its elastic energy and the gravitational
    /// energy of its material.
    pub potential: f64,
    /// Energy turned into heat inside since the start (friction, plastic soil, numerical damping where known); ≥ 0, and
    /// never falls.
    pub dissipated: f64,
    /// Work done **on** this subsystem through its ports since the start. A soil takes the wrench of its own law, at the
    /// motion that was committed, and not the wrench that was passed to it.
    pub port_work: f64,
    /// Mechanical work that its own motors have put in since the start (Σ τ·ω·h, signed), and loads from outside.
    pub actuator_work: f64,
    /// Electrical energy that its motors have drawn since the start, where a drive with losses computes it; not a number for
    /// motors that are ideal.
    pub electrical: f64,
}

impl Energy {
    /// The ledger of a subsystem that keeps none.
    pub const UNKNOWN: Self = Self {
        kinetic: f64::NAN,
        potential: f64::NAN,
        dissipated: f64::NAN,
        port_work: f64::NAN,
        actuator_work: f64::NAN,
        electrical: f64::NAN,
    };

    /// Kinetic plus potential energy, J.
    pub fn mechanical(&self) -> f64 {
        self.kinetic + self.potential
    }

    /// Kinetic + potential + dissipated − port_work − actuator_work, J: stays as it was at the start where the ledger is
    /// true; not a number where one of them is unknown.
    pub fn balance(&self) -> f64 {
        self.mechanical() + self.dissipated - self.port_work - self.actuator_work
    }

    /// Whether the mechanical ledger is whole; the electrical energy may be unknown.
    pub fn is_known(&self) -> bool {
        !self.balance().is_nan()
    }

    /// The sum of two ledgers; unknown where one is.
    #[must_use]
    pub fn plus(&self, other: &Self) -> Self {
        Self {
            kinetic: self.kinetic + other.kinetic,
            potential: self.potential + other.potential,
            dissipated: self.dissipated + other.dissipated,
            port_work: self.port_work + other.port_work,
            actuator_work: self.actuator_work + other.actuator_work,
            electrical: self.electrical + other.electrical,
        }
    }
}
