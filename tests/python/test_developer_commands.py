"""`cargo xtask`: what it builds before it does what it is asked for. Cargo is replaced by a program that only says its arguments."""

import os
import subprocess

import pytest

from conftest import ROOT
from documented import xtask


def asked(program, *arguments):
    environment = {**os.environ, "CARGO": "/bin/echo"}
    return subprocess.run([program, *arguments], cwd=ROOT, env=environment, capture_output=True, text=True, timeout=60)


@pytest.mark.parametrize("options", [[], ["--no-timing"], ["--quick"]])
def test_a_wrong_part_is_told_before_anything_is_built(options):
    done = asked(xtask(), "validate", "soil", "--part", "wrong", *options)
    assert done.returncode == 1 and done.stdout == "", done.stdout
    assert done.stderr.startswith("error: --part wrong: the parts are automaton, "), done.stderr
