"""Inputs that are wrong in every way that was thought of. None may panic, hang, or leave the user without place and cure."""

import json
import os
import pathlib
import re
import struct
import zipfile
from concurrent.futures import ThreadPoolExecutor

import pytest
from cfmu import build
from conftest import MOON_WALK, PROGRAM, ROOT, small_disk, terraglue

WALK = MOON_WALK.read_text().replace("../models", str(ROOT / "models"))
ROBOT = (ROOT / "models" / "hexapod.urdf").read_text()
PLATE = "sinkage_mm,pressure_kPa,plate_diam_mm\n"
LIMIT_S = 300

# ---------------------------------------------------------------------------------------------------------------------
# Tables: input, exit code, words that must appear.

# Arguments after `check WALK --set`.
SETS = [
    ("gluing.strategy", 2, "there is no `=`"),
    ("gluing.strategy=newton", 2, "unknown strategy `newton`"),
    ("gluing.strategy=3", 2, "not 3"),
    ("gluing.strategy=", 2, "strategy"),
    ("=3", 2, "no key path"),
    ("gluing..strategy=x", 2, "no key path"),
    ("gluing.stratgy=x", 2, "`strategy`"),
    ("gluing.tolerance=-1", 2, "out of range"),
    ("gluing.tolerance=nan", 2, "nan or inf"),
    ("gluing.max_iterations=0", 2, "max_iterations"),
    ("gluing.max_iterations=1.5", 2, "1.5"),
    ("gluing.max_iterations=99999999999999999999", 2, "max_iterations"),
    ("gluing.form=odd", 2, "form"),
    ("time.step_s=0", 2, "out of range"),
    ("time.step_s=-0.001", 2, "out of range"),
    ("time.step_s=inf", 2, "nan or inf"),
    ("time.step_s=1e-12", 2, "1.000e13 steps"),
    ("time.step_s=fast", 2, "the text \"fast\""),
    ("time.step_s=[0.001]", 2, "step_s"),
    ("time.step_s={a=1}", 2, "step_s"),
    ("time.duration_s=0", 2, "duration_s"),
    ("time.duration_s=1e300", 2, "duration_s"),
    ("time.duration_s=0.00015", 2, "no multiple"),
    ("time.settle_s=-1", 2, "settle_s"),
    ("time=3", 2, "is a table"),
    ("world.gravity_m_s2=9.81", 2, "gravity_m_s2"),
    ("world.gravity_m_s2=[0,0]", 2, "gravity_m_s2"),
    ("world.gravity_m_s2=[0,0,nan]", 2, "gravity_m_s2"),
    ("world.seed=-1", 2, "seed"),
    ("terrain.kind=lava", 2, "kind"),
    ("terrain.size_m=[0,0]", 2, "size_m"),
    ("terrain.size_m=[-6,4]", 2, "size_m"),
    ("terrain.size_m=[1e9,1e9]", 2, "size_m"),
    ("terrain.spacing_m=1e-9", 2, "spacing_m"),
    ("terrain.spacing_m=0", 2, "out of range"),
    ("terrain.wavelengths_m=[3.0,0.3]", 2, "wavelengths_m"),
    ("terrain.file=x.asc", 2, "no file `x.asc`"),
    ("terrain.pixel_m=1.0", 2, "does not belong to kind"),
    ("soil.module=soil-beker", 2, "`soil-bekker`"),
    ("soil.module=/no/such.so", 2, "relative to the folder of the scenario"),
    ("soil.module=/etc/passwd", 2, "TG"),
    ("soil.module=", 2, "module"),
    ("soil.module=gait", 2, "soil"),
    ("soil.parameters=lunar", 2, "there is no soil `lunar`"),
    ("soil.parameters=nothing.toml", 2, "nothing.toml"),
    ("soil.parameters=[1]", 2, "parameters"),
    ("soil.parameters_file=/no/such.csv", 2, "/no/such.csv"),
    ("soil.parameters_file=/tmp", 2, "a folder"),
    ("soil.n=-1", 2, "`n`"),
    ("soil.n=two", 2, "the text \"two\""),
    ("soil.k_phi=nan", 2, "k_phi"),
    ("soil.phi_rad=35", 2, "0.611 rad"),
    ("soil.c_pa=-5", 2, "c_pa"),
    ("soil.modle=x", 2, "`module`"),
    ("soil.law={pressure=\"k_phi*\"}", 2, "pressure"),
    ("soil.law={pressure=\"k_phi*z^n/0s\"}", 2, "pressure"),
    ("soil.law={pressure=\"z\"}", 2, "pressure"),
    ("soil.law={plugin=\"no-law\"}", 2, "no-law"),
    ("robot.module=rigid-bdy", 2, "`rigid-body`"),
    ("robot.model=/no/such.urdf", 2, "/no/such.urdf"),
    ("robot.model=/tmp", 2, "a folder"),
    ("robot.model=", 2, "a folder"),
    ("robot.stiffness=-600", 2, "stiffness"),
    ("robot.motor=steam", 2, "motor"),
    ("robot.joints={nothing=1.0}", 2, "nothing"),
    ("robot.isolate=maybe", 2, "isolate"),
    ("gait.gait=gallop", 2, "gait"),
    ("gait.speed_m_s=fast", 2, "speed_m_s"),
    ("gait.step_multiple=0", 2, "step_multiple"),
    ("connect.0.from=robot.nothing", 2, "to fill them"),
    ("connect.2.from=robot.nothing", 2, "no variable and no stream matches"),
    ("connect.0.to=robot.*.*.x", 2, "`*`"),
    ("connect.1.to=gait.*.angle_target", 2, "does not exist"),
    ("connect.2.to=robot.body.yaw", 2, "is not an input"),
    ("connect.2.from=robot.body.x", 2, "cannot be connected"),
    ("connect=3", 2, "[[connect]]"),
    ("report.body=robot.bdy", 2, "robot.body"),
    ("report.joint=robot.none", 2, "robot.none"),
    ("recording.every_steps=0", 2, "every_steps"),
    ("recording.every=5", 2, "every_steps"),
    ("glue=[{side_1=\"robot.body\",side_2=\"moon.x\"}]", 2, "moon"),
    ("glue=[{side_1=\"robot.none\",side_2=\"world\"}]", 2, "robot.none"),
    ("event=[{at_s=1.0}]", 2, "does nothing"),
    ("event=[{set={\"robot.LF_j2.max_torque\"=0.0}}]", 2, "`at_s` or `when`"),
    ("event=[{at_s=1.0,set={\"robot.LF_j2.max_torqe\"=0.0}}]", 2, "max_torque`?"),
    ("event=[{at_s=1.0,set={\"robot.LF_j2.max_torque\"=nan}}]", 2, "finite"),
    ("event=[{at_s=1.0,set={\"robot.LF_j2.max_torque\"=1e300}}]", 2, "plausible is at most 1e15 N m"),
    ("event=[{when=\"robot.body.z<1\",set={\"gait.heading\"=-1e300}}]", 2, "plausible is at most 1e6 rad in either direction"),
    ("event=[{at_s=1.0,act=\"robot.LF_j2.explode\"}]", 2, "explode"),
    ("event=[{when=\"robot.body.z\",act=\"robot.LF_j2.break\"}]", 2, "no comparison"),
    ("event=[{when=\"robot.body.z < high\",act=\"robot.LF_j2.break\"}]", 2, "no number"),
    ("fault=[{variable=\"robot.LF_j1.angle_target\",kind=\"melt\",at_s=1.0}]", 2, "kind"),
    ("fault=[{variable=\"robot.LF_j1.angle\",kind=\"freeze\",at_s=1.0}]", 2, "robot.LF_j1.angle"),
    ("fault=[{variable=\"robot.LF_j1.angle_target\",kind=\"freeze\",at_s=2.0,until_s=1.0}]", 2, "never act"),
    ("fault=[{variable=\"robot.LF_j1.angle_target\",kind=\"drop-out\",probability=2.0,at_s=1.0}]", 2, "probability"),
    ("unknown.key=1", 2, "unknown table"),
    ("ключ.π=1", 2, "ключ"),
]

