//! Features that users of FMUs expect of a master and found broken: time grids of solvers, tolerances, whole arrays, processes apart,
//! defects of descriptions, exports that prove themselves, gaps of glued bodies.

use super::{built, testbed};
use crate::process::{Outcome, command, must, root, write};
use crate::{Context, Figure, Limit};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;
use terraglue_fmi::Fmu;
use terraglue_fmi::export::{Compression, Content, pack};
use terraglue_numerics::extremes::larger;

const SOURCE: &str = "tests/validation/src/fmi/master.c";
const ROWS: u32 = 20_000;
const NONE: Limit = Limit::Equal(0.0);

pub fn figures(place: &Path, context: &Context) -> Outcome<Vec<Figure>> {
    let mut all = vec![own_grid(place, context)?, tolerance(place, context)?];
    all.extend(arrays(place)?);
    all.push(array_of_one(place)?);
    all.push(large_array(place, context)?);
    all.extend(apart(place, context)?);
    all.push(defects(place)?);
    all.push(export(place, context)?);
    all.push(gap(place)?);
    Ok(all)
}

/// An FMU of FMI 3.0 from the C next to this file.
fn three(place: &Path, name: &str, variables: &str, outputs: &str, macros: &[&str]) -> Outcome<PathBuf> {
    let has_grid = macros.iter().any(|m| m.contains("GRID"));
    let grid = if has_grid { " fixedInternalStepSize=\"0.01\"" } else { "" };
    let library = place.join(format!("{name}.so"));
    let mut compile = command("cc", &["-O2", "-shared", "-fPIC", "-w", "-o"]);
    must(compile.arg(&library).arg(root().join(SOURCE)).args(macros).arg("-lm"))?;
    let text = format!(
        "<?xml version=\"1.0\"?><fmiModelDescription fmiVersion=\"3.0\" modelName=\"{name}\" instantiationToken=\"g\">\
         <CoSimulation modelIdentifier=\"m\" canHandleVariableCommunicationStepSize=\"true\"{grid}/><ModelVariables>\
         <Float64 name=\"time\" valueReference=\"0\" causality=\"independent\" variability=\"continuous\"/>{variables}</ModelVariables>\
         <ModelStructure>{outputs}</ModelStructure></fmiModelDescription>"
    );
    packed(place, name, text, "binaries/x86_64-linux/m.so", Some(library))
}

fn packed(place: &Path, name: &str, text: String, at: &str, library: Option<PathBuf>) -> Outcome<PathBuf> {
    let fmu = place.join(format!("{name}.fmu"));
    let mut entries = vec![("modelDescription.xml".to_owned(), Content::Text(text))];
    entries.extend(library.map(|library| (at.to_owned(), Content::File(library))));
    pack(&fmu, &entries, Compression::Deflate)?;
    Ok(fmu)
}

fn run(context: &Context, words: &[&str]) -> Command {
    let mut run = command(&context.program, words);
    run.stdout(Stdio::null()).stderr(Stdio::null());
    run
}

/// The last cell of the last row of a table.
fn last(table: &Path) -> Outcome<Vec<f64>> {
    let text = std::fs::read_to_string(table).map_err(|e| format!("{}: {e}", table.display()))?;
    let row = text.lines().last().ok_or("the table is empty")?;
    Ok(row.split(',').map(|cell| cell.parse().unwrap_or(f64::NAN)).collect())
}

/// `lastSuccessfulTime` on a grid of 10 ms, in steps below it, off it and above it.
fn own_grid(place: &Path, context: &Context) -> Outcome<Figure> {
    let y = "<Float64 name=\"y\" valueReference=\"5\" causality=\"output\"/>";
    let fmu = three(place, "grid", y, "<Output valueReference=\"5\"/>", &["-DGRID=0.01"])?;
    let mut wrong = 0;
    for step in ["0.001", "0.01", "0.015", "0.03", "0.1"] {
        let table = place.join("grid.csv");
        let done = run(context, &["fmu", "run"])
            .arg(&fmu)
            .args(["--stop", "0.9", "--step", step])
            .arg("--csv")
            .arg(&table)
            .status();
        let ended = done.is_ok_and(|s| s.success()) && last(&table)?.iter().all(|x| (x - 0.9).abs() < 1e-9);
        let text = format!("[time]\nstep_s = {step}\nduration_s = 0.9\n[x]\nfmu = \"grid.fmu\"\n");
        let mut testbed = built(place, &text)?;
        let within = testbed.run_until(0.9, &mut []).is_ok()
            && testbed.read("x.y").is_some_and(|y| (y - 0.9).abs() < 1e-9);
        wrong += usize::from(!ended) + usize::from(!within);
    }
    let what = "runs of an FMU that reports the time of a grid of its own that stop or end elsewhere, of 10";
    Ok(Figure::new("fmi.master.own_grid", wrong as f64, NONE, what))
}

