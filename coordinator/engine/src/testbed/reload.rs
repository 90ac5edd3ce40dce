//! Another instance in the place of one that runs: the same to everything around it, with other code.

use super::Testbed;
use super::subsystems::Subsystems;
use crate::observer::Event;
use crate::signals::Directory;
use terraglue_diagnostics::Error;
use terraglue_host::{Instance, TeardownErrors};
use terraglue_subsystem::{
    Action, Batch, BodyState, Capabilities, Energy, Estimate, FieldInfo, FieldTile, Input, Kind, Law, Level,
    Message, Motion, Overlay, Response, Scene, Step, StreamInfo, Subsystem, Values, ValuesMut, Variable,
    World,
};

impl Testbed {
    /// Writes a line into the recording at this communication point.
    pub fn note(&mut self, what: String) {
        self.events.push(Event { t_s: self.clock.t, what });
    }

    /// Errors of instances at their end.
    pub fn teardown_errors(&self) -> TeardownErrors {
        self.teardown_errors.clone()
    }

    /// Puts an instance in the place of the one of its name: with its state, or as it is (`afresh`). `count`: its number
    /// among those of this name. Answers with the size of the state in bytes; None: afresh.
    ///
    /// # Errors
    /// Why the old one stays; nothing has changed then.
    pub fn exchange(
        &mut self,
        new: Instance,
        afresh: bool,
        count: u64,
    ) -> std::result::Result<Option<usize>, String> {
        let told = |e: Error| match e {
            Error::Module { function, message, .. } => format!("{function}: {message}"),
            other => other.to_string(),
        };
        let slot = self.instances().iter().position(|i| i.name() == new.name());
        let slot = slot.ok_or_else(|| format!("there is no subsystem `{}`", new.name()))?;
        let kind = new.kind();
        let mut new = new.wrapped(|inner| Renumbered::of(inner, kind, count));
        let old = &self.subsystems.instances[slot];
        if let Some(why) = misfit(old, &new) {
            return Err(why);
        }
        let mut carried = None;
        if !afresh {
            let way = "--reload-reset starts it afresh";
            for (instance, which) in [(old, "old"), (&new, "new")] {
                if !instance.capabilities().has(Capabilities::SERIALIZE) {
                    return Err(format!("the {which} code cannot hand its state over as bytes; {way}"));
                }
            }
            let bytes = old.serialize().map_err(told)?;
            new.deserialize(&bytes).map_err(|e| format!("it does not take the state: {}; {way}", told(e)))?;
            carried = Some(bytes.len());
        }
        let mut states = vec![BodyState::REST; new.scene().bodies.len()];
        new.body_states(&mut states).map_err(told)?;
        let Subsystems { instances, schedules, members } = &mut self.subsystems;
        schedules[slot].has_bodies = !states.is_empty();
        members[slot].states = states;
        instances[slot] = new;
        // new variables can be read and set from now on
        self.signals.directory = Directory::new(instances);
        if schedules[slot].glued {
            instances[slot].watch();
        }
        Ok(carried)
    }
}

/// Difference of a new instance in properties on which connections, contacts and recordings of the old one depend.
fn misfit(old: &Instance, new: &Instance) -> Option<String> {
    if old.kind() != new.kind() {
        return Some("it is of another kind now; start the run again".into());
    }
    let lost = |all: Capabilities, now: Capabilities| {
        Capabilities(all.0 & !now.0 & !(Capabilities::SERIALIZE | Capabilities::STATE).0)
    };
    if let Some(name) = lost(old.capabilities(), new.capabilities()).names().next() {
        return Some(format!("it offers no {name} any more; start the run again"));
    }
    let same = |a: &Variable, b: &Variable| {
        (a.id, &a.name, a.value_type, a.causality, &a.dims)
            == (b.id, &b.name, b.value_type, b.causality, &b.dims)
    };
    let (a, b) = (old.variables(), new.variables());
    if let Some(k) = (0..a.len()).find(|k| !b.get(*k).is_some_and(|b| same(&a[*k], b))) {
        let name = &a[k].name;
        return Some(format!(
            "its variables changed: `{name}` is recorded and read by its place and number, which other code has to keep; \
             new variables stand behind all others; start the run again"
        ));
    }
    if old.scene() != new.scene() {
        return Some("its bodies or shapes changed; start the run again".into());
    }
    if old.fields() != new.fields() {
        return Some("its fields changed; start the run again".into());
    }
    if old.subsystem().streams() != new.subsystem().streams() {
        return Some("its streams changed; start the run again".into());
    }
    if old.actions().iter().any(|a| !new.actions().iter().any(|b| a.name == b.name)) {
        return Some("an action is gone; start the run again".into());
    }
    None
}

