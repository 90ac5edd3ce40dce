"""Direct feed-through output by output: an output beside those of a loop neither delays the loop nor changes what its FMUs are given."""

import csv
import json
import zipfile

import pytest
from cfmu import MOTION, build, build_3
from conftest import terraglue

MASS = [("f", "input", -10.0, ""), ("x", "output", 0.1, ""), ("v", "output", 0.0, ""), ("a", "output", -10.0, "")]
SPRING = [("x", "input", 0.1, ""), ("f", "output", -10.0, "")]
GAIN = [("u", "input", 0.0, ""), ("y", "output", 0.0, "")]
EXCHANGES = ["", 'order = "jacobi"', 'extrapolate = "linear"', 'order = "jacobi"\nextrapolate = "linear"', 'order = "iterate"']


@pytest.fixture(scope="module")
def parts(tmp_path_factory):
    folder = tmp_path_factory.mktemp("parts")
    build(folder, "plain", MASS[:3], MOTION, depends="")
    build(folder, "mass", MASS, MOTION + " r[3] = r[0];", depends={"x": "", "v": "", "a": "1"})
    build(folder, "spring", SPRING, "r[1] = -100.0 * r[0];", depends="1")
    build(folder, "display", GAIN, "r[1] = r[0];", depends="1")
    # a motor with friction, exact under a torque that is held, and a controller that integrates along the line of its input
    motor = [("u", "input", 0.0, ""), ("w", "output", 0.0, ""), ("a", "output", 0.0, "")]
    move = "double e = exp(-h); r[1] = r[1] * e + r[0] * (1 - e);"
    build(folder, "plain_motor", motor[:2], move, depends="")
    build(folder, "motor", motor, move + " r[2] = r[0] - r[1];", depends={"w": "", "a": "1"})
    controller = [("w", "input", 0.0, ""), ("u", "output", 0.0, ""), ("sum", "local", 0.0, ""), ("last", "local", 0.0, "")]
    control = "double e = 10.0 - r[0]; r[2] += 0.5 * h * (e + r[3]); r[3] = e; r[1] = 4.0 * e + 20.0 * r[2];"
    build(folder, "controller", controller, control, depends="1")
    return folder


def run(folder, step, tables, connections):
    text = f"[time]\nstep_s = {step}\nduration_s = 2.0\n"
    text += "".join(f'[{name}]\nfmu = "{fmu}.fmu"\n' for name, fmu in tables.items())
    text += "".join(f'[[connect]]\nfrom = "{a}"\nto = "{b}"\n{how}\n' for a, b, how in connections)
    (folder / "s.toml").write_text(text)
    done = terraglue("run", "s.toml", "--csv", "--quiet", "--out", "out", cwd=folder)
    assert done.returncode == 0, done.stderr
    notes = json.loads((folder / "out/exchange.json").read_text())["connections"]
    return list(csv.DictReader((folder / "out/variables.csv").open())), {n["to"]: n for n in notes}


def only(rows, names):
    return [[row[name] for name in names] for row in rows]


@pytest.mark.parametrize("how", EXCHANGES)
def test_an_acceleration_beside_a_loop_changes_no_bit(parts, how):
    loop = [("mass.x", "spring.x", how if "extra" not in how or "jacobi" in how else ""), ("spring.f", "mass.f", how)]
    names = ["mass.x", "mass.v", "spring.f"]
    expected, notes = run(parts, 0.01, {"mass": "plain", "spring": "spring"}, loop)
    tables = {"mass": "mass", "spring": "spring", "display": "display"}
    unconnected, same = run(parts, 0.01, tables, loop)
    assert only(unconnected, names) == only(expected, names)
    assert all(same[to]["delay"] == note["delay"] for to, note in notes.items())
    for other in ("", how):
        rows, same = run(parts, 0.01, tables, loop + [("mass.a", "display.u", other)])
        assert only(rows, names) == only(expected, names)
        assert all(same[to]["delay"] == note["delay"] for to, note in notes.items())


@pytest.mark.parametrize("how", EXCHANGES)
def test_an_acceleration_of_a_motor_changes_no_bit_of_its_control(parts, how):
    loop = [("motor.w", "control.w", how if "extra" not in how or "jacobi" in how else ""), ("control.u", "motor.u", how)]
    names = ["motor.w", "control.u"]
    expected, _ = run(parts, 0.01, {"control": "controller", "motor": "plain_motor"}, loop)
    tables = {"control": "controller", "motor": "motor", "display": "display"}
    assert only(run(parts, 0.01, tables, loop)[0], names) == only(expected, names)
    for other in ("", how):
        rows, _ = run(parts, 0.01, tables, loop + [("motor.a", "display.u", other)])
        assert only(rows, names) == only(expected, names)


