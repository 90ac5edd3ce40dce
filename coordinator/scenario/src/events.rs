//! `[[connect]]`, `[[glue]]`, `[[event]]` and `[[fault]]`.

use super::choices::{ConnectionOrder, Extrapolate, FaultChoice, StrategyKind};
use super::keys::{self, Table};
use super::model::{
    Comparison, Connection, Entry, EventSpec, FaultEnd, FaultKind, FaultSpec, GlueSpec, Trigger,
};
use super::node::{Node, Raw};
use super::section::Section;
use super::source::Source;
use super::subsystems::check_reference;
use serde_json::Value;
use terraglue_diagnostics::InputError;

type Checked<T> = Result<T, Box<InputError>>;

/// All connections in the order of the file.
pub fn connections(source: &Source, names: &[&str]) -> Checked<Vec<Connection>> {
    each(source, "connect", |s, _, entry| {
        for key in ["from", "to"] {
            check_reference(&s.text(key), names).map_err(|c| s.error(key, c.message, c.help))?;
        }
        let [stars_from, stars_to] = ["from", "to"].map(|k| s.text(k).matches('*').count());
        if stars_to > stars_from {
            let message = format!("`to` has {stars_to} `*`, `from` only {stars_from} to fill them");
            return Err(s.error("to", message, None));
        }
        let extrapolate = Extrapolate::named(&s.text("extrapolate")).unwrap_or(Extrapolate::Constant);
        let order = ConnectionOrder::named(&s.text("order")).unwrap_or(ConnectionOrder::Structure);
        if extrapolate != Extrapolate::Constant && order.repeats() {
            let message = format!(
                "`extrapolate = \"{extrapolate}\"` beside `order = \"{order}\"`, which finds the values of the step itself"
            );
            return Err(s.error("extrapolate", message, Some("leave one of them out".into())));
        }
        Ok(Connection {
            extrapolate,
            from: s.text("from"),
            to: s.text("to"),
            factor: s.number("factor"),
            offset: s.number("offset"),
            convert: s.value("convert") != Value::Bool(false),
            order,
            map: table(s)?,
            entry,
        })
    })
}

/// The entries of `map`.
fn table(s: &Section) -> Checked<Vec<(String, Value)>> {
    let entries = s.entry("map").map(Node::entries).unwrap_or_default();
    let one = |(key, node): &(String, Node)| match node.to_json() {
        value if value.is_boolean() || value.is_i64() || value.is_string() => Ok((key.clone(), value)),
        _ => {
            let message =
                format!("`{key}` of `map` becomes true, false, a whole number or the name of an item");
            Err(s.error("map", message, None))
        }
    };
    entries.iter().map(one).collect()
}

const COMPONENTS: [&str; 6] = ["x", "y", "z", "rx", "ry", "rz"];

/// All glue in the order of the file.
pub fn glue(source: &Source, names: &[&str]) -> Checked<Vec<GlueSpec>> {
    each(source, "glue", |s, _, entry| {
        for key in ["side_1", "side_2"] {
            let text = s.text(key);
            if key == "side_1" || text != "world" {
                check_reference(&text, names).map_err(|c| s.error(key, c.message, c.help))?;
            }
        }
        let contact = s.text("kind") == "contact";
        let mu = s.number("mu");
        if s.number("damping_n_s_m") > 0.0 && (contact || s.number("compliance_m_n") == 0.0) {
            let message = "a joint has a damper only next to its spring: give compliance_m_n too".into();
            return Err(s.error("damping_n_s_m", message, None));
        }
        if s.number("ramp_s") > 0.0 && (contact || s.number("compliance_m_n") > 0.0) {
            let message = "`ramp_s` is of joints without compliance".into();
            return Err(s.error("ramp_s", message, Some("leave it out".into())));
        }
        let projects = s.text("close") == "project";
        if projects
            && (contact
                || s.number("compliance_m_n") > 0.0
                || s.number("ramp_s") > 0.0
                || s.entry("at_m").is_some())
        {
            let message = "`close = \"project\"` is of joints without compliance, ramp and `at_m`".into();
            return Err(s.error("close", message, Some("leave it out".into())));
        }
        let normal: [f64; 3] = s.numbers("normal");
        if contact && normal.iter().map(|n| n * n).sum::<f64>() < 1e-12 {
            let message = "a normal of no length points nowhere".into();
            return Err(s.error(
                "normal",
                message,
                Some("from side 2 to side 1, such as [0.0, 0.0, 1.0]".into()),
            ));
        }
        if let Some(key) = ["normal", "mu", "t_max_n"].into_iter().find(|k| !contact && s.entry(k).is_some())
        {
            let help = "leave it out, or give kind = \"contact\"".to_owned();
            return Err(s.error(key, format!("`{key}` is of contacts; this glue is a joint"), Some(help)));
        }
        Ok(GlueSpec {
            sides: [s.text("side_1"), s.text("side_2")],
            contact,
            at_m: s.entry("at_m").map(|_| s.numbers("at_m")),
            mask: if contact { if mu > 0.0 { 7 } else { 1 } } else { mask(s)? },
            turning: s.text("axes") == "body",
            normal,
            compliance: s.number("compliance_m_n"),
            damping: s.number("damping_n_s_m"),
            ramp_s: s.number("ramp_s"),
            projects,
            t_max: s.optional_number("t_max_n").unwrap_or(f64::INFINITY),
            mu,
            strategy: s.optional_text("strategy").and_then(|name| StrategyKind::named(&name)),
            entry,
        })
    })
}

