"""Intermediate update of FMI 3: inner steps are recorded, early returns are gone on from, odd calls do no harm."""

import csv

import pytest

from cfmu import build_3
from conftest import terraglue

VARIABLES = [("x", "output", "", ()), ("y", "output", "", (2,)), ("mode", "parameter", "0", ()), ("calls", "output", "", ())]

# x' = x in four inner steps, each shown; y = x, -x. From t = 0.5 s on `mode` selects: 1 a NaN that only an inner step shows, 2 a time
# outside the step, 3 early returns half-way, 4 one that never gets on, 5 ever smaller ones, 6 a call from another thread, 7 no places for
# the answer, 8 values may not be read at odd inner steps.
STEP = r"""int m = t >= 0.5 ? (int)v[3][0] : 0;
if (m == 4) { *last = t; return *early = *event = true, 0; }
if (m == 5) { *last = t + 1e-9 * h; return *early = true, 0; }
for (int k = 1; k <= 4; k++) {
    v[1][0] += h / 4 * v[1][0]; v[2][0] = v[1][0]; v[2][1] = -v[1][0];
    bool stop = false; double when = 0, own = t + k * h / 4, kept = v[1][0];
    if (m == 1 && k == 2) v[1][0] = NAN;
    if (m == 6) { Call c = {u, own}; pthread_t p; pthread_create(&p, 0, apart, &c); pthread_join(p, 0); }
    else if (u->update) u->update(u->env, m == 2 ? own + 1 : own, false, !(m == 8 && k % 2), true, true, m == 7 ? 0 : &stop, m == 7 ? 0 : &when);
    v[1][0] = kept; v[4][0] += 1;
    if (stop) { *early = true; *last = when; return 0; }
    if (m == 3 && k == 2) { if (!u->early) return 3; *early = true; *last = own; return 0; }
}"""
MORE = r"""typedef struct { Fmu *u; double t; } Call;
static void *apart(void *p) { Call *c = p; bool stop; double when; c->u->update(c->u->env, c->t, 0, 1, 1, 1, &stop, &when); return 0; }"""
ODD = r"""bool stop = true; double when; static int deep;
if (deep || !u->update) return 0; deep = 1;
u->update(u->env, 0.1, true, true, true, true, &stop, &when); u->update((void *)8, NAN, false, true, false, true, 0, 0); deep = 0;
if (stop) abort();"""
# event mode of an FMU without events of its own
EVENTS = r"""int fmi3EnterEventMode(Fmu *u) { return 0; }
int fmi3EnterStepMode(Fmu *u) { return 0; }
int fmi3UpdateDiscreteStates(Fmu *u, bool *a, bool *b, bool *c, bool *d, bool *e, double *t) { flip(u); return *a = *b = *c = *d = *e = false, 0; }"""
MORE += "\nstatic void flip(Fmu *u) {}\n" + EVENTS
START = "v[1][0] = v[2][0] = 1; v[2][1] = -1;"
FLAGS = 'providesIntermediateUpdate="true" canReturnEarlyAfterIntermediateUpdate="true" mightReturnEarlyFromDoStep="true" hasEventMode="true"'


@pytest.fixture(scope="session")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("intermediate")
    build_3(folder, "inner", VARIABLES, STEP, START, MORE, FLAGS)
    build_3(folder, "plain", VARIABLES, STEP, START, MORE)
    build_3(folder, "odd", VARIABLES, STEP, START, MORE, FLAGS, odd=ODD)
    return folder


def run(folder, mode, *more, fmu="inner"):
    return terraglue("fmu", "run", folder / f"{fmu}.fmu", "--stop", "1", "--step", "0.25", "--start", f"mode={mode}", *more)


def inner(count):
    x = [1.0]
    for _ in range(count):
        x.append(x[-1] + 0.25 / 4 * x[-1])
    return x


def rows(path):
    return list(csv.DictReader(path.open()))


@pytest.mark.parametrize("mode", [0, 8])
def test_inner_steps_are_recorded(folder, tmp_path, mode):
    done = run(folder, mode, "--intermediate", tmp_path / "i.csv", "--csv", tmp_path / "o.csv")
    assert done.returncode == 0, done.stderr
    table, own = rows(tmp_path / "i.csv"), inner(16)
    assert list(table[0]) == ["time", "x", "y[1]", "y[2]", "calls", "step_finished"]
    shown = [k for k in range(1, 17) if mode == 0 or k <= 8 or k % 2 == 0]
    assert [float(row["x"]) for row in table] == [own[k] for k in shown]
    assert [float(row["y[2]"]) for row in table] == [-own[k] for k in shown]
    assert [float(row["time"]) for row in table] == pytest.approx([k / 16 for k in shown], abs=1e-12)
    assert {row["step_finished"] for row in table} == {"1"}
    assert [float(row["x"]) for row in rows(tmp_path / "o.csv")] == own[::4]
    only = run(folder, mode, "--intermediate", tmp_path / "x.csv", "--output", "x,mode", "--csv", tmp_path / "o.csv")
    assert only.returncode == 0 and list(rows(tmp_path / "x.csv")[0]) == ["time", "x", "step_finished"], only.stderr


