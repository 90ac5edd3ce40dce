"""Wrong input ends with exit code 2 and a message with file, line, the offending text and the way out."""

import re

import pytest
from conftest import MOON_WALK, ROOT, terraglue


def refused(*arguments):
    process = terraglue(*arguments)
    assert process.returncode == 2, (process.returncode, process.stderr)
    assert "panicked" not in process.stderr
    return process.stderr


def test_missing_unreadable_and_empty_scenarios(tmp_path):
    assert "moon_walk.toml" in refused("run", ROOT / "scenarios" / "moon_wlk.toml")
    assert "cannot read the scenario" in refused("run", tmp_path)
    empty = tmp_path / "empty.toml"
    empty.write_text("")
    assert "is empty" in refused("run", empty)
    binary = tmp_path / "binary.toml"
    binary.write_bytes(b"\xff\xfe\x00")
    assert "cannot read the scenario" in refused("run", binary)


@pytest.mark.parametrize(
    "old, new, expected",
    [
        ("[gluing]", "[glueing]", ["unknown table `[glueing]`", "`gluing`"]),
        ("strategy = ", "stratgy = ", ["unknown key `stratgy`", "`strategy`"]),
        ('strategy = "cooperative"', 'strategy = "coop"', ["unknown strategy `coop`", "`cooperative`", "`iterative`"]),
        ('strategy = "cooperative"', "strategy = 3", ["`strategy` takes", "not 3"]),
        ("spacing_m = 0.01", "spacing_m = -0.01", ["-0.01 is out of range", "greater than 0 m"]),
        ("step_s = 0.001", "step_s = 0.0", ["0.0 is out of range"]),
        ('module = "soil-cellular-automaton"', 'module = "soil-celular-automaton"', ["`soil-cellular-automaton`"]),
        ("gait.*.angle_target", "gait.*.angle_targt", ["angle_targt"]),
        ("lunar_nominal_Apollo", "lunar_nominal_Apolo", ["there is no soil", "`lunar_nominal_Apollo`"]),
    ],
)
def test_mistakes_in_a_scenario(edited, old, new, expected):
    message = refused("check", edited(old, new))
    assert "walk.toml:" in message
    unwrapped = re.sub(r"\n\s+\| (?=\S)", " ", message)
    for text in expected:
        assert text in unwrapped, message


def test_events_and_connections_that_make_no_sense(edited):
    event = '[[event]]\nat_s = 1.0\nset = { "robot.LF_j2.max_torqe" = 0.0 }\n\n[gluing]'
    message = refused("check", edited("[gluing]", event))
    assert "robot.LF_j2.max_torque" in message and "walk.toml:" in message
    connect = '[[connect]]\nfrom = "robot.body.z"\nto = "robot.LF_j1.angle_target"\n\n[gluing]'
    message = refused("check", edited("[gluing]", connect))
    assert "rad" in message and "walk.toml:" in message


def test_edits_are_shown_as_they_were_written():
    message = refused("run", MOON_WALK, "--set", "soil.modle=soil-bekker")
    assert "--set" in message and "soil.modle=soil-bekker" in message
    assert refused("run", MOON_WALK, "--set", "gluing.strategy")


def hexapod_with(edited, tmp_path, element, instead):
    """The walk with a hexapod whose first such element is another one; the scenario and the line of the element."""
    text = (ROOT / "models" / "hexapod.urdf").read_text()
    start = text.index(element)
    end = text.index("/>", start)
    (tmp_path / "odd.urdf").write_text(text[:start] + instead + text[end:])
    return edited("../models/hexapod.urdf", "../odd.urdf"), text[:start].count("\n") + 1


def test_an_error_in_a_robot_file_shows_its_line(edited, tmp_path):
    scenario, line = hexapod_with(edited, tmp_path, "<mass ", '<mass value="-7"')
    message = refused("check", scenario)
    assert "mass -7 kg is not positive" in message
    place = re.search(r"-\[(.*):(\d+):\d+\]\n", message)
    assert place[1].endswith("odd.urdf") and int(place[2]) in (line - 1, line), message
    assert '<link name="body"' in message and "[robot]" not in message


