//! Soil after Bekker with unloading, Mohr-Coulomb strength and Janosi-Hanamoto shear.
