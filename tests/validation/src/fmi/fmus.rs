//! FMUs in C, compiled while they are measured: real libraries behind the interface of FMI 2.0.

use crate::process::{Outcome, command, must, write};
use std::path::{Path, PathBuf};
use terraglue_fmi::export::{Compression, Content, pack};

/// Common code of the FMUs. `calc` gives outputs from all values, `step` goes on by h.
const FRAME: &str = r"
#include <math.h>
#include <stdlib.h>
#include <string.h>
typedef struct { double v[128]; } Fmu;
static void calc(double *v);
static void step(double *v, double h);
void *fmi2Instantiate(const char *n, int t, const char *g, const char *r, const void *b, int v, int l) {
    Fmu *u = calloc(1, sizeof *u); start(u->v); return u; }
void fmi2FreeInstance(Fmu *u) { free(u); }
int fmi2SetupExperiment(Fmu *u, int a, double b, double c, int d, double e) { return 0; }
int fmi2EnterInitializationMode(Fmu *u) { return 0; }
int fmi2ExitInitializationMode(Fmu *u) { return 0; }
int fmi2Terminate(Fmu *u) { return 0; }
int fmi2GetReal(Fmu *u, const unsigned *r, size_t n, double *x) { calc(u->v); for (size_t i = 0; i < n; i++) x[i] = u->v[r[i]]; return 0; }
int fmi2SetReal(Fmu *u, const unsigned *r, size_t n, const double *x) { for (size_t i = 0; i < n; i++) u->v[r[i]] = x[i]; return 0; }
int fmi2DoStep(Fmu *u, double t, double h, int p) { step(u->v, h); return 0; }
int fmi2GetFMUstate(Fmu *u, void **s) { if (!*s) *s = malloc(sizeof *u); memcpy(*s, u, sizeof *u); return 0; }
int fmi2SetFMUstate(Fmu *u, void *s) { memcpy(u, s, sizeof *u); return 0; }
int fmi2FreeFMUstate(Fmu *u, void **s) { free(*s); *s = 0; return 0; }
";

/// Functions that no FMU here has a use for; masters that look all of them up need them.
const UNUSED: &str = r#"
const char *fmi2GetTypesPlatform(void) { return "default"; }
const char *fmi2GetVersion(void) { return "2.0"; }
int fmi2SetDebugLogging(Fmu *u, int on, size_t n, const char *const *c) { return 0; }
int fmi2Reset(Fmu *u) { start(u->v); return 0; }
int fmi2GetInteger(Fmu *u, const unsigned *r, size_t n, int *x) { return n ? 3 : 0; }
int fmi2GetBoolean(Fmu *u, const unsigned *r, size_t n, int *x) { return n ? 3 : 0; }
int fmi2GetString(Fmu *u, const unsigned *r, size_t n, const char **x) { return n ? 3 : 0; }
int fmi2SetInteger(Fmu *u, const unsigned *r, size_t n, const int *x) { return n ? 3 : 0; }
int fmi2SetBoolean(Fmu *u, const unsigned *r, size_t n, const int *x) { return n ? 3 : 0; }
int fmi2SetString(Fmu *u, const unsigned *r, size_t n, const char *const *x) { return n ? 3 : 0; }
int fmi2SerializedFMUstateSize(Fmu *u, void *s, size_t *n) { return 3; }
int fmi2SerializeFMUstate(Fmu *u, void *s, char *b, size_t n) { return 3; }
int fmi2DeSerializeFMUstate(Fmu *u, const char *b, size_t n, void **s) { return 3; }
int fmi2SetRealInputDerivatives(Fmu *u, const unsigned *r, size_t n, const int *o, const double *x) { return 3; }
int fmi2CancelStep(Fmu *u) { return 3; }
int fmi2GetStatus(Fmu *u, int k, int *x) { return 3; }
int fmi2GetRealStatus(Fmu *u, int k, double *x) { return 3; }
int fmi2GetIntegerStatus(Fmu *u, int k, int *x) { return 3; }
int fmi2GetBooleanStatus(Fmu *u, int k, int *x) { return 3; }
int fmi2GetStringStatus(Fmu *u, int k, const char **x) { return 3; }
"#;

/// Answer of an FMU without derivatives.
const NO_SLOPE: &str = "int fmi2GetDirectionalDerivative(Fmu *u, const unsigned *z, size_t n, const unsigned *k, size_t m, const double *s, double *x) { return 3; }";

/// Answer of an FMU whose outputs have no derivatives by time.
const NO_RATE: &str = "int fmi2GetRealOutputDerivatives(Fmu *u, const unsigned *r, size_t n, const int *o, double *x) { return 3; }";

