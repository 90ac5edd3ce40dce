//! The worker's side: makes one instance and answers calls until the host ends it or is gone.

use super::calls::{self, Call, OwnedStep};
use super::channel::{self, Segment};
use super::messages::Messages;
use super::printed::Printed;
use super::proxy::ModuleInfo;
use super::sight;
use super::tiles::Tiles;
use super::wire::{Reader, Writer};
use super::worker_channel::WorkerChannel;
use super::{Line, Start, What};
use crate::{HostServices, Library, LoadedModule, TeardownErrors, Workers};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use terraglue_subsystem::{
    Batch, BodyState, Config, Error, Estimate, Host, LogLevel, Motion, Result, Subsystem, Terrain,
    TerrainTile,
};

/// Serves the host that made the segment at `path`; `library` brings what makes FMUs.
pub fn serve(path: &Path, library: &Library) -> ExitCode {
    let host = channel::parent();
    std::thread::spawn(move || {
        // An orphan ends with all that it has started.
        while channel::parent() == host {
            std::thread::sleep(Duration::from_millis(500));
        }
        channel::end_group(std::process::id());
    });
    let Ok(segment) = Segment::open(path) else { return ExitCode::FAILURE };
    let channel = WorkerChannel::new(segment);
    let printed = Printed::of_this_process();
    let mut worker = Worker { library: library.clone(), printed, ..Worker::default() };
    loop {
        let request = channel.next(&worker.log.cancel);
        let quits = request.first() == Some(&(Call::Quit as u8));
        let done = catch_unwind(AssertUnwindSafe(|| worker.answer(&request, &channel)));
        let mut segment = channel.segment.borrow_mut();
        let length = done.unwrap_or_else(|_| {
            let mut w = Writer::new(segment.area(1));
            calls::write_outcome(&mut w, &[], &Err(Error::Fatal("panicked in its process".into())));
            w.length().unwrap_or(0)
        });
        segment.post_answer(length);
        if quits {
            // The host ends the whole group; nothing of the instance runs any more.
            loop {
                std::thread::sleep(Duration::from_secs(1));
            }
        }
    }
}

/// Lines on their way to the host, and whether the run is to stop.
#[derive(Default)]
struct Log {
    lines: Mutex<Vec<Line>>,
    cancel: Arc<AtomicBool>,
}

/// Most lines between two answers.
const LINES: usize = 1000;

impl Log {
    fn put(&self, level: LogLevel, text: &str) {
        let mut lines = self.lines.lock().unwrap_or_else(PoisonError::into_inner);
        if lines.len() < LINES {
            lines.push((level, text.chars().take(10_000).collect()));
        }
    }

