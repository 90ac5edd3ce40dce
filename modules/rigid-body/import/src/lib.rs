//! Reads robot files (URDF) into a checked tree of bodies, joints and shapes.
