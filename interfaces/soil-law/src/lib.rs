//! Pressure and shear laws of soils with tangents and inverses, evaluated over batches of nodes.
