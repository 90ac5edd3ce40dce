"""Inputs that go on within a step: FMUs of FMI 3 ask for them, FMUs of FMI 2 receive their slopes; results are closed forms."""

import csv
import math

import numpy
import pytest
from fmpy import extract, read_model_description, simulate_fmu
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave

from cfmu import FRAME, FRAME_3, build, build_3
from conftest import terraglue

# x' = u - x and y' = u by Runge and Kutta's method in 64 inner steps; AT(s) is u at the time s.
RUNGE_KUTTA = r"""for (int k = 0; k < 64; k++) {
    double d = h / 64, s = t + k * d, a = AT(s), m = AT(s + d / 2), b = AT(s + d), x = X, k1 = a - x, k2 = m - x - d / 2 * k1,
        k3 = m - x - d / 2 * k2, k4 = b - x - d * k3;
    STOP; X += d / 6 * (k1 + 2 * k2 + 2 * k3 + k4); Y += d / 6 * (a + 4 * m + b); }"""

# FMI 3; while the FMU asks, its mode is 9
ASK = r"""
static struct { bool stop; double when; } asked;
static double ask(Fmu *u, double s) {
    int mode = u->mode; u->mode = 9;
    if (u->update && !asked.stop) u->update(u->env, s, true, false, false, true, &asked.stop, &asked.when);
    u->mode = mode;
    return u->v[1][0]; }
#define AT(s) ask(u, s)
#define X v[2][0]
#define Y v[3][0]
#define STOP if (asked.stop) { asked.stop = false; *early = true; *last = asked.when; return 0; }
"""
ABLE = 'providesIntermediateUpdate="true" canReturnEarlyAfterIntermediateUpdate="true"'
VARIABLES = [("u", "input", "0", ()), ("x", "output", "", ()), ("y", "output", "", ())]

# FMI 2
TOLD = r"""
int fmi2SetRealInputDerivatives(Fmu *u, const unsigned *r, size_t n, const int *order, const double *slope) {
    for (size_t k = 0; k < n; k++) { if (order[k] != 1 || r[k] != 0) return 3; u->slope[r[k]] = slope[k]; }
    return 0; }
#define AT(s) (r[0] + u->slope[0] * ((s) - t))
#define X r[1]
#define Y r[2]
#define STOP
"""
REALS = [("u", "input", 0, ""), ("x", "output", 0, ""), ("y", "output", 0, "")]
INTERPOLATES = 'canInterpolateInputs="true"'


def two(folder, name="two", step=RUNGE_KUTTA, more=TOLD, flags=INTERPOLATES, others=""):
    return build(folder, name, REALS, step, others, more=more, flags=flags)


def three(folder, name="three", step=RUNGE_KUTTA, more=ASK, flags=ABLE, **other):
    return build_3(folder, name, VARIABLES, step, more=more, flags=flags, **other)


@pytest.fixture(scope="session")
def fmus(tmp_path_factory):
    folder = tmp_path_factory.mktemp("within")
    return {"2": two(folder), "3": three(folder)}


def table(folder, *rows, names="u"):
    path = folder / "in.csv"
    path.write_text("\n".join([f"time,{names}", *(",".join(map(str, row)) for row in rows)]) + "\n")
    return path


def run(fmu, rows, *more, step=0.25):
    done = terraglue("fmu", "run", fmu, "--input", rows, "--stop", 1, "--step", step, *more)
    return done, [{k: float(x) for k, x in row.items()} for row in csv.DictReader(done.stdout.splitlines())]


@pytest.mark.parametrize("version", ["2", "3"])
@pytest.mark.parametrize("more", [(), ("--isolate",)])
def test_a_ramp_gives_the_closed_form(fmus, tmp_path, version, more):
    done, rows = run(fmus[version], table(tmp_path, (0, 0), (2, 2)), *more)
    assert done.returncode == 0 and len(rows) == 5, done.stderr
    for row in rows:
        t = row["time"]
        assert row["y"] == pytest.approx(t * t / 2, abs=1e-12)
        assert row["x"] == pytest.approx(t - 1 + math.exp(-t), abs=1e-12)


