"""The comparison as a user's script reads it, and the listings."""

import csv
import json
import re

import pytest
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
                        "--strategies", "cooperative,iterative,semi-implicit", "--soils", "soil-bekker",
                        "--steps", "1e-3,2e-3", "--reference", "iterative")
    assert process.returncode == 0, process.stderr
    rows = json.loads((tmp_path / "compare.json").read_text())["rows"]
    assert [(row["strategy"], row["step_s"]) for row in rows] == [
        ("cooperative", 1e-3), ("cooperative", 2e-3), ("iterative", 1e-3), ("iterative", 2e-3),
        ("semi-implicit", 1e-3), ("semi-implicit", 2e-3), ("iterative", 1.25e-4)]
    refused = [row for row in rows if row["strategy"] == "semi-implicit"]
    assert all("refused" in row["error"] and "these would work: cooperative, " in row["error"] for row in refused)
    # the reference is a run at an eighth of the smallest step
    assert 0.0 < rows[2]["reference_error_m"] < rows[3]["reference_error_m"]
    page = (tmp_path / "compare.html").read_text()
    assert "error-step" in page and "work-precision" in page


CUT_PENDULUM = """
[time]
step_s = 0.002
duration_s = 0.2
[gluing]
strategy = "iterative"
[recording]
every_steps = 1
[report]
body = "forearm.lower"
[robot]
CUT = "root"
[forearm]
CUT = "tip"
[[glue]]
side_1 = "robot.upper"
side_2 = "forearm.upper"
"""
PART = f"""module = "rigid-body"
model = "{ROOT}/tests/models/double_pendulum.urdf"
motor = "off"
integrator = "generalized-alpha"
joints = {{ shoulder = 1.5, elbow = 0.3 }}
joint_rates = {{ elbow = 0.5 }}
cut.elbow"""


@pytest.fixture
def pendulum(tmp_path):
    """A double pendulum of second order, cut and glued at the elbow."""
    path = tmp_path / "pendulum.toml"
    path.write_text(CUT_PENDULUM.replace("CUT", PART))
    return path


def test_a_second_order_integrator_shows_its_order(pendulum, tmp_path):
    process = terraglue("compare", pendulum, "--out", tmp_path / "out", "--quiet", "--strategies", "iterative",
                        "--steps", "2e-3,4e-3,8e-3", "--reference", "iterative")
    assert process.returncode == 0, process.stderr
    rows = json.loads((tmp_path / "out" / "compare.json").read_text())["rows"]
    assert [row["step_s"] for row in rows] == [2e-3, 4e-3, 8e-3, 2.5e-4]
    assert all(1.9 <= row["order"] <= 2.1 for row in rows[1:3]), [row["order"] for row in rows]
    finer = terraglue("compare", pendulum, "--out", tmp_path / "finer", "--quiet", "--strategies", "iterative",
                      "--steps", "4e-3,8e-3", "--reference", "iterative", "--reference-step", "1e-3")
    rows = json.loads((tmp_path / "finer" / "compare.json").read_text())["rows"]
    assert finer.returncode == 0 and rows[-1]["step_s"] == 1e-3


def test_a_reference_folder_must_be_of_the_same_run(tmp_path):
    made = terraglue("run", MOON_WALK, "--duration", "0.04", "--out", tmp_path / "truth", "--quiet",
                     "--set", "time.step_s=5e-4", "--set", "gluing.strategy=iterative")
    assert made.returncode == 0, made.stderr

    def compare(*more, duration="0.04"):
        return terraglue("compare", MOON_WALK, "--duration", duration, "--out", tmp_path / "out", "--quiet",
                         "--strategies", "cooperative", "--reference", tmp_path / "truth", *more)

    good = compare()
    assert good.returncode == 0, good.stderr
    row, = json.loads((tmp_path / "out" / "compare.json").read_text())["rows"]
    assert row["reference_error_m"] > 0.0
    for more, duration, words in (
        (["--soils", "soil-bekker"], "0.04", ["soil.module", "soil-bekker"]),
        (["--set", "world.gravity_m_s2=[0.0, 0.0, -9.81]"], "0.04", ["world.gravity_m_s2"]),
        (["--set", "robot.position_m=[0.0, 0.0, 0.5]"], "0.04", ["robot.position_m"]),
        ([], "0.08", ["ends at t = 0.04 s"]),
    ):
        refused = compare(*more, duration=duration)
        said = " ".join(refused.stderr.replace("│", " ").split())
        assert refused.returncode == 2 and "terraglue run" in said, said
        assert all(word in said for word in words), said
    assert "folder" in " ".join(terraglue("compare", "--help").stdout.split("--reference ")[1].split("--")[0].split())


