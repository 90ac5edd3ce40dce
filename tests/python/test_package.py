"""The Python package, from a wheel: the numbers of the program, states, errors, batches, recordings."""

import hashlib
import json
import os
import pathlib
import pickle
import re
import subprocess
import sys
import threading

import numpy as np
import pytest
from conftest import PLATE, ROOT, interrupted


def sha(path):
    return hashlib.sha256(pathlib.Path(path).read_bytes()).hexdigest()


def test_the_wheel_brings_the_program_and_what_it_needs(tg, site, tmp_path):
    environment = {**os.environ, "PYTHONPATH": str(site), "PATH": "/usr/bin:/bin"}
    run = lambda *words: subprocess.run([sys.executable, "-m", "terraglue", *words], cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert run("--version").stdout.startswith("terraglue ")
    scenario = tg.SCENARIOS / "moon_walk.toml"
    done = run("run", str(scenario), "--duration", "0.02", "--no-report", "--quiet", "--out", "out")
    assert done.returncode == 0, done.stderr
    assert "soil-bekker" in run("modules").stdout
    assert (tg.MODELS / "soils.csv").is_file() and (site / "terraglue/py.typed").is_file()


def test_a_recorded_testbed_gives_the_bytes_of_the_program(tg, tmp_path):
    sets = {"soil.module": "soil-bekker", "gluing.strategy": "iterative", "time.duration_s": 0.3}
    with tg.Testbed("moon_walk", set=sets, seed=7, out=tmp_path / "own") as testbed:
        testbed.run_until(0.1)
        testbed.step(7)
        testbed.run_until(testbed.duration_s)
        assert testbed.t == pytest.approx(0.3)
        summary = testbed.finish()
    edits = [word for key, value in {**sets, "world.seed": 7}.items() for word in ("--set", f"{key}={value}")]
    tg.run("run", tg.SCENARIOS / "moon_walk.toml", *edits, "--no-report", "--quiet", "--out", tmp_path / "program")
    assert sha(tmp_path / "own/recording.mcap") == sha(tmp_path / "program/recording.mcap")
    other = json.loads((tmp_path / "program/summary.json").read_text())
    assert summary["distance_m"] == other["distance_m"] and summary["steps"] == 300


def test_variables_are_read_and_set_with_units(tg):
    testbed = tg.Testbed(PLATE)
    assert "bevameter.small_press.angle" in testbed and testbed.unit("bevameter.small_press.angle") == "m"
    testbed["bevameter.small_press.velocity_target"] = np.float64(0.05)
    testbed["bevameter.large_press.velocity_target"] = 0.02
    testbed.step(100)
    small, large = testbed.read(["bevameter.small_press.angle", "bevameter.large_press.angle"])
    assert small == pytest.approx(0.005, rel=0.05) and large == pytest.approx(0.002, rel=0.05)
    assert testbed["bevameter.small_press.angle"] == small
    assert testbed.read([]).shape == (0,) and testbed.help("bevameter.small_press.angle")
    bodies = testbed.bodies()
    assert bodies["bevameter.small_plate"].shape == (13,) and np.linalg.norm(bodies["bevameter.small_plate"][3:7]) == pytest.approx(1)
    assert set(testbed.energy()) >= {"kinetic", "potential", "dissipated"}


def test_wrong_names_and_values_say_what_would_fit(tg):
    testbed = tg.Testbed(PLATE)
    with pytest.raises(KeyError, match="small_press.angle") as raised:
        testbed["bevameter.small_press.angel"]
    assert isinstance(raised.value, tg.UnknownName) and isinstance(raised.value, tg.Error)
    with pytest.raises(KeyError):
        testbed["bevameter.small_press.nothing"] = 1.0
    with pytest.raises(ValueError, match="angle"):
        testbed["bevameter.small_press.angle"] = "wide"
    with pytest.raises(tg.InputError, match="duratoin_s"):
        tg.Testbed({**PLATE, "time": {"duratoin_s": 1.0}})
    with pytest.raises(tg.InputError, match="LETE_sand"):
        tg.Testbed(PLATE, set={"soil.parameters": "LETE_sandd"})
    with pytest.raises(tg.InputError, match="nowhere"):
        tg.Testbed("nowhere.toml")
    with pytest.raises(tg.InputError):
        tg.Testbed(PLATE, set={"soil.parameters": None})
    with pytest.raises(ValueError):
        testbed.run_until(float("nan"))
    with pytest.raises(KeyError):
        testbed.message("bevameter.camera")
    testbed.finish()
    with pytest.raises(tg.SimulationError, match="ended"):
        testbed.step()
    assert testbed.finish() is None


def test_an_error_survives_pickling(tg):
    with pytest.raises(tg.InputError) as raised:
        tg.Testbed("nowhere.toml")
    assert str(pickle.loads(pickle.dumps(raised.value))) == str(raised.value)


def test_a_state_is_gone_back_to_exactly(tg):
    testbed = tg.Testbed("moon_walk", set={"soil.module": "soil-cellular-automaton"})
    testbed.run_until(0.1)
    kept = testbed.snapshot()
    testbed.run_until(0.2)
    names = testbed.names
    once = testbed.read(names)
    testbed.restore(kept)
    assert testbed.t == pytest.approx(0.1)
    testbed.run_until(0.2)
    assert np.array_equal(testbed.read(names), once, equal_nan=True)
    with pytest.raises(tg.InputError, match="another testbed"):
        tg.Testbed(PLATE).restore(kept)
    more = [testbed.snapshot() for _ in range(63)]
    with pytest.raises(tg.InputError, match="64"):
        testbed.snapshot()
    del more
    testbed.snapshot()


def test_the_ground_is_an_array_and_shows_what_was_pressed(tg):
    testbed = tg.Testbed(PLATE, set={"time.duration_s": 1.0})
    testbed["bevameter.large_press.velocity_target"] = 0.05
    x, y, before = testbed.heights(-0.5, 0.5, -0.3, 0.3)
    assert before.shape == (len(y), len(x)) and x[1] - x[0] == pytest.approx(0.01)
    testbed.run_until(0.5)
    x, y, after = testbed.heights(-0.5, 0.5, -0.3, 0.3)
    assert (before - after).max() == pytest.approx(0.02, abs=0.004)
    place = testbed.bodies()["bevameter.large_plate"][:2]
    row, column = np.unravel_index(np.argmax(before - after), after.shape)
    assert np.hypot(x[column] - place[0], y[row] - place[1]) < 0.06
    with pytest.raises(ValueError, match="no node"):
        testbed.heights(5.0, 6.0, 0.0, 0.1)


def test_threads_may_share_a_testbed(tg):
    testbed = tg.Testbed(PLATE)
    errors = []

    def work():
        try:
            for _ in range(20):
                testbed.step()
                testbed.read(["bevameter.small_press.angle"])
        except Exception as error:  # noqa: BLE001 - whatever it is, it is reported below
            errors.append(error)

    threads = [threading.Thread(target=work) for _ in range(4)]
    [thread.start() for thread in threads]
    [thread.join() for thread in threads]
    assert not errors and testbed.t == pytest.approx(0.08)


def test_ctrl_c_ends_a_long_run(site, tmp_path):
    code = "import terraglue\nt = terraglue.Testbed('moon_walk', set={'time.duration_s': 1000.0})\nprint('ready', flush=True)\nt.run_until(1000.0)\n"
    code_of_exit, _, said = interrupted(site, code)
    assert "KeyboardInterrupt" in said and code_of_exit != 0


def test_a_recording_is_read_as_arrays(tg, tmp_path):
    with tg.Testbed("moon_walk", set={"time.duration_s": 0.2}, out=tmp_path / "run") as testbed:
        testbed.run_until(0.2)
        last = testbed["robot.body.z"]
    recording = tg.Recording(tmp_path / "run")
    t, z = recording.series("robot.body.z")
    assert t[-1] == pytest.approx(0.2) and z[-1] == pytest.approx(last, rel=1e-8) and recording.unit("robot.body.z") == "m"
    times, poses = recording.poses("robot/body")
    assert poses.shape == (len(times), 7) and "robot/body" in recording.frames
    x, y, start = recording.ground("start")
    assert start.shape == (len(y), len(x)) and recording.ground()[2].shape == start.shape
    assert "[time]" in recording.scenario and "robot.body.z" in recording.names
    with pytest.raises(KeyError, match="robot.body.z"):
        recording.series("robot.body.zz")
    with pytest.raises(tg.Error):
        tg.Recording(tmp_path / "nowhere")


def test_many_testbeds_leave_nothing_behind(tg):
    def rss():
        return int(next(line.split()[1] for line in open("/proc/self/status") if line.startswith("VmRSS")))

    def life(n):
        for _ in range(n):
            testbed = tg.Testbed(PLATE)
            testbed.step(2)
            testbed.finish()

    life(60)
    before, files = rss(), len(os.listdir("/proc/self/fd"))
    life(240)
    assert len(os.listdir("/proc/self/fd")) <= files and rss() - before < 8_000


def test_the_stubs_know_everything_that_is_there(tg, site):
    text = (site / "terraglue/_terraglue.pyi").read_text()
    for cls in (tg.Testbed, tg.Batch, tg.Recording):
        body = text.split(f"class {cls.__name__}:")[1].split("\nclass ")[0]
        public = [name for name in vars(cls) if not name.startswith("_")]
        assert public and all(f"def {name}(" in body for name in public), cls


@pytest.mark.parametrize("page", ["docs/python.md", "README.md"])
def test_what_a_page_shows_runs(tg, site, tmp_path, page):
    blocks = re.findall(r"^```python\n(.*?)^```", (ROOT / page).read_text(), re.M | re.S)
    assert blocks
    code = "\n".join(blocks).replace("64", "3")
    if "terraglue.gym" in code:
        pytest.importorskip("gymnasium", reason="gymnasium cannot be installed here")
    with tg.Testbed("moon_walk", set={"time.duration_s": 0.05}, out=tmp_path / "runs/moon_walk") as testbed:
        testbed.run_until(0.05)
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, env={**os.environ, "PYTHONPATH": str(site)}, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
