//! The two traits: a module makes instances; an instance is stepped.

use crate::capability::Capabilities;
use crate::config::Config;
use crate::energy::Energy;
use crate::error::{Error, Result};
use crate::feed_through::FeedThrough;
use crate::field::{FieldInfo, FieldTile};
use crate::host::Host;
use crate::overlay::Overlay;
use crate::port::Law;
use crate::pose::BodyState;
use crate::scene::Scene;
use crate::schema::Schema;
use crate::stream::{Message, StreamInfo};
use crate::trial::{Batch, Estimate, Input, Level, Motion, Response, Step};
use crate::variable::{Action, Values, ValuesMut, Variable};
use crate::world::World;
use std::sync::Arc;

/// The static side of a module: what `export_subsystem!` takes.
pub trait Module {
    /// Name, kind and parameters.
    fn schema() -> Schema;
    /// Makes an instance. May allocate and read files below `host.folder()`. The terrain of the host may be
    /// read during this call only.
    ///
    /// # Errors
    /// [`Error::Refused`]: parameters without sense. [`Error::Failed`]: a file that cannot be read, or whatever else is
    /// missing.
    fn instantiate(config: &Config, host: Arc<dyn Host>) -> Result<Box<dyn Subsystem>>;
}

/// An instance. Only `capabilities` and `advance` are required; everything else is declared as a capability.
///
/// Calls come from one thread at a time.
pub trait Subsystem: Send {
    /// Capabilities of this instance.
    fn capabilities(&self) -> Capabilities;

    /// Paper, step 1. The ports of this step (grounds come first). Returns the committed X, V and,
    /// for a soil, t = the wrench of its law at that X. A ground may narrow `laws` (mu = tan φ, t_max), one
    /// per port; a ground's `x` along n is its own continuous surface x2 below the body, from its unrounded state.
    /// The default suits a body: its origin lies on itself, and it has no force of its own.
    ///
    /// # Errors
    /// [`Error::Failed`]: the subsystem cannot answer for these ports.
    fn set_ports(&mut self, _step: &Step, _laws: &mut [Law], now: &mut Response) -> Result {
        for values in [&mut *now.x, &mut *now.v, &mut *now.a, &mut *now.t] {
            values.fill(0.0);
        }
        Ok(())
    }

    /// Paper, step 2. If the other side of every contact were rigid and stood at `partner` at t + h: which
    /// wrenches? Solved, not applied.
    ///
    /// # Errors
    /// [`Error::Unsupported`]: not offered. [`Error::Discard`]: the step is too long. [`Error::Failed`]: no solution was found.
    fn estimate_forces(&mut self, _step: &Step, _partner: &Motion, _out: &mut Estimate) -> Result {
        Err(Error::Unsupported)
    }

    /// Paper, step 3. Given the estimate: `out.t` = T1, `out.x` = own surface under it. A trial.
    ///
    /// # Errors
    /// [`Error::Unsupported`]: not offered. [`Error::Discard`]: the step is too long. [`Error::Failed`]: no solution was found.
    fn solve_compatibility(&mut self, _step: &Step, _estimate: &Estimate, _out: &mut Response) -> Result {
        Err(Error::Unsupported)
    }

    /// Paper, steps 3 and 4. A trial from the committed state; without ports, a plain step.
    ///
    /// # Errors
    /// [`Error::Unsupported`]: an input that is not offered. [`Error::Discard`]: the step is too long. [`Error::Failed`]: no
    /// solution was found.
    fn advance(&mut self, step: &Step, input: &Input, out: &mut Response) -> Result;

    /// Trials of one step under several wrenches (packed one after the other in `t`), each from the committed state: all
    /// columns of a difference in one exchange. The last one counts as the last trial. Worth an implementation of its own
    /// where every call has a price.
    ///
    /// # Errors
    /// As [`Subsystem::advance`].
    fn advance_batch(&mut self, step: &Step, t: &[f64], out: &mut Batch) -> Result {
        out.one_by_one(step, t, |step, input, out| self.advance(step, input, out))
    }

