//! The C ABI of a module: the table of functions, its header, and the conversion both ways.
