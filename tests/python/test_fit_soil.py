"""A soil from plate tests: fitted, written, drawn, predicted on unseen tests, and run."""

import csv
import json
import subprocess

import pytest

from conftest import ROOT, terraglue
from test_plugins import made

PLATES = ROOT / "tests" / "reference" / "terramechanics" / "cmu_plate_pressure_sinkage_d60_d100.csv"


def test_fit_predict_and_use(tmp_path):
    rows = list(csv.DictReader(PLATES.open()))
    seen, unseen = tmp_path / "seen.csv", tmp_path / "unseen.csv"
    for path, box in ((seen, "f-d-large-box"), (unseen, None)):
        chosen = [r for r in rows if (r["box"] == "f-d-large-box") == (box is not None)]
        with path.open("w", newline="") as file:
            writer = csv.DictWriter(file, rows[0].keys())
            writer.writeheader()
            writer.writerows(chosen)
    out = tmp_path / "soil.toml"
    process = terraglue("fit-soil", seen, "--law", "bearing", "--soil", "CMU_Direct90_s0",
                        "--out", out, "--predict", unseen, "--json")
    assert process.returncode == 0, process.stderr
    found = json.loads(process.stdout)
    assert found["rms"] < 0.12 and found["predicted"]["rms"] < 0.2
    n = found["parameters"]["n"]
    assert n["low"] < n["value"] < n["high"] and 1.1 < n["value"] < 1.5
    assert found["intervals_from"] == {"basis": "curves", "groups": 6, "confidence": 0.95}
    drawing = (tmp_path / "soil.svg").read_text()
    assert drawing.count("<circle") > 250 and drawing.count("<polyline") == 2
    (tmp_path / "models").symlink_to(ROOT / "models")
    (tmp_path / "scenarios").mkdir()
    scenario = tmp_path / "scenarios" / "plate.toml"
    text = (ROOT / "scenarios" / "plate_sinkage.toml").read_text()
    old = next(line for line in text.splitlines() if line.startswith("parameters ="))
    scenario.write_text(text.replace(old, 'parameters = "../soil.toml"', 1))
    assert terraglue("check", scenario).returncode == 0, terraglue("check", scenario).stderr


def test_what_is_missing_is_said(tmp_path):
    process = terraglue("fit-soil", PLATES, "--law", "reece")
    assert process.returncode == 2 and "--cohesion-pa" in process.stderr
    bad = tmp_path / "bad.csv"
    bad.write_text("depth,load\n1,2\n")
    process = terraglue("fit-soil", bad, "--law", "bekker")
    assert process.returncode == 2 and "sinkage_mm" in process.stderr and "depth, load" in process.stderr


def test_one_soil():
    shown = terraglue("soils", "Toyoura_sand_Ishigami")
    assert shown.returncode == 0 and "ambiguous" in shown.stdout and "confidence" in shown.stdout
    assert "there is no soil `cheese`" in terraglue("soils", "cheese").stderr


@pytest.mark.parametrize("language", ["c", "python"])
def test_a_law_that_is_a_module_is_fitted_within_its_ranges(tmp_path, language):
    place, _ = made(tmp_path, "law", language)
    file = "my_law.py" if language == "python" else "libmy_law_plugin.so"
    if language == "c":
        subprocess.run(["make"], cwd=place, check=True, capture_output=True)
    out = tmp_path / "law.toml"
    arguments = ["fit-soil", PLATES, "--law", place / file, "--soil", "CMU_Direct90_s0", "--out", out]
    process = terraglue(*arguments, "--json")
    assert process.returncode == 0, process.stderr
    found = json.loads(process.stdout)
    bekker = json.loads(terraglue("fit-soil", PLATES, "--law", "bekker", "--json").stdout)
    # Bekker's law is this one where z_1 is large: it can fit no better.
    assert found["rms"] <= bekker["rms"] + 1e-4
    k_phi, cohesion = found["parameters"]["k_phi"], found["parameters"]["c_pa"]
    assert k_phi["low"] < k_phi["value"] < k_phi["high"] and cohesion["low"] is None
    assert (tmp_path / "law.svg").read_text().count("<polyline") == 2
    assert "plates do not tell it" in terraglue(*arguments).stdout
    scenario = place / "scenario.toml"
    text = scenario.read_text()
    old = text[text.index("[soil.law]"):text.index("[robot]")]
    scenario.write_text(text.replace(old, out.read_text() + "\n"))
    process = terraglue("run", scenario, "--quiet", "--duration", "0.05", "--out", tmp_path / "run")
    assert process.returncode == 0 and (tmp_path / "run" / "report.html").exists(), process.stderr
    process = terraglue("fit-soil", PLATES, "--law", "beker")
    assert process.returncode == 2 and "beker" in process.stderr


