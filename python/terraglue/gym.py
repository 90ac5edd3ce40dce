"""Environments of Gymnasium: `gymnasium.make("terraglue/MoonWalk-v0")` after `import terraglue.gym`.

A `Task` says what is observed, what is acted upon and what counts: `Task.of(scenario)` reads it from the table `[task]` of a scenario.
`Environment` is one testbed, `VectorEnvironment` a batch of them on all cores.
"""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Optional

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from ._terraglue import Batch, Testbed, matching
from ._terraglue import task as _table
from .errors import InputError, SimulationError


@dataclasses.dataclass(frozen=True)
class Action:
    """A variable that is set, with its range."""

    name: str
    low: float
    high: float


@dataclasses.dataclass(frozen=True)
class Task:
    """An environment in words: names of variables are those of the scenario; each `*` matches within one dotted part."""

    #: As for `Testbed`.
    scenario: Any
    #: Variables that are observed, in their units.
    observe: Sequence[str]
    #: Variables that are set.
    act: Sequence[Action]
    #: Variables whose growth is rewarded.
    reward: Sequence[str]
    #: Variables whose growth the reward is divided by; none: the work of all drives, J.
    cost: Sequence[str] = ()
    #: Angles whose magnitude beyond `fallen_rad` is a fall.
    tilt: Sequence[str] = ()
    #: Time between two actions, s.
    period_s: float = 0.1
    #: Time of an episode, s.
    duration_s: float = 10.0
    fallen_rad: float = 0.8
    #: Edits of the scenario.
    set: Optional[Mapping[str, Any]] = None

    @classmethod
    def of(cls, scenario, set=None):
        """The table `[task]` of a scenario."""
        table = _table(scenario, set=set)
        if table is None:
            raise InputError(f"{scenario}: the scenario has no table `[task]`: docs/scenario.md shows its keys")
        act = [Action(name, *ends) for name, ends in table.pop("act")]
        return cls(scenario=scenario, set=set, act=act, **table)

    def spelled_out(self):
        """The same with the variables that its patterns match."""
        if "*" not in "".join([*self.observe, *self.reward, *self.cost, *self.tilt, *(action.name for action in self.act)]):
            return self
        with Testbed(self.scenario, set=dict(self.set or {})) as testbed:
            names = testbed.names
        act = [Action(name, action.low, action.high) for action in self.act for name in matching(names, [action.name])]
        lists = {key: matching(names, getattr(self, key)) for key in ("observe", "reward", "cost", "tilt")}
        return dataclasses.replace(self, act=act, **lists)

    def _spaces(self):
        low, high = (np.array([getattr(action, end) for action in self.act], dtype=np.float32) for end in ("low", "high"))
        return spaces.Box(low, high, dtype=np.float32), spaces.Box(-np.inf, np.inf, (len(self.observe),), dtype=np.float64)

    def _values(self, actions):
        """Numbers to write; the ends of a range are those of the task, not their nearest 32-bit numbers."""
        low, high = (np.array([getattr(action, end) for action in self.act]) for end in ("low", "high"))
        return np.ascontiguousarray(np.clip(np.asarray(actions, dtype=float), low, high))

    # `runs` is a testbed, whose results are those of one episode, or a batch, whose results have a row for each

    def _observed(self, runs):
        return np.nan_to_num(runs.read(list(self.observe)))

    def _counted(self, runs):
        """What is rewarded and what it costs, both since the start of the run."""
        cost = runs.read(list(self.cost)).sum(axis=-1) if self.cost else runs.energy()["actuator_work"]
        return np.stack([runs.read(list(self.reward)).sum(axis=-1), cost], axis=-1)

    def _has_fallen(self, runs):
        return np.abs(np.nan_to_num(runs.read(list(self.tilt)))).max(axis=-1, initial=0.0) > self.fallen_rad

    def _is_over(self, runs):
        return runs.t >= self.duration_s - 0.5 * runs.step_s

    @staticmethod
    def _reward(fallen, ended, gain, cost):
        return np.where(fallen, -1.0, np.where(ended, gain / np.maximum(cost, 1e-9), 0.0))


