//! Supply of all motors of a robot: an ideal source, or a battery with an open-circuit voltage over its charge and an
//! internal resistance.
//!
//! U = U0(charge) − R·I with P = U·I, the upper root of U² − U0·U + R·P = 0. The motors of a step see the voltage that
//! follows from the step before; motors that the voltage limits draw less at a lower one, which is taken into account
//! in its prediction, so that a weak battery cannot make it swing.

/// Most points of the open-circuit voltage.
pub(crate) const POINTS: usize = 16;

/// Data and state of the supply. Without capacity it is an ideal source of `voltage`.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub(crate) struct Supply {
    /// Open-circuit voltage at evenly spaced charges from 0 to 1, V.
    pub open_circuit: [f64; POINTS],
    pub points: usize,
    /// Ω.
    pub resistance: f64,
    /// A s; 0: no battery.
    pub capacity: f64,
    /// Share of the capacity.
    pub charge: f64,
    /// Voltage that the motors see in the next step, V.
    pub limit: f64,
    /// Voltage and current of the last step, V and A.
    pub voltage: f64,
    pub current: f64,
    /// Energy delivered, lost in the internal resistance, and requested beyond its capability, J.
    pub delivered: f64,
    pub lost: f64,
    pub missing: f64,
}

/// Energy and charge that the motors drew in a step.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Draw {
    /// All power, W.
    pub power: f64,
    /// Power of motors that the voltage limits, W, and by how much their current falls with it, A/V.
    pub starved: f64,
    pub conductance: f64,
}

impl Supply {
    /// An ideal source.
    pub fn ideal(voltage: f64) -> Self {
        Self { limit: voltage, voltage, charge: 1.0, ..Self::default() }
    }

    /// Whether it is a battery.
    pub fn is_battery(&self) -> bool {
        self.capacity > 0.0
    }

    /// Open-circuit voltage at the present charge, V; 0 when it is empty.
    pub fn open_circuit_v(&self) -> f64 {
        if self.charge <= 0.0 {
            return 0.0;
        }
        let x = self.charge.min(1.0) * self.points.saturating_sub(1) as f64;
        let i = (x as usize).min(self.points.saturating_sub(2));
        let (a, b) = (self.open_circuit[i], self.open_circuit[(i + 1).min(POINTS - 1)]);
        if self.points < 2 { a } else { a + (b - a) * (x - i as f64) }
    }

    /// Books a step of length h and predicts the voltage of the next one.
    pub fn advance(&mut self, draw: &Draw, h: f64) {
        if !self.is_battery() {
            self.current = if self.voltage > 0.0 { draw.power / self.voltage } else { 0.0 };
            self.delivered += draw.power * h;
            return;
        }
        let (u0, r) = (self.open_circuit_v(), self.resistance);
        let root = u0 * u0 - 4.0 * r * draw.power;
        self.voltage = 0.5 * (u0 + root.max(0.0).sqrt());
        let power = if root < 0.0 { 0.25 * u0 * u0 / r } else { draw.power };
        self.current = if self.voltage > 0.0 { power / self.voltage } else { 0.0 };
        self.missing += (draw.power - power) * h;
        self.delivered += power * h;
        self.lost += r * self.current * self.current * h;
        self.charge = (self.charge - self.current * h / self.capacity).clamp(0.0, 1.0);
        self.limit = self.predict(draw);
    }

    /// (1 + R·G)·U² − (U0 − R·(I_s − G·U_n))·U + R·P = 0 with the starved motors' current I_s + G·(U − U_n).
    fn predict(&self, draw: &Draw) -> f64 {
        let (u0, r, before) = (self.open_circuit_v(), self.resistance, self.limit);
        let starved = if before > 0.0 { draw.starved / before } else { 0.0 };
        let a = 1.0 + r * draw.conductance;
        let b = u0 - r * (starved - draw.conductance * before);
        let c = r * (draw.power - draw.starved);
        (0.5 * (b + (b * b - 4.0 * a * c).max(0.0).sqrt()) / a).max(0.0)
    }
}

terraglue_subsystem::persist!(Supply {
    open_circuit,
    points,
    resistance,
    capacity,
    charge,
    limit,
    voltage,
    current,
    delivered,
    lost,
    missing,
});

#[cfg(test)]
#[path = "../../tests/unit/battery.rs"]
mod tests;
