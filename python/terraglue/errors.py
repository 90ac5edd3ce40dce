"""Exceptions. All are `Error`; each also derives from the built-in type that Python programs expect."""


class Error(Exception):
    """Anything that Terraglue refuses or that fails in a run."""


class InputError(Error, ValueError):
    """A scenario, a value or a file that does not fit. The message names file, key and way out."""


class UnknownName(Error, KeyError):
    """There is no variable, stream or case of that name. The message has the most similar ones."""

    def __str__(self):
        return str(self.args[0]) if self.args else ""


class SimulationError(Error, RuntimeError):
    """The simulation stopped."""


class ModuleError(SimulationError):
    """A module or FMU failed; the message names it with time and function."""
