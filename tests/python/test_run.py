"""Reads the files of a run, as a user's script would."""

import csv
import json
import math
import shutil
import signal
import subprocess
import time

import pytest
from conftest import MOON_WALK, PROGRAM, ROOT, terraglue
from mcap.stream_reader import StreamReader
from mcap_protobuf.decoder import DecoderFactory
from mcap.records import Channel, Message, Schema

SUMMARY_KEYS = """status error events scenario strategy soil_module steps simulated_s wall_s cpu_s cpu_real_time_factor real_time_factor
distance_m commanded_distance_m max_roll_rad max_pitch_rad max_sinkage_m energy_j cost_of_transport evaluations_mean
evaluations_max steps_not_converged max_gap_m max_action_reaction_gap_n soil_mass_error_relative recording
report""".split()


def records(path):
    with open(path, "rb") as file:
        yield from StreamReader(file).records


def test_summary_holds_the_promised_figures(short_run):
    folder, printed, _ = short_run
    summary = json.loads((folder / "summary.json").read_text())
    assert summary == printed
    assert [key for key in SUMMARY_KEYS if key not in summary] == []
    assert summary["status"] == "done" and summary["error"] is None
    assert summary["scenario"] == "moon_walk"
    assert summary["steps"] == 500 and math.isclose(summary["simulated_s"], 0.5)
    # The default is a single pass: nothing to converge to.
    assert summary["steps_not_converged"] is None and summary["max_gap_m"] is None
    books = summary["energies"]
    assert books["without_book"] == [] and books["soil_heat_j"] > 0 and books["turnover_j"] >= summary["energy_j"]
    assert books["drift_j"] == summary["energy_balance_j"] and summary["interface_work_error_j"] >= 0
    assert summary["soil_mass_error_relative"] == 0.0
    assert summary["evaluations_mean"] == 1.0 and summary["evaluations_max"] == 1
    for name in ("recording", "report"):
        assert (folder / summary[name]).is_file()


def test_no_number_is_missing_or_wrong(short_run):
    _, summary, _ = short_run
    assert 0.0 < summary["max_sinkage_m"] < 0.06
    assert abs(summary["max_roll_rad"]) < math.radians(15)
    assert summary["real_time_factor"] > 0 and summary["cpu_s"] > 0


def test_recording_has_the_promised_topics(short_run):
    folder, _, _ = short_run
    channels, counts, last = {}, {}, {}
    schemas = {}
    for record in records(folder / "recording.mcap"):
        if isinstance(record, Schema):
            schemas[record.id] = record.name
        elif isinstance(record, Channel):
            channels[record.id] = record
        elif isinstance(record, Message):
            topic = channels[record.channel_id].topic
            counts[topic] = counts.get(topic, 0) + 1
            last[topic] = record
    for topic in ("/robot", "/soil", "/gait", "/tf", "/scene", "/ground", "/gluing"):
        assert counts.get(topic, 0) > 0, f"{topic} is missing from {sorted(counts)}"
    # Time stamps are simulated time, in order.
    assert last["/robot"].log_time == 500_000_000
    assert all(record.message_encoding == "protobuf" for record in channels.values())


def test_csv_has_time_and_dotted_names(short_run):
    folder, _, _ = short_run
    with open(folder / "variables.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert "t_s" in rows[0] and "robot.LF_j2.angle" in rows[0]
    times = [float(row["t_s"]) for row in rows]
    assert times[0] == 0.0 and math.isclose(times[-1], 0.5)
    assert all(a < b for a, b in zip(times, times[1:]))
    assert all(math.isfinite(float(row["robot.body.z"])) for row in rows)


def test_final_ground_is_an_esri_grid(short_run):
    folder, _, _ = short_run
    lines = (folder / "final_ground.asc").read_text().splitlines()
    head = {words[0].lower(): float(words[1]) for words in map(str.split, lines[:6])}
    columns, rows = int(head["ncols"]), int(head["nrows"])
    values = [float(v) for line in lines[5:] if line[0] not in "NnCcXxYy" for v in line.split()]
    assert len(values) == columns * rows and all(map(math.isfinite, values))


def test_report_needs_no_network(short_run):
    folder, _, _ = short_run
    page = (folder / "report.html").read_text()
    assert page.lstrip().lower().startswith("<!doctype html")
    for needle in ('src="http', "src='http", "@import", 'rel="stylesheet" href="http'):
        assert needle not in page


def test_quiet_run_prints_nothing_and_json_only_json(short_run, tmp_path):
    _, _, process = short_run
    assert process.stdout.lstrip().startswith("{")
    quiet = terraglue("run", MOON_WALK, "--duration", "0.01", "--out", tmp_path / "q", "--quiet")
    assert (quiet.returncode, quiet.stdout) == (0, "")


def test_earlier_runs_are_renamed(tmp_path):
    scenario = str(MOON_WALK)
    for _ in range(3):
        assert terraglue("run", scenario, "--duration", "0.01", "--quiet", cwd=tmp_path).returncode == 0
    assert sorted(p.name for p in (tmp_path / "runs").iterdir()) == ["moon_walk", "moon_walk.1", "moon_walk.2"]


def start(folder, *arguments):
    command = [PROGRAM, "run", str(MOON_WALK), "--out", str(folder), "--quiet", *arguments]
    return subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE)


