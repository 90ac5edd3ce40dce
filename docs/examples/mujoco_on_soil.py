"""A robot of MuJoCo on a soil of Terraglue: the soil is a functional mock-up unit, driven here through FMPy.

    pip install mujoco fmpy matplotlib
    terraglue export soil-bekker -o soil.fmu --set soil.parameters=LETE_sand --set foot.count=4 \\
        --set foot.radius_m=0.03 --set terrain.size_m=[2,2]
    python mujoco_on_soil.py soil.fmu mujoco_on_soil.png

The robot squats three times on four legs. Each step hands the poses of the feet to the soil and takes forces and
moments back. They act in the next step: with signals one step late, a stiff soil needs short steps.
"""

import sys

import mujoco
import numpy as np
from fmpy import extract, read_model_description
from fmpy.fmi3 import FMU3Slave

STEP_S, END_S, FEET = 2e-4, 3.0, 4
CORNERS = [(0.25, 0.15), (0.25, -0.15), (-0.25, 0.15), (-0.25, -0.15)]

LEG = """
<body name="thigh{k}" pos="{x} {y} 0"><joint name="leg{k}" type="slide" axis="0 0 1" range="-0.2 0.2" damping="60"/>
  <geom type="capsule" fromto="0 0 0 0 0 -0.3" size="0.015" mass="0.5"/>
  <body name="foot{k}" pos="0 0 -0.3"><geom type="sphere" size="0.03" mass="0.2"/></body></body>"""
MODEL = f"""
<mujoco><option timestep="{STEP_S}" gravity="0 0 -9.81" integrator="implicitfast"/>
<default><geom contype="0" conaffinity="0"/></default>
<worldbody><body name="trunk" pos="0 0 0.335"><freejoint/><geom type="box" size="0.3 0.2 0.05" mass="10"/>
{"".join(LEG.format(k=k, x=x, y=y) for k, (x, y) in enumerate(CORNERS))}</body></worldbody>
<actuator>{"".join(f'<position joint="leg{k}" kp="4000"/>' for k in range(FEET))}</actuator></mujoco>"""


class Soil:
    """The FMU: poses in, forces and moments out."""

    def __init__(self, path, positions):
        description = read_model_description(path)
        self.reference = {v.name: v.valueReference for v in description.modelVariables}
        self.fmu = FMU3Slave(
            guid=description.instantiationToken,
            unzipDirectory=extract(path),
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName="soil",
        )
        self.fmu.instantiate()
        self.fmu.enterInitializationMode()
        self.place(positions, np.tile([1.0, 0, 0, 0], (FEET, 1)))
        self.fmu.exitInitializationMode()

    def place(self, positions, orientations):
        self.fmu.setFloat64([self.reference["foot.position"]], np.ravel(positions).tolist())
        self.fmu.setFloat64([self.reference["foot.orientation"]], np.ravel(orientations).tolist())

    def step(self, t, positions, orientations):
        self.place(positions, orientations)
        self.fmu.doStep(currentCommunicationPoint=t, communicationStepSize=STEP_S)
        get = lambda name: np.reshape(self.fmu.getFloat64([self.reference[name]], nValues=3 * FEET), (FEET, 3))
        return get("foot.force"), get("foot.moment")


def simulate(path):
    model = mujoco.MjModel.from_xml_string(MODEL)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    feet = [model.body(f"foot{k}").id for k in range(FEET)]
    soil = Soil(path, data.xpos[feet])
    rows = []
    for k in range(round(END_S / STEP_S)):
        t = k * STEP_S
        force, moment = soil.step(t, data.xpos[feet], data.xquat[feet])
        data.xfrc_applied[feet, :3], data.xfrc_applied[feet, 3:] = force, moment
        data.ctrl[:] = 0.03 * (1.0 - np.cos(2.0 * np.pi * t)) / 2.0
        mujoco.mj_step(model, data)
        if k % 25 == 0:
            rows.append([t, data.xpos[1][2], *(data.xpos[feet][:, 2] - 0.03), *force[:, 2]])
    return np.array(rows), data


def draw(rows, data, path):
    import matplotlib.pyplot as plt

    figure, (side, lines, forces) = plt.subplots(1, 3, figsize=(14, 4), gridspec_kw={"width_ratios": [1.1, 1, 1]})
    trunk = data.xpos[1]
    side.add_patch(plt.Rectangle((trunk[0] - 0.3, trunk[2] - 0.05), 0.6, 0.1, color="#465a78"))
    for x, z in {(round(data.xpos[3 + 2 * k][0], 4), round(data.xpos[3 + 2 * k][2], 4)) for k in range(FEET)}:
        side.plot([x, x], [z, trunk[2]], color="#465a78", lw=4)
        side.add_patch(plt.Circle((x, z), 0.03, color="#22303f"))
    side.axhspan(-0.1, 0, color="#d8c19c", zorder=0)
    side.set(xlim=(-0.5, 0.5), ylim=(-0.1, 0.5), aspect="equal", xlabel="x, m", ylabel="z, m", title="robot of MuJoCo")
    lines.plot(rows[:, 0], -1000.0 * rows[:, 2:6])
    lines.set(xlabel="t, s", ylabel="sinkage of the feet, mm", title="soil-bekker, LETE sand")
    forces.plot(rows[:, 0], rows[:, 6:10])
    forces.set(xlabel="t, s", ylabel="normal force on each foot, N", title="from the FMU")
    forces.axhline(12.8 * 9.81 / FEET, color="k", lw=0.5)
    figure.tight_layout()
    figure.savefig(path, dpi=80)


if __name__ == "__main__":
    rows, data = simulate(sys.argv[1])
    # over the last squat
    weight, carried = 12.8 * 9.81, rows[rows[:, 0] > END_S - 1.0, 6:10].sum(axis=1).mean()
    print(f"sinkage {-1000 * rows[-1, 2:6].mean():.2f} mm; the soil carries {carried:.1f} N of {weight:.1f} N")
    draw(rows, data, sys.argv[2])