fn mask(s: &Section) -> Checked<u32> {
    let names: Vec<String> = match s.value("components") {
        Value::String(text) => vec![text],
        Value::Array(items) => items.iter().filter_map(|v| v.as_str().map(str::to_owned)).collect(),
        _ => COMPONENTS.map(str::to_owned).to_vec(),
    };
    let mut mask = 0;
    for name in &names {
        let Some(k) = COMPONENTS.iter().position(|c| c == name) else {
            let help = Some(format!("components are {}", COMPONENTS.join(", ")));
            return Err(s.error("components", format!("unknown component `{name}`"), help));
        };
        if mask & 1 << k != 0 {
            let help = Some("leave one of the two out".to_owned());
            return Err(s.error("components", format!("component `{name}` is named twice"), help));
        }
        mask |= 1 << k;
    }
    if mask == 0 { Err(s.error("components", "glue that carries nothing".into(), None)) } else { Ok(mask) }
}

/// All events in the order of the file.
pub fn events(source: &Source, names: &[&str]) -> Checked<Vec<EventSpec>> {
    each(source, "event", |s, node, entry| {
        let trigger = trigger(s, names)?;
        let set = assignments(source, s, names)?;
        let act = actions(s, names)?;
        if set.is_empty() && act.is_empty() {
            let help = Some(
                "give `set = { \"robot.LF_j2.max_torque\" = 0.0 }` or `act = \"robot.LF_j2.break\"`".into(),
            );
            return Err(source.error(&node.at, "an event that does nothing", help));
        }
        Ok(EventSpec { trigger, set, act, entry })
    })
}

/// All faults in the order of the file.
pub fn faults(source: &Source, names: &[&str]) -> Checked<Vec<FaultSpec>> {
    each(source, "fault", |s, _, entry| {
        let variable = s.text("variable");
        check_reference(&variable, names).map_err(|c| s.error("variable", c.message, c.help))?;
        let kind = match FaultChoice::named(&s.text("kind")).unwrap_or(FaultChoice::Freeze) {
            FaultChoice::Override => FaultKind::Override(s.number("value")),
            FaultChoice::Offset => FaultKind::Offset(s.number("value")),
            FaultChoice::Gain => FaultKind::Gain(s.number("value")),
            FaultChoice::Ramp => FaultKind::Ramp(s.number("rate_per_s")),
            FaultChoice::Delay => FaultKind::Delay(s.number("delay_s")),
            FaultChoice::DropOut => FaultKind::DropOut(s.number("probability")),
            FaultChoice::Noise => FaultKind::Noise(s.number("deviation")),
            FaultChoice::Freeze => FaultKind::Freeze,
        };
        let ends = [
            s.optional_number("until_s").map(|t| FaultEnd::At(Trigger::At(t))),
            s.optional_text("until")
                .map(|text| when(s, "until", &text, names))
                .transpose()?
                .map(FaultEnd::At),
            s.optional_number("for_s").map(FaultEnd::After),
        ];
        let mut ends = ends.into_iter().flatten();
        let end = ends.next().unwrap_or(FaultEnd::Never);
        if ends.next().is_some() {
            return Err(s.error("kind", "a fault has one of `until_s`, `until` and `for_s`".into(), None));
        }
        let start = trigger(s, names)?;
        if let (Trigger::At(begin), FaultEnd::At(Trigger::At(end))) = (&start, &end)
            && end <= begin
        {
            let message = format!("the fault ends at {end} s, and begins at {begin} s: it would never act");
            let help = "give an `until_s` after `at_s`, or `for_s`, how long it lasts".to_owned();
            return Err(s.error("until_s", message, Some(help)));
        }
        if let FaultEnd::After(0.0) = end {
            let message = "the fault lasts for 0 s: it would never act".to_owned();
            return Err(s.error(
                "for_s",
                message,
                Some("give how long it lasts, or leave `for_s` out".into()),
            ));
        }
        Ok(FaultSpec { variable, kind, start, end, seed: s.optional_count("seed"), entry })
    })
}

