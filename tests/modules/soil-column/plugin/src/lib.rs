//! The module soil-column as a dynamic library.
