//! A subsystem from the shared contact machinery and a soil's own rule for its material.

use crate::bookkeeping::{self, EnergyLedger, Lists};
use crate::compatibility::Compatibility;
use crate::cone;
use crate::contacts::Contacts;
use crate::ground::{Covered, Ground};
use crate::law_memory::LawMemory;
use crate::mask::Mask;
use crate::overlays;
use crate::patch::{Laws, Patches};
use crate::state::{Committed, Slot, Slots, Target};
use crate::trial::Last;
use crate::values;
use std::sync::Arc;
use terraglue_soil_law::strength::Inclination;
use terraglue_soil_law::{
    DEEPEST_TESTED, DEFAULT_DENSITY, PluginLaw, PressureLaw, SlipSinkage, SoilExpressions, SoilParameters,
};
use terraglue_subsystem::bytes::{self, Persist};
use terraglue_subsystem::{
    Capabilities, Config, Energy, Error, Estimate, FieldInfo, FieldTile, Host, Input, Law, Level, LogLevel,
    Motion, Overlay, Response, Result, Step, Subsystem, Values, ValuesMut, Variable,
};

/// Contact that is this small for so many commits in a row is worth a warning.
const FEW_NODES: u32 = 3;
const FEW_NODES_COMMITS: u32 = 100;

/// Motion of the material under and around a foot.
pub trait Material: Send {
    /// Exact copy of its own committed state.
    type Saved: Default + Send + Persist;

    /// Whether it reads [`Covered::virgin`].
    const READS_VIRGIN: bool = true;

    /// Looks at the ground before the first step, and may bring it to rest.
    ///
    /// # Errors
    /// The ground cannot be brought to rest.
    fn begin(&mut self, _ground: &mut Ground, _parameters: &SoilParameters) -> Result {
        Ok(())
    }
    /// Its variables, numbered from `first`; all are f64.
    fn variables(&self, _first: u32) -> Vec<Variable> {
        Vec::new()
    }
    /// Value of its variable number k.
    fn value(&self, _k: u32, _ground: &Ground) -> f64 {
        f64::NAN
    }
    /// New value, within its bounds, for its variable number k.
    ///
    /// # Errors
    /// [`Error::Refused`]: it can only be read, or the value is not acceptable.
    fn set_value(&mut self, _k: u32, _value: f64) -> Result {
        Err(Error::Refused("this value can only be read".into()))
    }
    /// The laws' parameters have changed.
    fn parameters_changed(&mut self, _ground: &Ground, _parameters: &SoilParameters) {}
    /// After the laws have taken a step of h seconds: puts the material where it belongs. `covered` are the nodes
    /// below feet. `most` (J): the gravitational energy that the step can pay for; material that would gain more waits.
    /// Returns the gravitational energy that the material has gained, J; a loss becomes heat.
    fn redistribute(&mut self, ground: &mut Ground, covered: &[Covered], most: f64, h: f64) -> f64;
    /// Copies the state into `out`.
    fn save(&self, _out: &mut Self::Saved) {}
    /// Whether a saved state contains nodes of this ground only.
    fn fits(&self, _saved: &Self::Saved, _ground: &Ground) -> bool {
        true
    }
    /// Back to a saved state.
    fn restore(&mut self, _saved: &Self::Saved) {}
}

/// A soil on a height field.
pub struct FieldSoil<M: Material> {
    host: Arc<dyn Host>,
    parameters: SoilParameters,
    expressions: Option<SoilExpressions>,
    plugin: Option<PluginLaw>,
    /// Of the scenario's own soil, then of those of the mask.
    laws: Vec<Laws>,
    ground: Ground,
    material: M,
    patches: Patches,
    lists: Lists,
    ledger: EnergyLedger,
    last: Last,
    compatibility: Compatibility,
    fields: [FieldInfo; 2],
    variables: Vec<Variable>,
    /// Number of the first variable of the contacts.
    first_contact: u32,
    slots: Slots<M::Saved>,
    few_nodes: u32,
    warned: [bool; 2],
}

