//! The module rigid-body as a dynamic library.
