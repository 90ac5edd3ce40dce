//! Buffers of finite differences over trials, and which ports one trial may perturb together.

use super::participant::Participant;
use terraglue_subsystem::Node;

/// Memory of differences from trial to trial.
#[derive(Debug, Default)]
pub struct Differences {
    /// Vectors of the problem while differences change them.
    pub(super) kept: [Vec<f64>; 4],
    /// d(v1 − v2)/dT.
    pub(super) rates: Vec<f64>,
    /// The bodies' last trial is not that of T.
    pub(super) displaced: bool,
    /// Which ports may be perturbed together, and which share ground: see [`Participant::colours`].
    pub(super) colours: Vec<u32>,
    pub(super) meets: Vec<bool>,
}

impl Differences {
    /// Numbers the m ports of bodies on side 2 and of grounds by which they may be perturbed together; how many numbers there are.
    pub(super) fn colour_ports<'a>(
        &mut self,
        bodies: impl Iterator<Item = &'a Participant>,
        grounds: &[Participant],
        nodes: &[Node],
        m: usize,
    ) -> u32 {
        self.meets.clear();
        self.meets.resize(m * m, false);
        self.colours.clear();
        self.colours.resize(m, u32::MAX);
        for side in bodies {
            side.colours(None, m, &mut self.meets, &mut self.colours);
        }
        for side in grounds {
            side.colours(Some(nodes), m, &mut self.meets, &mut self.colours);
        }
        self.colours.iter().filter(|c| **c != u32::MAX).max().map_or(0, |c| c + 1)
    }
}
