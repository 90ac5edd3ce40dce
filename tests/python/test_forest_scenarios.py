"""The woods in whole runs: the modules keep the promises of the interface, the pose that is believed is right, the head is taken for a
tree until it is masked, and input that is wrong is refused with a way out."""

import csv

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
