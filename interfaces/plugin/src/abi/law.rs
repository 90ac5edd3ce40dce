//! Pressure and shear laws as modules of their own.
use super::constants::TgStatus;
use std::ffi::c_char;

/// Nodes of one contact at one trial of a step, one entry per node in each array.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct TgPressureNodes {
    /// Number of nodes.
    pub n: usize,
    /// The numbers of the law, in the order of its schema.
    pub parameters: *const f64,
    /// How many.
    pub n_parameters: usize,
    /// Size of the contact, m: radius of a disc, short side of a rectangle, width of a wheel.
    pub b: f64,
    /// Length of the step, s; 0: no time passes.
    pub h: f64,
    /// Depth below the level at which the surface would be if the node had never been pressed, m; larger than zero
    /// for a law without state.
    pub depth: *const f64,
    /// Laws with state only, else null: depth of the unloaded surface, m.
    pub permanent: *const f64,
    /// Laws with state only, else null: accumulated slip, m.
    pub slip: *const f64,
    /// Laws with state only, else null: the committed state, `state_doubles` per node.
    pub state: *const f64,
}

/// Answer of a pressure law; filled with NaN before the call.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct TgPressureAnswer {
    /// Pressure, Pa; never negative.
    pub pressure: *mut f64,
    /// Its derivative by the depth, Pa/m.
    pub slope: *mut f64,
    /// Laws with state only, else null: depth of the unloaded surface after this step, m.
    pub permanent: *mut f64,
    /// Laws with state only, else null: the state after this step.
    pub state: *mut f64,
    /// Longest step that the law can answer for, s; inf before the call. Smaller than h: the step is repeated
    /// with it.
    pub longest: f64,
}

/// Nodes that are sheared.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct TgShearNodes {
    /// Number of nodes.
    pub n: usize,
    /// The numbers of the law, in the order of its schema.
    pub parameters: *const f64,
    /// How many.
    pub n_parameters: usize,
    /// Length of the step, s.
    pub h: f64,
    /// Pressure, Pa; not negative.
    pub pressure: *const f64,
    /// Accumulated slip since the contact began, m.
    pub slip: *const f64,
    /// Laws with state only, else null: the committed state.
    pub state: *const f64,
}

/// Answer of a shear law; filled with NaN before the call.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct TgShearAnswer {
    /// Stress up to which the soil is elastic, Pa; it falls neither with the pressure nor with the slip.
    pub stress: *mut f64,
    /// Its derivative by the pressure.
    pub by_pressure: *mut f64,
    /// Its derivative by the slip, Pa/m.
    pub by_slip: *mut f64,
    /// As in `tg_pressure_answer`.
    pub longest: f64,
}

/// The functions of a law. They keep nothing from call to call and are called from any thread, several at a time.
/// A law without state is the curve of first loading; unloading is elastic by the rule of the soil. A law with
/// state answers for unloading, too.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct TgNodeLaw {
    /// sizeof(tg_node_law) of the module. Entries beyond it count as null.
    pub size: u32,
    /// Doubles per node that the soil keeps for the law; at most 16.
    pub state_doubles: u32,
    /// Pressure and slope of all nodes; null: the soil's own pressure law acts.
    /// When: at any time. Thread: any, several at once.
    pub pressure:
        Option<unsafe extern "C" fn(nodes: *const TgPressureNodes, out: *mut TgPressureAnswer) -> TgStatus>,
    /// Yield stress of all nodes; null: the soil's own shear law acts.
    /// When: at any time. Thread: any, several at once.
    pub shear: Option<unsafe extern "C" fn(nodes: *const TgShearNodes, out: *mut TgShearAnswer) -> TgStatus>,
}

/// A law with its numbers, as a soil gets it.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct TgOpenLaw {
    /// Name, for messages.
    pub name: *const c_char,
    /// Its functions.
    pub law: *const TgNodeLaw,
    /// Its numbers, for `parameters` of every call.
    pub parameters: *const f64,
    /// How many.
    pub n_parameters: usize,
}
