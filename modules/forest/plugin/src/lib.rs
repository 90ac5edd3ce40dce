//! The module forest as a dynamic library, and what its section says of it.
terraglue_plugin::export_subsystem! {
    terraglue_forest::Forest,
    kind: "robot",
    can: "retry state serialize",
    variables: ["trees output u64"],
}
