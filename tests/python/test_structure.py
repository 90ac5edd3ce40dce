"""Structural parameters of FMI 3: set in configuration mode, arrays of other sizes, wrong values refused by name."""

import csv

import pytest

from cfmu import build_3
from conftest import terraglue

# x' = A x + u by Euler's explicit rule; the start is A = identity, x0 = 1, 2, 3, whatever n is
STEP = r"""double d[8];
for (size_t i = 0; i < n; i++) { d[i] = v[5][i]; for (size_t j = 0; j < n; j++) d[i] += v[2][i * n + j] * v[4][j]; }
for (size_t i = 0; i < n; i++) v[4][i] += h * d[i];"""
START = r"""for (size_t i = 0; i < u->n; i++) { v[3][i] = v[4][i] = i + 1; for (size_t j = 0; j < u->n; j++) v[2][i * u->n + j] = i == j; }"""
VARIABLES = [
    ("A", "parameter", "1 0 0 0 1 0 0 0 1", ("n", "n")),
    ("x0", "parameter", "1 2 3", ("n",)),
    ("x", "output", "", ("n",)),
    ("u", "input", "0 0 0", ("n",)),
]


@pytest.fixture(scope="session")
def space(tmp_path_factory):
    folder = tmp_path_factory.mktemp("space")
    step = "if (t == 0) memcpy(v[4], v[3], 8 * n); " + STEP
    build_3(folder, "space", VARIABLES, step, START, n=3)
    build_3(folder, "plain", VARIABLES, step, START, n=3, macros=["PLAIN"])
    return folder


def euler(a, x, u, h, steps):
    for _ in range(steps):
        d = [u[i] + sum(a[i][j] * x[j] for j in range(len(x))) for i in range(len(x))]
        x = [x[i] + h * d[i] for i in range(len(x))]
    return x


def scenario(space, path, keys):
    path.write_text(f'[time]\nstep_s = 0.125\nduration_s = 1.0\n[recording]\nevery_steps = 1\n[s]\nfmu = "{space}/space.fmu"\n{keys}')
    return terraglue("run", path, "--csv", "--quiet", "--out", path.parent / "out")


@pytest.mark.parametrize("n", [1, 2, 3, 5])
def test_an_fmu_runs_alone_in_another_size(space, n):
    done = terraglue("fmu", "run", space / "space.fmu", "--stop", "1", "--step", "0.125", "--start", f"n={n}")
    assert done.returncode == 0, done.stderr
    rows = list(csv.DictReader(done.stdout.splitlines()))
    assert list(rows[0]) == ["time", *(f"x[{k + 1}]" for k in range(n))]
    unity = [[float(i == j) for j in range(n)] for i in range(n)]
    own = euler(unity, [k + 1.0 for k in range(n)], [0.0] * n, 0.125, 8)
    assert [float(rows[-1][f"x[{k + 1}]"]) for k in range(n)] == own


def test_arrays_are_given_with_the_size_and_set_from_the_scenario(space, tmp_path):
    keys = "n = 2\nA = [[0.0, 1.0], [-1.0, -0.5]]\nx0 = [1.0, 0.0]\n[s.start]\n\"u[2]\" = 0.25\n\"u[1]\" = 0.0\n"
    done = scenario(space, tmp_path / "a.toml", keys)
    assert done.returncode == 0, done.stderr
    rows = list(csv.DictReader((tmp_path / "out" / "variables.csv").open()))
    assert [name for name in rows[0] if name.startswith("s.x[")] == ["s.x[1]", "s.x[2]"]
    own = euler([[0.0, 1.0], [-1.0, -0.5]], [1.0, 0.0], [0.0, 0.25], 0.125, 8)
    assert [float(rows[-1][f"s.x[{k}]"]) for k in (1, 2)] == own
    isolated = scenario(space, tmp_path / "b.toml", "isolate = true\n" + keys)
    assert isolated.returncode == 0, isolated.stderr
    assert list(csv.DictReader((tmp_path / "out" / "variables.csv").open())) == rows


