"""Soils of the Earth on the Moon: a warning with the way out, and moduli that scale with gravity."""

import pytest

from conftest import ROOT, terraglue

WALK = ROOT / "scenarios/moon_walk.toml"


def check(*settings):
    process = terraglue("check", WALK, *(part for s in settings for part in ("--set", s)))
    assert process.returncode == 0, process.stderr
    return [line for line in process.stderr.splitlines() if "was measured under" in line]


def test_a_soil_of_the_earth_on_the_moon_is_warned_of_with_the_way_out():
    [warning] = check("soil.parameters=LETE_sand")
    assert all(part in warning for part in ("`k_phi`", "9.81 m/s²", "1.62", "gravity_scaling = true")), warning
    assert check("soil.parameters=LETE_sand", "soil.gravity_scaling=true") == []


@pytest.mark.parametrize("settings", [(), ("soil.parameters=LETE_sand", "world.gravity_m_s2=[0, 0, -9.81]")])
def test_a_soil_under_its_own_gravity_is_not(settings):
    assert check(*settings) == []
