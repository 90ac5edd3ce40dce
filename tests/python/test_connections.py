"""Connections of FMUs: whole arrays, other types than f64, units with factor and offset."""

import csv
import subprocess
import zipfile

import pytest

import cfmu
from conftest import terraglue

# All values of a type lie in one array, by reference; `twice` hands on its inputs, doubled or as they are.
CODE = r"""
#include <stdlib.h>
typedef struct { double r[16]; int i[4], b[4]; const char *s[4]; char text[64]; } Fmu;
#include <string.h>
void *fmi2Instantiate(const char *n, int t, const char *g, const char *r, const void *b, int v, int l) {
    Fmu *u = calloc(1, sizeof *u); u->s[0] = u->s[1] = "start"; return u; }
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
int fmi2GetString(Fmu *u, const unsigned *r, size_t n, const char **x) { while (n--) x[n] = u->s[r[n]]; return 0; }
int fmi2SetString(Fmu *u, const unsigned *r, size_t n, const char *const *x) {
    strncpy(u->text, x[0], 63); u->s[0] = u->s[1] = u->text; return 0; }
int fmi2DoStep(Fmu *u, double t, double h, int p) {
    for (int k = 0; k < 4; k++) u->r[8 + k] = u->r[k];
    u->i[1] = 2 * u->i[0]; u->b[1] = u->b[0]; return 0; }
"""


def variable(name, reference, causality, kind="Real", more=""):
    start = {"Real": "0", "Integer": "0", "Boolean": "false", "String": "start"}[kind]
    start = f' start="{start}"' if causality != "output" else ""
    return (
        f'<ScalarVariable name="{name}" valueReference="{reference}" causality="{causality}" '
        f'variability="discrete"><{kind}{start}{more}/></ScalarVariable>'
    )


def description(shape, unit_in, unit_out):
    rows, columns = shape
    names = [f"[{i + 1},{j + 1}]" for i in range(rows) for j in range(columns)]
    all_ = [variable(f"u{n}", k, "input", more=f' unit="{unit_in}"') for k, n in enumerate(names)]
    all_ += [variable(f"y{n}", 8 + k, "output", more=f' unit="{unit_out}"') for k, n in enumerate(names)]
    for name, kind in (("i", "Integer"), ("b", "Boolean"), ("s", "String")):
        all_ += [variable(f"{name}_in", 0, "input", kind), variable(f"{name}_out", 1, "output", kind)]
    outputs = "".join(f'<Unknown index="{k + 1}"/>' for k, v in enumerate(all_) if 'causality="output"' in v)
    return f"""<?xml version="1.0" encoding="UTF-8"?><fmiModelDescription fmiVersion="2.0" modelName="m" guid="g">
<CoSimulation modelIdentifier="m"/><UnitDefinitions><Unit name="m"><BaseUnit m="1"/></Unit>
<Unit name="foot"><BaseUnit m="1" factor="0.3048"/></Unit><Unit name="warmth"><BaseUnit K="1" offset="273.15"/></Unit>
</UnitDefinitions><ModelVariables>{"".join(all_)}</ModelVariables>
<ModelStructure><Outputs>{outputs}</Outputs></ModelStructure></fmiModelDescription>"""


@pytest.fixture(scope="session")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("units")
    (folder / "m.c").write_text(CODE)
    subprocess.run(["cc", "-shared", "-fPIC", "-w", "m.c", "-o", "m.so"], cwd=folder, check=True)
    for name, shape, units in [
        ("metres", (2, 2), ("m", "m")),
        ("feet", (2, 2), ("foot", "foot")),
        ("long", (4, 1), ("m", "m")),
        ("warm", (2, 2), ("warmth", "warmth")),
    ]:
        with zipfile.ZipFile(folder / f"{name}.fmu", "w") as archive:
            archive.writestr("modelDescription.xml", description(shape, *units))
            archive.write(folder / "m.so", "binaries/linux64/m.so")
    return folder


