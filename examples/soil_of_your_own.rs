//! A soil of one's own in the same program: a foam that is crushed, under a sphere that falls on it.
//!
//! `cargo run --package terraglue-examples --example soil_of_your_own`
//!
//! A soil is a type that implements `Subsystem`, and a `Module` that makes it; `Library::with` adds it to the modules that a
//! scenario can name. No dynamic library is built. `terraglue new soil` writes such a soil for a library of its own.
//!
//! The foam yields below each foot like a column: F = k·z where it is pressed for the first time. What was pressed
//! springs back a hundred times as stiffly, so a hundredth of the work comes back. It has no friction.

use std::sync::Arc;
use terraglue::scenario::Scenario;
use terraglue::subsystem::{
    Capabilities, Config, Energy, Error, Host, Input, Kind, Law, Level, Module, Motion, Parameter, Port,
    Response, Result, Schema, Step, Subsystem,
};
use terraglue::testbed::Testbed;

/// Stiffness of springing back over that of first loading.
const STIFFER: f64 = 100.0;

/// The foam below one foot, as it was committed.
#[derive(Clone, Copy, Default)]
struct Column {
    key: u64,
    /// Deepest place of the foot so far, m.
    deepest: f64,
    /// Elastic energy and the work of the foot so far, J.
    stored: f64,
    work: f64,
}

/// What a port answered in the last trial.
#[derive(Clone, Copy, Default)]
struct Answer {
    column: usize,
    /// dX/dT (m/N) after a force, dF/dz (N/m) after a motion.
    slope: f64,
}

/// The soil: level foam whose surface is at z = 0.
struct Foam {
    /// Stiffness of first loading, N/m.
    k: f64,
    columns: Vec<Column>,
    /// Per port of the step.
    answers: Vec<Answer>,
}

impl Module for Foam {
    fn schema() -> Schema {
        Schema {
            name: "soil-foam".into(),
            kind: Kind::Soil,
            help: "Foam that is crushed and springs back a little".into(),
            parameters: vec![
                Parameter::number("stiffness_n_m", "N/m", 20000.0, "Stiffness of first loading").positive(),
            ],
        }
    }

    fn instantiate(config: &Config, _: Arc<dyn Host>) -> Result<Box<dyn Subsystem>> {
        let k = config.number("stiffness_n_m")?;
        Ok(Box::new(Self { k, columns: Vec::with_capacity(16), answers: Vec::with_capacity(16) }))
    }
}

impl Foam {
    /// Force (N) at a depth (m), and its slope (N/m).
    fn force(&self, column: &Column, z: f64) -> (f64, f64) {
        if z > column.deepest {
            return (self.k * z, self.k);
        }
        let force = self.k * column.deepest - STIFFER * self.k * (column.deepest - z);
        if force > 0.0 { (force, STIFFER * self.k) } else { (0.0, 0.0) }
    }

    /// Depth (m) under a force (N), and its slope (m/N): the inverse.
    fn depth(&self, column: &Column, force: f64) -> (f64, f64) {
        let most = self.k * column.deepest;
        if force > most {
            return (force / self.k, 1.0 / self.k);
        }
        let slope = 1.0 / (STIFFER * self.k);
        (column.deepest - (most - force.max(0.0)) * slope, slope)
    }
}

/// Depth of the foot at the start of the step, m; `frame[2]` is the z of the normal.
fn depth_at_start(port: &Port) -> f64 {
    -port.origin[2] * port.frame[2]
}

/// Writes motion (m) and force (N) along the normal; there are no others.
fn write(port: &Port, x_n: f64, t_n: f64, out: &mut Response) {
    for (i, component) in port.components() {
        (out.x[i], out.t[i]) = if component == 0 { (x_n, t_n) } else { (0.0, 0.0) };
        (out.v[i], out.a[i]) = (0.0, 0.0);
    }
}

impl Subsystem for Foam {
    fn capabilities(&self) -> Capabilities {
        Capabilities::FORCE | Capabilities::MOTION | Capabilities::DERIVATIVES | Capabilities::RETRY
    }

    /// Finds the column of each port, or begins one, and tells force and surface at the start of the step.
    fn set_ports(&mut self, step: &Step, laws: &mut [Law], now: &mut Response) -> Result {
        self.answers.clear();
        for (port, law) in step.ports.iter().zip(laws) {
            let known = self.columns.iter().position(|c| c.key == port.key);
            let column = known.unwrap_or(self.columns.len());
            if known.is_none() {
                self.columns.push(Column { key: port.key, ..Column::default() });
            }
            let z = depth_at_start(port);
            let (force, slope) = self.force(&self.columns[column], z);
            // the surface is at the foot, or below it by the gap
            let (bare, _) = self.depth(&self.columns[column], 0.0);
            write(port, (z - bare).min(0.0), force, now);
            law.mu = 0.0;
            self.answers.push(Answer { column, slope });
        }
        Ok(())
    }

    /// A trial: the depth under a force, or the force at a motion of the feet.
    fn advance(&mut self, step: &Step, input: &Input, out: &mut Response) -> Result {
        for (p, port) in step.ports.iter().enumerate() {
            let (column, z) = (&self.columns[self.answers[p].column], depth_at_start(port));
            let n = port.first as usize;
            let slope = match input {
                Input::Force { t, .. } => {
                    let (depth, slope) = self.depth(column, t[n]);
                    write(port, z - depth, t[n], out);
                    slope
                }
                Input::Motion(motion) => {
                    let (force, slope) = self.force(column, z - motion.x[n]);
                    write(port, motion.x[n], force, out);
                    slope
                }
            };
            self.answers[p].slope = slope;
        }
        out.reached = step.t + step.h;
        Ok(())
    }

