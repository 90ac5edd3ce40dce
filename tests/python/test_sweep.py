"""Sweeps: the same table whatever ran the cases and was killed between, and plans that do not fit."""

import csv
import fcntl
import hashlib
import json
import os
import resource
import shutil
import signal
import subprocess
import time
from concurrent.futures import ThreadPoolExecutor

import pytest
from conftest import MOON_WALK, PROGRAM, ROOT, terraglue

# plates that touch the soil after half a second
PLAN = f"""
scenario = "{ROOT}/scenarios/plate_sinkage.toml"

[sweep]
seeds = 2
collect = ["max_sinkage_m", "energy_j"]

[sweep.vary]
"soil.parameters" = ["LETE_sand", "dry_sand_LLL_K010"]
"time.duration_s" = {{ from = 0.55, to = 0.7, count = 4 }}
"""


def listed(folder, text=PLAN, more=()):
    (folder / "plan.toml").write_text(text)
    return terraglue("sweep", "plan.toml", "-o", "sweep", *more, cwd=folder)


def swept(folder, *arguments):
    done = terraglue("sweep", "run", "sweep", *arguments, cwd=folder)
    assert done.returncode == 0, done.stderr
    return (folder / "sweep/sweep.csv").read_bytes()


def recordings(folder):
    """Hash of the recording of each case."""
    files = sorted((folder / "sweep/cases").glob("*/recording.mcap"))
    return [hashlib.sha256(file.read_bytes()).hexdigest() for file in files]


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    folder = tmp_path_factory.mktemp("whole")
    done = listed(folder)
    assert done.returncode == 0 and "16 cases" in done.stdout, done.stderr
    return folder, swept(folder, "-j", "1")


def test_the_table_has_values_ends_and_figures(whole):
    folder, table = whole
    rows = list(csv.DictReader(table.decode().splitlines()))
    assert [row["case"] for row in rows] == [str(k) for k in range(1, 17)]
    assert {row["status"] for row in rows} == {"done"}
    assert list(rows[0])[:8] == ["case", "soil.parameters", "time.duration_s", "world.seed", "status", "reason", "max_sinkage_m", "energy_j"]
    assert [row["time.duration_s"] for row in rows[:8:2]] == ["0.55", "0.6", "0.65", "0.7"]
    # the figures are those of the summary, and a longer press goes deeper
    summary = json.loads((folder / "sweep/cases/0008/summary.json").read_text())
    assert float(rows[7]["max_sinkage_m"]) == summary["max_sinkage_m"] and float(rows[7]["steps"]) == summary["steps"]
    depths = [float(row["max_sinkage_m"]) for row in rows[:8:2]]
    assert depths == sorted(depths) and depths[0] < depths[-1]
    assert "wall_s" not in rows[0]
    page = (folder / "sweep/sweep.html").read_text()
    assert "By soil.parameters" in page and "parallel coordinates" in page and "over time.duration_s" in page


def test_a_case_is_the_run_of_its_values(whole, tmp_path):
    folder, _ = whole
    sets = ["--set", "soil.parameters=dry_sand_LLL_K010", "--set", "time.duration_s=0.7", "--set", "world.seed=2"]
    done = terraglue("run", ROOT / "scenarios/plate_sinkage.toml", *sets, "--no-report", "--quiet", "--out", tmp_path / "one")
    assert done.returncode == 0, done.stderr
    one = hashlib.sha256((tmp_path / "one/recording.mcap").read_bytes()).hexdigest()
    assert one == recordings(folder)[15]


@pytest.mark.parametrize("how", ["two at a time", "commands", "slurm", "killed"])
def test_the_table_is_the_same_whoever_runs_it(whole, tmp_path, how):
    expected, bytes_before = whole[1], recordings(whole[0])
    if how == "commands":
        done = listed(tmp_path, more=["--commands"])
        lines = done.stdout.splitlines()
        assert len(lines) == 16
        with ThreadPoolExecutor(2) as pool:
            codes = list(pool.map(lambda line: subprocess.run(["sh", "-c", line]).returncode, lines))
        assert codes == [0] * 16
        assert terraglue("sweep", "collect", "sweep", cwd=tmp_path).returncode == 0
    elif how == "slurm":
        script = listed(tmp_path, more=["--slurm"]).stdout
        assert "#SBATCH --array=1-16\n" in script
        for task in range(1, 17):
            run = subprocess.run(["sh"], input=script, text=True, env={**os.environ, "SLURM_ARRAY_TASK_ID": str(task)})
            assert run.returncode == 0
        assert terraglue("sweep", "collect", "sweep", cwd=tmp_path).returncode == 0
    elif how == "killed":
        listed(tmp_path)
        process = subprocess.Popen([PROGRAM, "sweep", "run", "sweep", "-j", "2", "--quiet"], cwd=tmp_path)
        while len(list(tmp_path.glob("sweep/cases/*/case.json"))) < 3 and process.poll() is None:
            time.sleep(0.01)
        process.kill()
        process.wait()
        done = {path: path.stat().st_mtime_ns for path in tmp_path.glob("sweep/cases/*/case.json")}
        assert 3 <= len(done) < 16
        collected = terraglue("sweep", "collect", "sweep", "--json", cwd=tmp_path)
        assert json.loads(collected.stdout)["missing"] >= 16 - len(done) - 2
        swept(tmp_path)
        # finished cases are left as they were
        assert all(path.stat().st_mtime_ns == when for path, when in done.items())
    else:
        listed(tmp_path)
        swept(tmp_path, "-j", "2")
    assert (tmp_path / "sweep/sweep.csv").read_bytes() == expected
    assert recordings(tmp_path) == bytes_before


