"""Bodies of FMUs that turn: forces off their reference point and moments, by terminals of exported robots and by maps of names."""

import csv
import json
import math

import numpy as np
import pytest

from cfmu import build, build_3
from conftest import terraglue
from fmus import export

H, STEPS = 0.001, 400
GRAVITY = [0.0, 0.0, -9.81]
HULL = {"mass": 3.0, "com": [0.1, -0.2, 0.05], "inertia": [0.2, 0.5, 0.4]}
ARM = {"mass": 1.0, "com": [0.3, 0.0, 0.02], "inertia": [0.02, 0.1, 0.09]}
# The joint in the world at the start, where hull and arm stand, and the rate of the hull's frame.
JOINT, HULL_AT, ARM_AT, SPIN = [0.4, 0.1, 0.8], [0.0, 0.0, 1.0], [0.4, 0.1, 0.8], [1.0, 2.0, -1.5]
MOTION = ["x", "y", "z", "qw", "qx", "qy", "qz", "vx", "vy", "vz", "wx", "wy", "wz"]


def link(name, of):
    xx, yy, zz = of["inertia"]
    place = " ".join(map(str, of["com"]))
    return (
        f'<link name="{name}"><inertial><origin xyz="{place}"/><mass value="{of["mass"]}"/>'
        f'<inertia ixx="{xx}" iyy="{yy}" izz="{zz}" ixy="0" ixz="0" iyz="0"/></inertial></link>'
    )


def joint(parent, child, place):
    at = " ".join(map(str, place))
    return (
        f'<joint name="ball" type="continuous"><parent link="{parent}"/><child link="{child}"/><axis xyz="0 0 1"/>'
        f'<origin xyz="{at}"/></joint>'
    )


def robot(*parts):
    return f'<robot name="r">{"".join(parts)}</robot>'


def keys(at, velocity, spin):
    return {"position_m": at, "velocity_m_s": velocity, "rotation_rate_rad_s": spin, "motor": "off"}


# The arm goes with the hull at the start.
ARM_SPEED = np.cross(SPIN, np.subtract(ARM_AT, HULL_AT)).tolist()
FREE = {"hull": keys(HULL_AT, [0.0] * 3, SPIN), "arm": keys(ARM_AT, ARM_SPEED, SPIN)}


@pytest.fixture(scope="session")
def folder(tmp_path_factory):
    """Robots of one link and of two, and the first as FMUs with and without gravity."""
    folder = tmp_path_factory.mktemp("turning")
    (folder / "hull.urdf").write_text(robot(link("hull", HULL)))
    (folder / "arm.urdf").write_text(robot(link("arm", ARM)))
    offset = np.subtract(JOINT, HULL_AT)
    (folder / "pair.urdf").write_text(robot(link("hull", HULL), link("arm", ARM), joint("hull", "arm", offset)))
    hung = {**HULL, "com": (np.array(HULL["com"]) - offset).tolist()}
    (folder / "hung.urdf").write_text(robot('<link name="world"/>', link("hull", hung), joint("world", "hull", JOINT)))
    for name, gravity, suffix in (("hull", GRAVITY, "_heavy"), ("hull", [0.0] * 3, ""), ("arm", [0.0] * 3, "")):
        own = FREE[name]
        at_rest = keys(own["position_m"], [0.0] * 3, [0.0] * 3)
        sets = {**(at_rest if suffix else own), "model": str(folder / f"{name}.urdf")}
        words = [f"robot.{key}={json.dumps(value)}" for key, value in sets.items()]
        words = [word for edit in [*words, f"world.gravity_m_s2={gravity}"] for word in ("--set", edit)]
        export("rigid-body", folder / f"{name}{suffix}.fmu", *words)
    return folder


def table(name, model, own):
    rest = "".join(f"{key} = {json.dumps(value)}\n" for key, value in own.items())
    return f'[{name}]\nmodule = "rigid-body"\nmodel = "{model}"\n{rest}'


def plug(name, fmu, body):
    return f'[{name}]\nfmu = "{fmu}.fmu"\n[{name}.bodies.{body}]\nterminal = "{body}"\n'


