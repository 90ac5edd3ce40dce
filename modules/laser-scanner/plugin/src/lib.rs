//! The module laser-scanner as a dynamic library, with the description in its section.
terraglue_plugin::export_subsystem! {
    terraglue_laser_scanner::LaserScanner,
    kind: "sensor",
    can: "retry state serialize",
    variables: [
        "blind parameter f64",
        "frozen parameter f64",
        "blocked_* parameter f64 rad",
        "bias_m parameter f64 m",
        "misaligned_* parameter f64 rad",
        "noise_m parameter f64 m",
        "drop_out parameter f64",
        "returns output u64",
        "turns output u64",
    ],
}