impl<M: Material> FieldSoil<M> {
    /// A soil on the host's terrain. Refused: parameters without sense, a scenario without ground.
    ///
    /// # Errors
    /// [`Error::Refused`]: parameters without sense. [`Error::Failed`]: a scenario without ground.
    pub fn new(config: &Config, host: Arc<dyn Host>, mut material: M) -> Result<Self> {
        let parameters = SoilParameters::from_config(config, length(host.gravity()))?;
        let expressions = SoilExpressions::from_config(config)?;
        let plugin = plugin(config, host.as_ref(), &parameters)?;
        let mut ground = Ground::new(host.required_terrain()?)?;
        ground.mask = Mask::from_config(config, length(host.gravity()), ground.heights.lattice())?;
        ground.contacts = Contacts::new(config.optional_number("contacts_shown")?.unwrap_or(0.0) as usize);
        material.begin(&mut ground, &parameters)?;
        let mut variables = values::shared();
        variables.extend(material.variables(values::SHARED));
        let first_contact = variables.len() as u32;
        variables.extend(ground.contacts.variables(first_contact));
        let nodes = host.max_nodes() as usize;
        if let Some(law) = &plugin {
            ground.law_memory = LawMemory::new(*ground.heights.lattice(), law.state_doubles());
        }
        let (mut patches, mut lists) = (Patches::default(), Lists::default());
        patches.nodes.doubles = ground.law_memory.doubles();
        patches.reserve(nodes);
        lists.reserve(nodes);
        let mut compatibility = Compatibility::default();
        compatibility.reserve(nodes);
        let mut last = Last::default();
        last.reserve(nodes);
        let laws = all_laws(&parameters, &ground.mask, expressions.as_ref(), plugin.as_ref())?;
        if parameters.elastic_stiffness_pa_m.is_some() {
            warn_of_module(&laws[0], host.as_ref());
        }
        Ok(Self {
            laws,
            expressions,
            plugin,
            fields: [ground.heights.height_info(), ground.heights.sinkage_info()],
            slots: Slots::new(host.slots()),
            ledger: EnergyLedger::default(),
            last,
            compatibility,
            few_nodes: 0,
            warned: [false; 2],
            host,
            parameters,
            ground,
            material,
            patches,
            lists,
            variables,
            first_contact,
        })
    }

    /// The ground, for tests and drawings.
    pub fn ground(&self) -> &Ground {
        &self.ground
    }

    /// The material rule.
    pub fn material(&self) -> &M {
        &self.material
    }

    fn build(&mut self, step: &Step) -> Result {
        if let Some(plugin) = &self.plugin {
            plugin.begin(step.h);
        }
        self.patches.in_debt = self.ledger.owed > 0.0;
        self.patches.begins = self.ledger.stamp == 0;
        self.patches.build(step, &self.ground, &self.laws)
    }

    /// The end of a trial: whether a module that is the law can answer for the whole step.
    fn answered(&self, step: &Step) -> Result {
        self.plugin.as_ref().map_or(Ok(()), |plugin| plugin.reaches(step.t))
    }

    /// Fills x, v, a with the committed surface: along n as in `set_ports`, at rest otherwise.
    fn show_surface(&self, now: &mut Response) {
        now.x.fill(0.0);
        now.v.fill(0.0);
        now.a.fill(0.0);
        for patch in &self.patches.ports {
            patch.pack(&[patch.surface, 0.0, 0.0, 0.0, 0.0, 0.0], now.x);
        }
    }

    /// Makes a saved state the committed one.
    fn go_back(&mut self, slot: &Slot<M::Saved>) -> Result {
        let Self { ground, lists, ledger, parameters, .. } = self;
        slot.put_back(&mut Target { ground, loaded: &mut lists.loaded, ledger, parameters })?;
        self.material.restore(&slot.material);
        self.laws[0] = laws_of(&self.parameters, self.expressions.as_ref(), self.plugin.as_ref())?;
        self.patches.forget();
        self.last.clear();
        Ok(())
    }

    fn warn(&mut self, which: usize, text: &str) {
        if !std::mem::replace(&mut self.warned[which], true) {
            self.host.log(LogLevel::Warning, text);
        }
    }

