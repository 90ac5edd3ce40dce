//! Every call of the interface through the C table gives the bits of the direct call, without an allocation per
//! call, and every failure comes back unchanged.
#![allow(unsafe_code, missing_docs, clippy::unwrap_used)]

mod everything;

use everything::{Everything, TYPES};
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::sync::{Arc, Mutex};
use terraglue_plugin::{ForeignModule, table};
use terraglue_subsystem::*;

thread_local! {
    static ALLOCATIONS: Cell<usize> = const { Cell::new(0) };
}

struct Counting;

#[global_allocator]
static COUNTING: Counting = Counting;

// SAFETY: hands everything to the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let _ = ALLOCATIONS.try_with(|a| a.set(a.get() + 1));
        // SAFETY: the same contract.
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the same contract.
        unsafe { System.dealloc(pointer, layout) }
    }
}

struct Plane;

impl Terrain for Plane {
    fn origin(&self) -> [f64; 2] {
        [-3.0, 4.0]
    }
    fn spacing(&self) -> f64 {
        0.5
    }
    fn size(&self) -> [u32; 2] {
        [5, 6]
    }
    fn heights(&self, i0: i64, j0: i64, ni: usize, nj: usize, out: &mut [f64]) -> TerrainTile {
        for (k, height) in out[..ni * nj].iter_mut().enumerate() {
            *height = (i0 + (k % ni) as i64) as f64 + 0.1 * (j0 + (k / ni) as i64) as f64;
        }
        TerrainTile::Varied
    }
}

#[derive(Default)]
struct TestHost {
    lines: Mutex<Vec<(LogLevel, String)>>,
    no_terrain: bool,
}

impl Host for TestHost {
    fn name(&self) -> &str {
        "unit"
    }
    fn log(&self, level: LogLevel, text: &str) {
        self.lines.lock().unwrap().push((level, text.into()));
    }
    fn cancelled(&self) -> bool {
        true
    }
    fn seed(&self) -> u64 {
        (1 << 52) + 1
    }
    fn folder(&self) -> &str {
        "some/where"
    }
    fn slots(&self) -> u32 {
        3
    }
    fn max_nodes(&self) -> u32 {
        77
    }
    fn gravity(&self) -> [f64; 3] {
        [0.0, 0.5, -1.62]
    }
    fn terrain(&self) -> Option<&dyn Terrain> {
        (!self.no_terrain).then_some(&Plane)
    }
}

fn foreign() -> ForeignModule {
    let table: &'static _ = Box::leak(Box::new(table::<Everything>("everything-plugin", b"\0")));
    // SAFETY: a table of our own making that lives as long as the process.
    unsafe { ForeignModule::new(table) }.unwrap()
}

