"""Exported FMUs, driven by FMPy: valid, equal to `terraglue run`, and right about states, resets, threads, errors."""

import csv
import shutil
import subprocess
import threading

import numpy as np
import pytest
from fmpy import simulate_fmu
from fmpy.fmi1 import FMICallException
from fmpy.validation import validate_fmu

from conftest import ROOT, terraglue
from fmus import Fmu, export
from test_plugins import made

GROUND = ("terrain.size_m=[1.0,0.6]", "terrain.spacing_m=0.005")
PLATE = ("foot.shape=cylinder", "foot.radius_m=0.025", "foot.half_length_m=0.01")
SCENARIO = ROOT / "scenarios" / "plate_sinkage.toml"
EXACT = ("--set", "gluing.strategy=iterative", "--set", "gluing.tolerance=1e-13")
PRESSES = ["robot.small_press.velocity_target", "robot.large_press.velocity_target"]


def sets(*edits):
    return [word for edit in edits for word in ("--set", edit)]


@pytest.fixture(scope="session")
def fmus(tmp_path_factory):
    """All that can be exported, in both versions."""
    folder = tmp_path_factory.mktemp("units")
    soil = sets("soil.parameters=LETE_sand", *GROUND, *PLATE)
    press = sets(f"robot.model={ROOT}/models/bevameter.urdf", "robot.fixed_base=true", "robot.motor=velocity")
    wanted = {
        "soil3": ("soil-bekker", "--fmi", "3", *soil),
        "soil2": ("soil-cellular-automaton", "--fmi", "2", *soil, "--set", "foot.count=2"),
        "robot2": ("rigid-body", "--fmi", "2", *press),
        "whole3": (SCENARIO, "--fmi", "3", "--scalars", *EXACT),
    }
    made = {name: Fmu(export(target, folder / f"{name}.fmu", *rest)) for name, (target, *rest) in wanted.items()}
    yield made
    for fmu in made.values():
        fmu.remove()


@pytest.fixture(scope="session")
def pressed(tmp_path_factory):
    """Seven tenths of a second of plate_sinkage as `terraglue run` writes it."""
    out = tmp_path_factory.mktemp("plate") / "out"
    every = ("--set", "recording.every_steps=1", "--duration", "0.7", "--csv", "--quiet", "--out", out)
    done = terraglue("run", SCENARIO, *EXACT, *every)
    assert done.returncode == 0, done.stderr
    return list(csv.DictReader((out / "variables.csv").open()))


def place(row):
    return [float(row[f"bevameter.small_plate.{axis}"]) for axis in "xyz"]


def press(instance, depths, feet=1):
    """Forces while the feet go down to each depth in turn, 1 ms apart."""
    forces = []
    for depth in depths:
        instance["foot.position"] = [[0.2 * k, 0.0, 0.01 - depth] for k in range(feet)]
        instance.step(1e-3)
        forces.append(instance["foot.force"].copy())
    return np.array(forces)


DEPTHS = [0.0] + [1e-4 * k for k in range(1, 40)] + [2e-3, 3e-3]


@pytest.mark.parametrize("name", ["soil3", "soil2", "robot2", "whole3"])
def test_fmpy_finds_no_fault(fmus, name):
    assert validate_fmu(fmus[name].path) == []


def test_a_soil_gives_the_forces_of_the_run(fmus, pressed):
    instance = fmus["soil3"].instance(foot__position=place(pressed[0]))
    forces, wanted = [], np.array([float(row["bevameter.small_plate.contact_normal"]) for row in pressed[1:]])
    for row in pressed[1:]:
        instance["foot.position"] = place(row)
        instance.step(1e-3)
        forces.append(instance["foot.force"][0, 2])
    assert np.abs(np.array(forces) - wanted).max() <= 1e-12 * wanted.max() and wanted.max() > 100.0
    instance.end()


def test_a_whole_scenario_gives_the_run(fmus, pressed):
    instance = fmus["whole3"].instance()
    for row in pressed[1:]:
        instance.step(1e-3)
    outputs = [n for n, v in fmus["whole3"].variables.items() if v.causality == "output" and n in row]
    assert len(outputs) > 50
    for name in outputs:
        assert abs(instance[name][0] - float(row[name])) <= 1e-12 * max(1.0, abs(float(row[name]))), name
    instance.end()


