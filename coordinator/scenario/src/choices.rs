//! Keys whose values are a fixed list of names, as enums: a `match` over one has no arm for a name that nobody knows.

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
        /// Newton's method on two subsystems that both take motion.
        XxNewton = "xx-newton",
        /// All subsystems side by side with the forces of the step before, as FMI masters do.
        Jacobi = "jacobi",
        /// One after the other, each with the newest values.
        GaussSeidel = "gauss-seidel",
        /// Transmission lines: physical springs only.
        Tlm = "tlm",
        /// Both sides as one system, as reference.
        Monolithic = "monolithic",
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
    }
}