    fn interface_jacobian(&mut self, step: &Step, level: Level, out: &mut [f64]) -> Result {
        if level == Level::Acceleration {
            return Err(Error::Unsupported);
        }
        out.fill(0.0); // nothing here depends on velocities
        for (port, answer) in step.ports.iter().zip(&self.answers).filter(|_| level == Level::Position) {
            let n = port.first as usize;
            out[n * step.n as usize + n] = answer.slope;
        }
        Ok(())
    }

    /// The step is accepted: crushes the foam down to where the feet are, and keeps the ledger.
    fn commit(&mut self, step: &Step, _: &[f64], feet: &Motion) -> Result {
        for (port, answer) in step.ports.iter().zip(&self.answers) {
            let x_n = feet.x[port.first as usize];
            let before = self.columns[answer.column];
            let z = depth_at_start(port) - x_n;
            let (force, _) = self.force(&before, z);
            self.columns[answer.column] = Column {
                deepest: before.deepest.max(z),
                stored: 0.5 * force * force / (STIFFER * self.k),
                work: before.work - force * x_n,
                ..before
            };
        }
        Ok(())
    }

    fn energy(&self) -> Energy {
        let [potential, port_work] =
            self.columns.iter().fold([0.0; 2], |[p, w], c| [p + c.stored, w + c.work]);
        Energy { potential, port_work, dissipated: port_work - potential, ..Energy::default() }
    }
}

/// What a fall leaves.
struct Fall {
    /// Depth of the print, m.
    sinkage_m: f64,
    /// Energies of sphere and foam at the start and at the end.
    start: Energy,
    end: Energy,
    /// Those of the foam alone.
    foam: Energy,
}

/// Radius of the sphere (`tests/models/ball.urdf`, 5 kg), m.
const RADIUS_M: f64 = 0.03;
/// Height of the fall, m.
const HEIGHT_M: f64 = 0.05;

/// A sphere falls on the foam and comes to rest. Heat outside of the foam is that of its integrator, which damps impacts.
fn fall() -> terraglue::Result<Fall> {
    let text = format!(
        "[time]\nstep_s = 0.0002\nduration_s = 1.0\n[world]\ngravity_m_s2 = [0.0, 0.0, -9.81]\n\
         [terrain]\nkind = \"flat\"\nsize_m = [0.6, 0.6]\nspacing_m = 0.01\n[gluing]\nstrategy = \"iterative\"\n\
         [soil]\nmodule = \"soil-foam\"\nstiffness_n_m = 20000.0\n\
         [foot]\nmodule = \"rigid-body\"\nmodel = \"../tests/models/ball.urdf\"\nposition_m = [0.0, 0.0, {:?}]\n\
         place_on_ground = false\n",
        HEIGHT_M + RADIUS_M
    );
    let path = terraglue_examples::scenario("foam");
    let scenario = Scenario::parse(&text, &path.to_string_lossy(), &[])?;
    let library = terraglue::library().with::<Foam>();
    let mut testbed = Testbed::build_with(&scenario, &terraglue_examples::options(), &library)?;
    let start = testbed.energy();
    testbed.run_until(1.0, &mut [])?;
    let sinkage_m = RADIUS_M - testbed.read("foot.ball.z").unwrap_or(f64::NAN);
    let soil = testbed.instances().iter().find(|instance| instance.name() == "soil");
    let foam = soil.map_or(Energy::UNKNOWN, |soil| soil.subsystem().energy());
    Ok(Fall { sinkage_m, start, end: testbed.energy(), foam })
}

fn main() -> terraglue::Result {
    let Fall { sinkage_m, start, end, foam } = fall()?;
    let lost = start.mechanical() - end.mechanical();
    println!("the sphere has sunk by {:.2} mm", sinkage_m * 1e3);
    println!("mechanical energy lost {lost:.4} J");
    println!(
        "heat in the foam {:.4} J, elsewhere {:.4} J",
        foam.dissipated,
        end.dissipated - foam.dissipated
    );
    println!("drift of the energies {:.1e} J", end.dissipated - lost);
    Ok(())
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_sphere_sinks_and_the_energies_balance() {
        let fall = super::fall().unwrap_or_else(|e| panic!("{e}"));
        // k·z²/2 = m·g·(height + z) at the deepest point, then back by the elastic part that the weight does not hold
        let (weight, k) = (5.0 * 9.81, 20e3);
        let deepest = (weight + f64::sqrt(weight * weight + 2.0 * k * weight * super::HEIGHT_M)) / k;
        let rest = deepest - (k * deepest - weight) / (super::STIFFER * k);
        assert!((fall.sinkage_m / rest - 1.0).abs() < 0.02, "{} m of {rest} m", fall.sinkage_m);
        let lost = fall.start.mechanical() - fall.end.mechanical();
        assert!((fall.end.dissipated / lost - 1.0).abs() < 0.01, "{} J of {lost} J", fall.end.dissipated);
    }
}
