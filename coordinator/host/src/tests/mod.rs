//! The host on real libraries: the column soil through its table against the same code linked in, and bad
//! libraries made by the system's C compiler.

mod bad_libraries;
mod c_soil;
mod older_abi;
mod sight;

use super::*;
use soil_column::SoilColumnModule;
use std::path::{Path, PathBuf};
use terraglue_subsystem::{
    Capabilities, Config, Input, Kind, Law, Level, Motion, Port, Response, Step, component,
};

fn port(key: u64, first: u32, z: f64) -> Port {
    Port {
        key,
        kind: 0,
        side: -1,
        mask: component::FORCE,
        first,
        body: 0,
        shape: 0,
        first_node: 0,
        node_count: 0,
        origin: [0.1 * key as f64, 0.0, z],
        frame: [0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0],
        extent: [0.0; 2],
        law: Law::UNILATERAL,
    }
}

/// A step of 1 ms at t = 1 s.
fn step_of(ports: &[Port], n: u32) -> Step<'_> {
    Step { n, ports, ..Step::free(1.0, 1e-3, 0) }
}

/// Compiles a module in C into `folder`, as a user would.
fn compile(folder: &Path, name: &str, source: &str, defines: &[&str]) -> PathBuf {
    let include = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../interfaces/plugin/include");
    compile_with(&include, folder, name, source, defines)
}

/// The same with the header in another folder.
fn compile_with(include: &Path, folder: &Path, name: &str, source: &str, defines: &[&str]) -> PathBuf {
    let (code, library) = (folder.join(format!("{name}.c")), folder.join(format!("lib{name}_plugin.so")));
    std::fs::write(&code, source).expect("written");
    let mut command = std::process::Command::new("cc");
    command
        .args(["-std=c11", "-O2", "-Wall", "-Wextra", "-Werror", "-fPIC", "-shared"])
        .arg("-I")
        .arg(include);
    command.args(defines.iter().map(|d| format!("-D{d}"))).arg(&code).arg("-o").arg(&library).arg("-lm");
    let done = command.output().expect("the system's C compiler `cc`");
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    library
}

/// Vectors of a response.
struct Buffers([Vec<f64>; 4]);

impl Buffers {
    fn new(n: usize) -> Self {
        Self([0; 4].map(|_| vec![0.0; n]))
    }

    fn response(&mut self) -> Response<'_> {
        let [x, v, a, t] = &mut self.0;
        Response { x, v, a, t, reached: 0.0, flags: 0 }
    }

    fn bits(&self) -> Vec<u64> {
        self.0.iter().flatten().map(|v| v.to_bits()).collect()
    }
}

/// Drives a soil through a few steps of two feet and collects the bits of every answer.
fn drive(soil: &mut Instance) -> Vec<u64> {
    let mut bits = Vec::new();
    let (mut out, mut g, mut laws) = (Buffers::new(6), vec![0.0; 36], [Law::UNILATERAL; 2]);
    for k in 0..20u64 {
        let ports = [port(1, 0, -1e-4 * k as f64), port(2, 3, -2e-4 * (10.0 - k as f64).abs())];
        let step = Step { t: 1e-3 * k as f64, index: k, ..step_of(&ports, 6) };
        soil.set_ports(&step, &mut laws, &mut out.response()).expect("set_ports");
        bits.extend(out.bits());
        bits.extend(laws.iter().map(|l| l.mu.to_bits()));
        let (x, v) = ([-1e-4, 2e-5, -1e-5, 3e-5, 1e-4, 0.0], [0.0; 6]);
        let motion = Motion { x: &x, v: &v };
        let t = [5.0 + k as f64, 1.0, 0.5, 3.0, 0.0, 0.1];
        for input in [
            Input::Force { t: &t, motion: None },
            Input::Force { t: &t, motion: Some(motion) },
            Input::Motion(motion),
        ] {
            assert_eq!(
                soil.advance(&step, &input, &mut out.response()).expect("advance"),
                Progress::Complete
            );
            bits.extend(out.bits());
            soil.interface_jacobian(&step, Level::Position, &mut g).expect("derivative");
            bits.extend(g.iter().map(|v| v.to_bits()));
        }
        soil.commit(&step, &t, &motion).expect("commit");
        if k == 5 {
            soil.save_state(1).expect("save");
        }
        if k == 12 {
            soil.restore_state(1).expect("restore");
        }
    }
    if soil.capabilities().has(Capabilities::SERIALIZE) {
        bits.extend(soil.serialize().expect("serialize").iter().map(|b| u64::from(*b)));
    }
    bits
}

