//! The module gait as a dynamic library.
terraglue_plugin::export_subsystem!(terraglue_gait::Gait);
