"""The comparison as a user's script reads it, and the listings."""

import csv
import json

from conftest import MOON_WALK, ROOT, terraglue

SOILS = ["soil-cellular-automaton", "soil-bekker"]
STRATEGIES = ["cooperative", "iterative"]


def test_compare_writes_a_row_per_combination(tmp_path):
    process = terraglue("compare", MOON_WALK, "--duration", "0.1", "--out", tmp_path, "--quiet",
                        "--strategies", ",".join(STRATEGIES), "--soils", ",".join(SOILS))
    assert process.returncode == 0, process.stderr
    comparison = json.loads((tmp_path / "compare.json").read_text())
    rows = comparison["rows"] if isinstance(comparison, dict) else comparison
    found = {(row["strategy"], row["soil"]) for row in rows}
    assert found == {(strategy, soil) for strategy in STRATEGIES for soil in SOILS}
    assert len(rows) == 4
    with open(tmp_path / "compare.csv", newline="") as file:
        assert len(list(csv.DictReader(file))) == 4
    assert (tmp_path / "compare.html").is_file()


def test_compare_runs_steps_against_a_reference(tmp_path):
    process = terraglue("compare", MOON_WALK, "--duration", "0.04", "--out", tmp_path, "--quiet",
                        "--strategies", "cooperative,iterative,xx-newton", "--soils", "soil-bekker",
                        "--steps", "1e-3,2e-3", "--reference", "iterative")
    assert process.returncode == 0, process.stderr
    rows = json.loads((tmp_path / "compare.json").read_text())["rows"]
    assert [(row["strategy"], row["step_s"]) for row in rows] == [
        ("cooperative", 1e-3), ("cooperative", 2e-3), ("iterative", 1e-3), ("iterative", 2e-3),
        ("xx-newton", 1e-3), ("xx-newton", 2e-3), ("iterative", 5e-4)]
    refused = [row for row in rows if row["strategy"] == "xx-newton"]
    assert all("refused" in row["error"] for row in refused)
    # the reference is a run at half the smallest step
    assert 0.0 < rows[2]["reference_error_m"] < rows[3]["reference_error_m"]
    page = (tmp_path / "compare.html").read_text()
    assert "error-step" in page and "work-precision" in page


def test_compare_refuses_unknown_names():
    for option, name in (("--strategies", "iterativ"), ("--soils", "soil-beker")):
        process = terraglue("compare", MOON_WALK, option, name)
        assert process.returncode == 2 and name in process.stderr


def test_listings():
    soils = terraglue("soils")
    assert soils.returncode == 0 and "lunar_nominal_Apollo" in soils.stdout
    modules = terraglue("modules", "--json")
    names = {module["name"] for module in json.loads(modules.stdout)}
    assert {"rigid-body", "gait", *SOILS} <= names
    variables = terraglue("variables", MOON_WALK)
    assert variables.returncode == 0, variables.stderr
    for name in ("robot.LF_j2.max_torque", "gait.LF_j2.angle_target", "robot.LF_j2.break"):
        assert name in variables.stdout
    check = terraglue("check", MOON_WALK)
    assert check.returncode == 0 and "is good" in check.stdout
    assert (ROOT / "docs" / "scenario.schema.json").is_file()
