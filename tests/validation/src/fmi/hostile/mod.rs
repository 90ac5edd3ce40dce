//! FMUs that mean harm: archives and descriptions before any of their code runs, and behaviour while they live.

pub(super) mod archives;
pub(super) mod behaviour;