def messages(path):
    return sum(isinstance(r, Message) for r in records_of_cut_file(path)) if path.exists() else 0


def wait_for_messages(path, process):
    """Until a message can be read from the file so far: sizes are no criterion, and times depend on the machine."""
    while messages(path) == 0:
        assert process.poll() is None, process.stderr.read()
        time.sleep(0.1)


def test_a_killed_run_can_still_be_reported(tmp_path):
    folder = tmp_path / "killed"
    process = start(folder, "--duration", "600")
    wait_for_messages(folder / "recording.mcap", process)
    process.kill()
    process.wait()
    process.stdout.close(), process.stderr.close()
    cut = messages(folder / "recording.mcap")
    assert cut > 0
    report = terraglue("report", folder)
    assert report.returncode == 0, report.stderr
    assert (folder / "report.html").is_file()
    mended = sum(isinstance(r, Message) for r in records(folder / "recording.mcap"))
    assert mended >= cut > 0


def records_of_cut_file(path):
    with open(path, "rb") as file:
        try:
            yield from StreamReader(file).records
        except Exception:  # the reader raises at the cut; the messages before it count
            return


def test_an_interrupted_run_closes_its_recording(tmp_path):
    folder = tmp_path / "stopped"
    process = start(folder, "--duration", "600")
    wait_for_messages(folder / "recording.mcap", process)
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=300)
    assert process.returncode == 130
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["status"] == "stopped" and 0 < summary["simulated_s"] < 600
    assert sum(isinstance(r, Message) for r in records(folder / "recording.mcap")) > 0


def test_threads_do_not_change_a_byte(tmp_path):
    recordings = []
    for threads in ("1", "2"):
        folder = tmp_path / threads
        run = terraglue("run", MOON_WALK, "--duration", "0.2", "--threads", threads, "--out", folder, "--quiet",
                        "--set", "recording.digits=17")
        assert run.returncode == 0, run.stderr
        recordings.append((folder / "recording.mcap").read_bytes())
    assert recordings[0] == recordings[1]


def test_a_recording_tells_nothing_of_the_machine(short_run):
    folder, _, _ = short_run
    text = b""
    for record in records(folder / "recording.mcap"):
        if isinstance(record, (Message, Schema)):
            text += record.data
        elif not isinstance(record, Channel):
            text += repr(record).encode()
    assert len(text) > 100_000
    assert str(folder).encode() not in text and str(ROOT).encode() not in text
    assert b"threads" not in text and b"wall_s" not in text


WORLD = """<robot name="room"><link name="world"><visual><geometry><mesh filename="wall.obj"/></geometry></visual>
<collision><origin xyz="2 0 0"/><geometry><mesh filename="wall.obj"/></geometry></collision></link>
<link name="bob"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
<visual><geometry><sphere radius="0.1"/></geometry></visual></link>
<joint name="hinge" type="continuous"><parent link="world"/><child link="bob"/><axis xyz="0 1 0"/></joint></robot>"""