@pytest.mark.parametrize("version", ["2", "3"])
def test_held_inputs_are_half_a_step_late(fmus, tmp_path, version):
    done, rows = run(fmus[version], table(tmp_path, (0, 0), (2, 2)), "--hold-inputs")
    assert done.returncode == 0, done.stderr
    for row in rows:
        t = row["time"]
        assert row["y"] == pytest.approx(t * t / 2 - t * 0.25 / 2, abs=1e-12)


def test_rows_within_a_step(fmus, tmp_path):
    """Asked for, the input is the table's at every time; a slope is the mean one of the step, so that both ends are the table's."""
    bent = table(tmp_path, (0, 0), (0.375, 0.75), (0.75, -0.5), (0.8125, 3.0), (0.875, 1.0))
    knots = [(0, 0), (0.375, 0.75), (0.75, -0.5), (0.8125, 3.0), (0.875, 1.0), (1, 1.0)]
    area = sum((b[0] - a[0]) * (a[1] + b[1]) / 2 for a, b in zip(knots, knots[1:]))
    done, rows = run(fmus["3"], bent)
    assert done.returncode == 0 and rows[-1]["y"] == pytest.approx(area, abs=1e-12), done.stderr
    at = numpy.interp([0, 0.25, 0.5, 0.75, 1], *zip(*knots))
    done, rows = run(fmus["2"], bent)
    assert done.returncode == 0, done.stderr
    sums = [0, *numpy.cumsum((at[1:] + at[:-1]) / 8)]
    assert [row["y"] for row in rows] == pytest.approx(sums, abs=1e-12)
    done, rows = run(fmus["2"], bent, step=0.0625)
    assert done.returncode == 0 and rows[-1]["y"] == pytest.approx(area, abs=1e-12), done.stderr


def test_before_the_first_and_behind_the_last_row_inputs_stand(fmus, tmp_path):
    for version, fmu in fmus.items():
        done, rows = run(fmu, table(tmp_path, (0.25, 1), (0.75, 2)))
        assert done.returncode == 0 and rows[-1]["y"] == pytest.approx(0.25 + 0.75 + 0.5, abs=1e-12), version
        done, rows = run(fmu, table(tmp_path, (0, 3)))
        assert done.returncode == 0 and rows[-1]["y"] == pytest.approx(3, abs=1e-12), version


@pytest.mark.parametrize("version", ["2", "3"])
def test_a_step_that_is_discarded_and_halved(tmp_path, version):
    step = "if (h > 0.1) return 2; " + RUNGE_KUTTA
    fmu = two(tmp_path, step=step) if version == "2" else three(tmp_path, step=step.replace("return 2;", "{ ask(u, t + h); return 2; }"))
    done, rows = run(fmu, table(tmp_path, (0, 0), (0.375, 0.75), (2, 4)))
    assert done.returncode == 0, done.stderr
    # x' = u - x and y' = u see the table between halves of halves; the bend at 0.375 s lies on an end of one
    bend = 0.75 * 0.375 / 2
    assert rows[-1]["y"] == pytest.approx(bend + 0.75 * 0.625 + 2 * 0.625**2 / 2, abs=1e-12)


@pytest.mark.parametrize("version", ["2", "3"])
def test_numbers_of_fmpy(tmp_path, version):
    """FMPy sets slopes of FMI 2 itself; for FMI 3 it offers the call-back, here with a line of its own."""
    names = ["u", *"abcdefgh"]
    if version == "2":
        # FMPy 0.3.32 has places for the slopes of nine inputs, no more and no less
        reals = REALS + [(name, "input", 0, "") for name in names[1:]]
        more = TOLD.replace("r[k] != 0", "r[k] > 10") + not_there(FMU2Slave, FRAME + TOLD)
        fmu = build(tmp_path, "nine", reals, RUNGE_KUTTA, more=more, flags=INTERPOLATES)
        rows = [(t, *(2 * t + k for k in range(9))) for t in (-1.0, 3.0)]
        ours = run(fmu, table(tmp_path, *rows, names=",".join(names)))[1]
        signal = numpy.array(rows, dtype=[(name, float) for name in ["time", *names]])
        theirs = simulate_fmu(
            fmu, stop_time=1.0, output_interval=0.25, input=signal, set_input_derivatives=True, output=["x", "y"]
        )
    else:
        fmu = three(tmp_path, more=ASK + not_there(FMU3Slave, FRAME_3))
        ours = run(fmu, table(tmp_path, (-1, -2), (3, 6)))[1]
        theirs = by_hand(fmu)
    assert [tuple(row.values()) for row in ours] == [tuple(map(float, row)) for row in theirs]


