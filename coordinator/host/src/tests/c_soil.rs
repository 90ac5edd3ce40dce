//! The elastic soil in C: compiled by the system's compiler, it keeps to its closed law in all forms.

use super::{Buffers, compile, port, services, step_of};
use crate::{Instance, LoadedModule};
use std::sync::Arc;
use terraglue_subsystem::{Config, Input, Law, Level, Motion, Port, Terrain, TerrainTile};

const SOURCE: &str = include_str!("../../../../tests/modules/soil-elastic-c/soil_elastic.c");
const K: f64 = 2e4;
const MU: f64 = 0.7;

/// z = 0.1·x.
struct Ramp;

impl Terrain for Ramp {
    fn origin(&self) -> [f64; 2] {
        [-1.0, -1.0]
    }
    fn spacing(&self) -> f64 {
        0.25
    }
    fn size(&self) -> [u32; 2] {
        [9, 9]
    }
    fn heights(&self, i0: i64, _: i64, ni: usize, nj: usize, out: &mut [f64]) -> TerrainTile {
        for k in 0..ni * nj {
            out[k] = 0.1 * (-1.0 + 0.25 * (i0 + (k % ni) as i64) as f64);
        }
        TerrainTile::Varied
    }
}

fn soil(terrain: bool) -> Instance {
    let folder = tempfile::tempdir().expect("folder");
    let path = compile(folder.path(), "soil_elastic", SOURCE, &[]);
    let module = LoadedModule::load(&path).expect("loads");
    assert_eq!(module.schema().name, "soil-elastic");
    let mut services = services();
    services.terrain = terrain.then(|| Arc::new(Ramp) as Arc<dyn Terrain>);
    module.instantiate("soil", Config::default(), &services).expect("instance")
}

fn set_ports(soil: &mut Instance, ports: &[Port]) -> (Buffers, f64) {
    let n = 3 * ports.len() as u32;
    let (mut out, mut laws) = (Buffers::new(n as usize), vec![Law::UNILATERAL; ports.len()]);
    soil.set_ports(&step_of(ports, n), &mut laws, &mut out.response()).expect("set_ports");
    (out, laws[0].mu)
}

fn advance(soil: &mut Instance, ports: &[Port], input: Input) -> (Buffers, Vec<f64>) {
    let n = 3 * ports.len();
    let (mut out, mut g) = (Buffers::new(n), vec![0.0; n * n]);
    let step = step_of(ports, n as u32);
    soil.advance(&step, &input, &mut out.response()).expect("advance");
    soil.interface_jacobian(&step, Level::Position, &mut g).expect("derivative");
    (out, g)
}

fn near(a: f64, b: f64) {
    assert!((a - b).abs() <= 1e-9 * b.abs().max(1e-3), "{a} {b}");
}

#[test]
fn presses_like_a_spring_and_slides_by_its_coefficient() {
    let mut soil = soil(false);
    let ports = [port(3, 0, -2e-3)];
    let (now, mu) = set_ports(&mut soil, &ports);
    assert_eq!(mu, MU);
    near(now.0[3][0], K * 2e-3);
    assert_eq!(now.0[0], [0.0; 3]);
    // The foot sinks by another millimetre and is dragged far along t1.
    let motion = Motion { x: &[-1e-3, 0.5, 0.0], v: &[0.0; 3] };
    let (out, k) = advance(&mut soil, &ports, Input::Motion(motion));
    near(out.0[3][0], K * 3e-3);
    near(out.0[3][1], -MU * K * 3e-3);
    near(k[0], K);
    // A given force comes back with the surface below it.
    let (out, g) = advance(&mut soil, &ports, Input::Force { t: &[50.0, 1.0, 0.0], motion: None });
    near(out.0[0][0], 2e-3 - 50.0 / K);
    near(g[0], 1.0 / K);
    // Above the ground the surface is below the body by the gap.
    let (now, _) = set_ports(&mut soil, &[port(3, 0, 5e-3)]);
    near(now.0[0][0], -5e-3);
    assert_eq!(now.0[3][0], 0.0);
}

#[test]
fn derivatives_are_those_of_its_answers() {
    let mut soil = soil(false);
    let ports = [port(3, 0, -2e-3), port(9, 3, -1e-3)];
    set_ports(&mut soil, &ports);
    // The first foot slides, the second sticks.
    let x = [-1e-4, 4e-3, -3e-3, 1e-4, 1e-5, 2e-5];
    let force = [30.0, 0.0, 0.0, 10.0, 0.0, 0.0];
    let d = 1e-7;
    for given in [false, true] {
        let mut answer = |x: &[f64], t: &[f64]| {
            let motion = Motion { x, v: &[0.0; 6] };
            let input = if given { Input::Force { t, motion: Some(motion) } } else { Input::Motion(motion) };
            advance(&mut soil, &ports, input)
        };
        let (_, g) = answer(&x, &force);
        for column in 0..6 {
            let (mut x1, mut t1) = (x, force);
            let by_force = given && column % 3 == 0;
            if by_force {
                t1[column] += 1e3 * d
            } else {
                x1[column] += d
            }
            let ((plus, _), (zero, _)) = (answer(&x1, &t1), answer(&x, &force));
            for row in 0..6 {
                let change = |of: usize| plus.0[of][row] - zero.0[of][row];
                // Per wrench on the soil, which is −T.
                let numeric = match (by_force, row % 3 == 0) {
                    (true, true) => -change(0) / (1e3 * d),
                    (true, false) => change(3) / (1e3 * d),
                    (false, true) if given => 0.0,
                    (false, _) => -change(3) / d,
                };
                let own = g[column * 6 + row];
                assert!(
                    (own - numeric).abs() < 1e-4 * own.abs().max(1.0),
                    "{given} {row} {column}: {own} {numeric}"
                );
            }
        }
    }
}

#[test]
fn keeps_friction_over_a_commit_and_returns_to_a_saved_state() {
    let mut soil = soil(true);
    let at = [port(2, 0, 0.1 * 0.2 - 1e-3)]; // on the ramp at x = 0.2
    let (now, _) = set_ports(&mut soil, &at);
    near(now.0[3][0], K * 1e-3);
    soil.save_state(0).expect("save");
    let motion = Motion { x: &[0.0, 1e-4, 0.0], v: &[0.0; 3] };
    soil.commit(&step_of(&at, 3), &[20.0, 0.0, 0.0], &motion).expect("commit");
    let (now, _) = set_ports(&mut soil, &at);
    near(now.0[3][1], -K * 1e-4);
    soil.restore_state(0).expect("restore");
    let (now, _) = set_ports(&mut soil, &at);
    assert_eq!(now.0[3][1], 0.0);
    let error = soil.save_state(99).expect_err("no slot").to_string();
    assert!(error.ends_with("save_state failed at t = 1 s: no such slot"), "{error}");
}