    /// Derivatives at the last trial, n × n, column-major. After `Force`: G = dX/d(wrench on itself) at `level`.
    /// After `Motion`: K = d(wrench on itself)/dX (position) or /dV (velocity), sign as for a spring: the
    /// wrench on a soil grows with the motion that presses it, K is positive semi-definite. After `Force` with
    /// motion: column n of a port is dX_n/dT_n and dT_t/dT_n, columns t and m are dT/dX as after `Motion`.
    ///
    /// # Errors
    /// [`Error::Unsupported`]: not offered, or not at this level.
    fn interface_jacobian(&mut self, _step: &Step, _level: Level, _out: &mut [f64]) -> Result {
        Err(Error::Unsupported)
    }

    /// Paper, step 5. The last trial is accepted under T; the other side has moved to `partner`.
    ///
    /// # Errors
    /// [`Error::Failed`]: the state at t + h cannot be formed.
    fn commit(&mut self, _step: &Step, _t: &[f64], _partner: &Motion) -> Result {
        Ok(())
    }

    /// Looks at the committed world. Called once per step of an instance with [`Capabilities::SEES`], after all subsystems
    /// have committed the step and before anything reads them; `step` is the one that was committed, or has h = 0 at the
    /// start of a run. Observations belong to the committed state: variables, streams and `save_state` contain it from t + h
    /// on. Nothing of `world` may be kept.
    ///
    /// # Errors
    /// [`Error::Failed`]: the world cannot be evaluated.
    fn observe(&mut self, _step: &Step, _world: &dyn World) -> Result {
        Ok(())
    }

    /// The committed state, exactly, into one of `host.slots()` numbered slots.
    ///
    /// # Errors
    /// [`Error::Unsupported`]: not offered. [`Error::Refused`]: there is no such slot.
    fn save_state(&mut self, _slot: u32) -> Result {
        Err(Error::Unsupported)
    }

    /// Back to the state of a slot.
    ///
    /// # Errors
    /// [`Error::Unsupported`]: not offered. [`Error::Refused`]: nothing was saved in the slot.
    fn restore_state(&mut self, _slot: u32) -> Result {
        Err(Error::Unsupported)
    }

    /// The committed state as bytes with a version, for another process or day.
    ///
    /// # Errors
    /// [`Error::Unsupported`]: not offered.
    fn serialize(&self) -> Result<Vec<u8>> {
        Err(Error::Unsupported)
    }

    /// Back to a state made by `serialize`.
    ///
    /// # Errors
    /// [`Error::Unsupported`]: not offered. [`Error::Refused`]: the bytes are no state of this instance, which is unchanged.
    fn deserialize(&mut self, _bytes: &[u8]) -> Result {
        Err(Error::Unsupported)
    }

    /// All variables of this instance, in ascending order of id; constant over its life.
    fn variables(&self) -> &[Variable] {
        &[]
    }

    /// Committed values of the variables `ids`, all of the type of `out`.
    ///
    /// # Errors
    /// [`Error::Refused`]: an unknown id or another type. [`Error::Unsupported`]: there are no variables.
    fn get(&self, _ids: &[u32], _out: ValuesMut) -> Result {
        Err(Error::Unsupported)
    }

    /// New values for the variables `ids`; effective from the next step on.
    ///
    /// # Errors
    /// [`Error::Refused`]: an unknown id, another type, or a value that is not acceptable. [`Error::Unsupported`]: there are no
    /// variables.
    fn set(&mut self, _ids: &[u32], _values: Values) -> Result {
        Err(Error::Unsupported)
    }

