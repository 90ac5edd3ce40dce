//! The committed state: motion of the bodies, settings and memory of the joints, energy ledger.

use crate::actuator::Actuator;
use crate::actuator::battery::Supply;
use crate::actuator::curve::Mode;
use crate::contact::memory::Pressed;
use crate::dynamics::scheme::Acceleration;
use crate::math::V3;
use crate::motion::Motion;
use crate::motor::Motor;
use terraglue_subsystem::Energy;

mod bytes;

/// External force and moment on a body, world axes.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub(crate) struct Load {
    /// Force at the centre of mass, N.
    pub force: V3,
    /// Moment about it, N m.
    pub moment: V3,
}

/// Settings, inputs and memory of a joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct JointState {
    /// Committed coordinate and rate, rad or m.
    pub angle: f64,
    pub velocity: f64,
    /// Torque or force of the motor in the last step, N m or N.
    pub torque: f64,
    pub angle_target: f64,
    pub velocity_target: f64,
    pub torque_target: f64,
    pub max_torque: f64,
    pub stiffness: f64,
    pub damping: f64,
    pub motor: Motor,
    /// Coordinate at which it is blocked.
    pub blocked: Option<f64>,
    pub broken: bool,
    /// Branch of the axis in the last step, where the next step starts looking.
    pub mode: Mode,
    pub actuator: Actuator,
}

/// A connection beyond the tree.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub(crate) struct ClosureState {
    pub broken: bool,
    /// Magnitudes of force (N) and moment (N m) in the last step.
    pub force: f64,
    pub moment: f64,
    /// Energy in a spring, J.
    pub stored: f64,
}

/// Results of the last step for contacts among the bodies and with rigid ground.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub(crate) struct ContactLedger {
    /// Points that pressed.
    pub points: usize,
    /// Residual of the contact problem.
    pub residual: f64,
    /// Energy lost in impacts and friction since the start, J.
    pub lost: f64,
    /// Rate by which rigid motors gave way at their largest torque, rad/s or m/s.
    pub yielding: f64,
}

/// All that changes from step to step.
#[derive(Debug, PartialEq, Default)]
pub(crate) struct State {
    pub bodies: Vec<Motion>,
    pub joints: Vec<JointState>,
    pub closures: Vec<ClosureState>,
    /// Redundant rows of loops at the last step.
    pub redundant_rows: usize,
    /// External force and moment of each body.
    pub loads: Vec<Load>,
    /// Reaction of each joint on its child in the last step: force at the anchor, moment about it, world axes, N and N
    /// m.
    pub reactions: Vec<[f64; 6]>,
    /// Normal force of all ports of a body, N.
    pub contact_normal: Vec<f64>,
    pub energy: Energy,
    pub contact: ContactLedger,
    /// Contact forces of the last step.
    pub pressed: Vec<Pressed>,
    pub supply: Supply,
    /// Position of body 0 at the start; distances are counted from there.
    pub start: Option<V3>,
    /// By how much positions are ahead of rates, s: half the last step, 0 at the start.
    pub stagger: f64,
    /// Accelerations at t, where the integrator keeps them.
    pub accelerations: Vec<Acceleration>,
    /// Whether they are known; until then the first step finds them.
    pub accelerated: bool,
}

impl State {
    /// Counts work, heat, drawn energy and distance from here on. The energy in batteries and windings stays.
    pub fn restart_ledger(&mut self) {
        let Energy { kinetic, potential, .. } = self.energy;
        self.energy = Energy { kinetic, potential, ..Energy::default() };
        (self.contact.lost, self.start) = (0.0, None);
        (self.supply.delivered, self.supply.lost, self.supply.missing) = (0.0, 0.0, 0.0);
        self.joints.iter_mut().for_each(|j| j.actuator.restart_ledger());
    }

    /// Takes over another state without allocating once the sizes are equal.
    pub fn copy_from(&mut self, other: &Self) {
        self.bodies.clone_from(&other.bodies);
        self.joints.clone_from(&other.joints);
        self.closures.clone_from(&other.closures);
        self.redundant_rows = other.redundant_rows;
        self.loads.clone_from(&other.loads);
        self.contact_normal.clone_from(&other.contact_normal);
        self.reactions.clone_from(&other.reactions);
        self.accelerations.clone_from(&other.accelerations);
        self.accelerated = other.accelerated;
        (self.energy, self.stagger) = (other.energy, other.stagger);
        self.contact = other.contact;
        self.pressed.clone_from(&other.pressed);
        (self.supply, self.start) = (other.supply, other.start);
    }
}