class Environment(gymnasium.Env):
    """One testbed as an environment.

    The reward of an episode is given at its end: for the tasks of this package the distance per joule of the drives, m/J. A fall or a
    simulation that stops ends it with −1. A seed of `reset` is the seed of the world, so that an episode with the same actions is the same
    to the bit.
    """

    metadata = {"render_modes": []}

    def __init__(self, task: Task, make: Callable[..., Testbed] = Testbed):
        self.task, self._make = task.spelled_out(), make
        self._testbed = None
        self._actions = [action.name for action in self.task.act]
        self.action_space, self.observation_space = self.task._spaces()

    @property
    def testbed(self):
        """The running testbed: all its variables can be read between steps."""
        return self._testbed

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        own = seed if seed is not None else int(self.np_random.integers(2**31))
        if self._testbed is not None:
            self._testbed.finish()
        self._testbed = self._make(self.task.scenario, set=dict(self.task.set or {}), seed=own)
        self._begun = self.task._counted(self._testbed)
        return self.task._observed(self._testbed), {"seed": own}

    def step(self, action):
        task, testbed = self.task, self._testbed
        if testbed is None:
            raise gymnasium.error.ResetNeeded("reset comes before the first step")
        testbed.write(self._actions, task._values(action))
        try:
            testbed.run_until(testbed.t + task.period_s)
        except SimulationError as error:
            nothing = np.zeros(self.observation_space.shape)
            return nothing, -1.0, True, False, {"gain": np.nan, "cost": np.nan, "error": str(error)}
        gain, cost = task._counted(testbed) - self._begun
        fallen = bool(task._has_fallen(testbed))
        over = bool(task._is_over(testbed)) and not fallen
        reward = float(task._reward(fallen, over, gain, cost))
        return task._observed(testbed), reward, fallen, over, {"gain": gain, "cost": cost}

    def close(self):
        if self._testbed is not None:
            self._testbed.finish()
            self._testbed = None


