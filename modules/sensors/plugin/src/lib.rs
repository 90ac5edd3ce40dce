//! The module sensor as a dynamic library, with the description in its section.
terraglue_plugin::export_subsystem! {
    terraglue_sensors::Sensor,
    kind: "sensor",
    can: "retry state serialize",
    variables: [
        "true_* input f64 rad | N | N m",
        "angle output f64 rad",
        "force_* output f64 N",
        "moment_* output f64 N m",
        "acceleration_* output f64 m/s^2",
        "rate_* output f64 rad/s",
        "distance output f64 m",
        "hit output bool",
        "contact output bool",
    ],
}