def glue(side_1, side_2, at=JOINT, components='["x", "y", "z"]', more=""):
    return f'[[glue]]\nside_1 = "{side_1}"\nside_2 = "{side_2}"\nat_m = {at}\ncomponents = {components}\n{more}'


def run(folder, out, text, steps=STEPS, gluing="", gravity=(0.0, 0.0, 0.0), h=H):
    """Rows of a run of `text`, glued by `iterative`."""
    path = folder / f"{out.parent.name}_{out.name}.toml"
    path.write_text(
        f'[time]\nstep_s = {h}\nduration_s = {h * steps}\n[world]\ngravity_m_s2 = {list(gravity)}\n'
        f'[gluing]\nstrategy = "iterative"\ntolerance = 1e-10\n{gluing}[recording]\nevery_steps = 1\n{text}'
    )
    done = terraglue("run", path, "--csv", "--quiet", "--out", out)
    assert done.returncode == 0, done.stderr
    rows = list(csv.DictReader((out / "variables.csv").open()))
    assert len(rows) == steps + 1
    names = [name for name in rows[0] if number(rows[0][name])]
    return [{name: float(row[name]) for name in names} for row in rows]


def number(text):
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False


def same(rows, others, names, bound=1e-10):
    """The largest difference of columns with these pairs of names, and that it is at most `bound`."""
    worst = max(
        abs(row[own] - other[its]) for row, other in zip(rows, others, strict=True) for own, its in names
    )
    assert worst <= bound, worst
    return worst


def turn(q):
    w, x, y, z = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def momenta(row, prefix, of):
    """Momentum and angular momentum about the world's origin."""
    place, q, v, w = (np.array([row[f"{prefix}.{n}"] for n in names]) for names in (MOTION[:3], MOTION[3:7], MOTION[7:10], MOTION[10:]))
    r = turn(q)
    arm = r @ of["com"]
    push = of["mass"] * (v + np.cross(w, arm))
    return push, np.cross(place + arm, push) + r @ np.diag(of["inertia"]) @ r.T @ w


def test_an_fmu_that_hangs_beside_its_centre_of_mass_swings_like_the_module_on_a_ball_joint(folder, tmp_path):
    hung = run(folder, tmp_path / "fmu", plug("a", "hull_heavy", "hull") + glue("a.hull", "world"))
    ball = 'joint_kind = { ball = "spherical" }\n'
    whole = run(folder, tmp_path / "module", table("a", "hung.urdf", {"motor": "off"}) + ball, gravity=GRAVITY)
    same(hung, whole, [(f"a.hull.{n}", f"a.hull.{n}") for n in ("qw", "qx", "qy", "qz", "wx", "wy", "wz")])
    assert abs(hung[-1]["a.hull.qw"]) < 0.95, "it has swung"


def test_two_fmus_on_a_ball_joint_move_like_one_robot_and_keep_their_momenta(folder, tmp_path):
    text = plug("a", "hull", "hull") + plug("b", "arm", "arm") + glue("a.hull", "b.arm")
    fmus = run(folder, tmp_path / "fmus", text)
    whole = run(folder, tmp_path / "whole", table("a", "pair.urdf", FREE["hull"]) + 'joint_kind = { ball = "spherical" }\n')
    # poses: rates of the robot know the gap of its joint, 1e-12 m, over the step
    names = [(f"{sub}.{body}.{n}", f"a.{body}.{n}") for sub, body in (("a", "hull"), ("b", "arm")) for n in MOTION[:7]]
    same(fmus, whole, names)
    total = [
        np.concatenate(momenta(row, "a.hull", HULL)) + np.concatenate(momenta(row, "b.arm", ARM)) for row in fmus
    ]
    assert np.abs(np.array(total) - total[0]).max() < 1e-10 * np.abs(total[0]).max()
    apart = np.subtract([fmus[-1][f"a.hull.w{k}"] for k in "xyz"], [fmus[-1][f"b.arm.w{k}"] for k in "xyz"])
    assert np.abs(apart).max() > 0.1, "they turn against each other"


