//! Keys whose values are a fixed list of names, as enums: a `match` over one has no arm for unknown names.

/// An enum whose variants have a name each, in the order of the documentation.
macro_rules! named {
    ($(#[$about:meta])* $name:ident { $($(#[$doc:meta])* $variant:ident = $text:literal),+ $(,)? }) => {
        $(#[$about])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum $name {
            $($(#[$doc])* $variant),+
        }

        impl $name {
            /// All, in the order of the documentation.
            pub const ALL: &[Self] = &[$(Self::$variant),+];
            /// Their names, in the same order.
            pub const NAMES: &[&str] = &[$($text),+];

            /// The name in a scenario.
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $text),+
                }
            }

            /// The one of that name.
            pub fn named(name: &str) -> Option<Self> {
                Self::ALL.iter().copied().find(|one| one.name() == name)
            }
        }

        impl std::fmt::Display for $name {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str(self.name())
            }
        }
    };
}

named! {
    /// How subsystems are glued: `gluing.strategy`.
    StrategyKind {
        /// The paper's single pass: estimate, answer of the soil, bodies once more.
        Cooperative = "cooperative",
        /// The iteration against the estimate of the bodies, who are evaluated once.
        CooperativeCompliant = "cooperative-compliant",
        /// The generic T-T iteration by Newton's method, to agreement.
        Iterative = "iterative",
        /// One step of that iteration.
        SemiImplicit = "semi-implicit",
        /// Newton's method on the X-T form: motion in, force out.
        XtNewton = "xt-newton",
        /// A fixed point with acceleration, for subsystems without derivatives.
        Relaxed = "relaxed",
        /// All subsystems side by side with the forces of the step before, as FMI masters do.
        Jacobi = "jacobi",
        /// One after the other, each with the newest values.
        GaussSeidel = "gauss-seidel",
        /// Both sides as one system, as reference.
        Monolithic = "monolithic",
    }
}

named! {
    /// Which form of the interface problem `iterative` solves: `gluing.form`.
    FormChoice {
        /// X-T where the soil yields, T-T elsewhere, the other one on failure.
        Auto = "auto",
        /// Force in, motion out.
        Tt = "tt",
        /// Motion in, force out.
        Xt = "xt",
    }
}

named! {
    /// Initial guess of the iteration of a step: `gluing.start`.
    StartChoice {
        /// min(T*, F), from the estimate of the bodies and the law of the soil.
        Estimate = "estimate",
        /// T = 0, to show what the estimate saves.
        Zero = "zero",
    }
}

named! {
    /// How `relaxed` accelerates its fixed point: `gluing.relaxation`.
    Relaxation {
        /// Not at all.
        None = "none",
        /// By Aitken's factor.
        Aitken = "aitken",
        /// By Anderson's mixing of earlier residuals.
        Anderson = "anderson",
        /// By Broyden's update of an inverse Jacobian.
        Broyden = "broyden",
    }
}

named! {
    /// When within a step a connection passes its value: `order` of `[[connect]]`.
    ConnectionOrder {
        /// FMUs are stepped in the order of their structure where that avoids a delay.
        Structure = "structure",
        /// At the start of the step.
        Jacobi = "jacobi",
        /// The step is repeated until its values, in the middle and at the end, are those that it was made with.
        Iterate = "iterate",
        /// The step is repeated until the value at its end is the one that it was made with.
        IterateEnds = "iterate-ends",
    }
}

impl ConnectionOrder {
    /// Whether the step is repeated until its values are those that it was made with.
    pub fn repeats(self) -> bool {
        matches!(self, Self::Iterate | Self::IterateEnds)
    }
}

named! {
    /// Extrapolation of an input over a step that begins with the output that feeds it: `extrapolate` of `[[connect]]`.
    Extrapolate {
        /// It is held.
        Constant = "constant",
        /// The line through the last two values.
        Linear = "linear",
        /// The line along the derivative that the source provides.
        Derivatives = "derivatives",
    }
}

named! {
    /// Name of a fault: `kind` of `[[fault]]`.
    FaultChoice {
        /// A value of its own.
        Override = "override",
        /// Something is added.
        Offset = "offset",
        /// It is multiplied.
        Gain = "gain",
        /// Something is added that grows.
        Ramp = "ramp",
        /// The value of the moment is kept.
        Freeze = "freeze",
        /// The value comes late.
        Delay = "delay",
        /// Values get lost.
        DropOut = "drop-out",
        /// A random number is added.
        Noise = "noise",
    }
}

named! {
    /// Form of the ground at the start: `terrain.kind`.
    TerrainChoice {
        /// A level.
        Flat = "flat",
        /// An inclined plane.
        Slope = "slope",
        /// Waves of random phase.
        Undulating = "undulating",
        /// A crater.
        Crater = "crater",
        /// A grid of heights as text.
        EsriAscii = "esri-ascii",
        /// An elevation model.
        Geotiff = "geotiff",
        /// An image whose greys are heights.
        Png = "png",
    }
}

named! {
    /// Where the interface Jacobian of the bodies comes from: `gluing.jacobian`.
    JacobianChoice {
        /// The modules' own derivatives.
        Analytic = "analytic",
        /// Directional derivatives of FMUs, else central differences.
        Directional = "directional",
        /// Forward differences at the first iteration of a step.
        FiniteDifferences = "finite-differences",
        /// Forward differences once, then Broyden's updates.
        Broyden = "broyden",
        /// A control that neglects the coupling of the ports.
        Diagonal = "diagonal",
        /// A control that is never refreshed.
        Frozen = "frozen",
    }
}

impl JacobianChoice {
    /// The names that a scenario can choose; the others are controls of tests.
    pub const OFFERED: &[&str] = Self::NAMES.split_at(4).0;
}

named! {
    /// Level of the condition at joints: `gluing.level`.
    LevelChoice {
        /// Positions agree.
        Position = "position",
        /// Velocities agree.
        Velocity = "velocity",
        /// Accelerations agree.
        Acceleration = "acceleration",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_variants_are_the_same_list() {
        for (kind, name) in StrategyKind::ALL.iter().zip(StrategyKind::NAMES) {
            assert_eq!(kind.name(), *name);
            assert_eq!(StrategyKind::named(name), Some(*kind));
        }
        assert_eq!(StrategyKind::named("nothing"), None);
        assert_eq!(LevelChoice::named("velocity"), Some(LevelChoice::Velocity));
    }
}
