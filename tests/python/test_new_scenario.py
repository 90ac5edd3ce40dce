"""`terraglue new scenario --robot FILE`: the robot stands on lunar soil in its pose, upright, with its energies balanced."""

import csv
import json
import re

import pytest
from conftest import ROOT, terraglue

LINK = """<link name="{name}"><inertial><origin xyz="0 0 {com}"/><mass value="{mass}"/>
  <inertia ixx="{i}" ixy="0" ixz="0" iyy="{i}" iyz="0" izz="{i}"/></inertial>{shape}</link>
"""
JOINT = """<joint name="{name}" type="revolute"><origin xyz="{at}"/><parent link="{parent}"/><child link="{child}"/>
  <axis xyz="{axis}"/><limit lower="{low}" upper="{high}" effort="50" velocity="10"/></joint>
"""


def shape(geometry, at="0 0 0"):
    return f'<collision><origin xyz="{at}"/><geometry>{geometry}</geometry></collision>'


def quadruped():
    """Twelve joints; its knees cannot be straight, so at 0 it would stand behind its hips."""
    parts = [LINK.format(name="trunk", com=0, mass=10, i=0.2, shape=shape('<box size="0.5 0.25 0.12"/>'))]
    for side, y in (("L", 0.15), ("R", -0.15)):
        for end, x in (("F", 0.2), ("R", -0.2)):
            leg = end + side
            foot = shape('<sphere radius="0.025"/>', "0 0 -0.22")
            parts += [
                LINK.format(name=f"{leg}_hip", com=0, mass=0.6, i=0.001, shape=""),
                LINK.format(name=f"{leg}_thigh", com=-0.1, mass=0.8, i=0.004, shape=""),
                LINK.format(name=f"{leg}_shank", com=-0.1, mass=0.2, i=0.001, shape=foot),
            ]
            places = {"at": f"{x} {y} 0", "parent": "trunk", "child": f"{leg}_hip", "axis": "1 0 0"}
            parts.append(JOINT.format(name=f"{leg}_hip_joint", low=-0.8, high=0.8, **places))
            places = {"at": "0 0 0", "parent": f"{leg}_hip", "child": f"{leg}_thigh", "axis": "0 1 0"}
            parts.append(JOINT.format(name=f"{leg}_thigh_joint", low=-1.5, high=3.0, **places))
            places = {"at": "0 0 -0.22", "parent": f"{leg}_thigh", "child": f"{leg}_shank", "axis": "0 1 0"}
            parts.append(JOINT.format(name=f"{leg}_calf_joint", low=-2.7, high=-0.888, **places))
    return f'<robot name="quadruped">{"".join(parts)}</robot>'


def arm():
    """Two links on a plate that lies on the ground: its root is free, its elbow reaches out."""
    parts = [
        LINK.format(name="plate", com=0, mass=20, i=0.5, shape=shape('<box size="0.6 0.6 0.05"/>')),
        LINK.format(name="upper", com=0.2, mass=2, i=0.03, shape=shape('<box size="0.05 0.05 0.4"/>', "0 0 0.2")),
        LINK.format(name="fore", com=0.15, mass=1, i=0.01, shape=shape('<box size="0.04 0.04 0.3"/>', "0 0 0.15")),
        JOINT.format(name="shoulder", at="0 0 0.03", parent="plate", child="upper", axis="0 1 0", low=-2, high=2),
        JOINT.format(name="elbow", at="0 0 0.4", parent="upper", child="fore", axis="0 1 0", low=0.5, high=2.5),
    ]
    return f'<robot name="arm">{"".join(parts)}</robot>'


