"""An FMU in FMPy, from its start to its end, all outputs. It prints, line by line:

NONE reason              it is no FMU for co-simulation on this machine, and nothing was run
EXPERIMENT start stop step on|off        the last word: with event mode, where an FMU with clocks offers it
RESULT json              time, values of the outputs in the last row, names of those that were no finite number in any row
FAILED reason

Usage: third_party.py FMU MOST_STEPS
Descriptions are read without FMPy's own check and functions that are missing are not asked for: what FMPy makes of it at best.
"""

import json
import math
import os
import re
import sys
import zipfile
from xml.etree import ElementTree


def say(*words):
    # an FMU may have left its own line open
    print("\n" + " ".join(words), flush=True)


def experiment(path, most):
    """Default start, stop and step of the FMU, s, with at most so many steps, and whether events are handled; none where it is
    not of our kind."""
    with zipfile.ZipFile(path) as archive:
        names = [name.replace("\\", "/") for name in archive.namelist()]
        root = ElementTree.fromstring(archive.read("modelDescription.xml"))
    version = root.get("fmiVersion", "")
    co_simulation = root.find("CoSimulation")
    folder = {"2": "binaries/linux64/", "3": "binaries/x86_64-linux/"}.get(version[:1])
    if folder is None or co_simulation is None or not any(n.startswith(folder) and n.endswith(".so") for n in names):
        return None
    wanted = root.find("DefaultExperiment")
    wanted = {} if wanted is None else wanted.attrib
    start = float(wanted.get("startTime", 0))
    stop = float(wanted.get("stopTime", start + 1))
    if not start < stop < math.inf:
        stop = start + 1
    step = float(wanted.get("stepSize") or co_simulation.get("fixedInternalStepSize") or 0)
    if not 0 < step < math.inf:
        step = (stop - start) / 500
    steps = min(max(1, round((stop - start) / step)), most)
    clocks = root.find("ModelVariables/Clock") is not None and co_simulation.get("hasEventMode") in ("true", "1")
    return start, start + steps * step, step, "on" if clocks else "off"


def ticked_by_master(description):
    """Clocks that tick by themselves in a master's hand, which FMPy never does: it shows such an FMU standing still."""
    clocks = [v for v in description.modelVariables if v.type == "Clock" and v.causality == "input"]
    return [v.name for v in clocks if v.intervalVariability != "triggered"]


def run(path, start, stop, step, events):
    import fmpy
    from fmpy import simulation

    description = fmpy.read_model_description(path, validate=False)
    if ticked_by_master(description):
        raise NotImplementedError(f"no tick for {', '.join(ticked_by_master(description))}")
    outputs = [v for v in description.modelVariables if v.causality == "output" and v.type != "Clock"]
    found = {"time": None, "values": {}, "odd": []}
    stuck = [None, 0]

    class Recorder(simulation.Recorder):
        """Keeps the last row, with the texts and bytes that FMPy does not record."""

        def sample(self, time, force=False):
            found["time"] = repr(float(time))
            # FMPy repeats a discarded step for ever
            stuck[:] = [time, stuck[1] + 1 if time == stuck[0] else 0]
            if stuck[1] > 1000:
                raise RuntimeError(f"it does not go on from t = {time} s")
            for v in outputs:
                get = getattr(self.fmu, "get" + {"Enumeration": enumeration}.get(v.type, v.type))
                count = math.prod(v.shape or ())
                values = get(vr=[v.valueReference]) if version == "2" else get(vr=[v.valueReference], nValues=count)
                found["values"][v.name] = [text(v, value) for value in values]

    def text(v, value):
        if v.type in ("Real", "Float64", "Float32"):
            if not math.isfinite(value) and v.name not in found["odd"]:
                found["odd"].append(v.name)
            return repr(float(value))
        if v.type == "String":
            return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value or "")
        if v.type == "Binary":
            return bytes(value or b"").hex()
        return str(int(value))

    version = description.fmiVersion[:1]
    enumeration = "Integer" if version == "2" else "Int64"
    simulation.Recorder = Recorder
    Recorder.result = lambda self: None
    fmpy.simulate_fmu(
        path,
        validate=False,
        fmi_type="CoSimulation",
        start_time=start,
        stop_time=stop,
        output_interval=step,
        output=[],
        use_event_mode=events == "on",
    )
    return found


def main():
    path, most = sys.argv[1], int(sys.argv[2])
    wanted = experiment(path, most)
    if wanted is None:
        say("NONE no FMU of FMI 2.0 or 3.0 for co-simulation with a library for this platform")
        return
    say("EXPERIMENT", *map(str, wanted))
    try:
        say("RESULT", json.dumps(run(path, *wanted)))
    except BaseException as error:
        say("FAILED", re.sub(r"\s+", " ", f"{type(error).__name__}: {error}")[:300])
    # an FMU that does not let go would hold the process
    os._exit(0)


main()
