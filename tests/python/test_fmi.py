"""Functional mock-up units made here in C, and archives that are no FMUs."""

import csv
import pathlib
import subprocess
import tempfile
import zipfile

import pytest

import cfmu
from conftest import terraglue

DESCRIPTION = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="m" guid="g">
<CoSimulation modelIdentifier="m"/><ModelVariables/><ModelStructure/></fmiModelDescription>
"""

VARIABLES = """<ModelVariables>
<ScalarVariable name="k" valueReference="0" causality="parameter" variability="tunable"><Real start="1"/></ScalarVariable>
<ScalarVariable name="x" valueReference="1" causality="output" initial="calculated"><Real/></ScalarVariable>
<ScalarVariable name="mode" valueReference="2" causality="parameter"><Real start="0"/></ScalarVariable>
</ModelVariables><ModelStructure><Outputs><Unknown index="2"/></Outputs></ModelStructure>"""

# x' = -k x by Euler's explicit rule; after t = 0.25 s it acts by `mode`: 1 NaN, 2 error, 3 fatal, 4 discards
# steps longer than 0.1 s, 5 answers a status that does not exist.
CODE = r"""
#include <math.h>
#include <stdlib.h>
#include <string.h>
typedef struct { double v[3]; int dead; } Fmu;
typedef struct { void (*log)(void *, const char *, int, const char *, const char *, ...); void *a, *f, *s, *e; } Back;
static Back back;
void *fmi2Instantiate(const char *n, int t, const char *g, const char *r, const Back *b, int v, int l) {
    Fmu *u = calloc(1, sizeof *u); back = *b; u->v[0] = u->v[1] = 1; return u; }
