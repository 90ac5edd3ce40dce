//! Arguments and results of the calls of a step. Laid out as the types of the subsystem interface
//! (held equal by `abi::layout`), so that ports and nodes cross without a copy.

/// t_min <= T_n <= t_max, |T_t| <= mu T_n, residual x1 - x2 + compliance T.
/// Bilateral -inf, inf; unilateral 0, inf; yielding 0, cap.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct TgLaw {
    /// Smallest normal force, N.
    pub t_min: f64,
    /// Largest normal force, N.
    pub t_max: f64,
    /// Coulomb coefficient that bounds the tangential force.
    pub mu: f64,
    /// Compliance of the glue itself, m/N.
    pub compliance: f64,
}

/// Where two subsystems are glued. For a contact the origin is the lowest point of the body along -n at t,
/// and n points from the soil into the body.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct TgPort {
    /// Stable over the run; ports come in ascending order of key.
    pub key: u64,
    /// TG_CONTACT, TG_JOINT or TG_NAMED.
    pub kind: u32,
    /// +1: T acts on this subsystem; -1: -T does.
    pub side: i32,
    /// Bit c: component c of (n, t1, t2, mn, mt1, mt2) is carried; see TG_N ... TG_MT2.
    pub mask: u32,
    /// First component of this port in packed vectors.
    pub first: u32,
    /// Index of the body of its scene, of the cell or of the terminal at this port.
    pub body: u32,
    /// Id of the scene shape on the side of the body; UINT32_MAX: none.
    pub shape: u32,
    /// First of the ground nodes below the shape.
    pub first_node: u32,
    /// How many ground nodes lie below the shape.
    pub node_count: u32,
    /// Reference point, world, m; fixed during the step.
    pub origin: [f64; 3],
    /// n, t1, t2 in the world, one after the other; fixed during the step.
    pub frame: [f64; 9],
    /// Half lengths of the contact along t1 and t2, m: bound the centre of pressure. Zero for a sphere.
    pub extent: [f64; 2],
    /// Bounds of the wrench and compliance of the glue.
    pub law: TgLaw,
}

/// A lattice node below a contact shape at t.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct TgNode {
    /// Index along x.
    pub i: i32,
    /// Index along y.
    pub j: i32,
    /// Horizontal area of the cell covered by the shape, m^2; at most spacing^2.
    pub area: f64,
    /// World height of the shape's underside at the node at t, m.
    pub lower: f64,
    /// d lower/dx and d lower/dy of the underside there (world): the body's inward normal is (-slope, 1).
    pub slope: [f64; 2],
}

/// One communication step as this subsystem sees it.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct TgStep {
    /// Time at the start of the step, s.
    pub t: f64,
    /// Length, s. 0: accelerations at t only, X and V stay (start of a run, new joint).
    pub h: f64,
    /// Accepted steps before this one.
    pub index: u64,
    /// Number of the trial in this step.
    pub trial: u32,
    /// Length of packed vectors.
    pub n: u32,
    /// Number of ports.
    pub n_ports: u32,
    /// Number of nodes.
    pub n_nodes: u32,
    /// All ports of this subsystem in ascending order of key.
    pub ports: *const TgPort,
    /// Ground nodes of all ports.
    pub nodes: *const TgNode,
}

/// Input on the ports during a trial; packed. Pointers that the kind does not use are null.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct TgInput {
    /// TG_FORCE or TG_MOTION.
    pub kind: u32,
    /// 0.
    pub reserved: u32,
    /// Wrench on side 1 (force).
    pub t: *const f64,
    /// Motion of the other side at t + h: displacement from the origin. After TG_FORCE it may be null.
    pub x: *const f64,
    /// Motion of the other side at t + h: velocity. Null exactly when `x` is.
    pub v: *const f64,
}

/// Motion of the other side; packed.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct TgMotion {
    /// Displacement from the port's origin, m and rad.
    pub x: *const f64,
    /// Velocity, m/s and rad/s.
    pub v: *const f64,
}

/// Answer of a trial at its end; packed. The vectors come filled with NaN: an entry that stays NaN is an error.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct TgResponse {
    /// Own displacement X.
    pub x: *mut f64,
    /// Own velocity V.
    pub v: *mut f64,
    /// Own acceleration A.
    pub a: *mut f64,
    /// T at the end: the input for bodies under force, the law's answer for a soil.
    pub t: *mut f64,
    /// Time reached, s. Comes as t + h; smaller: ended early, all sides repeat the trial up to the earliest.
    pub reached: f64,
    /// Bits TG_EVENT, TG_TERMINATE, TG_YIELDED. Comes as 0.
    pub flags: u32,
    /// 0.
    pub reserved: u32,
}

/// The rigid-contact estimate T*; packed. gap_free = x_free - x2 along n, x2 = the soil's answer to `set_ports`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct TgEstimate {
    /// T*: the wrenches that would hold every contact rigidly, of minimum norm. Never applied.
    pub t_star: *mut f64,
    /// Own X at t + h if no contact port carried a wrench.
    pub x_free: *mut f64,
    /// n x n, column-major: dX(t + h)/d(wrench on itself).
    pub g: *mut f64,
    /// Per port: 1 where T*_n > 0.
    pub active: *mut u8,
    /// For TG_DISCARD: time that could be reached, s.
    pub reached: f64,
    /// 1: T* is the only solution.
    pub unique: u32,
    /// 0.
    pub reserved: u32,
}
