"""How much of a result is the soil, and how much the method? Indices of Sobol' (1993) of sinkage and pull of a wheel, with SALib and a sweep.

    pip install SALib
    python examples/python/soil_or_method.py 64

Friction, cohesion, shear modulus and stiffness of the soil are as uncertain as its measurement; soil module, strategy, grid and step are choices of
whoever simulates. The first-order index of a group is the share of the variance that goes away where it is known; the total index is the share that
stays where all else is known. Every case is the scenario `wheel_rig` for a second, in a process of its own.
"""

import pathlib
import sys
import tempfile

import numpy as np
from SALib.analyze import sobol as analysis
from SALib.sample import sobol as sampling

import terraglue

# group, key, and the value at a place from 0 to 1: between two numbers, or one of a list
FACTORS = [
    ("soil", "soil.phi_rad", (0.51, 0.58)),
    ("soil", "soil.c_pa", (800.0, 1800.0)),
    ("soil", "soil.K_m", (0.009, 0.015)),
    ("soil", "soil.k_phi", (4.5e6, 6.0e6)),
    ("method", "soil.module", ["soil-bekker", "soil-cellular-automaton"]),
    ("method", "gluing.strategy", ["cooperative", "iterative"]),
    ("method", "terrain.spacing_m", [0.005, 0.01]),
    ("method", "time.step_s", [0.001, 0.0005]),
]
RESULTS = ["soil.contact1.sinkage", "soil.contact1.pull"]


def value(place, choice):
    """A number between the ends of a range, or one of a list."""
    if isinstance(choice, tuple):
        return choice[0] + place * (choice[1] - choice[0])
    return choice[min(int(place * len(choice)), len(choice) - 1)]


def indices(points, folder, duration_s=1.0, executor=None):
    """First-order and total indices of the groups, with the half width of their 95 % intervals, for each result."""
    groups, keys, choices = zip(*FACTORS)
    problem = {"num_vars": len(keys), "names": list(keys), "groups": list(groups), "bounds": [[0.0, 1.0]] * len(keys)}
    places = sampling.sample(problem, points, calc_second_order=False, seed=1)
    table = pathlib.Path(folder) / "points.csv"
    rows = [",".join(str(value(x, choice)) for x, choice in zip(row, choices)) for row in places]
    table.write_text("\n".join([",".join(keys), *rows]) + "\n")
    plan = {"scenario": "wheel_rig", "sweep": {"method": "table", "table": str(table.absolute()), "collect": RESULTS}}
    scenario = {"soil.parameters": "LETE_sand", "time.duration_s": duration_s}
    cases = terraglue.sweep(plan, pathlib.Path(folder) / "sweep", set=scenario, executor=executor).rows()
    found = {}
    for result in RESULTS:
        y = np.array([case[result] for case in cases], dtype=float)
        found[result] = analysis.analyze(problem, y, calc_second_order=False, seed=1, print_to_console=False)
    return problem, found


def main():
    points = int(sys.argv[1]) if len(sys.argv) > 1 else 64
    with tempfile.TemporaryDirectory() as folder:
        _, found = indices(points, folder)
    for result, index in found.items():
        print(result)
        for k, group in enumerate(dict.fromkeys(group for group, *_ in FACTORS)):
            first, total = (f"{index[key][k]:.2f} ± {index[key + '_conf'][k]:.2f}" for key in ("S1", "ST"))
            print(f"  {group:8} first order {first}, total {total}")


if __name__ == "__main__":
    main()
