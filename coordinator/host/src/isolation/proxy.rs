//! The host's side of an isolated instance: a subsystem whose every call is made in its worker.

use super::calls::{self, Call};
use super::messages::Messages;
use super::sight::Question;
use super::tiles::Tiles;
use super::wire::{Reader, Writer};
use super::{Link, Start};
use std::cell::{Cell, RefCell};
use std::time::Instant;
use terraglue_subsystem::{
    Action, Batch, BodyState, Capabilities, Energy, Error, Estimate, FeedThrough, FieldInfo, FieldTile,
    Input, Law, Level, Message, Motion, Overlay, Response, Result, Scene, Step, StreamInfo, Subsystem,
    Terrain, Values, ValuesMut, Variable, World,
};

/// An instance in a worker.
pub struct Isolated {
    link: RefCell<Link>,
    about: ModuleInfo,
    tiles: Tiles,
    messages: Messages,
    /// Whether a failure of the overlays was reported.
    told: Cell<bool>,
}

/// Constants of its life.
pub struct ModuleInfo {
    pub capabilities: Capabilities,
    pub variables: Vec<Variable>,
    pub actions: Vec<Action>,
    pub scene: Scene,
    pub fields: Vec<FieldInfo>,
    pub streams: Vec<StreamInfo>,
    /// Whether it books energies and knows events; a functional mock-up unit does not.
    pub is_module: bool,
    /// Of a functional mock-up unit only.
    pub feed_through: Vec<FeedThrough>,
}

impl ModuleInfo {
    pub fn put(&self, w: &mut Writer) {
        w.put(&self.capabilities.0);
        w.put(&self.variables);
        w.put(&self.actions);
        w.put(&self.scene);
        w.put(&self.fields);
        w.put(&self.streams);
        w.put(&self.is_module);
        if !self.is_module {
            w.put(&self.feed_through);
        }
    }

    fn take(r: &mut Reader) -> Option<Self> {
        let mut all = Self {
            capabilities: Capabilities(r.take()?),
            variables: r.take()?,
            actions: r.take()?,
            scene: r.take()?,
            fields: r.take()?,
            streams: r.take()?,
            is_module: r.take()?,
            feed_through: Vec::new(),
        };
        if !all.is_module {
            all.feed_through = r.take()?;
        }
        Some(all)
    }
}

impl Isolated {
    pub fn start(mut link: Link, start: &Start, terrain: Option<&dyn Terrain>) -> Result<Self> {
        let text = serde_json::to_string(start).map_err(|e| Error::Failed(e.to_string()))?;
        let (about, tiles) = link.call(
            Call::Start,
            |w| {
                w.put(&text);
                w.put(&u8::from(terrain.is_some()));
                if let Some(terrain) = terrain {
                    put_terrain(w, terrain);
                }
            },
            |r| {
                let about = ModuleInfo::take(r)?;
                let mut tiles = Tiles::new(&about.fields);
                tiles.receive(r)?;
                Some((about, tiles))
            },
        )?;
        let messages = Messages::new(about.streams.len());
        Ok(Self { link: RefCell::new(link), about, tiles, messages, told: Cell::new(false) })
    }

    /// A call after which fields may have changed, and streams have other messages.
    fn change(&mut self, call: Call, write: impl FnOnce(&mut Writer)) -> Result {
        let (tiles, messages) = (&mut self.tiles, &mut self.messages);
        self.link.get_mut().call(call, write, |r| {
            tiles.receive(r)?;
            messages.receive(r)
        })
    }
}

/// Row by row, so that nothing large is made in between.
fn put_terrain(w: &mut Writer, terrain: &dyn Terrain) {
    let [nx, ny] = terrain.size();
    w.put(&terrain.origin());
    w.put(&terrain.spacing());
    w.put(&[nx, ny]);
    w.put(&nx.saturating_mul(ny));
    let mut row = vec![0.0; nx as usize];
    for j in 0..ny {
        terrain.heights(0, j.into(), row.len(), 1, &mut row);
        row.iter().for_each(|z| w.put(z));
    }
}

