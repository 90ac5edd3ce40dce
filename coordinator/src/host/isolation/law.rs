//! The host's side of a law in Python: arrays of nodes go to its process and come back, one call at a time.
//!
//! A soil asks many nodes at once, but where it looks for a depth it asks for one after the other, and the same again in
//! every trial of a step and while a foot rests. Answers to single nodes are kept: a law without state is a function.

use super::calls::Call;
use super::{Link, Start, What};
use std::any::Any;
use std::sync::{Mutex, PoisonError};
use terraglue_subsystem::{
    Error, MOST_LAW_STATE, NodeLaw, PressureAnswer, PressureNodes, Result, ShearAnswer, ShearNodes,
};

/// Answers that are kept, a power of two.
const KEPT: usize = 1 << 13;

/// What was asked of a single node – which function, size or pressure, depth or slip, step – and the answer.
#[derive(Clone, Copy)]
struct Single {
    asked: [u64; 4],
    answer: [f64; 4],
}

/// No call has the number 0.
const UNASKED: Single = Single { asked: [0; 4], answer: [0.0; 4] };

/// The worker, and its answers to single nodes, each at a place that follows from what was asked.
struct Asked {
    link: Link,
    start: Start,
    kept: Box<[Single]>,
}

/// What is asked of a single node of a law without state; None: it is asked more than that.
fn single(function: u64, h: f64, doubles: usize, values: [&[f64]; 2]) -> Option<[u64; 4]> {
    match values {
        [[a], [b]] if doubles == 0 => Some([function, a.to_bits(), b.to_bits(), h.to_bits()]),
        _ => None,
    }
}

impl Asked {
    /// The place of an answer: by FNV-1a over whole words.
    fn place(&mut self, asked: &[u64; 4]) -> &mut Single {
        let mix = |hash: u64, word: &u64| (hash ^ word ^ (word >> 29)).wrapping_mul(0x0100_0000_01b3_9e37);
        let hash = asked.iter().fold(0xcbf2_9ce4_8422_2325, mix);
        &mut self.kept[(hash >> 40) as usize & (KEPT - 1)]
    }

    fn known(&mut self, asked: Option<[u64; 4]>) -> Option<[f64; 4]> {
        let asked = asked?;
        let place = self.place(&asked);
        (place.asked == asked).then_some(place.answer)
    }

    fn keep(&mut self, asked: Option<[u64; 4]>, answer: [f64; 4]) {
        if let Some(asked) = asked {
            *self.place(&asked) = Single { asked, answer };
        }
    }
}

/// Doubles per node, whether it has pressure, whether it has shear.
fn opened(link: &mut Link, start: &Start) -> Result<(u32, bool, bool)> {
    let text = serde_json::to_string(start).map_err(|e| Error::Failed(e.to_string()))?;
    let write = |w: &mut super::wire::Writer| {
        w.put(&text);
        w.put(&0_u8);
    };
    link.call(Call::Start, write, |r| Some((r.take()?, r.take()?, r.take()?)))
}

/// A law in a worker.
pub struct IsolatedLaw {
    name: String,
    asked: Mutex<Asked>,
    doubles: usize,
    has_pressure: bool,
    has_shear: bool,
}

impl IsolatedLaw {
    pub(super) fn start(name: &str, mut link: Link, start: &Start) -> Result<Self> {
        let about = opened(&mut link, start)?;
        let (doubles, has_pressure, has_shear) = about;
        let doubles = doubles as usize;
        if doubles > MOST_LAW_STATE {
            let text = format!("STATE_DOUBLES = {doubles}; a soil keeps at most {MOST_LAW_STATE} per node");
            return Err(Error::Refused(text));
        }
        if doubles > 0 && !has_pressure {
            return Err(Error::Refused(
                "STATE_DOUBLES needs a function `pressure`, which writes the state".into(),
            ));
        }
        let kept = vec![UNASKED; KEPT].into();
        let asked = Mutex::new(Asked { link, start: start.clone(), kept });
        Ok(Self { name: name.to_owned(), asked, doubles, has_pressure, has_shear })
    }

    /// The same law with other numbers, by name.
    ///
    /// # Errors
    /// The process was lost.
    pub fn renumber(&self, new: serde_json::Map<String, serde_json::Value>) -> Result {
        let mut asked = self.asked.lock().unwrap_or_else(PoisonError::into_inner);
        let Asked { link, start, kept } = &mut *asked;
        if let What::Law { numbers, .. } = &mut start.what {
            *numbers = new;
        }
        kept.fill(UNASKED);
        opened(link, start).map(drop)
    }

    #[cold]
    fn failed(&self, function: &str, error: Error) -> Error {
        let said = match error {
            Error::Failed(text) | Error::Fatal(text) | Error::Refused(text) => text,
            other => other.to_string(),
        };
        Error::Failed(format!("[TG14] the law `{}`, function {function}: {said}", self.name))
    }
}

impl NodeLaw for IsolatedLaw {
    fn name(&self) -> &str {
        &self.name
    }

    fn state_doubles(&self) -> usize {
        self.doubles
    }

    fn has_pressure(&self) -> bool {
        self.has_pressure
    }

    fn has_shear(&self) -> bool {
        self.has_shear
    }

    fn pressure(&self, nodes: &PressureNodes, out: &mut PressureAnswer) -> Result {
        let mut asked = self.asked.lock().unwrap_or_else(PoisonError::into_inner);
        let question = single(Call::Pressure as u64, nodes.h, self.doubles, [&[nodes.b], nodes.depth]);
        if let Some([p, slope, longest, _]) = asked.known(question) {
            (out.pressure[0], out.slope[0], out.longest_s) = (p, slope, longest);
            return Ok(());
        }
        let done = asked.link.call(
            Call::Pressure,
            |w| {
                w.put(&[nodes.b, nodes.h]);
                [nodes.depth, nodes.permanent, nodes.slip, nodes.state].iter().for_each(|a| w.put(*a));
            },
            |r| {
                r.fill(out.pressure)?;
                r.fill(out.slope)?;
                r.fill(out.permanent)?;
                r.fill(out.state)?;
                out.longest_s = r.take()?;
                Some(())
            },
        );
        done.map_err(|e| self.failed("pressure", e))?;
        if question.is_some() {
            asked.keep(question, [out.pressure[0], out.slope[0], out.longest_s, 0.0]);
        }
        Ok(())
    }

    fn shear(&self, nodes: &ShearNodes, out: &mut ShearAnswer) -> Result {
        let mut asked = self.asked.lock().unwrap_or_else(PoisonError::into_inner);
        let question = single(Call::Shear as u64, nodes.h, self.doubles, [nodes.pressure, nodes.slip]);
        if let Some([stress, by_pressure, by_slip, longest]) = asked.known(question) {
            (out.stress[0], out.by_pressure[0], out.by_slip[0]) = (stress, by_pressure, by_slip);
            out.longest_s = longest;
            return Ok(());
        }
        let done = asked.link.call(
            Call::Shear,
            |w| {
                w.put(&nodes.h);
                [nodes.pressure, nodes.slip, nodes.state].iter().for_each(|a| w.put(*a));
            },
            |r| {
                r.fill(out.stress)?;
                r.fill(out.by_pressure)?;
                r.fill(out.by_slip)?;
                out.longest_s = r.take()?;
                Some(())
            },
        );
        done.map_err(|e| self.failed("shear", e))?;
        if question.is_some() {
            let answer = [out.stress[0], out.by_pressure[0], out.by_slip[0], out.longest_s];
            asked.keep(question, answer);
        }
        Ok(())
    }

    fn as_any(&self) -> &dyn Any {
        self
    }
}
