//! Output of the commands: errors with their place, tables.

use super::shorten;
use comfy_table::{Cell, Color, ContentArrangement, Table, presets};
use miette::{GraphicalReportHandler, GraphicalTheme};
use terraglue_diagnostics::Error;
use terraglue_recording::{Energies, PrintDepth, Summary};
use terraglue_scenario::{InputError, keys};

/// An error with its way out, for a cell of a table.
pub fn in_one_line(error: &Error) -> String {
    match error {
        Error::Input(input) => match &input.help {
            Some(help) => format!("{input}; {help}"),
            None => input.to_string(),
        },
        other => other.to_string(),
    }
}

/// An error on standard error; wrong input with file, line and the offending text.
pub fn error(error: &Error) {
    match error {
        Error::Input(input) => {
            let mut text = String::new();
            let mut theme = GraphicalTheme::default();
            theme.characters.error = "error:".into();
            let mut short = shorten::error(input);
            short.help = short.help.or_else(|| Some(way_out(input)));
            match GraphicalReportHandler::new_themed(theme).render_report(&mut text, &short) {
                Ok(()) => eprint!("{}", text.trim_start()),
                Err(_) => eprintln!("error: {short}"),
            }
        }
        other => {
            eprintln!("error: {}", shorten::text(&other.to_string()));
            let help = other.help().or_else(|| on_the_ground(other));
            help.iter().for_each(|help| eprintln!("  help: {help}"));
        }
    }
}

/// The way out where a body and the ground do not fit.
fn on_the_ground(error: &Error) -> Option<&'static str> {
    let Error::Simulation { message, .. } = error else { return None };
    if message.contains(" is buried: ") {
        return Some(
            "`terraglue soils` lists other soils, `terraglue robot FILE` shows the mass and the shapes of its feet",
        );
    }
    let left = message.contains(" has left the ground: ");
    left.then_some(
        "terrain.size_m is the size of the ground; a shorter run, --duration, ends before its edge",
    )
}

/// Where to read on about a robot file.
pub const ROBOT_FILES: &str = "`terraglue robot FILE` shows what is read of it; docs/rigid-body.md says under \"Robot files\" what a robot needs";

/// Where to look for a file that the system does not give.
pub const PATH: &str = "look whether the path is right, and at the permissions of the file";

/// Numbers of Linux for a lack of room: EFBIG (`ulimit -f`), ENOSPC, EDQUOT.
const FULL: [i32; 3] = [27, 28, 122];

/// How files of robots end, and those of FMUs and their structures.
const ROBOTS: [&str; 4] = [".urdf", ".xacro", ".xml", ".mjcf"];
const FMUS: [&str; 3] = [".fmu", ".ssp", ".ssd"];

/// Where to read on, for an error that has no cure of its own.
fn way_out(error: &InputError) -> String {
    let (message, file) = (error.message.as_str(), error.source_code.name());
    let is_shown = error.span.is_some() && !file.is_empty();
    // a law inside a soil: the innermost number is that of the cause
    let number = message.rfind("[TG").and_then(|at| message[at + 1..].split(']').next());
    if is_shown && names(file, &ROBOTS) || number == Some("TG10") && names(message, &ROBOTS) {
        return ROBOT_FILES.into();
    }
    if let (true, Some("TG02")) = (is_shown, number) {
        return "a path is relative to the folder of the scenario; docs/plugins/errors.md lists more causes of TG02".into();
    }
    if let Some(number) = number {
        return format!("docs/plugins/errors.md lists causes and cures of {number}");
    }
    if is_shown {
        return keys_of(error);
    }
    match () {
        () if message.contains("are free there") => "free some room, or name a path on another disk with -o",
        () if FULL.iter().any(|number| message.contains(&format!("(os error {number})"))) => {
            "free some room there; TMPDIR names another folder for files that are needed for a while"
        }
        () if message.contains("(os error ") => PATH,
        () if message.contains("exists already") => {
            "name another folder with -o, or take that one away first"
        }
        () if message.contains("holds no module") => {
            "build it first (README.md in its folder says how), or name the file itself"
        }
        () if message.contains("which module `") => {
            "give it with --set, as --set soil.parameters=LETE_sand gives all numbers of a soil"
        }
        () if names(message, &FMUS) => "docs/fmi.md lists the supported parts of FMI and SSP",
        () => "`terraglue COMMAND --help` lists the arguments of the command",
    }
    .into()
}