    fn watch_range(&mut self) {
        let few = self.ledger.fewest > 0 && self.ledger.fewest < FEW_NODES;
        self.few_nodes = if few || self.ledger.narrow { self.few_nodes + 1 } else { 0 };
        if self.few_nodes >= FEW_NODES_COMMITS {
            let which = if few { "spans fewer than three cells" } else { "is narrower than a cell" };
            self.warn(0, &format!("a contact {which}; a finer spacing resolves it better"));
        }
        if self.ledger.max_sinkage > DEEPEST_TESTED {
            self.warn(1, "a foot sinks deeper than 0.3 m, beyond the range of the pressure law");
        }
    }
}

fn length(v: [f64; 3]) -> f64 {
    v.iter().map(|c| c * c).sum::<f64>().sqrt()
}

/// Size of a contact for which a law is checked before there is any, m.
const TYPICAL_SIZE: f64 = 0.1;

/// The laws of the scenario's own soil and of those of the mask.
fn all_laws(
    own: &SoilParameters,
    mask: &Mask,
    texts: Option<&SoilExpressions>,
    plugin: Option<&PluginLaw>,
) -> Result<Vec<Laws>> {
    std::iter::once(own).chain(&mask.soils).map(|p| laws_of(p, texts, plugin)).collect()
}

/// Warns where unloading is softer than a law that is a module; the host warns of the others, with their places.
fn warn_of_module(laws: &Laws, host: &dyn Host) {
    if let (PressureLaw::Plugin(law), Some(softened)) = (&laws.pressure, laws.pressure.softened(laws.elastic))
    {
        host.log(LogLevel::Warning, &softened.message(&format!(" `{}`", law.name())));
    }
}

/// The laws with these numbers; a law that the scenario writes as text replaces the built-in one.
fn laws_of(p: &SoilParameters, texts: Option<&SoilExpressions>, plugin: Option<&PluginLaw>) -> Result<Laws> {
    let mut laws = Laws {
        pressure: p.pressure(),
        shear: p.shear(),
        elastic: p.unloading(),
        adhesion: p.adhesion_pa,
        rolling: p.rolling,
        direction: p.direction,
        passive: p.strength().passive(),
        cone: cone::ConeMaterial {
            density: p.added_mass * p.density_kg_m3.unwrap_or(DEFAULT_DENSITY),
            slope: p.strength().passive_coefficient().sqrt(),
        },
        cohesive: p.strength().cohesive_pressure(),
        inclination: Inclination::new(p.phi_rad),
        loose: p.strength().loose_share(),
        plugin: plugin.cloned(),
    };
    if let Some(texts) = texts {
        if let Some(law) = texts.pressure(p)? {
            if p.rolling.sinkage != SlipSinkage::None && law.at_size(TYPICAL_SIZE).power_law().is_none() {
                let text =
                    "`slip_sinkage` acts on power laws, and `law.pressure` is none; it must be \"none\" here";
                return Err(Error::Refused(text.into()));
            }
            laws.take_pressure(PressureLaw::Expression(law), p)?;
        }
        if let Some(law) = texts.shear(p)? {
            laws.shear = laws.shear.with_expression(law);
        }
    }
    if let Some(law) = plugin {
        law.begin(0.0);
        if law.has_pressure() {
            laws.take_pressure(PressureLaw::Plugin(law.clone()), p)?;
            // checked as the built-in laws: one that fails here always will
            laws.pressure.curve(TYPICAL_SIZE, laws.elastic)?;
        }
        if law.has_shear() {
            laws.shear = laws.shear.with_plugin(law.clone())?;
        }
    }
    Ok(laws)
}

impl Laws {
    /// A pressure law replaces the built-in one, and the soil springs back by the default stiffness.
    fn take_pressure(&mut self, law: PressureLaw, p: &SoilParameters) -> Result {
        self.elastic = p.elastic_stiffness_pa_m.map_or_else(|| law.unloading(), Ok)?;
        self.shear = self.shear.above(self.elastic);
        self.pressure = law.looked_at(self.elastic);
        Ok(())
    }
}