def not_there(kind, code):
    """FMPy wants all functions of the standard, also those that it does not call."""
    names = [name for name in dir(kind) if name.startswith(("fmi2", "fmi3")) and f"{name}(" not in code]
    return "".join(f"\nint {name}() {{ return 3; }}" for name in names)


def by_hand(path):
    description, folder = read_model_description(path), extract(str(path))
    fmu = FMU3Slave(guid="g", unzipDirectory=folder, modelIdentifier="m", instanceName="x")
    line = lambda t: 2 * t

    def update(environment, t, requested, allowed, finished, can_return, early, early_time):
        if requested:
            fmu.setFloat64([1], [line(t)])

    fmu.instantiate(intermediateUpdate=update, requiredIntermediateVariables=[1])
    fmu.enterInitializationMode(startTime=0.0)
    fmu.setFloat64([1], [line(0.0)])
    fmu.exitInitializationMode()
    rows = [(0.0, *fmu.getFloat64([2, 3]))]
    for k in range(4):
        fmu.setFloat64([1], [line(0.25 * k)])
        fmu.doStep(currentCommunicationPoint=0.25 * k, communicationStepSize=0.25)
        rows.append((0.25 * (k + 1), *fmu.getFloat64([2, 3])))
    fmu.terminate()
    fmu.freeInstance()
    assert description.coSimulation.providesIntermediateUpdate
    return rows


def test_only_inputs_with_a_column_are_announced_and_only_when_they_are_asked_for(tmp_path):
    """Two inputs that could be set, one with a column; an output is read first and announced too."""
    variables = [*VARIABLES, ("w", "input", "7", ()), ("count", "output", "", ()), ("first", "output", "", ()), ("set", "output", "", ())]
    step = """v[5][0] = u->count; v[6][0] = u->announced[0]; X = u->announced[1]; v[4][0] = 7; v[7][0] = 0;
for (int k = 1; k <= 2; k++) {
    double before = v[1][0]; bool stop; double when;
    u->mode = 9;
    if (u->update) u->update(u->env, t + k * h / 2, k == 2, true, true, false, &stop, &when);
    u->mode = 3;
    if (k == 1 && v[1][0] != before || v[4][0] != 7) return no(u, "nobody asked");
    v[7][0] += v[1][0] != before; Y += h / 2 * v[1][0]; }"""
    once_set = {"sets": "if (u->mode == 9) u->mode = 10;", "odd": "if (u->mode == 10) abort();"}
    fmu = build_3(tmp_path, "counts", variables, step, more=ASK, flags=ABLE, **once_set)
    rows = table(tmp_path, (0, 0), (2, 2))
    done, found = run(fmu, rows)
    assert done.returncode == 0, done.stderr
    assert [found[-1][name] for name in ("count", "first", "set")] == [1, 1, 1]
    done, found = run(fmu, rows, "--intermediate", tmp_path / "i.csv", "--output", "count,first,x,y")
    # inputs, outputs: u (1) and x, y, count, first (2, 3, 5, 6)
    assert done.returncode == 0 and (found[-1]["count"], found[-1]["first"], found[-1]["x"]) == (5, 1, 2), done.stderr
    within = list(csv.DictReader((tmp_path / "i.csv").open()))
    assert [float(row["time"]) for row in within] == [k / 8 for k in range(1, 9)]
    done, found = run(fmu, rows, "--hold-inputs")
    assert done.returncode == 0 and (found[-1]["count"], found[-1]["set"]) == (0, 0), done.stderr
    done = terraglue("fmu", "run", fmu, "--stop", 1, "--step", 0.25)
    assert done.returncode == 0 and list(csv.DictReader(done.stdout.splitlines()))[-1]["count"] == "0"