/// Where the keys are listed of the table in which the error is: of a subsystem those of its module.
fn keys_of(error: &InputError) -> String {
    let text = error.source_code.inner();
    let at = error.span.map_or(0, |s| s.offset());
    let end = text.get(at..).and_then(|rest| rest.find('\n')).map_or(text.len(), |n| at + n);
    let head = match error.source_code.name().starts_with("--") {
        true => text,
        false => text[..end].lines().rev().find(|l| l.trim_start().starts_with('[')).unwrap_or_default(),
    };
    let name = head.trim_start_matches(|c: char| c.is_whitespace() || "[\"'".contains(c));
    let name = name.split(|c: char| ".]=\"' \t".contains(c)).next().unwrap_or_default();
    match keys::table(name) {
        Some(_) => format!("docs/scenario.md has the keys of `[{name}]` and what they take"),
        None => "docs/scenario.md has the keys of a scenario and what they take; `terraglue modules NAME` has those of a module".into(),
    }
}

/// Whether a text names a file with one of these endings.
fn names(text: &str, endings: &[&str]) -> bool {
    let text = text.to_ascii_lowercase();
    let mut words = text.split(|c: char| c.is_whitespace() || "`:,;()".contains(c));
    words.any(|word| endings.iter().any(|ending| word.ends_with(ending)))
}

/// A table as wide as the terminal.
pub fn table(headers: &[&str]) -> Table {
    let mut table = Table::new();
    table.load_preset(presets::UTF8_FULL_CONDENSED).set_content_arrangement(ContentArrangement::Dynamic);
    table.set_header(headers.iter().copied());
    table
}

/// The same table without lines between its columns.
pub fn plain(mut table: Table) -> Table {
    table.load_preset(presets::NOTHING);
    table
}

/// A table for people at a terminal; for other programs plain columns, one row to a line.
pub fn listing(headers: &[&str]) -> Table {
    let table = table(headers);
    match table.is_tty() {
        true => table,
        false => plain(table),
    }
}

/// Table with the wall time of each subsystem.
pub fn costs(costs: &[(String, f64)], steps: u64) -> Table {
    let mut t = table(&["subsystem", "wall time", "per step"]);
    for (name, s) in costs {
        t.add_row([name.clone(), format!("{s:.3} s"), format!("{:.2} µs", 1e6 * s / steps.max(1) as f64)]);
    }
    t
}

/// The figures of a run.
pub fn summary(s: &Summary) -> Table {
    let mut t = table(&["figure", "value"]);
    let mut row = |name: &str, value: String| {
        t.add_row([name.to_owned(), value]);
    };
    row("scenario", s.scenario.clone());
    row("gluing", format!("{} ({})", s.strategy, s.gluing.form));
    row("soil", s.soil_module.clone().unwrap_or_else(|| "none".into()));
    row("simulated", format!("{:.3} s in {} steps", s.simulated_s, s.steps));
    row("distance", distance(s));
    row(
        "energy per metre",
        both(s.energy.electrical_energy_j_per_m, s.energy.energy_j_per_m, |e| format!("{e:.1} J/m")),
    );
    row(
        "cost of transport",
        both(s.energy.electrical_cost_of_transport, s.energy.cost_of_transport, |c| format!("{c:.2}")),
    );
    let balance = Cell::new(drift(&s.energy.energies));
    t.add_row([
        Cell::new("energy balance"),
        if s.energy.energies.is_off() { balance.fg(Color::Red) } else { balance },
    ]);
    let mut row = |name: &str, value: String| {
        t.add_row([name.to_owned(), value]);
    };
    row("depth of the prints", s.print_depth.as_ref().map_or_else(none, prints));
    row("peak force", s.motion.peak_force_over_weight.map_or_else(none, |f| format!("{f:.2} × the weight")));
    row(
        "real-time factor",
        format!("{:.2} ({:.2} s of wall time)", s.times.real_time_factor, s.times.wall_s),
    );
    row(
        "height gained",
        s.motion.height_gained_m.map_or_else(none, |h| format!("{} mm{}", signed(1e3 * h, 1), stall(s))),
    );
    row(
        "largest roll, pitch",
        format!("{}, {}", degrees(s.motion.max_roll_rad), degrees(s.motion.max_pitch_rad)),
    );
    row("work of the motors", work(&s.energy.energies));
    if let Some(electrical_j) = s.energy.electrical_energy_j.filter(|e| *e > 0.0) {
        row("electrical energy", format!("{electrical_j:.1} J"));
    }
    gluing(&mut t, s);
    t
}

