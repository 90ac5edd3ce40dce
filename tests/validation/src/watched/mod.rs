//! Figures of the page of a run: that watching changes nothing and delays no run, the speed of the past, the cost of the ground, and
//! how the page draws in a real browser. Without a browser or the Python packages of the tests their lines have `skip`.

use crate::process::{Outcome, command, root, target};
use crate::{Context, Figure, Limit, Part};
use Limit::{AtLeast, AtMost, Equal};

const SCRIPT: &str = "tests/validation/src/watched/measure.py";

/// The parts, in the order of the table.
pub const PARTS: [Part; 5] =
    [("untouched", untouched), ("free", free), ("ground", ground), ("past", past), ("browser", browser)];

/// How a figure is held: its name, its limit, and whether a clock or the machine makes it.
type Bar = (&'static str, Limit, fn(Figure) -> Figure);

fn exact(figure: Figure) -> Figure {
    figure
}

/// Three clients that watch, one that stops to read, and noise: the recording keeps its bytes.
fn untouched(context: &Context) -> Outcome<Vec<Figure>> {
    let bars: [Bar; 3] = [
        ("watched_bytes", Equal(0.0), exact),
        ("stopped_bytes", Equal(0.0), exact),
        ("noise_bytes", Equal(0.0), exact),
    ];
    Ok(measure("untouched", context, &bars))
}

/// Memory while the run goes as fast as it can; flat within the reserves of allocators.
fn free(context: &Context) -> Outcome<Vec<Figure>> {
    long(context, "free", &[("memory_mb", AtMost(32.0), Figure::noisy)])
}

/// Ground of 2048² nodes with six feet on it, in real time.
fn ground(context: &Context) -> Outcome<Vec<Figure>> {
    let bars: [Bar; 3] = [
        ("rate_mb_s", AtMost(0.3), Figure::noisy),
        ("age_p95_s", AtMost(0.1), Figure::timed),
        ("pace", AtLeast(0.9), Figure::timed),
    ];
    long(context, "ground", &bars)
}

/// A recording of ten minutes.
fn past(context: &Context) -> Outcome<Vec<Figure>> {
    let bars: [Bar; 2] =
        [("open_s", AtMost(1.0), Figure::timed), ("scrub_p95_s", AtMost(0.3), Figure::timed)];
    long(context, "past", &bars)
}

/// Drawing of the page without a graphics card at 1400 × 900.
fn browser(context: &Context) -> Outcome<Vec<Figure>> {
    let bars: [Bar; 5] = [
        ("frames_per_s", AtLeast(8.0), Figure::timed),
        ("reload_s", AtMost(2.0), Figure::timed),
        ("plots_core", AtMost(0.3), Figure::timed),
        ("ssim_replayed", AtLeast(0.99), exact),
        ("ssim_headless", AtLeast(0.99), exact),
    ];
    long(context, "browser", &bars)
}

/// Figures of the long form with clocks only.
fn long(context: &Context, part: &str, bars: &[Bar]) -> Outcome<Vec<Figure>> {
    if !context.timing || context.quick {
        return Ok(Vec::new());
    }
    Ok(measure(part, context, bars))
}

/// Figures printed by the script: `name<TAB>value<TAB>what`; one that it does not print is skipped with its last words.
fn measure(part: &str, context: &Context, bars: &[Bar]) -> Vec<Figure> {
    let id = |name: &str| format!("page.{part}.{name}");
    let printed = match printed(part, context) {
        Ok(printed) => printed,
        Err(why) => return bars.iter().map(|(name, ..)| Figure::skipped(id(name), &why)).collect(),
    };
    let line = |name: &str| printed.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix('\t'));
    let one = |(name, limit, held): &Bar| match line(name).and_then(|rest| rest.split_once('\t')) {
        Some((value, what)) => match value.parse() {
            Ok(value) => held(Figure::new(id(name), value, *limit, what)),
            Err(_) => Figure::skipped(id(name), what),
        },
        None => held(Figure::new(id(name), f64::NAN, *limit, "was not measured")),
    };
    bars.iter().map(one).collect()
}

/// The lines of the script; why there are none where a program is missing.
fn printed(part: &str, context: &Context) -> Outcome<String> {
    let python = target().join("venv/bin/python");
    if !python.is_file() {
        return Err("needs the Python packages of the tests: `cargo xtask test` installs them".into());
    }
    std::fs::create_dir_all(&context.scratch).map_err(|e| e.to_string())?;
    let script = root().join(SCRIPT).display().to_string();
    let scratch = context.scratch.join(format!("page-{part}")).display().to_string();
    let mut child = command(&python, &[&script, part, &scratch]);
    child.env("TERRAGLUE_BIN", &context.program).env("PYTHONDONTWRITEBYTECODE", "1");
    let output = child.output().map_err(|e| e.to_string())?;
    if !output.status.success() {
        eprint!("{}", String::from_utf8_lossy(&output.stderr));
    }
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}
