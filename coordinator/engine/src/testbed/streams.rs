//! Streams of all subsystems: the messages of a step, copied before the next one begins, within the bounds that each stream
//! declares. Messages beyond them are omitted with a warning that names the stream; nothing waits.

use crate::observer::StreamView;
use crate::signals;
use terraglue_diagnostics::Result;
use terraglue_gluing::memory::{Recall, Remember};
use terraglue_host::Instance;
use terraglue_subsystem::StreamInfo;

/// Most bytes of all messages of a nominal step. Messages beyond it are omitted.
const MOST_BYTES: usize = 64 << 20;
/// Messages may come earlier than their rate allows by this part of a period: steps do not divide it evenly.
const EARLY: f64 = 0.5;

/// All streams of a run; empty where there are none.
#[derive(Default)]
pub(super) struct Streams {
    views: Vec<StreamView>,
    /// Slots and numbers in them, of each view.
    places: Vec<(usize, usize)>,
    state: Vec<State>,
    bytes: usize,
}

#[derive(Clone, Default)]
struct State {
    /// Time of the last message that was taken.
    last: Option<f64>,
    warned: bool,
}

impl Streams {
    pub fn new(instances: &[Instance]) -> Self {
        let mut all = Self::default();
        for (name, (slot, k)) in signals::streams(instances) {
            let info = instances[slot].subsystem().streams()[k].clone();
            all.views.push(StreamView { name, info, messages: Vec::new() });
            all.places.push((slot, k));
        }
        all.state = vec![State::default(); all.views.len()];
        all
    }

    /// Forgets the messages of the last nominal step.
    pub fn clear(&mut self) {
        self.views.iter_mut().for_each(|view| view.messages.clear());
        self.bytes = 0;
    }

    /// All streams with the messages of the last nominal step.
    pub fn views(&self) -> &[StreamView] {
        &self.views
    }

    /// The run begins.
    pub fn forget(&mut self) {
        self.clear();
        self.state.iter_mut().for_each(|state| state.last = None);
    }

    /// For a snapshot: the times of the last messages, so that none is taken twice.
    pub fn remember(&self) -> Vec<u64> {
        let mut out = Vec::new();
        for State { last, .. } in &self.state {
            out.push(u64::from(last.is_some()));
            out.put(last.unwrap_or(0.0));
        }
        out
    }

    /// Back to a snapshot.
    pub fn recall(&mut self, kept: &mut Recall) {
        self.clear();
        for state in &mut self.state {
            let (there, time) = (kept.word() != 0, kept.number());
            state.last = there.then_some(time);
        }
    }

    /// Takes the messages of the last communication step; `tell` gets the number of the stream and the bytes of each.
    pub fn collect(&mut self, instances: &[Instance], mut tell: impl FnMut(usize, &[u8])) -> Result {
        let all = self.views.iter_mut().zip(&self.places).zip(&mut self.state).enumerate();
        for (number, ((view, (slot, k)), state)) in all {
            let Some(message) = terraglue_host::message(&instances[*slot], *k)? else { continue };
            // the same message again: the instance has made no step since
            if state.last == Some(message.time) {
                continue;
            }
            let total = self.bytes + message.bytes.len();
            if let Some(why) = too_much(&view.info, state.last, message.time, message.bytes.len(), total) {
                if !std::mem::replace(&mut state.warned, true) {
                    log::warn!("the stream `{}` {why}; what is too much is left out", view.name);
                }
                continue;
            }
            self.bytes = total;
            state.last = Some(message.time);
            tell(number, message.bytes);
            view.messages.push((message.time, message.bytes.to_vec()));
        }
        Ok(())
    }
}

/// Why a message is not taken.
fn too_much(info: &StreamInfo, last: Option<f64>, time: f64, size: usize, total: usize) -> Option<String> {
    if size > info.most_bytes as usize {
        return Some(format!(
            "made a message of {size} bytes at t = {time} s and promises at most {}",
            info.most_bytes
        ));
    }
    if let Some(last) = last
        && info.rate_hz > 0.0
        && time - last < EARLY / info.rate_hz
    {
        let after = time - last;
        return Some(format!(
            "made a message {after:.6} s after the one before, at t = {time} s, and promises at most {} per second",
            info.rate_hz
        ));
    }
    (total > MOST_BYTES).then(|| {
        format!(
            "does not fit into the {} MB that all messages of a step may have, at t = {time} s",
            MOST_BYTES >> 20
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_are_those_that_a_stream_tells() {
        let info = StreamInfo {
            name: "points".into(),
            schema: String::new(),
            encoding: String::new(),
            rate_hz: 10.0,
            most_bytes: 100,
            help: String::new(),
        };
        assert_eq!(too_much(&info, None, 0.0, 100, 100), None);
        assert_eq!(too_much(&info, Some(0.0), 0.09, 100, 100), None);
        assert!(too_much(&info, Some(0.0), 0.01, 1, 1).is_some_and(|why| why.contains("10 per second")));
        assert!(too_much(&info, None, 0.0, 101, 101).is_some_and(|why| why.contains("101 bytes")));
        assert!(too_much(&info, None, 0.0, 1, MOST_BYTES + 1).is_some_and(|why| why.contains("64 MB")));
        assert_eq!(too_much(&StreamInfo { rate_hz: 0.0, ..info }, Some(0.0), 1e-9, 1, 1), None);
    }
}
