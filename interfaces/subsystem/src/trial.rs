//! Arguments and results of the calls of a step: the step itself, inputs, responses, the estimate.

use crate::port::{Node, Port};

/// One communication step as this subsystem sees it. Borrowed: nothing in it outlives the call.
///
/// ```
/// use terraglue_subsystem::Step;
///
/// // the third step of 1 ms of a subsystem without ports
/// let step = Step::free(0.002, 0.001, 2);
/// assert!(step.ports.is_empty() && step.n == 0 && (step.t + step.h - 0.003).abs() < 1e-15);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Step<'a> {
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
    /// All ports of this subsystem in ascending order of key.
    pub ports: &'a [Port],
    /// Ground nodes of all ports.
    pub nodes: &'a [Node],
}

impl Step<'_> {
    /// A plain step without ports.
    pub const fn free(t: f64, h: f64, index: u64) -> Step<'static> {
        Step { t, h, index, trial: 0, n: 0, ports: &[], nodes: &[] }
    }
}

/// Wrenches or motions at the ports during a trial, packed.
#[derive(Clone, Copy, Debug)]
pub enum Input<'a> {
    /// The wrench T. For components that a constitutive law answers (shear and moments of a soil), `motion`
    /// carries the partner's motion at t + h: a soil then answers `x` = its surface under the normal force
    /// and `t` = the whole wrench that its law gives at that motion. Bodies ignore `motion`.
    Force {
        /// Wrench on side 1; a subsystem with smaller steps of its own holds it over all of them.
        t: &'a [f64],
        /// The partner's motion where it is known.
        motion: Option<Motion<'a>>,
    },
    /// Motion of the other side at t + h.
    Motion(Motion<'a>),
}

/// Level at which a derivative is requested.
#[repr(u32)]
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Level {
    /// Positions X.
    Position = 0,
    /// Velocities V.
    Velocity = 1,
    /// Accelerations A.
    Acceleration = 2,
}

/// Motion of the other side; packed.
#[derive(Clone, Copy, Debug)]
pub struct Motion<'a> {
    /// Displacement from the port's origin, m and rad.
    pub x: &'a [f64],
    /// Velocity, m/s and rad/s.
    pub v: &'a [f64],
}

/// Answer of a trial at its end; packed. Comes filled with NaN: an entry that stays NaN is an error of the subsystem.
#[derive(Debug)]
pub struct Response<'a> {
    /// Own displacement X.
    pub x: &'a mut [f64],
    /// Own velocity V.
    pub v: &'a mut [f64],
    /// Own acceleration A.
    pub a: &'a mut [f64],
    /// T at the end: the input for bodies under force, the law's answer for a soil.
    pub t: &'a mut [f64],
    /// Time reached, s; < t + h: ended early, all sides repeat the trial up to the earliest.
    pub reached: f64,
    /// Bits of [`flag`].
    pub flags: u32,
}

/// Answers of several trials of one step, one after the other; filled with NaN before the call like a [`Response`].
#[derive(Debug)]
pub struct Batch<'a> {
    /// X of all trials.
    pub x: &'a mut [f64],
    /// V of all trials.
    pub v: &'a mut [f64],
    /// A of all trials.
    pub a: &'a mut [f64],
    /// Room for T of one trial.
    pub t: &'a mut [f64],
    /// Earliest time reached, s.
    pub reached: f64,
}

impl Batch<'_> {
    /// Makes the trials one by one: `t` holds one wrench after the other.
    ///
    /// # Errors
    /// Those of `advance`.
    pub fn one_by_one(
        &mut self,
        step: &Step,
        t: &[f64],
        mut advance: impl FnMut(&Step, &Input, &mut Response) -> crate::Result,
    ) -> crate::Result {
        let n = step.n as usize;
        for (k, t) in t.chunks_exact(n.max(1)).enumerate() {
            let own = k * n..(k + 1) * n;
            let mut out = Response {
                x: &mut self.x[own.clone()],
                v: &mut self.v[own.clone()],
                a: &mut self.a[own],
                t: self.t,
                reached: step.t + step.h,
                flags: 0,
            };
            let step = Step { trial: step.trial + k as u32, ..*step };
            advance(&step, &Input::Force { t, motion: None }, &mut out)?;
            self.reached = self.reached.min(out.reached);
        }
        Ok(())
    }
}

/// Bits of [`Response::flags`].
pub mod flag {
    /// Something happened at `reached`.
    pub const EVENT: u32 = 1;
    /// The subsystem asks for the end of the run.
    pub const TERMINATE: u32 = 2;
    /// A port yields.
    pub const YIELDED: u32 = 4;
}

/// The rigid-contact estimate T*; packed. gap_free = x_free − x2 along n, x2 = the soil's answer to `set_ports`.
#[derive(Debug)]
pub struct Estimate<'a> {
    /// T*: the wrenches that would hold every contact rigidly, of minimum norm. Never applied.
    pub t_star: &'a mut [f64],
    /// Own X at t + h if no contact port carried a wrench.
    pub x_free: &'a mut [f64],
    /// n × n, column-major: dX(t + h)/d(wrench on itself).
    pub g: &'a mut [f64],
    /// Per port: 1 where T*_n > 0.
    pub active: &'a mut [u8],
    /// Whether T* is the only solution.
    pub unique: bool,
}