def test_a_robot_gives_the_run(fmus, tmp_path):
    path = tmp_path / "presses.toml"
    path.write_text(f"""
[time]
step_s = 0.001
duration_s = 0.2
[world]
gravity_m_s2 = [0.0, 0.0, -9.81]
[recording]
every_steps = 1
[robot]
module = "rigid-body"
model = "{ROOT}/models/bevameter.urdf"
fixed_base = true
motor = "velocity"
[[event]]
at_s = 0.0
set = {{ "{PRESSES[0]}" = 0.01, "{PRESSES[1]}" = 0.02 }}
""")
    done = terraglue("run", path, "--csv", "--quiet", "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    row = list(csv.DictReader((tmp_path / "out" / "variables.csv").open()))[-1]
    instance = fmus["robot2"].instance(small_press__velocity_target=0.01, large_press__velocity_target=0.02)
    for _ in range(200):
        instance.step(1e-3)
    outputs = [n for n, v in fmus["robot2"].variables.items() if v.causality == "output" and f"robot.{n}" in row]
    assert len(outputs) > 30
    for name in outputs:
        wanted = float(row[f"robot.{name}"])
        assert abs(instance[name][0] - wanted) <= 1e-12 * max(1.0, abs(wanted)), name
    instance.end()


FREE = """<robot name="swing"><link name="base"><inertial><mass value="2"/>
<inertia ixx="0.02" iyy="0.03" izz="0.04" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="arm"><inertial><origin xyz="0.3 0 0"/><mass value="1"/>
<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="hinge" type="revolute"><parent link="base"/><child link="arm"/><origin xyz="0.1 0 0"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="1" effort="5" velocity="9"/></joint></robot>"""


@pytest.mark.parametrize("version", ["2", "3"])
def test_poses_and_coordinates_are_set_before_the_start(tmp_path, version):
    (tmp_path / "swing.urdf").write_text(FREE)
    wanted = {"base.z": 0.75, "base.yaw": 0.4, "base.vx": 0.2, "base.wz": 1.5, "hinge.angle": 0.6, "hinge.velocity": -2.0}
    values = ", ".join(f'"robot.{name}" = {value}' for name, value in wanted.items())
    (tmp_path / "swing.toml").write_text(f"""
[time]
step_s = 0.001
duration_s = 0.1
[world]
gravity_m_s2 = [0.0, 0.0, -9.81]
[recording]
every_steps = 1
[robot]
module = "rigid-body"
model = "swing.urdf"
motor = "off"
[[event]]
at_s = 0.0
set = {{ {values} }}
""")
    done = terraglue("run", tmp_path / "swing.toml", "--csv", "--quiet", "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    row = list(csv.DictReader((tmp_path / "out" / "variables.csv").open()))[-1]

    edits = sets(f"robot.model={tmp_path}/swing.urdf", "robot.motor=off")
    fmu = Fmu(export("rigid-body", tmp_path / "swing.fmu", "--fmi", version, *edits))
    assert validate_fmu(fmu.path) == []
    for name, what in {"base.z": "m", "base.yaw": "rad", "hinge.angle": "rad", "hinge.velocity": "rad/s"}.items():
        found = fmu.variables[name]
        assert (found.causality, found.initial, found.unit, float(found.start)) == ("output", "exact", what, 0.0), name
    unknown = {v.variable.name for v in fmu.description.initialUnknowns}
    assert "arm.z" in unknown and not unknown & wanted.keys() and fmu.variables["arm.z"].start is None

    instance = fmu.instance(running=False)
    instance["hinge.angle"] = 0.1  # before the initialisation, too; the later value counts
    with pytest.raises(FMICallException):
        instance["hinge.angle"] = 1.5  # beyond its limit
    with pytest.raises(FMICallException):
        instance["arm.z"] = 1.0  # its joint determines its place
    instance.initialize({name.replace(".", "__"): value for name, value in wanted.items()})
    assert instance["base.z"][0] == 0.75 and abs(instance["hinge.angle"][0] - 0.6) < 1e-15
    with pytest.raises(FMICallException):
        instance["base.z"] = 1.0
    for _ in range(100):
        instance.step(1e-3)
    outputs = [n for n, v in fmu.variables.items() if v.causality == "output" and f"robot.{n}" in row]
    assert len(outputs) > 30
    for name in outputs:
        assert abs(instance[name][0] - float(row[f"robot.{name}"])) <= 1e-12 * max(1.0, abs(float(row[f"robot.{name}"]))), name
    instance.end()

    # A master that knows nothing but the description.
    result = simulate_fmu(fmu.path, start_values=wanted, stop_time=0.1, step_size=1e-3, output=["base.x", "hinge.angle"])
    for name in ("base.x", "hinge.angle"):
        assert abs(result[name][-1] - float(row[f"robot.{name}"])) < 1e-12, name
    fmu.remove()


@pytest.mark.parametrize(("name", "feet"), [("soil3", 1), ("soil2", 2)])
def test_a_state_is_saved_restored_and_replayed(fmus, name, feet):
    fmu = fmus[name]
    instance = fmu.instance(foot__position=[[0.2 * k, 0, 0.05] for k in range(feet)])
    press(instance, DEPTHS[:20], feet)
    state = instance.save()
    first, t = press(instance, DEPTHS[20:], feet), instance.t
    instance.restore(state)
    instance.t = t - 1e-3 * len(first)
    assert (press(instance, DEPTHS[20:], feet) == first).all() and first.max() > 10.0
    if fmu.description.coSimulation.canSerializeFMUstate:
        raw = instance.raw
        data = (raw.serializeFMUstate if fmu.two else raw.serializeFMUState)(state)
        other = fmu.instance("other", start=t - 1e-3 * len(first))
        loaded = (other.raw.deSerializeFMUstate if fmu.two else other.raw.deserializeFMUState)(data)
        other.restore(loaded)
        assert (press(other, DEPTHS[20:], feet) == first).all()
        other.end()
    instance.release(state)
    instance.end()


def test_reset_forgets_everything(fmus):
    instance = fmus["soil3"].instance(foot__position=[0, 0, 0.05])
    first = press(instance, DEPTHS)
    instance.raw.reset()
    instance.t = 0.0
    instance.initialize({"foot.position": [0, 0, 0.05]})
    assert (press(instance, DEPTHS) == first).all()
    instance.end()


def test_ten_instances_in_threads(fmus):
    results = {}

    def run(k):
        instance = fmus["soil2"].instance(f"soil{k}", foot__position=[[0, 0, 0.05], [0.2, 0, 0.05]])
        results[k] = press(instance, DEPTHS, 2)
        instance.end()

    threads = [threading.Thread(target=run, args=(k,)) for k in range(10)]
    [t.start() for t in threads]
    [t.join() for t in threads]
    assert len(results) == 10 and all((results[k] == results[0]).all() for k in results)


def test_steps_of_any_length(fmus):
    """The same way in steps of 1 ms and of 2.5 ms: the law depends on the way, not on the steps."""
    ends = []
    for h in (1e-3, 2.5e-3):
        instance = fmus["soil3"].instance(foot__position=[0, 0, 0.01])
        for k in range(1, round(0.05 / h) + 1):
            instance["foot.position"] = [0, 0, 0.01 - 0.1 * k * h]
            instance.step(h)
        ends.append(instance["foot.force"][0, 2])
        instance.end()
    assert ends[0] > 100.0 and ends[0] == pytest.approx(ends[1], rel=1e-9)


@pytest.mark.parametrize("name", ["soil3", "soil2"])
def test_what_must_not_be_done_is_an_error(fmus, name):
    fmu = fmus[name]
    instance = fmu.instance(running=False)
    feet = 2 if fmu.two else 1

    def refused(call, *arguments, **named):
        with pytest.raises(FMICallException) as error:
            call(*arguments, **named)
        assert error.value.status == 3, error.value

    refused(lambda: instance["foot.force"])
    refused(instance.step, 1e-3)
    refused(instance.raw.terminate)
    instance.initialize({"foot.position": [[0.2 * k, 0, 0.05] for k in range(feet)]})
    refused((instance.raw.getReal if fmu.two else instance.raw.getFloat64), [99999])
    refused((instance.raw.getBoolean), [fmu.variables["max_sinkage"].valueReference])
    refused(instance.__setitem__, "max_sinkage", 1.0)
    refused(instance.__setitem__, "foot.position", [np.nan] * 3 * feet)
    refused(instance.raw.enterInitializationMode)
    refused(instance.raw.doStep, currentCommunicationPoint=1.0, communicationStepSize=1e-3)
    refused(instance.raw.doStep, currentCommunicationPoint=0.0, communicationStepSize=-1e-3)
    press(instance, DEPTHS[:5], feet)  # and all of this has broken nothing
    instance.end()


def test_our_own_import_gives_the_same(fmus, pressed, tmp_path):
    out = tmp_path / "out.csv"
    names = ["bevameter.small_plate.z", "bevameter.small_plate.contact_normal"]
    done = terraglue(
        "fmu", "run", fmus["whole3"].path, "--stop", "0.7", "--step", "0.001", "--output", ",".join(names), "--csv", out
    )
    assert done.returncode == 0, done.stderr
    row = list(csv.DictReader(out.open()))[-1]
    for name in names:
        assert abs(float(row[name]) - float(pressed[-1][name])) <= 1e-12 * abs(float(pressed[-1][name]))


@pytest.mark.parametrize("language", ["c", "python", "scenario"])
def test_a_soil_with_a_law_of_its_own_gives_the_run(tmp_path, language):
    place, _ = made(tmp_path, "law", language)
    if language == "c":
        subprocess.run(["make"], cwd=place, check=True, capture_output=True)
    path = export(place / "scenario.toml", tmp_path / "law.fmu", "--fmi", "3", "--scalars", *EXACT)
    every = ("--set", "recording.every_steps=1", "--duration", "0.3", "--csv", "--quiet", "--out", tmp_path / "out")
    done = terraglue("run", place / "scenario.toml", *EXACT, *every)
    assert done.returncode == 0, done.stderr
    rows = list(csv.DictReader((tmp_path / "out" / "variables.csv").open()))
    # the law that the FMU calls is its own
    shutil.rmtree(place)
    fmu = Fmu(path)
    instance = fmu.instance()
    for _ in rows[1:]:
        instance.step(1e-3)
    assert float(rows[-1]["soil.max_sinkage"]) > 1e-3
    for name in ["soil.max_sinkage", "robot.ball.z", "robot.ball.contact_normal"]:
        assert abs(instance[name][0] - float(rows[-1][name])) <= 1e-12 * max(1.0, abs(float(rows[-1][name]))), name
    instance.end()
    fmu.remove()