@pytest.mark.parametrize("components", ['["x", "y", "z"]', '["x", "y", "z", "rx", "ry", "rz"]'])
def test_exported_robots_that_are_plugged_together_turn_like_the_modules(folder, tmp_path, components):
    modules = "".join(table(n, f"{body}.urdf", FREE[body]) for n, body in (("a", "hull"), ("b", "arm")))
    fmus = plug("a", "hull", "hull") + plug("b", "arm", "arm")
    mixed = plug("a", "hull", "hull") + table("b", "arm.urdf", FREE["arm"])
    joined = glue("a.hull", "b.arm", components=components)
    wanted = run(folder, tmp_path / "modules", modules + joined)
    names = [(f"{body}.{n}",) * 2 for body in ("a.hull", "b.arm") for n in MOTION]
    for name, text in (("fmus", fmus), ("mixed", mixed)):
        same(run(folder, tmp_path / name, text + joined), wanted, names)
    assert abs(wanted[-1]["a.hull.qw"]) < 0.95


def test_a_map_of_names_with_the_point_of_the_force_is_the_terminal(folder, tmp_path):
    def mapped(point):
        lists = {"position": MOTION[:3], "orientation": MOTION[3:7], "velocity": MOTION[7:10], "angular_velocity": MOTION[10:]}
        lists |= {"force": [f"force_{k}" for k in "xyz"], "moment": [f"moment_{k}" for k in "xyz"]}
        text = "".join(f"{key} = {json.dumps([f'hull.{n}' for n in names])}\n" for key, names in lists.items())
        return f'[a]\nfmu = "hull_heavy.fmu"\n[a.bodies.hull]\n{text}{point}' + glue("a.hull", "world")

    names = [(f"a.hull.{n}",) * 2 for n in MOTION]
    wanted = run(folder, tmp_path / "terminal", plug("a", "hull_heavy", "hull") + glue("a.hull", "world"), steps=50)
    for k, point in enumerate([f"force_at = {HULL['com']}\n", 'force_at = ["hull.force_at_x", "hull.force_at_y", "hull.force_at_z"]\n']):
        same(run(folder, tmp_path / f"point{k}", mapped(point), steps=50), wanted, names, 0.0)
    # a force whose point is not given acts elsewhere
    other = run(folder, tmp_path / "origin", mapped(""), steps=50)
    with pytest.raises(AssertionError):
        same(other, wanted, names)


# A rotor on a torsion spring and damper, backward Euler: angle, rate, quaternion, moment, inertia, stiffness, damping.
ROTOR = [("phi", "output"), ("w", "output"), ("qw", "output"), ("qx", "output"), ("qy", "output"), ("qz", "output"), ("m", "input")]
ROTOR_STEP = (
    "double I = r[7], k = r[8], d = r[9]; r[1] = (I * r[1] + h * (r[6] - k * r[0])) / (I + h * d + h * h * k);"
    "r[0] += h * r[1]; r[2] = cos(r[0] / 2); r[5] = sin(r[0] / 2);"
)
ROTOR_BODY = 'orientation = ["qw", "qx", "qy", "qz"]\nangular_velocity = ["", "", "w"]\nmoment = ["", "", "m"]\n'
ANGLE = 0.7


def rotor(folder, name, inertia, stiffness, damping, odd="", **others):
    start = {"phi": ANGLE, "qw": math.cos(ANGLE / 2), "qz": math.sin(ANGLE / 2), **others}
    reals = [(n, causality, start.get(n, 0.0), "") for n, causality in ROTOR]
    reals += [("I", "parameter", inertia, ""), ("k", "parameter", stiffness, ""), ("d", "parameter", damping, "")]
    return build(folder, name, reals, ROTOR_STEP + odd)


def rotors(folder, body=ROTOR_BODY, left="left", components='["rz"]'):
    sides = "".join(f'[{n}]\nfmu = "{fmu}.fmu"\n[{n}.bodies.shaft]\n{body}' for n, fmu in (("left", left), ("right", "right")))
    return f'{sides}[[glue]]\nside_1 = "left.shaft"\nside_2 = "right.shaft"\ncomponents = {components}\n'


@pytest.fixture(scope="session")
def shafts(tmp_path_factory):
    folder = tmp_path_factory.mktemp("shafts")
    rotor(folder, "left", 1.0, 40.0, 0.3)
    rotor(folder, "right", 10.0, 1000.0, 0.1)
    rotor(folder, "long", 1.0, 40.0, 0.3, qw=1.1)
    rotor(folder, "nan", 1.0, 40.0, 0.3, odd="if (t > 0.0005) r[3] = NAN;")
    return folder


