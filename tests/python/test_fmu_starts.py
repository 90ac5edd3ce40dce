"""What FMUs start with: connected values, numbers of enumerations, what may be set; clocks that count from the start; what they do to the program."""

import csv
import zipfile

import pytest
from cfmu import build, build_3
from conftest import recorded, terraglue

LAG = [("u", "input", 0.0, ""), ("x", "output", 0.0, "")]
ITEMS = '<SimpleType name="T"><Enumeration><Item name="one" value="1"/><Item name="two" value="2"/><Item name="three" value="3"/></Enumeration></SimpleType>'
CHOICE = '<ScalarVariable name="e" valueReference="0" causality="{}" variability="{}"><Enumeration declaredType="T"{}/></ScalarVariable>'


def run(folder, text):
    return recorded(folder, text)[0]


def rows(folder, text):
    done, found = recorded(folder, text)
    assert done.returncode == 0, done.stderr
    return found


def time(step, duration):
    return f"[time]\nstep_s = {step!r}\nduration_s = {duration!r}\n[recording]\nevery_steps = 1\ndigits = 17\n"


@pytest.mark.parametrize("keys", ["", "isolate = true", "rollback = false"])
@pytest.mark.parametrize("between", [False, True])
def test_an_initialisation_has_the_values_that_are_connected(tmp_path, keys, between):
    """x(0) is what u is at the end of the initialisation, whether or not an output of the scenario depends on an input at once."""
    own = "int fmi2ExitInitializationMode(Fmu *u) { u->r[1] = u->r[0]; return 0; }"
    build(tmp_path, "source", [("y", "output", 5.0, "")], "r[0] = 5;", depends="")
    build(tmp_path, "lag", LAG, "r[1] += h * (r[0] - r[1]);", more=own, instead=["fmi2ExitInitializationMode"], depends="")
    build(tmp_path, "gain", [("u", "input", 0.0, ""), ("y", "output", 0.0, "")], "r[1] = r[0];", more="int fmi2GetReal(Fmu *u, const unsigned *r, "
          "size_t n, double *x) { u->r[1] = u->r[0]; while (n--) x[n] = u->r[r[n]]; return 0; }", instead=["fmi2GetReal"], depends="1")
    link = '[[connect]]\nfrom = "{}"\nto = "{}"\n'
    text = time(0.1, 0.2) + "".join(f'[{name}]\nfmu = "{name}.fmu"\n{keys}\n' for name in ["source", "lag", *["gain"] * between])
    links = [("source.y", "gain.u"), ("gain.y", "lag.u")] if between else [("source.y", "lag.u")]
    found = rows(tmp_path, text + "".join(link.format(*ends) for ends in links))
    assert [float(row["lag.x"]) for row in found] == [5.0] * 3


def test_a_number_of_an_enumeration_is_that_of_the_fmu(tmp_path):
    build(tmp_path, "items", [("y", "output", 0.0, "")], "r[0] = i[0];", others=CHOICE.format("parameter", "tunable", ' start="1"'), types=ITEMS)
    for value, expected in [("1", 1), ("3", 3), ('"two"', 2)]:
        assert float(rows(tmp_path, time(0.1, 0.1) + f'[x]\nfmu = "items.fmu"\ne = {value}\n')[-1]["x.y"]) == expected
    for value in ["0", "4", '"four"']:
        done = run(tmp_path, time(0.1, 0.1) + f'[x]\nfmu = "items.fmu"\ne = {value}\n')
        assert done.returncode == 2 and "one = 1, two = 2, three = 3" in done.stderr, done.stderr
    done = terraglue("fmu", "run", "items.fmu", "--start", "e=4", "--stop", "0.1", cwd=tmp_path)
    assert done.returncode == 2 and "one = 1, two = 2, three = 3" in done.stderr, done.stderr


