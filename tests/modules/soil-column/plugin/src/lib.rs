//! The module soil-column as a dynamic library.
terraglue_plugin::export_subsystem!(soil_column::SoilColumnModule);
