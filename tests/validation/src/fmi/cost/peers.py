"""Steps FMUs in another master and prints the CPU time per FMU and step, µs.

Usage: peers.py ecos|libcosim|fmpy|fmucontainer FMU COUNT pair|chain BARE_LOOP
FMUs have an input `u` and an output `y`; in a chain y of one is u of the next, in a pair both ways.
"""

import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time

peer, path, count, form, bare_loop = sys.argv[1], os.path.abspath(sys.argv[2]), int(sys.argv[3]), *sys.argv[4:6]
links = [(k, (k + 1) % count) for k in range(count if form == "pair" else count - 1)]
H, ROUNDS = 1e-3, 7
steps = max(10_000 // count, 100)


def least(run):
    """Least CPU time of all threads over some rounds of `steps` steps."""
    best = float("inf")
    for _ in range(ROUNDS):
        start = time.process_time()
        run()
        best = min(best, time.process_time() - start)
    return best * 1e6 / steps / count


def ecos():
    from ecospy import EcosSimulation, EcosSimulationStructure

    structure = EcosSimulationStructure()
    for k in range(count):
        structure.add_model(f"u{k}", path)
    for a, b in links:
        structure.make_real_connection(f"u{a}::y", f"u{b}::u")
    with EcosSimulation(structure=structure, step_size=H) as simulation:
        simulation.init()
        cost = least(lambda: simulation.step(steps))
        simulation.terminate()
    return cost


def libcosim():
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimSlave import CosimLocalSlave

    execution = CosimExecution.from_step_size(int(H * 1e9))
    fmus = [execution.add_local_slave(CosimLocalSlave(fmu_path=path, instance_name=f"u{k}")) for k in range(count)]
    for a, b in links:
        execution.connect_real_variables(fmus[a], 1, fmus[b], 0)
    return least(lambda: execution.step(steps))


def fmpy():
    from fmpy import extract, read_model_description
    from fmpy.fmi2 import FMU2Slave

    description, folder = read_model_description(path), extract(path)
    fmus = []
    for k in range(count):
        name = description.coSimulation.modelIdentifier
        fmu = FMU2Slave(guid=description.guid, unzipDirectory=folder, modelIdentifier=name, instanceName=f"u{k}")
        fmu.instantiate()
        fmu.setupExperiment()
        fmu.enterInitializationMode()
        fmu.exitInitializationMode()
        fmus.append(fmu)
    now = [0.0]

    def run():
        for _ in range(steps):
            values = [fmus[a].getReal([1]) for a, _ in links]
            for (_, b), value in zip(links, values):
                fmus[b].setReal([0], value)
            for fmu in fmus:
                fmu.doStep(currentCommunicationPoint=now[0], communicationStepSize=H)
            now[0] += H

    cost = least(run)
    shutil.rmtree(folder, ignore_errors=True)
    return cost


def fmucontainer():
    """The container is an FMU itself: it is stepped by the bare loop in C."""
    from fmpy import extract, read_model_description

    folder = pathlib.Path(tempfile.mkdtemp())
    names = [f"u{k}.fmu" for k in range(count)]
    for name in names:
        shutil.copy(path, folder / name)
    assembly = {
        "name": "all.fmu",
        "fmu": names,
        "step_size": H,
        "auto_input": False,
        "auto_output": False,
        "output": [[names[0], "y", "y"]],
        "link": [[names[a], "y", names[b], "u"] for a, b in links],
    }
    (folder / "all.json").write_text(json.dumps(assembly))
    tool = pathlib.Path(sys.executable).parent / "fmucontainer"
    subprocess.run([tool, "-fmu-directory", folder, "-container", "all.json"], check=True, stdout=sys.stderr)
    fmu = str(folder / "all.fmu")
    description, place = read_model_description(fmu), extract(fmu)
    library = next(pathlib.Path(place).glob("binaries/linux64/*.so"))
    arguments = [library, "1", "chain", "blind", "go", description.guid, f"file://{place}/resources"]
    done = subprocess.run([bare_loop, *map(str, arguments)], capture_output=True, text=True)
    shutil.rmtree(folder, ignore_errors=True), shutil.rmtree(place, ignore_errors=True)
    assert done.returncode == 0, f"the loop over the container ended with {done.returncode}"
    return float(done.stdout.split()[0]) / count


print("RESULT", {"ecos": ecos, "libcosim": libcosim, "fmpy": fmpy, "fmucontainer": fmucontainer}[peer]())
