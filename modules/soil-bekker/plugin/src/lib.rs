//! The module soil-bekker as a dynamic library.