/// How the subsystems were glued, and the error of the soil's mass.
fn gluing(t: &mut Table, s: &Summary) {
    let mut row = |name: &str, value: String| {
        t.add_row([name.to_owned(), value]);
    };
    row(
        "evaluations of the bodies",
        format!("{:.2} mean, {} at most", s.gluing.evaluations_mean, s.gluing.evaluations_max),
    );
    row("steps not converged", s.gluing.steps_not_converged.map_or_else(not_applicable, |n| n.to_string()));
    row(
        "largest gap",
        s.gluing.max_gap_m.map_or_else(not_applicable, |gap| format!("{} m", scientific(gap, 2))),
    );
    let gap = s.gluing.max_action_reaction_gap_n;
    row(
        "largest action–reaction gap",
        gap.map_or_else(not_applicable, |gap| format!("{} N", scientific(gap, 2))),
    );
    let error = s.gluing.interface_work_error_j;
    row(
        "interface work error",
        error.map_or_else(|| "unknown".into(), |e| format!("{} J", scientific(e, 2))),
    );
    row("error of the soil's mass", s.soil_mass_error_relative.map_or_else(none, |e| scientific(e, 1)));
}

fn not_applicable() -> String {
    "not applicable".into()
}

/// The drift with what it is held against, or why it is unknown.
fn drift(e: &Energies) -> String {
    let Some(drift_j) = e.drift_j else { return format!("unknown: {}", e.why_unknown()) };
    let share =
        e.drift_share().map_or_else(String::new, |s| format!(", {} % {}", fixed(100.0 * s, 2), e.measure()));
    let beyond = if e.is_off() { ": more than 1 %" } else { "" };
    format!("{drift_j:+.2e} J{share}{beyond}")
}

/// Electrical energy where a drive with losses reports it, and the work of the motors.
fn both(electrical: Option<f64>, mechanical: Option<f64>, show: fn(f64) -> String) -> String {
    let part = |value: Option<f64>, what| Some(format!("{} {what}", show(value.filter(|e| *e > 0.0)?)));
    let all = [part(electrical, "electrical"), part(mechanical, "by the work of the motors")];
    let all: Vec<String> = all.into_iter().flatten().collect();
    if all.is_empty() { none() } else { all.join(", ") }
}

fn work(e: &Energies) -> String {
    format!("{} J driving, {} J braking", fixed(e.driving_j, 1), fixed(e.braking_j, 1))
}

/// So many decimals and a power of ten; nothing is `0`.
fn scientific(x: f64, decimals: usize) -> String {
    if x == 0.0 { "0".into() } else { format!("{x:.decimals$e}") }
}

/// So many decimals, without the sign of what they round to 0.
pub fn fixed(x: f64, decimals: usize) -> String {
    let text = format!("{x:.decimals$}");
    match text.strip_prefix('-') {
        Some(rest) if !rest.contains(|c: char| ('1'..='9').contains(&c)) => rest.to_owned(),
        _ => text,
    }
}

/// The same with a sign, except of what rounds to 0.
fn signed(x: f64, decimals: usize) -> String {
    let text = fixed(x, decimals);
    let plus = x > 0.0 && text.contains(|c: char| ('1'..='9').contains(&c));
    if plus { format!("+{text}") } else { text }
}

