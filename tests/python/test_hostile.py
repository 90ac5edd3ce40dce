"""Units in C that misbehave at every stage of their life, without and with isolation."""

import csv
import pathlib
import subprocess
import tempfile
import zipfile

import pytest

from conftest import terraglue

DESCRIPTION = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="m" guid="g"><CoSimulation modelIdentifier="m"/><ModelVariables>
<ScalarVariable name="x" valueReference="0" causality="output" initial="calculated"><Real/></ScalarVariable>
</ModelVariables><ModelStructure><Outputs><Unknown index="1"/></Outputs></ModelStructure></fmiModelDescription>"""

# The name of the instance says what it does, and when: `segv_step`. Steps do it after t = 0.25 s.
CODE = r"""
#define _GNU_SOURCE
#include <locale.h>
#include <pthread.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
typedef struct { void (*log)(void *, const char *, int, const char *, const char *, ...); void *a, *f, *s, *e; } Back;
typedef struct { char name[64]; Back back; double *small; } Unit;
static void *idle(void *p) { for (;;) pause(); return p; }
static int act(Unit *u, const char *stage) {
    char what[64]; strcpy(what, u->name); char *at = strchr(what, '_');
    if (!at || strcmp(at + 1, stage)) return 0;
    *at = 0;
    if (!strcmp(what, "abort")) abort();
    if (!strcmp(what, "exit")) exit(0);
    if (!strcmp(what, "gone")) _exit(0);
    if (!strcmp(what, "segv")) *(volatile int *)8 = 1;
    if (!strcmp(what, "hang")) for (;;) pause();
    if (!strcmp(what, "heap")) { memset((char *)u->small - 16, 0x55, 64); free(u->small); }
    if (!strcmp(what, "memory")) for (;;) memset(malloc(64 << 20), 1, 64 << 20);
    if (!strcmp(what, "flood")) for (int i = 0; i < 100000; i++) u->back.log(u->back.e, u->name, 1, "c", "line %d", i);
    if (!strcmp(what, "null")) u->back.log(u->back.e, 0, 0, 0, 0);
    if (!strcmp(what, "utf")) u->back.log(u->back.e, u->name, 1, "c", "\xff\xfe\xc3(");
    if (!strcmp(what, "huge")) { char *t = malloc(64 << 20); memset(t, 'a', (64 << 20) - 1); t[(64 << 20) - 1] = 0;
        u->back.log(u->back.e, u->name, 1, "c", "%s", t); free(t); }
    if (!strcmp(what, "close")) for (int i = 3; i < 256; i++) close(i);
    if (!strcmp(what, "folder")) { if (chdir("/")) abort(); setlocale(LC_ALL, "C"); umask(0777); signal(SIGTERM, SIG_IGN); }
    if (!strcmp(what, "thread")) { pthread_t t; pthread_create(&t, 0, idle, 0); }
    if (!strcmp(what, "child")) if (!fork()) { execlp("sleep", "sleep", "98765", (char *)0); _exit(1); }
    return !strcmp(what, "error") ? 3 : !strcmp(what, "fatal") ? 4 : 0;
}
void *fmi2Instantiate(const char *n, int t, const char *g, const char *r, const Back *b, int v, int l) {
    Unit *u = calloc(1, sizeof *u); strncpy(u->name, n, 63); u->back = *b; u->small = malloc(24);
    return act(u, "instantiate") ? 0 : u; }
void fmi2FreeInstance(Unit *u) { act(u, "free"); }
int fmi2SetupExperiment(Unit *u, int a, double b, double c, int d, double e) { return 0; }
int fmi2EnterInitializationMode(Unit *u) { return act(u, "init"); }
int fmi2ExitInitializationMode(Unit *u) { return 0; }
int fmi2Terminate(Unit *u) { return act(u, "terminate"); }
int fmi2GetReal(Unit *u, const unsigned *r, size_t n, double *x) {
    while (n--) x[n] = 1; if (!strcmp(u->name, "overrun_get")) memset(x, 0x55, 1 << 26); return 0; }
