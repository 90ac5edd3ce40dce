"""Two masses on a spring between two FMUs, in another master, step by step; prints the place of the first after each step.

Usage: pair_peers.py ecos|fmpy|pyfmi LEFT.fmu RIGHT.fmu STEPS H
The left FMU takes a force f and gives x and v; the right one takes those as x1 and v1 and gives f.
"""

import sys

peer, left, right, steps, h = sys.argv[1], sys.argv[2], sys.argv[3], int(sys.argv[4]), float(sys.argv[5])


def ecos():
    from ecospy import EcosSimulation, EcosSimulationStructure

    structure = EcosSimulationStructure()
    structure.add_model("left", left)
    structure.add_model("right", right)
    for a, b in (("left::x", "right::x1"), ("left::v", "right::v1"), ("right::f", "left::f")):
        structure.make_real_connection(a, b)
    with EcosSimulation(structure=structure, step_size=h) as simulation:
        simulation.init()
        for _ in range(steps):
            simulation.step(1)
            yield simulation.get_real("left::x")
        simulation.terminate()


def fmpy():
    """The explicit master that a user writes: all outputs are read, then all inputs set, then both FMUs step."""
    from fmpy import extract, read_model_description
    from fmpy.fmi2 import FMU2Slave

    fmus = []
    for path in (left, right):
        description = read_model_description(path)
        name = description.coSimulation.modelIdentifier
        fmu = FMU2Slave(guid=description.guid, unzipDirectory=extract(path), modelIdentifier=name, instanceName=path)
        fmu.instantiate()
        fmu.setupExperiment()
        fmu.enterInitializationMode()
        fmu.exitInitializationMode()
        fmus.append((fmu, {v.name: v.valueReference for v in description.modelVariables}))
    (a, names_a), (b, names_b) = fmus
    for k in range(steps):
        x, v = a.getReal([names_a["x"], names_a["v"]])
        (f,) = b.getReal([names_b["f"]])
        b.setReal([names_b["x1"], names_b["v1"]], [x, v])
        a.setReal([names_a["f"]], [f])
        for fmu in (a, b):
            fmu.doStep(currentCommunicationPoint=k * h, communicationStepSize=h)
        yield a.getReal([names_a["x"]])[0]


def pyfmi():
    """Its master with linear correction, where the FMUs give directional derivatives."""
    from pyfmi import Master, load_fmu

    a, b = load_fmu(left), load_fmu(right)
    links = [(a, "x", b, "x1"), (a, "v", b, "v1"), (b, "f", a, "f")]
    master = Master([a, b], links)
    options = master.simulate_options()
    options["step_size"], options["linear_correction"] = h, True
    result = master.simulate(0.0, steps * h, options)
    yield from list(result[a]["x"])[1:]


print("RESULT", *(repr(x) for x in {"ecos": ecos, "fmpy": fmpy, "pyfmi": pyfmi}[peer]()))
