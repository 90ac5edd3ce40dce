//! Which beams a turn has: directions in the frame of the scanner (x ahead, z up), and when within the turn each one fires.

use std::f64::consts::TAU;

/// Beams of a scanner that turns about its axis z.
#[derive(Clone, Debug, PartialEq)]
pub struct Pattern {
    /// Firings in a turn; each fires all beams at once.
    pub columns: u32,
    /// Elevation of each beam, rad, the highest first: its place is the ring of a point.
    pub elevations: Vec<f64>,
    /// Azimuth of the first firing, and how far the firings reach from there, rad.
    pub sector: [f64; 2],
}

impl Pattern {
    /// Names of the patterns that are built in.
    pub const NAMES: [&'static str; 3] = ["line", "vlp-16", "os1-64"];

    /// A pattern by its name.
    pub fn named(name: &str) -> Option<Self> {
        match name {
            "line" => Some(Self::line()),
            "vlp-16" => Some(Self::vlp_16()),
            "os1-64" => Some(Self::os1_64()),
            _ => None,
        }
    }

    /// One beam over 190° in steps of 0.5°, as scanners of the class of the SICK LMS 100 have it.
    pub fn line() -> Self {
        let sector = [-95.0_f64, 190.0].map(f64::to_radians);
        Self { columns: 381, elevations: vec![0.0], sector }
    }

    /// 16 beams from 15° to −15° in steps of 2°, 1800 firings in a turn (Velodyne, VLP-16 user manual, 10 Hz).
    pub fn vlp_16() -> Self {
        Self::even(1800, 16, [15.0, -15.0])
    }

    /// 64 beams from 22.5° to −22.5°, 1024 firings in a turn (Ouster, OS1 datasheet, 45° of vertical field of view).
    pub fn os1_64() -> Self {
        Self::even(1024, 64, [22.5, -22.5])
    }

    /// Beams at even distances between two elevations, degrees, over a whole turn.
    pub fn even(columns: u32, beams: u32, [first, last]: [f64; 2]) -> Self {
        let step = (last - first) / f64::from(beams.max(2) - 1);
        let elevations = (0..beams).map(|k| (first + step * f64::from(k)).to_radians()).collect();
        Self { columns, elevations, sector: [0.0, TAU] }
    }

    /// Rays of a turn.
    pub fn rays(&self) -> usize {
        self.columns as usize * self.elevations.len()
    }

    /// Angle between two firings, rad.
    pub fn azimuth_step(&self) -> f64 {
        self.sector[1] / f64::from(if self.is_whole() { self.columns } else { self.columns.max(2) - 1 })
    }

    /// Whether firings go all around.
    fn is_whole(&self) -> bool {
        (self.sector[1].abs() - TAU).abs() < 1e-9
    }

    /// Azimuth of a column, rad.
    pub fn azimuth(&self, column: u32) -> f64 {
        self.sector[0] + self.azimuth_step() * f64::from(column)
    }

    /// Unit vector of a beam in the frame of the scanner; a beam that is not there points ahead.
    pub fn direction(&self, column: u32, ring: u32) -> [f64; 3] {
        let elevation = self.elevations.get(ring as usize).copied().unwrap_or(0.0);
        direction(self.azimuth(column), elevation)
    }

    /// The same, looking aside in azimuth and elevation, rad.
    pub fn direction_aside(&self, column: u32, ring: u32, [azimuth, up]: [f64; 2]) -> [f64; 3] {
        let elevation = self.elevations.get(ring as usize).copied().unwrap_or(0.0);
        direction(self.azimuth(column) + azimuth, elevation + up)
    }

    /// Share of a turn that has passed when a column fires.
    pub fn share(&self, column: u32) -> f64 {
        self.azimuth_step().abs() * f64::from(column) / TAU
    }
}

/// Unit vector of an azimuth and an elevation, rad.
fn direction(azimuth: f64, elevation: f64) -> [f64; 3] {
    let level = libm::cos(elevation);
    [level * libm::cos(azimuth), level * libm::sin(azimuth), libm::sin(elevation)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_are_unit_vectors_within_the_field_of_view() {
        for name in Pattern::NAMES {
            let pattern = Pattern::named(name).expect("built in");
            for (column, ring) in
                (0..pattern.columns).flat_map(|c| [(c, 0), (c, pattern.elevations.len() as u32 - 1)])
            {
                let d = pattern.direction(column, ring);
                assert!((d.iter().map(|x| x * x).sum::<f64>() - 1.0).abs() < 1e-12);
                assert!(d[2].abs() <= libm::sin(22.5_f64.to_radians()) + 1e-12);
            }
            assert!(pattern.share(pattern.columns - 1) < 1.0);
        }
        let line = Pattern::line();
        assert!((line.azimuth_step().to_degrees() - 0.5).abs() < 1e-12);
        assert!((line.azimuth(380).to_degrees() - 95.0).abs() < 1e-9);
    }
}