def test_what_stands_in_the_world_is_recorded_and_angles_can_be_set_at_the_start(tmp_path):
    (tmp_path / "wall.obj").write_text("v 0 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\n")
    (tmp_path / "room.urdf").write_text(WORLD)
    (tmp_path / "room.toml").write_text(
        "[time]\nduration_s = 0.01\n[robot]\nmodule = \"rigid-body\"\nmodel = \"room.urdf\"\n"
        "[[event]]\nat_s = 0.0\nset = { \"robot.hinge.angle\" = 0.5 }\n")
    process = terraglue("run", tmp_path / "room.toml", "--out", tmp_path / "out", "--quiet", "--csv")
    assert process.returncode == 0, process.stderr
    all_records = list(records(tmp_path / "out" / "recording.mcap"))
    scene = next(r.id for r in all_records if isinstance(r, Channel) and r.topic == "/scene")
    schemas = {r.id: r for r in all_records if isinstance(r, Schema)}
    channel = next(r for r in all_records if isinstance(r, Channel) and r.id == scene)
    message = next(r for r in all_records if isinstance(r, Message) and r.channel_id == scene)
    decode = DecoderFactory().decoder_for("protobuf", schemas[channel.schema_id])
    world, = [e for e in decode(message.data).entities if e.frame_id == "robot/world"]
    assert sorted(mesh.pose.position.x for mesh in world.triangles) == [0.0, 2.0]
    assert all(list(mesh.indices) == [0, 1, 2] for mesh in world.triangles)
    with open(tmp_path / "out" / "variables.csv", newline="") as file:
        assert abs(float(list(csv.DictReader(file))[-1]["robot.hinge.angle"]) - 0.5) < 1e-2
    late = terraglue("run", tmp_path / "room.toml", "--out", tmp_path / "late", "--quiet",
                     "--set", "event=[{ at_s = 0.005, set = { \"robot.hinge.angle\" = 0.5 } }]")
    assert late.returncode != 0 and "before the first step" in late.stderr


def test_a_run_at_the_pace_of_the_clock_takes_its_time_and_has_the_same_bytes(tmp_path):
    plate = ROOT / "scenarios" / "plate_sinkage.toml"
    recordings, times = [], []
    for name, option in [("free", []), ("paced", ["--realtime"])]:
        begin = time.monotonic()
        done = terraglue("run", plate, "--duration", "2", "--quiet", "--out", tmp_path / name, *option)
        times.append(time.monotonic() - begin)
        assert done.returncode == 0, done.stderr
        recordings.append((tmp_path / name / "recording.mcap").read_bytes())
    assert recordings[0] == recordings[1]
    # how long the other one takes is up to the machine
    assert times[1] > 1.9, times


@pytest.mark.parametrize("strategy", ["cooperative", "cooperative-compliant", "iterative"])
@pytest.mark.parametrize("soil", ["soil-bekker", "soil-cellular-automaton"])
def test_a_press_that_holds_its_speed_pays_for_the_soil(strategy, soil, tmp_path):
    """Under T*, the force of rigid ground, a press gives way; under the soil's force it does not: another branch of its motor."""
    sets = [f"--set={key}" for key in (f"gluing.strategy={strategy}", f"soil.module={soil}", "terrain.spacing_m=0.01")]
    process = terraglue("run", ROOT / "scenarios/plate_sinkage.toml", "--duration", "1.2", "--json", "--out", tmp_path / "out", *sets)
    summary = json.loads(process.stdout)
    work = summary["energies"]["driving_j"] + summary["energies"]["braking_j"]
    assert work > 0.5 and abs(summary["energy_balance_j"]) < 1e-3 * work, process.stderr
    assert summary["evaluations_max"] <= 4 or strategy == "iterative"


def test_a_recording_that_was_cut_off_says_so(short_run, tmp_path):
    folder = tmp_path / "half"
    shutil.copytree(short_run[0], folder)
    with open(folder / "recording.mcap", "r+b") as file:
        file.truncate((folder / "recording.mcap").stat().st_size // 2)
    process = terraglue("report", folder)
    assert process.returncode == 0 and "had no end" in process.stderr, process.stderr
    page = (folder / "report.html").read_text()
    assert "recording cut off" in page and "the run at 0.5" in page


def test_an_open_contact_leaves_no_gap(tmp_path):
    """A plate that is lifted off, glued in one system: a contact that opens is no gap of a closed one."""
    text = (ROOT / "scenarios/plate_sinkage.toml").read_text()
    text = text.replace("../models", f"{ROOT}/models").replace('"cooperative"', '"monolithic"')
    text += """
[[event]]
at_s = 0.55
set = { "bevameter.small_press.velocity_target" = -0.1, "bevameter.large_press.velocity_target" = -0.1 }
"""
    (tmp_path / "lift.toml").write_text(text)
    process = terraglue("run", tmp_path / "lift.toml", "--duration", "0.62", "--out", tmp_path / "lift", "--quiet")
    assert process.returncode == 0, process.stderr
    summary = json.loads((tmp_path / "lift/summary.json").read_text())
    assert summary["steps_not_converged"] == 0
    assert summary["max_gap_m"] < 1e-9