def test_a_robot_with_zero_inertia_is_told_and_strict_refuses_it(edited, tmp_path):
    scenario, _ = hexapod_with(edited, tmp_path, "<inertia ", '<inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"')
    done = terraglue("check", scenario)
    assert done.returncode == 0, done.stderr
    assert "no inertia" in done.stderr and "odd.urdf:" in done.stderr and "filled evenly" in done.stderr
    for refusal in (refused("check", scenario, "--strict"), refused("run", scenario, "--strict")):
        assert "no inertia" in refusal and "strict" in refusal and "odd.urdf:" in refusal
    assert "strict" in refused("check", scenario, "--set", "robot.strict=true")


def test_a_truncated_elevation_file_is_refused(edited, tmp_path):
    grid = "ncols 4\nnrows 3\nxllcorner 0\nyllcorner 0\ncellsize 0.5\n0 0 0 0\n0 0\n"
    (tmp_path / "cut.asc").write_text(grid)
    path = edited("[gluing]", "[gluing]")
    lines = path.read_text().splitlines()
    begin = lines.index("[terrain]")
    end = next(i for i in range(begin + 1, len(lines)) if lines[i].startswith("["))
    lines[begin:end] = ["[terrain]", 'kind = "esri-ascii"', 'file = "../cut.asc"', ""]
    path.write_text("\n".join(lines))
    assert "cut.asc" in refused("check", path)


def test_wrong_usage():
    assert "Usage" in refused("run")
    assert refused("run", MOON_WALK, "--no-such-option")
    assert "recording.mcap" in refused("report", ROOT / "docs")


def test_values_in_other_units_are_warned_of_with_the_likely_slip(tmp_path):
    text = (ROOT / "scenarios" / "plate_sinkage.toml").read_text().replace("../models", str(ROOT / "models"))
    path = tmp_path / "units.toml"
    path.write_text(text.replace("[soil]\n", f'[soil]\nparameters_file = "{ROOT}/models/soils.csv"\nk_phi = 1528\n'))
    line = path.read_text().splitlines().index("k_phi = 1528") + 1
    process = terraglue("check", path, "--set", "soil.K_m=1.8", "--set", "soil.c_pa=1.04", "--set", "soil.density_kg_m3=1.6")
    assert process.returncode == 0, process.stderr
    told = process.stderr
    assert f"{path.name}:{line}: `k_phi` = 1528 N/m^(n+2) is 9.82 times below the usual" in told and "in kN (1530000 N/m^(n+2))?" in told
    assert "`K_m` = 1.8 m" in told and "in cm (0.018 m)?" in told
    assert "`c_pa` = 1.04 Pa" in told and "in kPa (1040 Pa)" in told and "in t/m³ or g/cm³ (1600 kg/m^3)?" in told
    assert told.count(" usual ") == 4, told
    coarse = terraglue("check", path, "--set", "terrain.spacing_m=10", "--set", "terrain.size_m=[600, 400]")
    assert "`spacing_m` = 10 m is 20 times above" in coarse.stderr and "in cm (0.1 m) or mm (0.01 m)?" in coarse.stderr, coarse.stderr
    degrees = terraglue("check", path, "--set", "soil.phi_rad=35")
    assert degrees.returncode == 2 and "35 degrees are 0.611 rad" in degrees.stderr, degrees.stderr


def test_values_of_a_row_and_of_a_soil_file_are_looked_at_too(tmp_path):
    text = (ROOT / "scenarios" / "plate_sinkage.toml").read_text().replace("../models", str(ROOT / "models"))
    (tmp_path / "soil.toml").write_text("[soil]\nn = 1.1\nk_c = 0.99\nk_phi = 1528.43\nc_pa = 1040\nphi_rad = 0.49\nK_m = 0.01\n")
    path = tmp_path / "file.toml"
    old = next(line for line in text.splitlines() if line.startswith("parameters ="))
    path.write_text(text.replace(old, 'parameters = "soil.toml"', 1))
    line = path.read_text().splitlines().index('parameters = "soil.toml"') + 1
    told = terraglue("check", path).stderr
    assert f"file.toml:{line}: `k_phi` = 1528.43" in told and "`k_c` = 0.99" in told and told.count("in kN (") == 2, told


@pytest.mark.parametrize("scenario", sorted(p.name for p in (ROOT / "scenarios").glob("*.toml")))
def test_no_value_of_a_shipped_scenario_is_doubted(scenario):
    told = terraglue("check", ROOT / "scenarios" / scenario).stderr
    assert " usual " not in told and "is softer than" not in told, told
