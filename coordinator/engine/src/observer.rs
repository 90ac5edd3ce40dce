//! Looking at a run: recorders, progress bars and pages implement [`Observer`] and get the committed state.

use terraglue_diagnostics::error::{Error, Result};
use terraglue_gluing::StepReport;
use terraglue_subsystem::{BodyState, Energy, Kind, Scene, Subsystem};

/// A subsystem as an observer sees it: committed values only.
pub struct SubsystemView<'a> {
    /// Name in the scenario.
    pub name: &'a str,
    /// Module name.
    pub module: &'a str,
    /// Kind.
    pub kind: Kind,
    /// Bodies and shapes.
    pub scene: &'a Scene,
    /// Committed states of the bodies.
    pub body_states: &'a [BodyState],
    /// For variables, fields and energy.
    pub instance: &'a dyn Subsystem,
}

/// A stream with the messages of the last nominal step.
#[derive(Clone, Debug, PartialEq)]
pub struct StreamView {
    /// Its full name, `subsystem.stream`.
    pub name: String,
    /// Its description.
    pub info: terraglue_subsystem::StreamInfo,
    /// Times (s) and bytes, in the order in which they were made.
    pub messages: Vec<(f64, Vec<u8>)>,
}

/// The energies of a subsystem as they enter the sum of all: one that carries signals only has none, unless it reports
/// them, and a soil has no motors.
pub fn ledger_of(kind: Kind, energy: &Energy) -> Energy {
    let or_none = |value: f64| if value.is_nan() { 0.0 } else { value };
    match kind {
        Kind::Robot => *energy,
        Kind::Soil => Energy {
            actuator_work: or_none(energy.actuator_work),
            electrical: or_none(energy.electrical),
            ..*energy
        },
        Kind::Controller | Kind::Law | Kind::Sensor => Energy {
            kinetic: or_none(energy.kinetic),
            potential: or_none(energy.potential),
            dissipated: or_none(energy.dissipated),
            port_work: or_none(energy.port_work),
            actuator_work: or_none(energy.actuator_work),
            electrical: or_none(energy.electrical),
        },
    }
}

/// The whole testbed at a communication point.
pub struct View<'a> {
    /// Simulated time, s.
    pub t_s: f64,
    /// Accepted steps so far.
    pub step_index: u64,
    /// Length of the last step, s.
    pub h_s: f64,
    /// All subsystems in the order of their names.
    pub subsystems: &'a [SubsystemView<'a>],
    /// Gluing of the last step; of step 0 all zero.
    pub gluing: &'a StepReport,
    /// Sum over all subsystems.
    pub energy: Energy,
    /// All streams, in the order of their subsystems.
    pub streams: &'a [StreamView],
}

/// Something that happened or was changed, written so that it can go back into a scenario.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Event {
    /// Simulated time, s.
    pub t_s: f64,
    /// E.g. `set robot.LF_j2.max_torque = 0 (was 60)`.
    pub what: String,
}

terraglue_subsystem::persist!(Event { t_s, what });

/// Follows a run. All methods are called from the stepping thread.
pub trait Observer {
    /// Before the first step.
    ///
    /// # Errors
    /// Failure of the observer, such as of writing a file; it ends the run.
    fn started(&mut self, _view: &View) -> Result {
        Ok(())
    }
    /// After every commit.
    ///
    /// # Errors
    /// Failure of the observer, such as of writing a file; it ends the run.
    fn stepped(&mut self, _view: &View) -> Result {
        Ok(())
    }
    /// An event, a `set`, an action, a warning of the run.
    ///
    /// # Errors
    /// Failure of the observer, such as of writing a file; it ends the run.
    fn event(&mut self, _event: &Event) -> Result {
        Ok(())
    }
    /// After the last step, also of a run that failed or was stopped.
    ///
    /// # Errors
    /// Failure of the observer, such as of writing a file; it ends the run.
    fn finished(&mut self, _view: &View, _error: Option<&Error>) -> Result {
        Ok(())
    }
}
