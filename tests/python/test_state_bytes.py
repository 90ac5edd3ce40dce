"""States as bytes: an FMU goes on in another process as if nothing had happened, and refuses bytes that are no state of it."""

import pathlib
import subprocess
import sys

import pytest
from fmpy.fmi1 import FMICallException

from conftest import ROOT
from fmus import Fmu, export

H = 1e-3
SOIL = ["--set", "soil.parameters=LETE_sand", "--set", "terrain.size_m=[0.6,0.4]"]
FMUS = {
    "bekker": ("soil-bekker", "--fmi", "3", *SOIL),
    "automaton": ("soil-cellular-automaton", "--fmi", "2", *SOIL),
    "robot": ("rigid-body", "--fmi", "2", "--set", f"robot.model={ROOT}/models/hexapod.urdf"),
    "walk": (ROOT / "scenarios" / "moon_walk.toml", "--fmi", "3", "--scalars"),
}


@pytest.fixture(scope="session", params=FMUS)
def fmu(request, tmp_path_factory):
    target, *rest = FMUS[request.param]
    fmu = Fmu(export(target, tmp_path_factory.mktemp("bytes") / f"{request.param}.fmu", *rest))
    yield fmu
    fmu.remove()


def start(fmu, name, t=0.0):
    feet = {"foot.position": [0, 0, 0.05]} if any(n.startswith("foot.position") for n in fmu.variables) else {}
    return fmu.instance(name, start=t, **feet)


def replay(fmu, instance, steps):
    """All f64 outputs after each step, as bits in text. Feet go down and along."""
    names = [n for n, v in fmu.variables.items() if v.causality == "output" and v.type in ("Real", "Float64")]
    assert names
    lines = []
    for k in steps:
        if any(n.startswith("foot.position") for n in fmu.variables):
            instance["foot.position"] = [1e-4 * k, 0.0, 0.032 - 1.5e-4 * k]
        instance.step(H)
        lines.append(" ".join(float(x).hex() for name in names for x in instance[name].ravel()))
    return "\n".join(lines)


def to_bytes(fmu, instance):
    state, raw = instance.save(), instance.raw
    data = (raw.serializeFMUstate if fmu.two else raw.serializeFMUState)(state)
    instance.release(state)
    return bytes(data)


def take(fmu, instance, data):
    state = (instance.raw.deSerializeFMUstate if fmu.two else instance.raw.deserializeFMUState)(data)
    instance.restore(state)
    instance.release(state)


def go_on(path, file):
    """The work of the other process."""
    fmu = Fmu(path)
    instance = start(fmu, "other", t=40 * H)
    take(fmu, instance, pathlib.Path(file).read_bytes())
    print(replay(fmu, instance, range(40, 70)))
    instance.end()
    fmu.remove()


def test_a_state_goes_on_in_another_process(fmu, tmp_path):
    experiment = fmu.description.coSimulation
    assert experiment.canSerializeFMUstate and experiment.canGetAndSetFMUstate
    instance = start(fmu, "first")
    replay(fmu, instance, range(40))
    (tmp_path / "state").write_bytes(to_bytes(fmu, instance))
    wanted = replay(fmu, instance, range(40, 70))
    instance.end()
    code = "import sys; from test_state_bytes import go_on; go_on(*sys.argv[1:])"
    command = [sys.executable, "-c", code, fmu.path, tmp_path / "state"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, cwd=pathlib.Path(__file__).parent)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == wanted
    assert len(set(wanted.split("\n"))) > 20


def test_bytes_that_are_no_state_are_refused_and_change_nothing(fmu):
    one, two = start(fmu, "one"), start(fmu, "two")
    for instance in (one, two):
        replay(fmu, instance, range(40))
    data = to_bytes(fmu, one)
    other = bytearray(data)
    other[len(data) // 2] ^= 1
    for bad in (data[:-1], data[: len(data) // 2], bytes(other), data + b"\0", b"\0" * len(data)):
        with pytest.raises(FMICallException) as error:
            take(fmu, one, bad)
        assert error.value.status == 3
    assert replay(fmu, one, range(40, 60)) == replay(fmu, two, range(40, 60))
    one.end(), two.end()