    /// d(unknowns)/d(knowns)·seed of f64 variables at the committed time, where it is known without trying. Loops of
    /// connected values at the start are solved with it; without it they are solved with differences.
    ///
    /// # Errors
    /// [`Error::Unsupported`]: it is not known without trying.
    fn directional_derivative(
        &self,
        _unknowns: &[u32],
        _knowns: &[u32],
        _seed: &[f64],
        _out: &mut [f64],
    ) -> Result {
        Err(Error::Unsupported)
    }

    /// Outputs that follow inputs of a step at once, at its end, one entry for each output whose inputs are known. Where there is any,
    /// values of a trial can be read before it is committed. Of FMUs; unknown to the C interface of modules.
    fn feed_through(&self) -> Vec<FeedThrough> {
        Vec::new()
    }

    /// Derivatives of f64 outputs by time at the committed time, per second. Asked of an instance with
    /// [`Capabilities::OUTPUT_DERIVATIVES`] after its first step.
    ///
    /// # Errors
    /// [`Error::Unsupported`]: not offered. [`Error::Failed`]: they cannot be computed.
    fn output_derivatives(&self, _ids: &[u32], _out: &mut [f64]) -> Result {
        Err(Error::Unsupported)
    }

    /// All actions of this instance.
    fn actions(&self) -> &[Action] {
        &[]
    }

    /// Does an action; `arguments` is a JSON object.
    ///
    /// # Errors
    /// [`Error::Refused`]: an unknown action, or one that cannot be done now. [`Error::Unsupported`]: there are no actions.
    fn act(&mut self, _action: &str, _arguments: &str) -> Result {
        Err(Error::Unsupported)
    }

    /// Time of the next event known beforehand, s; ∞: none.
    fn next_event_time(&self) -> f64 {
        f64::INFINITY
    }

    /// Bodies, shapes and joints; constant over the life of the instance.
    fn scene(&self) -> Scene {
        Scene::default()
    }

    /// Committed states of the scene's bodies, in its order.
    ///
    /// # Errors
    /// [`Error::Failed`]: the states cannot be computed.
    fn body_states(&self, _out: &mut [BodyState]) -> Result {
        Ok(())
    }

    /// Which of the scene's shapes are shown, in its order; the others are neither drawn nor seen until they are shown again.
    /// It belongs to the committed state, which `save_state` and `serialize` keep. Asked of an instance with
    /// [`Capabilities::HIDES`]; of any other all are shown. Contact with soil does not ask for it.
    ///
    /// # Errors
    /// [`Error::Failed`]: it cannot be determined.
    fn shape_visibility(&self, out: &mut [bool]) -> Result {
        out.fill(true);
        Ok(())
    }

    /// Streams of this instance; constant over its life.
    fn streams(&self) -> &[StreamInfo] {
        &[]
    }

    /// The message that the last committed step made on stream number `k`; none: it made none. It may be read any number of
    /// times, and is borrowed until the next call that changes the instance.
    ///
    /// # Errors
    /// [`Error::Refused`]: there is no such stream. [`Error::Unsupported`]: there are no streams.
    fn stream(&self, _k: usize) -> Result<Option<Message<'_>>> {
        Err(Error::Unsupported)
    }

    /// Appends overlays of the committed state, shown with the bodies, to `out`. Called only when they are displayed or
    /// recorded, so it may be expensive.
    fn overlays(&self, _out: &mut Vec<Overlay>) {}

    /// Fields over the ground. `height`, where offered, is the surface that contact detection reads.
    fn fields(&self) -> &[FieldInfo] {
        &[]
    }

    /// Tile (a, b) of field number `field`.
    ///
    /// # Errors
    /// [`Error::Refused`]: there is no such field or tile. [`Error::Unsupported`]: there are no fields.
    fn field_tile(&self, _field: usize, _a: u32, _b: u32) -> Result<FieldTile<'_>> {
        Err(Error::Unsupported)
    }

    /// Energies of the committed state; unknown for a subsystem that keeps no energy ledger.
    fn energy(&self) -> Energy {
        Energy::UNKNOWN
    }
}