def test_a_reference_that_cannot_run_is_an_error(pendulum, tmp_path):
    process = terraglue("compare", pendulum, "--out", tmp_path / "out", "--quiet", "--strategies", "iterative",
                        "--reference", "cooperative")
    assert process.returncode == 2
    assert "--reference: `cooperative`" in process.stderr and "iterative" in process.stderr
    assert not (tmp_path / "out").exists()


def test_rows_that_come_twice_run_once(pendulum, tmp_path):
    process = terraglue("compare", pendulum, "--out", tmp_path / "out", "--strategies", "iterative,iterative",
                        "--steps", "4e-3,0.004")
    assert process.returncode == 0, process.stderr
    assert len(json.loads((tmp_path / "out" / "compare.json").read_text())["rows"]) == 1
    assert "`iterative` more than once" in process.stderr and "`0.004` more than once" in process.stderr


def test_a_comparison_without_any_run_that_ends_fails(pendulum, tmp_path):
    process = terraglue("compare", pendulum, "--out", tmp_path / "out", "--quiet", "--strategies", "iterative",
                        "--set", "gluing.max_iterations=1", "--set", "gluing.tolerance=1e-15",
                        "--set", "gluing.max_halvings=0")
    assert process.returncode == 1, process.stderr
    row, = json.loads((tmp_path / "out" / "compare.json").read_text())["rows"]
    assert "did not converge" in row["error"] and "no run reached its end" in process.stderr


SMALL = ["--duration", "0.1", "--set", "time.settle_s=0.1", "--set", "terrain.size_m=[2.0,1.6]", "--set", "terrain.spacing_m=0.02"]


def test_any_key_can_be_varied_and_all_combinations_run(tmp_path):
    process = terraglue("compare", MOON_WALK, *SMALL, "--out", tmp_path,
                        "--vary", "soil.parameters=lunar_nominal_Apollo,LETE_sand,lunar_nominal_Apollo",
                        "--vary", "world.gravity_m_s2=[0.0,0.0,-1.62],[0.0, 0.0, -3.7]", "--reference", "cooperative")
    assert process.returncode == 0, process.stderr
    assert "`lunar_nominal_Apollo` more than once" in process.stderr
    rows = json.loads((tmp_path / "compare.json").read_text())["rows"]
    keys = ("soil.parameters", "world.gravity_m_s2")
    combinations = [(soil, g) for soil in ("lunar_nominal_Apollo", "LETE_sand") for g in ("[0.0,0.0,-1.62]", "[0.0, 0.0, -3.7]")]
    # the strategy of the scenario, each combination with a reference of its own
    assert [row["strategy"] for row in rows] == 8 * ["cooperative"]
    assert [tuple(row["varied"][key] for key in keys) for row in rows] == 2 * combinations
    assert [row["reference_error_m"] for row in rows] == 4 * [0.0] + 4 * [None]
    depths = [row["print_depth_m"] for row in rows[:4]]
    assert len(set(depths)) == 4 and all(0.0 < depth < 0.05 for depth in depths), depths
    assert len({row["folder"] for row in rows}) == 8
    for row in rows[:4]:
        text = (tmp_path / row["folder"] / "report.html").read_text()
        assert row["varied"]["soil.parameters"] in text
    with open(tmp_path / "compare.csv", newline="") as file:
        assert [tuple(row[key] for key in keys) for row in csv.DictReader(file)] == 2 * combinations
    table, _, legend = process.stdout.partition("* best")
    assert table.count("\n") >= 10 and all(len(line) <= 80 for line in table.splitlines()), table
    heads = [" ".join(words) for words in zip(*(line.strip("│ ").split("┆") for line in table.splitlines()[2:4]))]
    assert [" ".join(head.split()) for head in heads] == [
        "run", "distance", "median print", "energy drift", "CPU per step"], table
    assert "all runs: " in table and "LETE_sand" in table and "--details" in legend
    page = (tmp_path / "compare.html").read_text()
    assert page.count("data:image/png;base64,") == 8 and "Grounds side by side" in page


