"""Small FMUs in C, made while the tests run."""

import subprocess
import zipfile

FRAME = r"""
#include <math.h>
#include <stdlib.h>
#include <string.h>
typedef struct { double r[32], slope[32]; int i[8], b[8]; char text[64]; } Fmu;
static const double start[32] = {%(start)s};
void *fmi2Instantiate(const char *n, int t, const char *g, const char *r, const void *b, int v, int l) {
    Fmu *u = calloc(1, sizeof *u); memcpy(u->r, start, sizeof start); return u; }
void fmi2FreeInstance(Fmu *u) { free(u); }
int fmi2SetupExperiment(Fmu *u, int a, double b, double c, int d, double e) { return 0; }
int fmi2EnterInitializationMode(Fmu *u) { return 0; }
int fmi2ExitInitializationMode(Fmu *u) { return 0; }
int fmi2Terminate(Fmu *u) { return 0; }
int fmi2GetReal(Fmu *u, const unsigned *r, size_t n, double *x) { while (n--) x[n] = u->r[r[n]]; return 0; }
int fmi2SetReal(Fmu *u, const unsigned *r, size_t n, const double *x) { while (n--) u->r[r[n]] = x[n]; return 0; }
int fmi2GetInteger(Fmu *u, const unsigned *r, size_t n, int *x) { while (n--) x[n] = u->i[r[n]]; return 0; }
int fmi2SetInteger(Fmu *u, const unsigned *r, size_t n, const int *x) { while (n--) u->i[r[n]] = x[n]; return 0; }
int fmi2GetBoolean(Fmu *u, const unsigned *r, size_t n, int *x) { while (n--) x[n] = u->b[r[n]]; return 0; }
int fmi2SetBoolean(Fmu *u, const unsigned *r, size_t n, const int *x) { while (n--) u->b[r[n]] = x[n]; return 0; }
int fmi2GetString(Fmu *u, const unsigned *r, size_t n, const char **x) { while (n--) x[n] = u->text; return 0; }
int fmi2SetString(Fmu *u, const unsigned *r, size_t n, const char *const *x) { strncpy(u->text, *x, 63); return 0; }
int fmi2GetFMUstate(Fmu *u, void **s) { if (!*s) *s = malloc(sizeof *u); memcpy(*s, u, sizeof *u); return 0; }
int fmi2SetFMUstate(Fmu *u, void *s) { memcpy(u, s, sizeof *u); return 0; }
int fmi2FreeFMUstate(Fmu *u, void **s) { free(*s); *s = 0; return 0; }
%(more)s
int fmi2DoStep(Fmu *u, double t, double h, int p) { double *r = u->r; int *i = u->i, *b = u->b; %(step)s return 0; }
"""

# the step of a mass of 1 kg, exact under a force that is held: r is force, place and speed
MOTION = "r[1] += h * r[2] + 0.5 * h * h * r[0]; r[2] += h * r[0];"


def build(folder, name, reals, step, others="", units="", variable_step=True, types="", more="", flags="", depends=None, instead=()):
    """The FMU `name`.fmu; `reals` are (name, causality, start, unit), `step` is C over r, i and b at t, of length h; `more` are functions
    of its own, `flags` attributes of <CoSimulation>; `depends` the places of the variables that the outputs depend on, from 1, of all outputs or
    of each by name; none: all of them; `instead`: functions of the frame that `more` replaces."""
    starts = ", ".join(repr(float(start)) for _, _, start, _ in reals)
    frame = FRAME
    for own in instead:
        frame = frame.replace(f"int {own}(", f"static int frame_{own}(")
    (folder / f"{name}.c").write_text(frame % {"start": starts, "step": step, "more": more})
    command = ["cc", "-shared", "-fPIC", "-w", f"{name}.c", "-o", f"{name}.so", "-lm"]
    subprocess.run(command, cwd=folder, check=True, capture_output=True)
    text = ""
    for k, (own, causality, start, unit) in enumerate(reals):
        tunable = ' variability="tunable"' if causality == "parameter" else ""
        value = "" if causality == "output" else f' start="{start}"'
        unit = f' unit="{unit}"' if unit else ""
        text += f'<ScalarVariable name="{own}" valueReference="{k}" causality="{causality}"{tunable}>'
        text += f"<Real{value}{unit}/></ScalarVariable>"
    of = lambda name: depends.get(name) if isinstance(depends, dict) else depends
    known = lambda name: "" if of(name) is None else f' dependencies="{of(name)}"'
    outputs = "".join(f'<Unknown index="{k + 1}"{known(v[0])}/>' for k, v in enumerate(reals) if v[1] == "output")
    units = f"<UnitDefinitions>{units}</UnitDefinitions>" if units else ""
    types = f"<TypeDefinitions>{types}</TypeDefinitions>" if types else ""
    variable = str(variable_step).lower()
    description = f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="{name}" guid="g">
