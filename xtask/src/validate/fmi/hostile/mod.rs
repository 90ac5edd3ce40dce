//! Units that mean harm: what they do at each stage of their life.

pub(super) mod behaviour;
