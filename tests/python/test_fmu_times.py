"""`fmu run` and a scenario of one FMU: the same first outputs, times, halves and ends; what is left out on the way to others is said."""

import csv

import pytest
from cfmu import build, build_3
from conftest import recorded, terraglue

INTEGRAL = [("u", "input", 0.0, ""), ("x", "output", 0.0, "")]
SHOWN = [("y", "output", 0.0, ""), ("t", "output", 0.0, ""), ("h", "output", 0.0, "")]


def scenario(folder, tables, step, duration, connections=""):
    text = f"[time]\nstep_s = {step!r}\nduration_s = {duration!r}\n[recording]\nevery_steps = 1\ndigits = 17\n"
    text += "".join(f'[{name}]\nfmu = "{name}.fmu"\n{keys}\n' for name, keys in tables.items())
    done, rows = recorded(folder, text + connections)
    assert done.returncode == 0, done.stderr
    return rows, done.stderr


def alone(folder, name, *arguments):
    done = terraglue("fmu", "run", f"{name}.fmu", *arguments, "--csv", "a.csv", cwd=folder)
    assert done.returncode == 0, done.stderr
    return list(csv.DictReader((folder / "a.csv").open())), done.stderr


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("times")
    # an output that is known at the end of the initialisation only
    late = "int fmi2ExitInitializationMode(Fmu *u) { u->r[0] = 7.0; return 0; }"
    build(folder, "late", SHOWN, "r[1] = t; r[2] = h;", more=late, instead=["fmi2ExitInitializationMode"], depends="")
    build(folder, "integral", INTEGRAL, "r[1] += h * r[0];", depends="")
    build(folder, "coarse", SHOWN, "if (h > 0.03) return 2; r[0] += h; r[1] = t; r[2] = h;", depends="")
    return folder


@pytest.mark.parametrize("order", ["", 'order = "jacobi"'])
@pytest.mark.parametrize("isolate", ["", "isolate = true"])
def test_the_first_step_takes_outputs_of_the_end_of_the_initialisation(folder, order, isolate):
    link = f'[[connect]]\nfrom = "late.y"\nto = "integral.u"\n{order}\n'
    rows, _ = scenario(folder, {"late": isolate, "integral": isolate}, 0.1, 0.3, link)
    assert [float(row["late.y"]) for row in rows] == [7.0] * 4
    assert [float(row["integral.x"]) for row in rows] == pytest.approx([0.0, 0.7, 1.4, 2.1], rel=1e-12)


def test_an_event_at_the_start_still_sets_what_is_fixed_afterwards(folder):
    event = '[[event]]\nat_s = 0.0\nset = { "integral.u" = 2.0 }\n'
    rows, _ = scenario(folder, {"integral": ""}, 0.1, 0.2, event)
    assert float(rows[-1]["integral.x"]) == pytest.approx(0.4, rel=1e-12)


@pytest.mark.parametrize("start", [0.0, 1e-5, 0.3, 100.7, -3.5])
def test_steps_and_their_halves_are_those_of_a_scenario_from_any_start(folder, start):
    for name, step in [("late", 0.001), ("coarse", 0.1)]:
        times = ["--start-time", repr(start), "--stop", repr(start + 5 * step), "--step", repr(step)]
        expected, _ = alone(folder, name, *times)
        rows, _ = scenario(folder, {name: f"start_time_s = {start!r}"}, step, 5 * step)
        for output in ["y", "t", "h"]:
            assert [float(r[output]) for r in expected] == [float(r[f"{name}.{output}"]) for r in rows], output


def test_a_step_that_was_typed_with_few_digits_ends_at_the_stop(folder):
    for step in ["0.333333", "0.33333", "0.33333333"]:
        rows, _ = alone(folder, "integral", "--start", "u=1", "--stop", "1", "--step", step)
        assert float(rows[-1]["time"]) == 1.0 and float(rows[-1]["x"]) == pytest.approx(1.0, rel=1e-12)


def test_a_stop_before_the_start_is_refused(folder):
    (folder / "w.toml").write_text('[time]\nstep_s = 0.1\nduration_s = 0.2\n[late]\nfmu = "late.fmu"\nstart_time_s = 1.0\nstop_time_s = 0.5\n')
    done = terraglue("run", "w.toml", "--out", "w", cwd=folder)
    assert done.returncode == 2 and "stop_time_s" in done.stderr and "start_time_s" in done.stderr


def test_a_structure_says_which_keys_of_the_scenario_it_leaves_out(folder):
    keys = 'tolerance = 1e-3\nstart_time_s = 1.0\non_nan = "warn"\nisolate = true\nstep_multiple = 2\n'
    (folder / "c.toml").write_text(f'[time]\nstep_s = 0.1\nduration_s = 0.2\n[late]\nfmu = "late.fmu"\n{keys}')
    done = terraglue("convert", "c.toml", "-o", "c.ssp", cwd=folder)
    assert done.returncode == 0, done.stderr
    for key in ["tolerance", "start_time_s", "on_nan", "isolate", "step_multiple"]:
        assert f"`{key}` of `late` is left out" in done.stderr


