//! Units in C, compiled while they are measured: real libraries behind the interface of FMI 2.0.

use crate::process::{Outcome, command, must, write};
use std::path::{Path, PathBuf};
use terraglue_fmi::export::{Content, pack};

/// What every unit shares. `calc` gives outputs from all values, `step` goes on by h.
const FRAME: &str = r"
#include <math.h>
#include <stdlib.h>
#include <string.h>
typedef struct { double v[128]; } Unit;
static void calc(double *v);
static void step(double *v, double h);
void *fmi2Instantiate(const char *n, int t, const char *g, const char *r, const void *b, int v, int l) {
    Unit *u = calloc(1, sizeof *u); start(u->v); return u; }
void fmi2FreeInstance(Unit *u) { free(u); }
int fmi2SetupExperiment(Unit *u, int a, double b, double c, int d, double e) { return 0; }
int fmi2EnterInitializationMode(Unit *u) { return 0; }
int fmi2ExitInitializationMode(Unit *u) { return 0; }
int fmi2Terminate(Unit *u) { return 0; }
int fmi2GetReal(Unit *u, const unsigned *r, size_t n, double *x) { calc(u->v); for (size_t i = 0; i < n; i++) x[i] = u->v[r[i]]; return 0; }
int fmi2SetReal(Unit *u, const unsigned *r, size_t n, const double *x) { for (size_t i = 0; i < n; i++) u->v[r[i]] = x[i]; return 0; }
int fmi2DoStep(Unit *u, double t, double h, int p) { step(u->v, h); return 0; }
int fmi2GetFMUstate(Unit *u, void **s) { if (!*s) *s = malloc(sizeof *u); memcpy(*s, u, sizeof *u); return 0; }
int fmi2SetFMUstate(Unit *u, void *s) { memcpy(u, s, sizeof *u); return 0; }
int fmi2FreeFMUstate(Unit *u, void **s) { free(*s); *s = 0; return 0; }
";

/// A variable: name, role (`p`arameter, `i`nput, `o`utput) and start value.
pub type Variable<'a> = (&'a str, char, f64);

/// Builds a unit; `calc` and `step` are bodies in C over the values `v` in the order of the variables.
pub fn build(folder: &Path, name: &str, variables: &[Variable], calc: &str, step: &str) -> Outcome<PathBuf> {
    let starts: String = variables.iter().enumerate().map(|(k, v)| format!("v[{k}] = {:?}; ", v.2)).collect();
    let code = format!(
        "static void start(double *v) {{ {starts} }}\n{FRAME}\nstatic void calc(double *v) {{ {calc} }}\n\
         static void step(double *v, double h) {{ {step} }}\n"
    )
    .replacen("static void start", "#include <stddef.h>\nstatic void start", 1);
    let (source, library) = (folder.join(format!("{name}.c")), folder.join(format!("{name}.so")));
    write(&source, &code)?;
    let flags = ["-O2", "-ffp-contract=off", "-shared", "-fPIC", "-w", "-o"];
    must(&mut command("cc", &flags).arg(&library).arg(&source).arg("-lm"))?;
    let unit = folder.join(format!("{name}.fmu"));
    let entries = [
        ("modelDescription.xml".to_owned(), Content::Text(describe(variables))),
        ("binaries/linux64/m.so".to_owned(), Content::File(library)),
    ];
    pack(&unit, &entries)?;
    Ok(unit)
}

fn describe(variables: &[Variable]) -> String {
    let one = |(k, (name, role, start)): (usize, &Variable)| {
        let (causality, real) = match role {
            'p' => ("parameter\" variability=\"tunable", format!("<Real start=\"{start:?}\"/>")),
            'i' => ("input", format!("<Real start=\"{start:?}\"/>")),
            _ => ("output", "<Real/>".to_owned()),
        };
        format!(
            "<ScalarVariable name=\"{name}\" valueReference=\"{k}\" causality=\"{causality}\">{real}</ScalarVariable>"
        )
    };
    let all: String = variables.iter().enumerate().map(one).collect();
    let outputs = variables.iter().enumerate().filter(|(_, v)| v.1 == 'o');
    let outputs: String = outputs.map(|(k, _)| format!("<Unknown index=\"{}\"/>", k + 1)).collect();
    format!(
        "<?xml version=\"1.0\"?><fmiModelDescription fmiVersion=\"2.0\" modelName=\"m\" guid=\"g\"><CoSimulation \
         modelIdentifier=\"m\" canGetAndSetFMUstate=\"true\" canHandleVariableCommunicationStepSize=\"true\"/>\
         <ModelVariables>{all}</ModelVariables><ModelStructure><Outputs>{outputs}</Outputs></ModelStructure>\
         </fmiModelDescription>"
    )
}
