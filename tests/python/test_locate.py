"""`terraglue locate`: the scan and the map of docs/forest.md, and input that is wrong."""

import json
import shutil

import pytest

from conftest import ROOT, terraglue

SCAN, MAP = (ROOT / "models/forest" / name for name in ("scan.laz", "map.csv"))


def located(*arguments):
    done = terraglue("locate", *map(str, arguments), "--json")
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.parametrize("prior", [(), ("--prior", "0,0,15", "--map-noise", "0.15")])
def test_the_scan_of_the_page_is_located(prior, tmp_path):
    told = located(SCAN, "--map", MAP, *prior, "--picture", tmp_path / "x.svg")
    pose = told["poses"][0]
    assert told["answer"] == "located" and told["reason"] is None and told["false_matches"] < 1e-3
    assert abs(pose["x"] - 4) < 0.15 and abs(pose["y"] + 7) < 0.15 and abs(pose["yaw"] - 0.6) < 0.02
    picture = (tmp_path / "x.svg").read_text()
    assert picture.startswith("<svg") and picture.count("<circle") > 20 and picture.count("<line") > 10


def test_a_prior_elsewhere_is_not_believed():
    assert located(SCAN, "--map", MAP, "--prior", "-30,30,5")["answer"] != "located"


@pytest.mark.parametrize("points, why", [("", "no points"), ("1 2 3\n" * 10, "too few points"), ("nan nan nan\n", "no point is left")])
def test_scans_without_trees_say_why(points, why, tmp_path):
    scan = tmp_path / "scan.xyz"
    scan.write_text(points)
    told = located(scan, "--map", MAP, "--scanner", "0,0,0")
    assert told["answer"] == "lost" and why in told["scans"][0]["nothing"] and "4 are needed" in told["reason"]


@pytest.mark.parametrize("name, content, why", [
    ("map.csv", "x,y\n1,2\nthree,4\n", "line 3: column `x`"),
    ("map.csv", "x,y\n1,nan\n", "line 2: column `y`"),
    ("map.csv", "a,b\n1,2\n", "names no column `x`"),
    ("map.csv", "x,y\n1,2\n1,2\n1,2\n", "1 trees are no map"),
    ("map.csv", "", "names no column"),
    ("scan.xyz", "x y z\n1 2 3\n1 2\n", "line 3"),
    ("scan.las", "no points", "scan.las"),
    ("scan.laz", "", "scan.laz"),
])
def test_files_that_are_wrong_are_refused_with_their_place(name, content, why, tmp_path):
    file = tmp_path / name
    file.write_text(content)
    scan, table = (SCAN, file) if name == "map.csv" else (file, MAP)
    done = terraglue("locate", scan, "--map", table)
    assert done.returncode == 2 and why in done.stderr and "panicked" not in done.stderr, done.stderr


def test_a_scan_that_was_cut_off_is_refused(tmp_path):
    cut = tmp_path / "cut.laz"
    shutil.copy(SCAN, cut)
    whole = cut.read_bytes()
    for share in (0.05, 0.3, 0.6, 0.95):
        cut.write_bytes(whole[: int(share * len(whole))])
        done = terraglue("locate", cut, "--map", MAP)
        assert done.returncode == 2 and "cut.laz" in done.stderr and "panicked" not in done.stderr, done.stderr


@pytest.mark.parametrize("arguments", [("--prior", "1,2"), ("--prior", "1,2,-3"), ("--scanner", "a,b,c"), ("--missing", "2"),
                                       ("--yaw", "1,2")])
def test_arguments_that_are_wrong_are_refused(arguments):
    assert terraglue("locate", SCAN, "--map", MAP, *arguments).returncode == 2