def test_a_model_that_is_not_there_is_found_before_anything_is_written(tmp_path):
    text = MOON_WALK.read_text().replace("../models", str(ROOT / "models"))
    models = f'["{ROOT}/models/hexapod.urdf", "nowhere.urdf"]'
    (tmp_path / "walk.toml").write_text(f'{text}\n[sweep.vary]\n"robot.model" = {models}\n')
    done = terraglue("sweep", "walk.toml", "-o", "sweep", cwd=tmp_path)
    assert done.returncode == 2 and "nowhere.urdf" in done.stderr, done.stderr
    assert not (tmp_path / "sweep").exists()


def test_values_that_do_not_fit_are_cases_that_say_so(tmp_path):
    # 20 values are more than are tried beforehand, and the last is no value
    values = ", ".join(f"{0.001 * k:.3f}" for k in range(10, 30)) + ", 0.0105"
    plan = f'scenario = "{ROOT}/scenarios/plate_sinkage.toml"\n[sweep.vary]\n"time.duration_s" = [{values}]\n'
    assert listed(tmp_path, plan).returncode == 0
    done = terraglue("sweep", "run", "sweep", cwd=tmp_path)
    assert done.returncode == 1 and "20 done, 1 refused" in done.stdout, done.stderr
    rows = list(csv.DictReader((tmp_path / "sweep/sweep.csv").open()))
    assert rows[20]["status"] == "refused" and "no multiple of `step_s`" in rows[20]["reason"]
    # nothing is run again unless requested
    before = (tmp_path / "sweep/cases/0021/case.json").stat().st_mtime_ns
    assert terraglue("sweep", "run", "sweep", cwd=tmp_path).returncode == 1
    assert (tmp_path / "sweep/cases/0021/case.json").stat().st_mtime_ns == before
    assert terraglue("sweep", "run", "sweep", "--again", cwd=tmp_path).returncode == 1
    assert (tmp_path / "sweep/cases/0021/case.json").stat().st_mtime_ns > before
    assert "Cases that did not reach their end" in (tmp_path / "sweep/sweep.html").read_text()


def test_several_processes_share_a_sweep(whole, tmp_path):
    listed(tmp_path)
    both = [subprocess.Popen([PROGRAM, "sweep", "run", "sweep", "-j", "2", "--quiet"], cwd=tmp_path, stdout=subprocess.DEVNULL) for _ in range(2)]
    # whoever is ready first waits for the last cases of the other
    assert [process.wait() for process in both] == [0, 0]
    assert (tmp_path / "sweep/sweep.csv").read_bytes() == whole[1] and recordings(tmp_path) == recordings(whole[0])
    assert not list(tmp_path.glob("sweep/cases/*.lock"))