void fmi2FreeInstance(Fmu *u) { if (u->dead) abort(); free(u); }
int fmi2SetupExperiment(Fmu *u, int a, double b, double c, int d, double e) { return 0; }
int fmi2EnterInitializationMode(Fmu *u) { return 0; }
int fmi2ExitInitializationMode(Fmu *u) { return 0; }
int fmi2Terminate(Fmu *u) { if (u->dead) abort(); return 0; }
int fmi2GetReal(Fmu *u, const unsigned *r, size_t n, double *x) { while (n--) x[n] = u->v[r[n]]; return 0; }
int fmi2SetReal(Fmu *u, const unsigned *r, size_t n, const double *x) { while (n--) u->v[r[n]] = x[n]; return 0; }
int fmi2GetFMUstate(Fmu *u, void **s) { if (!*s) *s = malloc(sizeof *u); memcpy(*s, u, sizeof *u); return 0; }
int fmi2SetFMUstate(Fmu *u, void *s) { memcpy(u, s, sizeof *u); return 0; }
int fmi2FreeFMUstate(Fmu *u, void **s) { free(*s); *s = 0; return 0; }
int fmi2DoStep(Fmu *u, double t, double h, int p) {
    int m = t > 0.25 ? (int)u->v[2] : 0;
    if (m == 4 && h > 0.1) return 2;
    u->v[1] -= h * u->v[0] * u->v[1];
    if (m == 1) u->v[1] = NAN;
    if (m == 2) { back.log(back.e, "u", 3, "solver", "pressure %d is too high", 42); return 3; }
    if (m == 3) { u->dead = 1; return 4; }
    return m == 5 ? 77 : 0;
}
"""


@pytest.fixture(scope="session")
def decay(tmp_path_factory):
    folder = tmp_path_factory.mktemp("decay")
    (folder / "m.c").write_text(CODE)
    command = ["cc", "-shared", "-fPIC", "-w", "m.c", "-o", "m.so", "-lm"]
    subprocess.run(command, cwd=folder, check=True, capture_output=True)
    flags = 'modelIdentifier="m" canGetAndSetFMUstate="true" canHandleVariableCommunicationStepSize="true"'
    text = DESCRIPTION.replace('modelIdentifier="m"', flags)
    text = text.replace("<ModelVariables/><ModelStructure/>", VARIABLES)
    with zipfile.ZipFile(folder / "decay.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", text)
        archive.write(folder / "m.so", "binaries/linux64/m.so")
    return folder / "decay.fmu"


def left_behind():
    return set(pathlib.Path(tempfile.gettempdir()).glob("terraglue-fmu-*"))


@pytest.mark.parametrize(
    ("mode", "says"),
    [
        (1, "`x` is NaN"),
        (2, "pressure 42 is too high"),
        (3, "status fatal"),
        (5, "77, which is no status"),
    ],
)
def test_an_fmu_that_fails_stops_the_run_and_is_named(decay, tmp_path, mode, says):
    path = tmp_path / "decay.toml"
    path.write_text(
        f'[time]\nstep_s = 0.125\nduration_s = 1.0\n[recording]\nevery_steps = 1\n'
        f'[decay]\nfmu = "{decay}"\nmode = {mode}\n'
    )
    runs = [
        terraglue("fmu", "run", decay, "--stop", "1", "--step", "0.125", "--start", f"mode={mode}"),
        terraglue("run", path, "--out", tmp_path / "out", "--csv", "--quiet"),
    ]
    for done in runs:
        assert done.returncode == 1, done.stderr
        assert says in done.stderr and ("0.375" in done.stderr or "0.5" in done.stderr), done.stderr
        assert "decay" in done.stderr
    rows = list(csv.reader((tmp_path / "out" / "variables.csv").open()))
    assert len(rows) >= 4, "the recording up to the failure is readable"


@pytest.mark.parametrize("value", ["NAN", "-INFINITY"])
def test_a_single_precision_output_that_is_no_number_stops_the_run(tmp_path, value):
    get = """int fmi3GetFloat32(Fmu *u, const unsigned *r, size_t k, float *x, size_t m) {
        for (size_t i = 0; i < m; i++) x[i] = u->v[1][0] > 0.3 ? %s : 1.5f; return 0; }""" % value
    fmu = cfmu.build_3(tmp_path, "single", [("x", "output", "", ())], "v[1][0] += h;", more=get)
    with zipfile.ZipFile(fmu) as archive:
        entries = {name: archive.read(name) for name in archive.namelist()}
    entries["modelDescription.xml"] = entries["modelDescription.xml"].replace(
        b'<Float64 name="x" valueReference="1" causality="output"></Float64>',
        b'<Float32 name="x" valueReference="1" causality="output"/>',
    )
    assert b"Float32" in entries["modelDescription.xml"]
    with zipfile.ZipFile(fmu, "w") as archive:
        for name, content in entries.items():
            archive.writestr(name, content)
    scenario = tmp_path / "single.toml"
    scenario.write_text('[time]\nstep_s = 0.125\nduration_s = 1.0\n[recording]\nevery_steps = 1\n[single]\nfmu = "single.fmu"\n')
    for done in (
        terraglue("fmu", "run", fmu, "--stop", "1", "--step", "0.125"),
        terraglue("run", scenario, "--out", tmp_path / "out", "--quiet"),
    ):
        assert done.returncode == 1, done.stderr
        assert f"`x` is {'NaN' if value == 'NAN' else '-inf'}" in done.stderr, done.stderr


def test_a_library_whose_name_is_no_identifier_of_c_runs_with_a_warning(tmp_path):
    fmu = cfmu.build(tmp_path, "tank", [("x", "output", 0, "")], "r[0] += h;")
    with zipfile.ZipFile(fmu) as archive:
        text = archive.read("modelDescription.xml").decode()
        library = archive.read("binaries/linux64/m.so")
    with zipfile.ZipFile(fmu, "w") as archive:
        archive.writestr("modelDescription.xml", text.replace('modelIdentifier="m"', 'modelIdentifier="tank-c"'))
        archive.writestr("binaries/linux64/tank-c.so", library)
    scenario = tmp_path / "tank.toml"
    scenario.write_text('[time]\nstep_s = 0.25\nduration_s = 1.0\n[tank]\nfmu = "tank.fmu"\n')
    runs = [
        terraglue("fmu", "run", fmu, "--stop", "1", "--step", "0.25"),
        terraglue("run", scenario, "--out", tmp_path / "out", "--quiet"),
    ]
    for done in runs:
        assert done.returncode == 0, done.stderr
        assert 'modelIdentifier = "tank-c" is no identifier of C' in done.stderr
    assert runs[0].stdout.splitlines()[-1] == "1,1"
    assert "is no identifier of C" in terraglue("fmu", "check", fmu).stdout


def both_ways(fmu, tmp_path, more=""):
    """An FMU of FMI 3.0 run alone and as a subsystem, 1 s in steps of 0.25 s; the end of x of each where it got there."""
    scenario = tmp_path / "both.toml"
    scenario.write_text(
        f'[time]\nstep_s = 0.25\nduration_s = 1.0\n[recording]\nevery_steps = 1\n[unit]\nfmu = "{fmu}"\n{more}\n'
    )
    alone = terraglue("fmu", "run", fmu, "--stop", "1", "--step", "0.25")
    inside = terraglue("run", scenario, "--out", tmp_path / "out", "--csv", "--quiet")
    rows = list(csv.DictReader((tmp_path / "out" / "variables.csv").open()))
    return alone, inside, (alone.stdout.splitlines() or [""])[-1], float(rows[-1]["unit.x"])


@pytest.mark.parametrize(("macros", "step"), [(["SILENT"], ""), ([], "*last = NAN;"), (["SILENT"], "*early = true;")])
def test_a_step_counts_as_made_where_the_fmu_does_not_say_how_far_it_came(tmp_path, macros, step):
    """A value that it does write is checked, and a step that it leaves early needs one."""
    fmu = cfmu.build_3(tmp_path, "silent", [("x", "output", "", ())], f"v[1][0] += h; {step}", macros=macros)
    alone, inside, last, end = both_ways(fmu, tmp_path)
    if step:
        assert (alone.returncode, inside.returncode) == (1, 1)
        assert "came to t = NaN s" in alone.stderr and "came to t = NaN s" in inside.stderr
        return
    assert (alone.returncode, inside.returncode) == (0, 0), alone.stderr + inside.stderr
    assert (last, end) == ("1,1", 1.0)
    for done in (alone, inside):
        assert done.stderr.count("does not say how far it came (lastSuccessfulTime)") == 1, done.stderr


def test_an_early_return_that_is_not_allowed_is_told_once(tmp_path):
    step = "if (h > 0.2) { v[1][0] += 0.1; *early = true; *last = t + 0.1; return 0; } v[1][0] += h;"
    fmu = cfmu.build_3(tmp_path, "early", [("x", "output", "", ())], step)
    alone, inside, last, end = both_ways(fmu, tmp_path)
    assert (alone.returncode, inside.returncode) == (0, 0), alone.stderr + inside.stderr
    assert end == pytest.approx(1.0, abs=1e-12) and float(last.split(",")[1]) == pytest.approx(1.0, abs=1e-12)
    assert alone.stderr.count("which was not allowed (earlyReturnAllowed = false)") == 1, alone.stderr


def test_an_fmu_that_saves_nothing_runs_without_its_state(tmp_path):
    fmu = cfmu.build_3(tmp_path, "forgetful", [("x", "output", "", ())], "v[1][0] += h;", macros=["SAVES_NOTHING"])
    alone, inside, last, _ = both_ways(fmu, tmp_path)
    assert (alone.returncode, last) == (0, "1,1"), alone.stderr
    assert alone.stderr.count("saved nothing") == 1
    assert inside.returncode == 1 and "`rollback = false`" in inside.stderr, inside.stderr
    _, inside, _, end = both_ways(fmu, tmp_path, "rollback = false")
    assert (inside.returncode, end) == (0, 1.0), inside.stderr


def test_a_discarded_step_is_halved(decay):
    done = terraglue("fmu", "run", decay, "--stop", "1", "--step", "0.125", "--start", "mode=4")
    assert done.returncode == 0, done.stderr
    last = done.stdout.splitlines()[-1].split(",")
    assert float(last[1]) == pytest.approx(0.875**3 * 0.9375**10, rel=1e-14)


def test_steps_are_for_good_unless_a_state_is_kept(tmp_path):
    """Some FMUs stay where they are in a step after which an earlier state might be set again."""
    fmu = cfmu.build(tmp_path, "wary", [("x", "output", 0, "")], "if (p) r[0] += h;")
    done = terraglue("fmu", "run", fmu, "--stop", "1", "--step", "0.25")
    assert [line.split(",")[1] for line in done.stdout.splitlines()[1:]] == ["0", "0.25", "0.5", "0.75", "1"]
    scenario = tmp_path / "wary.toml"
    scenario.write_text('[time]\nstep_s = 0.25\nduration_s = 1.0\n[recording]\nevery_steps = 1\n[wary]\nfmu = "wary.fmu"\n')
    done = terraglue("run", scenario, "--out", tmp_path / "out", "--csv", "--quiet")
    assert done.returncode == 0, done.stderr
    rows = list(csv.DictReader((tmp_path / "out" / "variables.csv").open()))
    assert float(rows[-1]["wary.x"]) == 1.0


def test_an_fmu_runs_alone(decay, tmp_path):
    out = tmp_path / "out.csv"
    done = terraglue("fmu", "run", decay, "--stop", "1", "--step", "0.125", "--start", "k=2", "--csv", out)
    assert done.returncode == 0, done.stderr
    rows = list(csv.DictReader(out.open()))
    x = 1.0
    for row in rows[1:]:
        x = x - 0.125 * 2 * x
        assert float(row["x"]) == x
    assert len(rows) == 9


def test_nothing_is_left_behind(decay):
    before = left_behind()
    for mode in (0, 2, 3):
        terraglue("fmu", "run", decay, "--stop", "1", "--step", "0.125", "--start", f"mode={mode}")
    assert left_behind() <= before


def test_an_fmu_is_a_subsystem(decay, tmp_path):
    path = tmp_path / "decay.toml"
    path.write_text(f"""
