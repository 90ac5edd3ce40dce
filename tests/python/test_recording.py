"""Opens a recording with the readers of others: mcap with Protobuf as Foxglove and Lichtblick do, and Rerun."""

import csv
import json
import math
import struct

import pytest
from conftest import MOON_WALK, terraglue
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

MB = 1e6


@pytest.fixture(scope="module")
def walk(tmp_path_factory):
    """The default walk, all of it."""
    folder = tmp_path_factory.mktemp("walk") / "out"
    process = terraglue("run", MOON_WALK, "--out", folder, "--quiet", "--csv")
    assert process.returncode == 0, process.stderr
    return folder


@pytest.fixture(scope="module")
def decoded(walk):
    """Messages by topic: (log time in s, message)."""
    topics = {}
    with open(walk / "recording.mcap", "rb") as file:
        for _, channel, message, content in make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages():
            topics.setdefault(channel.topic, []).append((message.log_time / 1e9, content))
    return topics


def rows(folder):
    with open(folder / "variables.csv", newline="") as file:
        return list(csv.DictReader(file))


def points(cloud):
    """(x, y, z, number) of every point."""
    at = cloud.pose.position
    for x, y, z, _, number in struct.iter_unpack("<fff4sf", cloud.data):
        yield at.x + x, at.y + y, at.z + z, number


def test_the_default_walk_takes_fifteen_megabytes(walk):
    # its 24 drives show heat, current and energy in addition: 0.7 MB more
    assert (walk / "recording.mcap").stat().st_size <= 15 * MB


def test_variables_are_those_of_the_table(walk, decoded):
    table = rows(walk)
    assert len(table) == len(decoded["/robot"]) > 2000
    for row, (t, robot) in list(zip(table, decoded["/robot"]))[::97]:
        assert math.isclose(float(row["t_s"]), t, abs_tol=1e-9)
        for joint in ("LF_j2", "RR_j3"):
            for part in ("angle", "torque", "power"):
                exact = float(row[f"robot.{joint}.{part}"])
                assert math.isclose(getattr(getattr(robot, joint), part), exact, rel_tol=1e-9)


def test_what_never_changes_is_written_once(walk, decoded):
    table = rows(walk)
    constant = [n for n in table[0] if n.startswith("robot.") and len({row[n] for row in table}) == 1]
    assert len(constant) > 500
    assert len(decoded["/robot/parameters"]) == 1
    _, robot = decoded["/robot"][500]

    def written(message, parts):
        for part in parts[:-1]:
            if part not in message.DESCRIPTOR.fields_by_name:
                return False
            message = getattr(message, part)
        return parts[-1] in {field.name for field, _ in message.ListFields()}

    again = [n for n in constant if written(robot, n.split(".")[1:])]
    # A module does not mark its own outputs as constant: centres of mass, and the voltages of supply and drives.
    expected = [n for n in constant if n.endswith((".force_at_x", ".voltage")) and float(table[0][n])]
    assert sorted(again) == sorted(expected)


def test_what_stays_although_it_is_written_again_takes_no_room(tmp_path):
    sizes = []
    for name, more in [("all", []), ("less", ["--set", 'recording.exclude=["robot.*.voltage","robot.*.force_at_x"]'])]:
        done = terraglue("run", MOON_WALK, "--duration", "1", "--quiet", "--out", tmp_path / name, *more)
        assert done.returncode == 0, done.stderr
        sizes.append((tmp_path / name / "recording.mcap").stat().st_size)
    assert 0.99 * sizes[0] < sizes[1] < sizes[0]


def test_every_variable_is_there_by_its_name_with_its_unit(walk):
    names = {}
    with open(walk / "recording.mcap", "rb") as file:
        for channel in make_reader(file).get_summary().channels.values():
            if "subsystem" in channel.metadata:
                for column in json.loads(channel.metadata["columns"]):
                    names[channel.metadata["subsystem"] + "." + column["name"]] = column["unit"]
    assert set(names) == set(rows(walk)[0]) - {"t_s"}
    assert names["robot.LF_j2.torque"] == "N m"


def test_robot_relief_prints_and_forces_are_there_for_viewers(walk, decoded):
    frames = {t.child_frame_id for t in decoded["/tf"][0][1].transforms}
    assert {e.frame_id for e in decoded["/scene"][0][1].entities} == frames
    shapes = {topic for topic in decoded if topic.startswith("/shapes/")}
    assert {decoded[topic][0][1].frame_id for topic in shapes} <= frames and len(shapes) > 6
    # The last message of each tile is shown at the end: all of the ground, with every print.
    start, end = decoded["/ground"][0][1], decoded["/ground"][-1][1]
    count = len(end.data) // 8
    shown = {}
    for topic in decoded:
        if topic.startswith("/ground/"):
            for x, y, z, sinkage in points(decoded[topic][-1][1]):
                i = round((x - end.pose.position.x) / end.cell_size.x - 0.5)
                j = round((y - end.pose.position.y) / end.cell_size.y - 0.5)
                shown[j * end.column_count + i] = (z, sinkage)
    assert len(start.data) == len(end.data) and len(shown) == count
    exact = list(struct.iter_unpack("<ff", end.data))
    assert max(abs(shown[k][0] - exact[k][0]) for k in range(count)) < 1e-4
    assert max(sinkage for _, sinkage in shown.values()) > 0.01
    weight = [sum(a.shaft_length + a.head_length for a in f.entities[0].arrows) for _, f in decoded["/contact_forces"]]
    assert len(weight) in (500, 501)
    # Arrows as long as half a metre for the weight of the robot: in the mean the feet carry it.
    assert math.isclose(sum(weight) / len(weight), 0.5, rel_tol=0.1)
    layout = json.loads((walk / "viewer_layout.json").read_text())
    drawn = layout["configById"]["3D!ground"]["topics"]
    assert set(drawn) <= set(decoded) and sum(topic.startswith("/ground/") for topic in drawn) > 10


