//! Messages about wrong input, as the user sees them: each test reads the rendered text.

use super::*;
use miette::{GraphicalReportHandler, GraphicalTheme};
use serde_json::json;
use std::path::Path;
use terraglue_subsystem::{Kind, Parameter, ParameterType, Schema};

const GOOD: &str = r#"
[time]
step_s = 0.001
duration_s = 2.0
[terrain]
kind = "undulating"
size_m = [6.0, 4.0]
spacing_m = 0.01
[gluing]
strategy = "cooperative"
[robot]
module = "rigid-body"
mass_kg = 5.0
[soil]
module = "soil-bekker"
k_phi = 8.2e5
[soil.soil-cellular-automaton]
curvature_max_per_m = 40.0
[soil.soil-bekker]
unloading_pa_per_m = 3e8
[[connect]]
from = "robot.*.angle"
to = "soil.*.input"
[[event]]
at_s = 1.0
set = { "robot.LF_j2.max_torque" = 0.0, robot.base.blocked = true }
[[event]]
when = "robot.body.z < 0.1"
act = "robot.LF_j2.break"
"#;

fn parse(text: &str) -> Result<Scenario, Box<InputError>> {
    Scenario::parse(text, "scenarios/walk.toml", &[])
}

fn rendered(error: &InputError) -> String {
    let mut text = String::new();
    let handler = GraphicalReportHandler::new_themed(GraphicalTheme::none()).with_width(200);
    handler.render_report(&mut text, error).expect("renders");
    text
}

/// The message after one replacement in the good scenario, or after edits.
fn message(from: &str, to: &str, sets: &[(&str, &str)]) -> String {
    assert!(GOOD.contains(from));
    let sets: Vec<_> = sets.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect();
    let error =
        Scenario::parse(&GOOD.replacen(from, to, 1), "scenarios/walk.toml", &sets).expect_err("is wrong");
    rendered(&error)
}

fn assert_holds(text: &str, parts: &[&str]) {
    for part in parts {
        assert!(text.contains(part), "`{part}` is not in:\n{text}");
    }
}

#[test]
fn a_good_scenario_is_read() {
    let s = parse(GOOD).expect("good");
    assert_eq!((s.name.as_str(), s.time.step_s, s.world.seed), ("walk", 0.001, 1));
    assert_eq!(s.subsystems.iter().map(|s| s.name.as_str()).collect::<Vec<_>>(), ["robot", "soil"]);
    let soil = &s.subsystems[1];
    assert_eq!(soil.parameters["unloading_pa_per_m"], json!(3e8), "the module's own table is flattened");
    assert_eq!(s.events[0].set[0], ("robot.LF_j2.max_torque".into(), json!(0.0)));
    assert_eq!(s.events[0].set[1], ("robot.base.blocked".into(), json!(true)));
    let Trigger::When { variable, comparison, value } = &s.events[1].trigger else { panic!("when") };
    assert_eq!((variable.as_str(), *comparison, *value), ("robot.body.z", Comparison::Less, 0.1));
    let error = s.source.error_in(s.connections[0].entry, &[], "whole", None);
    let span = error.span.expect("a place");
    let lines = GOOD[span.offset()..span.offset() + span.len()].lines().count();
    assert_eq!(lines, 3, "header and two keys");
}

#[test]
fn a_missing_or_empty_scenario_is_named() {
    let error = Scenario::load(Path::new("nowhere/walk.toml"), &[]).expect_err("missing");
    assert_holds(&rendered(&error), &["cannot read the scenario `nowhere/walk.toml`"]);
    assert_holds(
        &rendered(&parse(" \n").expect_err("empty")),
        &["the scenario `scenarios/walk.toml` is empty"],
    );
    let folder = Scenario::load(Path::new("src"), &[]).expect_err("a folder");
    assert_holds(&rendered(&folder), &["cannot read the scenario `src`"]);
}

