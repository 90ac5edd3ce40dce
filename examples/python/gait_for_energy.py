"""A gait that needs less energy per metre: a search over speed and lift with SciPy, each generation a batch on all cores.

    pip install scipy
    python examples/python/gait_for_energy.py

Each candidate walks the scenario `moon_walk`; its cost is the work of the drives per metre, J/m, from the time when it walks to the end. Those that fall or
that hardly move cost much. Every candidate has the same seed, so the same numbers come out on every machine with the same version.
"""

import sys

import numpy as np
from scipy.optimize import differential_evolution

import terraglue

RANGES = {"gait.speed": (0.05, 0.25), "gait.lift": (0.02, 0.10)}
WALKING_S, WALKS_S = 1.5, 2.5


def cost(parameters, until_s=WALKING_S + WALKS_S, **scenario):
    """Work per metre, J/m, of each column of parameters."""
    candidates = np.atleast_2d(np.asarray(parameters).T)
    batch = terraglue.Batch("moon_walk", len(candidates), seeds=[1] * len(candidates), **scenario)
    batch.write(list(RANGES), np.ascontiguousarray(candidates))
    begun = 0.4 * until_s
    batch.run_until(begun)
    way, work = -batch.read(["robot.body.x"])[:, 0], -batch.energy()["actuator_work"]
    batch.run_until(until_s)
    way, work = way + batch.read(["robot.body.x"])[:, 0], work + batch.energy()["actuator_work"]
    fallen = np.abs(batch.read(["robot.body.roll", "robot.body.pitch"])).max(axis=1) > 0.8
    bad = np.isnan(way) | fallen | (way < 1e-4)
    return np.where(bad, 1e4, work / np.where(bad, 1.0, way))


def search(generations=8, population=8, **options):
    """The best parameters and their cost."""
    found = differential_evolution(
        lambda x: cost(x, **options), list(RANGES.values()), maxiter=generations, popsize=population, seed=1, polish=False, vectorized=True,
        updating="deferred",
    )
    return found.x, float(found.fun)


def main():
    best, lowest = search(generations=int(sys.argv[1]) if len(sys.argv) > 1 else 8)
    print(", ".join(f"{name} = {value:.4f}" for name, value in zip(RANGES, best)), f"needs {lowest:.1f} J/m")
    print(f"as the scenario has it: {cost([[0.15], [0.05]])[0]:.1f} J/m")


if __name__ == "__main__":
    main()
