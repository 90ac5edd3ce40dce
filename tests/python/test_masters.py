"""Exported FMUs in other masters, and FMUs of other makers in a loop with an exported soil here."""

import csv
import ctypes.util
import os
import subprocess
import sys
import sysconfig

import pytest

from conftest import terraglue
from fmus import export

SOIL = ["--set", "soil.parameters=LETE_sand", "--set", "terrain.size_m=[0.5,0.5]"]
# A sphere of 3 cm radius goes down to these heights of its centre, 1 ms apart.
HEIGHTS = [0.05, 0.03, 0.029, 0.027, 0.026]


@pytest.fixture(scope="session")
def soil(tmp_path_factory):
    return export("soil-bekker", tmp_path_factory.mktemp("soil") / "soil.fmu", "--fmi", "2", *SOIL)


@pytest.fixture(scope="session")
def wanted(soil):
    """Forces that FMPy gets."""
    from fmus import Fmu

    fmu = Fmu(soil)
    instance, forces = fmu.instance(foot__position=[0, 0, HEIGHTS[0]]), []
    for z in HEIGHTS:
        instance["foot.position"] = [0, 0, z]
        instance.step(1e-3)
        forces.append(instance["foot.force"][0, 2])
    instance.end()
    fmu.remove()
    assert forces[0] == 0.0 and forces[-1] > 50.0
    return forces


def run(code, *arguments, **environment):
    command = [sys.executable, "-c", code, *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, env={**os.environ, **environment})
    assert done.returncode == 0, done.stderr
    line = next(l for l in done.stdout.splitlines() if l.startswith("FORCES"))
    return [float(x) for x in line.split()[1:]]


COSIM = """
import sys
from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimSlave import CosimLocalSlave
from libcosimpy.CosimObserver import CosimObserver
from libcosimpy.CosimManipulator import CosimManipulator
e = CosimExecution.from_step_size(1_000_000)
i = e.add_local_slave(CosimLocalSlave(fmu_path=sys.argv[1], instance_name="soil"))
o, m = CosimObserver.create_last_value(), CosimManipulator.create_override()
e.add_observer(o), e.add_manipulator(m)
vr = {v.name.decode(): v.reference for v in e.slave_variables(i)}
place, force = [vr[f"foot.position[1,{k}]"] for k in (1, 2, 3)], [vr["foot.force[1,3]"]]
e.real_initial_value(i, place[2], float(sys.argv[2]))
out = []
for z in sys.argv[2:]:
    m.slave_real_values(i, place, [0.0, 0.0, float(z)])
    assert e.step()
    out += o.last_real_values(i, force)
print("FORCES", *out)
"""

ECOS = """
import sys
from ecospy import EcosSimulation, EcosSimulationStructure
s = EcosSimulationStructure()
s.add_model("soil", sys.argv[1])
s.add_parameter_set("start", {"soil::foot.position[1,1]": 0.0, "soil::foot.position[1,3]": float(sys.argv[2])})
out = []
with EcosSimulation(structure=s, step_size=1e-3) as e:
    e.init(parameter_set="start")
    for z in sys.argv[2:]:
        for k, x in zip((1, 2, 3), (0.0, 0.0, float(z))):
            e.set_real(f"soil::foot.position[1,{k}]", x)
        e.step()
        out.append(e.get_real("soil::foot.force[1,3]"))
    e.terminate()
print("FORCES", *out)
"""


def test_libcosim_runs_a_soil(soil, wanted):
    assert run(COSIM, soil, *HEIGHTS) == pytest.approx(wanted, rel=1e-12)


def test_ecos_runs_a_soil(soil, wanted):
    libraries = os.pathsep.join([os.path.join(sys.prefix, "lib"), os.environ.get("LD_LIBRARY_PATH", "")])
    assert run(ECOS, soil, *HEIGHTS, LD_LIBRARY_PATH=libraries) == pytest.approx(wanted, rel=1e-12)


# A mass that falls on the soil: 2 kg, symplectic Euler. The signals are late by a step or two, which drives elastic
# parts: their own damping must be larger.
MASS = """
from {package} import {names}
class Mass({base}):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        {clock}
        self.z, self.v, self.f = 0.031, 0.0, 0.0
        for name, causality in (("z", {causality}.output), ("v", {causality}.output), ("f", {causality}.input)):
            self.register_variable({real}(name, causality=causality))
    def do_step(self, t, h):
        self.v += h * (self.f / 2.0 - 9.81 - 300.0 * self.v)
        self.z += h * self.v
        return {ok}
"""
MAKERS = {
    "pythonfmu": {
        "package": "pythonfmu",
        "names": "Fmi2Slave, Fmi2Causality, Real",
        "base": "Fmi2Slave",
        "causality": "Fmi2Causality",
        "real": "Real",
        "ok": "True",
        "clock": "",
    },
    "pythonfmu3": {
        "package": "pythonfmu3",
        "names": "Fmi3Slave, Fmi3Causality, Fmi3Status, Fmi3StepResult, Float64, Fmi3Variability",
        "base": "Fmi3Slave",
        "causality": "Fmi3Causality",
        "real": "Float64",
        "ok": "Fmi3StepResult(status=Fmi3Status.ok)",
        "clock": "self.time = 0.0; self.register_variable(Float64('time', causality=Fmi3Causality.independent, "
        "variability=Fmi3Variability.continuous))",
    },
}


def library_of_python():
    name = sysconfig.get_config_var("INSTSONAME") or ""
    path = os.path.join(sysconfig.get_config_var("LIBDIR") or "", name)
    if name.endswith(".so.1.0") and os.path.exists(path):
        return path
    return ctypes.util.find_library(f"python{sys.version_info[0]}.{sys.version_info[1]}")


@pytest.mark.parametrize("maker", ["pythonfmu", "pythonfmu3"])
def test_a_mass_of_another_maker_comes_to_rest_on_the_soil(tmp_path, soil, maker):
    library = library_of_python()
    if library is None:
        pytest.skip("this Python has no shared library, which FMUs of pythonfmu need")
    (tmp_path / "mass.py").write_text(MASS.format(**MAKERS[maker]))
    subprocess.run([sys.executable, "-m", maker, "build", "-f", "mass.py"], cwd=tmp_path, check=True, capture_output=True)
    if maker == "pythonfmu3":
        soil = export("soil-bekker", tmp_path / "soil3.fmu", *SOIL)
    path = tmp_path / "loop.toml"
    path.write_text(f"""
[time]
step_s = 0.00025
duration_s = 0.5
[mass]
fmu = "Mass.fmu"
rollback = false
[soil]
fmu = "{soil}"
"foot.position[1,3]" = 0.031
[[connect]]
from = "mass.z"
to = "soil.foot.position[1,3]"
[[connect]]
from = "soil.foot.force[1,3]"
to = "mass.f"
""")
    os.environ["LD_PRELOAD"] = library
    try:
        done = terraglue("run", path, "--csv", "--quiet", "--out", tmp_path / "out")
    finally:
        del os.environ["LD_PRELOAD"]
    assert done.returncode == 0, done.stderr
    row = list(csv.DictReader((tmp_path / "out" / "variables.csv").open()))[-1]
    assert abs(float(row["mass.v"])) < 1e-3 and 0.02 < float(row["mass.z"]) < 0.03
    assert float(row["soil.foot.force[1,3]"]) == pytest.approx(2.0 * 9.81, rel=0.02)
