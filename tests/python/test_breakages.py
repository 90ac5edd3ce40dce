"""Faults that ended in a panic, a hang, a lost run or a misleading message stay mended."""

import json
import os
import re
import signal
import subprocess
import time

import pytest
from conftest import MOON_WALK, PROGRAM, ROOT, small_disk, terraglue
from test_bad_input import refused

# a signal wakes `sleep`, which then goes on
SLOW_LIBRARY = """#include <unistd.h>
__attribute__((constructor)) static void wait_long(void) { for (unsigned left = 3600; left > 0;) left = sleep(left); }
"""


@pytest.mark.parametrize("option", [["--threads", "100000"], ["--threads", "-1"]])
def test_more_threads_than_any_machine_has_are_refused(option, tmp_path):
    message = refused("run", MOON_WALK, "--out", tmp_path / "out", *option)
    assert "--threads" in message and "1024" in message
    assert "1024" in refused("check-module", "soil-bekker", "--jobs", "100000")


@pytest.mark.parametrize("command", [["run"], ["check"], ["fit-soil"], ["fmu", "info"], ["convert"], ["modules"], ["soils", "--file"]])
@pytest.mark.parametrize("kind", ["device", "pipe"])
def test_what_never_ends_is_not_read(command, kind, tmp_path):
    path = "/dev/zero"
    if kind == "pipe":
        path = tmp_path / "pipe"
        os.mkfifo(path)
    process = terraglue(*command, path)
    assert process.returncode == 2 and str(path) in process.stderr, process.stderr
    assert "panicked" not in process.stderr


@pytest.mark.parametrize("key", ["robot.model", "soil.parameters_file", "soil.module"])
def test_files_that_a_scenario_names_are_regular(key, tmp_path):
    for path in ["/dev/zero", tmp_path / "pipe"]:
        path == "/dev/zero" or os.mkfifo(path)
        process = terraglue("check", MOON_WALK, "--set", f"{key}={path}")
        assert process.returncode == 2 and str(path) in process.stderr, process.stderr


@pytest.mark.parametrize("kind", ["device", "pipe"])
def test_a_mesh_is_a_regular_file(kind, tmp_path):
    mesh = tmp_path / "foot.stl"
    os.mkfifo(mesh) if kind == "pipe" else mesh.symlink_to("/dev/zero")
    robot = tmp_path / "robot.urdf"
    robot.write_text('<robot name="r"><link name="a"><inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" '
                     'iyz="0" izz="1"/></inertial><collision><geometry><mesh filename="foot.stl"/></geometry></collision>'
                     '</link></robot>')
    process = terraglue("robot", robot)
    assert "foot.stl" in process.stderr and "not a regular file" in process.stderr, process.stderr
    assert "no such file" not in process.stderr


@pytest.mark.parametrize("command", ["run", "check"])
@pytest.mark.parametrize("edit", ["terrain.size_m=[4e4,4e4]", "terrain.spacing_m=1e-4", "terrain.size_m=[1e6,1.0]"])
def test_grounds_that_fit_no_memory_are_refused(command, edit, tmp_path):
    process = terraglue(command, MOON_WALK, "--set", edit, cwd=tmp_path)
    told = " ".join(line.strip(" |") for line in process.stderr.splitlines())
    assert process.returncode == 2
    for words in ("size_m", "spacing_m", "nodes", "GB of memory", "5e7", "fits this size"):
        assert words in told, told
    # its advice is taken; waves may be too short for it
    fits = told.split("`spacing_m` = ")[-1].split(" fits")[0]
    flat = ["--set", 'terrain={kind="flat",size_m=[6.0,4.0],spacing_m=0.01}']
    again = terraglue("check", MOON_WALK, *flat, "--set", edit, "--set", f"terrain.spacing_m={fits}")
    assert again.returncode == 0 or "fewer than two cells" in again.stderr, again.stderr