def stood(tmp_path, robot):
    """The summary of one second, the scenario's text and the last row of the recording."""
    made = terraglue("new", "scenario", "--robot", robot, "-o", tmp_path / "moon")
    assert made.returncode == 0, made.stderr
    scenario = tmp_path / "moon" / "scenario.toml"
    run = terraglue("run", scenario, "--duration", "1", "--out", tmp_path / "out", "--json", "--csv")
    assert run.returncode == 0, run.stderr
    rows = list(csv.DictReader((tmp_path / "out" / "variables.csv").open()))
    return json.loads(run.stdout), scenario.read_text(), {name: float(x) for name, x in rows[-1].items() if x}


@pytest.mark.parametrize("name", ["hexapod", "rover", "quadruped", "arm"])
def test_a_new_scenario_stands(tmp_path, name):
    robot = ROOT / "models" / f"{name}.urdf"
    if name in ("quadruped", "arm"):
        robot = tmp_path / f"{name}.urdf"
        robot.write_text({"quadruped": quadruped, "arm": arm}[name]())
    summary, text, last = stood(tmp_path, robot)
    assert max(summary["max_roll_rad"], summary["max_pitch_rad"]) < 0.02
    assert abs(summary["distance_m"]) < 0.005
    # it stands still from the start: nothing swings on its joints
    assert summary["peak_force_over_weight"] <= 1.1
    assert 0 < summary["max_sinkage_m"] < 0.03
    # at rest next to nothing is turned over: rounding is compared with the energy of the sunken weight
    mass = json.loads(terraglue("robot", robot, "--json").stdout)["mass_kg"]
    sunken_j = 1.62 * mass * summary["max_sinkage_m"]
    assert abs(summary["energies"]["drift_j"]) < 1e-8 * sunken_j, summary["energies"]
    # and while it comes to rest the motors turn over more than that: no floor is needed
    coming = terraglue("run", tmp_path / "moon" / "scenario.toml", "--set", "time.settle_s=0", "--duration", "1",
                       "--out", tmp_path / "coming", "--json")
    energies = json.loads(coming.stdout)["energies"]
    assert energies["turnover_j"] > 1e-5 and abs(energies["drift_j"]) < 1e-4 * energies["turnover_j"], energies
    # joints stay where they started, within the accuracy of the gains
    angles = {key[len("robot.") : -len(".angle")]: x for key, x in last.items() if key.endswith(".angle")}
    starts = dict(line.split(" = ") for line in text.split("[robot.joints]")[1].split("\n#")[0].split("\n") if " = " in line)
    starts = {joint.strip('"'): float(x) for joint, x in starts.items()}
    assert angles and set(starts) <= set(angles)
    for joint, angle in angles.items():
        assert angle == pytest.approx(starts.get(joint, 0.0), abs=0.03), joint
    if name == "quadruped":
        assert starts["FL_calf_joint"] == -0.888 and starts["FL_thigh_joint"] == 0.444 and "FL_shank" in text


def test_effort_of_the_file_bounds_the_motors(tmp_path):
    robot = tmp_path / "arm.urdf"
    with_limits = arm().replace('effort="50"', 'effort="4.5"', 1).replace('effort="50"', 'effort="0"', 1)
    robot.write_text(with_limits)
    process = terraglue("new", "scenario", "--robot", robot, "-o", tmp_path / "moon")
    assert process.returncode == 0 and "effort" not in process.stderr, process.stderr
    text = (tmp_path / "moon" / "scenario.toml").read_text()
    largest = text.split("[robot.max_torque]")[1].split("[report]")[0]
    assert '"shoulder" = 4.5\n' in largest, largest
    # the file has no value for this one: a value of its own, and why
    assert re.search(r'"elbow" = [0-9.]+ +# 5 times what the weight asks\n', largest), largest
    # motors that are too weak are reported
    robot.write_text(with_limits.replace('effort="4.5"', 'effort="0.1"'))
    process = terraglue("new", "scenario", "--robot", robot, "-o", tmp_path / "weak")
    assert process.returncode == 0 and "`shoulder` (0.1 of " in process.stderr, process.stderr
    assert '"shoulder" = 0.1\n' in (tmp_path / "weak" / "scenario.toml").read_text()


