//! Contact: ports to the ground, the rigid estimate, and the contacts that are settled inside the subsystem, among
//! the bodies and with rigid ground.

pub(crate) mod bodies;
pub(crate) mod convex;
pub(crate) mod detection;
pub(crate) mod estimate;
pub(crate) mod memory;
pub(crate) mod plane;
pub(crate) mod port_jacobian;
pub(crate) mod ports;
pub(crate) mod reduce;
pub(crate) mod shapes;
pub(crate) mod surfaces;
pub(crate) mod triangles;