<CoSimulation modelIdentifier="m" canGetAndSetFMUstate="true" canHandleVariableCommunicationStepSize="{variable}" {flags}/>
{units}{types}<ModelVariables>{text}{others}</ModelVariables>
<ModelStructure><Outputs>{outputs}</Outputs></ModelStructure></fmiModelDescription>"""
    with zipfile.ZipFile(folder / f"{name}.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", description)
        archive.write(folder / f"{name}.so", "binaries/linux64/m.so")
    return folder / f"{name}.fmu"


# Variables of FMI 3.0 are arrays of numbers by value reference, `v[r]`; `n` is the structural parameter with reference 1 (up to 5).
FRAME_3 = r"""
#include <math.h>
#include <pthread.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
typedef void Log(void *, int, const char *, const char *);
typedef void Update(void *, double, bool, bool, bool, bool, bool *, double *);
typedef struct { double v[16][64]; unsigned long n; int mode; void *env; Log *log; Update *update; bool early;
    unsigned announced[8]; size_t count; } Fmu;
static size_t size(Fmu *u, unsigned r) { size_t n = u->n; switch (r) { %(sizes)s } return 1; }
static void calc(Fmu *u, double (*v)[64]) { %(calc)s }
static int odd(Fmu *u) { %(odd)s return 0; }
static int no(Fmu *u, const char *text) { u->log(u->env, 3, "logStatusError", text); return 3; }
static void start(Fmu *u) { double (*v)[64] = u->v; %(start)s }
void *fmi3InstantiateCoSimulation(const char *n, const char *t, const char *r, bool v, bool l, bool e, bool a,
    const unsigned *q, size_t k, void *env, Log *log, Update *update) {
    Fmu *u = calloc(1, sizeof *u);
    u->env = env; u->log = log; u->update = update; u->early = a; u->n = %(n)d;
    for (u->count = k; k-- > 0;) if (k < 8) u->announced[k] = q[k];
    start(u); odd(u); return u; }
void fmi3FreeInstance(Fmu *u) { odd(u); free(u); }
#ifndef PLAIN
int fmi3EnterConfigurationMode(Fmu *u) { if (u->mode) return no(u, "too late"); u->mode = 1; return 0; }
int fmi3ExitConfigurationMode(Fmu *u) { if (u->mode != 1) return 3; u->mode = 0; start(u); return 0; }
int fmi3SetUInt64(Fmu *u, const unsigned *r, size_t k, const unsigned long *x, size_t m) {
    if (u->mode != 1 || *r != 1) return no(u, "n is set in configuration mode only");
    if (*x == 4) return no(u, "four is not for me");
    u->n = *x; return 0; }
#endif
int fmi3GetUInt64(Fmu *u, const unsigned *r, size_t k, unsigned long *x, size_t m) { *x = u->n; return 0; }
int fmi3EnterInitializationMode(Fmu *u, bool a, double b, double c, bool d, double e) { u->mode = 2; return 0; }
int fmi3ExitInitializationMode(Fmu *u) { u->mode = 3; return odd(u); }
int fmi3Terminate(Fmu *u) { return odd(u); }
int fmi3GetFloat64(Fmu *u, const unsigned *r, size_t k, double *x, size_t m) {
    if (u->mode < 2) return no(u, "nothing to be read yet");
    odd(u); calc(u, u->v);
    for (size_t i = 0; i < k; i++) { size_t s = size(u, r[i]); memcpy(x, u->v[r[i]], 8 * s); x += s; m -= s; }
    return m ? no(u, "wrong number of values") : 0; }
