"""Runs connected FMUs in another master; prints variables at the end, and the CPU time of the run in seconds.

Usage: masters_peers.py fmpy|ecos|omsimulator STEP END NAME=FILE.fmu ... FROM.OUTPUT->TO.INPUT ... NAME.VARIABLE ...
STEP and END are in seconds. All masters get the same FMUs, connections and step, and nothing is said about their order.
"""

import sys
import tempfile
import time
import zipfile
from pathlib import Path
from xml.sax.saxutils import quoteattr

peer, step, end, words = sys.argv[1], float(sys.argv[2]), float(sys.argv[3]), sys.argv[4:]
fmus = dict(word.split("=", 1) for word in words if "=" in word)
connections = [word.split("->") for word in words if "->" in word]
variables = [word for word in words if "=" not in word and "->" not in word]
STEPS = round(end / step)


def structure(path):
    """Writes the system as an archive of SSP 1.0: a connector for each variable that is connected or read."""
    kinds = dict.fromkeys([source for source, _ in connections] + variables, "output")
    kinds |= dict.fromkeys([target for _, target in connections], "input")
    text = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        '<ssd:SystemStructureDescription xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon"',
        ' xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription" version="1.0" name="case">',
        '<ssd:System name="all"><ssd:Elements>',
    ]
    for name in fmus:
        text.append(f'<ssd:Component type="application/x-fmu-sharedlibrary" name="{name}" source="resources/{name}.fmu">')
        text.append("<ssd:Connectors>")
        own = [(full.split(".")[1], kind) for full, kind in kinds.items() if full.startswith(f"{name}.")]
        text += [f"<ssd:Connector name={quoteattr(v)} kind={quoteattr(k)}><ssc:Real/></ssd:Connector>" for v, k in own]
        text.append("</ssd:Connectors></ssd:Component>")
    text.append("</ssd:Elements><ssd:Connections>")
    for source, target in connections:
        (a, output), (b, to) = source.split("."), target.split(".")
        ends = f'startElement="{a}" startConnector="{output}" endElement="{b}" endConnector="{to}"'
        text.append(f"<ssd:Connection {ends}/>")
    text.append("</ssd:Connections></ssd:System></ssd:SystemStructureDescription>")
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("SystemStructure.ssd", "\n".join(text))
        for name, file in fmus.items():
            archive.write(file, f"resources/{name}.fmu")


def fmpy():
    """Its simulation of system structures. It counts time up by additions: half a step keeps it from one too many. Its CPU time includes unpacking."""
    from fmpy.ssp.simulation import simulate_ssp

    with tempfile.TemporaryDirectory() as folder:
        path = str(Path(folder) / "case.ssp")
        structure(path)
        start = time.process_time()
        result = simulate_ssp(path, stop_time=end - 0.5 * step, step_size=step)
        cpu = time.process_time() - start
    assert len(result) == STEPS, f"{len(result)} steps instead of {STEPS}"
    # names begin with that of the system where it is not the only one
    last = {name.removeprefix("all."): result[name][-1] for name in result.dtype.names}
    return [float(last[name]) for name in variables], cpu


def ecos():
    """Its algorithm with steps of one length."""
    from ecospy import EcosSimulation, EcosSimulationStructure

    all_of_it = EcosSimulationStructure()
    for name, path in fmus.items():
        all_of_it.add_model(name, path)
    for pair in connections:
        all_of_it.make_real_connection(*(name.replace(".", "::") for name in pair))
    with EcosSimulation(structure=all_of_it, step_size=step) as simulation:
        simulation.init()
        start = time.process_time()
        simulation.step(STEPS)
        cpu = time.process_time() - start
        values = [simulation.get_real(name.replace(".", "::")) for name in variables]
        simulation.terminate()
    return values, cpu


def omsimulator():
    """Its package loads the program from the server of its makers while it is installed."""
    try:
        import OMSimulator
    except ImportError:
        sys.exit("OMSimulator is not installed: its package loads the program from the server of its makers")
    sys.exit(f"OMSimulator is installed in {OMSimulator.__path__[0]}, but the cases have not been written for it")


found, cpu = {"fmpy": fmpy, "ecos": ecos, "omsimulator": omsimulator}[peer]()
print("RESULT", *map(repr, [*found, cpu]))
