//! The ports of a step, as all strategies and subsystems see them.

use terraglue_subsystem::{Node, Port};

/// Ports in ascending order of key with the nodes below them. All ports are written from the side of the body.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PortSet {
    /// Ports; `first` counts through all of them.
    pub ports: Vec<Port>,
    /// Ground nodes of all ports, one port after the other.
    pub nodes: Vec<Node>,
    /// Owners of the ports, in the same order.
    pub owners: Vec<PortOwner>,
    /// Grows when a port appears, goes or changes its mask.
    pub epoch: u32,
    /// Length of packed vectors over all ports.
    pub n: u32,
}

/// The two sides of a port.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PortOwner {
    /// Index of the subsystem that has the body.
    pub subsystem: u32,
    /// Index of the subsystem that has the ground.
    pub ground: u32,
    /// Index of the body in the scene of its subsystem.
    pub body: u32,
    /// Id of the shape; of several that touch as one piece the largest.
    pub shape: u32,
}

/// Key of the contact of a piece on a ground, by the id of its first shape: the same over the whole run, ascending by
/// subsystem, ground, shape.
pub fn port_key(subsystem: u32, ground: u32, shape: u32) -> u64 {
    u64::from(subsystem & 0xffff) << 48 | u64::from(ground & 0xffff) << 32 | u64::from(shape)
}
