"""Inputs of an FMU from a table: whole numbers of 64 bits and texts arrive as they are written."""

import csv
import subprocess
import zipfile

from conftest import terraglue

CODE = r"""
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
typedef struct { int64_t i; uint64_t u; double x; char s[64]; } Fmu;
void *fmi3InstantiateCoSimulation(const char *n, const char *t, const char *r, bool v, bool l, bool e, bool a,
    const unsigned *q, size_t k, void *env, void *log, void *up) { return calloc(1, sizeof(Fmu)); }
void fmi3FreeInstance(Fmu *u) { free(u); }
int fmi3EnterInitializationMode(Fmu *u, bool a, double b, double c, bool d, double e) { return 0; }
int fmi3ExitInitializationMode(Fmu *u) { return 0; }
int fmi3Terminate(Fmu *u) { return 0; }
int fmi3GetFloat64(Fmu *u, const unsigned *r, size_t n, double *x, size_t m) { *x = u->x; return 0; }
int fmi3SetFloat64(Fmu *u, const unsigned *r, size_t n, const double *x, size_t m) { u->x = *x; return 0; }
int fmi3GetInt64(Fmu *u, const unsigned *r, size_t n, int64_t *x, size_t m) { *x = u->i; return 0; }
int fmi3SetInt64(Fmu *u, const unsigned *r, size_t n, const int64_t *x, size_t m) { u->i = *x; return 0; }
int fmi3GetUInt64(Fmu *u, const unsigned *r, size_t n, uint64_t *x, size_t m) { *x = u->u; return 0; }
int fmi3SetUInt64(Fmu *u, const unsigned *r, size_t n, const uint64_t *x, size_t m) { u->u = *x; return 0; }
int fmi3GetString(Fmu *u, const unsigned *r, size_t n, const char **x, size_t m) { *x = u->s; return 0; }
int fmi3SetString(Fmu *u, const unsigned *r, size_t n, const char *const *x, size_t m) { strncpy(u->s, *x, 63); return 0; }
int fmi3DoStep(Fmu *u, double t, double h, bool g, bool *e, bool *d, bool *early, double *last) {
    *e = *d = *early = false; *last = t + h; return 0; }
"""

KINDS = {"i": ("Int64", "0"), "u": ("UInt64", "0"), "x": ("Float64", "0"), "s": ("String", None)}


def variables():
    text = ""
    for k, (name, (kind, start)) in enumerate(KINDS.items()):
        own = f'name="{name}_in" valueReference="{k + 1}" causality="input"'
        if start is None:
            text += f'<{kind} {own}><Start value="none"/></{kind}>'
        else:
            text += f'<{kind} {own} start="{start}"/>'
        text += f'<{kind} name="{name}_out" valueReference="{k + 11}" causality="output"/>'
    return text


def test_inputs_arrive_as_they_are_written(tmp_path):
    (tmp_path / "m.c").write_text(CODE)
    subprocess.run(["cc", "-shared", "-fPIC", "-w", "m.c", "-o", "m.so"], cwd=tmp_path, check=True, capture_output=True)
    outputs = "".join(f'<Output valueReference="{k + 11}"/>' for k in range(len(KINDS)))
    with zipfile.ZipFile(tmp_path / "m.fmu", "w") as archive:
        archive.writestr(
            "modelDescription.xml",
            '<?xml version="1.0"?><fmiModelDescription fmiVersion="3.0" modelName="m" instantiationToken="g">'
            '<CoSimulation modelIdentifier="m"/><ModelVariables><Float64 name="time" valueReference="0" '
            f'causality="independent" variability="continuous"/>{variables()}</ModelVariables>'
            f"<ModelStructure>{outputs}</ModelStructure></fmiModelDescription>",
        )
        archive.write(tmp_path / "m.so", "binaries/x86_64-linux/m.so")
    rows = [
        ["time", "i_in", "u_in", "x_in", "s_in"],
        ["0", "9223372036854775807", "18446744073709551615", "1.0", "first, and more"],
        ["0.5", "-9223372036854775807", "9007199254740993", "2.0", "second"],
    ]
    with (tmp_path / "in.csv").open("w") as file:
        csv.writer(file).writerows(rows)
    done = terraglue("fmu", "run", tmp_path / "m.fmu", "--stop", "1", "--step", "0.25", "--input", tmp_path / "in.csv")
    assert done.returncode == 0, done.stderr
    told = list(csv.DictReader(done.stdout.splitlines()))
    for row, t in zip(told[1:], (0.0, 0.25, 0.5, 0.75)):
        wanted = rows[1] if t < 0.5 else rows[2]
        assert [row["i_out"], row["u_out"], row["s_out"]] == [wanted[1], wanted[2], wanted[4]]
        assert float(row["x_out"]) == (1.0 + 2 * t if t < 0.5 else 2.0)
    (tmp_path / "in.csv").write_text("time,i_in\n0,1.5\n")
    done = terraglue("fmu", "run", tmp_path / "m.fmu", "--stop", "1", "--step", "0.25", "--input", tmp_path / "in.csv")
    assert done.returncode == 2 and "i_in" in done.stderr
