"""Batches of the Python package: bits of single runs, errors and signals in the middle, starting again, recordings."""

import collections.abc
import os
import subprocess
import sys

import numpy as np
import pytest
from conftest import PLATE, interrupted

SEEDS = [3, 4, 5, 6]


def test_a_batch_has_the_bits_of_single_runs_at_any_number_of_threads(tg):
    names = ["robot.body.x", "robot.body.z", "robot.LF_j2.torque"]
    alone = []
    for seed in SEEDS:
        testbed = tg.Testbed("moon_walk", seed=seed)
        testbed.step(120)
        alone.append(testbed.read(names))
    for threads in (1, 2, 5):
        batch = tg.Batch("moon_walk", 4, seeds=SEEDS, threads=threads)
        live = batch.bind(names)
        batch.step(60)
        middle = live.copy()
        batch.step(60)
        assert np.array_equal(live, np.array(alone)) and not np.array_equal(live, middle)
        assert np.array_equal(batch.read(names), live) and len(batch) == 4 and not batch.failed


def test_values_are_written_row_by_row_and_states_are_kept(tg):
    batch = tg.Batch(PLATE, 3, set=[{"time.duration_s": 0.2 + 0.1 * k} for k in range(3)])
    batch.write(["bevameter.small_press.velocity_target"], np.array([[0.01], [np.nan], [0.03]]))
    batch.run_until(0.1)
    moved = batch.read(["bevameter.small_press.angle"])[:, 0]
    assert moved == pytest.approx([0.001, 0.0, 0.003], rel=0.1, abs=1e-4)
    with pytest.raises(ValueError, match="3 x 1"):
        batch.write(["bevameter.small_press.velocity_target"], np.zeros((2, 1)))
    kept = batch.snapshot()
    batch.run_until(0.15)
    batch.restore(kept)
    assert batch.t == pytest.approx([0.1] * 3)
    assert np.array_equal(batch.read(["bevameter.small_press.angle"])[:, 0], moved)
    for wrong in ({"seeds": [1]}, {"set": [{}]}, {"set": 3}):
        with pytest.raises(ValueError):
            tg.Batch(PLATE, 3, **wrong)


PRESS = "bevameter.small_press.angle"


def aside(site, code, timeout=300):
    """Runs a program in a process of its own: what hangs is ended, and fails."""
    code = f"PLATE = {PLATE!r}\nimport sys, threading, time\nimport numpy as np\nimport terraglue\n" + code
    done = subprocess.run([sys.executable, "-c", code], env={**os.environ, "PYTHONPATH": str(site)}, capture_output=True, text=True, timeout=timeout)
    assert done.returncode == 0, done.stderr[-3000:]
    return done.stdout


def test_threads_that_run_into_errors_do_not_wait_for_each_other(site):
    # errors are made by Python, which runs another thread meanwhile: it must not wait for a lock of the batch
    code = """
sys.setswitchinterval(1e-6)
batch = terraglue.Batch(PLATE, 3, threads=3)
names = ["bevameter.small_press.angle", "bevameter.small_press.velocity_target"] * 400
live = batch.bind(names)
ends = time.monotonic() + 3.0
counts = [0] * 6
def errors(k):
    while time.monotonic() < ends:
        for wrong in (lambda: batch.read(["bevameter.nothing"]), lambda: batch.write(["bevameter.small_press.velocity_target"], np.full((3, 1), np.inf)),
                      lambda: batch.restart(7), lambda: batch.restore([])):
            try:
                wrong()
            except terraglue.Error:
                counts[k] += 1
def steps(k):
    while time.monotonic() < ends:
        batch.step()
        batch.bind(names)
        batch.restore(batch.snapshot())
        batch.failed, batch.t, batch.energy()
        counts[k] += 1
threads = [threading.Thread(target=errors if k % 2 else steps, args=(k,)) for k in range(6)]
[thread.start() for thread in threads]
[thread.join() for thread in threads]
assert min(counts) > 0, counts
print(batch.t.max())
"""
    assert float(aside(site, code)) > 0.0


def test_ctrl_c_in_the_middle_of_a_step_leaves_a_batch_that_goes_on(site):
    code = f"PLATE = {PLATE!r}\n" + """
import terraglue
batch = terraglue.Batch(PLATE, 4, threads=2)
live = batch.bind(["bevameter.small_press.angle"])
print("ready", flush=True)
try:
    batch.run_until(1000.0)
except KeyboardInterrupt:
    before = batch.t
    assert (before < 1000.0).all() and not batch.failed
    batch.run_until(float(before.max()) + 0.01)
    assert len(set(batch.t.tolist())) == 1 and (live == batch.read(["bevameter.small_press.angle"])).all()
    batch.restart(2)
    assert batch.t[2] == 0.0
    print("went on", flush=True)
"""
    code_of_exit, out, said = interrupted(site, code)
    assert out == "went on\n" and code_of_exit == 0, said


BREAKS = """\"\"\"A controller that fails at a time of its own.

[module]
name = "breaks"
kind = "controller"

[parameters]
at_s = { unit = "s", default = 1e9, help = "Time of its failure" }
\"\"\"
import terraglue as tg


class Breaks(tg.Subsystem):
    def __init__(self, host, config):
        self.at_s, self.state = config["at_s"], {"z": 0.0}
        self.variables = [tg.Variable("z", "m", tg.OUTPUT, "Way")]

    def advance(self, step, input, out):
        if step.t >= self.at_s:
            raise ValueError("it broke")

    def commit(self, step, t, partner):
        self.state["z"] += step.h
"""


