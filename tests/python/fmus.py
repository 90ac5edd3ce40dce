"""Drives an FMU through FMPy as a master would, with both versions of the standard under one set of names."""

import shutil

import numpy as np
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave

from conftest import terraglue


def export(target, path, *arguments):
    """The FMU that the program writes."""
    done = terraglue("export", target, "-o", path, *arguments)
    assert done.returncode == 0, done.stderr
    return path


class Fmu:
    """An extracted FMU: description and instances."""

    def __init__(self, path):
        self.path = str(path)
        self.description = read_model_description(self.path)
        self.folder = extract(self.path)
        self.variables = {v.name: v for v in self.description.modelVariables}
        self.two = self.description.fmiVersion.startswith("2")

    def instance(self, name="unit", start=None, stop=None, running=True, **values):
        return Instance(self, name, start, stop, running, values)

    def remove(self):
        shutil.rmtree(self.folder, ignore_errors=True)


class Instance:
    """One instance, ready to step unless `running` is false."""

    def __init__(self, fmu, name, start, stop, running, values):
        self.fmu = fmu
        kind = FMU2Slave if fmu.two else FMU3Slave
        self.raw = kind(
            guid=fmu.description.guid if fmu.two else fmu.description.instantiationToken,
            unzipDirectory=fmu.folder,
            modelIdentifier=fmu.description.coSimulation.modelIdentifier,
            instanceName=name,
        )
        self.raw.instantiate()
        self.t = start or 0.0
        if running:
            self.initialize(values, stop)

    def initialize(self, values, stop=None):
        if self.fmu.two:
            self.raw.setupExperiment(startTime=self.t, stopTime=stop)
            self.raw.enterInitializationMode()
        else:
            self.raw.enterInitializationMode(startTime=self.t, stopTime=stop)
        self.set(**values)
        self.raw.exitInitializationMode()

    def names(self, name):
        """The value references of a variable, or of all its elements."""
        found = self.fmu.variables.get(name)
        if found is not None:
            return [found.valueReference]
        return [v.valueReference for n, v in self.fmu.variables.items() if n.startswith(name + "[")]

    def set(self, **values):
        for name, value in values.items():
            self[name.replace("__", ".")] = value

    def __setitem__(self, name, value):
        references, value = self.names(name), np.ravel(value).tolist()
        assert references, name
        (self.raw.setReal if self.fmu.two else self.raw.setFloat64)(references, value)

    def __getitem__(self, name):
        references = self.names(name)
        assert references, name
        found = self.fmu.variables.get(name)
        shape = found.shape if found is not None and found.dimensions else ()
        count = int(np.prod(shape)) if shape else len(references)
        values = self.raw.getReal(references) if self.fmu.two else self.raw.getFloat64(references, nValues=count)
        if shape:
            return np.reshape(values, shape)
        return np.reshape(values, (-1, 3)) if name in ("foot.force", "foot.moment") else np.array(values)

    def step(self, h):
        self.raw.doStep(currentCommunicationPoint=self.t, communicationStepSize=h)
        self.t += h

    def save(self):
        return self.raw.getFMUState() if not self.fmu.two else self.raw.getFMUstate()

    def restore(self, state):
        (self.raw.setFMUstate if self.fmu.two else self.raw.setFMUState)(state)

    def release(self, state):
        (self.raw.freeFMUstate if self.fmu.two else self.raw.freeFMUState)(state)

    def end(self):
        self.raw.terminate()
        self.raw.freeInstance()
