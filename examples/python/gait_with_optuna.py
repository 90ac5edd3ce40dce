"""The same search as in gait_for_energy.py by Optuna's ask and tell: each round asks for as many trials as a batch walks at once.

    pip install optuna scipy
    python examples/python/gait_with_optuna.py 16

Optuna keeps the study: with `storage="sqlite:///gait.db"` other machines take part in it, and its dashboard shows it.
"""

import sys

import numpy as np
import optuna
from gait_for_energy import RANGES, cost


def search(rounds=16, at_once=8, **options):
    """The study after so many rounds of trials."""
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    study = optuna.create_study(sampler=optuna.samplers.TPESampler(seed=1, constant_liar=True))
    for _ in range(rounds):
        trials = [study.ask() for _ in range(at_once)]
        parameters = np.array([[trial.suggest_float(name, *bounds) for trial in trials] for name, bounds in RANGES.items()])
        for trial, joules_per_m in zip(trials, cost(parameters, **options)):
            study.tell(trial, joules_per_m)
    return study


def main():
    study = search(rounds=int(sys.argv[1]) if len(sys.argv) > 1 else 16)
    print(", ".join(f"{name} = {value:.4f}" for name, value in study.best_params.items()), f"needs {study.best_value:.1f} J/m")


if __name__ == "__main__":
    main()
