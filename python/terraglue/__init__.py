"""Robots on deformable soil: rigid bodies, soils and controllers, glued into one run.

    import terraglue

    testbed = terraglue.Testbed("moon_walk", set={"soil.module": "soil-bekker"})
    testbed.run_until(2.0)
    print(testbed["robot.body.z"], testbed.unit("robot.body.z"))
"""

from . import errors
from ._terraglue import Batch, Observation, Recording, Snapshot, Testbed, matching, version
from .commands import check_module, compare, export_fmu, fit_soil
from .errors import Error, InputError, ModuleError, SimulationError, UnknownName
from .frames import PointCloud
from .page import Page, serve
from .paths import MODELS, PROGRAM, SCENARIOS
from .program import run
from .soil import Soil
from .sweeps import Sweep, sweep

__version__ = version()
__all__ = [
    "Batch",
    "Error",
    "InputError",
    "MODELS",
    "ModuleError",
    "Observation",
    "PROGRAM",
    "Page",
    "PointCloud",
    "Recording",
    "SCENARIOS",
    "SimulationError",
    "Snapshot",
    "Soil",
    "Sweep",
    "Testbed",
    "UnknownName",
    "check_module",
    "compare",
    "errors",
    "export_fmu",
    "fit_soil",
    "matching",
    "run",
    "serve",
    "sweep",
    "version",
]
