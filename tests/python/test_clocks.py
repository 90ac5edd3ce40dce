"""Event mode of FMI 3: periodic input clocks tick at their times, events inside a step are handled and marked."""

import csv
import subprocess
import zipfile

import pytest

from conftest import terraglue

# `x` is the time; every tick samples it and counts; at t = 0.62 the unit asks for event mode by itself, and counts that.
CODE = r"""
#include <stdbool.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
typedef struct { double v[8], t; bool due, events, asked; } Unit;
enum { X = 1, SAMPLE, COUNT, EVENTS };
void *fmi3InstantiateCoSimulation(const char *n, const char *t, const char *r, bool v, bool l, bool e, bool a,
    const unsigned *q, size_t k, void *env, void *log, void *up) {
    Unit *u = calloc(1, sizeof(Unit)); u->events = e; return u; }
void fmi3FreeInstance(Unit *u) { free(u); }
int fmi3EnterInitializationMode(Unit *u, bool a, double b, double c, bool d, double e) { return 0; }
int fmi3ExitInitializationMode(Unit *u) { return 0; }
int fmi3EnterEventMode(Unit *u) { return 0; }
int fmi3EnterStepMode(Unit *u) { return 0; }
int fmi3Terminate(Unit *u) { return 0; }
int fmi3GetFloat64(Unit *u, const unsigned *r, size_t n, double *x, size_t m) { while (n--) x[n] = u->v[r[n]]; return 0; }
int fmi3SetFloat64(Unit *u, const unsigned *r, size_t n, const double *x, size_t m) { return 0; }
int fmi3SetClock(Unit *u, const unsigned *r, size_t n, const bool *on) { u->due = r[0] == 9 && on[0]; return n == 1 ? 0 : 3; }
int fmi3UpdateDiscreteStates(Unit *u, bool *again, bool *end, bool *nominals, bool *values, bool *defined, double *next) {
    *again = *end = *nominals = *values = *defined = false;
    if (u->due) { u->v[SAMPLE] = u->t; u->v[COUNT] += 1; u->due = false; }
    if (u->asked) { u->v[EVENTS] += 1; u->asked = false; }
    return 0; }
int fmi3DoStep(Unit *u, double t, double h, bool g, bool *e, bool *d, bool *early, double *last) {
    *e = *d = *early = false;
    if (!(h > 1e-9)) return 3;
    u->t = t + h;
    if (u->events && t < 0.62 - 1e-9 && t + h > 0.62 + 1e-9) { u->t = 0.62; u->asked = *e = *early = true; }
    u->v[X] = *last = u->t; return 0; }
"""


@pytest.fixture(scope="session")
def clocked(tmp_path_factory):
    folder = tmp_path_factory.mktemp("clocked")
    (folder / "m.c").write_text(CODE)
    subprocess.run(["cc", "-shared", "-fPIC", "-w", "m.c", "-o", "m.so"], cwd=folder, check=True, capture_output=True)
    names = ("x", "sample", "count", "events_seen")
    variables = "".join(f'<Float64 name="{n}" valueReference="{k + 1}" causality="output"/>' for k, n in enumerate(names))
    outputs = "".join(f'<Output valueReference="{k + 1}"/>' for k in range(len(names)))
    with zipfile.ZipFile(folder / "m.fmu", "w") as archive:
        archive.writestr(
            "modelDescription.xml",
            '<?xml version="1.0"?><fmiModelDescription fmiVersion="3.0" modelName="m" instantiationToken="g">'
            '<CoSimulation modelIdentifier="m" hasEventMode="true" canHandleVariableCommunicationStepSize="true" '
            'mightReturnEarlyFromDoStep="true"/><ModelVariables><Float64 name="time" valueReference="0" '
            f'causality="independent" variability="continuous"/>{variables}<Clock name="c" valueReference="9" '
            'causality="input" intervalVariability="constant" intervalDecimal="0.25"/></ModelVariables>'
            f"<ModelStructure>{outputs}</ModelStructure></fmiModelDescription>",
        )
        archive.write(folder / "m.so", "binaries/x86_64-linux/m.so")
    return folder / "m.fmu"


def ticks(t):
    return int((t + 1e-9) / 0.25) + 1


def test_clocks_tick_at_their_times_and_events_are_marked(clocked):
    done = terraglue("fmu", "run", clocked, "--stop", "1", "--step", "0.1", "--event-mode", "on")
    assert done.returncode == 0, done.stderr
    rows = list(csv.DictReader(done.stdout.splitlines()))
    assert len(rows) == 11
    before = 0.0
    for row in rows:
        t = float(row["time"])
        assert float(row["x"]) == t and float(row["count"]) == ticks(t)
        assert float(row["sample"]) == pytest.approx(0.25 * (ticks(t) - 1), abs=1e-12)
        assert float(row["events_seen"]) == (t > 0.62)
        inside = (ticks(t) - ticks(before)) + (before < 0.62 < t)
        assert int(row["events"]) == (inside if t > 0 else 0)
        before = t


def test_without_event_mode_nothing_ticks_and_that_is_said(clocked, tmp_path, monkeypatch):
    monkeypatch.setenv("TERRAGLUE_LOG", "warn")
    done = terraglue("fmu", "run", clocked, "--stop", "1", "--step", "0.1")
    assert done.returncode == 0 and "tick in event mode only" in done.stderr, done.stderr
    rows = list(csv.DictReader(done.stdout.splitlines()))
    assert "events" not in rows[0] and {row["count"] for row in rows} == {"0"}


def test_clocks_tick_in_a_scenario(clocked, tmp_path):
    path = tmp_path / "clocked.toml"
    path.write_text(
        f'[time]\nstep_s = 0.1\nduration_s = 1.0\n[recording]\nevery_steps = 1\n[m]\nfmu = "{clocked}"\nevent_mode = true\n'
    )
    done = terraglue("run", path, "--csv", "--quiet", "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    rows = list(csv.DictReader((tmp_path / "out" / "variables.csv").open()))
    assert [float(row["m.count"]) for row in rows[1:]] == [ticks(0.1 * (k + 1)) for k in range(10)]