/// The tolerance that an FMU is given, alone, in a scenario, and where a key names another one.
fn tolerance(place: &Path, context: &Context) -> Outcome<Figure> {
    let source = place.join("tolerance.c");
    let library = place.join("tolerance.so");
    write(
        &source,
        "#include <stdlib.h>\nvoid *fmi2Instantiate(const char *n, int t, const char *g, const char *r, const void *b, int v, int l) \
         { return calloc(1, 8); }\nvoid fmi2FreeInstance(double *u) { free(u); }\n\
         int fmi2SetupExperiment(double *u, int d, double tolerance, double b, int c, double e) { *u = d ? tolerance : -1; return 0; }\n\
         int fmi2EnterInitializationMode(void *u) { return 0; }\nint fmi2ExitInitializationMode(void *u) { return 0; }\n\
         int fmi2Terminate(void *u) { return 0; }\n\
         int fmi2GetReal(double *u, const unsigned *r, size_t n, double *x) { while (n--) x[n] = *u; return 0; }\n\
         int fmi2SetReal(double *u, const unsigned *r, size_t n, const double *x) { return 0; }\n\
         int fmi2DoStep(void *u, double t, double h, int p) { return 0; }\n",
    )?;
    must(command("cc", &["-shared", "-fPIC", "-w", "-o"]).arg(&library).arg(&source))?;
    let text = "<?xml version=\"1.0\"?><fmiModelDescription fmiVersion=\"2.0\" modelName=\"m\" guid=\"g\"><CoSimulation \
                modelIdentifier=\"m\" canHandleVariableCommunicationStepSize=\"true\"/><DefaultExperiment tolerance=\"1e-5\"/>\
                <ModelVariables><ScalarVariable name=\"y\" valueReference=\"0\" causality=\"output\"><Real/></ScalarVariable>\
                </ModelVariables><ModelStructure><Outputs><Unknown index=\"1\"/></Outputs></ModelStructure></fmiModelDescription>";
    let fmu = packed(place, "tolerance", text.to_owned(), "binaries/linux64/m.so", Some(library))?;
    let table = place.join("tolerance.csv");
    must(run(context, &["fmu", "run", "--stop", "1"]).arg(&fmu).arg("--csv").arg(&table))?;
    let alone = last(&table)?.last().copied().unwrap_or(f64::NAN);
    let within = |key: &str| -> Outcome<f64> {
        let text =
            format!("[time]\nduration_s = 0.001\n[x]\nfmu = \"tolerance.fmu\"\nrollback = false\n{key}");
        Ok(built(place, &text)?.read("x.y").unwrap_or(f64::NAN))
    };
    let off = [(alone, 1e-5), (within("")?, 1e-5), (within("tolerance = 1e-3\n")?, 1e-3)];
    let worst = off.iter().fold(0.0, |worst, (given, wanted)| larger(worst, (given / wanted - 1.0).abs()));
    let what = "tolerance that an FMU is given alone, in a scenario and by a key, against the one of its description and the key, relative";
    Ok(Figure::new("fmi.master.tolerance", worst, NONE, what))
}

