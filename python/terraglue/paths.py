"""Where the wheel keeps the program, its scenarios and models."""

import os
import pathlib

DATA = pathlib.Path(__file__).resolve().parent / "data"
#: The program `terraglue`.
PROGRAM = DATA / "bin" / "terraglue"
#: Folder of the modules that come with the program.
MODULES = DATA / "lib" / "terraglue"
#: Folder of the scenarios that come with the program.
SCENARIOS = DATA / "share" / "terraglue" / "scenarios"
#: Folder of robots and soils that come with the program.
MODELS = DATA / "share" / "terraglue" / "models"

# the soil table of the package is found by scenarios that lie elsewhere
os.environ.setdefault("TERRAGLUE_SHARE", str(DATA / "share" / "terraglue"))


def scenario(name):
    """The file of a scenario: as it is given, or the one of that name which comes with the program."""
    given = pathlib.Path(name)
    own = SCENARIOS / f"{name}.toml"
    return own if not given.exists() and given.name == str(name) and own.is_file() else given