#[test]
fn a_typo_in_a_key_shows_line_and_nearest_name() {
    let text = message("spacing_m", "spacin_m", &[]);
    assert_holds(
        &text,
        &[
            "unknown key `spacin_m` in `terrain`",
            "scenarios/walk.toml:8:1",
            "spacin_m = 0.01",
            "did you mean `spacing_m`?",
        ],
    );
    let text = message("[gluing]", "[glueing]", &[]);
    assert_holds(&text, &["unknown table `[glueing]`", "did you mean `gluing`?", ":9:"]);
    assert_holds(
        &message("[[event]]", "[[events]]", &[]),
        &["unknown table `[[events]]`", "did you mean `event`?"],
    );
}

#[test]
fn wrong_types_and_ranges_show_what_is_allowed() {
    let text = message("spacing_m = 0.01", "spacing_m = -0.01", &[]);
    assert_holds(
        &text,
        &["`spacing_m` = -0.01 is out of range: it takes a number greater than 0 m", ":8:13"],
    );
    let text = message("spacing_m = 0.01", "spacing_m = \"fine\"", &[]);
    assert_holds(&text, &["`spacing_m` takes a number greater than 0 m, not the text \"fine\""]);
    assert_holds(&message("step_s = 0.001", "step_s = 0", &[]), &["`step_s` = 0 is out of range"]);
    assert_holds(&message("step_s = 0.001", "step_s = nan", &[]), &["not nan or inf"]);
    assert_holds(&message("[6.0, 4.0]", "[6.0]", &[]), &["`size_m` takes a list of 2 numbers"]);
    assert_holds(
        &message("duration_s = 2.0", "duration_s = 2.0005", &[]),
        &["no multiple of `step_s`", "e.g. 2"],
    );
    let text = message("duration_s = 2.0", "duration_s = 0.0185", &[]);
    assert!(text.contains("e.g. 0.018") && !text.contains("0.0180"), "{text}");
    assert_holds(&message("duration_s = 2.0\n", "", &[]), &["`time` lacks `duration_s`"]);
    assert_holds(
        &message("kind = \"undulating\"", "kind = \"undulating\"\nangle_rad = 1.0", &[]),
        &["does not belong to kind `undulating`"],
    );
    assert_holds(
        &message("kind = \"undulating\"", "kind = \"geotiff\"\nfile = \"a.tif\"", &[]),
        &["no file `a.tif`"],
    );
}

#[test]
fn unknown_strategies_and_subsystems_are_answered_with_the_valid_ones() {
    let text = message("\"cooperative\"", "\"coperative\"", &[]);
    assert_holds(
        &text,
        &["unknown strategy `coperative`", "did you mean `cooperative`?", "`iterative`", ":10:12"],
    );
    assert_holds(
        &message("from = \"robot", "from = \"robt", &[]),
        &["no subsystem `robt`", "did you mean `robot`?", ":22:8"],
    );
    assert_holds(
        &message("\"robot.LF_j2.max_torque\"", "\"robo.LF_j2.max_torque\"", &[]),
        &["no subsystem `robo`", ":26:"],
    );
}

#[test]
fn events_need_a_time_and_something_to_do() {
    assert_holds(&message("at_s = 1.0\n", "", &[]), &["it needs `at_s` or `when`"]);
    assert_holds(&message("act = \"robot.LF_j2.break\"\n", "", &[]), &["an event that does nothing"]);
    assert_holds(&message("z < 0.1", "z 0.1", &[]), &["`robot.body.z 0.1` is no comparison"]);
    assert_holds(&message("z < 0.1", "z < low", &[]), &["`low` in `robot.body.z < low` is no number"]);
}

#[test]
fn edits_are_checked_like_the_file_and_shown_as_written() {
    let text = message("[time]", "[time]", &[("terrain.spacin_m", "0.02")]);
    assert_holds(
        &text,
        &["unknown key `spacin_m`", "--set:1:1", "terrain.spacin_m=0.02", "did you mean `spacing_m`?"],
    );
    let text = message("[time]", "[time]", &[("gluing.strategy", "iteratve")]);
    assert_holds(&text, &["unknown strategy `iteratve`", "--set:1:17"]);
    assert_holds(
        &message("[time]", "[time]", &[("tim.step_s", "0.1")]),
        &["unknown table `[tim]`", "did you mean `time`?"],
    );
    assert_holds(&message("[time]", "[time]", &[("a..b", "1")]), &["is no key path"]);
}