/// Arrays of twelve numbers pass in one call.
fn arrays(place: &Path) -> Outcome<[Figure; 2]> {
    let array = |name: &str, reference: u32, causality: &str, start: &str| {
        format!(
            "<Float64 name=\"{name}\" valueReference=\"{reference}\" causality=\"{causality}\"{start}><Dimension start=\"12\"/></Float64>"
        )
    };
    let zeros = format!(" start=\"{}\"", ["0"; 12].join(" "));
    let counts = "<Float64 name=\"sets\" valueReference=\"2\" causality=\"output\"/><Float64 name=\"torn\" valueReference=\"3\" causality=\"output\"/>";
    let sink = array("a", 1, "input", &zeros) + counts;
    three(place, "sink", &sink, "<Output valueReference=\"2\"/><Output valueReference=\"3\"/>", &[])?;
    three(place, "source", &array("b", 4, "output", ""), "<Output valueReference=\"4\"/>", &[])?;
    let steps = 50;
    let text = format!(
        "[time]\nduration_s = {}\n[source]\nfmu = \"source.fmu\"\nrollback = false\n[sink]\nfmu = \"sink.fmu\"\nrollback = false\n\
         [[connect]]\nfrom = \"source.b\"\nto = \"sink.a\"\n",
        0.001 * f64::from(steps)
    );
    let mut testbed = built(place, &text)?;
    let read = |testbed: &terraglue::Testbed, name: &str| testbed.read(name).unwrap_or(f64::NAN);
    let before = read(&testbed, "sink.sets");
    for _ in 0..steps {
        testbed.step().map_err(|e| e.to_string())?;
    }
    let calls = (read(&testbed, "sink.sets") - before) / f64::from(steps);
    let what = "calls per step that set an array of twelve numbers that is connected as a whole";
    Ok([
        Figure::new("fmi.master.array_calls", calls, Limit::AtMost(1.0), what),
        Figure::new(
            "fmi.master.arrays_torn",
            read(&testbed, "sink.torn"),
            NONE,
            "arrays that an FMU saw set in part",
        ),
    ])
}

/// A variable with elements, or a scalar where there is none.
fn numbers(name: &str, reference: u32, causality: &str, count: Option<usize>) -> String {
    let start = match causality {
        "input" => format!(" start=\"{}\"", vec!["0"; count.unwrap_or(1)].join(" ")),
        _ => String::new(),
    };
    let sides = count.map(|n| format!("<Dimension start=\"{n}\"/>")).unwrap_or_default();
    format!(
        "<Float64 name=\"{name}\" valueReference=\"{reference}\" causality=\"{causality}\"{start}>{sides}</Float64>"
    )
}

/// A source and a sink that are connected as wholes.
fn source_and_sink(
    place: &Path,
    name: &str,
    count: usize,
    ends: [Option<usize>; 2],
) -> Outcome<terraglue::Testbed> {
    let [source, sink] = ["source", "sink"].map(|end| format!("{end}_{name}"));
    let macros = format!("-DN={count}");
    let output = "<Output valueReference=\"4\"/>";
    three(place, &source, &numbers("b", 4, "output", ends[0]), output, &[&macros])?;
    three(place, &sink, &numbers("a", 1, "input", ends[1]), "", &[&macros])?;
    built(
        place,
        &format!(
            "[time]\nduration_s = 1.0\n[source]\nfmu = \"{source}.fmu\"\nrollback = false\n[sink]\nfmu = \"{sink}.fmu\"\nrollback = false\n\
             [[connect]]\nfrom = \"source.b\"\nto = \"sink.a\"\n"
        ),
    )
}

/// Arrays of one element and scalars fit each other.
fn array_of_one(place: &Path) -> Outcome<Figure> {
    let mut worst = 0.0;
    let ways = [("one_scalar", [Some(1), None], "sink.a"), ("scalar_one", [None, Some(1)], "sink.a[1]")];
    for (name, ends, input) in ways {
        let mut testbed = source_and_sink(place, name, 1, ends)?;
        for step in 0..10 {
            testbed.step().map_err(|e| e.to_string())?;
            let expected = 0.001 * f64::from(step);
            worst = larger(worst, (testbed.read(input).unwrap_or(f64::NAN) - expected).abs());
        }
    }
    let what = "an array of one element connected to a scalar and the other way: error of the input, s";
    Ok(Figure::new("fmi.master.array_of_one", worst, Limit::AtMost(1e-12), what))
}

/// Cost of a step with an array of 3000 elements that is connected as a whole.
fn large_array(place: &Path, context: &Context) -> Outcome<Figure> {
    const ID: &str = "fmi.master.large_array";
    if !context.timing {
        return Ok(Figure::skipped(ID, "measured with a clock only"));
    }
    let mut cost = Vec::new();
    for (name, count) in [("few", 12), ("many", 3000)] {
        let mut testbed = source_and_sink(place, name, count, [Some(count); 2])?;
        testbed.step().map_err(|e| e.to_string())?;
        let clock = Instant::now();
        for _ in 0..500 {
            testbed.step().map_err(|e| e.to_string())?;
        }
        cost.push(clock.elapsed().as_secs_f64());
    }
    let what = "what a step costs with a connected array of 3000 elements, over one of 12";
    Ok(Figure::new(ID, cost[1] / cost[0], Limit::None, what).timed())
}