def test_warnings_are_told_once_with_their_runs(tmp_path):
    process = terraglue("compare", MOON_WALK, "--duration", "0.02", "--quiet", "--strategies", "cooperative,iterative",
                        "--soils", "soil-bekker", "--vary", "soil.k_phi=1528,9e5", cwd=tmp_path)
    assert process.returncode in (0, 1, 2), process.stderr
    doubted = [line for line in process.stderr.splitlines() if line.startswith("warning: ") and "k_phi" in line]
    assert len(doubted) == 1, process.stderr
    assert "--vary soil.k_phi=1528: " in doubted[0] and "(2 of 4 runs: cooperative" in doubted[0], doubted
    assert "--set:" not in process.stderr


def test_a_comparison_leaves_the_results_of_a_run_where_they_are(tmp_path):
    for command in (["run"], ["compare", "--strategies", "cooperative"], ["run"]):
        assert terraglue(*command, MOON_WALK, "--duration", "0.01", "--quiet", cwd=tmp_path).returncode == 0
    names = sorted(p.name for p in (tmp_path / "runs").iterdir())
    assert names == ["moon_walk", "moon_walk-compare", "moon_walk.1"]


def test_details_show_all_figures(tmp_path):
    process = terraglue("compare", MOON_WALK, *SMALL, "--out", tmp_path, "--strategies", "cooperative", "--details",
                        "--vary", "soil.parameters=lunar_nominal_Apollo,LETE_sand")
    assert process.returncode == 0, process.stderr
    assert "evaluations of bodies, mean" in process.stdout and "heat elsewhere" in process.stdout
    assert "CPU per" in process.stdout.partition("* best")[0]


@pytest.mark.parametrize("vary, words", [
    ("gluing.strategy=cooperative,iterative", ["--strategies cooperative,iterative"]),
    ("soil.module=soil-bekker", ["--soils soil-bekker"]),
    ("time.step_s=1e-3,2e-3", ["--steps 1e-3,2e-3"]),
    ("soil.parameters=LETE_sant", ["LETE_sant", "did you mean `LETE_sand`"]),
    ("gait.speed=1", ["speed_m_s"]),
    ("soil.parameters=a,,b", ["a value is empty"]),
    ("soil.parameters", ["KEY.PATH"]),
])
def test_what_cannot_be_varied_is_told_with_the_way_out(tmp_path, vary, words):
    process = terraglue("compare", MOON_WALK, *SMALL, "--out", tmp_path / "out", "--vary", vary)
    said = " ".join(process.stderr.replace("│", " ").split())
    assert process.returncode == 2 and all(word in said for word in words), said
    assert not (tmp_path / "out").exists()


def test_compare_refuses_unknown_names():
    for option, name in (("--strategies", "iterativ"), ("--soils", "soil-beker"), ("--soils", "soil-bekker,foo")):
        process = terraglue("compare", MOON_WALK, option, name)
        assert process.returncode == 2 and name.split(",")[-1] in process.stderr
    assert "soil-bekker, soil-cellular-automaton" in " ".join(process.stderr.split())


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


