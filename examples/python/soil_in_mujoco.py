"""Soil of Terraglue in the loop of MuJoCo, with forces and moments, next to the failure where the moments are dropped.

    pip install mujoco
    python examples/python/soil_in_mujoco.py

A post stands with a flat foot on sand and gets a push. MuJoCo has gravity and the dynamics, Terraglue the sand under the foot: in each step MuJoCo's pose
goes to the soil, and its wrench comes back. Force and moment are about the origin of the foot, so that is the point where `mj_applyFT` applies them. With the
moment the sole holds the post, which stands after a small swing; without it the same force has no lever arm, and the post falls over.
"""

import mujoco
import numpy as np

import terraglue

SOLE = (0.12, 0.12, 0.03)
MODEL = f"""
<mujoco>
  <option timestep="0.001" gravity="0 0 -9.81"/>
  <worldbody>
    <body name="post" pos="0 0 {SOLE[2]}">
      <freejoint/>
      <geom type="box" size="{SOLE[0]} {SOLE[1]} {SOLE[2]}" mass="4" contype="0" conaffinity="0"/>
      <geom type="sphere" pos="0 0 0.4" size="0.06" mass="6" contype="0" conaffinity="0"/>
    </body>
  </worldbody>
</mujoco>
"""
# the law of the sand has no damping of its own: N s/m, and N m s/rad
DAMPING, TURN_DAMPING = 300.0, 3.0


def run(moments, duration_s=1.5):
    """Tilt (rad) and height of the foot (m) over time; it ends where the post lies."""
    model = mujoco.MjModel.from_xml_string(MODEL)
    data = mujoco.MjData(model)
    step_s, post = model.opt.timestep, model.body("post").id
    soil = terraglue.Soil(
        [data.qpos[:3]], shape="box", half_extents_m=SOLE, module="soil-bekker", parameters="LETE_sand", step_s=step_s,
        terrain={"kind": "flat", "size_m": [2.0, 2.0], "spacing_m": 0.02},
    )
    data.qvel[3] = 0.15
    rows = []
    for _ in range(round(duration_s / step_s)):
        mujoco.mj_step(model, data)
        (force,), (moment,) = soil.step([data.qpos[:3]], [data.qpos[3:7]])
        if force[2] > 0.0:
            force = force - DAMPING * data.qvel[:3]
            moment = moment - TURN_DAMPING * data.body(post).xmat.reshape(3, 3) @ data.qvel[3:6]
        data.qfrc_applied[:] = 0.0
        mujoco.mj_applyFT(model, data, force, moment if moments else np.zeros(3), data.qpos[:3], post, data.qfrc_applied)
        upright = 1.0 - 2.0 * (data.qpos[4] ** 2 + data.qpos[5] ** 2)
        rows.append((np.arccos(np.clip(upright, -1.0, 1.0)), data.qpos[2]))
        if rows[-1][0] > 1.2:
            break
    return np.array(rows)


def main():
    for moments in (True, False):
        tilt, height = run(moments).T
        words = "with its moment" if moments else "force alone    "
        end = "it lies" if tilt[-1] > 1.2 else "it stands"
        print(f"{words}: greatest tilt {tilt.max():.4f} rad, {tilt[-1]:.4f} rad and foot at {height[-1]:.4f} m after {len(tilt)} ms: {end}")


if __name__ == "__main__":
    main()
