"""`cargo xtask`: the builds before each command. Cargo is replaced by a program that only prints its arguments, or fails."""

import os
import subprocess

import pytest

from conftest import ROOT
from documented import xtask


def asked(program, *arguments, cargo="/bin/echo"):
    environment = {**os.environ, "CARGO": cargo}
    return subprocess.run([program, *arguments], cwd=ROOT, env=environment, capture_output=True, text=True, timeout=300)


@pytest.mark.parametrize("options", [[], ["--no-timing"], ["--quick"]])
def test_a_wrong_part_is_told_before_anything_is_built(options):
    done = asked(xtask("validate"), "validate", "soil", "--part", "wrong", *options)
    assert done.returncode == 1 and done.stdout == "", done.stdout
    assert done.stderr.startswith("error: --part wrong: the parts are automaton, "), done.stderr


def test_what_measures_is_compiled_only_when_it_is_asked_for():
    for arguments in (["validate", "--help"], ["validate", "soil", "--part", "wrong"], ["faults"], ["pictures"]):
        done = asked(xtask(), *arguments, cargo="/bin/false")
        assert done.returncode == 1 and done.stderr.startswith("$ false build --workspace --bin terraglue-validation\n"), done.stderr
    assert "terraglue-validation" not in (ROOT / "xtask/Cargo.toml").read_text()


def test_what_cargo_xtask_starts_hands_on_all_but_installing(tmp_path):
    start = xtask().with_name("xtask-start")
    for arguments in (["--help"], ["validate", "soil", "--quick"], ["test"], []):
        done = asked(start, *arguments, cargo="/bin/false")
        assert done.returncode == 1 and done.stderr.startswith("$ false build --workspace --bin xtask\n"), done.stderr
    done = asked(start, "validate", "--help")
    assert done.returncode == 0 and "build --workspace --bin xtask" in done.stdout and "Usage: cargo xtask validate" in done.stdout
    done = asked(start, "install")
    assert done.returncode == 2 and "<PREFIX>" in done.stderr and done.stdout == ""
    # the release profile of the program is all that an install builds
    built = subprocess.run([start, "install", tmp_path / "x"], cwd=ROOT, capture_output=True, text=True,
                           env={**os.environ, "CARGO": "/bin/false"}, timeout=300)
    assert built.returncode == 1 and not (tmp_path / "x").exists()
    lines = [line for line in built.stderr.splitlines() if line.startswith("$")]
    assert lines == ["$ false build --release --package terraglue-cli --package terraglue-fmu-library"]