def run(made, tmp_path, second, connections):
    path = made / "scenario.toml"
    connect = "".join(f'[[connect]]\nfrom = "a.{a}"\nto = "b.{b}"\n' for a, b in connections)
    path.write_text(f"""
[time]
step_s = 0.1
duration_s = 0.4
[recording]
every_steps = 1
[a]
fmu = "metres.fmu"
u = [1.0, 2.0]
i_in = 7
b_in = true
s_in = "hello"
[a.start]
"u[1,1]" = 1.0
"u[1,2]" = 2.0
"u[2,1]" = 3.0
"u[2,2]" = 4.0
[b]
fmu = "{second}.fmu"
{connect}
""".replace("u = [1.0, 2.0]\n", ""))
    done = terraglue("run", path, "--csv", "--quiet", "--out", tmp_path / "out")
    rows = list(csv.DictReader((tmp_path / "out" / "variables.csv").open())) if done.returncode == 0 else []
    return done, rows[-1] if rows else None


def test_whole_arrays_and_other_types_are_connected(made, tmp_path):
    names = [("y", "u"), ("i_out", "i_in"), ("b_out", "b_in"), ("s_out", "s_in")]
    done, row = run(made, tmp_path, "metres", names)
    assert done.returncode == 0, done.stderr
    assert [float(row[f"b.y[{i},{j}]"]) for i in (1, 2) for j in (1, 2)] == [1.0, 2.0, 3.0, 4.0]
    assert float(row["b.i_out"]) == 28.0 and row["b.b_out"] in ("true", "1", "1.0")


