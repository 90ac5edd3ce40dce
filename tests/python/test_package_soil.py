"""The soil of the Python package for dynamics of one's own, and its examples."""

import importlib.util
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from conftest import ROOT


def test_a_mass_of_ones_own_comes_to_rest_on_the_soil(tg):
    # a sphere of 10 cm under 2 kg, with dynamics of its own in steps of the soil
    mass, radius, h = 2.0, 0.1, 1e-3
    soil = tg.Soil([[0.0, 0.0, radius]], radius_m=radius, step_s=h, terrain={"kind": "flat", "size_m": [1.0, 1.0], "spacing_m": 0.005})
    z, v, force = radius, 0.0, 0.0
    for _ in range(1500):
        v += h * (force / mass - 9.81 - 20.0 * v)
        z += h * v
        wrench, _ = soil.step([[0.0, 0.0, z]])
        force = wrench[0, 2]
    assert force == pytest.approx(mass * 9.81, rel=0.02) and abs(v) < 1e-3
    x, y, ground = soil.heights(-0.2, 0.2, -0.2, 0.2)
    assert ground.min() == pytest.approx(z - radius, abs=1e-3) and z < radius


def test_a_trial_leaves_nothing_and_derivatives_are_those_of_the_force(tg):
    place = np.array([[0.0, 0.0, 0.03], [0.5, 0.2, 0.03]])
    soil = tg.Soil(place, parameters="dry_sand_LLL_K010", terrain={"kind": "flat", "size_m": [2.0, 1.0], "spacing_m": 0.005})
    for _ in range(10):
        place[:, 2] -= 2e-4
        force, moment = soil.step(place)
    assert force.shape == moment.shape == (2, 3) and (force[:, 2] > 0).all()
    deeper = place - [0.0, 0.0, 1e-4]
    tried, _ = soil.trial(deeper)
    again, _ = soil.trial(deeper)
    assert np.array_equal(tried, again)
    slope = soil.derivatives(deeper)
    # pressed deeper, the ground pushes more; a smaller step by hand agrees
    assert (slope[:, 2, 2] < 0).all()
    by_hand = (soil.trial(deeper + [0.0, 0.0, 1e-7])[0] - soil.trial(deeper - [0.0, 0.0, 1e-7])[0])[:, 2] / 2e-7
    assert slope[:, 2, 2] == pytest.approx(by_hand, rel=1e-3)
    assert np.array_equal(soil.step(deeper)[0], tried)
    for wrong in ([[0.0, 0.0, 0.0]], [[0.0, 0.0, float("nan")]] * 2, [[0.0, 0.0]] * 2):
        with pytest.raises(ValueError, match="position"):
            soil.step(wrong)


def test_a_dragged_foot_of_a_soil_takes_as_much_work_as_it_gives_heat(tg):
    soil = tg.Soil([[0.0, 0.0, 0.03]], module="soil-cellular-automaton", terrain={"kind": "flat", "size_m": [1.0, 0.4], "spacing_m": 0.005})
    place, work = np.array([0.0, 0.0, 0.03]), 0.0
    for k in range(300):
        before = place.copy()
        place = place + (np.array([0.0, 0.0, -1e-4]) if k < 100 else np.array([2e-4, 0.0, 0.0]))
        force, _ = soil.step(place[None])
        work -= float(force[0] @ (place - before))
    energy = soil.testbed.energy()
    kept = energy["dissipated"] + energy["potential"]
    assert work > 0.1 and kept == pytest.approx(work, rel=0.01)


def test_many_steps_in_one_call_are_those_of_single_ones(tg):
    def soil():
        return tg.Soil([[0.0, 0.0, 0.03], [0.3, 0.0, 0.03]], terrain={"kind": "flat", "size_m": [1.0, 0.4], "spacing_m": 0.01})

    path = np.array([[0.0, 0.0, 0.03], [0.3, 0.0, 0.03]]) + np.array([[[1e-5 * k, 0.0, -2e-5 * k]] * 2 for k in range(1, 41)])
    turns = np.array([[[1.0, 0.001 * k, 0.0, 0.0]] * 2 for k in range(1, 41)])
    one, other = soil(), soil()
    single = [np.stack(one.step(pose, turn)) for pose, turn in zip(path, turns)]
    force, moment = other.advance(path, turns)
    assert force.shape == moment.shape == (40, 2, 3)
    assert np.array_equal(np.stack([force, moment], axis=1), np.array(single)) and (force[-1, :, 2] > 0).all()
    # orientations are kept
    assert np.array_equal(other.step(path[-1])[1], one.step(path[-1])[1])
    assert other.advance(np.empty((0, 2, 3)))[0].shape == (0, 2, 3)
    for wrong in (path[0], path[:, :1], np.full((1, 2, 3), np.nan)):
        with pytest.raises(ValueError, match="position"):
            other.advance(wrong)
    with pytest.raises(ValueError, match="length 0"):
        other.advance(path[:1], np.zeros((1, 2, 4)))


