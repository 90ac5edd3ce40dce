"""Small units of FMI 2.0 in C, made while the tests run."""

import subprocess
import zipfile

FRAME = r"""
#include <math.h>
#include <stdlib.h>
#include <string.h>
typedef struct { double r[32]; int i[8], b[8]; char text[64]; } Unit;
static const double start[32] = {%(start)s};
void *fmi2Instantiate(const char *n, int t, const char *g, const char *r, const void *b, int v, int l) {
    Unit *u = calloc(1, sizeof *u); memcpy(u->r, start, sizeof start); return u; }
void fmi2FreeInstance(Unit *u) { free(u); }
int fmi2SetupExperiment(Unit *u, int a, double b, double c, int d, double e) { return 0; }
int fmi2EnterInitializationMode(Unit *u) { return 0; }
int fmi2ExitInitializationMode(Unit *u) { return 0; }
int fmi2Terminate(Unit *u) { return 0; }
int fmi2GetReal(Unit *u, const unsigned *r, size_t n, double *x) { while (n--) x[n] = u->r[r[n]]; return 0; }
int fmi2SetReal(Unit *u, const unsigned *r, size_t n, const double *x) { while (n--) u->r[r[n]] = x[n]; return 0; }
int fmi2GetInteger(Unit *u, const unsigned *r, size_t n, int *x) { while (n--) x[n] = u->i[r[n]]; return 0; }
int fmi2SetInteger(Unit *u, const unsigned *r, size_t n, const int *x) { while (n--) u->i[r[n]] = x[n]; return 0; }
int fmi2GetBoolean(Unit *u, const unsigned *r, size_t n, int *x) { while (n--) x[n] = u->b[r[n]]; return 0; }
int fmi2SetBoolean(Unit *u, const unsigned *r, size_t n, const int *x) { while (n--) u->b[r[n]] = x[n]; return 0; }
int fmi2GetString(Unit *u, const unsigned *r, size_t n, const char **x) { while (n--) x[n] = u->text; return 0; }
int fmi2SetString(Unit *u, const unsigned *r, size_t n, const char *const *x) { strncpy(u->text, *x, 63); return 0; }
int fmi2GetFMUstate(Unit *u, void **s) { if (!*s) *s = malloc(sizeof *u); memcpy(*s, u, sizeof *u); return 0; }
int fmi2SetFMUstate(Unit *u, void *s) { memcpy(u, s, sizeof *u); return 0; }
int fmi2FreeFMUstate(Unit *u, void **s) { free(*s); *s = 0; return 0; }
int fmi2DoStep(Unit *u, double t, double h, int p) { double *r = u->r; int *i = u->i, *b = u->b; %(step)s return 0; }
"""


def build(folder, name, reals, step, others="", units="", variable_step=True):
    """The unit `name`.fmu; `reals` are (name, causality, start, unit), `step` is C over r, i and b at t, of length h."""
    starts = ", ".join(repr(float(start)) for _, _, start, _ in reals)
    (folder / f"{name}.c").write_text(FRAME % {"start": starts, "step": step})
    command = ["cc", "-shared", "-fPIC", "-w", f"{name}.c", "-o", f"{name}.so", "-lm"]
    subprocess.run(command, cwd=folder, check=True, capture_output=True)
    text = ""
    for k, (own, causality, start, unit) in enumerate(reals):
        tunable = ' variability="tunable"' if causality == "parameter" else ""
        value = "" if causality == "output" else f' start="{start}"'
        unit = f' unit="{unit}"' if unit else ""
        text += f'<ScalarVariable name="{own}" valueReference="{k}" causality="{causality}"{tunable}>'
        text += f"<Real{value}{unit}/></ScalarVariable>"
    outputs = "".join(f'<Unknown index="{k + 1}"/>' for k, v in enumerate(reals) if v[1] == "output")
    units = f"<UnitDefinitions>{units}</UnitDefinitions>" if units else ""
    variable = str(variable_step).lower()
    description = f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="{name}" guid="g">
<CoSimulation modelIdentifier="m" canGetAndSetFMUstate="true" canHandleVariableCommunicationStepSize="{variable}"/>
{units}<ModelVariables>{text}{others}</ModelVariables>
<ModelStructure><Outputs>{outputs}</Outputs></ModelStructure></fmiModelDescription>"""
    with zipfile.ZipFile(folder / f"{name}.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", description)
        archive.write(folder / f"{name}.so", "binaries/linux64/m.so")
    return folder / f"{name}.fmu"
