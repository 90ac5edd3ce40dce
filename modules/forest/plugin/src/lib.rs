//! The module forest as a dynamic library, with the description in its section.
terraglue_plugin::export_subsystem! {
    terraglue_forest::Forest,
    kind: "robot",
    can: "retry state serialize",
    variables: ["trees output u64"],
}
