"""Added mass: a disc under a sudden load against its equation of motion, integrated here."""

import json
import math

import pytest
from conftest import terraglue

MASS, RADIUS, GRAVITY = 5.0, 0.05, 9.81
K_C, K_PHI, PHI, DENSITY = 1400.0, 820_000.0, 0.610865238198, 1500.0
URDF = f"""<robot name="disc"><link name="disc"><inertial><mass value="{MASS}"/>
<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><cylinder radius="{RADIUS}" length="0.04"/></geometry></collision></link></robot>"""
SCENARIO = """[time]
step_s = 0.00025
duration_s = 0.15
[world]
gravity_m_s2 = [0.0, 0.0, -9.81]
[terrain]
kind = "flat"
size_m = [0.6, 0.6]
spacing_m = 0.005
[gluing]
strategy = "STRATEGY"
[soil]
module = "soil-bekker"
parameters = "lunar_nominal_Apollo"
added_mass = SHARE
[robot]
module = "rigid-body"
model = "disc.urdf"
position_m = [0.0012, 0.0007, 0.02]
[report]
body = "robot.disc"
"""


def deepest(share):
    """(M + m(z)) z'' + m'(z) z'^2 + p(z) A = M g from rest at the surface."""
    height = RADIUS * math.tan(math.pi / 4 + PHI / 2)
    full = share * DENSITY * math.pi / 3 * RADIUS**2 * height
    area = math.pi * RADIUS**2
    z = v = 0.0
    h = 1e-6
    while v >= 0.0:
        rest = max(0.0, 1.0 - z / height)
        mass, slope = full * (1 - rest**3), 3 * full * rest**2 / height
        v += h * (MASS * GRAVITY - slope * v * v - (K_C / RADIUS + K_PHI) * z * area) / (MASS + mass)
        z += h * v
    return z


@pytest.mark.parametrize("strategy", ["cooperative", "iterative"])
def test_a_sudden_load_sinks_as_the_equation_of_motion_says(tmp_path, strategy):
    (tmp_path / "disc.urdf").write_text(URDF)
    found = {}
    for share in (0.0, 1.0, 5.0):
        path = tmp_path / "drop.toml"
        path.write_text(SCENARIO.replace("STRATEGY", strategy).replace("SHARE", str(share)))
        process = terraglue("run", path, "--json", "--out", tmp_path / f"out{share}")
        assert process.returncode == 0, process.stderr
        summary = json.loads(process.stdout)
        assert abs(summary["energy_balance_j"]) < 1e-3 * MASS * GRAVITY * deepest(share), summary["energy_balance_j"]
        found[share] = summary["max_sinkage_m"]
        assert found[share] == pytest.approx(deepest(share), rel=0.02), share
    # the soil that moves with the foot takes momentum: the overshoot falls
    assert found[0.0] > found[1.0] > found[5.0]