@pytest.mark.parametrize(
    ("start", "says"),
    [
        ("n=0", ["n = 0", "from 1 to 5"]),
        ("n=6", ["n = 6", "from 1 to 5"]),
        ("n=-1", ["n = -1", "from 1 to 5"]),
        ("n=4", ["n = 4", "fmi3SetUInt64", "four is not for me"]),
        ("n=2.5", ["`n` = 2.5", "whole number"]),
        ("n=18446744073709551616", ["from 1 to 5"]),
    ],
)
def test_a_wrong_value_is_refused_by_name(space, tmp_path, start, says):
    done = terraglue("fmu", "run", space / "space.fmu", "--stop", "1", "--step", "0.125", "--start", start)
    # only a value that the FMU itself rejects is a failure of the run
    code = 1 if "fmi3SetUInt64" in says else 2
    assert done.returncode == code and all(word in done.stderr for word in says), done.stderr
    value = start.split("=")[1]
    if len(value) > 10:
        return
    done = scenario(space, tmp_path / "a.toml", f"n = {value}\n")
    flat = " ".join(done.stderr.replace("│", " ").split())
    assert done.returncode in (1, 2) and "s" in flat and says[-1] in flat, done.stderr


def test_what_is_not_there_or_too_late_is_refused(space, tmp_path):
    done = terraglue("fmu", "run", space / "plain.fmu", "--stop", "1", "--step", "0.125", "--start", "n=2")
    assert done.returncode == 1 and "fmi3EnterConfigurationMode" in done.stderr and "n = 2" in done.stderr, done.stderr
    done = terraglue("fmu", "run", space / "plain.fmu", "--stop", "1", "--step", "0.125")
    assert done.returncode == 0, "an FMU whose size nobody changes needs no configuration mode"
    done = scenario(space, tmp_path / "a.toml", "n = 2\nx0 = [1.0]\n")
    flat = " ".join(done.stderr.replace("│", " ").split())
    assert done.returncode == 2 and "`x0[2]` lacks a value" in flat and "give all 2" in flat, done.stderr
    done = scenario(space, tmp_path / "a.toml", "n = 2\n[s.start]\n\"x0[3]\" = 1.0\n")
    assert done.returncode == 2 and "x0[3]" in done.stderr, done.stderr
    event = '[[event]]\nat_s = 0.0\nset = { "s.n" = 2 }\n'
    done = scenario(space, tmp_path / "a.toml", event)
    assert done.returncode != 0 and "in the table of its FMU" in " ".join(done.stderr.replace("│", " ").split()), done.stderr


def test_arrays_are_fed_over_time_whole_or_by_elements(space, tmp_path):
    tables = {
        "whole.csv": "time,u\n0,0 1\n1,2 1\n",
        "elements.csv": "time,u[2],u[1]\n0,1,0\n1,1,2\n",
    }
    x = [1.0, 2.0]
    for k in range(8):
        u = [2 * k / 8, 1.0]
        x = [a + 0.125 * (b + a) for a, b in zip(x, u, strict=True)]
    command = ("fmu", "run", space / "space.fmu", "--stop", "1", "--step", "0.125", "--start", "n=2", "--input")
    for name, text in tables.items():
        (tmp_path / name).write_text(text)
        done = terraglue(*command, tmp_path / name)
        assert done.returncode == 0, done.stderr
        last = list(csv.DictReader(done.stdout.splitlines()))[-1]
        assert [float(last[f"x[{k}]"]) for k in (1, 2)] == pytest.approx(x, rel=1e-14)
    for text, says in (("time,u\n0,0 1 2\n", "not 2 numbers"), ("time,u[3]\n0,1\n", "no variable `u[3]`"), ("time,u\n0,nan 1\n", "not 2")):
        (tmp_path / "wrong.csv").write_text(text)
        done = terraglue(*command, tmp_path / "wrong.csv")
        assert done.returncode == 2 and says in done.stderr, done.stderr