#[test]
fn edits_take_bare_words_and_reach_into_events() {
    let sets = [("soil.module", "soil-cellular-automaton"), ("event.0.at_s", "0.5"), ("robot.drive.k", "3")];
    let sets: Vec<_> = sets.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect();
    let s = Scenario::parse(GOOD, "walk.toml", &sets).expect("good");
    assert_eq!(s.subsystems[1].module, "soil-cellular-automaton");
    assert_eq!(s.subsystems[1].parameters["curvature_max_per_m"], json!(40.0));
    assert_eq!(s.events[0].trigger, Trigger::At(0.5));
    let again = Scenario::parse(&s.source.text, "walk.toml", &[]).expect("the edited text is a scenario");
    assert_eq!((again.subsystems, again.events[0].trigger.clone()), (s.subsystems, Trigger::At(0.5)));
}

fn schema() -> Schema {
    let parameters = vec![
        Parameter::number("mass_kg", "kg", 1.0, "mass").positive(),
        Parameter::of("model", ParameterType::Path, "robot file").optional(),
        Parameter::of("drive.mode", ParameterType::Text, "drive")
            .or("position")
            .choices(&["position", "torque"]),
        Parameter::of("initial.*", ParameterType::Number, "initial values").optional(),
        Parameter::of("n", ParameterType::Number, "exponent").optional(),
    ];
    Schema { name: "rigid-body".into(), kind: Kind::Robot, help: String::new(), parameters }
}

fn checked(robot: &str) -> Result<terraglue_subsystem::Config, String> {
    let s = parse(&GOOD.replacen("mass_kg = 5.0", robot, 1)).expect("parses");
    check_parameters(&schema(), &s.subsystems[0], &s.source).map_err(|e| rendered(&e))
}

#[test]
fn parameters_of_a_module_are_checked_against_its_schema() {
    let config =
        checked("mass_kg = 5\n[robot.initial]\nLF_j1 = 0.1\n[robot.soil-bekker]\nk = 1\n").expect("good");
    assert_eq!(config.number("mass_kg"), Ok(5.0));
    assert_eq!(config.number("initial.LF_j1"), Ok(0.1));
    assert_eq!(config.text("drive.mode"), Ok("position"), "default");
    assert_holds(
        &checked("mas_kg = 5.0").expect_err("typo"),
        &["unknown key `mas_kg` in `[robot]`", "did you mean `mass_kg`?", ":13:1"],
    );
    assert_holds(
        &checked("mass_kg = -5.0").expect_err("range"),
        &["`mass_kg` = -5.0 is out of range", "greater than 0 kg", ":13:11"],
    );
    assert_holds(
        &checked("drive.mode = \"speed\"").expect_err("choice"),
        &["unknown mode `speed`", ":13:14"],
    );
    assert_holds(&checked("model = \"a.urdf\"").expect_err("path"), &["no file `a.urdf`"]);
    assert_holds(&checked("[robot.drve]\nk = 1").expect_err("table"), &["unknown key `drve`"]);
}

#[test]
fn a_module_named_by_its_path_has_a_sub_table_too() {
    let text = GOOD.replacen("\"rigid-body\"", "\"../my/libbody.so\"", 1);
    let robot = |own: &str| parse(&text.replacen("mass_kg = 5.0", own, 1)).expect("parses");
    let s = robot("[robot.rigid-body]\nmass_kg = 7.0");
    let config = check_parameters(&schema(), &s.subsystems[0], &s.source).expect("good");
    assert_eq!(config.number("mass_kg"), Ok(7.0));
    let s = robot("[robot.rigid-body]\nmas_kg = 7.0");
    let error = check_parameters(&schema(), &s.subsystems[0], &s.source).expect_err("typo");
    assert_holds(&rendered(&error), &["unknown key `mas_kg`", ":14:1"]);
}

