"""MuJoCo on the cases of `cargo xtask validate rigid-body`: one line per figure, `name<TAB>value<TAB>what`.

Usage: peer_mujoco.py REFERENCE_FOLDER [gait]; `gait`: the walking hexapod alone. Step 1 ms, default (soft) contacts, and contacts as stiff as the step admits.
Passive motion with both of its integrators, Euler and RK4.
"""

import csv
import math
import pathlib
import sys
import time

import mujoco
import numpy

STAND = [0.0, 0.9581921787462744, -1.3796341802638374, -1.1493543252773333]
CYCLE = 1.2
STIFF = '<default><geom solref="0.002 1" solimp="0.99 0.9999 0.0001"/></default>'


def figure(name, value, what):
    print(f"{name}\t{float(value)!r}\t{what}")


def targets(t, rows):
    blend = min(max(t - 0.5, 0.0), 1.0)
    place = (max(t - 0.5, 0.0) % CYCLE) / CYCLE * (len(rows) - 1)
    k = min(int(place), len(rows) - 2)
    part = place - k
    out = []
    for j in range(24):
        gait = (1 - part) * rows[k][j] + part * rows[k + 1][j]
        out.append(STAND[j % 4] + blend * (gait - STAND[j % 4]))
    return out


def walk(xml, rows, name):
    """Five runs: each step counts with the least of its times, as it does on our side."""
    model = mujoco.MjModel.from_xml_string(xml)
    wanted = [targets(i * 1e-3, rows) for i in range(10_000)]
    runs = [gait(model, wanted) for _ in range(5)]
    times = sorted(min(of) for of in zip(*(r[0] for r in runs)))
    _, deepest, slips, x = runs[0]
    figure(f"gait.{name}.step", 1e6 * times[5000], "CPU time of a step, least of five runs, median, µs")
    figure(f"gait.{name}.tail", times[9900] / times[5000], "99th percentile of that / median")
    figure(f"gait.{name}.penetration", 1e3 * deepest, "deepest foot after 2 s, mm")
    figure(f"gait.{name}.slip", 1e3 * sum(slips) / max(len(slips), 1), "mean speed of feet that stand, mm/s")
    figure(f"gait.{name}.x", x, "distance in 10 s, m")


def gait(model, wanted):
    data = mujoco.MjData(model)
    data.qpos[7:31] = STAND * 6
    feet = [model.geom(f"{leg}4_foot").id for leg in ("LF", "LM", "LR", "RF", "RM", "RR")]
    times, slips, deepest = [], [], 0.0
    last = [None] * 6
    for i in range(10_000):
        start = time.thread_time()
        data.ctrl[:] = wanted[i]
        mujoco.mj_step(model, data)
        times.append(time.thread_time() - start)
        for k, foot in enumerate(feet):
            x, y, z = data.geom_xpos[foot]
            stands = z < 0.03
            if i >= 2000:
                deepest = max(deepest, 0.03 - z)
                if stands and last[k]:
                    slips.append(math.hypot(x - last[k][0], y - last[k][1]) / 1e-3)
            last[k] = (x, y) if stands else None
    return times, deepest, slips, float(data.qpos[0])


def scene(gravity, bodies, friction):
    text = "".join(
        f'<body pos="0 0 {z}"><freejoint/><geom type="box" size="{x} {y} {h}" mass="{mass}" '
        f'friction="{friction} 0 0" condim="3"/></body>'
        for mass, (x, y, h), z in bodies
    )
    gx, gz = gravity
    xml = (
        f'<mujoco><option timestep="0.001" gravity="{gx} 0 {gz}" integrator="implicitfast"/><worldbody>'
        f'<geom type="plane" size="0 0 1" friction="{friction} 0 0" condim="3"/>{text}</worldbody></mujoco>'
    )
    model = mujoco.MjModel.from_xml_string(xml)
    return model, mujoco.MjData(model)


def run(model, data, until):
    while data.time < until - 1e-9:
        mujoco.mj_step(model, data)


def incline(degrees):
    a = math.radians(degrees)
    return scene((9.81 * math.sin(a), -9.81 * math.cos(a)), [(1.0, (0.1, 0.1, 0.05), 0.05)], 0.5)


INTEGRATORS = {"euler": mujoco.mjtIntegrator.mjINT_EULER, "rk4": mujoco.mjtIntegrator.mjINT_RK4}


