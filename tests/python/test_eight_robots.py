"""The eight defects of public robots, a minimal robot of our own for each, named after the one that has it: each loads with the
warning that is due, is refused where `--strict` asks for it, and comes to stand on lunar soil."""

import json
import re
import struct

import pytest
from conftest import ROOT, terraglue

SINGULAR = (1e-6,) * 6
ROUND = (0.02, 0, 0, 0.02, 0, 0.02)
# anymal_c's depth camera: moments 9e-6, 6.7e-4 and 1.4e-3 kg m²
CAMERA = (0.000637051, 0.000484569, 0.000424211, 0.000929402, 5.138e-06, 0.000484569)
PLATE = '<collision><geometry><box size="0.4 0.3 0.1"/></geometry></collision>'
FOOT = '<collision><geometry><sphere radius="0.03"/></geometry></collision>'
LIMIT = '<limit lower="-1" upper="1" effort="40" velocity="10"/>'


def link(name, mass, tensor, shape=""):
    names = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    inertia = " ".join(f'{n}="{x}"' for n, x in zip(names, tensor))
    return f'<link name="{name}"><inertial><mass value="{mass}"/><inertia {inertia}/></inertial>{shape}</link>\n'


def joint(kind, parent, child, more="", at="0 0 0"):
    return (f'<joint name="{child}_joint" type="{kind}"><origin xyz="{at}"/><parent link="{parent}"/><child link="{child}"/>'
            f'<axis xyz="0 1 0"/>{more}</joint>\n')


def leg(parent, more=LIMIT, tensor=ROUND):
    return link("leg", 1, tensor) + joint("revolute", parent, "leg", more, "0.2 0 0.1")


# Name: robot, moving bodies, mass in kg, words of each warning, in order.
ROBOTS = {
    # the base of 1e-6 kg carries the trunk and, itself, the legs
    "anymal_b": (link("base", 1e-6, SINGULAR) + link("base_inertia", 16, ROUND, PLATE) + joint("fixed", "base", "base_inertia")
                 + leg("base"),
                 2, 17.000001, [["link `base`", "not positive", "fixed to `base_inertia`"]]),
    # the base is fixed to the trunk, such feet to the shanks, and a sensor has a mass and no inertia
    "hyq": (link("base_link", 1e-6, SINGULAR) + link("trunk", 50, ROUND, PLATE) + joint("fixed", "base_link", "trunk") + leg("trunk")
            + link("foot", 1e-6, SINGULAR, FOOT) + joint("fixed", "leg", "foot", at="0 0 -0.1")
            + link("trunk_imu", 0.018, (0,) * 6) + joint("fixed", "trunk", "trunk_imu", at="0.1 0 0.2"),
            2, 51.018002, [["link `base_link`", "not positive", "fixed to `trunk`", "2 more like it: `trunk_imu`, `foot`"]]),
    # as hyq's, with links of neither mass nor inertia, which are none
    "go1": (link("base", 1e-6, SINGULAR) + link("trunk", 5, ROUND, PLATE) + joint("fixed", "base", "trunk") + leg("trunk")
            + link("camera", 0.01, ROUND) + joint("fixed", "trunk", "camera")
            + link("camera_optical", 0, (0,) * 6) + joint("fixed", "camera", "camera_optical"),
            3, 6.010001, [["link `base`", "not positive", "fixed to `trunk`"]]),
    "anymal_c": (link("base", 30, ROUND, PLATE) + leg("base") + link("depth_camera", 0.16043, CAMERA) + joint("fixed", "base", "depth_camera")
                 + link("optical_frame", 0, (0,) * 6) + joint("fixed", "depth_camera", "optical_frame")
                 + link("hatch", 0.142, (0.001,) * 6) + joint("fixed", "base", "hatch"),
                 2, 31.30243, [["link `depth_camera`", "sum of the other two", "fixed to `base`", "1 more like it: `hatch`"]]),
    "phantomx": (link("body", 1.4, ROUND, PLATE) + leg("body", tensor=(2e-6, 0, 0, 1e-5, 0, 2e-5)),
                 2, 2.4, [["link `leg`", "sum of the other two", "used instead", "6.000020e-6"]]),
    "laikago": (link("chassis", 13.715, (0,) * 6, PLATE) + leg("chassis", tensor=(0,) * 6),
                2, 14.715, [["link `chassis`", "no inertia", "filled evenly"], ["link `leg`", "no inertia", "a ball of 1 cm radius"]]),
    "minitaur": (link("chassis", 3, ROUND, PLATE) + leg("chassis", '<limit effort="100" velocity="100"/>'),
                 2, 4.0, [["joint `leg_joint`", "neither `lower` nor `upper`", "without limits"]]),
    "solo12": (link("base", 1.2, ROUND, '<collision><geometry><mesh filename="base.stl"/></geometry></collision>') + leg("base"),
               2, 2.2, []),
}