def test_what_cannot_be_followed_is_held(tmp_path):
    """Without the capability the function is neither wanted nor called; inputs that are not continuous keep their value over a step."""
    plain = TOLD.replace("int fmi2SetRealInputDerivatives", "int nothing_of_that_name")
    refuses = TOLD.replace("    for (size_t k", "    return 3; for (size_t k")
    discrete = '<ScalarVariable name="d" valueReference="0" causality="input" variability="discrete"><Real start="0"/></ScalarVariable>'
    held = [t * t / 2 - t / 8 for t in (0, 0.25, 0.5, 0.75, 1)]
    for fmu, name in [
        (two(tmp_path, "plain", more=plain, flags=""), "u"),
        (two(tmp_path, "refuses", more=refuses, flags=""), "u"),
        (two(tmp_path, "discrete", more=refuses, others=discrete), "d"),
        (three(tmp_path, "silent", more=ASK.replace("s, true, false", "s, false, false")), "u"),
    ]:
        # a discrete input has the value of the row before
        rows = [(t / 4, t / 4) for t in range(5)] if name == "d" else [(0, 0), (2, 2)]
        done, found = run(fmu, table(tmp_path, *rows, names=name))
        assert done.returncode == 0 and [row["y"] for row in found] == pytest.approx(held, abs=1e-12), (fmu, done.stderr)
    done, found = run(tmp_path / "discrete.fmu", table(tmp_path, (0, 1), (0.6, 2), (2, 3), names="d"))
    assert [row["y"] for row in found] == pytest.approx([0, 0.25, 0.5, 0.75, 1.25], abs=1e-12)


def test_a_function_that_is_promised_and_missing_is_named(tmp_path):
    fmu = two(tmp_path, more=TOLD.replace("int fmi2SetRealInputDerivatives", "int nothing_of_that_name"))
    done, _ = run(fmu, table(tmp_path, (0, 0), (2, 2)))
    assert done.returncode == 1 and "`fmi2SetRealInputDerivatives`" in done.stderr and "two.fmu" in done.stderr, done.stderr


@pytest.mark.parametrize("isolate", [(), ("--isolate",)])
@pytest.mark.parametrize("status", [2, 3, 4, 77])
def test_an_fmu_that_does_not_take_an_input_is_named_with_time_and_function(tmp_path, status, isolate):
    rows = table(tmp_path, (0, 0), (2, 2))
    refuses = TOLD.replace("for (size_t k", f"if (u->r[0] >= 0.5) return {status}; for (size_t k")
    done, found = run(two(tmp_path, more=refuses), rows, *isolate)
    assert done.returncode == 1 and [row["time"] for row in found] == [0, 0.25, 0.5], done.stderr
    assert all(word in done.stderr for word in ("two.fmu", "t = 0.5 s", "fmi2SetRealInputDerivatives", "--hold-inputs")), done.stderr
    # nothing is called after fatal: the FMU would abort
    sets = f"if (u->mode == 9 && *x > 0.6) {{ u->n = {status} > 3 ? 99 : 0; return {status}; }}"
    fmu = three(tmp_path, sets=sets, odd="if (u->n == 99) abort();")
    done, found = run(fmu, rows, *isolate)
    assert done.returncode == 1 and [row["time"] for row in found] == [0, 0.25, 0.5], done.stderr
    says = ("three.fmu", "at t = 0.5 s: fmi3DoStep", f"answered {status} to fmi3SetFloat64", "`u`", "t = 0.6", "--hold-inputs")
    assert all(word in done.stderr for word in says), done.stderr


def test_a_cell_without_a_number_is_named(fmus, tmp_path):
    for version, fmu in fmus.items():
        done, found = run(fmu, table(tmp_path, (0, 0), (0.6, 1), (0.7, "x"), (1, 2)))
        assert done.returncode == 2 and "`u`" in done.stderr and "no number" in done.stderr, (version, done.stderr)
        assert found[-1]["time"] == 0.5, version


