//! The variables of the module; behind the numbers come the inputs that take messages.

use crate::settings::MASKS;
use terraglue_subsystem::{Causality, ValueType, Variable};

pub(crate) const ODOMETRY_X: u32 = 0;
pub(crate) const ODOMETRY_Y: u32 = 1;
pub(crate) const ODOMETRY_YAW: u32 = 2;
pub(crate) const SPEED: u32 = 3;
pub(crate) const TURN_RATE: u32 = 4;
pub(crate) const GNSS_X: u32 = 5;
pub(crate) const GNSS_Y: u32 = 6;
pub(crate) const GNSS_DEVIATION: u32 = 7;
pub(crate) const ROLL: u32 = 8;
pub(crate) const PITCH: u32 = 9;
pub(crate) const MASK: u32 = 10;
pub(crate) const X: u32 = 11;
pub(crate) const Y: u32 = 12;
pub(crate) const YAW: u32 = 13;
pub(crate) const STATUS: u32 = 14;
pub(crate) const IS_KNOWN: u32 = 15;
pub(crate) const BOUND: u32 = 16;
pub(crate) const LONG_AXIS: u32 = 17;
pub(crate) const SHORT_AXIS: u32 = 18;
pub(crate) const AXIS_ANGLE: u32 = 19;
pub(crate) const SCORE: u32 = 20;
pub(crate) const RUNNER_UP: u32 = 21;
pub(crate) const FALSE_MATCHES: u32 = 22;
pub(crate) const MATCHED: u32 = 23;
pub(crate) const TREES: u32 = 24;
pub(crate) const STEMS: u32 = 25;
pub(crate) const OWN_STEMS: u32 = 26;
pub(crate) const HIDDEN: u32 = 27;
pub(crate) const SCANS: u32 = 28;
pub(crate) const REFUSED: u32 = 29;
pub(crate) const ERROR: u32 = 30;
pub(crate) const BEYOND: u32 = 31;
/// Number of those above.
const NUMBERS: u32 = 32;
/// The global map.
pub(crate) const MAP: u32 = NUMBERS;
/// Points of the first scanner.
pub(crate) const POINTS: u32 = NUMBERS + 1;

/// Answers, in the order of [`STATUS`].
pub(crate) const LOCATED: f64 = 0.0;
pub(crate) const AMBIGUOUS: f64 = 1.0;
pub(crate) const LOST: f64 = 2.0;
const ANSWERS: [&str; 3] = ["located", "ambiguous", "lost"];

/// Numbers, flags and choices.
pub(crate) fn numbers() -> Vec<Variable> {
    let mut all = inputs();
    all.extend(pose());
    all.extend(quality());
    all
}

fn inputs() -> Vec<Variable> {
    let input = |id, name, unit, help| Variable::real(id, name, unit, Causality::Input, help);
    let mask = Variable::real(MASK, "mask", "", Causality::Parameter, "How the machine itself is left out");
    vec![
        input(ODOMETRY_X, "odometry_x", "m", "Place along x that the odometry shows"),
        input(ODOMETRY_Y, "odometry_y", "m", "Place along y that the odometry shows"),
        input(ODOMETRY_YAW, "odometry_yaw", "rad", "Direction that the odometry shows"),
        input(SPEED, "speed", "m/s", "Speed along x of the machine, for the motion within a turn"),
        input(TURN_RATE, "turn_rate", "rad/s", "Rate of turning about z, for the same"),
        input(GNSS_X, "gnss_x", "m", "Place along x that GNSS shows, in the frame of the map"),
        input(GNSS_Y, "gnss_y", "m", "Place along y that GNSS shows"),
        input(GNSS_DEVIATION, "gnss_deviation", "m", "Deviation that GNSS claims; 0: it shows nothing")
            .within(0.0, 1e6),
        input(
            ROLL,
            "roll",
            "rad",
            "Roll of the mount, as an inclinometer shows it: scans are turned level by it",
        ),
        input(PITCH, "pitch", "rad", "Pitch of the mount; both are 0 where nothing is connected"),
        mask.named(&MASKS),
    ]
}

fn pose() -> Vec<Variable> {
    let shown = |id, name, unit, help| Variable::real(id, name, unit, Causality::Output, help);
    vec![
        shown(
            X,
            "x",
            "m",
            "Place along x that is believed, in the frame of the map; the last one where it is lost",
        ),
        shown(Y, "y", "m", "Place along y that is believed"),
        shown(YAW, "yaw", "rad", "Direction that is believed"),
        shown(STATUS, "status", "", "Whether it knows where it is").named(&ANSWERS),
        shown(IS_KNOWN, "is_known", "", "Whether there is a pose that is believed").typed(ValueType::Bool),
        shown(
            BOUND,
            "bound",
            "m",
            "The place is right within this distance with 99.7 %; 0: nothing is believed",
        ),
        shown(LONG_AXIS, "long_axis", "m", "Longer half axis of the ellipse of one deviation"),
        shown(SHORT_AXIS, "short_axis", "m", "Shorter half axis of it"),
        shown(AXIS_ANGLE, "axis_angle", "rad", "Direction of the longer axis"),
    ]
}

fn quality() -> Vec<Variable> {
    let shown = |id, name, unit, help| Variable::real(id, name, unit, Causality::Output, help);
    let count = |id, name, help| shown(id, name, "", help).typed(ValueType::U64);
    vec![
        shown(SCORE, "score", "", "How much better the last match explains the trees than chance, nats"),
        shown(RUNNER_UP, "runner_up", "", "Score of the next best pose, nats"),
        shown(FALSE_MATCHES, "false_matches", "", "Matches as good that chance is expected to show"),
        count(MATCHED, "matched", "Trees of the last match that are on the map"),
        count(TREES, "trees", "Trees of the local map"),
        count(STEMS, "stems", "Stems that the last scans showed"),
        count(OWN_STEMS, "own_stems", "Of these, how many stand where the machine itself is"),
        shown(
            HIDDEN,
            "hidden",
            "rad",
            "Sectors that the machine hides from its scanners, the most of any of them",
        ),
        count(SCANS, "scans", "Scans that were read"),
        count(REFUSED, "refused", "Messages that are no point cloud or no map"),
        shown(
            ERROR,
            "error",
            "m",
            "Distance of the pose that is believed from the true one, where that is connected; else 0",
        ),
        count(BEYOND, "beyond", "Scans after which a pose was believed whose error exceeds its bound"),
    ]
}

/// Inputs of messages.
pub(crate) fn messages(scanners: u32) -> Vec<Variable> {
    let input = |id, name: String, help| {
        Variable::real(id, name, "", Causality::Input, help).typed(ValueType::Binary)
    };
    let mut all = vec![input(MAP, "map".into(), "Global map: a table with the columns x, y and dbh_m")];
    let points =
        |k| input(POINTS + k, format!("points_{}", k + 1), "Stream `points` of a scanner on the same body");
    all.extend((0..scanners).map(points));
    all
}
