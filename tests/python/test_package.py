"""The Python package, from a wheel: the numbers of the program, states, errors, batches, recordings."""

import hashlib
import json
import os
import pathlib
import pickle
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
import zipfile

import numpy as np
import pytest
from conftest import PROGRAM, ROOT

PLATE = {
    "time": {"step_s": 0.001, "duration_s": 0.2},
    "terrain": {"kind": "flat", "size_m": [1.0, 0.6], "spacing_m": 0.01},
    "soil": {"module": "soil-bekker", "parameters": "LETE_sand"},
    "bevameter": {
        "module": "rigid-body", "model": str(ROOT / "models/bevameter.urdf"), "fixed_base": True,
        "motor": "velocity", "max_torque": 5000.0,
    },
}


def wheel(place):
    """The wheel as pip builds it, from the build of the tests."""
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "-q"]
    environment = {**os.environ, "TERRAGLUE_PROFILE": "debug"}
    done = subprocess.run([*pip, "wheel", "--no-deps", "-w", place, ROOT / "python"], env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-4000:]
    (made,) = place.glob("terraglue-*-abi3-*.whl")
    return made


@pytest.fixture(scope="session")
def site(tmp_path_factory):
    """The folder with the installed package. Building the wheel compiles for minutes, so it is put together from the build of the tests;
    with TERRAGLUE_TEST_WHEEL=1 it is unpacked from the wheel."""
    place = tmp_path_factory.mktemp("package")
    folder = place / "site"
    if os.environ.get("TERRAGLUE_TEST_WHEEL"):
        with zipfile.ZipFile(wheel(place)) as archive:
            archive.extractall(folder)
        return folder
    shutil.copytree(ROOT / "python/terraglue", folder / "terraglue", ignore=shutil.ignore_patterns("data", "*.so", "__pycache__"))
    built = pathlib.Path(PROGRAM).parent
    shutil.copy(built / "lib_terraglue.so", folder / "terraglue/_terraglue.abi3.so")
    lay_out = ["cargo", "run", "--quiet", "--package", "xtask-start", "--", "install", folder / "terraglue/data", "--built", built.name]
    done = subprocess.run(lay_out, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return folder


@pytest.fixture(scope="session")
def tg(site):
    """The package in this process; the modules of plugins have the same name and are loaded by other processes only."""
    sys.path.insert(0, str(site))
    try:
        import terraglue
    finally:
        sys.path.remove(str(site))
    terraglue.PROGRAM.chmod(0o755)
    return terraglue


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
    # a process in the background of a shell has it ignored
    heard = lambda: signal.signal(signal.SIGINT, signal.SIG_DFL)
    environment = {**os.environ, "PYTHONPATH": str(site)}
    process = subprocess.Popen([sys.executable, "-c", code], env=environment, preexec_fn=heard, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "ready\n"
    time.sleep(0.2)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=20)
    assert "KeyboardInterrupt" in said and process.returncode != 0


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


def test_a_mass_of_ones_own_comes_to_rest_on_the_soil(tg):
    # a sphere of 10 cm under 2 kg, with dynamics of its own in steps of the soil
    mass, radius, h = 2.0, 0.1, 1e-3
    soil = tg.Soil([[0.0, 0.0, radius]], radius_m=radius, step_s=h, terrain={"kind": "flat", "size_m": [1.0, 1.0], "spacing_m": 0.005})
    z, v, force = radius, 0.0, 0.0
    for _ in range(1500):
        v += h * (force / mass - 9.81 - 20.0 * v)
        z += h * v
        wrench, _ = soil.step([[0.0, 0.0, z]])
        force = wrench[0, 2]
    assert force == pytest.approx(mass * 9.81, rel=0.02) and abs(v) < 1e-3
    x, y, ground = soil.heights(-0.2, 0.2, -0.2, 0.2)
    assert ground.min() == pytest.approx(z - radius, abs=1e-3) and z < radius


def test_a_trial_leaves_nothing_and_derivatives_are_those_of_the_force(tg):
    place = np.array([[0.0, 0.0, 0.03], [0.5, 0.2, 0.03]])
    soil = tg.Soil(place, parameters="dry_sand_LLL_K010", terrain={"kind": "flat", "size_m": [2.0, 1.0], "spacing_m": 0.005})
    for _ in range(10):
        place[:, 2] -= 2e-4
        force, moment = soil.step(place)
    assert force.shape == moment.shape == (2, 3) and (force[:, 2] > 0).all()
    deeper = place - [0.0, 0.0, 1e-4]
    tried, _ = soil.trial(deeper)
    again, _ = soil.trial(deeper)
    assert np.array_equal(tried, again)
    slope = soil.derivatives(deeper)
    # pressed deeper, the ground pushes more; a smaller step by hand agrees
    assert (slope[:, 2, 2] < 0).all()
    by_hand = (soil.trial(deeper + [0.0, 0.0, 1e-7])[0] - soil.trial(deeper - [0.0, 0.0, 1e-7])[0])[:, 2] / 2e-7
    assert slope[:, 2, 2] == pytest.approx(by_hand, rel=1e-3)
    assert np.array_equal(soil.step(deeper)[0], tried)
    for wrong in ([[0.0, 0.0, 0.0]], [[0.0, 0.0, float("nan")]] * 2, [[0.0, 0.0]] * 2):
        with pytest.raises(ValueError, match="position"):
            soil.step(wrong)


def test_a_dragged_foot_of_a_soil_takes_as_much_work_as_it_gives_heat(tg):
    soil = tg.Soil([[0.0, 0.0, 0.03]], module="soil-cellular-automaton", terrain={"kind": "flat", "size_m": [1.0, 0.4], "spacing_m": 0.005})
    place, work = np.array([0.0, 0.0, 0.03]), 0.0
    for k in range(300):
        before = place.copy()
        place = place + (np.array([0.0, 0.0, -1e-4]) if k < 100 else np.array([2e-4, 0.0, 0.0]))
        force, _ = soil.step(place[None])
        work -= float(force[0] @ (place - before))
    energy = soil.testbed.energy()
    kept = energy["dissipated"] + energy["potential"]
    assert work > 0.1 and kept == pytest.approx(work, rel=0.01)


@pytest.mark.parametrize("name", ["MoonWalk", "RoverSlope"])
def test_environments_pass_the_checker_and_are_repeatable(tg, name):
    gymnasium = pytest.importorskip("gymnasium", reason="gymnasium cannot be installed here")
    from gymnasium.utils.env_checker import check_env

    import terraglue.gym

    small = {"period_s": 0.02, "duration_s": 0.1}
    env = terraglue.gym.environment(name, **small)
    with __import__("warnings").catch_warnings():
        __import__("warnings").simplefilter("ignore")
        check_env(env, skip_render_check=True)
    actions = [env.action_space.sample() for _ in range(5)]

    def episode(seed):
        rows = [env.reset(seed=seed)[0]]
        for action in actions:
            observed, reward, fallen, over, info = env.step(action)
            rows.append(observed)
        assert over and not fallen and np.isfinite(reward) and info["energy_j"] >= 0
        return np.array(rows)

    assert np.array_equal(episode(3), episode(3))
    if name == "MoonWalk":
        assert not np.array_equal(episode(3), episode(4))
    env.close()
    made = gymnasium.make(f"terraglue/{name}-v0")
    assert made.action_space.shape == env.action_space.shape
    with pytest.raises(gymnasium.error.ResetNeeded):
        terraglue.gym.environment(name).step(actions[0])


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