[time]
step_s = 0.125
duration_s = 1.0
[recording]
every_steps = 1
[decay]
fmu = "{decay}"
k = 2.0
""")
    done = terraglue("run", path, "--out", tmp_path / "out", "--csv", "--quiet")
    assert done.returncode == 0, done.stderr
    rows = list(csv.reader((tmp_path / "out" / "variables.csv").open()))
    column = next(i for i, name in enumerate(rows[0]) if name.startswith("decay.x"))
    assert float(rows[-1][column]) == 0.75**8


@pytest.mark.parametrize(
    ("entries", "says"),
    [
        ({"a.txt": ""}, "no modelDescription.xml"),
        ({"../x": "", "modelDescription.xml": DESCRIPTION}, "leads out"),
        ({"/x": "", "modelDescription.xml": DESCRIPTION}, "absolute path"),
        ({"modelDescription.xml": DESCRIPTION}, "no library"),
        ({"modelDescription.xml": DESCRIPTION.replace('modelIdentifier="m"', 'modelIdentifier="$(id)"')}, "identifier"),
        ({"modelDescription.xml": DESCRIPTION.replace("2.0", "9")}, "fmiVersion"),
        ({"modelDescription.xml": DESCRIPTION.encode("utf-16")}, "UTF-16"),
        ({"modelDescription.xml": "<a>" * 100_000}, "nested"),
        ({"modelDescription.xml": '<!DOCTYPE a [<!ENTITY b "c">]><a>&b;</a>'}, "DTD"),
    ],
)
def test_an_archive_that_is_no_fmu_is_refused(tmp_path, entries, says):
    path = tmp_path / "x.fmu"
    with zipfile.ZipFile(path, "w") as archive:
        for name, text in entries.items():
            archive.writestr(name, text)
    done = terraglue("fmu", "run", path)
    assert done.returncode in (1, 2)
    assert says in done.stderr, done.stderr
    assert "panicked" not in done.stderr