def test_two_rotors_on_one_shaft_are_one_rotor_with_the_sums(shafts, tmp_path):
    rows = run(shafts, tmp_path / "out", rotors(shafts), steps=2000)
    inertia, stiffness, damping = 11.0, 1040.0, 0.4
    phi, w, worst = ANGLE, 0.0, 0.0
    for row in rows[1:]:
        w = (inertia * w - H * stiffness * phi) / (inertia + H * damping + H * H * stiffness)
        phi += H * w
        worst = max(worst, abs(row["left.phi"] - phi), abs(row["right.phi"] - phi))
    assert worst < 1e-10
    assert min(row["left.phi"] for row in rows) < -0.3


def test_a_torsion_spring_between_two_rotors_swings_as_both_solved_at_once(shafts, tmp_path):
    inertia, k, d, rate = np.array([1.0, 3.0]), 1e3, 1.0, 1e-3
    for name, own, w in (("one", inertia[0], rate), ("two", inertia[1], 0.0)):
        rotor(shafts, name, own, 0.0, 0.0, phi=0.0, qw=1.0, qz=0.0, w=w)
    text = rotors(shafts).replace("left.fmu", "one.fmu").replace("right.fmu", "two.fmu")
    rows = run(shafts, tmp_path / "out", text + f"compliance_m_n = {1 / k}\ndamping_n_s_m = {d}\n")
    shared = H * d + H * H * k
    matrix = np.diag(inertia) + shared * np.array([[1.0, -1.0], [-1.0, 1.0]])
    phi, w, worst, apart = np.zeros(2), np.array([rate, 0.0]), 0.0, 0.0
    for row in rows[1:]:
        pull = H * k * (phi[0] - phi[1])
        w = np.linalg.solve(matrix, inertia * w + [-pull, pull])
        phi = phi + H * w
        worst = max(worst, abs(row["left.phi"] - phi[0]), abs(row["right.phi"] - phi[1]))
        apart = max(apart, phi[0] - phi[1])
    # gaps are 2·sin of half the angle: its share of 3e-11 stays below
    assert apart > 1e-5 and worst < 1e-10 * apart, (worst, apart)


def refused(folder, tmp_path, text):
    path = folder / f"{tmp_path.name}.toml"
    path.write_text(f'[time]\nstep_s = 0.001\nduration_s = 0.002\n[gluing]\nstrategy = "iterative"\n{text}')
    done = terraglue("run", path, "--quiet", "--out", tmp_path / "out")
    assert done.returncode in (1, 2), done.stderr
    return done.stderr


@pytest.mark.parametrize(
    ("body", "components", "says"),
    [
        ('position = ["phi"]\nforce = ["m"]\n', '["rz"]', ["`shaft`", "no `moment` is mapped"]),
        (ROTOR_BODY, '["x"]', ["`shaft`", "no `force` is mapped"]),
        (ROTOR_BODY, '["rx"]', ["`shaft`", "about [1.0, 0.0, 0.0]", "no `moment` is mapped"]),
        (ROTOR_BODY.replace('"qw", ', ""), '["rz"]', ["`orientation` takes four names", "w, x, y, z"]),
        (ROTOR_BODY.replace("orientation", "attitude"), '["rz"]', ["has no key `attitude`", "position, orientation, velocity, angular_velocity,"]),
        ('moment = ["", "", "m"]\n', '["rz"]', ["`moment` belongs to a body that turns", "`orientation`"]),
        (ROTOR_BODY.replace("moment", "force").replace("orientation", 'position = ["", "", "phi"]\norientation'), '["z"]', ["takes no `moment`", "leave `orientation` out"]),
        (ROTOR_BODY + "force_at = [0.0, 1.0]\n", '["rz"]', ["`force_at` takes three numbers"]),
        (ROTOR_BODY.replace('"qz"', '"qy2"'), '["rz"]', ["no f64 variable `qy2`", "did you mean"]),
        (ROTOR_BODY.replace('"m"', '"w"'), '["rz"]', ["`w` cannot be set between steps"]),
    ],
)
def test_what_makes_no_body_is_refused_with_the_reason(shafts, tmp_path, body, components, says):
    text = refused(shafts, tmp_path, rotors(shafts, body, components=components))
    assert all(word in " ".join(text.split()) for word in says), text