impl Subsystem for Isolated {
    fn capabilities(&self) -> Capabilities {
        // the exchange with the worker has no question for them
        Capabilities(self.about.capabilities.0 & !Capabilities::OUTPUT_DERIVATIVES.0)
    }

    fn set_ports(&mut self, step: &Step, laws: &mut [Law], now: &mut Response) -> Result {
        let given = laws.to_vec();
        self.link.get_mut().call(
            Call::SetPorts,
            |w| {
                calls::put_step(w, step);
                w.put(&given);
            },
            |r| {
                calls::take_laws(r, laws)?;
                calls::take_response(r, now)
            },
        )
    }

    fn estimate_forces(&mut self, step: &Step, partner: &Motion, out: &mut Estimate) -> Result {
        self.link.get_mut().call(
            Call::Estimate,
            |w| {
                calls::put_step(w, step);
                calls::put_motion(w, partner);
            },
            |r| {
                r.fill(out.t_star)?;
                r.fill(out.x_free)?;
                r.fill(out.g)?;
                let active: Vec<u8> = r.take()?;
                out.active.get_mut(..active.len())?.copy_from_slice(&active);
                out.unique = r.take()?;
                Some(())
            },
        )
    }

    fn solve_compatibility(&mut self, step: &Step, estimate: &Estimate, out: &mut Response) -> Result {
        self.link.get_mut().call(
            Call::Solve,
            |w| {
                calls::put_step(w, step);
                w.put(&*estimate.t_star);
                w.put(&*estimate.x_free);
                w.put(&*estimate.g);
                w.put(&*estimate.active);
                w.put(&estimate.unique);
            },
            |r| calls::take_response(r, out),
        )
    }

    fn advance(&mut self, step: &Step, input: &Input, out: &mut Response) -> Result {
        self.link.get_mut().call(
            Call::Advance,
            |w| {
                calls::put_step(w, step);
                calls::put_input(w, input);
            },
            |r| calls::take_response(r, out),
        )
    }

    fn advance_batch(&mut self, step: &Step, t: &[f64], out: &mut Batch) -> Result {
        if self.link.get_mut().is_python {
            return out.one_by_one(step, t, |step, input, out| self.advance(step, input, out));
        }
        let count = (out.x.len() / (step.n as usize).max(1)) as u32;
        self.link.get_mut().call(
            Call::AdvanceBatch,
            |w| {
                calls::put_step(w, step);
                w.put(&count);
                w.put(t);
            },
            |r| {
                r.fill(out.x)?;
                r.fill(out.v)?;
                r.fill(out.a)?;
                out.reached = r.take()?;
                Some(())
            },
        )
    }

    fn interface_jacobian(&mut self, step: &Step, level: Level, out: &mut [f64]) -> Result {
        self.link.get_mut().call(
            Call::Jacobian,
            |w| {
                calls::put_step(w, step);
                w.put(&(level as u32));
            },
            |r| r.fill(out),
        )
    }

    fn commit(&mut self, step: &Step, t: &[f64], partner: &Motion) -> Result {
        self.change(Call::Commit, |w| {
            calls::put_step(w, step);
            w.put(t);
            calls::put_motion(w, partner);
        })
    }

    fn observe(&mut self, step: &Step, world: &dyn World) -> Result {
        let (link, messages) = (self.link.get_mut(), &mut self.messages);
        let mut read = |r: &mut Reader| {
            let question = Question::take(r)?;
            if question.is_none() {
                messages.receive(r)?;
            }
            Some(question)
        };
        let since = Instant::now();
        let begin = |w: &mut Writer| {
            calls::put_step(w, step);
            w.put(&world.interval());
            w.put(&world.revision());
        };
        let mut asked = link.call(Call::Observe, begin, &mut read)?;
        while let Some(question) = asked {
            // a module that never stops asking hangs like one that never answers
            link.within(since)?;
            asked = link.call(Call::Answer, |w| question.answer(world, w), &mut read)?;
        }
        Ok(())
    }

    fn shape_visibility(&self, out: &mut [bool]) -> Result {
        out.fill(true);
        if out.is_empty() {
            return Ok(());
        }
        let shown: Vec<bool> = self.link.borrow_mut().call(Call::Visibility, |_| {}, |r| r.take())?;
        out.iter_mut().zip(shown).for_each(|(out, shown)| *out = shown);
        Ok(())
    }

