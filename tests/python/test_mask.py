"""[soil.mask]: each plate of the bevameter meets the soil that the picture puts below it."""

import csv
import math
import re
import struct
import zlib

import pytest
from conftest import ROOT, terraglue

SCENARIO = ROOT / "scenarios" / "plate_sinkage.toml"
ROWS = """
[soil.mask]
file = "regions.png"
[soil.mask.rows]
1 = "LETE_sand"
7 = "lunar_nominal_Apollo"
"""


def png(path, rows):
    """An image of 8 bits of grey."""
    def chunk(kind, data):
        whole = kind + data
        return struct.pack(">I", len(data)) + whole + struct.pack(">I", zlib.crc32(whole))

    header = struct.pack(">IIBBBBB", len(rows[0]), len(rows), 8, 0, 0, 0, 0)
    data = zlib.compress(b"".join(b"\0" + bytes(row) for row in rows))
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", data) + chunk(b"IEND", b""))


def scenario(folder, rows, text=ROWS):
    """plate_sinkage on dry sand with a mask; the plates lie at x = -0.2 m and 0.2 m."""
    own = SCENARIO.read_text().replace("LETE_sand", "dry_sand_LLL_K010").replace("../models", str(ROOT / "models"))
    own = own.replace("[soil]\n", f'[soil]\nparameters_file = "{ROOT}/models/soils.csv"\n')
    png(folder / "regions.png", rows * 2)
    path = folder / "regions.toml"
    path.write_text(own + text)
    return path


def forces(folder, path, soil="soil-bekker"):
    """Travel below the touch and force of both plates at the end."""
    process = terraglue("run", path, "--duration", "1.5", "--out", folder, "--csv", "--quiet", "--set", f"soil.module={soil}")
    assert process.returncode == 0, process.stderr
    last = list(csv.DictReader((folder / "variables.csv").open()))[-1]
    return [(float(last[f"bevameter.{n}_press.angle"]) - 0.005, float(last[f"bevameter.{n}_plate.contact_normal"]))
            for n in ("small", "large")]


def bekker(z, b, n, k_c, k_phi):
    return (k_c / b + k_phi) * z**n * math.pi * b * b


@pytest.mark.parametrize("soil", ["soil-bekker", "soil-cellular-automaton"])
def test_each_plate_has_its_soil(tmp_path, soil):
    (z, small), (_, large) = forces(tmp_path / "out", scenario(tmp_path, [[1, 0, 7]]), soil)
    assert z == pytest.approx(0.01, rel=0.01)
    assert small == pytest.approx(bekker(z, 0.025, 0.79, 102e3, 5301e3), rel=0.02)
    assert large == pytest.approx(bekker(z, 0.05, 1.0, 1400, 820e3), rel=0.02)


def test_label_zero_and_the_outside_are_the_own_soil(tmp_path):
    path = scenario(tmp_path, [[0, 7]], ROWS.replace("[soil.mask.rows]", "pixel_m = 0.25\n[soil.mask.rows]"))
    (z, small), (_, large) = forces(tmp_path / "out", path)
    assert small == pytest.approx(bekker(z, 0.025, 1.1, 990, 1528430), rel=0.02)
    assert large == pytest.approx(bekker(z, 0.05, 1.0, 1400, 820e3), rel=0.02)


def test_wrong_masks_are_refused(tmp_path):
    for rows, text, said in (
        ([[1, 3]], ROWS, ["label 3 of regions.png", "column 2, row 2", "stands for no soil"]),
        ([[1, 7]], ROWS.replace("1 = ", "one = "), ["`one` is no label"]),
        ([[1, 7]], ROWS.replace("LETE_sand", "LETE_sant"), ["there is no soil `LETE_sant`", "did you mean `LETE_sand`"]),
        ([[1, 7]], ROWS.replace("regions.png", "regio.png"), ["regio.png"]),
    ):
        process = terraglue("run", scenario(tmp_path, rows, text), "--duration", "0.01", "--out", tmp_path / "out")
        assert process.returncode == 2, process.stdout
        assert all(part in process.stderr for part in said), process.stderr


def test_a_label_without_nodes_is_warned_of(tmp_path):
    process = terraglue("check", scenario(tmp_path, [[1, 0]]))
    assert process.returncode == 0, process.stderr
    assert "label 7 of regions.png" in process.stderr and "covers no node" in process.stderr
    assert "label 1 " not in process.stderr


def test_an_elastic_line_in_place_of_the_law_is_warned_of(tmp_path):
    path = scenario(tmp_path, [[1, 7]], ROWS.replace("LETE_sand", "heavy_clay_WES_25pct"))
    path.write_text(path.read_text().replace("[soil]\n", "[soil]\nelastic_stiffness_pa_m = 4e8\n"))
    process = terraglue("check", path)
    assert process.returncode == 0 and "`elastic_stiffness_pa_m` = 4e8" in process.stderr, process.stderr
    assert "of label 1 (heavy_clay_WES_25pct) down to 2.5" in process.stderr and process.stderr.count("takes the place") == 1
    path.write_text(path.read_text().replace("elastic_stiffness_pa_m = 4e8", "elastic_stiffness_pa_m = 1e10"))
    assert "takes the place" not in terraglue("check", path).stderr


@pytest.mark.parametrize("law", ["", '[soil.law]\npressure = "(k_c/b + k_phi)*z^n + 0*c*tanh(z/b)"\n'])
def test_a_law_stiffer_than_unloading_is_warned_of_with_the_way_out(tmp_path, law):
    path = scenario(tmp_path, [[1, 7]])
    path.write_text(path.read_text().replace("[soil]\n", "[soil]\nn = 1.5\nelastic_stiffness_pa_m = 4e5\n") + law)
    told = terraglue("check", path).stderr
    warning = next(line for line in told.splitlines() if "is softer than the law from" in line)
    line = path.read_text().splitlines().index("elastic_stiffness_pa_m = 4e5") + 1
    assert f"{path.name}:{line}: `elastic_stiffness_pa_m` = 4e5" in warning and "yield energy" in warning, warning
    enough = re.search(r"yield energy; (\S+) leaves the law as it is down to 300 mm", warning).group(1)
    path.write_text(path.read_text().replace("= 4e5", f"= {enough}"))
    assert "is softer than the law from" not in terraglue("check", path).stderr


def test_an_exported_fmu_carries_the_mask(tmp_path):
    path = scenario(tmp_path, [[1, 0, 7]])
    plain = forces(tmp_path / "plain", path)
    fmu = tmp_path / "unit.fmu"
    process = terraglue("export", path, "-o", fmu)
    assert process.returncode == 0, process.stderr
    (tmp_path / "regions.png").unlink()
    out = tmp_path / "unit.csv"
    process = terraglue("fmu", "run", fmu, "--stop", "1.5", "--step", "0.001", "--csv", out)
    assert process.returncode == 0, process.stderr
    last = list(csv.DictReader(out.open()))[-1]
    assert float(last["bevameter.small_plate.contact_normal"]) == pytest.approx(plain[0][1], rel=1e-6)
