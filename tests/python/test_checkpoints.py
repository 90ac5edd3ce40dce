"""A run that is killed goes on from its last checkpoint to the bytes of a run that nothing has ended."""

import csv
import json
import shutil
import signal
import subprocess
import time

import pytest
from conftest import MOON_WALK, PROGRAM, ROOT, terraglue
from fmus import export

SAME = ["recording.mcap", "variables.csv", "final_ground.asc", "exchange.json", "viewer_layout.json"]
MEASURED = {"wall_s", "cpu_s", "real_time_factor", "cpu_real_time_factor", "cpu_per_step_s"}
SMALL = ["--duration", "0.4", "--set", "time.settle_s=0.1", "--set", "terrain.size_m=[2.0,1.6]",
         "--set", "terrain.spacing_m=0.02", "--csv", "--quiet"]
# Events and faults before the first checkpoint, at 0.13 s, and after it.
TIME_LINE = """
[[event]]
at_s = 0.05
set = { "robot.LF_j2.max_torque" = 30.0 }
[[event]]
at_s = 0.2505
set = { "robot.RF_j2.max_torque" = 5.0 }
[[fault]]
variable = "robot.body.pitch"
kind = "noise"
deviation = 0.01
at_s = 0.1
until_s = 0.3
"""
# The cases differ also in how steps are cut, and in how the run is ended.
CASES = [
    ("soil-bekker", "iterative", signal.SIGKILL, []),
    ("soil-cellular-automaton", "iterative", signal.SIGINT, []),
    ("soil-bekker", "cooperative", signal.SIGKILL, ["--set", "gluing.energy_residual_j=1e-4"]),
    ("soil-cellular-automaton", "cooperative", signal.SIGKILL, ["--set", "gait.isolate=true"]),
]


@pytest.fixture(scope="module")
def walk(tmp_path_factory):
    """The walk with a time line, next to a robot file of its own."""
    folder = tmp_path_factory.mktemp("walk")
    shutil.copytree(ROOT / "models", folder / "models")
    text = MOON_WALK.read_text().replace("../models/", "models/")
    (folder / "walk.toml").write_text(text + TIME_LINE)
    return folder / "walk.toml"


def end_after_a_checkpoint(out, how, *arguments):
    """Runs at the pace of the clock, so that the rest takes longer than noticing the file; again where the run had ended nevertheless."""
    command = [PROGRAM, "run", *map(str, arguments), "--out", str(out), "--checkpoint-every", "130ms", "--realtime"]
    for _ in range(20):
        process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, cwd=ROOT)
        while not (out / "checkpoint.bin").exists() and process.poll() is None:
            time.sleep(0.002)
        process.send_signal(how)
        _, said = process.communicate(timeout=300)
        if process.returncode != 0:
            break
        shutil.rmtree(out)
    assert process.returncode == {signal.SIGKILL: -signal.SIGKILL, signal.SIGINT: 130}[how]
    return said


def figures(folder):
    summary = json.loads((folder / "summary.json").read_text())
    return {key: value for key, value in summary.items() if key not in MEASURED}


def sections(folder):
    with open(folder / "timing.csv", newline="") as file:
        return [(row["section"], row["steps"]) for row in csv.DictReader(file)]


def assert_same(one, two):
    for name in SAME:
        if name == "final_ground.asc" and not (one / name).exists():
            continue  # no soil of its own
        assert (one / name).read_bytes() == (two / name).read_bytes(), name
    assert figures(one) == figures(two)
    assert sections(one) == sections(two)


@pytest.mark.parametrize("soil,strategy,how,more", CASES)
def test_a_run_that_is_ended_goes_on_to_the_same_bytes(walk, tmp_path, soil, strategy, how, more):
    arguments = [walk, *SMALL, "--set", f"soil.module={soil}", "--set", f"gluing.strategy={strategy}", *more]
    whole = terraglue("run", *arguments, "--out", tmp_path / "whole")
    assert whole.returncode == 0, whole.stderr
    out = tmp_path / "out"
    end_after_a_checkpoint(out, how, *arguments)
    resumed = terraglue("run", "--resume", out, "--quiet")
    assert resumed.returncode == 0, resumed.stderr
    assert_same(tmp_path / "whole", out)
    assert not list(out.glob("checkpoint*"))
    assert "noise" in str(figures(out)["events"])
    again = terraglue("run", "--resume", out)
    assert again.returncode == 2 and "reached its end" in again.stderr


def test_units_and_modules_in_other_processes_go_on_too(tmp_path):
    """A soil as an FMU, and a controller in Python that keeps a state."""
    fmu = export("soil-bekker", tmp_path / "soil.fmu", "--set", "soil.parameters=LETE_sand",
                  "--set", "terrain.size_m=[0.6,0.4]")
    (tmp_path / "foot.py").write_text(
        '"""A controller.\n\n[module]\nname = "foot"\nkind = "controller"\n"""\n'
        "import terraglue as tg\n\n\nclass Foot(tg.Subsystem):\n"
        "    def __init__(self, host, config):\n        self.state = {'z': 0.032}\n"
        "        self.variables = [tg.Variable('z', 'm', tg.OUTPUT, 'Height')]\n\n"
        "    def advance(self, step, input, out):\n        pass\n\n"
        "    def commit(self, step, t, partner):\n        self.state['z'] -= 1e-4 * step.h / 1e-3\n")
    scenario = tmp_path / "s.toml"
    scenario.write_text(f'[time]\nstep_s = 0.002\nduration_s = 0.4\n[soil]\nfmu = "{fmu}"\n'
                        '[foot]\nmodule = "./foot.py"\n[[connect]]\nfrom = "foot.z"\nto = "soil.foot.position[1,3]"\n')
    whole = terraglue("run", scenario, "--csv", "--quiet", "--out", tmp_path / "whole")
    assert whole.returncode == 0, whole.stderr
    end_after_a_checkpoint(tmp_path / "out", signal.SIGKILL, scenario, "--csv", "--quiet")
    resumed = terraglue("run", "--resume", tmp_path / "out", "--quiet")
    assert resumed.returncode == 0, resumed.stderr
    assert_same(tmp_path / "whole", tmp_path / "out")