def test_rerun_shows_robot_ground_and_forces(walk, tmp_path):
    rerun = pytest.importorskip("rerun", reason="rerun-sdk is not installed")
    import shutil
    import subprocess
    import sys
    import pathlib

    program = shutil.which("rerun", path=str(pathlib.Path(sys.executable).parent))
    out = tmp_path / "walk.rrd"
    command = [program, "mcap", "convert", str(walk / "recording.mcap"), "-o", str(out)]
    subprocess.run(command, check=True, capture_output=True, text=True, timeout=300)
    printed = subprocess.run([program, "rrd", "print", "-v", str(out)], check=True, capture_output=True, text=True,
                             timeout=300).stdout
    assert rerun.__version__
    for archetype in ("Points3D:positions", "Points3D:colors", "Transform3D:translation", "CoordinateFrame:frame"):
        assert archetype in printed, archetype
    for entity in ("/shapes/robot/body", "/ground/0_0", "/contact_forces/points"):
        assert entity in printed, entity


def test_joints_are_there_by_name_with_the_tree_of_the_robot(walk, decoded):
    states = decoded["/joints/robot"]
    assert [t for t, _ in states] == [t for t, _ in decoded["/robot"]]
    names = [joint.name for joint in states[0][1].joints]
    assert len(names) == 24 and {f"{leg}_j{k}" for leg in ("LF", "LM", "LR", "RF", "RM", "RR") for k in (1, 2, 3, 4)} == set(names)
    for (_, message), (_, robot) in list(zip(states, decoded["/robot"]))[::97]:
        assert [joint.name for joint in message.joints] == names
        for joint in message.joints:
            own = getattr(robot, joint.name)
            assert (joint.position, joint.velocity, joint.effort) == (own.angle, own.velocity, own.torque)
    with open(walk / "recording.mcap", "rb") as file:
        channel, = (c for c in make_reader(file).get_summary().channels.values() if c.topic == "/joints/robot")
    tree = json.loads(channel.metadata["joints"])
    frames = {t.child_frame_id for t in decoded["/tf"][0][1].transforms if t.child_frame_id.startswith("robot/")}
    # a tree: every body but the root hangs on one joint
    assert {joint["child"] for joint in tree} == frames - {"robot/body"} and len(tree) == len(frames) - 1
    assert {joint["parent"] for joint in tree} <= frames


def test_rerun_reads_joints_by_name(walk):
    pytest.importorskip("rerun", reason="rerun-sdk is not installed")
    from rerun.chunk import McapReader

    messages = []
    for chunk in McapReader(str(walk / "recording.mcap")).stream():
        batch = chunk.to_record_batch()
        if str(chunk.entity_path) == "/joints/robot" and "foxglove.JointStates:message" in batch.schema.names:
            messages += [row[0] for row in batch.column("foxglove.JointStates:message").to_pylist()]
    assert len(messages) > 2000
    joints = {joint["name"]: joint for joint in messages[-1]["joints"]}
    last = rows(walk)[-1]
    for name in ("LF_j2", "RR_j3"):
        assert math.isclose(joints[name]["position"], float(last[f"robot.{name}.angle"]), rel_tol=1e-8)
        assert math.isclose(joints[name]["effort"], float(last[f"robot.{name}.torque"]), rel_tol=1e-8)


def test_overlays_are_recorded_where_they_are_wanted(tmp_path, decoded):
    assert not any(topic.startswith("/overlays") for topic in decoded)
    # a single pass leaves no meaningful residual
    sets = ("--set", "recording.overlays=true", "--set", 'gait.mount="robot.body"', "--set", "gluing.strategy=iterative")
    process = terraglue("run", MOON_WALK, "--out", tmp_path, "--duration", "1", "--quiet", "--no-report", *sets)
    assert process.returncode == 0, process.stderr
    topics = {}
    with open(tmp_path / "recording.mcap", "rb") as file:
        for _, channel, _, content in make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages():
            topics.setdefault(channel.topic, []).append(content)
    layers = {topic for topic in topics if topic.startswith("/overlays")}
    assert layers == {f"/overlays/{layer}" for layer in (
        "gait/foot_targets", "gait/next_footholds", "gait/support_polygon", "gluing/residual", "soil/pressure",
        "soil/friction_cone")}
    entity, = topics["/overlays/gait/support_polygon"][0].entities
    assert entity.frame_id == "robot/body" and len(entity.lines[0].points) == 8
    entity, = topics["/overlays/soil/friction_cone"][-1].entities
    assert entity.frame_id == "world" and len(entity.lines) == 1
    # eight lines from the apex of each cone, and eight along its edge
    assert len(entity.lines[0].points) % 32 == 0
    drawn = sum(math.dist((a.x, a.y, a.z), (b.x, b.y, b.z)) for message in topics["/overlays/soil/pressure"][-1:]
                for line in message.entities[0].lines for a, b in zip(line.points[::2], line.points[1::2]))
    assert drawn > 0.0
