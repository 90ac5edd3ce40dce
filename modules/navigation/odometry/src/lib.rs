//! The module odometry as a dynamic library, with the description in its section.
terraglue_plugin::export_subsystem! {
    terraglue_navigation::Odometry,
    kind: "controller",
    can: "retry state serialize",
    variables: [
        "x output f64 m",
        "y output f64 m",
        "yaw output f64 rad",
        "speed output f64 m/s",
        "turn_rate output f64 rad/s",
        "slip parameter f64",
        "shift_* parameter f64 m",
        "gyro input f64 rad/s",
        "rate_* input f64 rad/s",
    ],
}