def test_an_exported_scenario_runs_where_nothing_can_be_isolated(folder):
    (folder / "e.toml").write_text('[time]\nstep_s = 0.1\nduration_s = 0.2\n[late]\nfmu = "late.fmu"\nisolate = true\n')
    done = terraglue("export", "e.toml", "-o", "e.fmu", cwd=folder)
    assert done.returncode == 0 and "`isolate` is left out" in done.stderr, done.stderr
    fmpy = pytest.importorskip("fmpy")
    result = fmpy.simulate_fmu(str(folder / "e.fmu"), stop_time=0.2, step_size=0.1, output=["late.y"])
    assert list(result["late.y"]) == [7.0] * 3


def test_a_trace_begins_with_the_instance_and_ends_with_its_end(folder):
    alone(folder, "late", "--stop", "0.2", "--step", "0.1", "--trace", "t.txt")
    lines = (folder / "t.txt").read_text().splitlines()
    assert lines[0] == "fmi2Instantiate" and lines[-1] == "fmi2FreeInstance"


def test_a_start_value_is_the_name_of_an_item(tmp_path):
    types = '<SimpleType name="T"><Enumeration><Item name="slow" value="10"/><Item name="very fast" value="20"/></Enumeration></SimpleType>'
    more = '<ScalarVariable name="e" valueReference="0" causality="parameter" variability="tunable"><Enumeration declaredType="T" start="10"/></ScalarVariable>'
    build(tmp_path, "items", SHOWN[:1], "r[0] = i[0];", others=more, types=types)
    rows, _ = alone(tmp_path, "items", "--start", "e=very fast", "--stop", "0.1", "--step", "0.1")
    assert float(rows[-1]["y"]) == 20.0
    done = terraglue("fmu", "run", "items.fmu", "--start", "e=fast", "--stop", "0.1", cwd=tmp_path)
    assert done.returncode == 2, done.stderr


def test_attributes_for_other_tools_are_checked(tmp_path):
    units = '<Unit name="m"><BaseUnit m="1"/><DisplayUnit name="mm" factor="1000"/></Unit>'
    other = '<ScalarVariable name="a" valueReference="9" causality="local"><Real unit="m" displayUnit="%s"/></ScalarVariable>'
    fmu = build(tmp_path, "good", SHOWN[:1], "", others=other % "mm", units=units)
    assert "display unit" not in terraglue("fmu", "check", fmu).stdout
    fmu = build(tmp_path, "wrong", SHOWN[:1], "", others=other % "ft", units=units)
    done = terraglue("fmu", "check", fmu)
    assert "line" in done.stdout + done.stderr and "display unit `ft`" in done.stdout + done.stderr


def test_a_run_beyond_the_end_that_an_fmu_was_given_is_warned_of_once(folder):
    for stop, warns in [("0.5", False), ("0.4", True), ("0.4999999999999", False)]:
        _, errors = scenario(folder, {"late": f"stop_time_s = {stop}"}, 0.1, 0.5)
        assert errors.count("beyond stop_time_s") == int(warns), errors


def test_elements_of_an_array_are_start_values_as_in_a_scenario(tmp_path):
    own = "v[2][0] = 0; for (int k = 0; k < 6; k++) v[2][0] += (k + 1) * v[1][k];"
    build_3(tmp_path, "sum", [("u", "input", "1 2 3 4 5 6", [2, 3]), ("y", "output", None, [])], own)
    expected = 1 + 2 * 2 + 3 * 10 + 4 * 20 + 5 * 5 + 6 * 6
    rows, _ = alone(tmp_path, "sum", "--start", "u[1,3]=10", "--start", "u[2,1]=20", "--stop", "0.1", "--step", "0.1")
    assert float(rows[-1]["y"]) == expected
    rows, _ = scenario(tmp_path, {"sum": '"u[1,3]" = 10.0\n"u[2,1]" = 20.0'}, 0.1, 0.1)
    assert float(rows[-1]["sum.y"]) == expected
    for wrong, words in [(["u[3,1]=1"], "u[3,1]"), (["u[1,1]=x"], "takes a number"), (["u=1 1 1 1 1 1", "u[1,1]=2"], "whole and by element")]:
        starts = [word for text in wrong for word in ("--start", text)]
        done = terraglue("fmu", "run", "sum.fmu", *starts, "--stop", "0.1", cwd=tmp_path)
        assert done.returncode == 2 and words in done.stderr, done.stderr


@pytest.mark.parametrize("isolate", [[], ["--isolate"]])
def test_what_an_fmu_prints_does_not_get_into_the_table(tmp_path, isolate):
    build(tmp_path, "loud", SHOWN[:1], 'printf("17,18,19\\n"); fflush(0); r[0] = t;', more="#include <stdio.h>")
    done = terraglue("fmu", "run", "loud.fmu", "--stop", "0.2", "--step", "0.1", *isolate, cwd=tmp_path)
    assert done.returncode == 0 and done.stdout.splitlines()[0] == "time,y" and len(done.stdout.splitlines()) == 4, done.stdout
    assert "17,18,19" in done.stderr
