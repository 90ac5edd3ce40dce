"""Soil of Terraglue in the loop of MuJoCo, with forces and moments, next to the failure where the moments are dropped.

    pip install mujoco
    python examples/python/soil_in_mujoco.py

A box of 12 kg is set down with a push to its side. MuJoCo has gravity and the dynamics, Terraglue the sand under the box: each step MuJoCo's pose goes to the
soil, and its wrench comes back as `xfrc_applied`. The soil's moments are about the origin of the foot, MuJoCo applies them about the centre of mass: here
they are the same point. With its moments the box stays upright, as on real sand; without them nothing holds it level, and it turns over.
"""

import mujoco
import numpy as np

import terraglue

HALF = (0.15, 0.10, 0.05)
MODEL = f"""
<mujoco>
  <option timestep="0.001" gravity="0 0 -9.81"/>
  <worldbody>
    <body name="box" pos="0 0 {HALF[2]}">
      <freejoint/>
      <geom type="box" size="{HALF[0]} {HALF[1]} {HALF[2]}" mass="12" contype="0" conaffinity="0"/>
    </body>
  </worldbody>
</mujoco>
"""


def run(moments, duration_s=1.0):
    """Tilt (rad) and height (m) over time."""
    model = mujoco.MjModel.from_xml_string(MODEL)
    data = mujoco.MjData(model)
    step_s = model.opt.timestep
    soil = terraglue.Soil(
        [data.qpos[:3]], shape="box", half_extents_m=HALF, module="soil-bekker", parameters="LETE_sand", step_s=step_s,
        terrain={"kind": "flat", "size_m": [2.0, 2.0], "spacing_m": 0.02},
    )
    data.qvel[3:] = [0.3, 0.0, 0.0]
    box = model.body("box").id
    rows = []
    for _ in range(round(duration_s / step_s)):
        # the pose at the end of the step, as free motion has it
        mujoco.mj_step(model, data)
        force, moment = soil.step([data.qpos[:3]], [data.qpos[3:7]])
        data.xfrc_applied[box] = np.concatenate([force[0], moment[0] if moments else np.zeros(3)])
        # sand damps what bounces; Bekker's law alone does not
        data.xfrc_applied[box] -= np.concatenate([400.0 * data.qvel[:3], 2.0 * data.qvel[3:6]]) * (force[0, 2] > 0.0)
        up = 1.0 - 2.0 * (data.qpos[4] ** 2 + data.qpos[5] ** 2)
        rows.append((np.arccos(np.clip(up, -1.0, 1.0)), data.qpos[2]))
        if not np.isfinite(rows[-1]).all() or rows[-1][0] > 1.5:
            break
    return np.array(rows)


def main():
    for moments in (True, False):
        tilt, height = run(moments).T
        words = "with its moments" if moments else "forces only"
        print(f"{words}: greatest tilt {tilt.max():.3f} rad, at the end {tilt[-1]:.3f} rad, height {height[-1]:.3f} m after {len(tilt)} ms")


if __name__ == "__main__":
    main()
