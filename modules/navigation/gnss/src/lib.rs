//! The module gnss as a dynamic library, with the description in its section.
terraglue_plugin::export_subsystem! {
    terraglue_navigation::Gnss,
    kind: "sensor",
    can: "retry state serialize",
    variables: [
        "outage parameter bool",
        "offset_* parameter f64 m",
        "canopy parameter f64 m",
        "x output f64 m",
        "y output f64 m",
        "deviation output f64 m",
        "has_fix output bool",
    ],
}