/// A soil whose tiles have other generations than those of the soil before it, which counted from its own start: what
/// others keep of a tile is then looked at again.
struct Renumbered {
    inner: Box<dyn Subsystem>,
    first: u64,
}

impl Renumbered {
    /// The `count`-th soil of its name.
    fn of(inner: Box<dyn Subsystem>, kind: Kind, count: u64) -> Box<dyn Subsystem> {
        if kind != Kind::Soil || inner.fields().is_empty() {
            return inner;
        }
        Box::new(Self { inner, first: count << 40 })
    }
}

impl Subsystem for Renumbered {
    fn capabilities(&self) -> Capabilities {
        self.inner.capabilities()
    }
    fn set_ports(
        &mut self,
        step: &Step,
        laws: &mut [Law],
        now: &mut Response,
    ) -> terraglue_subsystem::Result {
        self.inner.set_ports(step, laws, now)
    }
    fn estimate_forces(
        &mut self,
        step: &Step,
        partner: &Motion,
        out: &mut Estimate,
    ) -> terraglue_subsystem::Result {
        self.inner.estimate_forces(step, partner, out)
    }
    fn solve_compatibility(
        &mut self,
        step: &Step,
        estimate: &Estimate,
        out: &mut Response,
    ) -> terraglue_subsystem::Result {
        self.inner.solve_compatibility(step, estimate, out)
    }
    fn advance(&mut self, step: &Step, input: &Input, out: &mut Response) -> terraglue_subsystem::Result {
        self.inner.advance(step, input, out)
    }
    fn advance_batch(&mut self, step: &Step, t: &[f64], out: &mut Batch) -> terraglue_subsystem::Result {
        self.inner.advance_batch(step, t, out)
    }
    fn interface_jacobian(
        &mut self,
        step: &Step,
        level: Level,
        out: &mut [f64],
    ) -> terraglue_subsystem::Result {
        self.inner.interface_jacobian(step, level, out)
    }
    fn commit(&mut self, step: &Step, t: &[f64], partner: &Motion) -> terraglue_subsystem::Result {
        self.inner.commit(step, t, partner)
    }
    fn observe(&mut self, step: &Step, world: &dyn World) -> terraglue_subsystem::Result {
        self.inner.observe(step, world)
    }
    fn shape_visibility(&self, out: &mut [bool]) -> terraglue_subsystem::Result {
        self.inner.shape_visibility(out)
    }
    fn streams(&self) -> &[StreamInfo] {
        self.inner.streams()
    }
    fn stream(&self, k: usize) -> terraglue_subsystem::Result<Option<Message<'_>>> {
        self.inner.stream(k)
    }
    fn overlays(&self, out: &mut Vec<Overlay>) {
        self.inner.overlays(out);
    }
    fn save_state(&mut self, slot: u32) -> terraglue_subsystem::Result {
        self.inner.save_state(slot)
    }
    fn restore_state(&mut self, slot: u32) -> terraglue_subsystem::Result {
        self.inner.restore_state(slot)
    }
    fn serialize(&self) -> terraglue_subsystem::Result<Vec<u8>> {
        self.inner.serialize()
    }
    fn deserialize(&mut self, bytes: &[u8]) -> terraglue_subsystem::Result {
        self.inner.deserialize(bytes)
    }
    fn variables(&self) -> &[Variable] {
        self.inner.variables()
    }
    fn get(&self, ids: &[u32], out: ValuesMut) -> terraglue_subsystem::Result {
        self.inner.get(ids, out)
    }
    fn set(&mut self, ids: &[u32], values: Values) -> terraglue_subsystem::Result {
        self.inner.set(ids, values)
    }
    fn actions(&self) -> &[Action] {
        self.inner.actions()
    }
    fn act(&mut self, action: &str, arguments: &str) -> terraglue_subsystem::Result {
        self.inner.act(action, arguments)
    }
    fn next_event_time(&self) -> f64 {
        self.inner.next_event_time()
    }
    fn scene(&self) -> Scene {
        self.inner.scene()
    }
    fn body_states(&self, out: &mut [BodyState]) -> terraglue_subsystem::Result {
        self.inner.body_states(out)
    }
    fn fields(&self) -> &[FieldInfo] {
        self.inner.fields()
    }
    fn field_tile(&self, field: usize, a: u32, b: u32) -> terraglue_subsystem::Result<FieldTile<'_>> {
        let tile = self.inner.field_tile(field, a, b)?;
        Ok(FieldTile { generation: self.first.wrapping_add(tile.generation), ..tile })
    }
    fn energy(&self) -> Energy {
        self.inner.energy()
    }
}