/// The module that the scenario names as law.
fn plugin(config: &Config, host: &dyn Host, p: &SoilParameters) -> Result<Option<PluginLaw>> {
    let given = |key| config.get(key).is_some_and(|v| !v.is_null());
    if !given("law.plugin") {
        return Ok(None);
    }
    let refused = |text: &str| Err(Error::Refused(text.into()));
    let Some(law) = host.law() else {
        return refused("`law.plugin`: this program hands no law to the soil; it is older than the soil");
    };
    let law = PluginLaw::new(law);
    if law.has_pressure() && given("law.pressure") || law.has_shear() && given("law.shear") {
        return refused("`law.plugin` and the text beside it give the same law twice; leave one of them out");
    }
    if law.has_pressure() && p.rolling.sinkage != SlipSinkage::None {
        return refused("`slip_sinkage` acts on power laws; with `law.plugin` it must be \"none\"");
    }
    if law.state_doubles() > 0 && p.rolling.peak.is_some() {
        return refused("`wheel_peak_a0` needs a law without state: first loading has to be known apart");
    }
    if given("mask.soils") {
        return refused(
            "`[….mask]` gives regions numbers of their own, which `law.plugin` does not get; leave one of them out",
        );
    }
    Ok(Some(law))
}

impl<M: Material> Subsystem for FieldSoil<M> {
    fn capabilities(&self) -> Capabilities {
        Capabilities::FORCE
            | Capabilities::MOTION
            | Capabilities::SOLVE
            | Capabilities::DERIVATIVES
            | Capabilities::RETRY
            | Capabilities::STATE
            | Capabilities::SERIALIZE
    }

    fn set_ports(&mut self, step: &Step, laws: &mut [Law], now: &mut Response) -> Result {
        self.build(step)?;
        self.last.clear();
        for (law, patch) in laws.iter_mut().zip(&self.patches.ports) {
            // cohesion and the soil beside hold a foot that hardly presses, too
            let held = if patch.force[0] > 0.0 { patch.strength / patch.force[0] } else { 0.0 };
            law.mu = law.mu.min(patch.friction.max(held));
            law.t_min = law.t_min.min(-patch.pull);
        }
        self.show_surface(now);
        for patch in &self.patches.ports {
            patch.pack(&patch.force, now.t);
        }
        now.reached = step.t;
        Ok(())
    }

    fn solve_compatibility(&mut self, step: &Step, estimate: &Estimate, out: &mut Response) -> Result {
        self.build(step)?;
        let left = self.compatibility.solve(&self.patches, step.n as usize, estimate)?;
        self.last.clear();
        out.t.copy_from_slice(&self.compatibility.t);
        out.x.copy_from_slice(&self.compatibility.x);
        out.v.fill(0.0);
        out.a.fill(0.0);
        out.reached = step.t + step.h;
        self.answered(step)?;
        match left {
            Some(_) => Err(Error::Discard { reached: step.t + 0.5 * step.h }),
            None => Ok(()),
        }
    }

    fn advance(&mut self, step: &Step, input: &Input, out: &mut Response) -> Result {
        self.build(step)?;
        match input {
            Input::Motion(motion) => self.last.motion(&mut self.patches, motion, out)?,
            Input::Force { t, motion, .. } => {
                self.last.force(&mut self.patches, t, motion.as_ref(), out)?;
            }
        }
        out.a.fill(0.0);
        out.reached = step.t + step.h;
        self.answered(step)
    }

    fn interface_jacobian(&mut self, step: &Step, level: Level, out: &mut [f64]) -> Result {
        self.build(step)?;
        self.last.jacobian(&mut self.patches, step.n as usize, level, out)
    }

    fn commit(&mut self, step: &Step, t: &[f64], partner: &Motion) -> Result {
        if let Some(k) = partner.x.iter().position(|x| !x.is_finite()) {
            return Err(Error::Failed(format!("the foot's motion, component {k}, is not a number")));
        }
        self.build(step)?;
        let prints = self.patches.prints;
        let scene = bookkeeping::Scene { patches: &self.patches, h: step.h, virgin: M::READS_VIRGIN };
        let heat = self.ledger.dissipated;
        let taken =
            scene.commit(step.ports, t, partner.x, &mut self.ground, &mut self.lists, &mut self.ledger);
        self.patches.forget();
        self.last.clear();
        taken?;
        // the prints in which bodies stand at the start were made before
        let most = if prints { f64::INFINITY } else { self.ledger.dissipated - heat - self.ledger.owed };
        let lifted = self.material.redistribute(&mut self.ground, &self.lists.covered, most, step.h);
        let lifted = if prints { 0.0 } else { lifted };
        self.ledger.lifted += lifted;
        self.ledger.pay(lifted, heat);
        self.watch_range();
        Ok(())
    }