/// A variable: name, role (`p`arameter, `i`nput, `o`utput, output of a `s`tate, which no input is seen in at once) and start value.
pub type Variable<'a> = (&'a str, char, f64);

/// Builds an FMU that knows the derivative of its last output by its first input, `slope` in C, and counts in the output
/// before it how often it was evaluated.
pub fn build_with_slope(
    folder: &Path,
    name: &str,
    variables: &[Variable],
    (calc, step): (&str, &str),
    slope: &str,
) -> Outcome<PathBuf> {
    let last = variables.len() - 1;
    let code = format!(
        "{NO_RATE}\nint fmi2GetDirectionalDerivative(Fmu *u, const unsigned *z, size_t n, const unsigned *k, size_t m, const double *s, \
         double *x) {{ double *v = u->v; v[{}] += 1; for (size_t i = 0; i < n; i++) x[i] = z[i] == {last} && k[0] == 0 ? ({slope}) * s[0] : 0; return 0; }}",
        last - 1
    );
    compile(folder, name, variables, calc, step, &code, " providesDirectionalDerivative=\"true\"")
}

/// Builds an FMU; `calc` and `step` are bodies in C over the values `v` in the order of the variables.
pub fn build(folder: &Path, name: &str, variables: &[Variable], calc: &str, step: &str) -> Outcome<PathBuf> {
    compile(folder, name, variables, calc, step, &format!("{NO_SLOPE}\n{NO_RATE}"), "")
}

/// Builds an FMU that tells the first derivative by time of outputs: `rates` gives their numbers and the derivative in C.
pub fn build_with_rates(
    folder: &Path,
    name: &str,
    variables: &[Variable],
    (calc, step): (&str, &str),
    rates: &[(usize, &str)],
) -> Outcome<PathBuf> {
    let cases: String = rates.iter().map(|(k, rate)| format!("case {k}: x[i] = {rate}; break; ")).collect();
    let code = format!(
        "{NO_SLOPE}\nint fmi2GetRealOutputDerivatives(Fmu *u, const unsigned *r, size_t n, const int *o, double *x) {{ \
         double *v = u->v; calc(v); for (size_t i = 0; i < n; i++) switch (r[i]) {{ {cases}default: return 3; }} return 0; }}"
    );
    compile(folder, name, variables, calc, step, &code, " maxOutputDerivativeOrder=\"1\"")
}

fn compile(
    folder: &Path,
    name: &str,
    variables: &[Variable],
    calc: &str,
    step: &str,
    more: &str,
    capabilities: &str,
) -> Outcome<PathBuf> {
    let starts: String = variables.iter().enumerate().map(|(k, v)| format!("v[{k}] = {:?}; ", v.2)).collect();
    let code = format!(
        "static void start(double *v) {{ {starts} }}\n{FRAME}\nstatic void calc(double *v) {{ {calc} }}\n\
         static void step(double *v, double h) {{ {step} }}\n{UNUSED}{more}\n"
    )
    .replacen("static void start", "#include <stddef.h>\nstatic void start", 1);
    let (source, library) = (folder.join(format!("{name}.c")), folder.join(format!("{name}.so")));
    write(&source, &code)?;
    let flags = ["-O2", "-ffp-contract=off", "-shared", "-fPIC", "-w", "-o"];
    must(command("cc", &flags).arg(&library).arg(&source).arg("-lm"))?;
    let fmu = folder.join(format!("{name}.fmu"));
    let entries = [
        ("modelDescription.xml".to_owned(), Content::Text(describe(variables, capabilities))),
        ("binaries/linux64/m.so".to_owned(), Content::File(library)),
    ];
    pack(&fmu, &entries, Compression::Deflate)?;
    Ok(fmu)
}

fn describe(variables: &[Variable], capabilities: &str) -> String {
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
    let output = |(k, (_, role, _)): (usize, &Variable)| match role {
        'o' => Some(format!("<Unknown index=\"{}\"/>", k + 1)),
        's' => Some(format!("<Unknown index=\"{}\" dependencies=\"\"/>", k + 1)),
        _ => None,
    };
    let outputs: String = variables.iter().enumerate().filter_map(output).collect();
    format!(
        "<?xml version=\"1.0\"?><fmiModelDescription fmiVersion=\"2.0\" modelName=\"m\" guid=\"g\"><CoSimulation \
         modelIdentifier=\"m\" canGetAndSetFMUstate=\"true\" canHandleVariableCommunicationStepSize=\"true\"{capabilities}/>\
         <ModelVariables>{all}</ModelVariables><ModelStructure><Outputs>{outputs}</Outputs></ModelStructure>\
         </fmiModelDescription>"
    )
}