def test_rows_of_the_soil_table_reach_a_law_that_is_a_module_and_its_run_is_drawn(tmp_path):
    place, _ = made(tmp_path, "law", "c")
    subprocess.run(["make"], cwd=place, check=True, capture_output=True)
    shown = terraglue("soils", "lunar_nominal_Apollo").stdout
    assert 'in a scenario: parameters = "lunar_nominal_Apollo"' in shown
    sets = [word for name, value in (("soil.parameters", "lunar_nominal_Apollo"),
                                     ("soil.law.plugin", place / "libmy_law_plugin.so"),
                                     ("soil.law.parameters.z_1", "1e6")) for word in ("--set", f"{name}={value}")]
    deepest = {}
    for name, more in (("module", sets), ("built-in", sets[:2])):
        out = tmp_path / name
        process = terraglue("run", ROOT / "scenarios" / "plate_sinkage.toml", "--quiet", "--csv", "--out", out, *more)
        assert process.returncode == 0, process.stderr
        rows = list(csv.DictReader((out / "variables.csv").open()))
        deepest[name] = max(float(row["soil.max_sinkage"]) for row in rows)
        page = (out / "report.html").read_text()
        assert "<svg" in page and "soil" in page
    # With z_1 far below every foot the law is Bekker's, with the numbers of the row.
    assert deepest["module"] == pytest.approx(deepest["built-in"], rel=1e-5) and deepest["module"] > 1e-3


def written(folder, name, rows, header="sinkage_mm,pressure_kPa,b_mm"):
    path = folder / name
    path.write_text("\n".join([header, *rows]) + "\n")
    return path


def test_too_few_readings_give_no_interval(tmp_path):
    data = written(tmp_path, "few.csv", ["5,10,50", "10,20,50", "20,40,50", "40,80,50"])
    out = tmp_path / "soil.toml"
    process = terraglue("fit-soil", data, "--law", "bekker", "--out", out)
    assert process.returncode == 0, process.stderr
    assert "unknown" in process.stdout and "nan" not in process.stdout.lower()
    assert "95 %: unknown" in out.read_text() and "0.0 … 0.0" not in out.read_text()
    found = json.loads(terraglue("fit-soil", data, "--law", "bekker", "--json").stdout)
    assert found["parameters"]["n"]["low"] is None and found["parameters"]["n"]["value"] == pytest.approx(1.0)


@pytest.mark.parametrize("option", ["--density=nan", "--density=-3", "--cohesion-pa=-1000", "--phi-deg=95", "--shear-m=-1",
                                    "--from-mm=nan"])
def test_options_have_ranges(tmp_path, option):
    out = tmp_path / "soil.toml"
    process = terraglue("fit-soil", PLATES, "--law", "reece", "--density=1500", "--cohesion-pa=1000", option, "--out", out) \
        if option.split("=")[0] not in ("--density", "--cohesion-pa") else \
        terraglue("fit-soil", PLATES, "--law", "reece", option, "--out", out)
    assert process.returncode == 2 and f"`{option.split('=')[0]}`" in process.stderr, process.stderr
    assert "a number" in process.stderr and not out.exists()


def test_refused_rows_are_refused_and_the_table_is_found_from_elsewhere(tmp_path):
    for row in ("Toyoura_sand_Ishigami", "GRC-1_GRC-3_JSC-1A"):
        process = terraglue("fit-soil", PLATES, "--law", "bekker", "--soil", row)
        assert process.returncode == 2 and "cannot be used" in process.stderr, process.stderr
    process = terraglue("fit-soil", PLATES, "--law", "bearing", "--soil", "CMU_Direct90_s0", cwd=tmp_path)
    assert process.returncode == 0, process.stderr


