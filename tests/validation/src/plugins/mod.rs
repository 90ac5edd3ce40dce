//! Figures of the plugin interface: the checker, its broken modules, its time, and its verdict on our own modules.

mod laws;
mod newcomer;
mod python;
mod reload;
mod speed;

use super::{Context, Figure, Limit, Part};
use crate::process::{Outcome, root};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;
use terraglue::conformance::{Level, Options, Report, check};
use terraglue::scaffold::{Kind, Language, scaffold};
use terraglue::scenario::read_soil_table;
use terraglue::scenario::{COLUMNS, SoilRow};

/// The parts, in the order of the table.
pub const PARTS: [Part; 8] = [
    ("broken", |context| collected(context, broken)),
    ("own", |context| collected(context, own)),
    ("seeds", |context| collected(context, seeds)),
    ("laws", |context| collected(context, laws::figures)),
    ("speed", |context| {
        let mut out = collected(context, speed::slope)?;
        out.extend(timed(context, speed::figures)?);
        Ok(out)
    }),
    ("python", |context| {
        let mut out = collected(context, python::faults)?;
        out.extend(timed(context, python::figures)?);
        Ok(out)
    }),
    ("reload", |context| {
        let mut out = collected(context, reload::same)?;
        out.extend(timed(context, reload::figures)?);
        Ok(out)
    }),
    ("newcomer", |context| timed(context, newcomer::figures)),
];

type Fill = fn(&Context, &mut Vec<Figure>) -> Outcome;

fn collected(context: &Context, fill: Fill) -> Outcome<Vec<Figure>> {
    std::fs::create_dir_all(&context.scratch).map_err(|e| format!("{}: {e}", context.scratch.display()))?;
    let mut out = Vec::new();
    fill(context, &mut out)?;
    Ok(out)
}

fn timed(context: &Context, fill: Fill) -> Outcome<Vec<Figure>> {
    if !context.timing {
        return Ok(Vec::new());
    }
    Ok(collected(context, fill)?.into_iter().map(Figure::timed).collect())
}

fn options(context: &Context) -> Options {
    Options { jobs: 2, ..Options::new(context.program.clone()) }
}

/// A line of tests/modules/broken/defects.tsv: source, test, switches.
type Defect = [String; 3];

fn defects() -> Outcome<Vec<Defect>> {
    let path = root().join("tests/modules/broken/defects.tsv");
    let text = std::fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?;
    let row = |line: &str| {
        let mut cells = line.split('\t').map(str::to_owned);
        Some([cells.next()?, cells.next()?, cells.next()?])
    };
    text.lines().skip(1).map(row).collect::<Option<_>>().ok_or_else(|| "defects.tsv: a short line".into())
}

fn compiled(context: &Context, source: &str, switches: &str) -> Outcome<PathBuf> {
    let folder = context.scratch.join(format!("broken-{source}-{switches}"));
    std::fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let library = folder.join(format!("libbroken_{source}_plugin.so"));
    let mut cc = Command::new("cc");
    cc.args(["-std=gnu11", "-O1", "-w", "-fPIC", "-shared", "-I"])
        .arg(root().join("interfaces/plugin/include"));
    for switch in switches.split(',').filter(|s| !s.is_empty()) {
        cc.arg(if switch == "WITH_FIELD" { "-DWITH_FIELD=1".into() } else { format!("-DBROKEN_{switch}=1") });
    }
    cc.arg(root().join(format!("tests/modules/broken/{source}.c"))).arg("-o").arg(&library);
    let done = cc.args(["-lm", "-lpthread"]).status().map_err(|e| format!("cannot start `cc`: {e}"))?;
    if done.success() { Ok(library) } else { Err(format!("{source} does not compile with {switches}")) }
}

fn report(context: &Context, library: &Path, change: impl Fn(&mut Options)) -> Outcome<Report> {
    let mut options = options(context);
    change(&mut options);
    check(library, &options)
}

