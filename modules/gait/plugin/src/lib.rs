//! The module gait as a dynamic library.
