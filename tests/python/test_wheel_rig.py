"""The wheel rig drives with the slip and the load that it is given, on both soils, and reports the wheel's state."""

import csv

import pytest
from conftest import ROOT, terraglue

SCENARIO = ROOT / "scenarios" / "wheel_rig.toml"
TOLD = ("slip", "sinkage", "area", "mean_pressure", "largest_pressure", "normal_force", "pull", "torque", "power")


def drive(folder, soil, slip, load):
    process = terraglue(
        "run", SCENARIO, "--duration", "2.6", "--out", folder, "--csv", "--quiet",
        "--set", f"soil.module={soil}",
        "--set", f"rig.velocity_target.travel={0.2 * (1 - slip)}",
        "--set", f"rig.torque_target.press={load - 9.81}",
    )
    assert process.returncode == 0, process.stderr
    assert "Wheels and feet" in (folder / "report.html").read_text()
    # the slip that the soil reports is smoothed over the length of the contact, 7 cm
    rows = [row for row in csv.DictReader((folder / "variables.csv").open()) if float(row["t_s"]) > 2.4]
    return {name: sum(float(row[f"soil.contact1.{name}"]) for row in rows) / len(rows) for name in TOLD}


@pytest.mark.parametrize("soil", ["soil-bekker", "soil-cellular-automaton"])
def test_slip_and_load(tmp_path, soil):
    gentle = drive(tmp_path / "gentle", soil, 0.1, 50.0)
    hard = drive(tmp_path / "hard", soil, 0.4, 64.7)
    for told, slip, load in ((gentle, 0.1, 50.0), (hard, 0.4, 64.7)):
        assert told["slip"] == pytest.approx(slip, abs=1e-3)
        assert told["normal_force"] == pytest.approx(load, rel=0.03)
        assert 0 < told["mean_pressure"] < told["largest_pressure"]
        # the wheel is 10.7 cm wide
        assert 0 < told["area"] < 0.107 * 0.184
        # the rim runs at 0.2 m/s
        assert told["power"] == pytest.approx(told["torque"] * 0.2 / 0.092, rel=1e-3)
    # the axle stays above the ground
    assert 0.005 < gentle["sinkage"] < hard["sinkage"] < 0.092
    assert gentle["pull"] < hard["pull"] and gentle["torque"] < hard["torque"]
