//! The height field that soils shape and everybody reads, with the exact lower surface of every shape.
