//! Glues subsystems into one simulation: scenario, host, contact detection, gluing strategies, recording.