def test_a_chain_with_a_way_back_is_not_delayed(parts, tmp_path):
    # the way back is integrated, or seen at once by another output than that of the chain
    head = [("u", "input", 0.0, ""), ("back", "input", 0.0, ""), ("y", "output", 0.0, ""), ("z", "output", 0.0, "")]
    build(tmp_path, "gain", GAIN, "r[1] = 2.0 * r[0];", depends="1")
    build(tmp_path, "clock", [("y", "output", 0.0, "")], "r[0] = t + h;", depends="")
    tables = {"z_clock": "clock", "c_head": "head", "b": "gain", "a": "gain"}
    chain = [("z_clock.y", "c_head.u", ""), ("c_head.y", "b.u", ""), ("b.y", "a.u", ""), ("a.y", "c_head.back", "")]
    for step, of_z in (("r[3] += h * r[1];", ""), ("r[3] = r[1];", "2")):
        build(tmp_path, "head", head, "r[2] = r[0]; " + step, depends={"y": "1", "z": of_z})
        rows, notes = run(tmp_path, 0.1, tables, chain)
        assert all(float(r["a.y"]) == pytest.approx(4 * float(r["t_s"]), abs=1e-12) for r in rows)
        assert [notes[to]["delay"] for to in ("c_head.u", "b.u", "a.u", "c_head.back")] == ["0", "0", "0", "1"]


def test_an_acceleration_in_the_loop_is_a_loop(parts):
    # a damper of the acceleration: the force follows it at once, and it follows the force at once
    loop = [("mass.a", "display.u", ""), ("display.y", "mass.f", "")]
    _, notes = run(parts, 0.01, {"mass": "mass", "display": "display"}, loop)
    assert {n["delay"] for n in notes.values()} == {"1"}


def refused(folder, text):
    (folder / "s.toml").write_text(text)
    return terraglue("run", "s.toml", "--out", "out", cwd=folder)


WHOLE = """<ScalarVariable name="n_in" valueReference="0" causality="input" variability="discrete"><Integer start="0"/></ScalarVariable>
<ScalarVariable name="n" valueReference="1" causality="output" variability="discrete"><Integer/></ScalarVariable>
<ScalarVariable name="on_in" valueReference="0" causality="input" variability="discrete"><Boolean start="false"/></ScalarVariable>
<ScalarVariable name="on" valueReference="1" causality="output" variability="discrete"><Boolean/></ScalarVariable>"""


def count(folder, name, more, instead):
    fmu = build(folder, name, [("seen", "output", 0.0, "")], "", others=WHOLE, more=more, instead=instead)
    described(fmu, b"</Outputs>", b'<Unknown index="3"/><Unknown index="5"/></Outputs>')


def counter(folder):
    """An FMU with n = n_in + 1 and on = not on_in, at once."""
    more = "int fmi2GetInteger(Fmu *u, const unsigned *r, size_t n, int *x) { u->i[1] = u->i[0] + 1; while (n--) x[n] = u->i[r[n]]; return 0; }\n"
    more += "int fmi2GetBoolean(Fmu *u, const unsigned *r, size_t n, int *x) { u->b[1] = !u->b[0]; while (n--) x[n] = u->b[r[n]]; return 0; }\n"
    count(folder, "count", more, ("fmi2GetInteger", "fmi2GetBoolean"))


def described(fmu, old, new):
    """Changes the description of an FMU."""
    with zipfile.ZipFile(fmu) as archive:
        entries = {i.filename: archive.read(i) for i in archive.infolist()}
    entries["modelDescription.xml"] = entries["modelDescription.xml"].replace(old, new)
    with zipfile.ZipFile(fmu, "w") as archive:
        [archive.writestr(entry, data) for entry, data in entries.items()]


@pytest.mark.parametrize("end", ["n", "on"])
def test_discrete_values_are_not_iterated(tmp_path, end):
    counter(tmp_path)
    text = f'[time]\nduration_s = 0.1\n[a]\nfmu = "count.fmu"\n[b]\nfmu = "count.fmu"\n[[connect]]\nfrom = "a.{end}"\nto = "b.{end}_in"\norder = "iterate"\n'
    done = refused(tmp_path, text)
    assert done.returncode == 2 and "s.toml:10" in done.stderr, done.stderr
    assert f"`a.{end}`" in done.stderr and 'leave `order = "iterate"`' in done.stderr