#[test]
fn keys_that_the_strategy_does_not_read_are_said() {
    let said = |keys: &str| {
        let text =
            format!("{GOOD}\n[gluing]\n{keys}\n").replacen("[gluing]\nstrategy = \"cooperative\"\n", "", 1);
        advice::unread_keys(&parse(&text).expect("parses"))
    };
    for good in [
        "strategy = \"iterative\"\nform = \"tt\"\nstart = \"zero\"\njacobian = \"broyden\"",
        "strategy = \"relaxed\"\nrelaxation = \"aitken\"",
        "strategy = \"semi-implicit\"\nlevel = \"velocity\"\nstabilisation = 0.2",
    ] {
        assert_eq!(said(good), Vec::<String>::new());
    }
    let one = said("strategy = \"iterative\"\nrelaxation = \"aitken\"");
    assert_holds(&one[0], &["`relaxation` has no effect", "`iterative` does not read it (relaxed does)"]);
    let level = said("strategy = \"monolithic\"\nlevel = \"velocity\"");
    assert_holds(&level[0], &["`level` has no effect", "iterative, semi-implicit does"]);
    assert_holds(
        &said("strategy = \"iterative\"\nstabilisation = 0.2")[0],
        &["at position level nothing drifts"],
    );
    assert_holds(&said("step_min_s = 1e-4")[0], &["without `energy_residual_j`"]);
}

#[test]
fn what_has_no_effect_is_said() {
    let good = parse(GOOD).expect("parses");
    assert!(advice::late_events(&good).is_empty());
    let late = parse(&GOOD.replacen("at_s = 1.0", "at_s = 2.5", 1)).expect("parses");
    let said = advice::late_events(&late);
    assert_eq!(said.len(), 1);
    assert_holds(&said[0], &["scenarios/walk.toml:24: ", "2.5 s never happens", "ends at 2 s"]);
    let other = Schema {
        name: "soil-cellular-automaton".into(),
        parameters: vec![Parameter::number("curvature_max_per_m", "1/m", 40.0, "curvature").positive()],
        ..schema()
    };
    let said = |own: &str| {
        let s = parse(&GOOD.replacen("curvature_max_per_m = 40.0", own, 1)).expect("parses");
        advice::unchosen(&other, &s.subsystems[1], &s.source)
    };
    assert_eq!(said("curvature_max_per_m = 30"), None);
    let typo = said("curvature_max = 30").expect("a typo");
    assert_holds(
        &typo,
        &["scenarios/walk.toml:18: ", "unknown key `curvature_max`", "`module = \"soil-bekker\"`"],
    );
    assert_holds(&said("curvature_max_per_m = -1").expect("out of range"), &[":18: ", "curvature_max_per_m"]);
}

#[test]
fn no_damaged_text_makes_the_reader_panic() {
    let text = format!("# é – ü\n{GOOD}");
    let outcome = |damaged: &str| parse(damaged).map_err(|e| rendered(&e)).is_ok();
    let ends = text.char_indices().map(|(i, _)| i);
    let cut = ends.clone().filter(|end| outcome(&text[..*end])).count();
    let dropped = ends.filter(|i| {
        let c = text[*i..].chars().next().map_or(1, char::len_utf8);
        outcome(&format!("{}{}", &text[..*i], &text[i + c..]))
    });
    let dropped = dropped.count();
    assert!(cut > 0 && dropped > 0, "some damage leaves a scenario");
    assert!(cut < text.len() / 2 && dropped < text.len(), "and some does not");
}

#[test]
fn edits_of_anything_to_anything_do_not_panic() {
    let keys = [
        "time",
        "time.step_s",
        "time.step_s.x",
        "event",
        "event.0",
        "event.7.at_s",
        "event.0.set.x.y",
        "soil",
    ];
    let values = ["1", "nan", "\"x\"", "word", "[1, 2", "{ a = 1 }", "[]", "", "-1e400", "2020-01-01"];
    for (key, value) in keys.iter().flat_map(|k| values.map(|v| (*k, v))) {
        let sets = [(key.to_owned(), value.to_owned())];
        if let Err(error) = Scenario::parse(GOOD, "walk.toml", &sets) {
            assert!(!rendered(&error).is_empty());
        }
    }
}