    fn take(&self) -> Vec<Line> {
        std::mem::take(&mut self.lines.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

#[derive(Default)]
struct Worker {
    library: Library,
    log: Arc<Log>,
    printed: Printed,
    subsystem: Option<Box<dyn Subsystem>>,
    is_module: bool,
    tiles: Tiles,
    known: sight::Known,
    teardown_errors: TeardownErrors,
}

fn garbled() -> Error {
    Error::Fatal("the call is garbled".into())
}

impl Worker {
    /// Does one call and writes its answer; the length.
    fn answer(&mut self, request: &[u8], channel: &WorkerChannel) -> usize {
        let mut r = Reader::new(request);
        let call = r.take::<u8>().and_then(Call::of);
        let mut body = Vec::new();
        let outcome = match call {
            None => Err(garbled()),
            Some(Call::Start) => self.start(&mut r),
            Some(Call::Quit) => {
                self.subsystem = None;
                match self.teardown_errors.take() {
                    all if all.is_empty() => Ok(()),
                    all => Err(Error::Failed(all.join("; "))),
                }
            }
            Some(Call::Observe) => match &mut self.subsystem {
                Some(subsystem) => sight::observe(subsystem.as_mut(), &mut r, channel, &mut self.known),
                None => Err(garbled()),
            },
            Some(call) => self.call(call, &mut r, &mut body),
        };
        if call.is_none_or(Call::is_rare) {
            self.printed.take(|line| self.log.put(LogLevel::Info, line));
        }
        let mut segment = channel.segment.borrow_mut();
        let area = segment.area(1);
        let mut w = Writer::new(area);
        let lines = self.log.take();
        calls::write_outcome(&mut w, &lines, &outcome);
        if outcome.is_ok() {
            self.append(call, &mut w, &body);
        }
        w.length().unwrap_or_else(|| {
            let mut w = Writer::new(area);
            let text = "the answer does not fit into the shared memory of an isolated subsystem".to_owned();
            calls::write_outcome(&mut w, &[], &Err(Error::Failed(text)));
            w.length().unwrap_or(0)
        })
    }

    /// Appends the data that follow a good outcome.
    fn append(&mut self, call: Option<Call>, w: &mut Writer, body: &[u8]) {
        let Some(subsystem) = &self.subsystem else { return };
        match call {
            Some(Call::Start) => {
                let about = ModuleInfo {
                    capabilities: subsystem.capabilities(),
                    variables: subsystem.variables().to_vec(),
                    actions: subsystem.actions().to_vec(),
                    scene: subsystem.scene(),
                    fields: subsystem.fields().to_vec(),
                    streams: subsystem.streams().to_vec(),
                    feed_through: subsystem.feed_through(),
                    is_module: self.is_module,
                };
                about.put(w);
                self.tiles = Tiles::new(&about.fields);
                self.tiles.send(subsystem.as_ref(), w);
            }
            Some(Call::Commit | Call::Restore | Call::Deserialize | Call::Act) => {
                self.tiles.send(subsystem.as_ref(), w);
                Messages::send(subsystem.as_ref(), w);
            }
            Some(Call::Observe) => {
                w.put(&0_u8);
                Messages::send(subsystem.as_ref(), w);
            }
            _ => w.bytes(body),
        }
    }

    fn start(&mut self, r: &mut Reader) -> Result {
        let text: String = r.take().ok_or_else(garbled)?;
        let start: Start = serde_json::from_str(&text).map_err(|e| Error::Fatal(e.to_string()))?;
        let terrain = match r.take::<u8>().ok_or_else(garbled)? {
            0 => None,
            _ => Some(Grid::take(r).ok_or_else(garbled)?),
        };
        channel::confine(start.memory_bytes);
        self.is_module = matches!(start.what, What::Module { .. });
        let host: Arc<dyn Host> = Arc::new(WorkerHost {
            log: self.log.clone(),
            workers: Workers::new(1),
            terrain,
            start: start.clone(),
        });
        self.subsystem = Some(match start.what {
            What::Fmu { path, parameters } => {
                (self.library.fmus()?)(&path, &parameters, host, self.teardown_errors.clone())?
            }
            What::Module { path, config } => {
                let module = LoadedModule::load(&path).map_err(|e| Error::Refused(e.to_string()))?;
                let config = Config::parse(&config.to_string())?;
                module.make(&config, host, &self.services(&start.folder))?
            }
            What::Python { path, .. } | What::Law { path, .. } => {
                return Err(Error::Refused(format!("{} is served by an interpreter", path.display())));
            }
        });
        Ok(())
    }

    /// Services for a process beside the instance.
    fn services(&self, folder: &str) -> HostServices {
        let log = self.log.clone();
        HostServices {
            cancel: self.log.cancel.clone(),
            log: Some(Arc::new(move |_, level, text| log.put(level, text))),
            teardown_errors: self.teardown_errors.clone(),
            ..HostServices::new(0, Path::new(folder))
        }
    }

    /// Does a call on the instance; what it answers goes into `body`.
    fn call(&mut self, call: Call, r: &mut Reader, body: &mut Vec<u8>) -> Result {
        let subsystem = self.subsystem.as_mut().ok_or_else(garbled)?.as_mut();
        let mut out = Answer { body };
        match call {
            Call::SetPorts => set_ports(subsystem, r, &mut out),
            Call::Estimate => estimate(subsystem, r, &mut out),
            Call::Solve => solve(subsystem, r, &mut out),
            Call::Advance => advance(subsystem, r, &mut out),
            Call::AdvanceBatch => advance_batch(subsystem, r, &mut out),
            Call::Jacobian => jacobian(subsystem, r, &mut out),
            Call::Commit => {
                let step = OwnedStep::take(r).ok_or_else(garbled)?;
                let [t, x, v]: [Vec<f64>; 3] = three(r)?;
                subsystem.commit(&step.step(), &t, &Motion { x: &x, v: &v })
            }
            Call::Save => subsystem.save_state(r.take().ok_or_else(garbled)?),
            Call::Restore => subsystem.restore_state(r.take().ok_or_else(garbled)?),
            Call::Serialize => {
                let bytes = subsystem.serialize()?;
                out.write(|w| w.put(&bytes))
            }
            Call::Deserialize => subsystem.deserialize(&r.take::<Vec<u8>>().ok_or_else(garbled)?),
            Call::Get => get(subsystem, r, &mut out),
            Call::Set => {
                let ids: Vec<u32> = r.take().ok_or_else(garbled)?;
                calls::with_values(r, |values| subsystem.set(&ids, values)).ok_or_else(garbled)?
            }
            Call::Act => {
                let (action, arguments): (String, String) =
                    (r.take().ok_or_else(garbled)?, r.take().ok_or_else(garbled)?);
                subsystem.act(&action, &arguments)
            }
            Call::NextEvent => out.write(|w| w.put(&subsystem.next_event_time())),
            Call::BodyStates => {
                let mut states = vec![BodyState::REST; subsystem.scene().bodies.len()];
                subsystem.body_states(&mut states)?;
                out.write(|w| w.put(&states))
            }
            Call::Directional => directional(subsystem, r, &mut out),
            Call::Energy => out.write(|w| w.put(&subsystem.energy())),
            Call::Visibility => {
                let mut shown = vec![true; subsystem.scene().shapes.len()];
                subsystem.shape_visibility(&mut shown)?;
                out.write(|w| w.put(&shown))
            }
            Call::Overlays => {
                let mut shown = Vec::new();
                subsystem.overlays(&mut shown);
                out.write(|w| w.put(&shown))
            }
            Call::Start | Call::Quit | Call::Pressure | Call::Shear | Call::Observe | Call::Answer => {
                Err(garbled())
            }
        }
    }
}

fn set_ports(subsystem: &mut dyn Subsystem, r: &mut Reader, out: &mut Answer) -> Result {
    let step = OwnedStep::take(r).ok_or_else(garbled)?;
    let mut laws: Vec<_> = r.take().ok_or_else(garbled)?;
    calls::with_response(&step.step(), |now| {
        subsystem.set_ports(&step.step(), &mut laws, now)?;
        out.write(|w| {
            w.put(&laws);
            calls::put_response(w, now);
        })
    })
}

fn advance(subsystem: &mut dyn Subsystem, r: &mut Reader, out: &mut Answer) -> Result {
    let step = OwnedStep::take(r).ok_or_else(garbled)?;
    let done = calls::with_input(r, |input| {
        calls::with_response(&step.step(), |now| {
            subsystem.advance(&step.step(), input, now)?;
            out.write(|w| calls::put_response(w, now))
        })
    });
    done.ok_or_else(garbled)?
}

fn directional(subsystem: &mut dyn Subsystem, r: &mut Reader, out: &mut Answer) -> Result {
    let (unknowns, knowns): (Vec<u32>, Vec<u32>) =
        (r.take().ok_or_else(garbled)?, r.take().ok_or_else(garbled)?);
    let seed: Vec<f64> = r.take().ok_or_else(garbled)?;
    let mut values = vec![f64::NAN; unknowns.len()];
    subsystem.directional_derivative(&unknowns, &knowns, &seed, &mut values)?;
    out.write(|w| w.put(values.as_slice()))
}

fn advance_batch(subsystem: &mut dyn Subsystem, r: &mut Reader, out: &mut Answer) -> Result {
    let step = OwnedStep::take(r).ok_or_else(garbled)?;
    let (count, t): (u32, Vec<f64>) = (r.take().ok_or_else(garbled)?, r.take().ok_or_else(garbled)?);
    let n = step.step().n as usize;
    if t.len() != n * count as usize {
        return Err(garbled());
    }
    let [mut x, mut v, mut a] = [(); 3].map(|()| vec![f64::NAN; n * count as usize]);
    let reached = step.step().t + step.step().h;
    let mut all = Batch { x: &mut x, v: &mut v, a: &mut a, t: &mut vec![f64::NAN; n], reached };
    subsystem.advance_batch(&step.step(), &t, &mut all)?;
    let reached = all.reached;
    out.write(|w| {
        [&x, &v, &a].into_iter().for_each(|values| w.put(values.as_slice()));
        w.put(&reached);
    })
}

fn jacobian(subsystem: &mut dyn Subsystem, r: &mut Reader, out: &mut Answer) -> Result {
    let step = OwnedStep::take(r).ok_or_else(garbled)?;
    let level = r.take().and_then(calls::level_of).ok_or_else(garbled)?;
    let n = step.step().n as usize;
    let mut matrix = vec![f64::NAN; n * n];
    subsystem.interface_jacobian(&step.step(), level, &mut matrix)?;
    out.write(|w| w.put(&matrix))
}

fn get(subsystem: &mut dyn Subsystem, r: &mut Reader, out: &mut Answer) -> Result {
    let ids: Vec<u32> = r.take().ok_or_else(garbled)?;
    let (kind, count) = (r.take().ok_or_else(garbled)?, r.take::<u32>().ok_or_else(garbled)?);
    let mut done = Ok(());
    calls::fill_room(
        kind,
        count as usize,
        |room| subsystem.get(&ids, room),
        |got, write| {
            done = got.clone();
            if done.is_ok() {
                done = out.write(write);
            }
        },
    );
    done
}

fn three(r: &mut Reader) -> Result<[Vec<f64>; 3]> {
    let mut next = || r.take().ok_or_else(garbled);
    Ok([next()?, next()?, next()?])
}

fn estimate(subsystem: &mut dyn Subsystem, r: &mut Reader, out: &mut Answer) -> Result {
    let step = OwnedStep::take(r).ok_or_else(garbled)?;
    let (x, v): (Vec<f64>, Vec<f64>) = (r.take().ok_or_else(garbled)?, r.take().ok_or_else(garbled)?);
    let n = step.step().n as usize;
    let [mut t_star, mut x_free, mut g] = [n, n, n * n].map(|n| vec![f64::NAN; n]);
    let mut active = vec![0; step.step().ports.len()];
    let mut e =
        Estimate { t_star: &mut t_star, x_free: &mut x_free, g: &mut g, active: &mut active, unique: false };
    subsystem.estimate_forces(&step.step(), &Motion { x: &x, v: &v }, &mut e)?;
    let unique = e.unique;
    out.write(|w| {
        w.put(&t_star);
        w.put(&x_free);
        w.put(&g);
        w.put(&active);
        w.put(&unique);
    })
}

fn solve(subsystem: &mut dyn Subsystem, r: &mut Reader, out: &mut Answer) -> Result {
    let step = OwnedStep::take(r).ok_or_else(garbled)?;
    let [mut t_star, mut x_free, mut g] = three(r)?;
    let mut active: Vec<u8> = r.take().ok_or_else(garbled)?;
    let unique = r.take().ok_or_else(garbled)?;
    let e = Estimate { t_star: &mut t_star, x_free: &mut x_free, g: &mut g, active: &mut active, unique };
    calls::with_response(&step.step(), |now| {
        subsystem.solve_compatibility(&step.step(), &e, now)?;
        out.write(|w| calls::put_response(w, now))
    })
}

/// Bytes of an answer.
struct Answer<'a> {
    body: &'a mut Vec<u8>,
}

impl Answer<'_> {
    /// Writes into room that grows until it is enough.
    fn write(&mut self, write: impl Fn(&mut Writer)) -> Result {
        let mut room = 1 << 12;
        loop {
            self.body.resize(room, 0);
            let mut w = Writer::new(self.body);
            write(&mut w);
            match w.length() {
                Some(length) => {
                    self.body.truncate(length);
                    return Ok(());
                }
                None if room < channel::AREA => room = (4 * room).min(channel::AREA),
                None => {
                    return Err(Error::Failed("the answer is too large for an isolated subsystem".into()));
                }
            }
        }
    }
}

/// The terrain of the scenario, copied.
struct Grid {
    origin: [f64; 2],
    spacing: f64,
    size: [u32; 2],
    heights: Vec<f64>,
}

impl Grid {
    fn take(r: &mut Reader) -> Option<Self> {
        let grid = Self { origin: r.take()?, spacing: r.take()?, size: r.take()?, heights: r.take()? };
        (grid.heights.len() == grid.size[0] as usize * grid.size[1] as usize).then_some(grid)
    }
}

impl Terrain for Grid {
    fn origin(&self) -> [f64; 2] {
        self.origin
    }
    fn spacing(&self) -> f64 {
        self.spacing
    }
    fn size(&self) -> [u32; 2] {
        self.size
    }
    fn heights(&self, i0: i64, j0: i64, ni: usize, nj: usize, out: &mut [f64]) -> TerrainTile {
        let [nx, ny] = self.size.map(|n| i64::from(n) - 1);
        let cells = (0..nj as i64).flat_map(|j| (0..ni as i64).map(move |i| (i0 + i, j0 + j)));
        for (out, (i, j)) in out.iter_mut().zip(cells) {
            let k = j.clamp(0, ny) * (nx + 1) + i.clamp(0, nx);
            *out = self.heights[k as usize];
        }
        match out.first() {
            Some(first) if out.iter().all(|z| z == first) => TerrainTile::Uniform(*first),
            _ => TerrainTile::Varied,
        }
    }
}

/// Services of the host, on this side of the border.
struct WorkerHost {
    log: Arc<Log>,
    workers: Workers,
    terrain: Option<Grid>,
    start: Start,
}

impl Host for WorkerHost {
    fn name(&self) -> &str {
        &self.start.name
    }
    fn log(&self, level: LogLevel, text: &str) {
        self.log.put(level, text);
    }
    fn parallel_for(&self, n: usize, job: &(dyn Fn(usize) + Sync)) {
        self.workers.parallel_for(n, job);
    }
    fn cancelled(&self) -> bool {
        self.log.cancel.load(Ordering::Relaxed)
    }
    fn seed(&self) -> u64 {
        self.start.seed
    }
    fn folder(&self) -> &str {
        &self.start.folder
    }
    fn slots(&self) -> u32 {
        self.start.slots
    }
    fn max_nodes(&self) -> u32 {
        self.start.max_nodes
    }
    fn gravity(&self) -> [f64; 3] {
        self.start.gravity
    }
    fn terrain(&self) -> Option<&dyn Terrain> {
        self.terrain.as_ref().map(|t| t as &dyn Terrain)
    }
}
