"""The rover climbs 10 degrees of dry sand with little slip, and digs itself in on 23 degrees."""

import csv
import math

import pytest
from conftest import ROOT, terraglue

SCENARIO = ROOT / "scenarios" / "rover_slope.toml"
STEEP = "world.gravity_m_s2=[-3.833,0.0,-9.030]"


def drive(folder, *sets):
    process = terraglue("run", SCENARIO, "--duration", "3", "--out", folder, "--csv", "--quiet", *sets)
    assert process.returncode == 0, process.stderr
    return list(csv.DictReader((folder / "variables.csv").open()))


def mean(rows, name):
    values = [float(row[name]) for row in rows if float(row["t_s"]) > 2.0]
    return sum(values) / len(values)


def test_slope(tmp_path):
    gentle = drive(tmp_path / "gentle")
    steep = drive(tmp_path / "steep", "--set", STEEP)
    way = {name: float(rows[-1]["rover.body.x"]) - float(rows[0]["rover.body.x"])
           for name, rows in (("gentle", gentle), ("steep", steep))}
    # two seconds at 0.15 m/s of rim speed
    assert way["gentle"] > 0.15 and way["steep"] < 0.5 * way["gentle"], way
    slip = [mean(steep, f"soil.contact{k}.slip") for k in range(1, 7)]
    # every wheel slips, and the rover loses more than a third of the way of its rims
    assert min(slip) > 0.25 and sum(slip) / len(slip) > 0.35, slip
    for rows, angle in ((gentle, 0.1745), (steep, 0.4015)):
        pull = sum(mean(rows, f"soil.contact{k}.pull") for k in range(1, 7))
        weight = 39.2 * 9.81
        assert pull == pytest.approx(weight * math.sin(angle), rel=0.1)
        load = sum(mean(rows, f"soil.contact{k}.normal_force") for k in range(1, 7))
        assert load == pytest.approx(weight * math.cos(angle), rel=0.05)
        largest = mean(rows, "soil.contact1.largest_pressure")
        assert 0 < mean(rows, "soil.contact1.mean_pressure") < largest < 1e6
        assert 0 < mean(rows, "soil.contact1.area") < 0.12 * 0.2
        assert mean(rows, "soil.contact1.torque") * 1.1 >= mean(rows, "soil.contact1.power") > 0