fn prints(p: &PrintDepth) -> String {
    let [median, low, high] = [p.median_m, p.p10_m, p.p90_m].map(|z| 1e3 * z);
    // two digits for shallow prints, too
    let decimals = if median < 9.95 { if median < 0.995 { 2 } else { 1 } } else { 0 };
    let show = |z: f64| fixed(z, decimals);
    format!(
        "{} mm (median of {}; 10 % to 90 %: {} mm to {} mm)",
        show(median),
        p.count,
        show(low),
        show(high)
    )
}

fn stall(s: &Summary) -> String {
    s.motion.stalled.map_or_else(String::new, |p| {
        format!("; stalled since {:.1} s at x = {} m, y = {} m", p.t_s, fixed(p.x_m, 2), fixed(p.y_m, 2))
    })
}

fn none() -> String {
    "–".into()
}

fn degrees(angle: Option<f64>) -> String {
    angle.map_or_else(none, |a| format!("{}°", fixed(a.to_degrees(), 1)))
}

fn distance(s: &Summary) -> String {
    match (s.motion.distance_m, s.motion.commanded_distance_m) {
        (Some(d), Some(c)) if c.abs() > 1e-9 => {
            let share = fixed(100.0 * d / c, 0);
            format!("{} m of {c:.3} m asked for ({share} %)", fixed(d, 3))
        }
        (Some(d), _) => format!("{} m", fixed(d, 3)),
        _ => none(),
    }
}

#[cfg(test)]
mod tests {
    use terraglue_recording::{PrintDepth, Status, Summary, SummaryObserver};
    use terraglue_scenario::Scenario;

    #[test]
    fn what_rounds_to_zero_has_no_sign() {
        let texts = [(-0.004, 2), (-0.0, 0), (-1.006, 2), (f64::NAN, 1)].map(|(x, n)| super::fixed(x, n));
        assert_eq!(texts, ["0.00", "0", "-1.01", "NaN"]);
        assert_eq!([0.04, -0.04, 0.06, -2.0].map(|x| super::signed(x, 1)), ["0.0", "0.0", "+0.1", "-2.0"]);
    }

    #[test]
    fn shallow_prints_have_two_digits() {
        let of = |median_m: f64| {
            super::prints(&PrintDepth { count: 3, median_m, p10_m: 0.5 * median_m, p90_m: 2.0 * median_m })
        };
        assert_eq!(of(0.0214), "21 mm (median of 3; 10 % to 90 %: 11 mm to 43 mm)");
        assert_eq!(of(0.00142), "1.4 mm (median of 3; 10 % to 90 %: 0.7 mm to 2.8 mm)");
        assert_eq!(of(0.000734), "0.73 mm (median of 3; 10 % to 90 %: 0.37 mm to 1.47 mm)");
    }

    #[test]
    fn the_table_shows_the_energy_balance() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios/plate_sinkage.toml");
        let scenario = Scenario::load(path.as_ref(), &[]).expect("good");
        let mut summary = SummaryObserver::new(&scenario).summary(1.0, 1.0, None, Status::Done);
        (summary.energy.energies.drift_j, summary.energy.energies.turnover_j) = (Some(-0.0125), 5.0);
        summary.energy.energies.by_ports = false;
        let line = |s: &Summary| {
            let table = super::summary(s).to_string();
            table.lines().filter(|l| l.contains("energy balance")).map(str::to_owned).collect::<String>()
        };
        let text = line(&summary);
        assert!(
            text.contains("-1.25e-2 J, -0.25 % of the motors' work") && !text.contains("more than"),
            "{text}"
        );
        summary.energy.energies.turnover_j = 1.0;
        assert!(line(&summary).contains("-1.25 % of the motors' work: more than 1 %"));
        summary.energy.energies.drift_j = None;
        summary.energy.energies.without_book = vec!["soil".into()];
        assert!(line(&summary).contains("unknown: soil keeps no energy ledger"));
    }
}