@pytest.mark.parametrize(("fmu", "says"), [("long", "of length 1.1"), ("nan", "is NaN (`orientation`)")])
def test_a_quaternion_that_is_none_stops_the_run_by_the_name_of_the_body(shafts, tmp_path, fmu, says):
    text = " ".join(refused(shafts, tmp_path, rotors(shafts, left=fmu)).split())
    assert "`shaft`" in text and says in text, text


# A ball of 2 kg and 0.3 kg m² that falls, an FMU with derivatives: place, velocity and rate, quaternion, accelerations a and b, inputs.
BALL = [("p", "output", "", (3,)), ("v", "output", "", (6,)), ("q", "output", "", (4,))]
BALL += [(f"{kind}{k}", "output", "", ()) for kind in ("a", "b") for k in "xyz"]
BALL += [(f"{kind}{k}", "input", "0", ()) for kind in ("f", "m") for k in "xyz"]
BALL_CALC = (
    "for (int k = 0; k < 3; k++) { v[4 + k][0] = v[10 + k][0] / 2 - (k == 2 ? 9.81 : 0); v[7 + k][0] = v[13 + k][0] / 0.3; }"
)
BALL_STEP = BALL_CALC + (
    "for (int k = 0; k < 6; k++) v[2][k] += h * v[4 + k][0]; for (int k = 0; k < 3; k++) v[1][k] += h * v[2][k];"
    "double a = h * v[2][3] / 2, b = h * v[2][4] / 2, c = h * v[2][5] / 2, *q = v[3], w = q[0], x = q[1], y = q[2], z = q[3];"
    "double o[4] = {w - a * x - b * y - c * z, x + a * w + b * z - c * y, y - a * z + b * w + c * x, z + a * y - b * x + c * w};"
    "double s = sqrt(o[0] * o[0] + o[1] * o[1] + o[2] * o[2] + o[3] * o[3]); for (int k = 0; k < 4; k++) q[k] = o[k] / s;"
)
BALL_SLOPES = r"""
static double slope(unsigned z, unsigned k) { return z - 4 == k - 10 ? (z < 7 ? 0.5 : 1 / 0.3) : 0; }
int fmi3GetDirectionalDerivative(Fmu *u, const unsigned *z, size_t n, const unsigned *k, size_t m, const double *s, size_t p, double *x, size_t q) {
    for (size_t i = 0; i < n; i++) { x[i] = 0; for (size_t j = 0; j < m; j++) x[i] += slope(z[i], k[j]) * s[j]; } return 0; }
int fmi3GetAdjointDerivative(Fmu *u, const unsigned *z, size_t n, const unsigned *k, size_t m, const double *s, size_t p, double *x, size_t q) {
    for (size_t j = 0; j < m; j++) { x[j] = 0; for (size_t i = 0; i < n; i++) x[j] += slope(z[i], k[j]) * s[i]; } return 0; }"""
KINDS = {"none": "", "directional": 'providesDirectionalDerivatives="true"', "adjoint": 'providesAdjointDerivatives="true"'}


def hanging_ball(folder, kind, out):
    """A ball that hangs off its centre, at the corner of a cube: rows and evaluations a step."""
    build_3(folder, kind, BALL, BALL_STEP, "v[3][0] = 1; v[2][0] = 0.6; v[2][1] = -0.8; v[2][5] = 2;", BALL_SLOPES, KINDS[kind], calc=BALL_CALC)
    arrays = {"position": ("p", 1, 3), "velocity": ("v", 1, 3), "angular_velocity": ("v", 4, 6), "orientation": ("q", 1, 4)}
    text = "".join(f"{key} = {json.dumps([f'{n}[{k}]' for k in range(a, b + 1)])}\n" for key, (n, a, b) in arrays.items())
    singles = {"acceleration": "a", "angular_acceleration": "b", "force": "f", "moment": "m"}
    text += "".join(f"{key} = {json.dumps([n + k for k in 'xyz'])}\n" for key, n in singles.items())
    text = f'[a]\nfmu = "{kind}.fmu"\n[a.bodies.ball]\n{text}' + glue("a.ball", "world", [0.4, 0.3, 0.2])
    rows = run(folder, out, text, gluing='jacobian = "directional"\n' if kind != "none" else "")
    return rows, json.loads((out / "summary.json").read_text())["evaluations_mean"]


