"""Runs the program as a user would: short scenarios into temporary folders."""

import json
import os
import pathlib
import shutil
import subprocess
import tempfile
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