/// Rows of a process apart are those of one, and cost little.
fn apart(place: &Path, context: &Context) -> Outcome<[Figure; 2]> {
    let y = "<Float64 name=\"y\" valueReference=\"5\" causality=\"output\"/>";
    let fmu = three(place, "clock", y, "<Output valueReference=\"5\"/>", &[])?;
    let stop = (0.001 * f64::from(ROWS)).to_string();
    let mut tables = Vec::new();
    let mut cost = Vec::new();
    for (name, more) in [("within.csv", &[][..]), ("apart.csv", &["--isolate"][..])] {
        let table = place.join(name);
        let clock = Instant::now();
        let mut own = run(context, &["fmu", "run", "--step", "0.001", "--stop", &stop]);
        must(own.args(more).arg(&fmu).arg("--csv").arg(&table))?;
        cost.push(clock.elapsed().as_secs_f64());
        tables.push(std::fs::read(&table).map_err(|e| e.to_string())?);
    }
    let unlike = f64::from(u8::from(tables[0] != tables[1]));
    let what =
        format!("whether the table of {ROWS} rows of an isolated FMU differs from that of the same process");
    let row = format!("what a row of an isolated FMU costs beyond one of the same process, µs, {ROWS} rows");
    let cost_us = if context.timing { 1e6 * (cost[1] - cost[0]) / f64::from(ROWS) } else { f64::NAN };
    let cost = match context.timing {
        true => Figure::new("fmi.master.isolated_row", cost_us, Limit::AtMost(20.0), row).timed(),
        false => Figure::skipped("fmi.master.isolated_row", "measured with a clock only"),
    };
    Ok([Figure::new("fmi.master.isolated_rows", unlike, NONE, what), cost])
}

/// Descriptions that are wrong in one place each: the words of a variable, and its name.
const DEFECTS: [(&str, &str); 18] = [
    (
        "enumeration",
        "<Enumeration name=\"v\" valueReference=\"1\" causality=\"parameter\" variability=\"fixed\" start=\"1\"/>",
    ),
    (
        "integer",
        "<Int8 name=\"v\" valueReference=\"1\" causality=\"parameter\" variability=\"fixed\" start=\"300\"/>",
    ),
    (
        "bounds",
        "<Float64 name=\"v\" valueReference=\"1\" causality=\"parameter\" variability=\"fixed\" start=\"1\" min=\"2\" max=\"0\"/>",
    ),
    (
        "range",
        "<Float64 name=\"v\" valueReference=\"1\" causality=\"parameter\" variability=\"fixed\" start=\"9\" min=\"0\" max=\"1\"/>",
    ),
    (
        "count",
        "<Float64 name=\"v\" valueReference=\"1\" causality=\"parameter\" variability=\"fixed\" start=\"1 2\"><Dimension start=\"3\"/></Float64>",
    ),
    ("missing", "<Float64 name=\"v\" valueReference=\"1\" causality=\"parameter\" variability=\"fixed\"/>"),
    (
        "unit",
        "<Float64 name=\"v\" valueReference=\"1\" causality=\"parameter\" variability=\"fixed\" start=\"1\" unit=\"furlong\"/>",
    ),
    ("clock", "<Clock name=\"v\" valueReference=\"1\" causality=\"input\"/>"),
    ("unlisted", "<Float64 name=\"v\" valueReference=\"1\" causality=\"output\"/>"),
    (
        "calculated",
        "<Float64 name=\"v\" valueReference=\"1\" causality=\"local\" initial=\"calculated\" start=\"1\"/>",
    ),
    ("clocks", "<Float64 name=\"v\" valueReference=\"1\" causality=\"input\" start=\"0\" clocks=\"55\"/>"),
    ("derivative", "<Float64 name=\"v\" valueReference=\"1\" causality=\"local\" derivative=\"9\"/>"),
    ("limit", "<Int32 name=\"v\" valueReference=\"1\" causality=\"input\" start=\"0\" max=\"99999999999\"/>"),
    ("single", "<Float32 name=\"v\" valueReference=\"1\" causality=\"input\" start=\"1e50\"/>"),
    (
        "role",
        "<Float64 name=\"v\" valueReference=\"1\" causality=\"parameter\" variability=\"continuous\" start=\"1\"/>",
    ),
    ("reinit", "<Float64 name=\"v\" valueReference=\"1\" causality=\"local\" reinit=\"true\"/>"),
    ("nominal", "<Float64 name=\"v\" valueReference=\"1\" causality=\"local\" nominal=\"0\"/>"),
    ("previous", "<Int32 name=\"v\" valueReference=\"1\" causality=\"local\" previous=\"2\"/>"),
];