int fmi2SetReal(Unit *u, const unsigned *r, size_t n, const double *x) { return 0; }
int fmi2DoStep(Unit *u, double t, double h, int p) { return t > 0.25 ? act(u, "step") : 0; }
#ifdef LOAD
__attribute__((constructor)) static void load(void) { abort(); }
#endif
"""


def build(folder, name, *flags):
    (folder / "m.c").write_text(CODE)
    command = ["cc", "-shared", "-fPIC", "-w", *flags, "m.c", "-o", "m.so", "-lpthread"]
    subprocess.run(command, cwd=folder, check=True, capture_output=True)
    with zipfile.ZipFile(folder / name, "w") as archive:
        archive.writestr("modelDescription.xml", DESCRIPTION)
        archive.write(folder / "m.so", "binaries/linux64/m.so")
    return folder / name


@pytest.fixture(scope="session")
def unit(tmp_path_factory):
    return build(tmp_path_factory.mktemp("hostile"), "m.fmu")


def left_behind():
    folders = set(pathlib.Path(tempfile.gettempdir()).glob("terraglue-*"))
    sleepers = set()
    for process in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            if b"98765" in (process / "cmdline").read_bytes():
                sleepers.add(process.name)
        except OSError:
            pass
    return folders, sleepers


def run(unit, name, tmp_path, isolate):
    path = tmp_path / "x.toml"
    patience = 1.0 if name.startswith("hang") else 60.0
    path.write_text(f"""
[time]
step_s = 0.125
duration_s = 1.0
[recording]
every_steps = 1
[{name}]
fmu = "{unit}"
isolate = {str(isolate).lower()}
step_timeout_s = {patience}
load_timeout_s = {patience}
memory_mb = 500
""")
    return terraglue("run", path, "--csv", "--quiet", "--out", tmp_path / "out", timeout=60)


DEADLY = ["abort", "exit", "gone", "segv", "heap"]
CASES = [(what, "step") for what in [*DEADLY, "hang", "memory", "error", "fatal"]]
CASES += [("segv", stage) for stage in ("instantiate", "init", "terminate", "free")]
CASES += [("exit", "instantiate"), ("hang", "init"), ("hang", "free"), ("error", "terminate"), ("overrun", "get")]


@pytest.mark.parametrize(("what", "stage"), CASES)
def test_an_isolated_unit_cannot_end_the_run(unit, tmp_path, what, stage):
    before = left_behind()
    done = run(unit, f"{what}_{stage}", tmp_path, True)
    assert done.returncode == (2 if what == "error" and stage == "init" else 1), (done.returncode, done.stderr)
    assert f"{what}_{stage}" in done.stderr and "panicked" not in done.stderr, done.stderr
    if stage in ("step", "terminate", "free"):
        rows = list(csv.reader((tmp_path / "out" / "variables.csv").open()))
        assert len(rows) >= (4 if stage == "step" else 10)
        assert terraglue("report", tmp_path / "out").returncode == 0
    after = left_behind()
    assert after[0] <= before[0] and after[1] <= before[1]


def test_a_library_that_aborts_while_it_is_loaded(tmp_path):
    done = run(build(tmp_path, "load.fmu", "-DLOAD"), "x", tmp_path, True)
    assert done.returncode == 1 and "abort" in done.stderr, done.stderr


HARMLESS = ["flood", "null", "utf", "huge", "folder", "thread"]


# Without isolation a unit that closes the recording or leaves processes behind cannot be helped.
@pytest.mark.parametrize(
    ("what", "isolate"), [(w, i) for w in HARMLESS for i in (False, True)] + [("close", True), ("child", True)]
)
def test_what_kills_nobody_spoils_nothing(unit, tmp_path, what, isolate):
    before = left_behind()
    done = run(unit, f"{what}_step", tmp_path, isolate)
    # Descriptors that were closed are missed when the unit ends: its error, after a complete run.
    assert done.returncode == (1 if what == "close" else 0), done.stderr
    assert len(list(csv.reader((tmp_path / "out" / "variables.csv").open()))) == 10
    assert len(done.stderr) < 100_000
    after = left_behind()
    assert after[0] <= before[0] and after[1] <= before[1]


@pytest.mark.parametrize("what", ["exit", "gone"])
def test_success_is_never_pretended(unit, tmp_path, what):
    assert run(unit, f"{what}_step", tmp_path, True).returncode == 1
    if what == "exit":
        assert run(unit, "exit_step", tmp_path, False).returncode == 1


def test_plugins_can_be_isolated(tmp_path):
    """A walk over an isolated soil is the walk, bit by bit."""
    from conftest import MOON_WALK

    rows = []
    for isolate in ("false", "true"):
        out = tmp_path / isolate
        sets = ["--set", f"soil.isolate={isolate}", "--set", "recording.every_steps=1"]
        done = terraglue("run", MOON_WALK, "--duration", "0.05", "--csv", "--quiet", "--out", out, *sets)
        assert done.returncode == 0, done.stderr
        rows.append((out / "variables.csv").read_bytes())
    assert rows[0] == rows[1]


