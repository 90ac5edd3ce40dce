"""A ground for programs with dynamics of their own: poses of feet or wheels in, forces and moments out."""

import numpy as np

from ._terraglue import Testbed
from .errors import InputError


class Soil:
    """Feet of one shape on deformable soil.

    `position` (n, 3) is where the feet are at the start. Each `step` moves them on straight lines to new poses, which they reach after
    `step_s`, and returns the wrenches of the ground on them, in world axes, moments about their origins. The new state is kept; `snapshot`
    and `restore` go back, `trial` looks without keeping.

        soil = Soil([[0.0, 0.0, 0.05]], module="soil-bekker", parameters="LETE_sand", radius_m=0.05)
        force, moment = soil.step([[0.0, 0.0, 0.04]])
    """

    def __init__(
        self,
        position,
        *,
        module="soil-bekker",
        parameters="LETE_sand",
        shape="sphere",
        radius_m=0.03,
        half_length_m=0.03,
        half_extents_m=(0.05, 0.05, 0.01),
        step_s=1e-3,
        gravity_m_s2=9.81,
        terrain=None,
        soil=None,
        set=None,
        threads=1,
    ):
        position = self._rows(position, 3, "position")
        self.count = len(position)
        feet = {"module": "feet", "count": self.count, "shape": shape, "position_m": position.ravel(), "duration_s": step_s}
        if shape == "box":
            feet["half_extents_m"] = list(half_extents_m)
        else:
            feet["radius_m"] = radius_m
        if shape in ("cylinder", "capsule"):
            feet["half_length_m"] = half_length_m
        scenario = {
            "time": {"step_s": step_s, "duration_s": 1e6 * step_s},
            "world": {"gravity_m_s2": [0.0, 0.0, -gravity_m_s2]},
            "terrain": terrain or {"kind": "flat", "size_m": [4.0, 4.0], "spacing_m": 0.01},
            "gluing": {"strategy": "iterative"},
            "soil": {"module": module, "parameters": parameters, **(soil or {})},
            "feet": feet,
        }
        self.step_s = step_s
        #: The testbed below: its variables, its energies.
        self.testbed = Testbed(scenario, set=set, threads=threads)
        one = lambda name, count: [f"feet.{name}[{i},{k}]" for i in range(1, self.count + 1) for k in range(1, count + 1)]
        self._pose = one("position", 3) + one("orientation", 4)
        self._wrench = one("force", 3) + one("moment", 3)
        self._orientation = np.tile([1.0, 0.0, 0.0, 0.0], (self.count, 1))

    def _rows(self, values, columns, what):
        rows = np.atleast_2d(np.asarray(values, dtype=float))
        count = getattr(self, "count", len(rows))
        if rows.shape != (count, columns) or not np.isfinite(rows).all():
            raise InputError(f"{what}: {count} rows of {columns} finite numbers are wanted, not an array of shape {rows.shape}")
        return rows

    def step(self, position, orientation=None):
        """Moves the feet to position (n, 3), m, and orientation (n, 4), quaternions w x y z; without one they keep theirs. Returns the mean
        forces (n, 3), N, and moments (n, 3), N m, over the step."""
        position = self._rows(position, 3, "position")
        if orientation is not None:
            self._orientation = self._unit(self._rows(orientation, 4, "orientation"))
        self.testbed.write(self._pose, np.concatenate([position.ravel(), self._orientation.ravel()]))
        self.testbed.step()
        force, moment = self.testbed.read(self._wrench).reshape(2, self.count, 3)
        return force, moment

    def advance(self, position, orientation=None):
        """Many steps in one call: positions (steps, n, 3) and orientations (steps, n, 4), quaternions w x y z, one for each step; without them
        the feet keep theirs. Returns the forces (steps, n, 3), N, and moments (steps, n, 3), N m, of each step."""
        position = self._steps(position, 3, "position")
        steps = len(position)
        if orientation is None:
            orientation = np.broadcast_to(self._orientation, (steps, self.count, 4))
        else:
            orientation = self._steps(orientation, 4, "orientation")
            if len(orientation) != steps:
                raise InputError(f"orientation: {steps} steps are wanted, as of position, not {len(orientation)}")
            orientation = self._unit(orientation)
        poses = np.concatenate([position.reshape(steps, 3 * self.count), orientation.reshape(steps, 4 * self.count)], axis=1)
        wrenches = self.testbed.drive(self._pose, np.ascontiguousarray(poses), self._wrench)
        if steps:
            self._orientation = np.array(orientation[-1])
        force, moment = np.moveaxis(wrenches.reshape(steps, 2, self.count, 3), 1, 0)
        return force, moment

    def _steps(self, values, columns, what):
        all_steps = np.asarray(values, dtype=float)
        if all_steps.ndim != 3 or all_steps.shape[1:] != (self.count, columns) or not np.isfinite(all_steps).all():
            raise InputError(f"{what}: finite numbers (steps, {self.count}, {columns}) are wanted, not an array of shape {all_steps.shape}")
        return all_steps

    def _unit(self, orientation):
        length = np.linalg.norm(orientation, axis=-1, keepdims=True)
        if not (length > 0.0).all():
            raise InputError("orientation: a quaternion of length 0 is no orientation")
        return orientation / length

    def snapshot(self):
        """The whole state, to go back to."""
        return self.testbed.snapshot(), self._orientation

    def restore(self, snapshot):
        """Back to a state."""
        state, self._orientation = snapshot
        self.testbed.restore(state)

    def trial(self, position, orientation=None):
        """The result that `step` would return; nothing is kept."""
        before = self.snapshot()
        try:
            return self.step(position, orientation)
        finally:
            self.restore(before)

    def derivatives(self, position, orientation=None, size_m=1e-6):
        """Derivatives of the forces by the positions at the end of a step, (n, 3, 3), N/m: entry [i, j, k] is that of force j on foot i by
        its coordinate k. By central differences of `size_m`, all feet at once: feet that share ground have no derivatives by each other."""
        position = self._rows(position, 3, "position")
        out = np.empty((self.count, 3, 3))
        for k in range(3):
            shift = np.zeros(3)
            shift[k] = size_m
            ahead, behind = (self.trial(position + sign * shift, orientation)[0] for sign in (1.0, -1.0))
            out[:, :, k] = (ahead - behind) / (2.0 * size_m)
        return out

    def jacobian(self, position, orientation=None, size_m=1e-6, size_rad=1e-6):
        """Derivatives of the wrenches by the poses at the end of a step, (n, 6, 6): rows are force x y z (N) and moment x y z (N m), columns
        position x y z (m) and rotation about the world axes x y z through the origin of the foot (rad). By central differences, all feet at
        once: feet that share ground have no derivatives by each other."""
        position = self._rows(position, 3, "position")
        orientation = self._orientation if orientation is None else self._unit(self._rows(orientation, 4, "orientation"))
        out = np.empty((self.count, 6, 6))
        for k in range(6):
            size = size_m if k < 3 else size_rad
            ahead, behind = (np.hstack(self.trial(*self._moved(position, orientation, k, sign * size))) for sign in (1.0, -1.0))
            out[:, :, k] = (ahead - behind) / (2.0 * size)
        return out

    def _moved(self, position, orientation, k, by):
        """Poses with coordinate k changed: moved along a world axis, or turned about one."""
        if k < 3:
            return position + by * np.eye(3)[k], orientation
        half = 0.5 * by
        w, v = np.cos(half), np.sin(half) * np.eye(3)[k - 3]
        scalar, vector = orientation[:, :1], orientation[:, 1:]
        turned = np.hstack([w * scalar - vector @ v[:, None], w * vector + scalar * v + np.cross(v, vector)])
        return position, turned

    def heights(self, x0, x1, y0, y1):
        """The ground within a rectangle: x of the columns, y of the rows, heights, m."""
        return self.testbed.heights(x0, x1, y0, y1)
