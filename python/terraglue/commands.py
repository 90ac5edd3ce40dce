"""Commands of the program as functions: compare, fit_soil, export_fmu, check_module."""

import json
import os
import pathlib
import tempfile

from .errors import Error
from .paths import scenario as _file
from .program import run


def _text(value):
    """A value as `--set` takes it."""
    if isinstance(value, (bool, int, float, list, tuple)) or hasattr(value, "tolist"):
        value = value.tolist() if hasattr(value, "tolist") else value
        return json.dumps(list(value) if isinstance(value, tuple) else value)
    return os.fspath(value) if hasattr(value, "__fspath__") else json.dumps(str(value), ensure_ascii=False)


def _sets(values):
    return [word for key, value in (values or {}).items() for word in ("--set", f"{key}={_text(value)}")]


def _option(name, value):
    return [] if value is None else [name, value]


def _listed(values):
    return None if values is None else ",".join(map(str, [values] if isinstance(values, str) else values))


def compare(scenario, *, strategies=None, soils=None, vary=None, steps=None, reference=None, duration_s=None, set=None, out=None):
    """Runs a scenario with several strategies, soils, steps (s) or values of keys, and returns the summary of the table; `out` keeps runs and page.

        terraglue.compare("moon_walk", strategies=["cooperative", "iterative"], duration_s=0.5)
    """
    options = [*_option("--strategies", _listed(strategies)), *_option("--soils", _listed(soils)), *_option("--steps", _listed(steps))]
    options += [word for key, values in (vary or {}).items() for word in ("--vary", f"{key}={_listed(values)}")]
    options += [*_option("--reference", reference), *_option("--duration", duration_s), *_sets(set)]
    with tempfile.TemporaryDirectory() as place:
        return run("compare", _file(scenario), *options, "--out", out or pathlib.Path(place) / "compare", "--json")


def fit_soil(data, *, law="bearing", wheel=None, out=None, predict=None, from_mm=None, soil=None, cohesion_pa=None, phi_deg=None, shear_m=None, density=None):
    """Finds the parameters of a soil from plate tests, or from those of a driven wheel (`wheel={"radius": m, "width": m}`); a dictionary.

        terraglue.fit_soil("plates.csv", law="bekker")["parameters"]
    """
    size = None if wheel is None else _listed(f"{key}={value}" for key, value in wheel.items())
    options = [*_option("--wheel", size), *([] if wheel else ["--law", law]), *_option("--out", out), *_option("--predict", predict)]
    options += [*_option("--from-mm", from_mm), *_option("--soil", soil), *_option("--cohesion-pa", cohesion_pa)]
    options += [*_option("--phi-deg", phi_deg), *_option("--shear-m", shear_m), *_option("--density", density)]
    return run("fit-soil", data, *options, "--json")


def export_fmu(what, output, *, fmi=3, scalars=False, set=None):
    """Writes a module, by its name, or a scenario as a functional mock-up unit; the path of the file.

        terraglue.export_fmu("soil-bekker", "soil.fmu", set={"soil.parameters": "LETE_sand"})
    """
    run("export", _file(what), "--output", output, "--fmi", fmi, *(["--scalars"] if scalars else []), *_sets(set))
    return pathlib.Path(output)


def check_module(path, *, level="standard", only=None, seed=1, set=None, jobs=None):
    """Puts a module to the test; a dictionary whose `rows` are the tests with their outcomes. A test that fails is no exception.

        [row["test"] for row in terraglue.check_module("soil-bekker", level="quick")["rows"] if row["outcome"] == "fail"]
    """
    with tempfile.TemporaryDirectory() as place:
        results = pathlib.Path(place) / "results.json"
        chosen = [word for name in ([only] if isinstance(only, str) else only or []) for word in ("--only", name)]
        options = ["--level", level, "--seed", seed, "--json", results, *chosen, *_option("--jobs", jobs), *_sets(set)]
        try:
            run("check-module", path, *options)
        except Error:
            if not results.exists():
                raise
        return json.loads(results.read_text())