fn each<T>(
    source: &Source,
    name: &'static str,
    read: impl Fn(&Section, &Node, Entry) -> Checked<T>,
) -> Checked<Vec<T>> {
    let (Some(table), Some(node)) = (keys::table(name), source.root.get(name)) else { return Ok(Vec::new()) };
    let Raw::List(items) = &node.value else { return Err(not_repeated(source, &table, node)) };
    let one = |(number, item): (usize, &Node)| {
        read(&Section::check(source, &table, Some(item))?, item, Entry { table: name, number })
    };
    items.iter().enumerate().map(one).collect()
}

fn not_repeated(source: &Source, table: &Table, node: &Node) -> Box<InputError> {
    let message = format!("`{0}` is written `[[{0}]]`, with two brackets", table.name);
    let help = match node.at.set {
        Some(_) => format!(
            "`--set {0}.0.KEY=VALUE` changes the first `[[{0}]]` that the scenario has, `--set {0}=[{{…}}]` gives it others",
            table.name
        ),
        None => table.help.into(),
    };
    source.error(&node.at, message, Some(help))
}

fn trigger(s: &Section, names: &[&str]) -> Checked<Trigger> {
    match (s.optional_number("at_s"), s.optional_text("when")) {
        (Some(at), None) => Ok(Trigger::At(at)),
        (None, Some(text)) => when(s, "when", &text, names),
        (Some(_), Some(_)) => {
            let help = "leave one of the two out";
            Err(s.error("when", "it has `at_s` or `when`, not both".into(), Some(help.into())))
        }
        (None, None) => {
            let help = Some("at_s = 3.0, or when = \"robot.body.z < 0.1\"".into());
            Err(s.error("set", "it needs `at_s` or `when`".into(), help))
        }
    }
}

const OPERATORS: [(&str, Comparison); 6] = [
    ("<=", Comparison::LessEqual),
    (">=", Comparison::GreaterEqual),
    ("==", Comparison::Equal),
    ("!=", Comparison::NotEqual),
    ("<", Comparison::Less),
    (">", Comparison::Greater),
];

fn when(s: &Section, key: &str, text: &str, names: &[&str]) -> Checked<Trigger> {
    let refuse = |what: String| {
        let help = Some("write `subsystem.variable < number`; operators: < <= > >= == !=".into());
        s.error(key, what, help)
    };
    let split = OPERATORS
        .iter()
        .find_map(|(symbol, c)| text.split_once(symbol).map(|(l, r)| (l.trim(), *c, r.trim())));
    let Some((variable, comparison, right)) = split else {
        return Err(refuse(format!("`{text}` is no comparison")));
    };
    let value = match right.parse::<f64>() {
        Ok(x) if x.is_finite() => x,
        _ => match right {
            "true" => 1.0,
            "false" => 0.0,
            _ => return Err(refuse(format!("`{right}` in `{text}` is no number"))),
        },
    };
    check_reference(variable, names).map_err(|c| s.error(key, c.message, c.help))?;
    if variable.contains('*') || variable.contains(char::is_whitespace) {
        return Err(refuse(format!("`{variable}` in `{text}` is no name of one variable")));
    }
    Ok(Trigger::When { variable: variable.into(), comparison, value })
}

fn assignments(source: &Source, s: &Section, names: &[&str]) -> Checked<Vec<(String, Value)>> {
    let mut all = Vec::new();
    if let Some(node) = s.entry("set") {
        flatten(source, "", node, names, &mut all)?;
    }
    Ok(all)
}

/// `{ "robot.a.b" = 1 }` and `{ robot.a.b = 1 }` mean the same.
fn flatten(
    source: &Source,
    prefix: &str,
    node: &Node,
    names: &[&str],
    all: &mut Vec<(String, Value)>,
) -> Checked<()> {
    for (key, entry) in node.entries() {
        let name = if prefix.is_empty() { key.clone() } else { format!("{prefix}.{key}") };
        if entry.is_table() {
            flatten(source, &name, entry, names, all)?;
            continue;
        }
        check_reference(&name, names).map_err(|c| source.error(&entry.key, c.message, c.help))?;
        let value = entry.to_json();
        if value.is_null() {
            return Err(source.error(&entry.at, format!("`{name}` takes a finite value"), None));
        }
        all.push((name, value));
    }
    Ok(())
}

fn actions(s: &Section, names: &[&str]) -> Checked<Vec<String>> {
    let texts = match s.value("act") {
        Value::String(text) => vec![text],
        Value::Array(items) => items.iter().filter_map(|v| v.as_str().map(str::to_owned)).collect(),
        _ => Vec::new(),
    };
    for text in &texts {
        check_reference(text, names).map_err(|c| s.error("act", c.message, c.help))?;
    }
    Ok(texts)
}