@pytest.mark.parametrize("start", [0.0, 2.0, -1.25])
@pytest.mark.parametrize(("interval", "shift"), [(0.1, 0.55), (0.3, 0.05)])
def test_shifts_of_clocks_count_from_the_start(tmp_path, start, interval, shift):
    clock = f'<Clock name="c" valueReference="8" causality="input" intervalVariability="constant" intervalDecimal="{interval}" shiftDecimal="{shift}"/>'
    more = ("int fmi3SetClock(Fmu *u, const unsigned *r, size_t n, const bool *x) { if (*x) u->v[1][0] += 1; return 0; }\n"
            "int fmi3EnterEventMode(Fmu *u) { return 0; }\nint fmi3EnterStepMode(Fmu *u) { return 0; }\n"
            "int fmi3UpdateDiscreteStates(Fmu *u, bool *a, bool *b, bool *c, bool *d, bool *e, double *f) { *a = *b = *c = *d = *e = false; return 0; }")
    build_3(tmp_path, "clock", [("y", "output", None, [])], "", more=more, flags='hasEventMode="true"', others=clock)
    expected = sum(shift + k * interval <= 1 + 1e-9 for k in range(100))
    done = terraglue("fmu", "run", "clock.fmu", "--event-mode", "on", "--start-time", start, "--stop", start + 1, "--step", 0.1, "--csv", "a.csv", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert float(list(csv.DictReader((tmp_path / "a.csv").open()))[-1]["y"]) == expected
    found = rows(tmp_path, time(0.1, 1.0) + f'[x]\nfmu = "clock.fmu"\nevent_mode = true\nstart_time_s = {start!r}\n')
    assert float(found[-1]["x.y"]) == expected


KINDS = ('<ScalarVariable name="c" valueReference="7" causality="local" variability="constant" initial="exact"><Real start="1"/></ScalarVariable>'
         '<ScalarVariable name="l" valueReference="8" causality="local"><Real/></ScalarVariable>'
         '<ScalarVariable name="f" valueReference="9" causality="parameter" variability="fixed"><Real start="1" min="0" max="5"/></ScalarVariable>'
         '<ScalarVariable name="n" valueReference="1" causality="parameter" variability="fixed"><Integer start="1"/></ScalarVariable>')


@pytest.mark.parametrize(
    ("arguments", "table", "words"),
    [
        (["--start", "c=1"], None, ["`c` cannot be set"]),
        (["--start", "l=1"], None, ["`l` cannot be set"]),
        (["--start", "x=1"], None, ["`x` cannot be set"]),
        (["--start", "f=9"], None, ["`f` = 9", "from 0 to 5"]),
        (["--start", "f=nan"], None, ["`f`", "finite"]),
        (["--start", "n=2.5"], None, ["`n` = 2.5", "one whole number"]),
        (["--start", "f=1 2"], None, ["`f` = 1 2", "one number"]),
        ([], "time,x\n0,1\n", ["column `x`", "read only"]),
        ([], "time,f\n0,1\n", ["column `f`", "--start f="]),
        ([], "time,u,u\n0,1,2\n", ["two columns", "`u`"]),
        ([], "time,u\n0,1\n0.05,\n1,2\n", ["in.csv, line 3", "`u`", "no number"]),
    ],
)
def test_what_the_standard_does_not_let_be_set_is_refused(tmp_path, arguments, table, words):
    build(tmp_path, "kinds", LAG, "r[1] = r[0];", others=KINDS)
    if table:
        (tmp_path / "in.csv").write_text(table)
        arguments = ["--input", "in.csv"]
    done = terraglue("fmu", "run", "kinds.fmu", *arguments, "--stop", "0.1", cwd=tmp_path)
    assert done.returncode == 2 and all(word in done.stderr for word in words), done.stderr
    if arguments[0] == "--start" and "=9" in arguments[1]:
        done = run(tmp_path, time(0.1, 0.1) + '[x]\nfmu = "kinds.fmu"\nf = 9.0\n')
        assert done.returncode == 2 and all(word in done.stderr for word in words), done.stderr


def test_an_event_on_a_connected_input_is_warned_of(tmp_path):
    build(tmp_path, "source", [("y", "output", 5.0, "")], "r[0] = 5;", depends="")
    build(tmp_path, "lag", LAG, "r[1] = r[0];")
    text = time(0.1, 0.2) + '[s]\nfmu = "source.fmu"\n[g]\nfmu = "lag.fmu"\n[[connect]]\nfrom = "s.y"\nto = "g.u"\n'
    assert "a connection feeds" not in run(tmp_path, text).stderr
    done = run(tmp_path, text + '[[event]]\nat_s = 0.1\nset = { "g.u" = 100.0 }\n')
    assert done.returncode == 0 and "`g.u`, which a connection feeds" in done.stderr and "[[fault]]" in done.stderr, done.stderr


def test_a_loop_that_another_connection_leaves_open_is_warned_of(tmp_path):
    build(tmp_path, "m", LAG, "r[1] += h * r[0];", depends="")
    build(tmp_path, "k", LAG, "r[1] = -r[0];", depends="1")
    text = time(0.1, 0.2) + '[m]\nfmu = "m.fmu"\n[k]\nfmu = "k.fmu"\n'
    link = '[[connect]]\nfrom = "{}"\nto = "{}"\norder = "{}"\n'
    for back, warns in [("jacobi", True), ("iterate", False), ("structure", True)]:
        done = run(tmp_path, text + link.format("m.x", "k.u", "iterate") + link.format("k.x", "m.u", back))
        assert done.returncode == 0 and ("its loop is open" in done.stderr) == warns, done.stderr


FORK = "#include <sys/wait.h>\n#include <unistd.h>\n"


@pytest.mark.parametrize("code", [0, 7])
def test_a_process_that_an_fmu_forks_may_exit(tmp_path, code):
    """It is not the run: its exit hooks do nothing, and the FMU learns its exit code."""
    step = f"if (t > 0.15 && t < 0.25) {{ int s = 0, c = fork(); if (!c) exit({code}); waitpid(c, &s, 0); r[0] = 100 + WEXITSTATUS(s); }}"
    build(tmp_path, "forks", [("y", "output", 0.0, "")], step, more=FORK)
    found = rows(tmp_path, time(0.1, 0.4) + '[x]\nfmu = "forks.fmu"\nisolate = false\n')
    assert float(found[-1]["x.y"]) == 100 + code and len(found) == 5
    done = terraglue("fmu", "run", "forks.fmu", "--stop", "0.4", "--step", "0.1", cwd=tmp_path)
    assert done.returncode == 0 and done.stdout.splitlines()[-1].endswith(f",{100 + code}") and not done.stderr, done.stderr


def test_a_failure_without_a_message_is_reported_by_the_process_that_waits(tmp_path):
    build(tmp_path, "shut", [("y", "output", 0.0, "")], "if (t > 0.15) { close(0); close(1); close(2); }", more="#include <unistd.h>\n")
    done = terraglue("fmu", "run", "shut.fmu", "--isolate", "--stop", "0.5", "--step", "0.1", cwd=tmp_path)
    assert done.returncode == 1 and "shut.fmu" in done.stderr and "closed" in done.stderr, (done.returncode, done.stderr)


def test_a_flood_is_cut_with_a_note(tmp_path):
    build(tmp_path, "flood", [("y", "output", 0.0, "")], 'for (int k = 0; k < 40000; k++) fprintf(stderr, "0123456789012345678901234567890\\n");', more="#include <stdio.h>\n")
    done = terraglue("fmu", "run", "flood.fmu", "--isolate", "--stop", "0.2", "--step", "0.1", cwd=tmp_path)
    assert done.returncode == 0 and done.stderr.count("the rest is left out") == 1, done.stderr[-300:]


def test_a_solver_that_goes_on_by_less_than_its_own_step_has_made_the_step(tmp_path):
    flags = 'fixedInternalStepSize="0.001"'
    build_3(tmp_path, "over", [("y", "output", None, [])], "*last = t + h + 1e-5; v[1][0] += 1;", flags=flags)
    for step in [0.01, 0.003, 0.001]:
        done = terraglue("fmu", "run", "over.fmu", "--start-time", "0", "--stop", "0.3", "--step", step, "--csv", "a.csv", cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        assert float(list(csv.DictReader((tmp_path / "a.csv").open()))[-1]["y"]) == round(0.3 / step)


def test_a_connected_enumeration_goes_into_a_system_structure(tmp_path):
    for name, causality, start in [("a", "output", ""), ("b", "input", ' start="1"')]:
        build(tmp_path, name, [("y", "output", 0.0, "")], "i[0] = 2; r[0] = i[0];", others=CHOICE.format(causality, "discrete", start), types=ITEMS)
    link = '[[connect]]\nfrom = "a.e"\nto = "b.e"\n'
    (tmp_path / "s.toml").write_text(time(0.1, 0.2) + '[a]\nfmu = "a.fmu"\n[b]\nfmu = "b.fmu"\n' + link)
    done = terraglue("convert", "s.toml", "-o", "s.ssp", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    text = zipfile.ZipFile(tmp_path / "s.ssp").read("SystemStructure.ssd").decode()
    assert 'startConnector="e"' in text and 'endConnector="e"' in text
    done = terraglue("convert", "s.ssp", "-o", "back.toml", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