def turned(orientation, rotation):
    """Orientation turned by a rotation vector in world axes."""
    angle = np.linalg.norm(rotation)
    w, v = np.cos(angle / 2), np.sin(angle / 2) * rotation / angle
    scalar, vector = orientation[:, :1], orientation[:, 1:]
    return np.hstack([w * scalar - vector @ v[:, None], w * vector + scalar * v + np.cross(v, vector)])


def test_the_jacobian_of_the_wrench_is_that_of_small_motions(tg):
    place = np.array([[0.0, 0.0, 0.02], [0.5, 0.1, 0.02]])
    level = np.tile([1.0, 0.0, 0.0, 0.0], (2, 1))
    soil = tg.Soil(place, shape="box", half_extents_m=(0.06, 0.04, 0.02), terrain={"kind": "flat", "size_m": [2.0, 1.0], "spacing_m": 0.01})
    for _ in range(10):
        place[:, 2] -= 2e-4
        soil.step(place)
    deeper, tilted = place - [0.0, 0.0, 1e-4], turned(level, np.array([5e-4, 3e-4, 0.0]))
    jacobian = soil.jacobian(deeper, tilted)
    assert jacobian.shape == (2, 6, 6)
    # deeper pushes more, a tilt is pushed back
    assert (jacobian[:, 2, 2] < 0).all() and (jacobian[:, 3, 3] < 0).all() and (jacobian[:, 4, 4] < 0).all()
    assert jacobian[:, :3, :3] == pytest.approx(soil.derivatives(deeper, tilted), rel=1e-6, abs=1e-3)
    # a small motion in all six directions at once, by hand
    motion = np.array([1e-7, -2e-7, 3e-7, 2e-7, -1e-7, 1e-7])
    wrench = lambda sign: np.hstack(soil.trial(deeper + sign * motion[:3], turned(tilted, sign * motion[3:])))
    change = 0.5 * (wrench(1.0) - wrench(-1.0))
    assert change == pytest.approx(jacobian @ motion, rel=2e-3, abs=2e-3 * np.abs(change).max())


def example(name):
    spec = importlib.util.spec_from_file_location(name, ROOT / "examples/python" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_a_post_in_mujoco_stands_with_moments_and_falls_without(tg):
    pytest.importorskip("mujoco", reason="mujoco is not installed: pip install mujoco")
    run = example("soil_in_mujoco").run
    tilt, height = run(True).T
    assert len(tilt) == 1500 and tilt.max() < 5e-3 and tilt[-1] < tilt.max() and 0.02 < height[-1] < 0.03
    fallen, _ = run(False).T
    assert fallen[-1] > 1.2 and len(fallen) < 1500


def test_a_search_for_a_gait_returns_what_it_has_measured(tg):
    pytest.importorskip("scipy", reason="scipy is not installed: pip install scipy")
    gait = example("gait_for_energy")
    # the search itself takes minutes: here a piece of it, with short walks
    short = {"until_s": 0.4, "set": {"gait.stand_s": 0.0, "gait.ramp_s": 0.1, "terrain.size_m": [3.0, 1.6], "terrain.spacing_m": 0.02}}
    first = gait.cost([[0.15, 0.1], [0.05, 0.05]], **short)
    assert first.shape == (2,) and np.isfinite(first).all()
    best, lowest = gait.search(generations=1, population=3, **short)
    assert lowest == gait.cost(best[:, None], **short)[0]


def test_optuna_asks_for_gaits_and_is_told_what_they_need(tg, monkeypatch):
    pytest.importorskip("optuna", reason="optuna is not installed: pip install optuna")
    pytest.importorskip("scipy", reason="scipy is not installed: pip install scipy")
    monkeypatch.syspath_prepend(ROOT / "examples/python")
    short = {"until_s": 0.4, "set": {"gait.stand_s": 0.0, "gait.ramp_s": 0.1, "terrain.size_m": [3.0, 1.6], "terrain.spacing_m": 0.02}}
    study = example("gait_with_optuna").search(rounds=2, at_once=3, **short)
    told = [trial.value for trial in study.trials]
    assert len(told) == 6 and study.best_value == min(told)
    best = np.array([[value] for value in study.best_params.values()])
    assert example("gait_for_energy").cost(best, **short)[0] == study.best_value


def test_indices_of_sobol_find_what_a_result_follows(tg, tmp_path):
    pytest.importorskip("SALib", reason="SALib is not installed: pip install SALib")
    study = example("soil_or_method")
    # the load of the wheel decides, the step does not
    study.FACTORS = [("load", "rig.torque_target.press", (20.0, 90.0)), ("step", "time.step_s", [0.001, 0.0005])]
    with ThreadPoolExecutor(2) as executor:
        problem, found = study.indices(8, tmp_path, duration_s=0.1, executor=executor)
    index = found["soil.contact1.sinkage"]
    assert problem["groups"] == ["load", "step"]
    assert index["ST"][0] > 0.9 and abs(index["ST"][1]) < 0.05
