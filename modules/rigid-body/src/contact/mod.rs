//! Contact: ports to the ground, the rigid estimate, and contacts among the robot's own bodies.

pub(crate) mod estimate;
pub(crate) mod ports;
pub(crate) mod self_contact;
