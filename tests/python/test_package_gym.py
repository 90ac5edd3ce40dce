"""Environments of Gymnasium: the checker, vector environments with their ways of resetting, tasks of a scenario."""

import warnings

import numpy as np
import pytest

gymnasium = pytest.importorskip("gymnasium", reason="gymnasium is not installed: pip install gymnasium")
SMALL = {"period_s": 0.02, "duration_s": 0.06}


@pytest.fixture
def envs(tg):
    import terraglue.gym

    return terraglue.gym


@pytest.mark.parametrize("name", ["MoonWalk", "RoverSlope"])
def test_environments_pass_the_checker_and_are_repeatable(envs, name):
    from gymnasium.utils.env_checker import check_env

    env = envs.environment(name, period_s=0.02, duration_s=0.1)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        # ranges of velocities and torques are not known
        warnings.filterwarnings("ignore", message=".*(infinity|symmetric and normalized|render|spec).*")
        check_env(env, skip_render_check=True)
    actions = [env.action_space.sample() for _ in range(5)]

    def episode(seed):
        rows = [env.reset(seed=seed)[0]]
        for action in actions:
            observed, reward, fallen, over, info = env.step(action)
            rows.append(observed)
        assert over and not fallen and np.isfinite(reward) and info["cost"] >= 0
        return np.array(rows)

    assert np.array_equal(episode(3), episode(3))
    if name == "MoonWalk":
        assert not np.array_equal(episode(3), episode(4))
    env.close()
    with pytest.raises(gymnasium.error.ResetNeeded):
        envs.environment(name).step(actions[0])


def test_environments_are_registered(envs):
    made = gymnasium.make("terraglue/RoverSlope-v0")
    assert made.action_space.shape == (6,)
    vector = gymnasium.make_vec("terraglue/RoverSlope-v0", num_envs=3, vectorization_mode="vector_entry_point")
    assert vector.action_space.shape == (3, 6) and vector.single_observation_space == made.observation_space
    observed, info = vector.reset(seed=5)
    assert observed in vector.observation_space and info["seed"].tolist() == [5, 6, 7]
    vector.close()


def rollout(vector, steps=8, seed=7):
    rng = np.random.default_rng(1)
    rows = [vector.reset(seed=seed)]
    for _ in range(steps):
        rows.append(vector.step(rng.uniform(vector.action_space.low, vector.action_space.high).astype(np.float32)))
    return rows


def same(one, other):
    """The same values with the same keys, arrays bit by bit."""
    if isinstance(one, dict):
        assert one.keys() == other.keys(), (one.keys(), other.keys())
        return all(same(one[key], other[key]) for key in one)
    if isinstance(one, np.ndarray) and one.dtype == object:
        return all(same(a, b) for a, b in zip(one, other))
    return np.array_equal(one, other, equal_nan=False) if one is not None else other is None


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_a_vector_environment_has_the_bits_of_single_ones(envs, mode):
    make = lambda: envs.environment("MoonWalk", **SMALL)
    single = gymnasium.vector.SyncVectorEnv([make] * 2, autoreset_mode=mode)
    vector = envs.vector_environment("MoonWalk", 2, autoreset_mode=mode, **SMALL)
    assert vector.metadata["autoreset_mode"] == single.metadata["autoreset_mode"]
    over = 0
    for one, other in zip(rollout(single), rollout(vector)):
        assert len(one) == len(other)
        for a, b in zip(one, other):
            assert same(a, b), (a, b)
        over += int(np.sum(one[3])) if len(one) == 5 else 0
    assert over >= 4
    single.close(), vector.close()


def test_without_autoreset_those_that_are_over_are_reset_by_a_mask(envs):
    vector = envs.vector_environment("RoverSlope", 2, autoreset_mode="Disabled", **SMALL)
    with pytest.raises(gymnasium.error.ResetNeeded):
        vector.step(np.zeros((2, 6)))
    rows = rollout(vector, steps=3)
    assert rows[-1][3].all()
    with pytest.raises(gymnasium.error.ResetNeeded, match="0, 1"):
        vector.step(np.zeros((2, 6)))
    observed, info = vector.reset(seed=[3, 4], options={"reset_mask": np.array([True, False])})
    assert info["seed"][0] == 3 and info["_seed"].tolist() == [True, False]
    assert vector.batch.t == pytest.approx([0.0, 0.06])
    for wrong in (np.array([1, 0]), np.array([False, False]), np.array([True])):
        with pytest.raises(ValueError, match="reset_mask"):
            vector.reset(options={"reset_mask": wrong})
    vector.close()


def test_a_fall_ends_an_episode(envs):
    task = envs.task("RoverSlope", fallen_rad=1e-12, **SMALL)
    vector, single = envs.VectorEnvironment(task, 2), envs.Environment(task)
    vector.reset(seed=1), single.reset(seed=1)
    _, rewards, fallen, over, _ = vector.step(np.full((2, 6), 2.0))
    assert rewards.tolist() == [-1.0, -1.0] and fallen.all() and not over.any()
    assert single.step(np.full(6, 2.0))[1:4] == (-1.0, True, False)
    vector.close(), single.close()


def test_a_task_is_a_table_of_a_scenario(tg, envs, tmp_path):
    scenario = str(tg.SCENARIOS / "moon_walk.toml")
    task = envs.Task.of(scenario, {"task.period_s": 0.5, "task.cost": ["robot.body.z"]})
    assert task.period_s == 0.5 and task.cost == ["robot.body.z"] and [a.high for a in task.act] == [0.25, 0.12, 0.2]
    names = task.spelled_out().observe
    assert "robot.LF_j2.torque" in names and "robot.body.vx" in names and not any("*" in name for name in names)
    for edit, words in (
        ({"task.low": [0.0]}, "`low` has 1 numbers"),
        ({"task.high": [0.0, 0.1, 0.2]}, "range of `gait.speed` is empty"),
        ({"task.observe": ["robto.body.z"]}, "did you mean"),
        ({"task.rewards": "x"}, "did you mean `reward`"),
        ({"task.period_s": 0.0}, "period_s"),
    ):
        with pytest.raises(tg.InputError, match=words):
            envs.Task.of(scenario, edit)
    with pytest.raises(tg.UnknownName, match="did you mean `robot.body.z`"):
        envs.Task.of(scenario, {"task.observe": ["robot.body.zz*"]}).spelled_out()
    with pytest.raises(tg.InputError, match=r"\[task\]"):
        envs.Task.of("plate_sinkage")
