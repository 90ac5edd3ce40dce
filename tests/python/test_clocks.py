"""Event mode of FMI 3: periodic input clocks tick at their times, triggered ones on request, output clocks are seen; events
inside a step are handled and marked."""

import csv
import subprocess
import zipfile

import pytest

from cfmu import build_3
from conftest import terraglue

# `x` is the time; every tick samples it and counts; at t = 0.62 the FMU asks for event mode by itself, counts that, and its output
# clock `beat` ticks. The triggered clock `hit` counts and keeps the input `in`, which can only be set while it ticks.
CODE = r"""
#include <stdbool.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
typedef struct { double v[32], t; bool due, events, asked, hit, inside, down, next, share; int grown; } Fmu;
enum { X = 1, SAMPLE, COUNT, EVENTS, HITS, KEPT, IN, DOWN = 12, GROWN };
void *fmi3InstantiateCoSimulation(const char *n, const char *t, const char *r, bool v, bool l, bool e, bool a,
    const unsigned *q, size_t k, void *env, void *log, void *up) {
    Fmu *u = calloc(1, sizeof(Fmu)); u->events = e; return u; }
void fmi3FreeInstance(Fmu *u) { free(u); }
int fmi3EnterInitializationMode(Fmu *u, bool a, double b, double c, bool d, double e) { return 0; }
int fmi3ExitInitializationMode(Fmu *u) { u->inside = u->events; return 0; }
int fmi3EnterEventMode(Fmu *u) { u->inside = true; return 0; }
int fmi3EnterStepMode(Fmu *u) { u->inside = false; return 0; }
int fmi3Terminate(Fmu *u) { return 0; }
int fmi3GetFloat64(Fmu *u, const unsigned *r, size_t n, double *x, size_t m) { while (n--) x[n] = u->v[r[n]]; return 0; }
int fmi3SetFloat64(Fmu *u, const unsigned *r, size_t n, const double *x, size_t m) {
    if (n != 1 || r[0] != IN || u->events && !u->hit) return 3; u->v[IN] = x[0]; return 0; }
int fmi3SetClock(Fmu *u, const unsigned *r, size_t n, const bool *on) {
    if (!u->inside) return 3;
    for (size_t k = 0; k < n; k++) { if (r[k] == 9) u->due = on[k]; else if (r[k] == 10) u->hit = on[k]; else if (r[k] == 14) u->down = on[k];
        else if (r[k] == 15) u->next = on[k]; else if (r[k] == 16) u->share = on[k]; else return 3; }
    return 0; }
int fmi3GetIntervalDecimal(Fmu *u, const unsigned *r, size_t n, double *x, int *q) {
    if (!u->inside || n != 2 || r[0] != 14 || r[1] != 15) return 3;
    // 0.13 s after the event at 0.62, and at once after that; the other one ticks at 0, 0.1, 0.3, 0.6, 1
    q[0] = u->v[DOWN] == 1 ? 2 : u->v[EVENTS] == 1 && u->v[DOWN] == 0 && u->v[8] == 0 ? 2 : 1;
    x[0] = u->v[DOWN] == 1 ? 0 : %INTERVAL%; u->v[8] = u->v[EVENTS];
    q[1] = 2; x[1] = 0.1 * u->grown; return 0; }
int fmi3GetIntervalFraction(Fmu *u, const unsigned *r, size_t n, unsigned long *x, unsigned long *d, int *q) {
    if (!u->inside || n != 1 || r[0] != 16) return 3; *x = 1; *d = %RESOLUTION%; *q = 2; return 0; }
int fmi3GetClock(Fmu *u, const unsigned *r, size_t n, bool *on) {
    if (!u->inside || n != 1 || r[0] != 11) return 3; *on = u->asked; return 0; }
int fmi3UpdateDiscreteStates(Fmu *u, bool *again, bool *end, bool *nominals, bool *values, bool *defined, double *next) {
    *again = *end = *nominals = *values = *defined = false;
    if (u->due) { u->v[SAMPLE] = u->t; u->v[COUNT] += 1; u->due = false; }
    if (!u->inside) return 3;
    if (u->down) { u->v[DOWN] += 1; u->v[9] = u->t; u->down = false; }
    if (u->next) { u->grown += 1; u->v[GROWN] = u->t; u->next = false; }
    if (u->share) { double off = fabs(u->t - u->v[20] / (double)%RESOLUTION%); u->v[20] += 1; if (off > u->v[21]) u->v[21] = off; u->share = false; }
    if (u->hit) { u->v[HITS] += 1; u->v[KEPT] = u->v[IN]; u->hit = false; }
    if (u->asked) { u->v[EVENTS] += 1; u->asked = false; }
    return 0; }
int fmi3GetFMUState(Fmu *u, void **s) { if (!*s) *s = malloc(sizeof *u); memcpy(*s, u, sizeof *u); return 0; }
int fmi3SetFMUState(Fmu *u, void *s) { memcpy(u, s, sizeof *u); return 0; }
int fmi3FreeFMUState(Fmu *u, void **s) { free(*s); *s = 0; return 0; }
int fmi3DoStep(Fmu *u, double t, double h, bool g, bool *e, bool *d, bool *early, double *last) {
    *e = *d = *early = false;
#ifdef SHORT
    *last = t;
    if (h > 0.11) return 2;
#endif
    if (!(h > 1e-9)) return 3;
    u->t = t + h;
    if (u->events && t < 0.62 - 1e-9 && t + h > 0.62 + 1e-9) { u->t = 0.62; u->asked = *e = *early = true; }
    u->v[X] = *last = u->t; return 0; }
"""