fn defects(place: &Path) -> Outcome<Figure> {
    let mut silent = Vec::new();
    for (name, variable) in DEFECTS {
        let text = format!(
            "<?xml version=\"1.0\"?>\n<fmiModelDescription fmiVersion=\"3.0\" modelName=\"m\" instantiationToken=\"g\">\n\
             <CoSimulation modelIdentifier=\"m\"/>\n<ModelVariables>\n\
             <Float64 name=\"time\" valueReference=\"0\" causality=\"independent\" variability=\"continuous\"/>\n{variable}\n\
             </ModelVariables>\n<ModelStructure/></fmiModelDescription>"
        );
        let fmu = packed(place, name, text, "", None)?;
        let told = match Fmu::inspect(&fmu) {
            Ok((description, _)) => description.defects().iter().map(ToString::to_string).collect(),
            Err(refused) => vec![refused.to_string()],
        };
        if !told.iter().any(|told: &String| told.contains("line 6") && told.contains("`v`")) {
            silent.push(format!("{name} ({})", told.join("; ")));
        }
    }
    let list = if silent.is_empty() { String::new() } else { format!(": {}", silent.join(", ")) };
    let what = format!(
        "kinds of defects of a description that are not told with line and variable, of {}{list}",
        DEFECTS.len()
    );
    Ok(Figure::new("fmi.master.silent_defects", silent.len() as f64, NONE, what))
}

/// An exported soil against the results that it brings with it.
fn export(place: &Path, context: &Context) -> Outcome<Figure> {
    let fmu = place.join("soil.fmu");
    must(run(context, &["export", "soil-bekker", "--set", "soil.parameters=LETE_sand", "-o"]).arg(&fmu))?;
    let done = run(context, &["fmu", "check", "--run", "--within", "1e-9"])
        .arg(&fmu)
        .status()
        .map_err(|e| e.to_string())?;
    let what = "whether an exported soil is off from the results that it brings with it by more than 1e-9 of their range";
    Ok(Figure::new("fmi.master.export", f64::from(u8::from(!done.success())), NONE, what))
}

/// A gap of 5 cm between glued bodies: refused, closed slowly, or closed by moving one of them.
fn gap(place: &Path) -> Outcome<Figure> {
    let link = "<link name=\"b\"><inertial><mass value=\"1\"/><inertia ixx=\"0.1\" iyy=\"0.1\" izz=\"0.1\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link>";
    write(&place.join("body.urdf"), &format!("<robot name=\"r\">{link}</robot>"))?;
    let text = |more: &str| {
        let robot = |name: &str, x: f64| {
            format!(
                "[{name}]\nmodule = \"rigid-body\"\nmodel = \"body.urdf\"\nposition_m = [{x:?}, 0.0, 0.0]\n"
            )
        };
        format!(
            "[time]\nduration_s = 0.2\n[world]\ngravity_m_s2 = [0.0, 0.0, 0.0]\n{}{}[gluing]\nstrategy = \"iterative\"\n[[glue]]\n\
             side_1 = \"one.b\"\nside_2 = \"two.b\"\ncomponents = [\"x\", \"y\", \"z\"]\n{more}",
            robot("one", 0.0),
            robot("two", 0.05)
        )
    };
    let refused = testbed(place, &text("")).err().is_some_and(|e| e.to_string().contains("0.0500 m apart"));
    let closed = |more: &str| -> Outcome<bool> {
        let mut testbed = built(place, &text(more))?;
        testbed.run_until(0.2, &mut []).map_err(|e| e.to_string())?;
        let at = |name: &str| testbed.read(name).unwrap_or(f64::NAN);
        let speed = at("one.b.vx").abs();
        Ok((at("one.b.x") - at("two.b.x")).abs() < 1e-9 && speed < 1e-9)
    };
    let ways = [refused, closed("close = \"project\"\n")?, closed("ramp_s = 0.1\n")?];
    let wrong = ways.iter().filter(|way| !**way).count();
    let what =
        "ways with a gap of 5 cm between glued bodies (refused, projected, along a ramp) that fail, of 3";
    Ok(Figure::new("fmi.master.gap", wrong as f64, NONE, what))
}