    fn save_state(&mut self, slot: u32) -> Result {
        let Self { ground, lists, ledger, parameters, .. } = self;
        let slot = self.slots.get_mut(slot)?;
        slot.fill(&Committed { ground, loaded: &lists.loaded, ledger, parameters });
        self.material.save(&mut slot.material);
        Ok(())
    }

    fn serialize(&self) -> Result<Vec<u8>> {
        let Self { ground, lists, ledger, parameters, .. } = self;
        let mut slot = Slot::<M::Saved>::default();
        slot.fill(&Committed { ground, loaded: &lists.loaded, ledger, parameters });
        self.material.save(&mut slot.material);
        Ok(slot.to_bytes(ground))
    }

    fn deserialize(&mut self, from: &[u8]) -> Result {
        let slot = Slot::<M::Saved>::from_bytes(from, &self.ground)?;
        if !self.material.fits(&slot.material, &self.ground) {
            return Err(bytes::wrong("they speak of nodes that this ground does not have"));
        }
        self.go_back(&slot)
    }

    fn restore_state(&mut self, slot: u32) -> Result {
        let slots = std::mem::replace(&mut self.slots, Slots::new(0));
        let done = slots.get(slot).and_then(|slot| self.go_back(slot));
        self.slots = slots;
        done
    }

    fn variables(&self) -> &[Variable] {
        &self.variables
    }

    fn get(&self, ids: &[u32], out: ValuesMut) -> Result {
        let ValuesMut::F64(out) = out else {
            return Err(Error::Refused("all values of a soil are f64".into()));
        };
        for (id, out) in ids.iter().zip(out) {
            if *id as usize >= self.variables.len() {
                return Err(Error::Refused(format!("no variable has the number {id}")));
            }
            if let Some(k) = id.checked_sub(self.first_contact) {
                *out = self.ground.contacts.value(k as usize);
                continue;
            }
            *out = values::get(*id, &self.ledger, &self.parameters)
                .unwrap_or_else(|| self.material.value(*id - values::SHARED, &self.ground));
        }
        Ok(())
    }

    fn set(&mut self, ids: &[u32], new: Values) -> Result {
        let Values::F64(new) = new else {
            return Err(Error::Refused("all values of a soil are f64".into()));
        };
        let before = self.parameters;
        for (id, value) in ids.iter().zip(new) {
            let variable = self
                .variables
                .get(*id as usize)
                .ok_or_else(|| Error::Refused(format!("no variable has the number {id}")))?;
            if *id < values::SHARED || *id >= self.first_contact {
                values::set(variable, *value, &mut self.parameters)?;
            } else {
                values::check(variable, *value)?;
                self.material.set_value(*id - values::SHARED, *value)?;
            }
        }
        match laws_of(&self.parameters, self.expressions.as_ref(), self.plugin.as_ref()) {
            Ok(laws) => self.laws[0] = laws,
            Err(refused) => {
                self.parameters = before;
                return Err(refused);
            }
        }
        self.material.parameters_changed(&self.ground, &self.parameters);
        self.patches.forget();
        Ok(())
    }

    fn overlays(&self, out: &mut Vec<Overlay>) {
        let friction = |[i, j]: [i32; 2]| self.laws[self.ground.mask.at(i, j)].shear.friction();
        overlays::of(&self.ground, &self.lists.loaded, friction, out);
    }

    fn fields(&self) -> &[FieldInfo] {
        &self.fields
    }

    fn field_tile(&self, field: usize, a: u32, b: u32) -> Result<FieldTile<'_>> {
        let [nx, ny] = self.ground.heights.lattice().tiles();
        match field {
            0 | 1 if a >= nx || b >= ny => Err(Error::Refused(format!("no tile ({a}, {b})"))),
            0 => Ok(self.ground.heights.height_tile(a, b)),
            1 => Ok(self.ground.heights.sinkage_tile(a, b)),
            _ => Err(Error::Refused(format!("no field number {field}"))),
        }
    }

    fn energy(&self) -> Energy {
        Energy {
            kinetic: self.ledger.kinetic,
            potential: self.ledger.elastic + self.ledger.lifted,
            dissipated: self.ledger.dissipated,
            port_work: self.ledger.port_work,
            ..Energy::default()
        }
    }
}