fn config(fault: &str) -> Config {
    Config::parse(&format!(r#"{{"fault": "{fault}"}}"#)).unwrap().with_defaults(&Everything::schema())
}

fn both() -> [Box<dyn Subsystem>; 2] {
    let direct = Everything::instantiate(&config("none"), Arc::new(TestHost::default())).unwrap();
    let through = foreign().instantiate(&config("none"), Arc::new(TestHost::default())).unwrap();
    [direct, Box::new(through)]
}

fn port(key: u64, first: u32, mask: u32) -> Port {
    Port {
        key,
        kind: 1,
        side: -1,
        mask,
        first,
        body: 5,
        shape: u32::MAX,
        first_node: first.min(1),
        node_count: 1,
        origin: [0.1, 0.2, 0.3],
        frame: [0.0, 0.1, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0],
        extent: [0.01, 0.02],
        law: Law { t_min: 0.0, t_max: 7.0, mu: 0.4, compliance: 1e-7 },
    }
}

fn ports() -> [Port; 2] {
    [port(7, 0, component::FORCE), port(1 << 40, 3, component::N)]
}

const NODES: [Node; 2] = [
    Node { i: -4, j: 9, area: 1e-4, lower: -0.02, slope: [0.1, -0.2] },
    Node { i: 5, j: -6, area: 5e-5, lower: 0.7, slope: [0.0; 2] },
];
const N: usize = 4;

fn step(ports: &[Port]) -> Step<'_> {
    Step { t: 0.1, h: 1e-3, index: 12, trial: 3, n: N as u32, ports, nodes: &NODES }
}

/// All calls of a step; every bit of the answers goes into `bits` (which does not grow beyond its capacity).
fn calls(s: &mut dyn Subsystem, bits: &mut Vec<u64>) {
    let ports = ports();
    let step = step(&ports);
    let (mut x, mut v, mut a, mut t) = ([f64::NAN; N], [f64::NAN; N], [f64::NAN; N], [f64::NAN; N]);
    let (mut g, mut active, mut laws) = ([0.0; N * N], [0; 2], [Law::UNILATERAL; 2]);
    let motion = Motion { x: &[1e-3, 2e-3, -3e-3, 4e-3], v: &[0.1, 0.2, 0.3, 0.4] };
    let force = [10.0, 1.0, -2.0, 5.0];
    macro_rules! answer {
        ($call:expr) => {{
            let mut out = Response { x: &mut x, v: &mut v, a: &mut a, t: &mut t, reached: 0.101, flags: 0 };
            let call: &mut dyn FnMut(&mut Response) -> Result = &mut $call;
            call(&mut out).unwrap();
            let (reached, flags) = (out.reached, out.flags);
            bits.extend([&x, &v, &a, &t].into_iter().flatten().map(|v| v.to_bits()));
            bits.extend([reached.to_bits(), flags.into()]);
        }};
    }
    answer!(|out| s.set_ports(&step, &mut laws, out));
    bits.extend(laws.iter().flat_map(|l| [l.mu, l.t_max, l.t_min, l.compliance]).map(f64::to_bits));
    let (mut t_star, mut x_free) = ([0.0; N], [0.0; N]);
    let mut e =
        Estimate { t_star: &mut t_star, x_free: &mut x_free, g: &mut g, active: &mut active, unique: false };
    s.estimate_forces(&step, &motion, &mut e).unwrap();
    bits.extend(e.t_star.iter().chain(&*e.x_free).chain(&*e.g).map(|v| v.to_bits()));
    bits.extend([u64::from(e.unique), u64::from(e.active[0]), u64::from(e.active[1])]);
    answer!(|out| s.solve_compatibility(&step, &e, out));
    for input in [
        Input::Force { t: &force, motion: None },
        Input::Force { t: &force, motion: Some(motion) },
        Input::Motion(motion),
    ] {
        answer!(|out| s.advance(&step, &input, out));
    }
    for level in [Level::Position, Level::Velocity, Level::Acceleration] {
        s.interface_jacobian(&step, level, &mut g).unwrap();
        bits.extend(g.iter().map(|v| v.to_bits()));
    }
    s.save_state(2).unwrap();
    s.commit(&step, &force, &motion).unwrap();
    let mut values = [0.0; 6];
    s.get(&[0], ValuesMut::F64(&mut values)).unwrap();
    bits.extend(values.map(f64::to_bits));
    s.restore_state(2).unwrap();
    s.set(&[0], Values::F64(&[1.5, 2.5])).unwrap();
    let mut flags = [false; 3];
    s.get(&[30], ValuesMut::Bool(&mut flags)).unwrap();
    bits.extend(flags.map(u64::from));
    let mut states = [BodyState::REST; 2];
    s.body_states(&mut states).unwrap();
    bits.extend(states.iter().flat_map(|s| s.linear_velocity).map(f64::to_bits));
    for (field, b) in [(0, 0), (0, 2), (1, 1), (2, 0), (3, 0)] {
        let tile = s.field_tile(field, 3, b).unwrap();
        bits.push(tile.generation);
        bits.extend((0..4).map(|k| tile.values.at(k).to_bits()));
    }
    let e = s.energy();
    bits.extend(
        [e.kinetic, e.potential, e.dissipated, e.port_work, e.actuator_work, e.electrical].map(f64::to_bits),
    );
    bits.push(s.next_event_time().to_bits());
}

#[test]
fn steps_give_the_bits_of_the_direct_call() {
    let [mut direct, mut through] = both();
    let (mut a, mut b) = (Vec::new(), Vec::new());
    for _ in 0..3 {
        calls(direct.as_mut(), &mut a);
        calls(through.as_mut(), &mut b);
    }
    assert!(a.len() > 300);
    assert_eq!(a, b);
}

#[test]
fn no_call_of_a_step_allocates() {
    let [_, mut through] = both();
    let mut bits = Vec::with_capacity(100_000);
    calls(through.as_mut(), &mut bits);
    let before = ALLOCATIONS.get();
    for _ in 0..20 {
        calls(through.as_mut(), &mut bits);
    }
    assert_eq!(ALLOCATIONS.get() - before, 0);
}

#[test]
fn descriptions_are_equal() {
    let [direct, through] = both();
    assert_eq!(foreign().schema().unwrap(), Everything::schema());
    assert_eq!(direct.capabilities(), through.capabilities());
    assert_eq!(direct.variables(), through.variables());
    assert_eq!(direct.variables().len(), TYPES.len());
    assert_eq!(direct.actions(), through.actions());
    assert_eq!(direct.scene(), through.scene());
    assert_eq!(direct.fields(), through.fields());
    assert_eq!(direct.streams(), through.streams());
}

#[test]
fn values_of_every_type_come_and_go() {
    let [mut direct, mut through] = both();
    macro_rules! same {
        ($variant:ident, $zero:expr, $new:expr) => {
            for s in [&mut direct, &mut through] {
                s.set(&[1], Values::$variant(&[$new])).unwrap();
            }
            let (mut a, mut b) = ([$zero], [$zero]);
            direct.get(&[1], ValuesMut::$variant(&mut a)).unwrap();
            through.get(&[1], ValuesMut::$variant(&mut b)).unwrap();
            assert_eq!(a, b);
            assert_ne!(a, [$zero], stringify!($variant));
        };
    }
    same!(F64, 0.0, 2.5);
    same!(F32, 0.0, 3.5);
    same!(I8, 0, i8::MIN);
    same!(I16, 0, i16::MIN);
    same!(I32, 0, i32::MIN);
    same!(I64, 0, i64::MIN);
    same!(U8, 0, u8::MAX);
    same!(U16, 0, u16::MAX);
    same!(U32, 0, u32::MAX);
    same!(U64, 0, u64::MAX);
    same!(Bool, false, true);
    same!(Enumeration, 0, 1);
    same!(String, String::new(), String::from("Mond, Staub\0und Fuß"));
    same!(Binary, Vec::<u8>::new(), vec![0_u8, 1, 255]);
}

#[test]
fn state_as_bytes_and_actions() {
    let [mut direct, mut through] = both();
    for s in [&mut direct, &mut through] {
        s.set(&[0], Values::F64(&[0.1])).unwrap();
        s.act("joint.break", r#"{"now": true}"#).unwrap();
        let refused = s.act("joint.mend", "{}").unwrap_err();
        assert_eq!(refused, Error::Refused("no action `joint.mend`".into()));
    }
    let mut word = [String::new()];
    through.get(&[33], ValuesMut::String(&mut word)).unwrap();
    assert_eq!(word[0], r#"joint.break {"now": true}"#);
    let bytes = through.serialize().unwrap();
    assert_eq!(bytes, direct.serialize().unwrap());
    through.set(&[0], Values::F64(&[9.0])).unwrap();
    through.deserialize(&bytes).unwrap();
    assert_eq!(through.serialize().unwrap(), bytes);
    assert_eq!(through.deserialize(&[1, 2]).unwrap_err(), Error::Refused("2 bytes".into()));
    assert_eq!(through.save_state(3).unwrap_err(), Error::Refused("no such slot".into()));
}

fn advance(s: &mut dyn Subsystem) -> (Result, f64) {
    let ports = ports();
    let [mut x, mut v, mut a, mut t] = [[0.0; N]; 4];
    let mut out = Response { x: &mut x, v: &mut v, a: &mut a, t: &mut t, reached: 0.101, flags: 0 };
    let input = Input::Force { t: &[0.0; N], motion: None };
    (s.advance(&step(&ports), &input, &mut out), out.reached)
}

#[test]
fn failures_come_back_as_what_they_were() {
    let make = |fault| foreign().instantiate(&config(fault), Arc::new(TestHost::default()));
    let mut s = make("discard").unwrap();
    assert_eq!(advance(&mut s), (Err(Error::Discard { reached: 0.125 }), 0.125));
    let mut s = make("refuse").unwrap();
    assert_eq!(advance(&mut s).0, Err(Error::Refused("not like this".into())));
    assert_eq!(s.commit(&Step::free(0.0, 1e-3, 0), &[], &Motion { x: &[], v: &[] }), Ok(()));
    let refused = make("start").err();
    assert_eq!(refused, Some(Error::Refused("the start is refused".into())));
}

#[test]
fn an_instance_that_panicked_or_failed_for_good_is_not_called_again() {
    for (fault, text) in [("panic", "panicked: index 17 is out of range"), ("fatal", "broken for good")] {
        let mut s = foreign().instantiate(&config(fault), Arc::new(TestHost::default())).unwrap();
        let fatal = Err(Error::Fatal(text.into()));
        assert_eq!(advance(&mut s).0, fatal);
        assert_eq!(s.save_state(0), fatal, "dead after {fault}");
        assert!(s.energy().kinetic.is_nan() && s.next_event_time().is_nan());
    }
    let failed = foreign().instantiate(&config("start-panic"), Arc::new(TestHost::default())).err();
    assert_eq!(failed, Some(Error::Fatal("panicked: at the start".into())));
}

#[test]
fn vectors_that_are_too_short_never_reach_the_module() {
    let [_, mut through] = both();
    let ports = ports();
    let [mut x, mut v, mut a, mut t] = [[0.0; N]; 4];
    let mut out = Response { x: &mut x[..3], v: &mut v, a: &mut a, t: &mut t, reached: 0.0, flags: 0 };
    let input = Input::Force { t: &[0.0; N], motion: None };
    assert!(through.advance(&step(&ports), &input, &mut out).is_err());
    let no_nodes = Step { nodes: &[], ..step(&ports) };
    let still = Motion { x: &[0.0; N], v: &[0.0; N] };
    assert!(through.commit(&no_nodes, &[0.0; N], &still).is_err());
    assert!(through.interface_jacobian(&step(&ports), Level::Position, &mut [0.0; 15]).is_err());
}

#[test]
fn services_of_the_host_arrive() {
    let host = Arc::new(TestHost::default());
    let through = foreign().instantiate(&config("none"), host.clone()).unwrap();
    let lines = host.lines.lock().unwrap();
    let text = "unit in some/where with [0.0, 0.5, -1.62]".to_owned();
    assert_eq!(lines.as_slice(), [(LogLevel::Warning, text)]);
    let e = through.energy();
    assert_eq!((e.potential, e.dissipated, e.port_work), (((1_u64 << 52) + 1) as f64, 36.0, 1.0));
    assert_eq!(through.field_tile(0, 0, 1).unwrap().values.at(0), -0.9);
    let none = Arc::new(TestHost { no_terrain: true, ..TestHost::default() });
    let error = foreign().instantiate(&config("none"), none).err().unwrap();
    assert!(error.to_string().contains("needs ground"), "{error}");
}
