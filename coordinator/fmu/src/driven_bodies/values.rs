//! The variables of `feet`: arrays with one row per foot.

use super::State;
use super::motion::DrivenBody;
use terraglue_subsystem::{Causality, Error, Result, ValueType, Values, ValuesMut, Variable};

/// Numbers of the variables.
pub mod id {
    /// Position, n × 3.
    pub const POSITION: u32 = 0;
    /// Orientation, n × 4.
    pub const ORIENTATION: u32 = 1;
    /// Time over which a new pose is reached.
    pub const DURATION: u32 = 2;
    /// Whether a new pose holds at once.
    pub const JUMP: u32 = 3;
    /// Force, n × 3.
    pub const FORCE: u32 = 4;
    /// Moment, n × 3.
    pub const MOMENT: u32 = 5;
}

/// All variables for n feet.
pub fn variables(n: u32) -> Vec<Variable> {
    use Causality::{Input, Output, Parameter};
    let rows = |id, name: &str, unit, role, width, help| Variable {
        dims: vec![n, width],
        ..Variable::real(id, name, unit, role, help)
    };
    vec![
        rows(
            id::POSITION,
            "position",
            "m",
            Input,
            3,
            "Where each foot is to be at the end of the step, world",
        ),
        rows(
            id::ORIENTATION,
            "orientation",
            "",
            Input,
            4,
            "Unit quaternion w, x, y, z, world from foot, likewise",
        ),
        Variable::real(id::DURATION, "duration", "s", Parameter, "Time over which a new pose is reached")
            .within(0.0, f64::INFINITY),
        Variable::real(id::JUMP, "jump", "", Parameter, "A new pose holds at once, without a way to it")
            .typed(ValueType::Bool),
        rows(
            id::FORCE,
            "force",
            "N",
            Output,
            3,
            "Force of the ground on each foot in the last step, world axes",
        ),
        rows(
            id::MOMENT,
            "moment",
            "N m",
            Output,
            3,
            "Moment about the foot's origin in the last step, world axes",
        ),
    ]
}

fn unknown<T>(id: u32) -> Result<T> {
    Err(Error::Refused(format!("no variable of this type has the number {id}")))
}

/// Reads values.
pub fn get(state: &State, ids: &[u32], out: ValuesMut) -> Result {
    match out {
        ValuesMut::F64(out) => {
            let mut rest = out;
            for id in ids {
                let place = get_one(state, *id, rest)?;
                rest = place;
            }
            Ok(())
        }
        ValuesMut::Bool(out) => ids.iter().zip(out).try_for_each(|(id, out)| match *id {
            id::JUMP => {
                *out = state.jump;
                Ok(())
            }
            other => unknown(other),
        }),
        _ => unknown(ids.first().copied().unwrap_or(0)),
    }
}

/// Writes one variable to the front of `out`; the rest of it.
fn get_one<'a>(state: &State, id: u32, out: &'a mut [f64]) -> Result<&'a mut [f64]> {
    fn rows<'a, const N: usize>(
        state: &State,
        out: &'a mut [f64],
        of: impl Fn(&DrivenBody) -> [f64; N],
    ) -> Result<&'a mut [f64]> {
        let split = out.split_at_mut_checked(N * state.feet.len());
        let (front, rest) = split.ok_or_else(|| Error::Refused("too little room".into()))?;
        front.chunks_exact_mut(N).zip(&state.feet).for_each(|(out, f)| out.copy_from_slice(&of(f)));
        Ok(rest)
    }
    match id {
        id::POSITION => rows(state, out, |f| f.target.position),
        id::ORIENTATION => rows(state, out, |f| f.target.orientation),
        id::FORCE => rows(state, out, |f| f.force),
        id::MOMENT => rows(state, out, |f| f.moment),
        id::DURATION => match out.split_first_mut() {
            Some((first, rest)) => {
                *first = state.duration_s;
                Ok(rest)
            }
            None => Err(Error::Refused("too little room".into())),
        },
        other => unknown(other),
    }
}

/// Sets values.
pub fn set(state: &mut State, ids: &[u32], new: Values) -> Result {
    match new {
        Values::F64(new) => {
            let mut rest = new;
            for id in ids {
                rest = set_one(state, *id, rest)?;
            }
            Ok(())
        }
        Values::Bool(new) => ids.iter().zip(new).try_for_each(|(id, new)| match *id {
            id::JUMP => {
                state.jump = *new;
                Ok(())
            }
            other => unknown(other),
        }),
        _ => unknown(ids.first().copied().unwrap_or(0)),
    }
}

/// Takes one variable from the front of `new`; the rest of it.
fn set_one<'a>(state: &mut State, id: u32, new: &'a [f64]) -> Result<&'a [f64]> {
    let width = match id {
        id::POSITION => 3 * state.feet.len(),
        id::ORIENTATION => 4 * state.feet.len(),
        id::DURATION => 1,
        other => return unknown(other),
    };
    let Some((front, rest)) = new.split_at_checked(width) else {
        return Err(Error::Refused(format!("{width} numbers are needed, {} are given", new.len())));
    };
    if let Some(x) = front.iter().find(|x| !x.is_finite()) {
        return Err(Error::Refused(format!("{x} is no finite number")));
    }
    match id {
        id::POSITION => {
            let new = front.as_chunks::<3>().0;
            state.feet.iter_mut().zip(new).for_each(|(foot, new)| foot.target.position = *new);
        }
        id::ORIENTATION => {
            let new = front.as_chunks::<4>().0;
            let unit: Option<Vec<[f64; 4]>> = new.iter().map(|q| normalised(*q)).collect();
            let unit =
                unit.ok_or_else(|| Error::Refused("a quaternion of length 0 is no orientation".into()))?;
            state.feet.iter_mut().zip(unit).for_each(|(foot, new)| foot.target.orientation = new);
        }
        _ if front[0] < 0.0 => return Err(Error::Refused("a duration is not negative".into())),
        _ => state.duration_s = front[0],
    }
    let (jump, duration) = (state.jump, state.duration_s);
    for foot in state.feet.iter_mut().filter(|f| f.now != f.target) {
        foot.left_s = if jump { 0.0 } else { duration };
        if jump {
            foot.now = foot.target;
        }
    }
    Ok(rest)
}

/// A quaternion of length 1; one that has it already stays as it is, bit by bit.
fn normalised(q: [f64; 4]) -> Option<[f64; 4]> {
    let squares = q.iter().map(|x| x * x).sum::<f64>();
    match (squares > 0.0, (squares - 1.0).abs() < 1e-15) {
        (false, _) => None,
        (_, true) => Some(q),
        _ => Some(q.map(|x| x / squares.sqrt())),
    }
}
