//! Soil as a cellular automaton: angle of repose, curvature, active nodes, force-equivalent height.