def test_whole_numbers_tell_their_range(edited):
    for edit in ("world.seed=9223372036854775808", "world.seed=99999999999999999999"):
        message = refused("check", MOON_WALK, "--set", edit)
        assert "out of range" in message and "9223372036854775807" in message and "text" not in message, message
    message = refused("check", edited("seed = 1 ", "seed = 9223372036854775808 "))
    assert "9223372036854775807" in message and "walk.toml:16" in message, message


@pytest.mark.parametrize("text", ['<robot name="x"><link name="a">', '<robot name="x"></robot>'], ids=["line", "no line"])
@pytest.mark.parametrize("command", ["robot", "new", "check"])
def test_help_of_a_robot_file_is_about_robots(command, text, tmp_path):
    robot = tmp_path / "robot.urdf"
    robot.write_text(text)
    message = refused(*{"robot": ["robot", robot],
                        "new": ["new", "scenario", "--robot", robot, "-o", tmp_path / "new"],
                        "check": ["check", MOON_WALK, "--set", f"robot.model={robot}"]}[command])
    told = message.split("help:")[1]
    assert "docs/rigid-body.md" in told and "terraglue robot" in told and "errors.md" not in told, message


def test_help_leads_to_what_the_error_is_about(tmp_path):
    """By the command that is refused: a part of the help."""
    robot = tmp_path / "robot.txt"
    robot.write_text('<robot name="x"><link name="a">')
    grid = tmp_path / "hill.asc"
    grid.write_text("ncols 2\nnrows 2\ncellsize 1\n1 2\n3 x\n")
    structure = tmp_path / "a.ssd"
    structure.write_text("no structure")
    ground = f'terrain={{kind="esri-ascii",file="{grid}"}}'
    law = ["soil.law.plugin=gait", "soil.law.pressure=0"]
    for command, part in [(["robot", robot], "docs/rigid-body.md"),
                          (["robot", tmp_path / "none.urdf"], "path is right"),
                          (["new", "scenario", "--robot", tmp_path / "none.urdf"], "path is right"),
                          (["fmu", "info", tmp_path / "none.fmu"], "path is right"),
                          (["fmu", "info", structure], "docs/fmi.md"),
                          (["run", structure], "docs/fmi.md"),
                          (["soils", "--file", robot], "models/soils.csv"),
                          (["check", MOON_WALK, "--set", ground], "NODATA_value"),
                          (["check", MOON_WALK, "--set", law[0]], "TG12"),
                          (["check", MOON_WALK, "--set", "robot.position_m=[90.0,0.0,1.0]"], "[terrain]")]:
        process = terraglue(*command)
        told = process.stderr.split("help:")[-1]
        assert process.returncode in (1, 2) and part in told, (command, process.stderr)


def test_a_signal_ends_the_loading_of_a_run(tmp_path):
    (tmp_path / "slow.c").write_text(SLOW_LIBRARY)
    library = tmp_path / "libslow_plugin.so"
    subprocess.run(["cc", "-shared", "-fPIC", tmp_path / "slow.c", "-o", library], check=True)
    scenario = tmp_path / "slow.toml"
    scenario.write_text(f'[time]\nduration_s = 1.0\n[robot]\nmodule = "{library}"\n')
    command = [PROGRAM, "run", str(scenario), "--out", str(tmp_path / "out")]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    while "libslow_plugin" not in open(f"/proc/{process.pid}/maps").read():
        assert process.poll() is None
        time.sleep(0.01)
    process.send_signal(signal.SIGTERM)
    _, told = process.communicate(timeout=300)
    assert process.returncode == 130 and "while loading" in told, told
    assert not (tmp_path / "out").exists()