def test_what_two_fmus_swap_is_never_lost(tmp_path):
    """Outputs that follow inputs at once: all values are read before any is set, so each step swaps them."""
    kinds = (("i", "Integer", "0"), ("b", "Boolean", "false"), ("s", "String", ""))
    others = ""
    for name, kind, start in kinds:
        for end, causality, value in (("in", "input", f' start="{start}"'), ("out", "output", "")):
            others += f'<ScalarVariable name="{name}_{end}" valueReference="0" causality="{causality}" variability="discrete">'
            others += f"<{kind}{value}/></ScalarVariable>"
    cfmu.build(tmp_path, "glass", [("x", "output", 0, "")], "", others)
    path, connect = tmp_path / "swap.toml", ""
    for name, _, _ in kinds:
        for a, b in ("ab", "ba"):
            connect += f'[[connect]]\nfrom = "{a}.{name}_out"\nto = "{b}.{name}_in"\n'
    path.write_text(f"""
[time]
step_s = 0.1
duration_s = 0.5
[recording]
every_steps = 1
[a]
fmu = "glass.fmu"
i_in = 7
b_in = true
s_in = "left"
[b]
fmu = "glass.fmu"
i_in = 9
s_in = "right"
{connect}""")
    done = terraglue("run", path, "--csv", "--quiet", "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    rows = list(csv.DictReader((tmp_path / "out" / "variables.csv").open()))
    pairs = [[{row["a.i_out"], row["b.i_out"]}, {row["a.b_out"], row["b.b_out"]}] for row in rows]
    assert all(len(whole) == 2 and len(truth) == 2 for whole, truth in pairs), rows
    seen = [float(row["a.i_out"]) for row in rows]
    assert len(seen) > 4 and all(x != y for x, y in zip(seen, seen[1:])), seen


def test_units_are_converted_at_connections(made, tmp_path):
    done, row = run(made, tmp_path, "feet", [("y", "u")])
    assert done.returncode == 0, done.stderr
    assert float(row["b.y[2,2]"]) == pytest.approx(4.0 / 0.3048, rel=1e-15)


@pytest.mark.parametrize(
    ("second", "pair", "says"),
    [
        ("long", ("y", "u"), ["[2,2]", "[4,1]"]),
        ("warm", ("y", "u"), ["cannot be connected", "K × 1.0 + 273.15"]),
        ("metres", ("i_out", "b_in"), ["i32", "bool"]),
    ],
)
def test_what_does_not_fit_is_refused(made, tmp_path, second, pair, says):
    done, _ = run(made, tmp_path, second, [pair])
    assert done.returncode == 2
    assert all(word in done.stderr for word in says), done.stderr


def test_explain_and_the_report_say_how_values_go_round(made, tmp_path):
    (made / "circle.toml").write_text("""
[time]
step_s = 0.1
duration_s = 0.4
[a]
fmu = "metres.fmu"
[b]
fmu = "feet.fmu"
step_multiple = 2
[[connect]]
from = "a.y"
to = "b.u"
[[connect]]
from = "b.y[1,1]"
to = "a.u[1,1]"
""")
    done = terraglue("run", made / "circle.toml", "--explain", "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    to = next(line for line in lines if "a.y[1,1] → b.u[1,1]" in line)
    back = next(line for line in lines if "b.y[1,1] → a.u[1,1]" in line)
    assert "3.2808" in to and "m → m × 0.3048" in to and "delay 1:" in to
    assert "delay 1 to 2:" in back and "one step of 2" in back
    assert any("a ⇄ b" in line for line in lines) and any("all outputs are read: a, b" in line for line in lines)
    assert sum("µs" in line for line in lines) == 2, "the cost of each subsystem"
    page = (tmp_path / "out" / "report.html").read_text()
    for words in ("How values went round", "a.y[1,1]", "delay (steps)", "a ⇄ b", "per step (µs)"):
        assert words in page


def mapped(made, tmp_path, pairs):
    path = made / "mapped.toml"
    connect = "".join(f'[[connect]]\nfrom = "a.{a}"\nto = "b.{b}"\nmap = {{ {m} }}\n' for a, b, m in pairs)
    path.write_text(
        "[time]\nstep_s = 0.1\nduration_s = 0.4\n[recording]\nevery_steps = 1\n"
        f'[a]\nfmu = "metres.fmu"\ni_in = 7\nb_in = true\n[b]\nfmu = "metres.fmu"\n{connect}'
    )
    done = terraglue("run", path, "--csv", "--quiet", "--out", tmp_path / "out")
    rows = list(csv.DictReader((tmp_path / "out" / "variables.csv").open())) if done.returncode == 0 else []
    return done, rows[-1] if rows else None, path


def test_values_become_others_by_a_table(made, tmp_path):
    pairs = [("i_out", "i_in", '"0" = 1, "14" = -3'), ("b_out", "b_in", "true = false, false = true")]
    done, row, path = mapped(made, tmp_path, pairs)
    assert done.returncode == 0, done.stderr
    assert float(row["b.i_out"]) == -6.0 and row["b.b_out"] in ("false", "0", "0.0")
    done, row, _ = mapped(made, tmp_path, [("i_out", "b_in", '"0" = false, "14" = true')])
    assert done.returncode == 0 and row["b.b_out"] in ("true", "1", "1.0"), done.stderr
    done = terraglue("run", path, "--explain", "--out", tmp_path / "explained")
    assert any("a.i_out → b.b_in" in line and "by a table" in line for line in done.stdout.splitlines()), done.stdout


@pytest.mark.parametrize(
    ("pair", "code", "says"),
    [
        (("i_out", "i_in", '"0" = 1'), 1, ["`i_out` is 14", "no entry"]),
        (("i_out", "i_in", '"0" = 1.5'), 2, ["`0` of `map`", "whole number"]),
        (("b_out", "b_in", "yes = true"), 2, ["`map` has `yes`", "no value of `b_out`"]),
        (("b_out", "b_in", "true = 2"), 2, ["`map` has `2`", "no value of `b_in`"]),
        (("y[1,1]", "u[1,1]", '"0" = 1'), 2, ["`map` is for truth values"]),
        (("i_out", "i_in", '"0" = 1, "00" = 2'), 2, ["twice"]),
    ],
)
def test_a_table_that_does_not_fit_is_refused(made, tmp_path, pair, code, says):
    done, _, _ = mapped(made, tmp_path, [pair])
    flat = " ".join(done.stderr.replace("│", " ").split())
    assert done.returncode == code and all(word in flat for word in says), done.stderr
