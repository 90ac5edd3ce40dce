//! Tests of the whole in one program: it is linked once. `no_allocation` counts what its process allocates and has its own.
#![allow(clippy::unwrap_used, missing_docs)]

mod architecture;
mod arrays;
mod bodies_on_soil;
mod cut_joints;
mod cut_robot;
mod differences;
mod fault_routes;
mod faults;
mod generated_files;
mod glue_groups;
mod glue_options;
mod grousers;
mod laws;
mod resting_foot;
mod scenarios;
mod settled_start;
mod side_by_side;
mod soil_in_c;
mod words;