# A whole scenario as text.
TEXTS = [
    ("", 2, "is empty"),
    ("\n\n", 2, "is empty"),
    ("[time", 2, "not TOML"),
    ("[time]\nstep_s = 0.001\nstep_s = 0.002\n", 2, "duplicate key"),
    ("[time]\n[time]\n", 2, "duplicate key"),
    ("[time]\nstep_s = 0.001.2\n", 2, "not TOML"),
    ("[time]\nstep_s = 1_000_\n", 2, "not TOML"),
    ("a = \"\u0000\"", 2, "not TOML"),
    ("\ufeff[time]\nduration_s = 1.0\n", 2, "no subsystem"),
    ("a = " + "[" * 50_000, 2, "recursion"),
    ("a" * 100_000, 2, "not TOML"),
    ("[time]\nduration_s = 1.0\n[soil]\nmodul = \"x\"\n", 2, "unknown table `[soil]`"),
    ("time = 3\n[soil]\nmodule = \"soil-bekker\"\n", 2, "is a table"),
    ("[time]\nduration_s = 1.0\n[event]\nat_s = 1.0\n[soil]\nmodule = \"soil-bekker\"\n", 2, "two brackets"),
    ("<robot/>", 2, "not TOML"),
    ("{\"time\": {}}", 2, "not TOML"),
    ("[time]\nduration_s = 1.0\n[a]\nfmu = \"none.fmu\"\n", 2, "none.fmu"),
    ("[time]\nduration_s = 1.0\n[a]\nmodule = \"soil-bekker\"\n[b]\nmodule = \"soil-bekker\"\n", 2, "b"),
    ("[time]\nduration_s = 1.0\n[\"a.b\"]\nmodule = \"gait\"\n", 2, "no name for a subsystem"),
]

