"""Environments of Gymnasium: `gymnasium.make("terraglue/MoonWalk-v0")` after `import terraglue.gym`.

A `Task` says what is observed, what is acted upon and what counts; `Environment` makes an environment of any scenario.
"""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Optional

import gymnasium
import numpy as np
from gymnasium import spaces

from ._terraglue import Testbed
from .errors import SimulationError


@dataclasses.dataclass(frozen=True)
class Action:
    """A variable that is set, with its range."""

    name: str
    low: float
    high: float


@dataclasses.dataclass(frozen=True)
class Task:
    """An environment in words: names of variables are those of the scenario."""

    #: As for `Testbed`.
    scenario: Any
    #: Variables that are observed, in their units.
    observe: Sequence[str]
    #: Variables that are set.
    act: Sequence[Action]
    #: Place along the way, m: the gain is the difference from the start.
    distance: str
    #: Angles whose magnitude beyond `fallen_rad` is a fall.
    tilt: Sequence[str]
    #: Time between two actions, s.
    period_s: float = 0.1
    #: Time of an episode, s.
    duration_s: float = 10.0
    fallen_rad: float = 0.8
    #: Edits of the scenario.
    set: Optional[Mapping[str, Any]] = None


class Environment(gymnasium.Env):
    """One testbed as an environment.

    The reward of an episode is the distance per joule of the drives, m/J, given at its end; a fall or a simulation that stops ends it with
    −1. A seed of `reset` is the seed of the world, so that an episode with the same actions is the same to the bit.
    """

    metadata = {"render_modes": []}

    def __init__(self, task: Task, make: Callable[..., Testbed] = Testbed):
        self.task, self._make = task, make
        self._testbed = None
        self._actions = [action.name for action in task.act]
        low, high = (np.array([getattr(action, end) for action in task.act], dtype=np.float32) for end in ("low", "high"))
        self.action_space = spaces.Box(low, high, dtype=np.float32)
        self.observation_space = spaces.Box(-np.inf, np.inf, (len(task.observe),), dtype=np.float64)

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
        self._start = self._testbed[self.task.distance]
        self._begun_j = self._joules()
        return self._observed(), {"seed": own}

    def step(self, action):
        task, testbed = self.task, self._testbed
        if testbed is None:
            raise gymnasium.error.ResetNeeded("reset comes before the first step")
        action = np.clip(np.asarray(action, dtype=float), self.action_space.low, self.action_space.high)
        testbed.write(self._actions, np.ascontiguousarray(action, dtype=float))
        end = testbed.t + task.period_s
        try:
            testbed.run_until(end)
        except SimulationError as error:
            return self._observed(), -1.0, True, False, {"error": str(error)}
        distance = testbed[task.distance] - self._start
        joules = self._joules() - self._begun_j
        info = {"distance_m": distance, "energy_j": joules}
        if np.abs(testbed.read(list(task.tilt))).max(initial=0.0) > task.fallen_rad:
            return self._observed(), -1.0, True, False, info
        over = testbed.t >= task.duration_s - 0.5 * testbed.step_s
        reward = distance / max(joules, 1e-9) if over else 0.0
        return self._observed(), float(reward), False, bool(over), info

    def close(self):
        if self._testbed is not None:
            self._testbed.finish()
            self._testbed = None

    def _observed(self):
        return np.nan_to_num(self._testbed.read(list(self.task.observe)))

    def _joules(self):
        return self._testbed.energy()["actuator_work"]


LEGS = ("LF", "LM", "LR", "RF", "RM", "RR")
BODY = ("z", "roll", "pitch", "yaw", "vx", "vy", "vz", "wx", "wy", "wz")

MOON_WALK = Task(
    scenario="moon_walk",
    observe=[f"robot.body.{name}" for name in BODY] + ["gait.phase"] + [f"robot.{leg}_j2.{q}" for leg in LEGS for q in ("angle", "torque")],
    act=[Action("gait.speed", 0.02, 0.25), Action("gait.lift", 0.02, 0.12), Action("gait.turn_rate", -0.2, 0.2)],
    distance="robot.body.x",
    tilt=["robot.body.roll", "robot.body.pitch"],
)
ROVER_SLOPE = Task(
    scenario="rover_slope",
    observe=[f"rover.body.{name}" for name in BODY] + [f"rover.{leg}_wheel_drive.{q}" for leg in LEGS for q in ("velocity", "torque")],
    act=[Action(f"rover.{leg}_wheel_drive.velocity_target", -2.0, 2.0) for leg in LEGS],
    distance="rover.body.x",
    tilt=["rover.body.roll", "rover.body.pitch"],
    duration_s=8.0,
    set={"event": []},
)

TASKS = {"MoonWalk": MOON_WALK, "RoverSlope": ROVER_SLOPE}


def environment(task, **changes):
    """The environment of a task of this package; `changes` replace fields of it."""
    return Environment(dataclasses.replace(TASKS[task], **changes))


for _name in TASKS:
    gymnasium.register(f"terraglue/{_name}-v0", entry_point="terraglue.gym:environment", kwargs={"task": _name})