def test_the_ground_of_a_large_robot_fits(tmp_path):
    robot = tmp_path / "ship.urdf"
    hull = LINK.format(name="hull", com=0, mass=1e6, i=1e9, shape=shape('<box size="3000 200 20"/>'))
    robot.write_text(f'<robot name="ship">{hull}</robot>')
    assert terraglue("new", "scenario", "--robot", robot, "-o", tmp_path / "moon").returncode == 0
    checked = terraglue("check", tmp_path / "moon" / "scenario.toml", timeout=300)
    assert checked.returncode == 0, checked.stderr
    # nor does a robot that is larger than its ground need the memory of a larger one
    small = terraglue("check", tmp_path / "moon" / "scenario.toml", "--set", "terrain.size_m=[1.0,1.0]",
                      "--set", "terrain.spacing_m=0.001", timeout=300)
    assert small.returncode == 0, small.stderr


def test_what_cannot_stand_is_told(tmp_path):
    floating = tmp_path / "floating.urdf"
    floating.write_text(f'<robot name="f">{LINK.format(name="a", com=0, mass=1, i=0.1, shape="")}</robot>')
    process = terraglue("new", "scenario", "--robot", floating, "-o", tmp_path / "moon")
    assert process.returncode == 2 and "can touch" in process.stderr and "<collision>" in process.stderr
    process = terraglue("new", "scenario", "mine")
    assert process.returncode == 2 and "--robot" in process.stderr
    # a centre of mass not above the only foot
    foot = shape('<sphere radius="0.03"/>', "0.5 0 -0.3")
    floating.write_text(f'<robot name="f">{LINK.format(name="a", com=0, mass=1, i=0.1, shape=foot)}</robot>')
    process = terraglue("new", "scenario", "--robot", floating, "-o", tmp_path / "moon")
    assert process.returncode == 0 and "tip over" in process.stderr
    assert "tip over" in (tmp_path / "moon" / "scenario.toml").read_text()
    # nothing is overwritten
    process = terraglue("new", "scenario", "--robot", floating, "-o", tmp_path / "moon")
    assert process.returncode == 2 and "exists already" in process.stderr


def test_the_tutorial_walks_and_drives(tmp_path):
    """The steps of docs/your-robot.md, with robots of our own whose joints are called as those in it."""
    page = (ROOT / "docs" / "your-robot.md").read_text()
    (controller,) = re.findall(r"```python\n(.*?)```", page, re.S)
    wheels, crawl = re.findall(r"```toml\n(.*?)```", page, re.S)
    robot = tmp_path / "quadruped.urdf"
    robot.write_text(quadruped())
    assert terraglue("new", "scenario", "--robot", robot, "-o", tmp_path / "walk").returncode == 0
    (tmp_path / "walk" / "crawl.py").write_text(controller)
    scenario = tmp_path / "walk" / "scenario.toml"
    scenario.write_text(scenario.read_text() + crawl)
    run = terraglue("run", scenario, "--duration", "6", "--out", tmp_path / "out", "--json")
    assert run.returncode == 0, run.stderr
    walked = json.loads(run.stdout)
    assert walked["distance_m"] > 0.15 and max(walked["max_roll_rad"], walked["max_pitch_rad"]) < 0.3, walked

    assert terraglue("new", "scenario", "--robot", ROOT / "models" / "rover.urdf", "-o", tmp_path / "drive").returncode == 0
    scenario = tmp_path / "drive" / "scenario.toml"
    text = scenario.read_text().replace('motor = "position"\n', wheels.replace("*_wheel", "*_wheel_drive"))
    assert "*_wheel_drive" in text
    scenario.write_text(text)
    run = terraglue("run", scenario, "--duration", "3", "--out", tmp_path / "out2", "--json")
    assert run.returncode == 0, run.stderr
    # 0.15 m/s at the rim, less the slip
    assert 0.3 < json.loads(run.stdout)["distance_m"] < 0.45