int fmi3SetFloat64(Fmu *u, const unsigned *r, size_t k, const double *x, size_t m) {
    %(sets)s
    for (size_t i = 0; i < k; i++) { size_t s = size(u, r[i]); memcpy(u->v[r[i]], x, 8 * s); x += s; m -= s; }
    return m ? no(u, "wrong number of values") : 0; }
int fmi3GetFMUState(Fmu *u, void **s) {
#ifdef SAVES_NOTHING
    return 0;
#endif
    if (!*s) *s = malloc(sizeof *u); memcpy(*s, u, sizeof *u); return 0; }
int fmi3SetFMUState(Fmu *u, void *s) { memcpy(u, s, sizeof *u); return 0; }
int fmi3FreeFMUState(Fmu *u, void **s) { free(*s); *s = 0; return 0; }
%(more)s
int fmi3DoStep(Fmu *u, double t, double h, bool g, bool *event, bool *end, bool *early, double *last) {
    size_t n = u->n; double (*v)[64] = u->v; *event = *end = *early = false;
#ifndef SILENT
    *last = t + h;
#endif
    %(step)s return 0; }
"""


def build_3(folder, name, variables, step, start="", more="", flags="", n=0, macros=(), calc="", odd="", others="", sets=""):
    """The FMU `name`.fmu of FMI 3.0; `variables` are (name, causality, start, sides), a side being a number or "n"; the first has the
    reference 2 where there is an `n` (not 0), else 1; `others` are more variables as XML, `sets` is what setting numbers begins
    with."""
    first = 2 if n else 1
    sizes = "".join(f"case {first + k}: return {' * '.join(map(str, v[3]))};" for k, v in enumerate(variables) if v[3])
    code = FRAME_3 % {"sizes": sizes, "start": start, "more": more, "step": step, "n": n, "calc": calc, "odd": odd, "sets": sets}
    (folder / f"{name}.c").write_text(code)
    command = ["cc", "-shared", "-fPIC", "-w", *(f"-D{m}" for m in macros), f"{name}.c", "-o", f"{name}.so", "-lm", "-pthread"]
    subprocess.run(command, cwd=folder, check=True, capture_output=True)
    text = outputs = ""
    if n:
        text += f'<UInt64 name="n" valueReference="1" causality="structuralParameter" start="{n}" min="1" max="5"/>'
    for k, (own, causality, value, sides) in enumerate(variables):
        value = f' start="{value}"' if value else ""
        tunable = ' variability="tunable"' if causality == "parameter" else ""
        between = ' intermediateUpdate="true"' if causality in ("input", "output") and "IntermediateUpdate" in flags else ""
        text += f'<Float64 name="{own}" valueReference="{first + k}" causality="{causality}"{between}{tunable}{value}>'
        text += "".join(f'<Dimension {"valueReference=" if s == "n" else "start="}"{1 if s == "n" else s}"/>' for s in sides)
        text += "</Float64>"
        outputs += f'<Output valueReference="{first + k}"/>' if causality == "output" else ""
    description = f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="{name}" instantiationToken="g">
<CoSimulation modelIdentifier="m" canGetAndSetFMUState="true" canHandleVariableCommunicationStepSize="true" {flags}/>
<ModelVariables><Float64 name="time" valueReference="0" causality="independent" variability="continuous"/>{text}{others}</ModelVariables>
<ModelStructure>{outputs}</ModelStructure></fmiModelDescription>"""
    with zipfile.ZipFile(folder / f"{name}.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", description)
        archive.write(folder / f"{name}.so", "binaries/x86_64-linux/m.so")
    return folder / f"{name}.fmu"


def described(folder, fmu, *replacements):
    """A copy of an FMU with another description."""
    copy = folder / "described.fmu"
    with zipfile.ZipFile(fmu) as old, zipfile.ZipFile(copy, "w") as new:
        for name in old.namelist():
            data = old.read(name)
            if name == "modelDescription.xml":
                for before, after in replacements:
                    assert before.encode() in data, before
                    data = data.replace(before.encode(), after.encode(), 1)
            new.writestr(name, data)
    return copy