def stl_that_begins_with_solid():
    """A box as a binary file whose head begins with the word that starts files of text."""
    corners = [(x * 0.2, y * 0.15, z * 0.05) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [(a, b, c) for a, b, c, _ in faces] + [(a, c, d) for a, _, c, d in faces]
    body = b"".join(struct.pack("<12fH", 0, 0, 0, *(x for k in t for x in corners[k]), 0) for t in triangles)
    return f"{'solid base exported by a CAD program':<80}".encode() + struct.pack("<I", len(triangles)) + body


@pytest.fixture(params=ROBOTS)
def case(request, tmp_path):
    text, bodies, mass, warnings = ROBOTS[request.param]
    path = tmp_path / f"{request.param}.urdf"
    path.write_text(f'<robot name="{request.param}">\n{text}</robot>\n')
    (tmp_path / "base.stl").write_bytes(stl_that_begins_with_solid())
    return path, bodies, mass, warnings


def test_it_loads_with_the_warning_that_is_due(case):
    path, bodies, mass, expected = case
    shown = terraglue("robot", path, "--json")
    assert shown.returncode == 0, shown.stderr
    robot = json.loads(shown.stdout)
    assert len(robot["bodies"]) == bodies and robot["mass_kg"] == pytest.approx(mass, abs=1e-12)
    assert len(robot["warnings"]) == len(expected), robot["warnings"]
    lines = path.read_text().splitlines()
    for warning, words in zip(robot["warnings"], expected):
        assert all(word in warning for word in words), (words, warning)
        # the line is that of the element
        _, line, name = re.search(r"(\S+):(\d+): (?:link|joint) `(\w+)`", warning).groups()
        assert f'name="{name}"' in lines[int(line) - 1], warning
        assert path.name in warning


def test_strict_refuses_it_by_name(case):
    path, _, _, expected = case
    strict = terraglue("robot", path, "--strict")
    assert strict.returncode == (2 if expected else 0), strict.stderr
    assert not expected or path.name in strict.stderr and "strict" in strict.stderr


def test_it_stands_on_lunar_soil(case, tmp_path):
    path, _, mass, _ = case
    made = terraglue("new", "scenario", "--robot", path, "-o", tmp_path / "moon")
    assert made.returncode == 0, made.stderr
    run = terraglue("run", tmp_path / "moon" / "scenario.toml", "--duration", "0.2", "--out", tmp_path / "out", "--json")
    assert run.returncode == 0, run.stderr
    summary = json.loads(run.stdout)
    assert 0 < summary["max_sinkage_m"] < 0.03 and max(summary["max_roll_rad"], summary["max_pitch_rad"]) < 0.05, summary
    assert 0.9 < summary["peak_force_over_weight"] < 1.2, summary
    assert mass > 0


def test_files_that_are_broken_on_purpose_are_refused_by_name(tmp_path):
    trunk = link("trunk", 5, ROUND, PLATE)
    for name, text, words in [
        ("negative mass", trunk.replace('"5"', '"-5"'), ["mass -5 kg", "`trunk`"]),
        ("negative moment", trunk.replace('ixx="0.02"', 'ixx="-0.02"'), ["ixx = -0.02", "`trunk`"]),
        ("massless leg", trunk + link("leg", 0, (0,) * 6) + joint("revolute", "trunk", "leg", LIMIT), ["`leg`", "no mass"]),
        ("limits reversed", trunk + leg("trunk", LIMIT.replace("-1", "2")), ["`leg_joint`", "no room"]),
        ("no such mesh", trunk.replace('<box size="0.4 0.3 0.1"/>', '<mesh filename="gone.stl"/>'), ["gone.stl"]),
    ]:
        path = tmp_path / "broken.urdf"
        path.write_text(f'<robot name="r">\n{text}</robot>\n')
        done = terraglue("robot", path)
        assert done.returncode == 2 and "help:" in done.stderr, (name, done.stderr)
        assert all(word in done.stderr for word in ["broken.urdf", *words]), (name, done.stderr)