class VectorEnvironment(VectorEnv):
    """A batch of testbeds as one vector environment, stepped on all cores.

    Each has the bits of an `Environment` with its seed. `autoreset_mode` is one of Gymnasium's: next step, same step, or disabled, where
    `reset(options={"reset_mask": …})` starts again those that are over.
    """

    def __init__(self, task: Task, num_envs: int = 1, *, threads: int = 0, autoreset_mode=AutoresetMode.NEXT_STEP):
        self.task, self.num_envs, self._threads = task.spelled_out(), num_envs, threads
        self.autoreset_mode = AutoresetMode(autoreset_mode)
        self.metadata = {"render_modes": [], "autoreset_mode": self.autoreset_mode}
        self._actions = [action.name for action in self.task.act]
        self.single_action_space, self.single_observation_space = self.task._spaces()
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self._random = [None] * num_envs
        self._begun = np.zeros((num_envs, 2))
        self._over = np.zeros(num_envs, dtype=bool)
        self._batch = None

    @property
    def batch(self):
        """The running batch."""
        return self._batch

    def reset(self, *, seed=None, options=None):
        which = np.ones(self.num_envs, dtype=bool)
        mask = (options or {}).get("reset_mask")
        if mask is not None:
            which = np.asarray(mask)
            if which.shape != (self.num_envs,) or which.dtype != np.bool_ or not which.any():
                raise InputError(f"reset_mask: {self.num_envs} truth values are wanted, at least one of them true")
        if seed is None or isinstance(seed, (int, np.integer)):
            seed = [None if seed is None else int(seed) + k for k in range(self.num_envs)]
        if len(seed) != self.num_envs:
            raise InputError(f"seed: {self.num_envs} numbers are wanted, one for each environment")
        infos = self._start(np.flatnonzero(which), seed)
        return self.task._observed(self._batch), infos

    def step(self, actions):
        if self._batch is None:
            raise gymnasium.error.ResetNeeded("reset comes before the first step")
        task, batch, over = self.task, self._batch, self._over.copy()
        if self.autoreset_mode == AutoresetMode.DISABLED and over.any():
            raise gymnasium.error.ResetNeeded(f"environments {np.flatnonzero(over).tolist()} are over: reset them with a `reset_mask`")
        values = np.array(task._values(actions))
        values[over] = np.nan
        batch.write(self._actions, values)
        batch.run_until(np.where(over, np.nan, batch.t + task.period_s))
        rewards, fallen, ended, own = self._judged(over)
        self._over = fallen | ended
        if self.autoreset_mode == AutoresetMode.SAME_STEP:
            observed = self.task._observed(self._batch)
            own = {k: {"final_obs": observed[k], "final_info": info} if self._over[k] else info for k, info in own.items()}
            over = self._over.copy()
        infos = {}
        for k, info in own.items():
            infos = self._add_info(infos, info, k)
        infos = self._start(np.flatnonzero(over), infos=infos) if over.any() else infos
        return self.task._observed(self._batch), rewards, fallen, ended, infos

    def close_extras(self, **kwargs):
        if self._batch is not None:
            self._batch.finish()
            self._batch = None

    def _judged(self, resting):
        """Rewards, falls, ends and figures of a step; of those that rest, nothing."""
        task, batch = self.task, self._batch
        failed = batch.failed
        stopped = np.isin(np.arange(self.num_envs), list(failed))
        gain, cost = (task._counted(batch) - self._begun).T
        fallen = (stopped | task._has_fallen(batch)) & ~resting
        ended = task._is_over(batch) & ~fallen & ~resting
        rewards = task._reward(fallen, ended, gain, cost)
        own = {k: {"gain": gain[k], "cost": cost[k]} for k in np.flatnonzero(~resting).tolist()}
        for k in own.keys() & failed.keys():
            own[k]["error"] = failed[k]
        return rewards, fallen, ended, own

    def _start(self, which, seeds=None, infos=None):
        """Starts some of them again; `infos` with theirs."""
        own = []
        for k in which:
            if seeds is not None and seeds[k] is not None:
                self._random[k] = seeding.np_random(seeds[k])[0]
                own.append(int(seeds[k]))
                continue
            self._random[k] = self._random[k] or seeding.np_random()[0]
            own.append(int(self._random[k].integers(2**31)))
        if self._batch is None:
            all_seeds = dict(zip(which.tolist(), own))
            first = [all_seeds.get(k, 1) for k in range(self.num_envs)]
            self._batch = Batch(self.task.scenario, self.num_envs, seeds=first, set=dict(self.task.set or {}), threads=self._threads)
        else:
            self._batch.restart(which.tolist(), seed=own)
        self._begun[which], self._over[which] = self.task._counted(self._batch)[which], False
        infos = {} if infos is None else infos
        for k, seed in zip(which.tolist(), own):
            infos = self._add_info(infos, {"seed": seed}, k)
        return infos


#: Scenarios of the package whose `[task]` is registered, and their edits: the rover starts without its time line.
TASKS = {"MoonWalk": ("moon_walk", None), "RoverSlope": ("rover_slope", {"event": []})}


def task(name, **changes):
    """A task of this package; `changes` replace fields of it."""
    return dataclasses.replace(Task.of(*TASKS[name]), **changes)


def environment(task_name, **changes):
    """The environment of a task of this package; `changes` replace fields of the task."""
    return Environment(task(task_name, **changes))


def vector_environment(task_name, num_envs=1, threads=0, autoreset_mode=AutoresetMode.NEXT_STEP, **changes):
    """The same as a vector environment."""
    return VectorEnvironment(task(task_name, **changes), num_envs, threads=threads, autoreset_mode=autoreset_mode)


for _name in TASKS:
    gymnasium.register(
        f"terraglue/{_name}-v0",
        entry_point="terraglue.gym:environment",
        vector_entry_point="terraglue.gym:vector_environment",
        kwargs={"task_name": _name},
    )