    fn feed_through(&self) -> Vec<FeedThrough> {
        self.about.feed_through.clone()
    }

    fn streams(&self) -> &[StreamInfo] {
        &self.about.streams
    }

    fn stream(&self, k: usize) -> Result<Option<Message<'_>>> {
        self.messages.get(k)
    }

    fn overlays(&self, out: &mut Vec<Overlay>) {
        let shown: Result<Vec<Overlay>> = self.link.borrow_mut().call(Call::Overlays, |_| {}, |r| r.take());
        match shown {
            Ok(shown) => out.extend(shown),
            // what is only looked at ends no run
            Err(e) if !self.told.replace(true) => log::warn!("overlays failed, and are not drawn: {e}"),
            Err(_) => {}
        }
    }

    fn save_state(&mut self, slot: u32) -> Result {
        self.link.get_mut().call(Call::Save, |w| w.put(&slot), |_| Some(()))
    }

    fn restore_state(&mut self, slot: u32) -> Result {
        self.change(Call::Restore, |w| w.put(&slot))
    }

    fn serialize(&self) -> Result<Vec<u8>> {
        self.link.borrow_mut().call(Call::Serialize, |_| {}, |r| r.take())
    }

    fn deserialize(&mut self, bytes: &[u8]) -> Result {
        self.change(Call::Deserialize, |w| w.put(bytes))
    }

    fn variables(&self) -> &[Variable] {
        &self.about.variables
    }

    fn get(&self, ids: &[u32], mut out: ValuesMut) -> Result {
        let mut link = self.link.borrow_mut();
        let out = RefCell::new(&mut out);
        link.call(
            Call::Get,
            |w| {
                w.put(ids);
                calls::put_room(w, &out.borrow());
            },
            |r| calls::take_room(r, &mut out.borrow_mut()),
        )
    }

    fn set(&mut self, ids: &[u32], values: Values) -> Result {
        self.link.get_mut().call(
            Call::Set,
            |w| {
                w.put(ids);
                calls::put_values(w, &values);
            },
            |_| Some(()),
        )
    }

    fn directional_derivative(
        &self,
        unknowns: &[u32],
        knowns: &[u32],
        seed: &[f64],
        out: &mut [f64],
    ) -> Result {
        if self.about.is_module {
            return Err(Error::Unsupported);
        }
        self.link.borrow_mut().call(
            Call::Directional,
            |w| {
                w.put(unknowns);
                w.put(knowns);
                w.put(seed);
            },
            |r| r.fill(out),
        )
    }

    fn actions(&self) -> &[Action] {
        &self.about.actions
    }

    fn act(&mut self, action: &str, arguments: &str) -> Result {
        self.change(Call::Act, |w| {
            w.put(action);
            w.put(arguments);
        })
    }

    fn next_event_time(&self) -> f64 {
        if !self.about.is_module {
            return f64::INFINITY;
        }
        self.link.borrow_mut().call(Call::NextEvent, |_| {}, |r| r.take()).unwrap_or(f64::INFINITY)
    }

    fn scene(&self) -> Scene {
        self.about.scene.clone()
    }

    fn body_states(&self, out: &mut [BodyState]) -> Result {
        if out.is_empty() {
            return Ok(());
        }
        let found: Vec<BodyState> = self.link.borrow_mut().call(Call::BodyStates, |_| {}, |r| r.take())?;
        out.iter_mut().zip(found).for_each(|(out, s)| *out = s);
        Ok(())
    }

    fn fields(&self) -> &[FieldInfo] {
        &self.about.fields
    }

    fn field_tile(&self, field: usize, a: u32, b: u32) -> Result<FieldTile<'_>> {
        self.tiles
            .tile(field, a, b)
            .ok_or_else(|| Error::Refused(format!("no tile ({a}, {b}) of field {field}")))
    }

    fn energy(&self) -> Energy {
        if !self.about.is_module {
            return Energy::UNKNOWN;
        }
        self.link.borrow_mut().call(Call::Energy, |_| {}, |r| r.take()).unwrap_or(Energy::UNKNOWN)
    }
}