def spin(name):
    xml = (
        '<mujoco><option timestep="0.001" gravity="0 0 0"/><worldbody><body><freejoint/>'
        '<inertial pos="0 0 0" mass="1" diaginertia="0.1 0.2 0.3"/></body></worldbody></mujoco>'
    )
    model = mujoco.MjModel.from_xml_string(xml)
    model.opt.integrator = INTEGRATORS[name]
    data = mujoco.MjData(model)
    data.qvel[3:6] = [0.01, 10.0, 0.01]
    moments = (0.1, 0.2, 0.3)
    turned = numpy.zeros(3)

    def state():
        w = data.qvel[3:6]
        mujoco.mju_rotVecQuat(turned, w * moments, data.qpos[3:7])
        return 0.5 * float(w * moments @ w), turned.copy(), float(w[1])

    e0, l0, last = state()
    energy = momentum = flips = 0.0
    for _ in range(60_000):
        mujoco.mj_step(model, data)
        e, l, rate = state()
        energy = max(energy, abs(e / e0 - 1))
        momentum = max(momentum, float(numpy.linalg.norm(l - l0) / numpy.linalg.norm(l0)))
        flips += rate * last < 0
        last = rate
    figure(f"dzhanibekov.{name}.energy", energy, "free body, 60 s: largest |ΔE|/E")
    figure(f"dzhanibekov.{name}.momentum", momentum, "the same: largest |ΔL|/L")
    figure(f"dzhanibekov.{name}.flips", flips, "sign changes of the middle rate")


def chain(folder, file, angles, reference, name):
    model = mujoco.MjModel.from_xml_path(str(folder / f"{file}.urdf"))
    model.opt.timestep = 1e-3
    model.opt.integrator = INTEGRATORS[name]
    model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    data = mujoco.MjData(model)
    data.qpos[:] = angles

    def energy():
        mujoco.mj_energyPos(model, data)
        mujoco.mj_energyVel(model, data)
        return float(data.energy.sum())

    mujoco.mj_forward(model, data)
    start, largest, change, tip = energy(), 0.0, 0.0, math.nan
    for step in range(1, 10_001):
        mujoco.mj_step(model, data)
        mujoco.mj_forward(model, data)
        change = energy() - start
        largest = max(largest, abs(change))
        if step == 1000:
            body = model.nbody - 1
            end = data.xpos[body] + data.xmat[body].reshape(3, 3) @ [0.25, 0.0, 0.0]
            tip = float(numpy.linalg.norm(end - reference))
    if data.warning[mujoco.mjtWarning.mjWARN_BADQACC].number > 0:
        # it started anew by itself
        largest = change = math.nan
    figure(f"{file}.{name}.energy", largest, "chain of eight, 10 s: largest |ΔE|, J")
    figure(f"{file}.{name}.energy_end", change, "the same: ΔE at the end, J")
    figure(f"{file}.{name}.tip", 1e3 * tip, "the same: tip at 1 s, mm from the reference")


def main():
    folder = pathlib.Path(sys.argv[1])
    with open(folder / "hexapod.xml", encoding="utf-8") as file:
        xml = file.read()
    with open(folder / "gait_tripod.csv", encoding="utf-8") as file:
        rows = [[float(x) for x in row[1:]] for row in list(csv.reader(file))[1:]]
    figure("version", int("".join(f"{int(part):03d}" for part in mujoco.__version__.split(".")[:3])), mujoco.__version__)
    walk(xml, rows, "soft")
    walk(xml.replace("<worldbody>", STIFF + "<worldbody>", 1), rows, "stiff_contacts")
    if "gait" in sys.argv[2:]:
        return
    model, data = incline(20)
    run(model, data, 5.0)
    before = data.qpos[0]
    run(model, data, 10.0)
    figure("incline.creep", 1e3 * abs(data.qpos[0] - before) / 5.0, "box on 20° with μ = 0.5: creep, mm/s")
    model, data = incline(35)
    run(model, data, 2.0)
    error = 2 * data.qpos[0] / 4.0 / 1.608844063366257 - 1
    figure("incline.acceleration", abs(error), "box on 35° with μ = 0.5: error of 2x/t²")
    for name, bodies in (
        ("stack.sink", [(1.0, (0.1, 0.1, 0.1), 0.1 + 0.2 * k) for k in range(10)]),
        ("heavy.sink", [(1.0, (0.1, 0.1, 0.1), 0.1), (1000.0, (0.1, 0.1, 0.1), 0.3)]),
    ):
        model, data = scene((0.0, -9.81), bodies, 0.6)
        start = data.qpos[-5]
        run(model, data, 5.0)
        figure(name, 1e3 * abs(start - data.qpos[-5]), "5 s: sink of the top, mm")
    for name in INTEGRATORS:
        spin(name)
        chain(folder, "chain8", [0.0, 0.2] * 4, [-1.640621154, -0.580129864, -0.919078146], name)
        hanging = [-1.0707963267948966] + [0.0] * 7
        chain(folder, "chain8_m1000", hanging, [-0.566796969, 0.0, -1.918003510], name)


main()
