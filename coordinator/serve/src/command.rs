//! Commands of clients to a run. They are taken between two steps; each is answered, or refused with the reason.

use serde_json::Value;
use tokio::sync::oneshot;

/// A command.
#[derive(Clone, Debug, PartialEq)]
pub enum Command {
    /// Goes on.
    Play,
    /// Stands still.
    Pause,
    /// So many steps, then a pause.
    Step(u64),
    /// From the start again.
    Reset,
    /// Times real time; none: as fast as it goes.
    Pace(Option<f64>),
    /// To a time of a recording, s.
    Seek(f64),
    /// Goes on from a time in the past, s.
    Rewind(f64),
    /// Takes the change of a variable back.
    Undo(String),
    /// The scenario with everything that was changed.
    Changes,
    /// Writes a variable.
    Set(String, Value),
    /// Values of variables.
    Get(Vec<String>),
    /// Calls an action.
    Act(String, String),
    /// First hit of a ray: start and direction, world.
    CastRay([f64; 3], [f64; 3]),
    /// External force (N) and moment (N m) on a body, world axes.
    Push {
        /// `subsystem.body`.
        body: String,
        /// At the centre of mass, N.
        force: [f64; 3],
        /// About the centre of mass, N m.
        moment: [f64; 3],
    },
}

/// A command with whoever waits for the answer.
pub struct Request {
    /// The command.
    pub command: Command,
    /// Where the answer goes.
    pub reply: oneshot::Sender<Result<Value, String>>,
}

impl Request {
    /// Answers.
    pub fn answer(self, with: Result<Value, String>) {
        // whoever asked may be gone
        drop(self.reply.send(with));
    }
}

/// Names of the services of every run, beside its actions.
pub const SERVICES: [&str; 10] = [
    "run.play",
    "run.pause",
    "run.step",
    "run.reset",
    "run.pace",
    "run.rewind",
    "run.undo",
    "run.changes",
    "world.cast_ray",
    "body.push",
];
/// Names of the services of a recording.
pub const REPLAY_SERVICES: [&str; 5] = ["run.play", "run.pause", "run.step", "run.pace", "run.seek"];

/// The command of a service call; the reason where the request is not as it should be.
///
/// # Errors
/// A number or text of the request is missing or of another kind.
pub fn of_service(name: &str, request: &[u8]) -> Result<Command, String> {
    let empty = request.iter().all(u8::is_ascii_whitespace);
    let body: Value = match empty {
        true => Value::Null,
        false => {
            serde_json::from_slice(request).map_err(|e| format!("{name}: the request is no JSON: {e}"))?
        }
    };
    let number = |key: &str| {
        let found = body[key].as_f64().filter(|x| x.is_finite());
        found.ok_or_else(|| format!("{name}: `{key}` is to be a number, not {}", body[key]))
    };
    let text = |key: &str| {
        body[key]
            .as_str()
            .map(str::to_owned)
            .ok_or_else(|| format!("{name}: `{key}` is to be text, not {}", body[key]))
    };
    let vector = |key: &str| {
        let all: Option<Vec<f64>> = body[key].as_array().and_then(|a| a.iter().map(Value::as_f64).collect());
        let three =
            all.and_then(|all| <[f64; 3]>::try_from(all).ok()).filter(|v| v.iter().all(|x| x.is_finite()));
        three.ok_or_else(|| format!("{name}: `{key}` is to be three numbers, not {}", body[key]))
    };
    Ok(match name {
        "run.play" => Command::Play,
        "run.pause" => Command::Pause,
        "run.step" if body["steps"].is_null() => Command::Step(1),
        "run.step" => {
            let steps = number("steps")?;
            let whole = steps.fract() == 0.0 && (1.0..=1e9).contains(&steps);
            whole
                .then_some(Command::Step(steps as u64))
                .ok_or_else(|| format!("{name}: `steps` is to be 1 to 1e9, not {steps}"))?
        }
        "run.reset" => Command::Reset,
        "run.pace" if body["factor"].is_null() => Command::Pace(None),
        "run.pace" => {
            let factor = number("factor")?;
            let sensible = (1e-3..=1e3).contains(&factor);
            sensible.then_some(Command::Pace(Some(factor))).ok_or_else(|| {
                format!("{name}: `factor` is to be 0.001 to 1000 times real time, or null for as fast as it goes, not {factor}")
            })?
        }
        "run.seek" => Command::Seek(number("t_s")?),
        "run.rewind" => Command::Rewind(number("t_s")?),
        "run.undo" => Command::Undo(text("id")?),
        "run.changes" => Command::Changes,
        "world.cast_ray" => Command::CastRay(vector("origin")?, vector("direction")?),
        "body.push" => {
            Command::Push { body: text("body")?, force: vector("force")?, moment: vector("moment")? }
        }
        action => {
            let arguments = if body.is_null() { "{}".into() } else { body.to_string() };
            Command::Act(action.to_owned(), arguments)
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn requests_are_read_and_wrong_ones_say_which_key_is_wrong() {
        assert_eq!(of_service("run.step", b"{\"steps\": 3}"), Ok(Command::Step(3)));
        assert_eq!(of_service("run.step", b""), Ok(Command::Step(1)));
        assert_eq!(of_service("run.pace", b"{\"factor\": null}"), Ok(Command::Pace(None)));
        assert_eq!(of_service("robot.lift", b""), Ok(Command::Act("robot.lift".into(), "{}".into())));
        for (name, request, word) in [
            ("run.step", &b"{\"steps\": 0.5}"[..], "`steps`"),
            ("run.step", b"{\"steps\": 1e300}", "`steps`"),
            ("run.pace", b"{\"factor\": -1}", "`factor`"),
            ("run.rewind", b"{\"t_s\": \"now\"}", "`t_s`"),
            ("body.push", b"{\"body\": \"a.b\", \"force\": [1, 2]}", "`force`"),
            ("run.undo", b"{{", "JSON"),
            ("run.undo", b"\xff\xfe", "JSON"),
        ] {
            let reason = of_service(name, request).expect_err(name);
            assert!(reason.contains(word) && reason.contains(name), "{reason}");
        }
    }
}