def test_derivatives_of_a_turning_body_are_its_jacobian(tmp_path):
    told = {kind: hanging_ball(tmp_path, kind, tmp_path / kind) for kind in KINDS}
    names = [(name,) * 2 for name in told["none"][0][0] if name.startswith(("a.p[", "a.q["))]
    assert len(names) == 7
    for kind in ("directional", "adjoint"):
        same(told[kind][0], told["none"][0], names)
        assert told[kind][1] <= 4.0, told[kind][1]
    assert told["adjoint"][1] == told["directional"][1]
    # the point of the joint stays where it is
    q, p = (np.array([told["none"][0][-1][f"a.{n}[{k + 1}]"] for k in range(c)]) for n, c in (("q", 4), ("p", 3)))
    assert np.abs(p + turn(q) @ [0.4, 0.3, 0.2] - [0.4, 0.3, 0.2]).max() < 1e-11
    assert abs(q[0]) < 0.95


def apart(folder, more, arm=None):
    """A pair glued by the link that hangs on its joint to an arm that stands 5 cm off; places at the start and after a tenth of a second."""
    (folder / "pair.urdf").write_text(robot(link("hull", HULL), link("arm", ARM), joint("hull", "arm", np.subtract(JOINT, HULL_AT))))
    (folder / "arm.urdf").write_text(robot(link("arm", ARM)))
    off = arm or np.add(ARM_AT, [0.03, 0.0, 0.04]).tolist()
    (folder / "s.toml").write_text(
        "[time]\nstep_s = 0.001\nduration_s = 0.1\n[world]\ngravity_m_s2 = [0.0, 0.0, 0.0]\n"
        f'[pair]\nmodule = "rigid-body"\nmodel = "pair.urdf"\nmotor = "off"\nposition_m = {HULL_AT}\n'
        f'[other]\nmodule = "rigid-body"\nmodel = "arm.urdf"\nmotor = "off"\nposition_m = {off}\n'
        f'[gluing]\nstrategy = "iterative"\n[[glue]]\nside_1 = "pair.arm"\nside_2 = "other.arm"\ncomponents = ["x", "y", "z"]\n{more}'
    )
    done = terraglue("run", "s.toml", "--csv", "--quiet", "--out", "out", cwd=folder)
    rows = list(csv.DictReader((folder / "out/variables.csv").open())) if done.returncode == 0 else []
    place = lambda row, body: np.array([float(row[f"{body}.{axis}"]) for axis in "xyz"])
    return done, [{body: place(row, body) for body in ("pair.hull", "pair.arm", "other.arm")} for row in rows]


def test_a_gap_is_closed_by_moving_the_free_body_that_the_glued_one_hangs_on(tmp_path):
    done, _ = apart(tmp_path, "")
    assert done.returncode == 2 and "0.0500 m apart" in done.stderr and "close" in done.stderr, done.stderr
    done, rows = apart(tmp_path, 'close = "project"\n')
    assert done.returncode == 0, done.stderr
    # the pair has moved as a whole, nothing has been accelerated by it
    assert rows[0]["pair.hull"] == pytest.approx(np.add(HULL_AT, [0.03, 0.0, 0.04]), abs=1e-9)
    for row in (rows[0], rows[-1]):
        assert row["pair.arm"] == pytest.approx(row["other.arm"], abs=1e-9)
    assert rows[-1]["pair.hull"] == pytest.approx(rows[0]["pair.hull"], abs=1e-9)
    # no gap, no way
    done, rows = apart(tmp_path, 'close = "project"\n', ARM_AT)
    assert rows[0]["pair.hull"] == pytest.approx(HULL_AT, abs=1e-12)
    for more in ('ramp_s = 0.5\nclose = "project"\n', 'close = "proyect"\n'):
        done, _ = apart(tmp_path, more)
        assert done.returncode == 2 and "close" in done.stderr, done.stderr
