//! Steps one module without the rest of the coordinator: a soil below moving feet, a robot under forces, a controller
//! with moving inputs. [`script`] does the same for any kind and hands back the bits of all answers.

mod bodies;
mod flat;
mod law;
mod script;
mod signals;
mod soil;

pub use bodies::BodyBench;
pub use flat::Flat;
pub use law::LawBench;
pub use script::{Runner, committed, script};
pub use signals::{numbers, outputs, set_numbers};
pub use soil::{Foot, Moved, SoilBench, dot};

use terraglue_subsystem::Response;

/// The vectors of a response.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Vectors {
    /// Displacement.
    pub x: Vec<f64>,
    /// Velocity.
    pub v: Vec<f64>,
    /// Acceleration.
    pub a: Vec<f64>,
    /// Wrench.
    pub t: Vec<f64>,
    /// Time reached, s.
    pub reached: f64,
}

impl Vectors {
    /// For n components.
    pub fn new(n: usize) -> Self {
        let [x, v, a, t] = [0; 4].map(|_| vec![0.0; n]);
        Self { x, v, a, t, reached: 0.0 }
    }

    /// To be filled by a call.
    pub fn response(&mut self) -> Response<'_> {
        let Self { x, v, a, t, reached } = self;
        Response { x, v, a, t, reached: *reached, flags: 0 }
    }

    /// The bits of all numbers.
    pub fn bits(&self) -> impl Iterator<Item = u64> + '_ {
        [&self.x, &self.v, &self.a, &self.t].into_iter().flatten().map(|v| v.to_bits())
    }
}