def test_one_that_fails_in_the_middle_is_listed_and_can_be_started_again(tg, tmp_path):
    (tmp_path / "breaks.py").write_text(BREAKS)
    scenario = {"time": {"step_s": 0.01, "duration_s": 1.0}, "breaks": {"module": str(tmp_path / "breaks.py")}}
    batch = tg.Batch(scenario, 3, set=[{}, {"breaks.at_s": 0.105}, {}])
    live = batch.bind(["breaks.z"])
    batch.run_until(0.05)
    kept = batch.snapshot()
    batch.run_until(0.2)
    assert list(batch.failed) == [1] and "it broke" in batch.failed[1] and "t = 0.11" in batch.failed[1]
    assert np.isnan(live[1, 0]) and live[[0, 2], 0] == pytest.approx([0.2, 0.2]) and batch.t == pytest.approx([0.2, 0.11, 0.2])
    assert np.isnan(batch.energy()["kinetic"]).tolist() == [False, True, False] and batch.snapshot()[1] is None
    # a state of before is gone back to, and fails again
    batch.restore([None, kept[1], None])
    assert not batch.failed and live[1, 0] == pytest.approx(0.05)
    batch.run_until(0.2)
    assert list(batch.failed) == [1]
    batch.step()
    batch.restart(1, set={"breaks.at_s": 5.0})
    assert not batch.failed and batch.t == pytest.approx([0.21, 0.0, 0.21])
    batch.run_until([np.nan, 0.21, np.nan])
    assert batch.t == pytest.approx([0.21] * 3) and live[1, 0] == live[0, 0]
    # one that cannot even be built leaves the others, and says why
    with pytest.raises(tg.InputError, match="at_s"):
        batch.restart(2, set={"breaks.at_s": "soon"})
    assert not batch.failed and batch.t == pytest.approx([0.21] * 3)


class Raises(collections.abc.Mapping):
    """A dictionary that fails where it is read."""

    def __getitem__(self, key):
        raise RuntimeError("no entry")

    def __iter__(self):
        return iter(["time.duration_s"])

    def __len__(self):
        return 1


def test_an_exception_in_an_edit_comes_out_and_leaves_everything_as_it_was(tg):
    batch = tg.Batch(PLATE, 2)
    batch.step(5)
    for wrong, error, words in (
        (Raises(), RuntimeError, "no entry"),
        ([{}, {"soil.parameters": object()}], tg.InputError, "type object"),
        ([{}, 3], tg.InputError, "dictionary"),
        ([{}, {"soil.parameters": "LETE_sandd"}], tg.InputError, "LETE_sand"),
    ):
        with pytest.raises(error, match=words):
            batch.restart([0, 1], set=wrong)
        with pytest.raises(error, match=words):
            tg.Batch(PLATE, 2, set=wrong)
    assert batch.t == pytest.approx([0.005] * 2) and not batch.failed
    batch.step()
    assert batch.t == pytest.approx([0.006] * 2)


def test_those_that_start_again_have_the_bits_of_a_new_testbed(tg):
    names = ["robot.body.x", "robot.LF_j2.torque"]
    batch = tg.Batch("moon_walk", 3, seeds=[1, 2, 3])
    live = batch.bind(names)
    batch.step(20)
    kept = live.copy()
    batch.restart([2, 0], seed=[8, 9], set={"gait.speed_m_s": 0.2})
    assert batch.t.tolist() == [0.0, pytest.approx(0.02), 0.0] and np.array_equal(live[1], kept[1])
    batch.run_until(np.array([0.03, np.nan, 0.03]))
    for k, seed in ((0, 9), (2, 8)):
        alone = tg.Testbed("moon_walk", seed=seed, set={"gait.speed_m_s": 0.2})
        alone.step(30)
        assert np.array_equal(alone.read(names), live[k])
    with pytest.raises(ValueError, match="0 to 2"):
        batch.restart(3)
    with pytest.raises(ValueError, match="list of 2"):
        batch.restart([0, 1], seed=[1, 2, 3])
    with pytest.raises(ValueError, match="spede"):
        batch.restart(0, set={"gait.spede": 0.1})
    assert batch.t[0] == pytest.approx(0.03)


def test_energies_are_those_of_single_testbeds(tg):
    batch = tg.Batch(PLATE, 2)
    batch.write(["bevameter.small_press.velocity_target"], np.array([[0.02], [0.04]]))
    batch.step(50)
    alone = tg.Testbed(PLATE)
    alone["bevameter.small_press.velocity_target"] = 0.04
    alone.step(50)
    parts, own = batch.energy(), alone.energy()
    assert parts.keys() == own.keys()
    assert np.array_equal([values[1] for values in parts.values()], list(own.values()), equal_nan=True)
    with pytest.raises(ValueError, match="testbed 1"):
        batch.write(["bevameter.small_press.velocity_target"], np.array([[0.1], [1e300]]))
    # all are set or none
    assert batch.read(["bevameter.small_press.velocity_target"])[0, 0] == 0.02


def test_a_batch_records_each_into_a_folder(tg, tmp_path):
    with tg.Batch(PLATE, 2, out=tmp_path / "runs") as batch:
        batch.run_until(0.05)
        with pytest.raises(ValueError, match="out"):
            batch.restart(0)
        first, second = batch.finish()
    assert first["steps"] == second["steps"] == 50
    with tg.Testbed(PLATE, out=tmp_path / "alone") as alone:
        alone.run_until(0.05)
    for k in "01":
        assert (tmp_path / "runs" / k / "recording.mcap").read_bytes() == (tmp_path / "alone" / "recording.mcap").read_bytes()
    assert batch.finish() == [None, None]
    with pytest.raises(tg.SimulationError, match="ended"):
        batch.read([PRESS])
