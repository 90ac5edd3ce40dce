//! Loose material on a height field as a cellular automaton: angle of repose, curvature, displacement, compaction.
//!
//! Each rule is in the file of its name: `repose.rs`, `curvature.rs`, `displacement.rs`, `compaction.rs`; which steep slopes stand
//! by cohesion is in `standing.rs`, the load of a foot in `feet.rs`, and `sweep.rs` applies the rules to the active nodes.
//!
//! A cellular automaton moves material between the nodes of the height field in whole units of fixed point, so that
//! nothing is lost; the forces on a foot come from the pressure and shear laws that all soils share
//! (`terraglue-soil-contact`). Two rules act on the free surface (Rossmann, Jung and Rast 2010, section IV):
//!
//! * **Repose**, per face between the cells i and j: with g_n = h_i − h_j, the transverse slope g_t (mean of the
//!   central differences of both cells) and g = √(g_n² + g_t²), the flux from i to j is
//!   q = trunc(¼·(g − Δ·tan φ_r)₊·g_n/g). A plane of slope tan φ_r is at rest at any azimuth.
//! * **Curvature**, per triple a–0–b of opposing neighbours in four directions at distance d: with
//!   c = h_a − 2h_0 + h_b and e = (|c| − κ_max·d²)₊, q = trunc(e/24) goes from 0 to each end (c < 0), or from each
//!   end to 0 (c > 0). e/6 would repair a single triple exactly; 1/24 is the limit for twelve overlapping ones.
//!
//! Both are odd functions of one snapshot: the order in which nodes are visited cannot be seen. A flux is rounded down
//! to whole units (0.24 µm). A sweep applies repose, every second one curvature as well; sweeps per step are bounded, and
//! material not at rest then goes on in the next step.
//!
//! # Load
//! A pressure p weighs as much as p/(N·ρ·g) of soil, N(z, b) = p_law(z, b)/(ρ·g·z): the force-equivalent height
//! is z·p/p_law(z), so a node at the depth of the law stands at its reference level and is in
//! balance with the ground around it. Pressed deeper, it is too high by the extra depth: this material
//! leaves it within the commit and goes to the nearest free nodes in eight directions, weighted with 1/distance².
//! Nothing flows into a node that carries a foot, and into a node below a foot only as much as fits under it.

/// The examples of the README, which the tests compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

mod active;
mod automaton;
mod coarse;
mod compaction;
mod curvature;
mod displacement;
mod feet;
mod lanes;
mod regions;
mod repose;
mod span;
mod standing;
mod still;
mod sweep;
mod values;
mod window;

pub use automaton::{Automaton, DEFAULT_COMPACTION, Settings};
pub use coarse::relax;
pub use compaction::Compaction;
pub use sweep::{Counts, Sweeper};

use terraglue_subsystem::{Parameter, ParameterType};

/// Parameters of these rules in the scenario table of a soil; `compacted` is its default for `compacted_fraction`.
pub fn schema(compacted: f64) -> Vec<Parameter> {
    vec![
        Parameter::number(
            "curvature_max_per_m",
            "",
            automaton::DEFAULT_CURVATURE,
            "largest curvature of the surface, 1/m",
        )
        .positive()
        .usually("1/m", 2.0, 2000.0),
        Parameter {
            unit: "rad".into(),
            ..Parameter::of(
                "angle_of_repose_rad",
                ParameterType::Number,
                "angle of repose; phi_rad where it is left out",
            )
            .within(0.01, 1.4)
            .optional()
        },
        Parameter::of(
            "sweeps_per_step",
            ParameterType::Integer,
            "sweeps of the automaton per communication step; where it is left out a slide's front runs as fast as a wave \
             on shallow water, sqrt(g h)",
        )
        .within(0.0, 1e6)
        .optional(),
        Parameter {
            unit: "m".into(),
            ..Parameter::of(
                "critical_height_m",
                ParameterType::Number,
                "height up to which steep slopes stand; where it is left out that of wall_cohesion_pa, 4 c/gamma tan(45 deg + phi/2)",
            )
            .within(0.0, 1e3)
            .optional()
        },
        Parameter::of(
            "settle_at_start",
            ParameterType::Bool,
            "bring ground that is steeper than its angle of repose to rest before the first step",
        )
        .or(false),
        Parameter::number(
            "compacted_fraction",
            "",
            compacted,
            "share of the pressed volume that becomes denser instead of moving to the rim",
        )
        .within(0.0, 1.0),
    ]
}
