//! The calls by number, what goes into them, and how they are answered.

use super::Line;
use super::wire::{Reader, Writer};
use terraglue_subsystem::{
    Error, Input, Law, Level, LogLevel, Motion, Node, Port, Response, Result, Step, ValueType, Values,
    ValuesMut,
};

/// The calls, numbered from 1 in this order.
macro_rules! calls {
    ($first:ident, $($other:ident),+ $(,)?) => {
        /// Calls of a worker.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[repr(u8)]
        pub enum Call {
            $first = 1,
            $($other),+
        }

        impl Call {
            const ALL: &[Self] = &[Self::$first, $(Self::$other),+];
        }
    };
}

calls! {
    Start, SetPorts, Estimate, Solve, Advance, Jacobian, Commit, Save, Restore, Serialize, Deserialize, Get, Set, Act,
    NextEvent, BodyStates, Energy, Pressure, Shear, Quit, AdvanceBatch, Observe,
    Answer, Visibility, Overlays, Directional,
}

impl Call {
    /// The call of this number.
    pub fn of(number: u8) -> Option<Self> {
        Self::ALL.iter().copied().find(|c| *c as u8 == number)
    }

    /// Whether it comes at most about once in a step.
    pub fn is_rare(self) -> bool {
        use Call::{Act, Advance, AdvanceBatch, Commit, Quit, Start};
        matches!(self, Start | Advance | AdvanceBatch | Commit | Act | Quit)
    }
}

/// Writes the log of the instance and the outcome of the call; an answer follows where it succeeded.
pub fn write_outcome(w: &mut Writer, lines: &[Line], outcome: &Result) {
    w.put(&(lines.len() as u32));
    for (level, text) in lines {
        w.put(&(*level as i32));
        w.put(text);
    }
    match outcome {
        Ok(()) => w.put(&0_u8),
        Err(Error::Unsupported) => w.put(&1_u8),
        Err(Error::Discard { reached }) => (w.put(&2_u8), w.put(reached)).0,
        Err(Error::Refused(text)) => (w.put(&3_u8), w.put(text)).0,
        Err(Error::Fatal(text)) => (w.put(&5_u8), w.put(text)).0,
        Err(other) => (w.put(&4_u8), w.put(&other.to_string())).0,
    }
}

/// Reads the same; nothing where the bytes make no sense.
pub fn read_answer<T>(
    r: &mut Reader,
    read: impl FnOnce(&mut Reader) -> Option<T>,
) -> Option<(Vec<Line>, Result<T>)> {
    let count: u32 = r.take()?;
    let mut lines = Vec::new();
    for _ in 0..count {
        let level = match r.take::<i32>()? {
            1 => LogLevel::Error,
            2 => LogLevel::Warning,
            3 => LogLevel::Info,
            4 => LogLevel::Debug,
            _ => return None,
        };
        lines.push((level, r.take()?));
    }
    let answer = match r.take::<u8>()? {
        0 => Ok(read(r)?),
        1 => Err(Error::Unsupported),
        2 => Err(Error::Discard { reached: r.take()? }),
        3 => Err(Error::Refused(r.take()?)),
        4 => Err(Error::Failed(r.take()?)),
        5 => Err(Error::Fatal(r.take()?)),
        _ => return None,
    };
    Some((lines, answer))
}

/// A step with what it borrows.
#[derive(Debug, Default)]
pub struct OwnedStep {
    numbers: [f64; 2],
    counts: [u64; 3],
    ports: Vec<Port>,
    nodes: Vec<Node>,
}

impl OwnedStep {
    /// As the interface wants it.
    pub fn step(&self) -> Step<'_> {
        let [t, h] = self.numbers;
        let [index, trial, n] = self.counts;
        Step { t, h, index, trial: trial as u32, n: n as u32, ports: &self.ports, nodes: &self.nodes }
    }

    /// Reads a step.
    pub fn take(r: &mut Reader) -> Option<Self> {
        Some(Self { numbers: r.take()?, counts: r.take()?, ports: r.take()?, nodes: r.take()? })
    }
}

/// Writes a step.
pub fn put_step(w: &mut Writer, s: &Step) {
    w.put(&[s.t, s.h]);
    w.put(&[s.index, s.trial.into(), s.n.into()]);
    w.put(s.ports);
    w.put(s.nodes);
}

/// Writes an input.
pub fn put_input(w: &mut Writer, input: &Input) {
    match input {
        Input::Force { t, motion } => {
            w.put(&if motion.is_some() { 1_u8 } else { 0 });
            w.put(*t);
            if let Some(m) = motion {
                put_motion(w, m);
            }
        }
        Input::Motion(m) => {
            w.put(&2_u8);
            put_motion(w, m);
        }
    }
}

