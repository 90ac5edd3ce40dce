//! The module rigid-body as a dynamic library.
terraglue_plugin::export_subsystem!(terraglue_rigid_body::RigidBody);
