//! Fits of soil laws to plate and wheel tests, with confidence intervals.
//!
//! Numerics alone: files, names and units around the fits belong to whoever calls.
//!
//! * `plates.rs`: the built-in pressure laws (`plate_law.rs`) on plate tests; `solve.rs` finds their numbers.
//! * `law_numbers.rs`: the numbers of any law, e.g. of one that is a module, by `least_squares.rs`.
//! * `wheel.rs`: a soil from the sinkage and pull of a driven wheel, by the integral in `rim.rs`.
//! * `interval.rs`: confidence intervals by leaving whole curves out; `student.rs`: Student's distribution.

/// The examples of the README, which the tests compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

mod interval;
mod law_numbers;
mod least_squares;
mod plate_law;
mod plates;
mod rim;
mod solve;
mod student;
mod wheel;

pub use interval::{Basis, Interval, spread};
pub use law_numbers::{LawNumbers, range, start};
pub use least_squares::{Free, Least, NumbersFit, Pressures, Residuals, fit_numbers, least_squares};
pub use plate_law::{FitError, FitLaw, PlateNumbers, Reading};
pub use plates::{Fit, fit};
pub use rim::{Rim, Rolling};
pub use wheel::{SoilBounds, Wheel, WheelError, WheelFit, WheelNumber, WheelPoint, WheelStart, fit_wheel};
