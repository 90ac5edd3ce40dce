"""The woods in whole runs: the modules keep the promises of the interface, the pose that is believed is right, the head is taken for a
tree until it is masked, and input that is wrong is refused with a way out."""

import csv
import math
import struct

import pytest
from conftest import PROGRAM, ROOT, terraglue

MODULES = ["forest", "laser_scanner", "tree_localisation", "gnss", "odometry", "driver"]


def rows(name, folder, *more):
    done = terraglue("run", ROOT / "scenarios" / f"{name}.toml", "--out", folder, "--csv", "--quiet", *more, timeout=600)
    assert done.returncode == 0, done.stderr
    with (folder / "variables.csv").open() as file:
        return [{k: v for k, v in row.items()} for row in csv.DictReader(file)]


def number(row, name):
    return float(row[name])


@pytest.mark.parametrize("module", MODULES)
def test_the_modules_keep_their_promises(module):
    library = PROGRAM.rsplit("/", 1)[0] + f"/lib{module}_plugin.so"
    checked = terraglue("check-module", library, "--level", "quick")
    assert checked.returncode == 0, checked.stdout + checked.stderr


def test_a_drive_finds_itself_and_tells_how_in_its_report(tmp_path):
    told = rows("forest_drive", tmp_path / "drive", "--duration", "16")
    last = told[-1]
    assert number(last, "locator.is_known") == 1 and number(last, "locator.scans") > 50
    believed = [number(r, "locator.error") for r in told if number(r, "locator.is_known") == 1]
    assert len(believed) > len(told) / 2 and max(believed) < 1.0, max(believed)
    gnss = ((number(last, "gnss.x") - number(last, "harvester.front.x")) ** 2
            + (number(last, "gnss.y") - number(last, "harvester.front.y")) ** 2) ** 0.5
    assert gnss > 5 and number(last, "driver.way") > 5
    page = (tmp_path / "drive" / "report.html").read_text()
    assert "Among the trees" in page and page.count('r="0.45"') > 100 and "Error among trees" in page


def test_the_head_is_a_tree_until_it_is_masked(tmp_path):
    told = rows("forest_head_in_view", tmp_path / "head", "--duration", "16", "--no-report")
    before = [number(r, "locator.own_stems") for r in told if 3 < number(r, "t_s") < 12]
    after = [number(r, "locator.own_stems") for r in told if number(r, "t_s") > 13]
    assert max(before) >= 1 and max(after) == 0
    assert max(number(r, "locator.hidden") for r in told if number(r, "t_s") > 13) > 0.05


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ("scanner1.mount=harvester.mast", ["mast"]),
        ("scanner1.mount=harvester.rear", ["harvester.rear", "harvester.front"]),
        ("locator.own_bodies=hands", ["hands", "own_bodies"]),
        ("locator.map=no_map.csv", ["no_map.csv"]),
        ("gnss.canopy_m=nan", ["canopy_m"]),
        ("odometry.radius_m=-1.0", ["radius_m"]),
        ("driver.way_points_m=[1.0,2.0]", ["way_points_m"]),
        ("woods.road_m=[1.0]", ["road_m"]),
    ],
)
def test_wrong_input_is_refused_with_its_name(setting, words, tmp_path):
    scenario = ROOT / "scenarios" / "forest_blind.toml"
    done = terraglue("run", scenario, "--duration", "1.0", "--out", tmp_path / "out", "--quiet", "--set", setting)
    assert done.returncode != 0 and "panicked" not in done.stderr
    assert all(word in done.stderr for word in words), done.stderr


STAND = """id,x,y,dbh_m,height_m,species,lean_x,lean_y
1,500006,7000000,0.3,22,pine,0,0
2,500000,7000006,0.25,20,pine,0.02,0
3,499993,7000003,0.4,25,pine,0,-0.03
4,499996,6999993,0.35,,pine,,
"""


def las_points(path):
    """Places, times and sources of the points of a LAS file."""
    data = path.read_bytes()
    count, first, size = struct.unpack_from("<I", data, 107)[0], struct.unpack_from("<I", data, 96)[0], struct.unpack_from("<H", data, 105)[0]
    rows = [(struct.unpack_from("<iii", data, at), struct.unpack_from("<H", data, at + 18)[0], struct.unpack_from("<d", data, at + 20)[0])
            for at in range(first, first + count * size, size)]
    return [([1e-4 * k for k in place], source, time) for place, source, time in rows]


