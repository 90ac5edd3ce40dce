"""The archive for users runs where nothing else is: an empty environment, another folder, no source next to it."""

import json
import os
import pathlib
import shutil
import subprocess
import tarfile

import pytest
from conftest import PROGRAM, ROOT

XTASK = pathlib.Path(PROGRAM).with_name("xtask")


@pytest.fixture(scope="module")
def unpacked(tmp_path_factory):
    if not XTASK.is_file():
        pytest.skip("xtask is not built beside the program")
    profile = XTASK.parent.name
    packed = subprocess.run([XTASK, "dist", "--built", profile], capture_output=True, text=True)
    assert packed.returncode == 0, packed.stderr
    folder = tmp_path_factory.mktemp("unpacked")
    with tarfile.open(packed.stdout.split()[-1]) as archive:
        archive.extractall(folder, filter="data")
    top, = folder.iterdir()
    return top


def bare(program, *arguments, cwd):
    command = ["env", "-i", program, *map(str, arguments)]
    return subprocess.run(command, cwd=cwd, capture_output=True, text=True, timeout=120)


def test_the_archive_holds_what_a_user_needs(unpacked):
    for path in ["README.md", "LICENSE-MIT", "docs/scenario.md", "docs/plugins/errors.md", "include/terraglue.h",
                 "lib/terraglue/libsoil_bekker_plugin.so", "share/terraglue/models/soils.csv"]:
        assert (unpacked / path).is_file(), path


@pytest.mark.parametrize("scenario", ["moon_walk", "plate_sinkage"])
def test_a_scenario_runs_in_an_empty_environment_from_another_folder(unpacked, tmp_path, scenario):
    path = unpacked / "share" / "terraglue" / "scenarios" / f"{scenario}.toml"
    done = bare(unpacked / "bin" / "terraglue", "run", path, "--duration", "0.05", "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["status"] == "done"
    assert (tmp_path / "runs" / scenario / "report.html").is_file()
    assert str(ROOT) not in done.stderr


def test_all_scenarios_find_their_modules(unpacked, tmp_path):
    scenarios = sorted((unpacked / "share/terraglue/scenarios").glob("*.toml"))
    assert len(scenarios) > 10
    refused = {path.name: done.stderr for path in scenarios if (done := bare(unpacked / "bin/terraglue", "check", path, cwd=tmp_path)).returncode}
    assert not refused


@pytest.fixture
def bare_root(unpacked, tmp_path):
    """A root folder that holds the archive as /opt and the C library, with /proc, /dev/null and an empty /tmp, like the emptiest container."""
    root = tmp_path / "root"
    files = [unpacked / "bin/terraglue", *(unpacked / "lib/terraglue").glob("*.so")]
    listed = subprocess.run(["ldd", *files], capture_output=True, text=True).stdout
    libraries = {word for word in listed.split() if word.startswith("/lib")}
    for library in libraries:
        place = root / library.lstrip("/")
        place.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(library, place)
    shutil.copytree(unpacked, root / "opt")
    for name in ("dev", "proc", "tmp", "results"):
        (root / name).mkdir()
    if os.geteuid() != 0 or subprocess.run(["mount", "-t", "proc", "proc", root / "proc"], capture_output=True).returncode:
        pytest.skip("needs the right to mount /proc and to change the root folder")
    (root / "dev/null").touch()
    try:
        yield root, {pathlib.Path(library).name for library in libraries}
    finally:
        subprocess.run(["umount", root / "proc"])


def test_the_archive_runs_in_a_root_folder_with_the_c_library_alone(bare_root):
    root, libraries = bare_root
    assert {name.split(".")[0] for name in libraries} <= {"libc", "libm", "libgcc_s", "ld-linux-x86-64", "ld-linux-aarch64"}

    def run(*arguments):
        program = [shutil.which("chroot") or "/usr/sbin/chroot", root, "/opt/bin/terraglue", *arguments]
        return subprocess.run(["env", "-i", *program], capture_output=True, text=True, timeout=120)

    isolated = ["--set", "soil.isolate=true", "--set", "gait.isolate=true"]
    walk = run("run", "/opt/share/terraglue/scenarios/moon_walk.toml", "--duration", "0.05", "--json", "--out", "/results/walk", *isolated)
    assert walk.returncode == 0, walk.stderr
    assert json.loads(walk.stdout)["status"] == "done"
    assert {"report.html", "recording.mcap", "summary.json"} <= {p.name for p in (root / "results/walk").iterdir()}
    checked = run("check-module", "/opt/lib/terraglue/libsensor_plugin.so", "--level", "quick")
    assert checked.returncode == 0, checked.stdout + checked.stderr


def test_modules_and_soils_are_those_of_the_archive(unpacked, tmp_path):
    program = unpacked / "bin" / "terraglue"
    modules = bare(program, "modules", "--json", cwd=tmp_path)
    paths = {m["name"]: m["path"] for m in json.loads(modules.stdout)}
    assert {"rigid-body", "gait", "soil-bekker", "soil-cellular-automaton"} <= set(paths)
    assert all(path.startswith(str(unpacked)) for path in paths.values()), paths
    assert "lunar_nominal_Apollo" in bare(program, "soils", cwd=tmp_path).stdout
    assert "terraglue 0." in bare(program, "--version", cwd=tmp_path).stdout


def test_a_program_without_its_modules_says_what_to_do(unpacked, tmp_path):
    (tmp_path / "terraglue").write_bytes((unpacked / "bin" / "terraglue").read_bytes())
    (tmp_path / "terraglue").chmod(0o755)
    scenario = unpacked / "share" / "terraglue" / "scenarios" / "plate_sinkage.toml"
    done = bare(tmp_path / "terraglue", "check", scenario, cwd=tmp_path)
    assert done.returncode == 2, done.stderr
    for word in ["cargo xtask install", "--module-path", "TERRAGLUE_MODULE_PATH"]:
        assert word in " ".join(done.stderr.split()), done.stderr
