//! Laws as text: `(k_c/b + k_phi)*z^n` in a scenario becomes a program with exact derivatives.
//!
//! Parsed ([`Tree`]), checked for names, dimensions (the result is a pressure) and for being defined over the whole
//! range of its names, folded with the parameters and the size of a contact, evaluated over chunks of nodes
//! without allocation. Where the folded law is a power law it becomes the built-in one.
//!
//! ```
//! use terraglue_soil_law::{Bekker, PressureLaw, SoilExpressions, SoilParameters};
//! use terraglue_subsystem::Config;
//! let config = Config::parse(r#"{"law": {"pressure": "(k_c/b + k_phi)*z^n"}}"#).expect("JSON");
//! let soil = SoilParameters { n: 1.1, k_c: 990.0, k_phi: 1_528_430.0, c_pa: 1040.0, phi_rad: 0.5, K_m: 0.01,
//!     ..SoilParameters::default() };
//! let laws = SoilExpressions::from_config(&config).expect("read").expect("there is one");
//! let law = laws.pressure(&soil).expect("good").expect("there is one");
//! let curve = PressureLaw::Expression(law).curve(0.05, 4e8);
//! let built_in = PressureLaw::Bekker(Bekker { k_c: 990.0, k_phi: 1_528_430.0, n: 1.1 }).curve(0.05, 4e8);
//! assert_eq!(curve, built_in);
//! ```

mod build;
mod dimension;
mod error;
mod law;
mod parse;
mod program;
mod range;
mod symbol;

pub use error::ExpressionError;
pub use law::{PressureExpression, ShearExpression, SoilExpressions};
pub use parse::{Binary, Function, Tree};
pub use program::Program;
pub use symbol::{Role, Symbol};