def test_points_of_a_scanner_that_moves_lie_on_the_trees_of_a_table(tmp_path):
    (tmp_path / "stand.csv").write_text(STAND)
    text = f"""
[time]
step_s = 0.01
duration_s = 1.0
[world]
gravity_m_s2 = [0.0, 0.0, 0.0]
[woods]
module = "forest"
trees = "stand.csv"
trees_origin_m = [500000.0, 7000000.0]
bushes_per_hectare = 0.0
[robot]
module = "rigid-body"
model = "{ROOT}/models/rover.urdf"
position_m = [-1.0, 0.0, 1.0]
heading_rad = 0.4
velocity_m_s = [2.0, 0.5, 0.0]
"""
    text += "".join(f"""
[{name}]
module = "laser-scanner"
mount = "robot.body"
mount_offset = [{x}, 0.0, 0.3]
pattern = "line"
rate_hz = {rate}
sees_own_body = false
""" for name, x, rate in (("left", -0.2, 8.0), ("right", 0.2, 5.0)))
    (tmp_path / "s.toml").write_text(text)
    done = terraglue("run", "s.toml", "--out", "out", "--points", "scan.las", "--quiet", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    points = las_points(tmp_path / "scan.las")
    assert {source for _, source, _ in points} == {1, 2} and len(points) > 100
    assert max(t for _, _, t in points) > 0.8
    trees = [(6, 0, 0.3, 0, 0), (0, 6, 0.25, 0.02, 0), (-7, 3, 0.4, 0, -0.03), (-4, -7, 0.35, 0, 0)]
    seen = set()
    for (x, y, z), _, _ in points:
        own = min(range(4), key=lambda k: math.hypot(x - trees[k][0], y - trees[k][1]))
        tx, ty, dbh, ax, ay = trees[own]
        off = math.hypot(x - tx - z * ax, y - ty - z * ay) - dbh / 2
        # stems taper; robots of their own stand farther away than 1 m
        if math.hypot(x - tx, y - ty) < 1.0:
            assert abs(off) < 0.02, (x, y, z)
            seen.add(own)
    assert len(seen) >= 2
    # made from the recording again, the same bytes
    again = terraglue("report", "out", "--points", "again.las", cwd=tmp_path)
    assert again.returncode == 0 and (tmp_path / "again.las").read_bytes() == (tmp_path / "scan.las").read_bytes()
    packed = terraglue("report", "out", "--points", "again.laz", cwd=tmp_path)
    assert packed.returncode == 0 and (tmp_path / "again.laz").stat().st_size < 0.6 * (tmp_path / "scan.las").stat().st_size
    assert not list(tmp_path.glob("*.part.*"))


@pytest.mark.parametrize("change, told", [
    (("0.3,22", "0.3x,22"), 'line 2: `dbh_m` = "0.3x" is no number'),
    (("pine,0,0", "oak,0,0"), '`species` = "oak" is neither pine nor spruce'),
    (("2,500000,7000006", "2,500006,7000000"), "lines 2 and 3: two trees at the same place"),
    (("id,x,y", "id,east,north"), "names no column `x`"),
])
def test_a_table_of_trees_that_is_wrong_is_refused(tmp_path, change, told):
    (tmp_path / "stand.csv").write_text(STAND.replace(*change))
    (tmp_path / "s.toml").write_text('[time]\nduration_s = 0.01\n[woods]\nmodule = "forest"\ntrees = "stand.csv"\ntrees_origin_m = [500000, 7000000]\n')
    done = terraglue("run", "s.toml", "--out", "out", cwd=tmp_path)
    assert done.returncode == 2 and told in done.stderr and "stand.csv" in done.stderr, done.stderr


def test_points_need_a_scanner_and_a_name_of_las(tmp_path):
    (tmp_path / "s.toml").write_text(f'[time]\nduration_s = 0.01\n[robot]\nmodule = "rigid-body"\nmodel = "{ROOT}/models/rover.urdf"\n')
    for name, told in (("scan.xyz", "written as .las or .laz"), ("scan.laz", "has no points")):
        done = terraglue("run", "s.toml", "--out", "out", "--points", name, cwd=tmp_path)
        assert done.returncode == 2 and told in done.stderr
        assert not (tmp_path / name).exists()
