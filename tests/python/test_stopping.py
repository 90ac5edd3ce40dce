"""Runs that end before their time: by a signal, by the length of their steps, next to another run."""

import signal
import subprocess
import time

import cfmu
import pytest
from conftest import PROGRAM, terraglue


@pytest.fixture(scope="session")
def slow(tmp_path_factory):
    return cfmu.build(tmp_path_factory.mktemp("slow"), "slow", [("y", "output", 0, "")], "usleep(1000); r[0] = t + h;")


def rows(path):
    return [[float(x) for x in line.split(",")] for line in path.read_text().splitlines()[1:]]


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
@pytest.mark.parametrize("isolate", [[], ["--isolate"]])
def test_a_signal_ends_an_fmu_with_its_table_and_all_its_processes(slow, tmp_path, how, isolate):
    table = tmp_path / "out.csv"
    command = [PROGRAM, "fmu", "run", slow, "--stop", "1000", "--step", "0.01", "--csv", table, *isolate]
    run = subprocess.Popen([*map(str, command)], stderr=subprocess.PIPE, text=True)
    while not table.exists():
        assert run.poll() is None, run.stderr.read()
        time.sleep(0.01)
    run.send_signal(how)
    assert run.wait(300) == 130, run.stderr.read()
    assert "once more" in run.stderr.read()
    before = table.read_text()
    assert subprocess.run(["pgrep", "-f", str(table)], capture_output=True).stdout == b""
    assert table.read_text() == before


@pytest.mark.parametrize("step", ["0.6", "0.7", "0.3", "0.25"])
def test_the_last_step_ends_where_the_run_does(slow, tmp_path, step):
    done = terraglue("fmu", "run", slow, "--stop", "1", "--step", step, "--csv", tmp_path / "out.csv")
    times = [row[0] for row in rows(tmp_path / "out.csv")]
    assert done.returncode == 0 and times[-1] == 1.0 and times[1] == float(step), done.stderr


def test_an_fmu_with_steps_of_one_length_ends_before(tmp_path):
    fmu = cfmu.build(tmp_path, "fixed", [("y", "output", 0, "")], "r[0] = t + h;", variable_step=False)
    done = terraglue("fmu", "run", fmu, "--stop", "1", "--step", "0.3", "--csv", tmp_path / "out.csv")
    assert done.returncode == 0 and "before 1 s" in done.stderr, done.stderr
    assert rows(tmp_path / "out.csv")[-1][0] == pytest.approx(0.9)


@pytest.mark.parametrize("option", ["--timeout", "--tolerance"])
@pytest.mark.parametrize("value", ["nan", "0", "-1", "inf"])
def test_times_and_tolerances_are_positive(slow, option, value):
    done = terraglue("fmu", "run", slow, f"{option}={value}")
    assert done.returncode == 2 and "above 0" in done.stderr, done.stderr