fn services() -> HostServices {
    HostServices::new(1, Path::new("."))
}

#[test]
fn through_the_table_and_linked_in_give_the_same_bits() {
    let config = || Config::parse(r#"{"K": 8340.0, "n": 1.2}"#).expect("config");
    let search = SearchPath::standard(&[], Path::new("."));
    let foreign = Library::new().find("soil-column", &search, Path::new(".")).expect("found");
    assert!(foreign.path().is_some());
    assert_eq!(foreign.schema().kind, Kind::Soil);
    let linked = Library::new().with::<SoilColumnModule>().find("soil-column", &search, Path::new("."));
    let linked = linked.expect("linked in");
    assert_eq!(linked.path(), None);
    assert_eq!(linked.schema(), foreign.schema());
    let mut a = linked.instantiate("soil", config(), &services()).expect("instance");
    let mut b = foreign.instantiate("soil", config(), &services()).expect("instance");
    let (a, b) = (drive(&mut a), drive(&mut b));
    assert!(a.len() > 1000 && a == b);
}

/// A module that panics in its third trial.
struct Panicking(u32);

impl terraglue_subsystem::Module for Panicking {
    fn schema() -> terraglue_subsystem::Schema {
        SoilColumnModule::schema()
    }
    fn instantiate(
        _: &Config,
        _: std::sync::Arc<dyn terraglue_subsystem::Host>,
    ) -> terraglue_subsystem::Result<Box<dyn terraglue_subsystem::Subsystem>> {
        Ok(Box::new(Self(0)))
    }
}

impl terraglue_subsystem::Subsystem for Panicking {
    fn capabilities(&self) -> terraglue_subsystem::Capabilities {
        terraglue_subsystem::Capabilities::MOTION
    }
    fn advance(&mut self, _: &Step, _: &Input, out: &mut Response) -> terraglue_subsystem::Result {
        self.0 += 1;
        assert!(self.0 < 3, "no third trial");
        for vector in [&mut *out.x, &mut *out.v, &mut *out.a, &mut *out.t] {
            vector.fill(0.0);
        }
        Ok(())
    }
}

#[test]
fn a_panic_behind_the_table_is_an_error_with_name_call_and_time() {
    let table = Box::leak(Box::new(terraglue_plugin::table::<Panicking>("panicking", b"\0")));
    #[allow(unsafe_code)]
    // SAFETY: a table of our own making that lives as long as the process.
    let module = unsafe { terraglue_plugin::ForeignModule::new(table) }.expect("table");
    let made = module.instantiate(&Config::default(), services().for_instance("soil")).expect("instance");
    let mut soil = Instance::new("soil", "panicking", Kind::Soil, Box::new(made));
    let mut out = Buffers::new(0);
    let mut trial = |t| {
        let input = Input::Motion(Motion { x: &[], v: &[] });
        soil.advance(&Step::free(t, 1e-3, 0), &input, &mut out.response()).map_err(|e| e.to_string())
    };
    assert_eq!([trial(0.0), trial(0.001)], [Ok(Progress::Complete), Ok(Progress::Complete)]);
    let told = Err("soil (panicking): advance failed at t = 0.002 s: panicked: no third trial".into());
    assert_eq!(trial(0.002), told);
    let dead =
        Err("soil (panicking): advance failed at t = 0.003 s: not called: it failed for good before".into());
    assert_eq!(trial(0.003), dead);
}