def test_listings_can_be_narrowed():
    some = terraglue("variables", MOON_WALK, "robot.*_j2.max_torque", "--json")
    assert some.returncode == 0, some.stderr
    found = json.loads(some.stdout)
    assert len(found["variables"]) == 6 and found["actions"] == []
    assert found["variables"][0].keys() >= {"name", "type", "unit", "role", "help"}
    plain = terraglue("variables", MOON_WALK, "lf_j2.MAX")
    assert "robot.LF_j2.max_torque" in plain.stdout and "│" not in plain.stdout and "RF_" not in plain.stdout
    none = terraglue("variables", MOON_WALK, "robot.LF_j2.max_torqe")
    assert none.returncode == 2 and "`robot.LF_j2.max_torque`" in none.stderr
    lunar = terraglue("soils", "lunar")
    assert "│" not in lunar.stdout
    assert lunar.returncode == 0 and "lunar_nominal_Apollo" in lunar.stdout and "LETE_sand" not in lunar.stdout
    # every column has its head: numbers stood below `source`
    head, row = lunar.stdout.splitlines()[:2]
    place = head.index("measured at, m/s²")
    assert row[place:].split()[0] == "1.62" and row[head.index("source"):].startswith("Lunar Sourcebook"), lunar.stdout
    (told,) = json.loads(terraglue("soils", "lunar_nominal_Apollo", "--json").stdout)
    assert (told["name"], told["measured_gravity_m_s2"], told["refused"]) == ("lunar_nominal_Apollo", 1.62, None)
    sands = json.loads(terraglue("soils", "SAND", "--json").stdout)
    assert len(sands) > 3 and all("sand" in row["name"].lower() and row["source"] for row in sands)
    wrong = terraglue("soils", "lunar_nominl_Apollo")
    assert wrong.returncode == 2 and "`lunar_nominal_Apollo`" in wrong.stderr


def test_modules_can_be_narrowed():
    soils = terraglue("modules", "soil")
    assert soils.returncode == 0, soils.stderr
    assert all(name in soils.stdout for name in SOILS) and "rigid-body" not in soils.stdout and "│" not in soils.stdout
    # one row to a line, so that other programs can pick a line
    head, *rows, _ = soils.stdout.splitlines()
    assert head.split()[:2] == ["module", "kind"]
    assert all(row.split()[:2] == [row.split()[0], "soil"] and ".so" in row for row in rows), rows
    starred = terraglue("modules", "*-bekker", "--json")
    names = {module["name"] for module in json.loads(starred.stdout)}
    assert "soil-bekker" in names and all(name.endswith("-bekker") for name in names)
    one = terraglue("modules", "soil-bekker")
    assert one.returncode == 0 and "elastic_stiffness_pa_m" in one.stdout
    for more in ([], ["--json"]):
        wrong = terraglue("modules", "soil-beker", *more)
        assert wrong.returncode == 2 and "did you mean `soil-bekker`" in " ".join(wrong.stderr.split())


def test_soils_are_listed_by_the_patterns_of_all_lists():
    everything = {row["name"] for row in json.loads(terraglue("soils", "--json").stdout)}
    for pattern, wanted in (("lunar*", lambda name: name.startswith("lunar")), ("*_sand*", lambda name: re.fullmatch(".+_sand.+", name)),
                            ("LETE_s*nd", lambda name: name == "LETE_sand"), ("lete", lambda name: "lete" in name.lower()),
                            ("LETE_sand", lambda name: name == "LETE_sand")):
        done = terraglue("soils", pattern, "--json")
        assert done.returncode == 0, (pattern, done.stderr)
        names = {row["name"] for row in json.loads(done.stdout)}
        assert names and names == {name for name in everything if wanted(name)}, pattern
        shown = terraglue("soils", pattern)
        assert shown.returncode == 0 and all(name in shown.stdout for name in names), shown.stderr
    for pattern in ("moon*", "*.*", "lunar_nominl*"):
        done = terraglue("soils", pattern)
        assert done.returncode == 2 and f"no soil matches `{pattern}`" in " ".join(done.stderr.split()), done.stderr


def test_the_page_begins_with_what_is_asked_first(tmp_path):
    process = terraglue("compare", MOON_WALK, *SMALL, "--out", tmp_path, "--quiet", "--strategies", "cooperative,iterative")
    assert process.returncode == 0, process.stderr
    page = (tmp_path / "compare.html").read_text()
    sections = re.findall(r'<section id="(\w[\w-]*)">', page)
    assert sections[0] == "figures" and sections[-1] == "all", sections
    first = page.split('<section id="figures">')[1].split("</section>")[0]
    assert re.findall(r"<th[^>]*>([^<]*)</th>", first) == ["run", "distance", "median print", "energy drift", "CPU per step"]
    assert first.count("report.html") == 2 and first.count("<tr>") == 3
    assert "<details><summary>" in page.split('<section id="all">')[1]