# A robot file as text: put next to the scenario.
ROBOTS = [
    ("", "robot"), ("<robot", "robot"), ("<robot name='a'/>", "robot"), ("<mujoco/>", "robot"), ("<html/>", "robot"),
    ("<robot name='a'>" + "<link>" * 5000, "robot"),
    (ROBOT.replace("<mass value=", "<mass value=\"-1\" old=", 1), "robot"),
    (ROBOT.replace("<mass value=", "<mass value=\"heavy\" old=", 1), "robot"),
    (ROBOT.replace("<mass value=", "<mass value=\"nan\" old=", 1), "robot"),
    (ROBOT.replace("parent link=\"", "parent link=\"no_", 1), "no_"),
    (ROBOT[: len(ROBOT) // 2], "robot"),
    ("<robot name='a'><link name='l'><inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial><collision><geometry><mesh filename='m.stl'/></geometry></collision></link></robot>", "m.stl"),
]

# Ground: kind, ending, bytes, further keys.
GROUNDS = [
    ("esri-ascii", "asc", b"", ""), ("esri-ascii", "asc", b"\xff\xfe", ""), ("esri-ascii", "asc", b"ncols 1e9\nnrows 2\n", ""),
    ("esri-ascii", "asc", b"ncols 2\nnrows 2\ncellsize 1\n1 2 3\n", ""), ("esri-ascii", "asc", b"ncols 2\nnrows 2\ncellsize 1\n1 2 3 x\n", ""),
    ("esri-ascii", "asc", b"ncols 2\nnrows 2\ncellsize 0\n1 2 3 4\n", ""), ("esri-ascii", "asc", b"ncols 2\nnrows 2\ncellsize 1\n1 2 3 -9999\n", ""),
    ("png", "png", b"", "pixel_m = 1.0\nhigh_m = 1.0\n"), ("png", "png", b"\x89PNG\r\n\x1a\n", "pixel_m = 1.0\nhigh_m = 1.0\n"),
    ("png", "png", b"\x89PNG\r\n\x1a\n" + struct.pack(">I", 13) + b"IHDR" + struct.pack(">IIBBBBB", 2**31 - 1, 2**31 - 1, 16, 0, 0, 0, 0) + b"AAAA", "pixel_m = 1.0\nhigh_m = 1.0\n"),
    ("geotiff", "tif", b"", ""), ("geotiff", "tif", b"II*\x00" + b"\xff" * 64, ""), ("geotiff", "tif", b"MM\x00*\x00\x00\x00\x08\x00\x00", ""),
]

# Arguments alone; `{}` is the folder of the test.
COMMANDS = [
    ("run", 2, "Usage"), ("", 2, "Usage"), ("fly", 2, "fly"), ("run a.toml b.toml", 2, "b.toml"), ("run {}/none.toml", 2, "none.toml"),
    ("run {}", 2, "a folder"), ("run /dev/null", 2, "/dev/null"), ("run /dev/zero", 2, "a device"), ("run {}/pipe", 2, "pipe"),
    ("run {walk} --threads 100000", 2, "1024"), ("run {walk} --threads x", 2, "--threads"), ("run {walk} --duration -1", 2, "duration_s"),
    ("run {walk} --duration nan", 2, "duration_s"), ("run {walk} --out /dev/null/x", 2, "/dev/null/x"), ("run {walk} --out {}", 2, "no run"),
    ("run {walk} --out /proc/x", 2, "/proc/x"), ("run {walk} --set", 2, "--set"), ("run {walk} --reload-reset", 2, "--watch"),
    ("check {walk} --module-path", 2, "--module-path"), ("compare {walk} --strategies none", 2, "`none`"),
    ("compare {walk} --soils gait", 2, "gait"), ("compare {walk} --steps 0", 2, "step_s"), ("compare {walk} --steps x", 2, "--steps"),
    ("compare {walk} --reference nothing", 2, "nothing"), ("report {}", 2, "recording.mcap"), ("report {}/cut", 2, "recording.mcap"),
    ("report {}/noise", 2, "recording.mcap"), ("report /dev/null", 2, "recording.mcap"), ("variables {}/none.toml", 2, "none.toml"),
    ("modules soil-beker", 2, "soil-bekker"), ("modules {}/none.so", 2, "none.so"), ("soils lunar_nominl_Apollo", 2, "lunar_nominal_Apollo"),
    ("soils --file {}/none.csv", 2, "none.csv"), ("soils --file {}/text.txt", 2, "text.txt"), ("check-module {}/none.so", 2, "none.so"),
    ("check-module soil-bekker --only nothing", 2, "nothing"),
    ("check-module soil-bekker --jobs 0", 2, "--jobs"), ("new soil Soil", 2, "Soil"), ("new soil soil-bekker", 2, "soil-bekker"),
    ("new moon x", 2, "moon"), ("new soil x --lang fortran", 2, "fortran"), ("export nothing -o {}/x.fmu", 2, "nothing"),
    ("export soil-bekker -o {}/none/x.fmu --set soil.parameters=LETE_sand", 2, "x.fmu"), ("convert {}/none.ssp", 2, "none.ssp"), ("convert {}/text.ssp", 2, "text.ssp"),
    ("export soil-bekker -o {}/text.txt --set soil.parameters=LETE_sand", 2, "would be lost"), ("export soil-bekker -o {}/pipe --set soil.parameters=LETE_sand", 2, "is no file"),
    ("check-module soil-bekker --level quick --only loads --json {}/pipe", 2, "a pipe"), ("check-module soil-bekker --level quick --only loads --junit {}/pipe", 2, "a pipe"),
    ("fit-soil {}/head.csv --law bekker --out {}/pipe", 2, "four readings"), ("fmu info {}/none.fmu", 2, "none.fmu"), ("fmu info {}/text.fmu", 2, "text.fmu"), ("fmu info {}/empty.fmu", 2, "empty.fmu"),
    ("fmu run {}/bad.fmu", 2, "bad.fmu"), ("fmu check {}/bad.fmu", 2, "bad.fmu"), ("fmu run {}/text.fmu --step 0", 2, "text.fmu"),
    ("fit-soil {}/none.csv", 2, "none.csv"), ("fit-soil {}/text.txt", 2, "text.txt"), ("fit-soil {}/head.csv --law bekker", 2, "four readings"),
    ("fit-soil {}/falls.csv --law bekker", 2, "falls"), ("fit-soil {}/words.csv --law bekker", 2, "words.csv"),
    ("fit-soil {}/head.csv --from-mm nan", 2, "--from-mm"), ("fit-soil {}/head.csv --law none", 2, "none"),
    ("fit-soil {}/head.csv --wheel radius=x", 2, "radius"), ("fit-soil {}/good.csv --law bekker --out {}/none/x.toml", 2, "/none/x.toml"),
    ("fit-soil {}/good.csv --law bekker --out {}", 2, "a folder"), ("fit-soil {}/good.csv --law bekker --predict {}/none.csv", 2, "none.csv"),
    ("check-module soil-bekker --level quick --only loads --json {}/none/x.json", 2, "/none/x.json"),
    ("check-module soil-bekker --level quick --only loads --junit {}", 2, "attacks"), ("check-module soil-bekker --level hard", 2, "hard"),
    ("check-module soil-bekker --set nothing=1 --only loads", 2, "nothing"), ("check-module soil-bekker --time-limit 0", 2, "--time-limit"),
    ("robot {}/text.txt", 2, "text.txt"), ("robot {}/none.urdf", 2, "none.urdf"), ("variables {walk} nothing.at.all", 2, "nothing.at.all"),
    ("variables {walk} --module-path {}/none", 2, "/none"), ("report {}/none", 2, "none"), ("export {walk} -o {}/x.fmu --fmi 4", 2, "4"),
    ("compare {walk} --vary soil.n", 2, "--vary"), ("compare {walk} --vary soil.n=1,,2", 2, "a value is empty"),
    ("compare {walk} --steps -1", 2, "step_s"), ("compare {walk} --reference-step 1e-3", 2, "--reference"), ("new scenario x", 2, "--robot"),
    ("run {walk} --checkpoint-every x", 2, "--checkpoint-every"), ("run --resume {}", 2, "checkpoint"), ("soils {}/x moon", 2, "moon"),
]

# ---------------------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    folder = tmp_path_factory.mktemp("attacks")
    os.mkfifo(folder / "pipe")
    (folder / "walk.toml").write_text(WALK)
    for name in ["text.txt", "text.ssp", "text.fmu"]:
        (folder / name).write_text("some words\n")
    (folder / "empty.fmu").write_bytes(b"")
    with zipfile.ZipFile(folder / "bad.fmu", "w") as fmu:
        fmu.writestr("modelDescription.xml", "<fmiModelDescription fmiVersion='9.0'/>")
    for name, data in [("cut", b""), ("noise", bytes(range(256)) * 40)]:
        (folder / name).mkdir()
        (folder / name / "recording.mcap").write_bytes(data)
    (folder / "head.csv").write_text(PLATE)
    (folder / "good.csv").write_text(PLATE + "".join(f"{z},{10.0 * z + d / 10},{d}\n" for d in (50, 100) for z in range(4, 40)))
    (folder / "words.csv").write_text(PLATE + "one,two,three\n")
    (folder / "falls.csv").write_text(PLATE + "".join(f"{z},{100.0 / z},50\n" for z in range(4, 40)))
    return folder


def fault_of(process, code, words):
    """Why an answer is no good one; None: it is."""
    told = process.stderr
    unwrapped = re.sub(r"\n[\s|│]*", " ", told)
    reasons = [
        ("panicked", "panicked" in told or process.returncode == 101),
        ("a signal", process.returncode < 0),
        (f"exit code {process.returncode}", process.returncode != code if code is not None else process.returncode not in (1, 2)),
        (f"no `{words}`", words not in unwrapped and words not in told),
        ("no cure", not re.search(r"help:|--help|Usage|tip:", told)),
        ("no form", not re.match(r"(warning: .*\n)*(error: |Usage|Simulates)", told)),
        ("too long", len(told) > 12_000),
        ("Debug output", re.search(r"Some\(|Error \{|ErrorKind|Os \{", told) is not None),
    ]
    found = [reason for reason, holds in reasons if holds]
    return f"{', '.join(found)}:\n{told[:1500]}" if found else None


def attack(rows):
    """Makes all attacks on two cores; the list of bad answers."""
    def one(row):
        name, arguments, code, words, cwd = row
        process = terraglue(*arguments, cwd=cwd, timeout=LIMIT_S)
        fault = fault_of(process, code, words)
        return fault and f"{name[:200]}: {fault}"
    with ThreadPoolExecutor(2) as pool:
        return [fault for fault in pool.map(one, rows) if fault]


def test_there_are_enough_of_them():
    assert len(SETS) + len(TEXTS) + len(ROBOTS) + len(GROUNDS) + len(COMMANDS) >= 136


def attack_edits(place, sets):
    rows = [(text, ["check", place / "walk.toml", "--set", text], code, words, place) for text, code, words in sets]
    faults = attack(rows)
    assert not faults, "\n\n".join(faults)


def test_edits(place):
    attack_edits(place, SETS)


def test_texts(place):
    rows = []
    for k, (text, code, words) in enumerate(TEXTS):
        path = place / f"text{k}.toml"
        path.write_text(text)
        rows.append((text, ["run", path], code, words, place))
    faults = attack(rows)
    assert not faults, "\n\n".join(faults)


def test_robots(place):
    rows = []
    for k, (text, words) in enumerate(ROBOTS):
        (place / f"robot{k}.urdf").write_text(text)
        rows.append((text, ["check", place / "walk.toml", "--set", f"robot.model=robot{k}.urdf"], 2, words, place))
    faults = attack(rows)
    assert not faults, "\n\n".join(faults)


def test_grounds(place):
    begin, end = WALK.index("[terrain]"), WALK.index("\n[", WALK.index("[terrain]"))
    rows = []
    for k, (kind, ending, data, keys) in enumerate(GROUNDS):
        (place / f"ground{k}.{ending}").write_bytes(data)
        path = place / f"ground{k}.toml"
        table = f'[terrain]\nkind = "{kind}"\nfile = "ground{k}.{ending}"\n{keys}'
        path.write_text(WALK[:begin] + table + WALK[end:])
        rows.append((f"{kind} {data[:40]}", ["check", path], 2, f"ground{k}.{ending}", place))
    faults = attack(rows)
    assert not faults, "\n\n".join(faults)


def test_commands(place):
    rows = []
    for text, code, words in COMMANDS:
        arguments = [word.replace("{walk}", str(place / "walk.toml")).replace("{}", str(place)) for word in text.split()]
        rows.append((text, arguments, code, words, place))
    faults = attack(rows)
    assert not faults, "\n\n".join(faults)


@pytest.mark.skipif(os.geteuid() == 0, reason="root reads everything")
def test_what_may_not_be_read(place):
    path = place / "secret.toml"
    path.write_text(WALK)
    path.chmod(0)
    faults = attack([("unreadable", ["run", path], 2, "secret.toml", place)])
    assert not faults, "\n\n".join(faults)


# ---------------------------------------------------------------------------------------------------------------------
# Found by a second look: each of these passed in silence, hung, or offered no way out.

SECOND_SETS = [
    ("recording.include=[\"nothing.*\"]", 2, "`include` names no variable"),
    ("recording.include=[\"\"]", 2, "`include` names no variable"),
    ("recording.exclude=[\"robot.*[\"]", 2, "`exclude` names no variable"),
    ("event=[{at_s=1.0,when=\"robot.body.z<1\",act=\"robot.LF_j2.break\"}]", 2, "leave one of the two out"),
    ("connect.0.to=robot.*.*.x", 2, "keys of `[connect]`"),
]


def test_edits_of_a_second_look(place):
    attack_edits(place, SECOND_SETS)


def test_texts_of_a_second_look(place):
    twice = '\n[[connect]]\nfrom = "gait.LF_j2.angle_target"\nto = "robot.LF_j2.angle_target"\n'
    rows = []
    for k, (more, words) in enumerate([('\n[""]\nmodule = "gait"\n', "no name for a subsystem"), (twice, "delete one of the two"),
                                       ('\n["  "]\nmodule = "gait"\n', "no name for a subsystem"), ('\n[x]\nmodule = ""\n', "terraglue modules")]):
        path = place / f"second{k}.toml"
        path.write_text(WALK + more)
        rows.append((more, ["check", path], 2, words, place))
    faults = attack(rows)
    assert not faults, "\n\n".join(faults)


def test_commands_of_a_second_look(place):
    (place / "soup.csv").write_bytes(b"\xff\xfe\x00\x01")
    (place / "disc.csv").write_text(PLATE + "1,2,0\n")
    walk = str(place / "walk.toml")
    rows = [("shortest checkpoint", ["run", walk, "--checkpoint-every", "1e-300", "--out", place / "never"], 2, "a microsecond", place),
            ("no text", ["fit-soil", place / "soup.csv"], 2, "commas between the cells", place),
            ("no plate", ["fit-soil", place / "disc.csv"], 2, "diameter or width", place),
            ("empty", ["fit-soil", place / "empty.fmu"], 2, "names of the columns", place),
            ("a scenario", ["convert", walk], 2, "ends in .ssp", place),
            ("robot for a soil", ["new", "soil", "x", "--robot", "r.urdf"], 2, "leave --robot out", place)]
    faults = attack(rows)
    assert not faults, "\n\n".join(faults)


def test_a_table_of_a_spreadsheet_begins_with_a_mark(place):
    readings = "".join(f"{z},{3.0 * z**0.9},{b}\n" for z in range(3, 30) for b in (50, 100))
    fits = []
    for name, mark in [("plain", b""), ("marked", b"\xef\xbb\xbf")]:
        (place / f"{name}.csv").write_bytes(mark + (PLATE + readings).replace("\n", "\r\n").encode())
        done = terraglue("fit-soil", place / f"{name}.csv", "--law", "bekker")
        assert done.returncode == 0, done.stderr
        fits.append(done.stdout)
    assert fits[0] == fits[1]


def test_an_stl_file_that_was_cut_off_is_refused(place):
    corners = struct.pack("<12fH", 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0)
    tetrahedron = corners + struct.pack("<12fH", 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 1, 0) + struct.pack("<12fH", 0, 0, 1, 0, 0, 0, 0, 0, 1, 1, 0, 0, 0)
    (place / "half.stl").write_bytes(b"x" * 80 + struct.pack("<I", 400) + tetrahedron)
    inertial = "<inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial>"
    mesh = "<collision><geometry><mesh filename='half.stl'/></geometry></collision>"
    (place / "half.urdf").write_text(f"<robot name='r'><link name='a'>{inertial}{mesh}</link></robot>")
    faults = attack([("half.stl", ["robot", place / "half.urdf"], 2, "400 triangles and holds 3", place)])
    assert not faults, "\n\n".join(faults)


def test_a_standard_output_without_room(place):
    import subprocess
    with open("/dev/full", "w") as full:
        done = subprocess.run([PROGRAM, "soils"], stdout=full, stderr=subprocess.PIPE, text=True, timeout=LIMIT_S)
    assert done.returncode == 1 and "help: look for room" in done.stderr, done.stderr


# ---------------------------------------------------------------------------------------------------------------------
# A third look: the first rows of each table passed in silence, failed in the middle of a run, or named another cause.

FREEZE = 'fault=[{variable="robot.LF_j1.angle_target",kind="freeze",at_s=0.0,'
THIRD_SETS = [
    ("robot.position_m=[nan,0,0]", 2, "a list with nan or inf in it"),
    ("robot.joints={LF_j1=nan}", 2, "a table with nan or inf in it"),
    ("report.commanded_speed=robot", 2, "lists its variables"),
    ('event=[{at_s=1.0,set={"robot"=1}}]', 2, "lists its variables"),
    ('event=[{at_s=1.0,set={"robot.body.z"=1}}]', 2, "before the first step"),
    ("event.0.at_s=3", 2, "--set event=[{"),
    ("connect.99.to=x", 2, "--set connect.0.KEY"),
    (FREEZE + "for_s=0}]", 2, "never act"),
    ("world.gravity_m_s2=[1e308,0,0]", 2, "out of range"),
    ("world.gravity_m_s2={z=-1.62}", 2, "a list of 3 numbers"),
    ("time.duration_s=-0.0", 2, "out of range"),
    ("time.duration_s='1'", 2, "the text \"1\""),
    ("time.duration_s=1979-05-27", 2, "the text \"1979-05-27\""),
    ("time.step_s.x=1", 2, "not a table"),
    ("time={}", 2, "lacks `duration_s`"),
    ("terrain={}", 2, "lacks `kind`"),
    ("terrain.size_m=[1e-9,1e-9]", 2, "fewer than two cells"),
    ("terrain.size_m=6", 2, "a list of 2 numbers"),
    ("terrain.size_m=[\"6\",\"4\"]", 2, "size_m"),
    ("terrain.spacing_m=100", 2, "make the spacing smaller"),
    ("terrain.rms_m=1e6", 2, "outside ±511 m"),
    ("terrain.seed=-3", 2, "out of range"),
    ("soil.k_phi=9.0e5 Pa", 2, "the text \"9.0e5 Pa\""),
    ("soil.k_phi=9,0", 2, "the text \"9,0\""),
    ("soil.k_phi=1e300", 2, "out of range"),
    ("soil.phi_rad=1.5707963", 2, "angles are in radians"),
    ("soil.K_m=0", 2, "K_m"),
    ("soil.parameters=../../etc/passwd", 2, "there is no soil"),
    ("soil.parameters=true", 2, "text in quotes"),
    ("soil.🦀=1", 2, "no key path"),
    ("soil={}", 2, "needs `module` or `fmu`"),
    ("soil=[]", 2, "unknown key `soil`"),
    ("robot.model=/dev/stdin", 2, "not a regular file"),
    ("robot.joints={LF_j1=1e5}", 2, "outside the limits"),
    ('robot.motor={"zz*"="velocity"}', 2, "no moving joint is called `zz*`"),
    ('robot.actuator={preset="x"}', 2, "mars-space-climber"),
    ("robot.strict=1", 2, "true or false"),
    ("recording.digits=2", 2, "from 3 to 17"),
    ("recording.include=[3]", 2, "a list of texts"),
    ("report.commanded_speed=gait.*", 2, "does not exist"),
    ("report.body=", 2, "subsystem.name"),
    ("gluing.contact_margin_m=-1", 2, "contact_margin_m"),
    ("gluing.energy_residual_j=0", 2, "energy_residual_j"),
    ("gait.step_multiple=1000001", 2, "step_multiple"),
    ("gait.load_timeout_s=0", 2, "load_timeout_s"),
    ("gait.step_timeout_s=1e-9", 2, "out of range"),
    ("gait.memory_mb=1", 2, "out of range"),
    ('glue=[{side_1="robot.body",side_2="world",components=["x","x"]}]', 2, "`x` is named twice"),
    ('glue=[{side_1="robot.body",side_2="robot.body"}]', 2, "two different subsystems"),
    ('glue=[{side_1="robot.body",side_2="world",components=["q"]}]', 2, "components are x, y, z"),
    ('glue=[{side_1="robot.body",side_2="world",normal=[0,0,0],kind="contact"}]', 2, "no length"),
    ('event=[{at_s=-1,act="robot.LF_j2.break"}]', 2, "out of range"),
    ('event=[{at_s=1,act=[]}]', 2, "does nothing"),
    ('event=[{when="1 < 2",act="robot.LF_j2.break"}]', 2, "subsystem.name"),
    ('event=[{at_s=1.0,set={"gait.speed"="fast"}}]', 2, "between -2 and 2"),
    ('fault=[{variable="robot.*.angle_target",kind="freeze",at_s=1.0}]', 2, "does not exist"),
]

BALL = ("<robot name='r'><link name='a'><inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial>"
        "<collision><geometry><sphere radius='0.1'/></geometry></collision></link>MORE</robot>")
SECOND_LINK = BALL[BALL.index("<link"): BALL.index("MORE")].replace("'a'", "'b'")
JOINT = ("<joint name='j' type='revolute'><parent link='a'/><child link='b'/><axis xyz='0 1 0'/>"
         "<limit lower='-1' upper='1' effort='1' velocity='1'/></joint>")
GEOM = "<mujoco><worldbody><body name='a'><freejoint/><geom type='{}' size='0.1' mass='1'/></body></worldbody></mujoco>"
# Ending, text, words.
THIRD_ROBOTS = [
    ("urdf", "<!DOCTYPE r [<!ENTITY a 'b'>]>" + BALL.replace("MORE", ""), "delete it"),
    ("xml", GEOM.format("banana"), "no type of a geom"),
    ("urdf", BALL.replace("MORE", "").replace("<sphere radius='0.1'/>", "<mesh filename='pipe'/>"), "a pipe (FIFO)"),
    ("urdf", BALL.replace("MORE", "<link name='a'/>"), "used twice"),
    ("urdf", BALL.replace("MORE", SECOND_LINK), "not connected"),
    ("urdf", BALL.replace("MORE", SECOND_LINK + JOINT + JOINT.replace("'j'", "'k'").replace("'a'", "'c'").replace("'b'", "'a'").replace("'c'", "'b'")), "form a loop"),
    ("urdf", BALL.replace("MORE", SECOND_LINK + JOINT.replace("0 1 0", "0 0 0")), "has no direction"),
    ("urdf", BALL.replace("MORE", SECOND_LINK + JOINT.replace("0 1 0", "0 nan 0")), "not finite"),
    ("urdf", BALL.replace("MORE", SECOND_LINK + JOINT.replace("<axis", "<mimic joint='j'/><axis")), "not itself"),
    ("urdf", BALL.replace("MORE", "").replace("0.1", "-0.1"), "sizes are positive"),
    ("urdf", BALL.replace("MORE", "").replace("<mass value='1'", "<mass value='0'"), "mass 0 kg is not positive"),
    ("urdf", BALL.replace("MORE", "").replace("<sphere radius='0.1'/>", "<mesh filename='.'/>"), "a folder"),
    ("urdf", BALL.replace("MORE", "").replace("<sphere radius='0.1'/>", "<mesh filename='http://a.b/c.stl'/>"), "package://"),
    ("xml", "<mujoco><include file='robot3.13.xml'/></mujoco>", "included twice"),
]


# ---------------------------------------------------------------------------------------------------------------------
# A fourth look: complaints of modules and the terrain about a value point to the value.

CRATER = 'terrain={kind="crater",size_m=[6,4],spacing_m=0.02,diameter_m=1.0,depth_m='
FOURTH_SETS = [
    ("robot.joints={LF_j1=1e5}", "outside the limits"),
    ('robot.motor={"zz*"="velocity"}', "no moving joint is called `zz*`"),
    ('robot.actuator={preset="x"}', "mars-space-climber"),
    ("robot.position_m=[1.0]", "position_m"),
    ("robot.integrator=euler", "`generalized-alpha`"),
    ("robot.integrator=rk4", "`energy-momentum`"),
    ("robot.contact_solver=lcp", "valid:"),
    ("robot.step_multiple=2", "`robot` is glued to `soil`"),
    ("soil.step_multiple=5", "connected by signals only"),
    ("soil.slip_sinkage=ding", "slip_sinkage_n1"),
    ("soil.slip_sinkage_n1=0.5", "slip_sinkage"),
    ("soil.curvature_max_per_m=0.0", "curvature_max_per_m"),
    ("soil.module=gait", "modules of kind soil"),
    ("gait.parameters=LETE_sand", "it takes no number of them"),
    ("gait.links_m=[1,2]", "links_m"),
    ("gait.body_height_m=1.5", "out of reach"),
    ("terrain.rms_m=1e6", "outside ±511 m"),
    ("terrain.rms_m=1e5", "outside ±511 m"),
    ("terrain.wavelengths_m=[0.001,3.0]", "cannot be shown"),
    ("terrain.flat_radius_m=9.0", "flattens the whole ground"),
    ('terrain={kind="slope",size_m=[6,4],spacing_m=0.02,angle_rad=1.55}', "is a wall"),
    ('terrain={kind="flat",size_m=[6,4],spacing_m=0.02,height_m=1e6}', "outside ±511 m"),
    (CRATER + "0.1,rim_height_m=0.5}", "is no bowl"),
    (CRATER + "2.0,max_slope_rad=0.1}", "steeper than"),
    ("time.duration_s=1e9", "1.000e12 steps"),
    ("time.step_s=1e-300", "1e-300"),
    ("terrain.spacing_m=1e-300", "1e-300"),
    ("world.gravity_m_s2=[0,0,-1e300]", "out of range"),
    ("world.gravity_m_s2=[0,0,-1e8]", "from -10000 to 10000"),
    ("soil.density_kg_m3=1e300", "plausible is at most 1e6 kg/m^3"),
    (f"robot.object=[{{name='a',model='{ROOT}/models/hexapod.urdf',position_m=[0,0,1e300]}}]", "plausible is at most 1e6"),
    (f"robot.object=[{{name='a',model='{ROOT}/models/hexapod.urdf',heading_rad=1e300}}]", "a number of at most 1e15"),
    ("robot.joints.LF_j1=1e300", "`LF_j1` = "),
    ("robot.stiffness={\"*_j1\"=100.0,\"*_j2\"=-1.0}", "`*_j2` = -1"),
    ("connect.0.factor=1e300", "plausible is at most 1e15"),
]


def test_edits_of_a_fourth_look(place):
    attack_edits(place, [(text, 2, words) for text, words in FOURTH_SETS])
    lost = []
    for text, _ in FOURTH_SETS:
        told = terraglue("check", place / "walk.toml", "--set", text, timeout=LIMIT_S).stderr
        if "[--set:1:" not in told or re.search(r"\d{30}", told):
            lost.append(f"{text}: {told[:1000]}")
    assert not lost, "\n\n".join(lost)


def test_a_duration_of_the_command_line_is_the_place(place):
    faults = attack([("1e300", ["run", place / "walk.toml", "--duration", "1e300"], 2, "[--duration:1:", place)])
    assert not faults, "\n\n".join(faults)


def test_tables_of_other_forms(place):
    header = PLATE.strip()
    tables = {"semicolons": header.replace(",", ";") + "\n1;2;50\n", "tabulators": header.replace(",", "\t") + "\n1\t2\t50\n",
              "with a point": header + "\n1,5,2,5,50\n", "0 of 2 readings": header + "\n1,2,50\n2,-3,50\n"}
    rows = []
    for k, (words, text) in enumerate(tables.items()):
        (place / f"form{k}.csv").write_text(text)
        rows.append((words, ["fit-soil", place / f"form{k}.csv", "--law", "bekker"], 2, words, place))
    rows.append(("above the ground", ["fit-soil", place / "form0.csv", "--from-mm", "-1"], 2, "out of range", place))
    faults = attack(rows)
    assert not faults, "\n\n".join(faults)


def test_commands_of_a_fourth_look(place):
    soil = ["export", "soil-bekker", "-o", place / "fourth.fmu", "--set", "soil.parameters=LETE_sand", "--set"]
    robot = ["export", "rigid-body", "-o", place / "fourth.fmu", "--set", f"robot.model={ROOT}/models/hexapod.urdf", "--set"]
    rows = [("no module", ["modules", place / "text.txt"], 2, "is not a shared library", place),
            ("no archive", ["fmu", "run", place / "text.txt"], 2, "is no zip archive", place),
            ("no feet", [*soil, "foot.count=0"], 2, "[--set:1:", place),
            ("no shape", [*soil, "foot.shape=cube"], 2, "`capsule`", place),
            ("no integrator", [*robot, "robot.integrator=euler"], 2, "`generalized-alpha`", place),
            ("no solver", [*robot, "robot.contact_solver=x"], 2, "`lcp-4`", place),
            ("no joint", [*robot, "robot.joints={zz=1.0}"], 2, "[--set:1:", place)]
    faults = attack(rows)
    assert not faults, "\n\n".join(faults)
    assert not (place / "fourth.fmu").exists()


def test_options_of_fmus_that_are_wrong(place):
    unit, table = place / "options.fmu", place / "options.csv"
    made = terraglue("export", "soil-bekker", "-o", unit, "--set", "soil.parameters=LETE_sand")
    assert made.returncode == 0, made.stderr
    table.write_text("time,nothing\n0,1\n")
    (place / "letters.csv").write_text("time,\"foot.position[1,1]\"\n0,x\n")
    (place / "times.csv").write_text("time,\"foot.position[1,1]\"\n0,0\n0,0\n")
    (place / "late.csv").write_text("time,\"foot.position[1,1]\"\n0,0\n0.005,x\n")
    rows = [("later --stop", ["--stop", "0"]), ("above 0", ["--step", "nan"]), ("above 0", ["--step", "-1"]), ("above 0", ["--step", "0"]),
            ("later --stop", ["--stop", "inf"]), ("later --stop", ["--start-time", "nan"]), ("no variable `nothing`", ["--output", "nothing"]),
            ("no variable `nothing`", ["--start", "nothing=1"]), ("there is no `=`", ["--start", "nothing"]), ("foot.position", ["--start", "foot.position=x"]),
            ("no variable `nothing`", ["--input", table]), ("no number", ["--input", place / "letters.csv"]), ("does not grow", ["--input", place / "times.csv"]),
            ("no number", ["--input", place / "late.csv", "--step", "0.001", "--stop", "0.02"]), ("none.csv", ["--input", place / "none.csv"]),
            ("intermediate", ["--intermediate", place / "between.csv"]), ("/none/", ["--csv", place / "none" / "x.csv"]), ("--timeout", ["--timeout", "0"]),
            ("--tolerance", ["--tolerance", "-1"]), ("--memory-mb", ["--memory-mb", "x"]), ("--event-mode", ["--event-mode", "maybe"])]
    rows = [(words, ["fmu", "run", unit, *options, *apart], 2, words, place) for words, options in rows for apart in ([], ["--isolate"])]
    faults = attack(rows)
    assert not faults, "\n\n".join(faults)
    # a run that is refused before the first row leaves no table behind
    done = terraglue("fmu", "run", unit, "--output", "nothing", "--csv", place / "unmade.csv")
    assert done.returncode == 2 and not (place / "unmade.csv").exists()


def test_absurd_values(place):
    export = ["export", "soil-bekker", "-o", place / "absurd.fmu", "--set", "soil.parameters=LETE_sand"]
    feet = [("foot.radius_m=1e300", "`radius_m`", "100 m"), ("foot.radius_m=1e-300", "`radius_m`", "0.0001"), ("foot.half_length_m=1e9", "`half_length_m`", "100 m"),
            ("foot.half_extents_m=[1e300,1,1]", "`half_extents_m`", "100 m"), ("foot.half_extents_m=[0.1,0.0,0.1]", "`half_extents_m`", "100 m"),
            ("foot.duration_s=1e300", "`duration_s`", "1000 s"), ("foot.position_m=[0,0,1e300]", "`position_m`", "1e6 m"),
            ("terrain.height_m=-1e300", "`height_m`", "1e6 m")]
    rows = [(edit, [*export, "--set", edit], 2, words, place) for edit, *all_words in feet for words in (*all_words, edit.split("=")[1][-4:].strip("]"))]
    walk = ["terrain.height_m=1e300", "terrain.size_m=[1e300,1.0]", "robot.stiffness=1e300", "robot.damping=1e300", "robot.position_m=[0,1e300,0.5]",
            "robot.max_torque=1e300", "robot.heading_rad=1e300", "robot.joints={LF_j1=1e300}", "gait.stand_s=1e300", "gait.ramp_s=1e-300", "gait.ramp_s=1e300",
            "gait.acceleration_m_s2=1e300", "gait.hip_x_m=1e300", "gait.links_m=[1e300,0.1,0.1,0.1]", "gluing.contact_margin_m=1e300", "time.duration_s=1e300", "soil.K_m=1e300",
            "soil.K_m=1e-300"]
    for edit in walk:
        key = "LF_j1" if "{" in edit else edit.split("=")[0].split(".")[1]
        span = "at least" if "e-300" in edit else "at most"
        flat = ["--set", "terrain.kind=flat", "--set"] if key == "height_m" else ["--set"]
        rows += [(edit, ["check", place / "walk.toml", *flat, edit], 2, words, place) for words in (f"`{key}` = ", f"plausible is {span}")]
    faults = attack(rows)
    assert not faults, "\n\n".join(faults)
    assert not (place / "absurd.fmu").exists()


# Text of a robot, words.
ABSURD = [
    (BALL.replace("<mass value='1'", "<mass value='1e30'"), "weighs 1e30 kg"),
    (BALL.replace("<mass value='1'", "<mass value='1e-12'"), "weighs 1e-12 kg"),
    (BALL.replace("radius='0.1'", "radius='1e6'"), "a shape of 2.000e6 m"),
    (BALL.replace("radius='0.1'", "radius='1e-9'"), "a shape of 2.000e-9 m"),
    (BALL.replace("ixx='1' iyy='1' izz='1'", "ixx='1e9' iyy='1e9' izz='1e9'"), "the inertia of a body 5.477e4 m large"),
    (BALL.replace("<inertial>", "<inertial><origin xyz='1e5 0 0'/>"), "its centre of mass 1.000e5 m from its origin"),
    (GEOM.format("sphere").replace("mass='1'", "mass='1e30'"), "weighs 1e30 kg"),
    (GEOM.format("sphere").replace("size='0.1'", "size='1e6'"), "a shape of 2.000e6 m"),
]


@pytest.mark.parametrize("k", range(len(ABSURD)))
def test_absurd_robots_are_told_with_their_line(place, k):
    text, words = ABSURD[k]
    path = place / f"absurd{k}.{'xml' if 'mujoco' in text else 'urdf'}"
    path.write_text("\n\n" + text.replace("MORE", ""))
    said = terraglue("robot", path)
    assert said.returncode == 0, said.stderr
    assert f"{path.name}:3: " in said.stdout + said.stderr and words in said.stdout + said.stderr, said.stdout + said.stderr
    faults = attack([(words, ["robot", path, "--strict"], 2, "refused because of `strict`", place)])
    assert not faults, "\n\n".join(faults)


def test_what_bounces_leaves_one_print_and_costs_nothing(place):
    (place / "ball.urdf").write_text(BALL.replace("MORE", "").replace("='1' iyy='1' izz='1'", "='0.004' iyy='0.004' izz='0.004'"))
    path = place / "ball.toml"
    path.write_text(f"""[time]
duration_s = 1.5
[terrain]
kind = "flat"
size_m = [1, 1]
spacing_m = 0.01
[robot]
module = "rigid-body"
model = "ball.urdf"
position_m = [0, 0, 0.5]
place_on_ground = false
[soil]
module = "soil-bekker"
parameters_file = "{ROOT}/models/soils.csv"
parameters = "LETE_sand"
k_phi = 1e8
""")
    done = terraglue("run", path, "--out", place / "bounced", "--json")
    assert done.returncode == 0, done.stderr
    figures = json.loads(done.stdout)
    assert figures["print_depth"]["count"] == 1, figures["print_depth"]
    assert figures["cost_of_transport"] is None and figures["energy_j_per_m"] is None
    page = (place / "bounced" / "report.html").read_text()
    cards = page[page.index('<dl class="cards'): page.rindex("</dl>")]
    for name in ("Distance", "Largest tilt"):
        value = re.search(f"<dt>{name}</dt><dd><b>([^<]*)</b>", cards)
        assert value and value[1] == "0", (name, cards)


def test_edits_of_a_third_look(place):
    attack_edits(place, THIRD_SETS)


def test_robots_of_a_third_look(place):
    rows = []
    for k, (ending, text, words) in enumerate(THIRD_ROBOTS):
        path = place / f"robot3.{k}.{ending}"
        path.write_text(text)
        rows.append((text, ["robot", path], 2, words, place))
    faults = attack(rows)
    assert not faults, "\n\n".join(faults)


def test_commands_of_a_third_look(place):
    walk, unit, taken = place / "walk.toml", place / "small.fmu", place / "taken"
    taken.mkdir()
    made = terraglue("export", "soil-bekker", "-o", unit, "--set", "soil.parameters=LETE_sand")
    assert made.returncode == 0, made.stderr
    rows = [("no folder of modules", ["check", walk, "--module-path", place / "nowhere"], 2, "there is no folder", place),
            ("a file of modules", ["check", walk, "--module-path", walk], 2, "there is no folder", place),
            ("no folder of a package", ["robot", ROOT / "models/hexapod.urdf", "--package", "x=/no"], 2, "there is no folder `/no`", place),
            ("no package", ["robot", ROOT / "models/hexapod.urdf", "--package", "x"], 2, "write NAME=DIR", place),
            ("taken", ["new", "soil", "taken"], 2, "name another folder", place),
            ("taken by a robot", ["new", "scenario", "--robot", ROOT / "models/hexapod.urdf", "-o", taken], 2, "name another folder", place),
            ("nothing built", ["check-module", taken], 2, "build it first", place),
            ("long", ["new", "soil", "x" * 300], 2, "up to 64", place),
            ("no numbers", ["export", "soil-bekker", "-o", place / "none.fmu"], 2, "--set soil.parameters=LETE_sand", place),
            ("no time", ["fmu", "run", unit, "--stop", "0"], 2, "later --stop", place),
            ("no step", ["fmu", "run", unit, "--step", "nan"], 2, "above 0", place),
            ("too many steps", ["fmu", "run", unit, "--stop", "1e9", "--step", "1e-9"], 2, "a longer --step", place),
            ("resumed nothing", ["run", "--resume", place / "nowhere"], 2, "--checkpoint-every", place),
            ("two scenarios", ["run", walk, "--resume", taken], 2, "cannot be used", place)]
    faults = attack(rows)
    assert not faults, "\n\n".join(faults)


def test_a_recording_that_is_too_short_to_go_on(place):
    import signal
    import subprocess
    import time
    folder = place / "cut_short"
    process = subprocess.Popen([PROGRAM, "run", str(place / "walk.toml"), "--checkpoint-every", "0.05", "--quiet", "--out", str(folder)])
    while not (folder / "checkpoint.bin").exists():
        assert process.poll() is None
        time.sleep(0.02)
    process.send_signal(signal.SIGKILL)
    process.wait()
    (folder / "recording.mcap").write_bytes(b"x")
    faults = attack([("cut short", ["run", "--resume", folder, "--quiet"], 2, "shorter than it was", place)])
    assert not faults, "\n\n".join(faults)


def test_a_unit_for_which_there_is_no_room(place):
    with small_disk(place / "disk", "1m") as disk:
        done = terraglue("export", "soil-bekker", "-o", disk / "a.fmu", "--set", "soil.parameters=LETE_sand")
        for words in ("a.fmu: No space left", "it has ", "MiB are free there", "help: free some room"):
            assert words in done.stderr and done.returncode in (1, 2), done.stderr
        assert "ZipWriter" not in done.stderr and not list(disk.iterdir())


def test_a_unit_that_may_not_become_so_large(place):
    import shlex
    import subprocess
    unit = place / "limited" / "a.fmu"
    unit.parent.mkdir()
    command = shlex.join([PROGRAM, "export", "soil-bekker", "-o", str(unit), "--set", "soil.parameters=LETE_sand"])
    done = subprocess.run(["bash", "-c", f"ulimit -f 100; exec {command}"], capture_output=True, text=True, timeout=LIMIT_S)
    for words in ("File too large (os error 27)", "help: free some room"):
        assert words in done.stderr and done.returncode in (1, 2), done.stderr
    assert not list(unit.parent.iterdir())


def test_limits_of_a_process_that_there_is_not_are_told(place):
    told = terraglue("check", place / "walk.toml", "--set", "gait.step_timeout_s=5", "--set", "gait.memory_mb=512").stderr
    for key in ("step_timeout_s", "memory_mb"):
        assert f"`{key}` has no effect: `gait` has no process of its own" in told, told
    apart = terraglue("check", place / "walk.toml", "--set", "gait.step_timeout_s=5", "--set", "gait.isolate=true")
    assert apart.returncode == 0 and "no effect" not in apart.stderr, apart.stderr


def test_a_module_without_the_memory_to_be_loaded_is_still_a_library(place):
    sets = ["--set", "robot.isolate=true", "--set", "robot.memory_mb=16"]
    faults = attack([("16 MiB", ["run", place / "walk.toml", "--duration", "0.01", "--quiet", "--out", place / "narrow", *sets], 2, "`memory_mb`", place)])
    assert not faults, "\n\n".join(faults)


def test_what_is_buried_has_a_cure(place):
    arguments = ["run", place / "walk.toml", "--quiet", "--out", place / "weak", "--duration", "0.1", "--set", "soil.module=soil-bekker", "--set", "soil.k_phi=1528"]
    faults = attack([("weak", arguments, 1, "`terraglue soils` lists other soils", place)])
    assert not faults, "\n\n".join(faults)


def test_check_counts_one_event_as_one(place):
    told = terraglue("check", place / "walk.toml", "--set", 'event=[{at_s=1.0,act="robot.LF_j2.break"}]')
    assert "33 connections, 1 event, " in told.stdout, told.stdout + told.stderr


def test_gravity_is_told_as_it_stands(place):
    told = terraglue("check", place / "walk.toml", "--set", "world.gravity_m_s2=[0,0,-9.81]").stderr
    assert "the scenario has 9.81: " in told, told


def test_numbers_are_told_without_what_arithmetic_leaves(place):
    event = 'event=[{at_s=0.0,set={"robot.body.force_z"=0.30000000000000004}},{at_s=0.01,set={"robot.body.force_z"=-1.9979999999999998}},'
    event += '{at_s=0.02,set={"robot.body.force_z"=0.0}}]'
    done = terraglue("run", place / "walk.toml", "--duration", "0.03", "--out", place / "told", "--json", "--set", "time.settle_s=0", "--set", event)
    assert done.returncode == 0, done.stderr
    assert "(was 0.3)" in done.stdout and "(was -1.998)" in done.stdout, done.stdout
    many = terraglue("check", place / "walk.toml", "--set", "time.step_s=1e-12").stderr
    assert "in steps of 1e-12 s" in many, many


def test_an_event_at_the_start_sets_what_needs_the_start(place):
    """Later it is refused: a row above."""
    event = 'event=[{at_s=0.0,set={"robot.body.z"=0.5}}]'
    done = terraglue("check", place / "walk.toml", "--set", event)
    assert done.returncode == 0, done.stderr


def test_limits_of_a_unit_are_told_idle_only_where_it_has_no_process(place):
    folder = place / "units"
    folder.mkdir()
    build(folder, "many", [("y", "output", 0, "")], "r[0] = 1;")
    for isolate, told in (("false", True), ("true", False)):
        path = folder / f"{isolate}.toml"
        path.write_text(f'[time]\nduration_s = 0.1\nstep_s = 0.1\n[a]\nfmu = "many.fmu"\nisolate = {isolate}\nmemory_mb = 512\n')
        checked = terraglue("check", path)
        assert checked.returncode == 0, checked.stderr
        assert ("`memory_mb` has no effect: `a`" in checked.stderr) == told, checked.stderr