def test_early_returns_are_gone_on_from(folder, tmp_path):
    done = run(folder, 3, "--intermediate", tmp_path / "i.csv", "--event-mode", "on")
    assert done.returncode == 0, done.stderr
    last = list(csv.DictReader(done.stdout.splitlines()))[-1]
    # a return half-way makes steps of h/2, h/4, …; the time is reached all the same
    assert float(last["time"]) == 1.0
    times = [float(row["time"]) for row in rows(tmp_path / "i.csv")]
    assert times == sorted(times) and times[-1] == pytest.approx(1.0, abs=1e-9)
    assert float(last["x"]) == pytest.approx(2.718, rel=0.03)


def test_an_event_is_never_left_to_nobody(tmp_path):
    """x' = 1 up to the event at 0.55 s, then -1. An FMU that may return early leaves the event to event mode; else it handles it itself."""
    step = """if (t < 0.55 - 1e-12 && t + h >= 0.55) {
    v[1][0] += 0.55 - t;
    if (u->early) { *early = *event = true; *last = 0.55; return 0; }
    v[2][0] = -1; v[1][0] -= t + h - 0.55; return 0; }
v[1][0] += h * v[2][0];"""
    more = "static void flip(Fmu *u) { if (u->v[1][0] > 0.5) u->v[2][0] = -1; }\n" + EVENTS
    flags = 'hasEventMode="true" mightReturnEarlyFromDoStep="true"'
    variables = [("x", "output", "", ()), ("slope", "output", "", ())]
    fmu = build_3(tmp_path, "turns", variables, step, start="v[2][0] = 1;", more=more, flags=flags)
    for mode in ("off", "on"):
        done = terraglue("fmu", "run", fmu, "--stop", "1", "--step", "0.1", "--event-mode", mode)
        last = list(csv.DictReader(done.stdout.splitlines()))[-1]
        assert float(last["x"]) == pytest.approx(0.1, abs=1e-12), mode


@pytest.mark.parametrize(
    ("mode", "says"),
    [(1, ["NaN in its intermediate update at t = 0.625 s", "`x`"]), (2, ["t = 1.5625 s", "in the step from 0.5 s"])],
)
def test_what_only_an_inner_step_shows_stops_the_run_where_it_is_asked_for(folder, tmp_path, mode, says):
    done = run(folder, mode, "--intermediate", tmp_path / "i.csv")
    assert done.returncode == 1 and all(word in done.stderr for word in says) and "fmi3DoStep" in done.stderr, done.stderr
    times = [float(row["time"]) for row in rows(tmp_path / "i.csv")]
    assert times == pytest.approx([k / 16 for k in range(1, 9)], abs=1e-12), "what was recorded before is there"
    assert run(folder, mode).returncode == 0, "nobody asked"


@pytest.mark.parametrize(
    ("mode", "says"), [(4, "came no further than t = 0.5"), (5, "returned early more than"), (6, "another thread"), (7, "")]
)
def test_odd_returns_and_calls_do_no_harm(folder, monkeypatch, mode, says):
    monkeypatch.setenv("TERRAGLUE_LOG", "warn")
    done = run(folder, mode)
    assert done.returncode == (1 if mode < 6 else 0) and says in done.stderr, done.stderr


def test_calls_outside_a_step_are_not_followed(folder, monkeypatch, tmp_path):
    monkeypatch.setenv("TERRAGLUE_LOG", "warn")
    done = run(folder, 0, "--intermediate", tmp_path / "i.csv", fmu="odd")
    assert done.returncode == 0 and done.stderr.count("that is not followed") == 1, done.stderr
    assert [float(row["x"]) for row in rows(tmp_path / "i.csv")] == inner(16)[1:]
    path = tmp_path / "odd.toml"
    path.write_text(f'[time]\nstep_s = 0.25\nduration_s = 1.0\n[a]\nfmu = "{folder}/odd.fmu"\n[b]\nfmu = "{folder}/inner.fmu"\nevent_mode = true\nmode = 3\n')
    done = terraglue("run", path, "--quiet", "--out", tmp_path / "out")
    assert done.returncode == 0 and done.stderr.count("that is not followed") == 1, done.stderr


def test_what_is_not_offered_is_refused(folder, tmp_path):
    done = run(folder, 0, "--intermediate", tmp_path / "i.csv", fmu="plain")
    assert done.returncode == 2 and "intermediate" in done.stderr, done.stderr
    done = run(folder, 0, "--intermediate", tmp_path / "i.csv", "--output", "mode")
    assert done.returncode == 2 and "intermediateUpdate" in done.stderr, done.stderr