/// How many broken modules are caught by the test meant for them; a fifth of them when short.
fn broken(context: &Context, out: &mut Vec<Figure>) -> Outcome {
    let all = defects()?;
    let (mut tried, mut caught) = (0u32, 0u32);
    for [source, test, switches] in all.iter().step_by(if context.quick { 5 } else { 1 }) {
        let library = compiled(context, source, switches)?;
        let found = report(context, &library, |o| {
            o.only = vec![test.clone()];
            o.limit_s = if test == "steps" { 3.0 } else { 30.0 };
        })?;
        tried += 1;
        caught += u32::from(found.broken().contains(&test.as_str()));
    }
    let share = f64::from(caught) / f64::from(tried.max(1));
    out.push(Figure::new(
        "plugins.broken.caught",
        share,
        Limit::Equal(1.0),
        "share of the broken modules, each with its one mistake, that the test meant for them catches",
    ));
    let mut alarms = 0;
    for source in ["soil", "robot", "controller", "law"] {
        alarms += report(context, &compiled(context, source, "")?, |_| {})?.broken().len();
    }
    out.push(Figure::new(
        "plugins.twins",
        alarms as f64,
        Limit::Equal(0.0),
        "tests that complain of their clean twins",
    ));
    Ok(())
}

/// Our own modules: findings and duration.
fn own(context: &Context, out: &mut Vec<Figure>) -> Outcome {
    let ball = root().join("tests/models/ball.urdf").display().to_string();
    let deps = context.program.with_file_name("deps");
    for name in ["soil-bekker", "soil-cellular-automaton", "gait", "rigid-body"] {
        let file = format!("lib{}_plugin.so", name.replace('-', "_"));
        let sets = if name == "rigid-body" { vec![("model".to_owned(), ball.clone())] } else { Vec::new() };
        let start = Instant::now();
        let found = report(context, &deps.join(&file), |o| o.sets.clone_from(&sets))?;
        let took = start.elapsed().as_secs_f64();
        let what = format!("tests that {name} fails");
        out.push(Figure::new(
            format!("plugins.own.{name}"),
            found.broken().len() as f64,
            Limit::Equal(0.0),
            what,
        ));
        if context.timing {
            let what = format!("check of {name}, s");
            out.push(Figure::new(format!("plugins.time.{name}"), took, Limit::AtMost(60.0), what).timed());
        }
    }
    if context.timing { times(context, out) } else { Ok(()) }
}

/// How long whoever writes a module waits for its check.
fn times(context: &Context, out: &mut Vec<Figure>) -> Outcome {
    let deps = context.program.with_file_name("deps");
    let own = |name: &str| deps.join(format!("lib{}_plugin.so", name.replace('-', "_")));
    let (soil, law) = (compiled(context, "soil", "")?, compiled(context, "law", "")?);
    let python_soil = fresh(context, Kind::Soil, Language::Python, "my_soil.py")?;
    let python_law = fresh(context, Kind::Law, Language::Python, "my_law.py")?;
    let cases = [
        ("law", "a law in C", &law, Level::Standard),
        ("law-python", "a law in Python", &python_law, Level::Standard),
        ("quick.soil-bekker", "soil-bekker", &own("soil-bekker"), Level::Quick),
        (
            "quick.soil-cellular-automaton",
            "soil-cellular-automaton",
            &own("soil-cellular-automaton"),
            Level::Quick,
        ),
        ("quick", "a soil in C", &soil, Level::Quick),
        ("quick.soil-python", "a soil in Python", &python_soil, Level::Quick),
        ("quick.law-python", "a law in Python", &python_law, Level::Quick),
    ];
    for (id, of, file, level) in cases {
        let start = Instant::now();
        report(context, file, |o| o.level = level)?;
        let took = start.elapsed().as_secs_f64();
        let (prefix, limit) = if level == Level::Quick { ("quick check", 2.0) } else { ("check", 5.0) };
        let what = format!("{prefix} of {of}, s");
        out.push(Figure::new(format!("plugins.time.{id}"), took, Limit::AtMost(limit), what).timed());
    }
    Ok(())
}

/// The tests that draw numbers; all others do the same under every seed.
const DRAWN: [&str; 5] = ["any-order", "passive", "slots", "serialize-garbage", "law-cycles"];