/// Writes a motion.
pub fn put_motion(w: &mut Writer, m: &Motion) {
    w.put(m.x);
    w.put(m.v);
}

/// Reads an input and hands it on.
pub fn with_input<T>(r: &mut Reader, run: impl FnOnce(&Input) -> T) -> Option<T> {
    let kind: u8 = r.take()?;
    let a: Vec<f64> = r.take()?;
    if kind == 0 {
        return Some(run(&Input::Force { t: &a, motion: None }));
    }
    let b: Vec<f64> = r.take()?;
    match kind {
        1 => {
            let v: Vec<f64> = r.take()?;
            let motion = Some(Motion { x: &b, v: &v });
            Some(run(&Input::Force { t: &a, motion }))
        }
        2 => Some(run(&Input::Motion(Motion { x: &a, v: &b }))),
        _ => None,
    }
}

/// The level of this number.
pub fn level_of(number: u32) -> Option<Level> {
    [Level::Position, Level::Velocity, Level::Acceleration].into_iter().find(|l| *l as u32 == number)
}

/// Writes a response.
pub fn put_response(w: &mut Writer, out: &Response) {
    w.put(&*out.x);
    w.put(&*out.v);
    w.put(&*out.a);
    w.put(&*out.t);
    w.put(&out.reached);
    w.put(&out.flags);
}

/// Reads a response into the caller's arrays.
pub fn take_response(r: &mut Reader, out: &mut Response) -> Option<()> {
    r.fill(out.x)?;
    r.fill(out.v)?;
    r.fill(out.a)?;
    r.fill(out.t)?;
    out.reached = r.take()?;
    out.flags = r.take()?;
    Some(())
}

/// Runs `run` on vectors of n values filled with NaN.
pub fn with_response<T>(step: &Step, run: impl FnOnce(&mut Response) -> T) -> T {
    let n = step.n as usize;
    let [mut x, mut v, mut a, mut t] = [(); 4].map(|()| vec![f64::NAN; n]);
    let reached = step.t + step.h;
    run(&mut Response { x: &mut x, v: &mut v, a: &mut a, t: &mut t, reached, flags: 0 })
}

/// Reads laws into the caller's array.
pub fn take_laws(r: &mut Reader, laws: &mut [Law]) -> Option<()> {
    let found: Vec<Law> = r.take()?;
    (found.len() == laws.len()).then(|| laws.copy_from_slice(&found))
}

macro_rules! values {
    ($($variant:ident: $t:ty),*) => {
        /// Writes values with their type.
        pub fn put_values(w: &mut Writer, values: &Values) {
            match values {
                $(Values::$variant(all) => (w.put(&ValueType::$variant), w.put(*all)).0,)*
            }
        }

        /// Reads values and hands them on.
        pub fn with_values<T>(r: &mut Reader, run: impl FnOnce(Values) -> T) -> Option<T> {
            match r.take::<ValueType>()? {
                $(ValueType::$variant => Some(run(Values::$variant(&r.take::<Vec<$t>>()?))),)*
                ValueType::Clock => None,
            }
        }

        /// Type and number of values that are asked for.
        pub fn put_room(w: &mut Writer, out: &ValuesMut) {
            match out {
                $(ValuesMut::$variant(all) => (w.put(&ValueType::$variant), w.put(&(all.len() as u32))).0,)*
            }
        }

        /// Makes room of a type, lets `run` fill it, and writes it after its outcome.
        pub fn fill_room(
            kind: ValueType,
            count: usize,
            run: impl FnOnce(ValuesMut) -> Result,
            write: impl FnOnce(&Result, &dyn Fn(&mut Writer)),
        ) {
            match kind {
                $(ValueType::$variant => {
                    let mut all = vec![<$t>::default(); count];
                    let done = run(ValuesMut::$variant(&mut all));
                    write(&done, &|w: &mut Writer| w.put(&all));
                })*
                ValueType::Clock => write(&Err(Error::Unsupported), &|_| {}),
            }
        }

        /// Reads values into the caller's room.
        pub fn take_room(r: &mut Reader, out: &mut ValuesMut) -> Option<()> {
            match out {
                $(ValuesMut::$variant(out) => {
                    let all: Vec<$t> = r.take()?;
                    if all.len() != out.len() {
                        return None;
                    }
                    out.iter_mut().zip(all).for_each(|(out, x)| *out = x);
                    Some(())
                })*
            }
        }
    };
}
values!(
    F64: f64, F32: f32, I8: i8, I16: i16, I32: i32, I64: i64, U8: u8, U16: u16, U32: u32, U64: u64, Bool: bool,
    String: String, Binary: Vec<u8>, Enumeration: i64
);
