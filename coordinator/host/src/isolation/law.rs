//! The host's side of a law in Python: arrays of nodes go to its process and come back, one call at a time.
//!
//! Answers are kept: a law without state is a function.

use super::answers::{Answers, LawQuestion};
use super::calls::Call;
use super::{Link, Start, What};
use std::any::Any;
use std::sync::{Mutex, PoisonError};
use terraglue_subsystem::{
    Error, MOST_LAW_STATE, NodeLaw, PressureAnswer, PressureNodes, Result, ShearAnswer, ShearNodes,
};

/// The worker, and its answers so far.
struct Asked {
    link: Link,
    start: Start,
    answers: Answers,
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
        let asked = Mutex::new(Asked { link, start: start.clone(), answers: Answers::new() });
        Ok(Self { name: name.to_owned(), asked, doubles, has_pressure, has_shear })
    }

    /// The same law with other numbers, by name.
    ///
    /// # Errors
    /// The process was lost.
    pub fn renumber(&self, new: serde_json::Map<String, serde_json::Value>) -> Result {
        let mut asked = self.asked.lock().unwrap_or_else(PoisonError::into_inner);
        let Asked { link, start, answers } = &mut *asked;
        if let What::Law { numbers, .. } = &mut start.what {
            *numbers = new;
        }
        *answers = Answers::new();
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
        let b = [nodes.b];
        let question = LawQuestion { function: Call::Pressure, h: nodes.h, given: [&b, nodes.depth] };
        if self.doubles == 0
            && let Some(longest) = asked.answers.recall(&question, &mut [&mut *out.pressure, &mut *out.slope])
        {
            out.longest_s = longest;
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
        if self.doubles == 0 {
            asked.answers.keep(&question, &[&*out.pressure, &*out.slope], out.longest_s);
        }
        Ok(())
    }

    fn shear(&self, nodes: &ShearNodes, out: &mut ShearAnswer) -> Result {
        let mut asked = self.asked.lock().unwrap_or_else(PoisonError::into_inner);
        let question = LawQuestion { function: Call::Shear, h: nodes.h, given: [nodes.pressure, nodes.slip] };
        let arrays = &mut [&mut *out.stress, &mut *out.by_pressure, &mut *out.by_slip];
        if self.doubles == 0
            && let Some(longest) = asked.answers.recall(&question, arrays)
        {
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
        if self.doubles == 0 {
            let answer = [&*out.stress, &*out.by_pressure, &*out.by_slip];
            asked.answers.keep(&question, &answer, out.longest_s);
        }
        Ok(())
    }

    fn as_any(&self) -> &dyn Any {
        self
    }
}
