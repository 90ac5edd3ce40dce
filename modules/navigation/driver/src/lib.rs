//! The module driver as a dynamic library, with the description in its section.
terraglue_plugin::export_subsystem! {
    terraglue_navigation::Driver,
    kind: "controller",
    can: "retry state serialize",
    variables: [
        "x input f64 m",
        "y input f64 m",
        "yaw input f64 rad",
        "is_known input bool",
        "speed parameter f64 m/s",
        "steering output f64 rad",
        "rate_* output f64 rad/s",
        "aside output f64 m",
        "way output f64 m",
        "arrived output bool",
    ],
}
