//! The module soil-cellular-automaton as a dynamic library.