def test_what_takes_long_before_the_first_step_is_said(tmp_path):
    terrain = ["--set", "terrain.size_m=[20.0,20.0]", "--set", "time.settle_s=600"]
    command = [PROGRAM, "run", str(MOON_WALK), "--out", str(tmp_path / "out"), *terrain]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    told = [process.stderr.readline()]
    while told[-1] and "comes to rest" not in told[-1]:
        told.append(process.stderr.readline())
    process.send_signal(signal.SIGTERM)
    process.communicate(timeout=300)
    assert re.search(r"note: .* t = -\d+\.\d+ s \(\d+ s so far\)", told[-1]), told


def test_steps_without_number_are_refused_and_very_many_are_warned_of():
    message = refused("run", MOON_WALK, "--set", "time.step_s=1e-12")
    assert "1.000e13 steps" in message and "at most 1e9" in message and "help:" in message
    process = terraglue("check", MOON_WALK, "--set", "time.step_s=2e-8")
    assert process.returncode == 0 and "5.000e8 steps" in process.stderr, process.stderr


def kept(folder):
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["status"] == "failed" and "kept up to" in summary["error"]["message"]
    return summary["error"]["time_s"]


def limited(blocks, *arguments, cwd):
    """The program where no file may be longer than this many KiB."""
    words = " ".join(f"'{word}'" for word in [PROGRAM, *map(str, arguments)])
    return subprocess.run(["bash", "-c", f"ulimit -f {blocks}; {words}"], cwd=cwd, capture_output=True, text=True, timeout=300)


def test_a_file_that_may_not_grow_leaves_the_run_up_to_then(tmp_path):
    process = limited(1500, "run", MOON_WALK, "--out", "out", "--duration", "3", cwd=tmp_path)
    assert process.returncode == 1, process.stderr
    folder = tmp_path / "out"
    for word in ["out/recording.mcap", "MiB are free", "kept up to t = ", "help:"]:
        assert word in process.stderr, process.stderr
    assert "attempted another write" not in process.stderr
    until = kept(folder)
    assert 0 < until < 3
    assert not list(folder.glob(".reserve"))
    report = terraglue("report", folder)
    assert report.returncode == 0 and "damaged" not in report.stderr, report.stderr


def test_a_full_disk_leaves_the_run_up_to_then(tmp_path):
    with small_disk(tmp_path / "disk", "4m") as disk:
        process = terraglue("run", MOON_WALK, "--out", disk / "out", "--duration", "3", "--csv")
        assert process.returncode == 1 and "kept up to t = " in process.stderr, process.stderr
        assert "No space left" in process.stderr and "0.0 MiB are free" in process.stderr
        assert 0 < kept(disk / "out") < 3


def test_readings_that_fall_with_the_depth_are_no_soil(tmp_path):
    rows = "\n".join(f"{z},{100.0 / z},50" for z in range(4, 40))
    (tmp_path / "falls.csv").write_text(f"sinkage_mm,pressure_kPa,plate_diam_mm\n{rows}\n")
    message = refused("fit-soil", tmp_path / "falls.csv", "--law", "bekker", "--out", tmp_path / "soil.toml")
    assert "falls as the sinkage grows" in message and "help:" in message
    assert not (tmp_path / "soil.toml").exists()


COMMENT = "# robot.LF_j1.angle_targt stands in a comment\n"


def test_an_error_in_an_edit_points_at_the_edit(edited):
    fault = f'[[fault]]\n{COMMENT}variable = "robot.LF_j1.angle_target"\nkind = "freeze"\nat_s = 1.0\n\n[gluing]'
    path = edited("[gluing]", fault)
    message = refused("check", path, "--set", "fault.0.variable=robot.LF_j1.angle_targt")
    assert "[--set:1:18]" in message and "stands in a comment" not in message, message
    message = refused("check", MOON_WALK, "--set", 'event=[{at_s=1.0,set={"robot.LF_j2.max_torqe"=0.0}}]')
    assert "[--set:1:24]" in message, message
    message = refused("check", MOON_WALK, "--set", "connect.0.to=robot.nothing")
    assert "[--set:1:14]" in message, message


