"""Runs the program as a user would: short scenarios into temporary folders."""

import csv
import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import zipfile
from contextlib import contextmanager

import pytest

# A temporary folder of their own: tests look at files left behind, and not at those of other programs.
TEMPORARY = tempfile.mkdtemp(prefix="terraglue-tests-")
os.environ["TMPDIR"] = TEMPORARY
tempfile.tempdir = TEMPORARY

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROGRAM = os.environ.get("TERRAGLUE_BIN", str(ROOT / "target" / "debug" / "terraglue"))
# The commands that new folders suggest call the program by its name.
os.environ["PATH"] = os.pathsep.join([os.path.dirname(os.path.abspath(PROGRAM)), os.environ["PATH"]])
MOON_WALK = ROOT / "scenarios" / "moon_walk.toml"


def pytest_sessionfinish(exitstatus):
    if exitstatus == 0:
        shutil.rmtree(TEMPORARY, ignore_errors=True)


@contextmanager
def small_disk(folder, size):
    """A file system of its own of `size` ("4m"), mounted at the new folder; the test is skipped where none may be mounted."""
    folder.mkdir()
    mounted = shutil.which("mount") and subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size}", "none", folder], capture_output=True)
    if not mounted or mounted.returncode:
        pytest.skip("no file system may be mounted here")
    try:
        yield folder
    finally:
        subprocess.run(["umount", folder])


def terraglue(*arguments, cwd=ROOT, timeout=300):
    """The finished process; output as text."""
    command = [PROGRAM, *map(str, arguments)]
    return subprocess.run(command, cwd=cwd, capture_output=True, text=True, timeout=timeout)


def recorded(folder, text, *arguments):
    """A scenario of that text, run in the folder: (process, its rows as printed)."""
    (folder / "s.toml").write_text(text)
    done = terraglue("run", "s.toml", "--csv", "--quiet", "--no-report", "--out", "out", *arguments, cwd=folder, timeout=120)
    table = folder / "out/variables.csv"
    return done, list(csv.DictReader(table.open())) if done.returncode == 0 else []


@pytest.fixture(scope="session")
def short_run(tmp_path_factory):
    """Half a second of moon_walk: (folder, summary as printed, process)."""
    folder = tmp_path_factory.mktemp("run") / "out"
    process = terraglue("run", MOON_WALK, "--duration", "0.5", "--out", folder, "--json", "--csv")
    assert process.returncode == 0, process.stderr
    return folder, json.loads(process.stdout), process


@pytest.fixture
def edited(tmp_path):
    """Writes moon_walk with one replacement next to links to models; returns its path."""

    def edit(old, new):
        text = MOON_WALK.read_text()
        assert old in text
        (tmp_path / "models").exists() or (tmp_path / "models").symlink_to(ROOT / "models")
        (tmp_path / "scenarios").mkdir(exist_ok=True)
        path = tmp_path / "scenarios" / "walk.toml"
        path.write_text(text.replace(old, new, 1))
        return path

    return edit


# The Python package
PLATE = {
    "time": {"step_s": 0.001, "duration_s": 0.2},
    "terrain": {"kind": "flat", "size_m": [1.0, 0.6], "spacing_m": 0.01},
    "soil": {"module": "soil-bekker", "parameters": "LETE_sand"},
    "bevameter": {
        "module": "rigid-body", "model": str(ROOT / "models/bevameter.urdf"), "fixed_base": True,
        "motor": "velocity", "max_torque": 5000.0,
    },
}


def wheel(place):
    """The wheel as pip builds it, from the build of the tests."""
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "-q"]
    environment = {**os.environ, "TERRAGLUE_PROFILE": "debug"}
    done = subprocess.run([*pip, "wheel", "--no-deps", "-w", place, ROOT / "python"], env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-4000:]
    (made,) = place.glob("terraglue-*-abi3-*.whl")
    return made


@pytest.fixture(scope="session")
def site(tmp_path_factory):
    """The folder with the installed package. Building the wheel compiles for minutes, so it is put together from the build of the tests;
    with TERRAGLUE_TEST_WHEEL=1 it is unpacked from the wheel."""
    place = tmp_path_factory.mktemp("package")
    folder = place / "site"
    if os.environ.get("TERRAGLUE_TEST_WHEEL"):
        with zipfile.ZipFile(wheel(place)) as archive:
            archive.extractall(folder)
        return folder
    shutil.copytree(ROOT / "python/terraglue", folder / "terraglue", ignore=shutil.ignore_patterns("data", "*.so", "__pycache__"))
    built = pathlib.Path(PROGRAM).parent
    shutil.copy(built / "lib_terraglue.so", folder / "terraglue/_terraglue.abi3.so")
    lay_out = ["cargo", "run", "--quiet", "--package", "xtask-start", "--", "install", folder / "terraglue/data", "--built", built.name]
    done = subprocess.run(lay_out, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return folder


@pytest.fixture(scope="session")
def tg(site):
    """The package in this process; the modules of plugins have the same name and are loaded by other processes only."""
    sys.path.insert(0, str(site))
    try:
        import terraglue
    finally:
        sys.path.remove(str(site))
    terraglue.PROGRAM.chmod(0o755)
    return terraglue


def interrupted(site, code):
    """Exit code, output and errors of a program with the package, which says "ready" and is stopped by Ctrl-C soon after."""
    # a process in the background of a shell has it ignored
    heard = lambda: signal.signal(signal.SIGINT, signal.SIG_DFL)
    environment = {**os.environ, "PYTHONPATH": str(site)}
    process = subprocess.Popen([sys.executable, "-c", code], env=environment, preexec_fn=heard, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "ready\n"
    time.sleep(0.3)
    process.send_signal(signal.SIGINT)
    out, said = process.communicate(timeout=300)
    return process.returncode, out, said
