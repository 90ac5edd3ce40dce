//! The module soil-bekker as a dynamic library.
terraglue_plugin::export_subsystem!(terraglue_soil_bekker::SoilBekker);