/// A new module, built; its file. Rust and Python where there is time.
fn fresh(context: &Context, kind: Kind, language: Language, file: &str) -> Outcome<PathBuf> {
    let program = context.program.display().to_string();
    let name = format!("my-{}", kind.word());
    let made = scaffold(kind, language, &name, &program).map_err(|e| e.to_string())?;
    let folder = context.scratch.join(format!("seeds-{}-{}", kind.word(), language.word()));
    drop(std::fs::remove_dir_all(&folder));
    made.write(&folder).map_err(|e| e.to_string())?;
    let built = Command::new("sh").args(["-c", &made.commands[0]]).current_dir(&folder).output();
    let built = built.map_err(|e| e.to_string())?;
    match built.status.success() {
        true => Ok(folder.join(file)),
        false => Err(format!("{name} does not build: {}", String::from_utf8_lossy(&built.stderr))),
    }
}

/// False alarms over many seeds: the tests that draw numbers, on our own modules and on a soil in every language, all of
/// which are right; and the quick tests of our soils with the numbers of every row of the soil table.
fn seeds(context: &Context, out: &mut Vec<Figure>) -> Outcome {
    let deps = context.program.with_file_name("deps");
    let own = |name: &str| deps.join(format!("lib{name}_plugin.so"));
    let mut modules = vec![compiled(context, "soil", "")?, compiled(context, "law", "")?, own("soil_bekker")];
    if !context.quick {
        modules.extend(["soil_cellular_automaton", "gait", "rigid_body"].map(own));
        modules.push(fresh(context, Kind::Soil, Language::C, "libmy_soil_plugin.so")?);
        modules.push(fresh(context, Kind::Soil, Language::Cpp, "libmy_soil_plugin.so")?);
        modules.push(fresh(context, Kind::Soil, Language::Rust, "target/debug/libmy_soil_plugin.so")?);
        modules.push(fresh(context, Kind::Soil, Language::Python, "my_soil.py")?);
    }
    let ball = ("model".to_owned(), root().join("tests/models/ball.urdf").display().to_string());
    let seeds = if context.quick { 3 } else { 100 };
    let (mut alarms, mut told) = (0_u32, Vec::new());
    for seed in 1..=seeds {
        for module in &modules {
            let found = report(context, module, |o| {
                (o.seed, o.only) = (seed, DRAWN.map(str::to_owned).to_vec());
                o.sets =
                    module.ends_with("librigid_body_plugin.so").then(|| ball.clone()).into_iter().collect();
            })?;
            alarms += found.broken().len() as u32;
            told.extend(
                found.broken().iter().map(|test| format!("{test} of {} with seed {seed}", module.display())),
            );
        }
    }
    told.iter().for_each(|alarm| eprintln!("false alarm: {alarm}"));
    let what =
        format!("false alarms of the tests that draw numbers, {} modules, {seeds} seeds", modules.len());
    out.push(Figure::new("plugins.false-alarms", f64::from(alarms), Limit::Equal(0.0), what));
    if !context.quick {
        soil_rows(context, &[own("soil_bekker"), own("soil_cellular_automaton")], out)?;
    }
    Ok(())
}

/// Complaints of the quick tests about our soils with the parameters of every usable soil.
fn soil_rows(context: &Context, soils: &[PathBuf], out: &mut Vec<Figure>) -> Outcome {
    let table = read_soil_table(&root().join("models/soils.csv"))?;
    let (mut alarms, mut count) = (0_u32, 0_u32);
    let whole = |row: &&SoilRow| row.refused.is_none() && row.value("k_phi").is_some();
    for row in table.rows.iter().filter(whole) {
        let given = COLUMNS
            .iter()
            .zip(&row.values)
            .filter_map(|(name, x)| Some(((*name).to_owned(), (*x)?.to_string())));
        // the soil in Bekker's form asks for no density
        let sets: Vec<(String, String)> = given.filter(|(name, _)| name != "density_kg_m3").collect();
        for soil in soils {
            let found = report(context, soil, |o| (o.level, o.sets) = (Level::Quick, sets.clone()))?;
            count += 1;
            alarms += found.broken().len() as u32;
            let file = soil.display();
            found
                .broken()
                .iter()
                .for_each(|test| eprintln!("false alarm: {test} of {file} with {}", row.name));
        }
    }
    let what = format!(
        "false alarms of the quick tests, our soils with every row of the soil table, {count} checks"
    );
    out.push(Figure::new("plugins.false-alarms.rows", f64::from(alarms), Limit::Equal(0.0), what));
    Ok(())
}
