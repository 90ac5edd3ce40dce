"""Sweeps from Python: the cases of a plan on the cores of this machine, or on any executor of `concurrent.futures`, Dask's among them."""

import csv
import json
import os
import pathlib
import subprocess
import sys
import tempfile

from .commands import _option, _sets
from .errors import Error, InputError
from .paths import PROGRAM
from .paths import scenario as _file
from .program import run as _run


class Sweep:
    """A sweep in its folder; `Sweep(folder)` opens one that is there.

    A case is done when its result is in the folder, so what was interrupted goes on with `run()`, by whichever executor.
    """

    def __init__(self, folder):
        self.folder = pathlib.Path(folder)
        if not (self.folder / "sweep.json").is_file():
            raise InputError(f"{self.folder}: there is no sweep in this folder; terraglue.sweep(plan, folder) makes one")
        with open(self.folder / "cases.tsv", newline="", encoding="utf-8") as file:
            self._numbers = [int(row["case"]) for row in csv.DictReader(file, delimiter="\t")]

    @classmethod
    def create(cls, plan, folder, *, set=None):
        """Writes the list of cases of a plan: a file, a scenario with `[sweep]`, or a dictionary with `scenario` and `sweep`."""
        with tempfile.TemporaryDirectory() as place:
            if hasattr(plan, "keys"):
                text = {**plan, "scenario": os.path.abspath(_file(plan["scenario"]))} if "scenario" in plan else plan
                plan = pathlib.Path(place) / "plan.toml"
                plan.write_text("".join(f"{key} = {_toml(value)}\n" for key, value in text.items()), encoding="utf-8")
            _run("sweep", _file(plan), "--out", folder, *_sets(set))
        return cls(folder)

    def run(self, *, executor=None, jobs=None, again=False):
        """Runs the missing cases, each in a process of its own, and returns the sweep.

        `executor`: anything with the `submit` of `concurrent.futures`; its workers must see the folder and the program. `jobs`: cases at a time
        without one, one per core by default. `again`: those that failed, too.

        A case that fails is a row of the table; one whose process or worker was killed stays missing and is an error.
        """
        if executor is None:
            options = [*map(str, _option("--jobs", jobs)), *(["--again"] if again else [])]
            shown = None if sys.stderr.isatty() else subprocess.DEVNULL
            subprocess.run([PROGRAM, "sweep", "run", self.folder, *options], stdout=subprocess.DEVNULL, stderr=shown)
        else:
            for path, status in self._results() if again else ():
                if status != "done":
                    path.unlink()
            self._submit(executor)
        counts = self.collect()
        if counts["missing"]:
            raise Error(f"{counts['missing']} cases of {self.folder} were killed, or another process runs them; run() does what is missing")
        return self

    def _submit(self, executor):
        # a function of Python's own: workers need the program at the same path, and no package
        command = [str(PROGRAM), "sweep", "run", str(self.folder.absolute()), "--quiet", "--case"]
        quiet = dict.fromkeys(("stdin", "stdout", "stderr"), subprocess.DEVNULL)
        futures = [executor.submit(subprocess.call, [*command, str(number)], **quiet) for number in self.missing]
        try:
            for future in futures:
                future.result()
        finally:
            # after an error or Ctrl-C those that have not begun are left
            for future in futures:
                future.cancel()

    def _results(self):
        """File and status of each case that has a result."""
        for path in self.folder.glob("cases/*/case.json"):
            yield path, json.loads(path.read_text(encoding="utf-8"))["status"]

    def __len__(self):
        return len(self._numbers)

    def __repr__(self):
        return f"Sweep({os.fspath(self.folder)!r}, {len(self)} cases, {len(self.missing)} missing)"

    @property
    def missing(self):
        """Numbers of the cases that are still to be run."""
        found = {int(path.parent.name) for path in self.folder.glob("cases/*/case.json")}
        return [number for number in self._numbers if number not in found]

    def collect(self):
        """Writes `sweep.csv` and `sweep.html` from what is there; the number of cases by status."""
        told = _run("sweep", "collect", self.folder, "--json")
        return {status: told.get(status, 0) for status in ("done", "failed", "refused", "crashed", "missing")}

    def rows(self):
        """The table: a dictionary for each case with its values, `status`, `reason` and figures, numbers as numbers, None where there is none."""
        self.collect()
        with open(self.folder / "sweep.csv", newline="", encoding="utf-8") as file:
            return [{key: _value(text) for key, text in row.items()} for row in csv.DictReader(file)]

    def to_pandas(self):
        """The table as a pandas.DataFrame with `case` as its index; `.to_parquet(…)` writes it for others."""
        import pandas

        return pandas.DataFrame(self.rows()).set_index("case")


def sweep(plan, out, *, executor=None, jobs=None, set=None):
    """Runs a scenario once for each case of a plan and returns the :class:`Sweep`; `out` is its new folder.

        plan = {"scenario": "moon_walk", "sweep": {"seeds": 5, "vary": {"soil.module": ["soil-bekker", "soil-cellular-automaton"]}}}
        table = terraglue.sweep(plan, "runs/soils").to_pandas()

    `executor`: e.g. `concurrent.futures.ThreadPoolExecutor(8)`, or `dask.distributed.Client(…).get_executor()` for a cluster.
    """
    return Sweep.create(plan, out, set=set).run(executor=executor, jobs=jobs)


def _value(text):
    if text == "":
        return None
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            pass
    return text


def _toml(value):
    """A value in TOML, tables in one line."""
    if hasattr(value, "keys"):
        return "{" + ", ".join(f"{json.dumps(str(key), ensure_ascii=False)} = {_toml(own)}" for key, own in value.items()) + "}"
    value = value.tolist() if hasattr(value, "tolist") else value
    if isinstance(value, (list, tuple, range)):
        return "[" + ", ".join(map(_toml, value)) + "]"
    return json.dumps(value if isinstance(value, (bool, int, float)) else os.fspath(value), ensure_ascii=False)