#[test]
fn a_required_parameter_is_asked_for() {
    let mut needs = schema();
    needs.parameters[0] = Parameter::of("mass_kg", ParameterType::Number, "mass");
    let s = parse(&GOOD.replacen("mass_kg = 5.0", "", 1)).expect("parses");
    let error = check_parameters(&needs, &s.subsystems[0], &s.source).expect_err("lacks");
    assert_holds(&rendered(&error), &["`[robot]` lacks `mass_kg`, which module `rigid-body` needs"]);
    assert!(!rendered(&error).contains("terraglue soils"));
    needs.parameters[0] = Parameter::of("k_phi", ParameterType::Number, "modulus");
    let error = check_parameters(&needs, &s.subsystems[0], &s.source).expect_err("lacks");
    assert_holds(&rendered(&error), &["lacks `k_phi`", "terraglue soils"]);
}

#[test]
fn a_soil_row_is_offered_and_refused_rows_say_why() {
    let above = tempfile::tempdir().expect("folder");
    let folder = above.path().join("scenarios");
    let path = folder.join("walk.toml");
    std::fs::create_dir_all(folder.join("models")).expect("made");
    std::fs::create_dir(above.path().join("models")).expect("made");
    std::fs::write(above.path().join("models/soils.csv"), "the table further away is not read")
        .expect("written");
    let table = "name,n,k_c,k_phi,c_pa,phi_rad,K_m,density_kg_m3,source,refused\nmoon,1.0,1400,820000,170,0.61,0.018,,book,\nclay,0.5,13190,692150,4140,0.22,,,book,K_m is a range\n";
    std::fs::write(folder.join("models/soils.csv"), table).expect("written");
    let text = |row: &str| GOOD.replacen("k_phi = 8.2e5", &format!("parameters = \"{row}\""), 1);
    let read = |row: &str| Scenario::parse(&text(row), &path.display().to_string(), &[]);
    let moon = read("moon").expect("good");
    assert_eq!(moon.subsystems[1].offered["k_phi"], json!(820000.0));
    assert!(!moon.subsystems[1].offered.contains_key("density_kg_m3"), "an empty cell offers nothing");
    assert_holds(
        &rendered(&read("mon").expect_err("typo")),
        &["there is no soil `mon`", "did you mean `moon`?"],
    );
    let refused = rendered(&read("clay").expect_err("refused"));
    assert_holds(&refused, &["`clay` cannot be used: K_m is a range"]);
    let given = [("soil.K_m".to_owned(), "0.01".to_owned())];
    let given = Scenario::parse(&text("clay"), &path.display().to_string(), &given);
    assert_eq!(given.expect("the missing number is given").subsystems[1].offered["n"], json!(0.5));
}

#[test]
fn the_json_schema_knows_every_key() {
    let schema = schema::schema();
    for table in keys::tables() {
        for key in &table.keys {
            let below = &schema["properties"][table.name];
            let object = if table.repeated { &below["items"] } else { below };
            assert!(
                object["properties"][&key.parameter.name].is_object(),
                "{}.{}",
                table.name,
                key.parameter.name
            );
        }
    }
}

#[test]
fn names_of_a_law_that_are_not_used_or_hide_the_soils_are_said() {
    let said = |own: &str| {
        let law = format!("[soil.law]\npressure = \"k*z^n\"\nparameters = {{ {own} }}\n");
        let s = parse(&format!("{GOOD}\n{law}")).expect("parses");
        let schema = Schema { parameters: vec![Parameter::number("n", "", 1.0, "exponent")], ..schema() };
        advice::law_parameters(&schema, &s.subsystems[1], &s.source)
    };
    assert_eq!(said("k = \"1e5 N/m^(q+2)\", q = \"1\""), Vec::<String>::new());
    let two = said("k = \"1e5 N/m^(n+2)\", n = \"2\", unused = \"3 kg\"");
    assert_eq!(two.len(), 2, "{two:?}");
    assert_holds(&two[0], &["scenarios/walk.toml:", "`n` hides the `n` of `[soil]`"]);
    assert_holds(&two[1], &["scenarios/walk.toml:", "`unused` has no effect"]);
}