@pytest.fixture(scope="session")
def clocked(tmp_path_factory):
    return made(tmp_path_factory.mktemp("clocked"))


def made(folder, more="", interval="0.13", options=(), resolution="30"):
    (folder / "m.c").write_text(CODE.replace("%INTERVAL%", interval).replace("%RESOLUTION%", resolution))
    subprocess.run(["cc", "-shared", "-fPIC", "-w", *options, "m.c", "-o", "m.so"], cwd=folder, check=True, capture_output=True)
    names = ("x", "sample", "count", "events_seen", "hits", "kept")
    variables = "".join(f'<Float64 name="{n}" valueReference="{k + 1}" causality="output"/>' for k, n in enumerate(names))
    variables += '<Float64 name="in" valueReference="7" causality="input" variability="discrete" clocks="10" start="0"/>'
    variables += '<Clock name="hit" valueReference="10" causality="input" intervalVariability="triggered"/>'
    variables += '<Clock name="beat" valueReference="11" causality="output" intervalVariability="triggered"/>'
    variables += more
    outputs = "".join(f'<Output valueReference="{k + 1}"/>' for k in range(len(names)))
    with zipfile.ZipFile(folder / "m.fmu", "w") as archive:
        archive.writestr(
            "modelDescription.xml",
            '<?xml version="1.0"?><fmiModelDescription fmiVersion="3.0" modelName="m" instantiationToken="g">'
            '<CoSimulation modelIdentifier="m" hasEventMode="true" canHandleVariableCommunicationStepSize="true" canGetAndSetFMUState="true" '
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


def test_an_output_clock_is_seen_and_a_triggered_one_ticks_by_input(clocked, tmp_path):
    table = tmp_path / "in.csv"
    table.write_text("time,hit,in\n0,0,5\n0.3,1,6\n0.35,0,7\n0.7,1,8\n1,0,8\n")
    done = terraglue("fmu", "run", clocked, "--stop", "1", "--step", "0.1", "--event-mode", "on", "--input", table)
    assert done.returncode == 0, done.stderr
    rows = list(csv.DictReader(done.stdout.splitlines()))
    assert [row["beat"] for row in rows] == ["0"] * 7 + ["1"] + ["0"] * 3
    # the clock is up at 0.3 (once) and at 0.7, 0.8, 0.9
    assert [int(row["hits"]) for row in rows] == [0, 0, 0, 0, 1, 1, 1, 1, 2, 3, 4]
    assert [float(row["kept"]) for row in rows] == [0, 0, 0, 0, 6, 6, 6, 6, 8, 8, 8]


def test_clocks_are_connected_and_set_by_events(clocked, tmp_path):
    path = tmp_path / "clocked.toml"
    fmu = f'fmu = "{clocked}"\nevent_mode = true\n'
    path.write_text(
        "[time]\nstep_s = 0.1\nduration_s = 1.0\n[recording]\nevery_steps = 1\n"
        f'[a]\n{fmu}[b]\n{fmu}[c]\n{fmu}[[connect]]\nfrom = "a.beat"\nto = "b.hit"\n[[connect]]\nfrom = "a.x"\nto = "b.in"\n'
        '[[event]]\nat_s = 0.3\nset = { "c.hit" = true }\n[[event]]\nat_s = 0.3\nset = { "c.in" = 4.5 }\n'
    )
    for isolate in ("", "isolate = true\n"):
        path.write_text(path.read_text().replace("[b]\n", "[b]\n" + isolate))
        done = terraglue("run", path, "--csv", "--quiet", "--out", tmp_path / "out")
        assert done.returncode == 0, done.stderr
        rows = list(csv.DictReader((tmp_path / "out" / "variables.csv").open()))
        assert len(rows) == 11
        column = {name: [float(row[name]) for row in rows] for name in ("b.hits", "b.kept", "c.hits", "c.kept", "a.events_seen")}
        # a's event at 0.62 is seen at 0.7, where b ticks and keeps a.x of that time
        assert column["a.events_seen"] == [0] * 7 + [1] * 4
        assert column["b.hits"] == [0] * 8 + [1] * 3
        assert column["b.kept"] == [0] * 8 + [pytest.approx(0.7, abs=1e-12)] * 3
        assert column["c.hits"] == [0] * 4 + [1] * 7 and column["c.kept"] == [0] * 4 + [4.5] * 7
        beats = [row["a.beat"] in ("true", "1", "1.0") for row in rows]
        assert beats == [False] * 7 + [True] + [False] * 3


def test_without_event_mode_clocks_are_not_there(clocked, tmp_path):
    path = tmp_path / "clocked.toml"
    path.write_text(
        f'[time]\nstep_s = 0.1\nduration_s = 1.0\n[a]\nfmu = "{clocked}"\n[[event]]\nat_s = 0.3\nset = {{ "a.hit" = true }}\n'
    )
    done = terraglue("run", path, "--quiet", "--out", tmp_path / "out")
    assert done.returncode == 2 and "a.hit" in done.stderr, done.stderr
    table = tmp_path / "in.csv"
    table.write_text("time,hit\n0,1\n")
    done = terraglue("fmu", "run", clocked, "--stop", "1", "--step", "0.1", "--input", table)
    assert done.returncode == 2 and "`hit` cannot be made to tick" in done.stderr, done.stderr


TOLD = (
    '<Float64 name="down" valueReference="12" causality="output"/>'
    '<Float64 name="grown_at" valueReference="13" causality="output"/>'
    '<Clock name="count_down" valueReference="14" causality="input" intervalVariability="countdown"/>'
    '<Clock name="growing" valueReference="15" causality="input" intervalVariability="changing"/>'
)


def told(tmp_path, interval="0.13", options=()):
    fmu = made(tmp_path, TOLD, interval, options)
    return terraglue("fmu", "run", fmu, "--stop", "1", "--step", "0.25", "--event-mode", "on", "--output", "x,down,grown_at,count")


def test_clocks_tick_when_the_fmu_told(tmp_path):
    done = told(tmp_path)
    assert done.returncode == 0, done.stderr
    rows = list(csv.DictReader(done.stdout.splitlines()))
    # a countdown from 0.62 to 0.75, and one of no length there
    assert [float(row["down"]) for row in rows] == [0, 0, 0, 2, 2]
    assert [float(row["grown_at"]) for row in rows] == pytest.approx([0, 0.1, 0.3, 0.6, 1.0], abs=1e-12)
    assert [float(row["count"]) for row in rows] == [1, 2, 3, 4, 5], "the periodic one ticks as before"


def test_what_the_fmu_told_goes_back_with_its_state(tmp_path):
    # steps over 0.11 s are discarded, also behind a tick: the step is halved from the saved state, in which that tick is to come
    done = told(tmp_path, options=["-DSHORT"])
    assert done.returncode == 0, done.stderr
    rows = list(csv.DictReader(done.stdout.splitlines()))
    assert [float(row["down"]) for row in rows] == [0, 0, 0, 2, 2]
    assert [float(row["grown_at"]) for row in rows] == pytest.approx([0, 0.1, 0.3, 0.6, 1.0], abs=1e-12)
    assert [float(row["count"]) for row in rows] == [1, 2, 3, 4, 5]


FRACTIONS = (
    '<Float64 name="shares" valueReference="20" causality="output"/><Float64 name="off" valueReference="21" causality="output"/>'
    '<Clock name="share" valueReference="16" causality="input" intervalVariability="changing" supportsFraction="true"/>'
)


@pytest.mark.parametrize("options", [(), ("-DSHORT",)])
def test_fractions_of_a_second_do_not_drift(tmp_path, options):
    fmu = made(tmp_path, FRACTIONS, options=options)
    arguments = ["--stop", "20", "--step", "0.25", "--event-mode", "on", "--output", "shares,off"]
    done = terraglue("fmu", "run", fmu, *arguments)
    assert done.returncode == 0, done.stderr
    last = list(csv.DictReader(done.stdout.splitlines()))[-1]
    # the FMU adds its own t + h, which is off by a rounding; six hundred intervals of 1/30 s added up are off by 2e-13
    assert float(last["shares"]) == 601 and float(last["off"]) <= 4e-15


def test_a_fraction_of_nothing_is_refused(tmp_path):
    fmu = made(tmp_path, FRACTIONS, resolution="0")
    done = terraglue("fmu", "run", fmu, "--stop", "1", "--event-mode", "on")
    assert done.returncode == 1 and "told the interval 1/0 s" in done.stderr and "fmi3GetIntervalFraction" in done.stderr, done.stderr


def test_an_interval_that_is_none_is_refused(tmp_path):
    done = told(tmp_path, "-0.5")
    assert done.returncode == 1 and "told the interval -0.5 s" in done.stderr and "fmi3GetIntervalDecimal" in done.stderr, done.stderr


def test_a_failure_before_the_first_step_is_told_as_it_is(tmp_path):
    build_3(tmp_path, "nan", [("x", "output", "", ())], "", "v[1][0] = NAN;")
    path = tmp_path / "nan.toml"
    path.write_text('[time]\nstep_s = 0.1\nduration_s = 1.0\n[a]\nfmu = "nan.fmu"\n[recording]\nevery_steps = 1\n')
    done = terraglue("run", path, "--quiet", "--out", tmp_path / "out")
    assert done.returncode == 1 and "`x` is NaN" in done.stderr and "ended the program" not in done.stderr, done.stderr