def test_one_run_that_fails_fails_the_comparison_and_tells_its_own_reason(tmp_path):
    done = terraglue("compare", MOON_WALK, "--vary", "robot.rotation_rate_rad_s=[0.0,0.0,0.0],[1e6,0.0,0.0]", "--duration", "0.02", "--strategies", "cooperative",
                     "--quiet", "--out", tmp_path / "out")
    assert done.returncode == 1, done.stderr
    good, failed = json.loads((tmp_path / "out/compare.json").read_text())["rows"]
    assert not good.get("error") and "no consistent state" in failed["error"], failed["error"]
    assert "MCAP" not in failed["error"]
    assert "error: 1 of 2 runs did not reach the end" in done.stderr and failed["error"] in done.stderr, done.stderr


# Refusals of one of two values of a key: at its own place, by the module, and where another table is read.
WRONG_VALUES = [
    (["soil.parameters=LETE_sand,LETE_sandd"], "LETE_sandd", "there is no soil `LETE_sandd`"),
    (["soil.n=-1,0.8"], "-1", "`n` = -1"),
    (["robot.max_torque=60,1e300"], "1e300", "`max_torque`"),
    (["robot.model=nowhere.urdf,../models/hexapod.urdf"], "nowhere.urdf", "nowhere.urdf"),
    (["robot.joints.LF_j1=0.0,99"], "99", "LF_j1 = 99 is outside the limits"),
    (["gait.speed_m_s=0.1,fast", "world.seed=1,2"], "fast", "`speed_m_s`"),
]


@pytest.mark.parametrize(("varied", "value", "words"), WRONG_VALUES)
def test_a_wrong_value_fails_the_comparison_and_the_rest_is_shown(tmp_path, varied, value, words):
    options = [word for keys in varied for word in ("--vary", keys)]
    for more in ([], ["--reference", "cooperative"]):
        out = tmp_path / f"out{len(more)}"
        done = terraglue("compare", MOON_WALK, *SMALL, *options, "--out", out, *more)
        told = " ".join(done.stderr.replace("│", " ").split())
        assert done.returncode == 2, done.stderr
        assert words in told and "error: " in told and f"{varied[0].split('=')[0]}={value}" in told, done.stderr
        rows = json.loads((out / "compare.json").read_text())["rows"]
        refused = [row for row in rows if (row["error"] or "").startswith("refused: ")]
        assert 2 * len(refused) == len(rows) and all(value in " ".join(row["varied"].values()) for row in refused), rows
        assert all(not row["error"] and row["distance_m"] is not None for row in rows if row not in refused), rows
        assert "did not run" in done.stdout and "distance" in done.stdout and value in done.stdout, done.stdout


def test_a_comparison_of_wrong_values_only_begins_no_run(tmp_path):
    done = terraglue("compare", MOON_WALK, "--vary", "soil.n=-1,-2", "--out", tmp_path / "out")
    assert done.returncode == 2 and "`n` = -1" in done.stderr and not (tmp_path / "out").exists(), done.stderr


def test_it_says_at_the_start_what_will_run(pendulum, tmp_path):
    arguments = ["compare", pendulum, "--out", tmp_path / "out", "--strategies", "cooperative,iterative", "--steps", "4e-3,8e-3"]
    done = terraglue(*arguments, "--reference", "iterative")
    assert done.returncode == 0, done.stderr
    steps = sum(json.loads(row.read_text())["steps"] for row in (tmp_path / "out").glob("*/summary.json"))
    said = re.search(r"note: 3 runs \(1 of them for reference\), (\d+) steps in all; 2 more cannot be glued so", done.stderr)
    # runs that are counted once more start their iteration from zero
    assert said and steps <= int(said[1]) <= 2 * steps, done.stderr
    assert "steps in all" not in terraglue(*arguments, "--quiet").stderr
