//! Abilities of a subsystem beyond `advance`; a strategy that lacks one of them is refused at load time.

/// A set of capabilities; plain bits, so that it crosses the C ABI unchanged.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Capabilities(pub u32);

impl Capabilities {
    /// `advance` takes [`crate::Input::Force`].
    pub const FORCE: Self = Self(1);
    /// `advance` takes [`crate::Input::Motion`].
    pub const MOTION: Self = Self(2);
    /// `estimate_forces` is implemented.
    pub const ESTIMATE: Self = Self(8);
    /// `solve_compatibility` is implemented.
    pub const SOLVE: Self = Self(16);
    /// `interface_jacobian` is implemented.
    pub const DERIVATIVES: Self = Self(32);
    /// Trials do not disturb the committed state and can be repeated.
    pub const RETRY: Self = Self(64);
    /// `save_state` and `restore_state` are implemented.
    pub const STATE: Self = Self(128);
    /// `serialize` and `deserialize` are implemented.
    pub const SERIALIZE: Self = Self(256);
    /// Makes steps of its own inside a communication step.
    pub const SUBCYCLES: Self = Self(512);
    /// Outputs depend directly on inputs of the same time.
    pub const FEEDTHROUGH: Self = Self(1024);
    /// Makes communication steps of one length only.
    pub const FIXED_STEP: Self = Self(4096);
    /// `observe` is implemented.
    pub const SEES: Self = Self(8192);
    /// `shape_visibility` is implemented; without it all shapes are shown and it is not called.
    pub const HIDES: Self = Self(16384);
    /// `directional_derivative` is implemented. Of FMUs; unknown to the C interface of modules.
    pub const DIRECTIONAL: Self = Self(1 << 31);
    /// `output_derivatives` is implemented. Of FMUs in this process; unknown to the C interface of modules.
    pub const OUTPUT_DERIVATIVES: Self = Self(1 << 30);

    /// All names, for messages and listings.
    pub const NAMES: [(Self, &'static str); 13] = [
        (Self::FORCE, "force input"),
        (Self::MOTION, "motion input"),
        (Self::ESTIMATE, "estimate_forces"),
        (Self::SOLVE, "solve_compatibility"),
        (Self::DERIVATIVES, "interface_jacobian"),
        (Self::RETRY, "repeatable trials"),
        (Self::STATE, "save and restore"),
        (Self::SERIALIZE, "serialize"),
        (Self::SUBCYCLES, "sub-cycles"),
        (Self::FEEDTHROUGH, "direct feed-through"),
        (Self::FIXED_STEP, "steps of one length only"),
        (Self::SEES, "sight"),
        (Self::HIDES, "shapes that can be hidden"),
    ];

    /// Whether all of `other` is in this set.
    pub const fn has(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// The names of the capabilities in the set.
    pub fn names(self) -> impl Iterator<Item = &'static str> {
        Self::NAMES.iter().filter(move |(c, _)| self.has(*c)).map(|(_, name)| *name)
    }
}

impl std::ops::BitOr for Capabilities {
    type Output = Self;
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}