def test_arrays_and_single_precision(tmp_path):
    """Elements without a column keep their start value while the others go on; whole arrays and Float32 go on likewise."""
    variables = [("u", "input", "5 6", (2,)), ("x", "output", "", (2,)), ("f", "output", "", ())]
    more = ASK + r"""
static float narrow[3];
int fmi3SetFloat32(Fmu *u, const unsigned *r, size_t k, const float *x, size_t m) {
    if (k != 1 || m != (*r == 4 ? 1 : 2)) return 3;
    memcpy(narrow + (*r == 4 ? 0 : 1), x, 4 * m); return 0; }"""
    step = r"""for (int k = 0; k < 4; k++) {
    double d = h / 4; ask(u, t + (k + 0.5) * d); STOP;
    for (int i = 0; i < 2; i++) v[2][i] += d * v[1][i];
    for (int i = 0; i < 3; i++) v[3][0] += d * narrow[i]; }"""
    single = """<Float32 name="g" valueReference="4" causality="input" intermediateUpdate="true" start="0"/>
<Float32 name="k" valueReference="5" causality="input" intermediateUpdate="true" start="0 0"><Dimension start="2"/></Float32>"""
    fmu = build_3(tmp_path, "wide", variables, step, "v[1][0] = 5; v[1][1] = 6;", more, ABLE, others=single)
    done, found = run(fmu, table(tmp_path, (0, 1, 0, "0 0"), (2, 5, 1, "1 2"), names="u[2],g,k"))
    assert done.returncode == 0, done.stderr
    assert [found[-1][name] for name in ("x[1]", "x[2]", "f")] == [5, 2, 0.25 + 0.25 + 0.5]
    done, found = run(fmu, table(tmp_path, (0, "0 1"), (2, "4 5")))
    assert done.returncode == 0 and [found[-1][name] for name in ("x[1]", "x[2]")] == [1, 2], done.stderr


@pytest.mark.parametrize("event", [True, False])
def test_after_an_early_return_the_input_is_of_that_time(tmp_path, event):
    """A trial of the solver looks at the end of the step; then the FMU returns half-way. `x` is the value there."""
    step = r"""double half = t + h / 2;
if (t == 0.375 && EVENT == 0) X = v[1][0];
if (t == 0.25 && u->early) { Y += h / 2 * ask(u, t + h / 4); ask(u, t + h); *early = true; *event = EVENT; *last = half; return 0; }
Y += h * ask(u, half);"""
    events = r"""
int fmi3EnterEventMode(Fmu *u) { return 0; }
int fmi3EnterStepMode(Fmu *u) { return 0; }
int fmi3UpdateDiscreteStates(Fmu *u, bool *a, bool *b, bool *c, bool *d, bool *e, double *t) {
    u->v[2][0] = u->v[1][0]; return *a = *b = *c = *d = *e = false, 0; }"""
    flags = ABLE + ' mightReturnEarlyFromDoStep="true" hasEventMode="true"'
    fmu = three(tmp_path, step=step, more=ASK + events, flags=flags, macros=(f"EVENT={int(event)}",))
    done, found = run(fmu, table(tmp_path, (0, 0), (2, 2)), "--event-mode", "on")
    assert done.returncode == 0, done.stderr
    assert [row["events"] for row in found] == [0, 0, int(event), 0, 0]
    assert found[-1]["x"] == 0.375
    assert found[-1]["y"] == pytest.approx(0.5, abs=1e-12)


def test_a_solver_that_steps_over_the_end_gets_the_input_of_that_time(tmp_path, monkeypatch):
    """Dymola's FMUs of FMI 3 do so and interpolate back, which breaks the standard."""
    monkeypatch.setenv("TERRAGLUE_LOG", "warn")
    step = "if (ask(u, t + 3 * h) != 2 * (t + 3 * h)) return 3; " + RUNGE_KUTTA
    done, found = run(three(tmp_path, step=step), table(tmp_path, (0, 0), (2, 4)))
    assert done.returncode == 0 and found[-1]["y"] == pytest.approx(1, abs=1e-12), done.stderr
    assert done.stderr.count("was given the inputs of that time") == 1 and "for t = 0.75 s in the step from 0 s to 0.25 s" in done.stderr


@pytest.mark.parametrize("time", ["s - 0.5", "NAN", "INFINITY"])
def test_a_time_before_the_step_or_none_is_no_time_for_an_input(tmp_path, time):
    fmu = three(tmp_path, more=ASK.replace("u->env, s,", f"u->env, {time},"))
    done, _ = run(fmu, table(tmp_path, (0, 0), (2, 2)))
    assert done.returncode == 1 and "fmi3DoStep called its intermediate update for t = " in done.stderr, done.stderr
    assert run(fmu, table(tmp_path, (0, 0), (2, 2)), "--hold-inputs")[0].returncode == 0