def test_discrete_values_are_passed_while_fmus_initialise(tmp_path):
    # names against the order of the chain; the last one keeps what it had at the end of its initialisation
    counter(tmp_path)
    keep = "int fmi2ExitInitializationMode(Fmu *u) { u->i[2] = u->i[0]; u->b[2] = u->b[0]; return 0; }\n"
    keep += "int fmi2GetReal(Fmu *u, const unsigned *r, size_t n, double *x) { *x = u->i[2] + 0.25 * u->b[2]; return 0; }\n"
    count(tmp_path, "keeps", keep, ("fmi2ExitInitializationMode", "fmi2GetReal"))
    chain = ["d", "c", "b", "a"]
    text = "[time]\nstep_s = 0.1\nduration_s = 0.2\n"
    text += "".join(f'[{n}]\nfmu = "{"keeps" if n == "a" else "count"}.fmu"\n' for n in chain)
    text += "".join(f'[[connect]]\nfrom = "{x}.{v}"\nto = "{y}.{v}_in"\norder = "jacobi"\n' for x, y in zip(chain, chain[1:]) for v in ("n", "on"))
    (tmp_path / "s.toml").write_text(text)
    done = terraglue("run", "s.toml", "--csv", "--quiet", "--out", "out", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    rows = list(csv.DictReader((tmp_path / "out/variables.csv").open()))
    # 1, 2, 3 and true, false, true
    assert float(rows[-1]["a.seen"]) == 3.25, rows


def test_only_those_in_a_loop_need_a_state(parts, tmp_path):
    # a display behind the loop, and one behind that: each makes one step, with the solved values
    reals = [("u", "input", 0.0, ""), ("y", "output", 0.0, ""), ("steps", "output", 0.0, "")]
    fmu = build(tmp_path, "forgets", reals, "r[1] = r[0]; r[2] += 1;", depends="1")
    described(fmu, b'canGetAndSetFMUstate="true"', b"")
    tables = {"mass": str(parts / "mass"), "spring": str(parts / "spring"), "a": "forgets", "b": "forgets"}
    loop = [("mass.x", "spring.x", 'order = "iterate"'), ("spring.f", "mass.f", 'order = "iterate"')]
    rows, notes = run(tmp_path, 0.01, tables, loop + [("mass.x", "a.u", ""), ("a.y", "b.u", "")])
    assert all(row["b.y"] == row["mass.x"] for row in rows[1:]) and float(rows[-1]["b.steps"]) == 200
    assert {n["delay"] for n in notes.values()} == {"0"}
    # one in the loop needs it
    loop = [("mass.x", "a.u", ""), ("a.y", "spring.x", ""), ("spring.f", "mass.f", 'order = "iterate"')]
    text = "[time]\nduration_s = 0.1\n" + "".join(f'[{name}]\nfmu = "{fmu}.fmu"\n' for name, fmu in tables.items())
    done = refused(tmp_path, text + "".join(f'[[connect]]\nfrom = "{x}"\nto = "{y}"\n{how}\n' for x, y, how in loop))
    assert done.returncode == 2 and "`a` cannot save its state" in done.stderr, done.stderr


def test_an_unsolved_loop_is_named(tmp_path):
    build(tmp_path, "flips", [("u", "input", 1.0, ""), ("y", "output", 0.0, "")], "r[1] = t < 0.15 ? 0.0 : r[0] > 0 ? -1.0 : 1.0;", depends="1")
    text = '[time]\nstep_s = 0.1\nduration_s = 0.5\n[a]\nfmu = "flips.fmu"\n[b]\nfmu = "flips.fmu"\n'
    text += "".join(f'[[connect]]\nfrom = "{x}.y"\nto = "{y}.u"\norder = "iterate"\n' for x, y in ("ab", "ba"))
    # b only passes on what a makes
    build(tmp_path, "same", [("u", "input", 1.0, ""), ("y", "output", 0.0, "")], "r[1] = r[0];", depends="1")
    done = refused(tmp_path, text.replace('[b]\nfmu = "flips.fmu"', '[b]\nfmu = "same.fmu"'))
    assert done.returncode == 1, done.stderr
    for part in ("the loop of a, b was not solved", "t = 0.2 s", "a.y → b.u, b.y → a.u", "off by", "leave `order"):
        assert part in done.stderr, (part, done.stderr)
    assert "gluing" not in done.stderr, done.stderr


def test_a_loop_without_a_start_is_named(tmp_path):
    # values that jump have no derivatives
    now = "int fmi2GetReal(Fmu *u, const unsigned *r, size_t n, double *x) { u->r[1] = u->r[0] > 0 ? -1.0 : 1.0; while (n--) x[n] = u->r[r[n]]; return 0; }\n"
    build(tmp_path, "flips", GAIN, "", more=now, depends="1", instead=("fmi2GetReal",))
    text = '[time]\nduration_s = 0.1\n[a]\nfmu = "flips.fmu"\n[[connect]]\nfrom = "a.y"\nto = "a.u"\n'
    done = refused(tmp_path, text)
    assert done.returncode != 0 and "the loop of connections a.y → a.u has no solution at the start" in done.stderr, done.stderr


def last_row(folder, text):
    (folder / "s.toml").write_text("[time]\nstep_s = 0.1\nduration_s = 0.5\n" + text)
    done = terraglue("run", "s.toml", "--csv", "--explain", "--out", "out", cwd=folder)
    assert done.returncode == 0, done.stderr
    return list(csv.DictReader((folder / "out/variables.csv").open()))[-1], done.stdout


def test_isolated_fmus_give_their_derivatives_to_a_loop(tmp_path):
    reals = [("u", "input", 0.0, ""), ("y", "output", 0.0, ""), ("trials", "output", 0.0, "")]
    step = "static double trials; r[2] = ++trials; r[1] = {};"
    slope = "int fmi2GetDirectionalDerivative(Fmu *u, const unsigned *z, size_t n, const unsigned *k, size_t m, const double *s, double *x)"
    for name, right, derivative in (("a", "2.0 + sin(t) - 3.0 * r[0]", -3), ("b", "cos(r[0])", "-sin(u->r[0])")):
        more = slope + f"{{ while (n--) x[n] = z[n] == 1 ? ({derivative}) * s[0] : 0; return 0; }}"
        flags = 'providesDirectionalDerivative="true"'
        build(tmp_path, name, reals, step.format(right), more=more, flags=flags, depends={"y": "1", "trials": ""})
    loop = "".join(f'[[connect]]\nfrom = "{x}.y"\nto = "{y}.u"\norder = "iterate"\n' for x, y in ("ab", "ba"))
    inside, apart = (f'[a]\nfmu = "a.fmu"\n{more}[b]\nfmu = "b.fmu"\n{more}{loop}' for more in ("", "isolate = true\n"))
    row, text = last_row(tmp_path, inside)
    assert "by Newton's steps with directional derivatives" in text, text
    other, text = last_row(tmp_path, apart)
    assert other == row and "by Newton's steps" in text
    described(tmp_path / "b.fmu", b'providesDirectionalDerivative="true"', b"")
    slow, text = last_row(tmp_path, inside)
    assert "without derivatives, which `b` does not have" in text and float(slow["a.trials"]) > float(row["a.trials"])


def test_arrays_give_their_derivatives_to_a_loop(tmp_path):
    # y = c + A u with gains of 3 and 4: Newton needs one trial, and one that confirms it
    calc = "v[2][0] = 1 - 3 * v[1][0] + v[1][1]; v[2][1] = 2 + 4 * v[1][0] - v[1][1];"
    more = """int fmi3GetDirectionalDerivative(Fmu *u, const unsigned *z, size_t n, const unsigned *k, size_t m, const double *s, size_t ns, double *x,
    size_t nx) { if (n != 1 || *z != 2 || m != 1 || *k != 1 || ns != 2 || nx != 2) return no(u, "of whole arrays only");
    x[0] = -3 * s[0] + s[1]; x[1] = 4 * s[0] - s[1]; return 0; }"""
    reals = [("u", "input", "0 0", [2]), ("y", "output", None, [2]), ("trials", "output", None, [])]
    step = "static double trials; v[3][0] = ++trials;"
    build_3(tmp_path, "array", reals, step, calc=calc, more=more, flags='providesDirectionalDerivatives="true"')
    text = '[a]\nfmu = "array.fmu"\n[[connect]]\nfrom = "a.y"\nto = "a.u"\norder = "iterate"\n'
    row, told = last_row(tmp_path, text)
    # 4 a - b = 1, -4 a + 2 b = 2
    assert float(row["a.y[1]"]) == pytest.approx(1.0, abs=1e-9) and float(row["a.y[2]"]) == pytest.approx(3.0, abs=1e-9)
    assert float(row["a.trials"]) <= 10 and "by Newton's steps" in told, (row, told)


def test_discrete_values_that_never_settle_are_late_and_told(tmp_path):
    counter(tmp_path)
    text = "[time]\nstep_s = 0.1\nduration_s = 0.3\n" + "".join(f'[{n}]\nfmu = "count.fmu"\n' for n in "ab")
    text += "".join(f'[[connect]]\nfrom = "{x}.n"\nto = "{y}.n_in"\n' for x, y in ("ab", "ba"))
    done = refused(tmp_path, text)
    assert done.returncode == 0 and "do not settle at the start" in done.stderr and "a.n → b.n_in" in done.stderr, done.stderr