def test_doubtful_units_and_seen_readings_are_said(tmp_path):
    rows = ["5,10,50", "10,20,50", "20,40,50"]
    data = written(tmp_path, "m.csv", rows, "sinkage_m,pressure_kPa,b_mm")
    told = terraglue("fit-soil", data, "--law", "bekker", "--density", "1.6").stderr
    assert "the largest of the column `sinkage_m` = 20 m is 20 times above" in told and "or mm (0.02 m)?" in told, told
    assert "`--density` = 1.6 kg/m^3" in told and "(1600 kg/m^3)?" in told, told
    process = terraglue("fit-soil", PLATES, "--law", "bekker", "--predict", PLATES)
    assert "the very readings of the fit" in process.stdout and "not seen before" not in process.stdout, process.stdout


WHEEL = ROOT / "tests" / "reference" / "terramechanics" / "cmu_smooth_beta0_mean.csv"


def slips(path, chosen):
    rows = list(csv.DictReader(WHEEL.open()))
    with path.open("w", newline="") as file:
        writer = csv.DictWriter(file, rows[0].keys())
        writer.writeheader()
        writer.writerows(r for r in rows if round(float(r["slip"]), 1) in chosen)
    return path


def test_a_real_wheel_is_fitted_and_predicted(tmp_path):
    seen, unseen = slips(tmp_path / "seen.csv", [-0.5, 0.0, 0.5, 0.9]), slips(tmp_path / "unseen.csv", [0.2, 0.8])
    out = tmp_path / "soil.toml"
    command = ["fit-soil", seen, "--wheel", "radius=0.058,width=0.05", "--soil", "CMU_Direct90_s0", "--predict", unseen]
    process = terraglue(*command, "--out", out, "--json")
    assert process.returncode == 0, process.stderr
    found = json.loads(process.stdout)
    assert [round(s["slip"], 2) for s in found["slips"]] == [0.0, 0.5, 0.9]
    assert len(found["predicted"]["slips"]) == 2 and found["predicted"]["file"] == "unseen.csv"
    for errors in (found["largest_error"], found["predicted"]["largest_error"]):
        assert errors["sinkage"] < 0.15 and errors["pull_N"] < 2.0, errors
    n = found["parameters"]["n"]
    assert n["low"] <= n["value"] <= n["high"] and 0.8 < n["value"] < 2.0
    drawing = (tmp_path / "soil.svg").read_text()
    assert drawing.count("<polyline") == 2 and drawing.count("<circle") == 10
    text = out.read_text()
    assert 'slip_sinkage = "ding"' in text and "interface_phi_rad = " in text and "95 %:" in text
    told = terraglue(*command).stdout
    assert "1 rows of a braked wheel left out" in told and told.count("not seen") == 2, told
    rig = (ROOT / "scenarios" / "wheel_rig.toml").read_text()
    old = next(line for line in rig.splitlines() if line.startswith("parameters ="))
    scenario = tmp_path / "rig.toml"
    scenario.write_text(rig.replace(old, 'parameters = "soil.toml"', 1).replace("../models", str(ROOT / "models")))
    checked = terraglue("check", scenario, "--set", "soil.module=soil-bekker")
    assert checked.returncode == 0 and " usual " not in checked.stderr, checked.stderr


def test_wrong_wheels_are_told(tmp_path):
    wrong = lambda *more: terraglue("fit-soil", WHEEL, *more)
    assert "radius and width" in wrong("--wheel", "radius=0.05").stderr
    process = wrong("--wheel", "radius=0.058,width=0.05", "--law", "reece")
    assert process.returncode == 2 and "Bekker's law" in process.stderr
    small = wrong("--wheel", "radius=58,width=50", "--soil", "cheese")
    assert small.returncode == 2 and "no soil is called" in small.stderr
    assert terraglue("fit-soil", PLATES, "--wheel", "radius=1,width=1").returncode == 2