def test_only_the_same_run_goes_on(walk, tmp_path):
    out = tmp_path / "out"
    end_after_a_checkpoint(out, signal.SIGKILL, walk, *SMALL, "--set", "soil.module=soil-bekker")
    before = (out / "recording.mcap").read_bytes()

    def refused(*words):
        process = terraglue("run", "--resume", out)
        said = " ".join(process.stderr.replace("│", " ").split())
        assert process.returncode == 2 and all(word in said for word in words), said
        assert (out / "recording.mcap").read_bytes() == before

    model = walk.parent / "models" / "hexapod.urdf"
    text = model.read_text()
    model.write_text(text + "<!-- another file -->\n")
    refused("`robot.model`", "has changed since the checkpoint")
    model.write_text(text)
    checkpoint = (out / "checkpoint.bin").read_bytes()
    (out / "checkpoint.bin").write_bytes(checkpoint[:-1])
    refused("checkpoint.bin", "damaged")
    (out / "checkpoint.bin").unlink()
    refused("holds no checkpoint", "--checkpoint-every")
    # a recording that is not that of the checkpoint is left as it is
    (out / "checkpoint.bin").write_bytes(checkpoint)
    damaged = bytearray(before)
    damaged[len(before) // 4] ^= 1
    (out / "recording.mcap").write_bytes(damaged)
    process = terraglue("run", "--resume", out)
    assert process.returncode != 0 and "recording.mcap" in process.stderr
    assert (out / "recording.mcap").read_bytes() == damaged
    (out / "recording.mcap").write_bytes(before)
    # the scenario of the run is in the checkpoint: its file may have changed by now
    aside = walk.rename(walk.with_suffix(".aside"))
    resumed = terraglue("run", "--resume", out, "--quiet")
    aside.rename(walk)
    assert resumed.returncode == 0, resumed.stderr


def test_a_module_that_cannot_save_its_state_is_named_before_the_run(tmp_path):
    (tmp_path / "forgetful.py").write_text(
        '"""A controller.\n\n[module]\nname = "forgetful"\nkind = "controller"\n"""\n'
        "import terraglue as tg\n\n\nclass Mine(tg.Subsystem):\n    def advance(self, step, input, out):\n        pass\n")
    scenario = tmp_path / "s.toml"
    scenario.write_text('[time]\nstep_s = 0.01\nduration_s = 0.5\n[other]\nmodule = "./forgetful.py"\n')
    process = terraglue("run", scenario, "--checkpoint-every", "1", "--out", tmp_path / "out")
    said = " ".join(process.stderr.replace("│", " ").split())
    assert process.returncode == 2 and "`other`" in said and "cannot save its state" in said, said
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("time", ["0", "-1", "5x", "s", "inf"])
def test_a_time_between_checkpoints_is_above_zero(time):
    process = terraglue("run", MOON_WALK, "--checkpoint-every", time)
    assert process.returncode == 2 and "5s" in process.stderr


def test_a_report_of_a_killed_run_takes_nothing_from_it(walk, tmp_path):
    end_after_a_checkpoint(tmp_path / "run", signal.SIGKILL, walk, *SMALL)
    kept = (tmp_path / "run" / "recording.mcap").read_bytes()
    told = terraglue("report", tmp_path / "run")
    assert told.returncode == 0 and "is left as it is" in told.stderr, told.stderr
    assert (tmp_path / "run" / "recording.mcap").read_bytes() == kept
    done = terraglue("run", "--resume", tmp_path / "run", "--quiet")
    assert done.returncode == 0, done.stderr


def test_a_report_while_the_run_goes_on_takes_nothing_from_it(walk, tmp_path):
    once = terraglue("run", walk, *SMALL, "--out", tmp_path / "alone")
    assert once.returncode == 0, once.stderr
    out = tmp_path / "run"
    process = subprocess.Popen([PROGRAM, "run", str(walk), *SMALL, "--out", str(out), "--realtime"], cwd=ROOT)
    while not (out / "recording.mcap").exists() or not (out / "recording.mcap").stat().st_size:
        assert process.poll() is None
        time.sleep(0.002)
    while process.poll() is None:
        terraglue("report", out)
    assert process.returncode == 0
    assert_same(tmp_path / "alone", out)


@pytest.mark.parametrize("damage, words", [("gone", "No such file"), ("changed", "recording.mcap: ")])
def test_a_recording_that_was_changed_is_told_with_the_way_out(walk, tmp_path, damage, words):
    end_after_a_checkpoint(tmp_path / "run", signal.SIGKILL, walk, *SMALL)
    path = tmp_path / "run" / "recording.mcap"
    bytes_ = bytearray(path.read_bytes())
    bytes_[len(bytes_) // 3] ^= 0xFF
    path.unlink() if damage == "gone" else path.write_bytes(bytes_)
    told = terraglue("run", "--resume", tmp_path / "run", "--quiet")
    assert told.returncode == 2 and words in told.stderr and "start the run anew" in told.stderr, told.stderr