def test_a_case_that_another_process_runs_is_waited_for(whole, tmp_path):
    listed(tmp_path)
    (tmp_path / "sweep/cases").mkdir(exist_ok=True)
    with open(tmp_path / "sweep/cases/0001.lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        task = terraglue("sweep", "run", "sweep", "--case", "1", cwd=tmp_path)
        assert task.returncode == 75 and "another process runs case 1" in task.stderr
        process = subprocess.Popen([PROGRAM, "sweep", "run", "sweep", "-j", "2", "--quiet"], cwd=tmp_path)
        while len(list(tmp_path.glob("sweep/cases/*/case.json"))) < 15:
            assert process.poll() is None
            time.sleep(0.01)
        assert process.poll() is None and not (tmp_path / "sweep/cases/0001/case.json").exists()
    # whoever had it has ended without a result
    assert process.wait(timeout=300) == 0
    assert (tmp_path / "sweep/sweep.csv").read_bytes() == whole[1]


def test_a_case_does_not_outlive_the_process_that_started_it(tmp_path):
    listed(tmp_path)
    gone = subprocess.Popen(["true"])
    gone.wait()
    task = terraglue("sweep", "run", "sweep", "--case", "1", "--with-parent", str(gone.pid), cwd=tmp_path)
    assert task.returncode == 130 and not list(tmp_path.glob("sweep/cases/*"))


def test_ctrl_c_leaves_what_is_done_and_no_process(tmp_path):
    plan = PLAN.replace("seeds = 2", "seeds = 40")
    listed(tmp_path, plan)
    process = subprocess.Popen([PROGRAM, "sweep", "run", "sweep", "-j", "2"], cwd=tmp_path, stderr=subprocess.PIPE, text=True, start_new_session=True)
    while not list(tmp_path.glob("sweep/cases/*/case.json")):
        time.sleep(0.01)
    os.killpg(process.pid, signal.SIGINT)
    _, said = process.communicate(timeout=300)
    assert process.returncode == 130 and "goes on from here" in said
    with pytest.raises(ProcessLookupError):
        os.killpg(process.pid, 0)
    statuses = {json.loads(path.read_text())["status"] for path in tmp_path.glob("sweep/cases/*/case.json")}
    assert statuses == {"done"}


@pytest.mark.parametrize(
    "edit, words",
    [
        (("soil.parameters", "soil.parametrs"), "parametrs"),
        (('"LETE_sand"', '"LETE_sandd"'), "LETE_sandd"),
        (("count = 4", "cuont = 4"), "cuont"),
        (("to = 0.7", "to = 0.5"), "no range"),
        (('collect = ["max_sinkage_m"', 'collect = ["max_sinkage"'), "max_sinkage_m"),
        (('collect = ["max_sinkage_m"', 'collect = ["bevameter.small_plate.hieght"'), "bevameter.small_plate."),
        (("seeds = 2", 'method = "sobel"'), "sobel"),
        (("plate_sinkage.toml", "plate_sinkag.toml"), "plate_sinkage.toml"),
        (("[sweep]", "[gluing]\n[sweep]"), "gluing"),
    ],
)
def test_wrong_plans_are_refused_before_anything_is_written(tmp_path, edit, words):
    assert edit[0] in PLAN
    done = listed(tmp_path, PLAN.replace(*edit, 1))
    assert done.returncode == 2 and words in done.stderr, done.stderr
    assert not (tmp_path / "sweep").exists()


def test_wrong_folders_and_numbers_are_refused(whole, tmp_path):
    folder, _ = whole
    cases = [
        (["sweep", "run", tmp_path], "no sweep"),
        (["sweep", "collect", tmp_path / "nowhere"], "no sweep"),
        (["sweep", "run", folder / "sweep", "--case", "17"], "no case 17"),
        (["sweep", folder / "plan.toml", "-o", folder / "sweep"], "not empty"),
        (["sweep", MOON_WALK, "-o", tmp_path / "new"], "no table `[sweep]`"),
    ]
    for arguments, words in cases:
        done = terraglue(*arguments)
        assert done.returncode == 2 and words in done.stderr, (arguments, done.stderr)


def test_ten_thousand_cases_are_listed_and_collected_in_little_memory(tmp_path):
    plan = f"""
scenario = "{ROOT}/scenarios/plate_sinkage.toml"
[sweep]
method = "sobol"
points = 10000
[sweep.vary]
"world.seed" = {{ from = 1, to = 9000 }}
"gluing.tolerance" = {{ from = 1e-12, to = 1e-6, log = true }}
"""
    assert listed(tmp_path, plan).returncode == 0
    rows = (tmp_path / "sweep/cases.tsv").read_text().splitlines()
    assert len(rows) == 10001 and rows[0].split("\t") == ["case", "world.seed", "gluing.tolerance"]
    figures = {f"energies.number_{k}": 0.1 * k for k in range(60)}
    text = json.dumps({"status": "done", "figures": figures})
    for k in range(1, 10001):
        place = tmp_path / f"sweep/cases/{k:05}"
        place.mkdir(parents=True)
        (place / "case.json").write_text(text)
    # the peak usage of a process counts the one that it was forked from; a limit does not
    limit = lambda: resource.setrlimit(resource.RLIMIT_DATA, (100 << 20, 100 << 20))
    done = subprocess.run([PROGRAM, "sweep", "collect", "sweep"], cwd=tmp_path, preexec_fn=limit, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    shutil.rmtree(tmp_path / "sweep")
