//! Which shapes are shown, of the subsystems that can hide some: what `/scene` draws, and which bodies are to be drawn again.

use crate::snapshot::failed;
use terraglue_diagnostics::error::Result;
use terraglue_engine::observer::View;
use terraglue_subsystem::Capabilities;

/// Visibility of shapes when last read.
#[derive(Debug, Default)]
pub(crate) struct Visibility {
    /// Numbers of subsystems with a flag for each of their shapes.
    all: Vec<(usize, Vec<bool>)>,
}

impl Visibility {
    /// Of all subsystems that can hide shapes.
    pub fn find(view: &View) -> Result<Self> {
        let hides = |k: &usize| view.subsystems[*k].instance.capabilities().has(Capabilities::HIDES);
        let slots = (0..view.subsystems.len()).filter(hides);
        let all = slots.map(|k| (k, vec![true; view.subsystems[k].scene.shapes.len()])).collect();
        let mut found = Self { all };
        found.changed(view)?;
        Ok(found)
    }

    /// Whether shape number `shape` of a subsystem is shown.
    pub fn shows(&self, subsystem: usize, shape: usize) -> bool {
        let flags = self.all.iter().find(|(k, _)| *k == subsystem);
        flags.is_none_or(|(_, shown)| shown.get(shape).is_none_or(|s| *s))
    }

    /// Looks again: numbers of the subsystems and of their bodies of which another part is shown than before.
    pub fn changed(&mut self, view: &View) -> Result<Vec<(usize, usize)>> {
        let mut bodies = Vec::new();
        for (k, shown) in &mut self.all {
            let s = &view.subsystems[*k];
            let mut now = vec![true; shown.len()];
            let read = s.instance.shape_visibility(&mut now);
            read.map_err(|e| failed(s, view.t_s, "shape_visibility", e.to_string()))?;
            let flags = s.scene.shapes.iter().zip(shown.iter().zip(&now));
            bodies.extend(flags.filter(|(_, (a, b))| a != b).map(|(shape, _)| (*k, shape.body as usize)));
            *shown = now;
        }
        bodies.dedup();
        Ok(bodies)
    }

    /// For a checkpoint.
    pub fn flags(&self) -> Vec<Vec<bool>> {
        self.all.iter().map(|(_, shown)| shown.clone()).collect()
    }

    /// Back to a checkpoint.
    pub fn recall(&mut self, flags: Vec<Vec<bool>>) {
        let fitting = self.all.iter_mut().zip(flags).filter(|((_, shown), kept)| shown.len() == kept.len());
        fitting.for_each(|((_, shown), kept)| *shown = kept);
    }
}