def test_the_file_itself_is_not_what_was_meant(tmp_path):
    (tmp_path / "s.toml").write_bytes(b"\xff\xfe")
    assert "did you mean" not in refused("run", tmp_path / "s.toml")
    (tmp_path / "t.toml").symlink_to("nowhere.toml")
    assert "`t.toml`?" not in refused("run", tmp_path / "t.toml")


def test_a_fault_acts_before_it_ends(edited):
    fault = '[[fault]]\nvariable = "robot.LF_j1.angle_target"\nkind = "freeze"\nat_s = 1.0\nuntil_s = 0.5\n\n[gluing]'
    message = refused("check", edited("[gluing]", fault))
    assert "never act" in message and "until_s = 0.5" in message and "help:" in message
    late = fault.replace("at_s = 1.0\nuntil_s = 0.5", "at_s = 1000.0")
    assert "a fault at 1000 s never happens" in terraglue("check", edited("[gluing]", late)).stderr


@pytest.mark.parametrize("text", ["a = " + "[" * 100_000, "a" * 100_000, '[time]\nstep_s = "' + "x" * 100_000 + '"', "{" * 9000])
def test_long_lines_are_shortened(text, tmp_path):
    (tmp_path / "long.toml").write_text(text)
    message = refused("run", tmp_path / "long.toml")
    assert len(message) < 3000, len(message)


def test_pictures_that_are_damaged_are_told_in_words(edited, tmp_path):
    terrain = '[terrain]\nkind = "{}"\nfile = "../ground.{}"\n'
    png = b"\x89PNG\r\n\x1a\n\x00\x00\x00\rIHDR\x00\x00\x00\x04\x00\x00\x00\x04\x08\x00\x00\x00\x00AAAA"
    for kind, name, data in [("png", "png", png), ("geotiff", "tif", b"II*\x00\x08\x00\x00\x00\x01\x00\x63\x63"), ("geotiff", "tif", b"II*\x00" + b"\xff" * 40)]:
        (tmp_path / f"ground.{name}").write_bytes(data)
        text = MOON_WALK.read_text()
        begin, end = text.index("[terrain]"), text.index("\n[", text.index("[terrain]")) + 1
        extra = "pixel_m = 0.1\nlow_m = 0.0\nhigh_m = 1.0\n" if kind == "png" else ""
        path = edited(text[begin:end], terrain.format(kind, name) + extra + "\n")
        message = refused("check", path)
        assert f"ground.{name}" in message and "help:" in message, message
        assert not any(c in message for c in ["{ ", "Some(", "ChunkType", "Error("]), message


def test_check_counts_connections_and_not_patterns():
    told = terraglue("check", MOON_WALK)
    assert "good: 33 connections" in told.stdout, told.stdout


def test_warnings_and_errors_have_one_form():
    told = terraglue("check", MOON_WALK, "--set", "soil.k_phi=1528").stderr
    assert told.startswith("warning: ") and "warn: " not in told, told
    told = refused("check", MOON_WALK, "--set", "soil.modle=x")
    assert told.startswith("error: unknown key") and " x " not in told and "×" not in told, told


def test_an_earlier_run_in_a_named_folder_is_kept(tmp_path):
    for _ in range(2):
        done = terraglue("run", MOON_WALK, "--duration", "0.01", "--quiet", "--out", "out/", cwd=tmp_path)
        assert done.returncode == 0, done.stderr
    assert sorted(p.name for p in tmp_path.iterdir()) == ["out", "out.1"]
    assert "note: the earlier results in out are in out.1 now" in done.stderr, done.stderr
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.tex").write_text("text")
    message = refused("run", MOON_WALK, "--duration", "0.01", "--out", tmp_path / "mine")
    assert "thesis.tex" in message and "help:" in message
    assert [p.name for p in (tmp_path / "mine").iterdir()] == ["thesis.tex"]
    assert "renamed" in terraglue("run", "--help").stdout
