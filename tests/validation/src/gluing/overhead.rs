//! Cost of the coordinator itself: an exchange of six patches less the time inside the subsystems.
//!
//! Both subsystems are wrapped, so that the time of every `advance` is known from inside; the rest of the exchange is
//! the coordinator's. Thread CPU time would cost more to read than the exchange itself, so wall time is read and the
//! quickest of many blocks taken: the machine may be busy.

use super::super::timing::median;
use super::fixture::Setting;
use super::six_feet::{Table, columns};
use super::{Context, Figure, Limit};
use crate::process::Outcome;
use glue_cases::{PowerColumns, TableOnFeet};
use std::cell::Cell;
use std::marker::PhantomData;
use std::sync::Arc;
use std::time::{Duration, Instant};
use terraglue::Testbed;
use terraglue::scenario::Scenario;
use terraglue::subsystem::{
    BodyState, Capabilities, Config, Energy, Estimate, Host, Input, Law, Level, Module, Motion, Response,
    Result, Scene, Schema, Step, Subsystem, Values, ValuesMut, Variable,
};
use terraglue::testbed::Options;
use terraglue_numerics::extremes::smaller;

const BLOCKS: usize = 41;
const STEPS: u32 = 500;

thread_local! {
    static INSIDE: Cell<Duration> = const { Cell::new(Duration::ZERO) };
}

/// A module whose trials are timed.
struct Timed<M>(PhantomData<M>);

struct TimedSubsystem(Box<dyn Subsystem>);

impl<M: Module> Module for Timed<M> {
    fn schema() -> Schema {
        M::schema()
    }

    fn instantiate(config: &Config, host: Arc<dyn Host>) -> Result<Box<dyn Subsystem>> {
        Ok(Box::new(TimedSubsystem(M::instantiate(config, host)?)))
    }
}

impl Subsystem for TimedSubsystem {
    fn capabilities(&self) -> Capabilities {
        self.0.capabilities() | Capabilities::ESTIMATE
    }

    /// So that the coordinator need not make trials for the estimate, which are no evaluations of the iteration.
    fn estimate_forces(&mut self, step: &Step, _: &Motion, out: &mut Estimate) -> Result {
        let n = step.n as usize;
        let (zeros, mut v, mut a, mut t) = (vec![0.0; n], vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        let mut free = Response { x: out.x_free, v: &mut v, a: &mut a, t: &mut t, reached: 0.0, flags: 0 };
        let input = Input::Force { t: &zeros, motion: None };
        self.0.advance(step, &input, &mut free)?;
        self.0.interface_jacobian(step, Level::Position, out.g)?;
        out.t_star.fill(1e12);
        out.active.fill(1);
        Ok(())
    }

    fn set_ports(&mut self, step: &Step, laws: &mut [Law], now: &mut Response) -> Result {
        self.0.set_ports(step, laws, now)
    }

    fn advance(&mut self, step: &Step, input: &Input, out: &mut Response) -> Result {
        let start = Instant::now();
        let done = self.0.advance(step, input, out);
        INSIDE.with(|sum| sum.set(sum.get() + start.elapsed()));
        done
    }

    fn interface_jacobian(&mut self, step: &Step, level: Level, out: &mut [f64]) -> Result {
        self.0.interface_jacobian(step, level, out)
    }

    fn commit(&mut self, step: &Step, t: &[f64], partner: &Motion) -> Result {
        self.0.commit(step, t, partner)
    }

    fn save_state(&mut self, slot: u32) -> Result {
        self.0.save_state(slot)
    }

    fn restore_state(&mut self, slot: u32) -> Result {
        self.0.restore_state(slot)
    }

    fn variables(&self) -> &[Variable] {
        self.0.variables()
    }

    fn get(&self, ids: &[u32], out: ValuesMut) -> Result {
        self.0.get(ids, out)
    }

    fn set(&mut self, ids: &[u32], values: Values) -> Result {
        self.0.set(ids, values)
    }

    fn scene(&self) -> Scene {
        self.0.scene()
    }

    fn body_states(&self, out: &mut [BodyState]) -> Result {
        self.0.body_states(out)
    }

    fn energy(&self) -> Energy {
        self.0.energy()
    }
}

/// Seconds per evaluation of one side: of the exchange beyond the subsystems, of the whole step beyond them, inside them.
fn measure() -> Outcome<[f64; 3]> {
    let setting = Setting { gluing: String::new(), ..Setting::iterative(1e-3, [0.0; 3]) };
    let text = Table::standard("implicit-euler", 0.3).text(&setting, &columns(1.0, false));
    let scenario = Scenario::parse(&text, "overhead.toml", &[]).map_err(|e| e.to_string())?;
    let library = terraglue::library().with::<Timed<TableOnFeet>>().with::<Timed<PowerColumns>>();
    let options = Options { threads: 1, ..Options::default() };
    let mut testbed = Testbed::build_with(&scenario, &options, &library).map_err(|e| e.to_string())?;
    let exchanged = |testbed: &Testbed| {
        let part = |name: &str| testbed.timings().rows().filter(|r| r.0 == name).map(|r| r.1).sum::<f64>();
        part("bodies") + part("grounds")
    };
    let mut blocks: [Vec<f64>; 3] = Default::default();
    for _ in 0..BLOCKS {
        let (inside, parts, start) = (INSIDE.with(Cell::get), exchanged(&testbed), Instant::now());
        let mut evaluations = 0;
        for _ in 0..STEPS {
            testbed.step().map_err(|e| e.to_string())?;
            let report = testbed.report();
            evaluations += report.evaluations_bodies + report.evaluations_soil;
        }
        let whole = start.elapsed().as_secs_f64();
        let inside = (INSIDE.with(Cell::get) - inside).as_secs_f64();
        let per = |s: f64| s / f64::from(evaluations);
        let figures = [per(exchanged(&testbed) - parts - inside), per(whole - inside), per(inside)];
        blocks.iter_mut().zip(figures).for_each(|(block, figure)| block.push(figure));
    }
    let quickest = |block: &Vec<f64>| block.iter().copied().fold(f64::INFINITY, smaller);
    let [exchange, _, _] = blocks.each_ref().map(quickest);
    let [_, whole, inside] = blocks.map(median);
    Ok([exchange, whole, inside])
}

/// All figures of the part.
pub fn figures(context: &Context) -> Outcome<Vec<Figure>> {
    if !context.timing {
        return Ok(Vec::new());
    }
    let [exchange, whole, inside] = measure()?.map(|s| 1e6 * s);
    let figure = |name: &str, value: f64, limit: Limit, what: String| {
        Figure::new(format!("gluing.overhead.{name}"), value, limit, what).timed()
    };
    Ok(vec![
        figure(
            "exchange",
            exchange,
            Limit::AtMost(0.5),
            format!(
                "an evaluation of six patches in process beyond the {inside:.3} us inside the subsystem, quickest of {BLOCKS} blocks, us"
            ),
        ),
        figure(
            "step",
            whole,
            Limit::None,
            "all that the coordinator does in a step (detection, six coupled unknowns, report), by evaluation, us".into(),
        ),
    ])
}
