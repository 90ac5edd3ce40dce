//! The module soil-column as a dynamic library, with the description in its section.
terraglue_plugin::export_subsystem! {
    soil_column::SoilColumnModule,
    kind: "soil",
    can: "force motion derivatives retry state serialize",
    variables: [
        "max_sinkage output f64 m",
        "K parameter f64",
        "columns local u32",
    ],
}
