"""Commands of the program, for tasks without a function of the package."""

import json
import subprocess

from .errors import Error, InputError
from .paths import PROGRAM


def run(*arguments, cwd=None):
    """Runs `terraglue ARGUMENTS…` and returns its output, parsed where it is JSON.

        terraglue.run("compare", scenario, "--strategies", "cooperative,iterative", "--json")
        terraglue.run("fit-soil", "plates.csv", "--law", "bekker", "--json")
        terraglue.run("export", "soil-bekker", "-o", "soil.fmu", "--set", "soil.parameters=LETE_sand")
    """
    done = subprocess.run([PROGRAM, *map(str, arguments)], cwd=cwd, capture_output=True, text=True)
    if done.returncode == 2:
        raise InputError(done.stderr.strip())
    if done.returncode != 0:
        raise Error(done.stderr.strip() or f"`terraglue {arguments[0]}` ended with {done.returncode}")
    try:
        return json.loads(done.stdout)
    except ValueError:
        return done.stdout
