"""FMUs whose outputs follow their inputs at once are stepped after those that feed them, so that connections delay no value."""

import csv
import json
import math
import zipfile

import pytest
from cfmu import MOTION, build, build_3
from conftest import terraglue

# a mass of 1 kg on a spring of 100 N/m, 100 mm off
MASS = [("f", "input", 0.0, ""), ("x", "output", 0.1, ""), ("v", "output", 0.0, "")]
SPRING = [("x", "input", 0.1, ""), ("f", "output", -10.0, "")]


@pytest.fixture(scope="module")
def parts(tmp_path_factory):
    folder = tmp_path_factory.mktemp("parts")
    # exact under a constant force
    build(folder, "mass", MASS, MOTION, depends="")
    build(folder, "spring", SPRING, "r[1] = -100.0 * r[0];", depends="1")
    return folder


def sprung(parts, folder, step, to_spring="", to_mass="", more=""):
    """Rows of 2 s of the mass on its spring; `to_spring` and `to_mass` are keys of the connections, `more` of both FMUs."""
    (folder / "s.toml").write_text(
        f"[time]\nstep_s = {step}\nduration_s = 2.0\n"
        f'[mass]\nfmu = "{parts}/mass.fmu"\n{more}[a_spring]\nfmu = "{parts}/spring.fmu"\n{more}'
        f'[[connect]]\nfrom = "mass.x"\nto = "a_spring.x"\n{to_spring}\n[[connect]]\nfrom = "a_spring.f"\nto = "mass.f"\n{to_mass}\n'
    )
    done = terraglue("run", "s.toml", "--csv", "--quiet", "--out", "out", cwd=folder)
    assert done.returncode == 0, done.stderr
    return list(csv.DictReader((folder / "out/variables.csv").open()))


def farthest(rows):
    """Largest error of the position relative to the amplitude."""
    return max(abs(float(r["mass.x"]) - 0.1 * math.cos(10 * float(r["t_s"]))) for r in rows) / 0.1


def oscillate(parts, folder, more="", step=0.01, isolate=False):
    """Largest distance in the last period of 2 s, m, and the row of the spring's input in exchange.json."""
    rows = sprung(parts, folder, step, more, more="isolate = true\n" if isolate else "")
    late = [abs(float(row["mass.x"])) for row in rows if float(row["t_s"]) > 2.0 - 2 * math.pi / 10]
    notes = json.loads((folder / "out/exchange.json").read_text())["connections"]
    return max(late), next(n for n in notes if n["to"] == "a_spring.x"), rows


def test_a_spring_is_not_a_step_late(parts, tmp_path):
    structure, note, rows = oscillate(parts, tmp_path)
    assert note["delay"] == "0" and "after its source" in note["why"]
    # the force belongs to the position at every communication point
    assert all(abs(float(r["a_spring.f"]) + 100 * float(r["mass.x"])) < 1e-12 for r in rows[1:])
    jacobi, late, _ = oscillate(parts, tmp_path, 'order = "jacobi"')
    assert late["delay"] == "1"
    # with a force that is held over the step, energy grows by a share of h k / 2 m per s, with a delay of a step by three of them
    exact = 0.1
    assert abs(structure - exact * math.exp(0.25 * 100 * 0.01 * 2)) < 0.08 * exact, structure
    assert jacobi > 1.8 * structure


def test_it_converges_with_the_step(parts, tmp_path):
    errors = [oscillate(parts, tmp_path, step=h)[0] - 0.1 for h in (0.004, 0.002, 0.001)]
    assert errors[0] / errors[1] == pytest.approx(2, abs=0.3) and errors[1] / errors[2] == pytest.approx(2, abs=0.3)


def test_workers_give_the_same_bits(parts, tmp_path):
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    assert oscillate(parts, tmp_path / "a")[2] == oscillate(parts, tmp_path / "b", isolate=True)[2]


def test_a_chain_of_gains_is_passed_in_one_step(parts, tmp_path):
    gain = [("u", "input", 0.0, ""), ("y", "output", 0.0, "")]
    build(tmp_path, "gain", gain, "r[1] = 2.0 * r[0];", depends="1")
    build(tmp_path, "clock", [("y", "output", 0.0, "")], "r[0] = t + h;", depends="")
    # names against the order of the chain
    names = ["d", "c", "b", "a"]
    text = "[time]\nstep_s = 0.1\nduration_s = 1.0\n[source]\nfmu = \"clock.fmu\"\n"
    text += "".join(f'[{n}]\nfmu = "gain.fmu"\n' for n in names)
    chain = ["source"] + names
    text += "".join(f'[[connect]]\nfrom = "{x}.y"\nto = "{y}.u"\n' for x, y in zip(chain, names))
    (tmp_path / "s.toml").write_text(text)
    done = terraglue("run", "s.toml", "--csv", "--quiet", "--out", "out", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    rows = list(csv.DictReader((tmp_path / "out/variables.csv").open()))
    assert all(float(r["a.y"]) == pytest.approx(16 * float(r["t_s"]), abs=1e-12) for r in rows)


def test_a_loop_of_gains_is_one_step_late(tmp_path):
    build(tmp_path, "half", [("u", "input", 1.0, ""), ("y", "output", 0.5, "")], "r[1] = 1.0 + 0.5 * r[0];", depends="1")
    text = "[time]\nstep_s = 0.1\nduration_s = 3.0\n"
    text += "".join(f'[{n}]\nfmu = "half.fmu"\n' for n in "ab")
    text += '[[connect]]\nfrom = "a.y"\nto = "b.u"\n[[connect]]\nfrom = "b.y"\nto = "a.u"\n'
    (tmp_path / "s.toml").write_text(text)
    done = terraglue("run", "s.toml", "--explain", "--out", "out", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    notes = json.loads((tmp_path / "out/exchange.json").read_text())
    assert {n["delay"] for n in notes["connections"]} == {"1"} and len(notes["loops"]) == 1


def test_a_loop_whose_step_is_halved_begins_at_its_start(parts, tmp_path):
    spring = "if (t > 0.045 && t < 0.055 && h > 0.006) return 2; r[1] = -100.0 * r[0];"
    build(tmp_path, "spring", SPRING, spring, depends="1")
    (tmp_path / "mass.fmu").write_bytes((parts / "mass.fmu").read_bytes())
    (tmp_path / "run").mkdir()
    rows = sprung(tmp_path, tmp_path / "run", 0.01, 'order = "iterate"', 'order = "iterate"')
    assert farthest(rows) < 1.1 * iterated(parts, tmp_path, 0.01)[1]


def test_a_loop_whose_values_run_away_is_not_solved(tmp_path):
    both = [("u", "input", 0.0, ""), ("y", "output", 0.0, "")]
    build(tmp_path, "more", both, "r[1] = t > 0.035 ? 1.0 + r[0] : 0.0;", depends="1")
    build(tmp_path, "same", both, "r[1] = r[0];", depends="1")
    text = '[time]\nstep_s = 0.01\nduration_s = 0.1\n[a]\nfmu = "more.fmu"\n[b]\nfmu = "same.fmu"\n'
    text += "".join(f'[[connect]]\nfrom = "{x}.y"\nto = "{y}.u"\norder = "iterate"\n' for x, y in ("ab", "ba"))
    (tmp_path / "s.toml").write_text(text)
    done = terraglue("run", "s.toml", "--quiet", "--out", "out", cwd=tmp_path)
    assert done.returncode == 1 and "the loop of a, b was not solved" in done.stderr


@pytest.mark.parametrize(
    ("key", "fault", "line", "words"),
    [
        ("rollback = false", "", 4, "`mass` cannot save its state"),
        ("", '[[fault]]\nvariable = "mass.x"\nkind = "gain"\nvalue = 2.0\nat_s = 0.05\n', 18, "a fault changes mass.x → a_spring.x"),
    ],
)
def test_a_loop_that_cannot_be_iterated_names_its_place(parts, tmp_path, key, fault, line, words):
    connections = "".join(f'[[connect]]\nfrom = "{a}"\nto = "{b}"\norder = "iterate"\n' for a, b in [("mass.x", "a_spring.x"), ("a_spring.f", "mass.f")])
    fmus = f'[mass]\nfmu = "{parts}/mass.fmu"\n{key}\n[a_spring]\nfmu = "{parts}/spring.fmu"\n'
    (tmp_path / "s.toml").write_text("[time]\nstep_s = 0.01\nduration_s = 0.1\n" + fmus + connections + fault)
    done = terraglue("run", "s.toml", "--quiet", cwd=tmp_path)
    assert done.returncode == 2 and words in done.stderr and f"s.toml:{line}:" in done.stderr, done.stderr


def iterated(parts, folder, step, order="iterate", more=""):
    """Energies over 2 s, and the largest error of the position relative to the amplitude, with the loop of mass and spring solved in
    each step."""
    rows = sprung(parts, folder, step, f'order = "{order}"', f'order = "{order}"', more=more)
    return [0.5 * float(r["mass.v"]) ** 2 + 50 * float(r["mass.x"]) ** 2 for r in rows], farthest(rows)


@pytest.mark.parametrize("order, halving", [("iterate", 16), ("iterate-ends", 4)])
def test_a_loop_that_is_iterated_keeps_the_energy_and_has_its_order(parts, tmp_path, order, halving):
    energies, error = iterated(parts, tmp_path, 0.01, order)
    # start and end of a step are treated alike, so the amplitude stays
    assert max(energies) - min(energies) < 1e-9 * energies[0]
    finer = iterated(parts, tmp_path, 0.005, order)[1]
    assert error / finer == pytest.approx(halving, rel=0.03)
    notes = json.loads((tmp_path / "out/exchange.json").read_text())
    assert all(n["delay"] == "0" and "repeat" in n["why"] for n in notes["connections"])
    assert ("in the middle of the step, too" in notes["loops"][0]) == (order == "iterate")


def test_workers_solve_a_loop_with_the_same_bits(parts, tmp_path):
    assert iterated(parts, tmp_path, 0.01) == iterated(parts, tmp_path, 0.01, more="isolate = true\n")


def test_stiff_loops_stay_bounded(tmp_path):
    # 2 pi / 628 = 10 ms is the period of the spring; steps are ten times as long
    build(tmp_path, "mass", MASS, MOTION, depends="")
    build(tmp_path, "spring", [("x", "input", 0.1, ""), ("f", "output", -4e4, "")], "r[1] = -4e5 * r[0];", depends="1")
    for order in ("iterate", "iterate-ends"):
        rows = sprung(tmp_path, tmp_path, 0.1, f'order = "{order}"', f'order = "{order}"')
        assert max(abs(float(r["mass.x"])) for r in rows) < 0.11


@pytest.mark.parametrize("how", ["own_solver_step", "one_length"])
def test_a_loop_whose_fmu_makes_no_half_steps_exchanges_values_at_the_ends(parts, tmp_path, how):
    # with a solver step of 10 ms nothing moves until that is over
    own = "if (h < 0.0099) { r[3] += h; if (r[3] < 0.0099) return 0; h = r[3]; r[3] = 0; } "
    reals = MASS + [("rest", "local", 0.0, "")]
    build(tmp_path, "mass", reals, (own if how == "own_solver_step" else "") + MOTION, depends="", variable_step=how != "one_length")
    (tmp_path / "spring.fmu").write_bytes((parts / "spring.fmu").read_bytes())
    energies, error = iterated(tmp_path, tmp_path, 0.01)
    notes = json.loads((tmp_path / "out/exchange.json").read_text())
    assert ("at its end only, as `mass` makes steps of one length" in notes["loops"][0]) == (how == "one_length")
    at_ends = iterated(tmp_path, tmp_path, 0.01, "iterate-ends")
    # of two ways to the same solution
    assert energies == pytest.approx(at_ends[0], abs=1e-10) and error == pytest.approx(at_ends[1], abs=1e-8)


def test_loops_and_chains_beside_each_other_do_not_disturb_each_other(parts, tmp_path):
    alone = {order: sprung(parts, tmp_path, 0.01, f'order = "{order}"', f'order = "{order}"') for order in ("iterate", "iterate-ends")}
    build(tmp_path, "clock", [("y", "output", 0.0, "")], "r[0] = t + h;", depends="")
    build(tmp_path, "sum", [("u", "input", 0.0, ""), ("x", "output", 0.0, ""), ("y", "output", 0.0, "")], "r[1] += h * r[0]; r[2] = r[0];", depends={"y": "1", "x": ""})
    text = "[time]\nstep_s = 0.01\nduration_s = 2.0\n[clock]\nfmu = \"clock.fmu\"\n[sum]\nfmu = \"sum.fmu\"\n[[connect]]\nfrom = \"clock.y\"\nto = \"sum.u\"\n"
    for k, order in enumerate(("iterate-ends", "iterate")):
        text += f'[mass_{k}]\nfmu = "{parts}/mass.fmu"\n[spring_{k}]\nfmu = "{parts}/spring.fmu"\n'
        text += f'[[connect]]\nfrom = "mass_{k}.x"\nto = "spring_{k}.x"\norder = "{order}"\n[[connect]]\nfrom = "spring_{k}.f"\nto = "mass_{k}.f"\norder = "{order}"\n'
    (tmp_path / "s.toml").write_text(text)
    done = terraglue("run", "s.toml", "--csv", "--quiet", "--out", "out", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    rows = list(csv.DictReader((tmp_path / "out/variables.csv").open()))
    for k, order in enumerate(("iterate-ends", "iterate")):
        assert [r[f"mass_{k}.x"] for r in rows] == [r["mass.x"] for r in alone[order]]
    # sum of t h at the ends of 200 steps
    assert float(rows[-1]["sum.x"]) == pytest.approx(1e-4 * 200 * 201 / 2, abs=1e-12)


def test_an_algebraic_loop_is_solved(tmp_path):
    build(tmp_path, "half", [("u", "input", 1.0, ""), ("y", "output", 0.5, "")], "r[1] = 1.0 + 0.5 * r[0];", depends="1")
    text = "[time]\nstep_s = 0.1\nduration_s = 0.3\n"
    text += "".join(f'[{n}]\nfmu = "half.fmu"\n' for n in "ab")
    text += "".join(f'[[connect]]\nfrom = "{x}.y"\nto = "{y}.u"\norder = "iterate"\n' for x, y in ("ab", "ba"))
    (tmp_path / "s.toml").write_text(text)
    done = terraglue("run", "s.toml", "--csv", "--quiet", "--out", "out", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    rows = list(csv.DictReader((tmp_path / "out/variables.csv").open()))
    assert all(float(r["a.y"]) == pytest.approx(2.0, abs=1e-9) for r in rows[1:])


def test_a_loop_with_gains_above_one_is_solved(tmp_path):
    # y = 1 - 3 u_1 + u_2 and y = 2 + 4 u_1 - u_2: repeating alone runs away
    reals = [("u_1", "input", 0.0, ""), ("u_2", "input", 0.0, ""), ("y", "output", 0.0, "")]
    build(tmp_path, "one", reals, "r[2] = 1.0 - 3.0 * r[0] + r[1];", depends="1 2")
    build(tmp_path, "two", reals, "r[2] = 2.0 + 4.0 * r[0] - r[1];", depends="1 2")
    text = '[time]\nstep_s = 0.1\nduration_s = 0.3\n[one]\nfmu = "one.fmu"\n[two]\nfmu = "two.fmu"\n'
    for target in ("one", "two"):
        text += f'[[connect]]\nfrom = "one.y"\nto = "{target}.u_1"\norder = "iterate"\n[[connect]]\nfrom = "two.y"\nto = "{target}.u_2"\norder = "iterate"\n'
    (tmp_path / "s.toml").write_text(text)
    done = terraglue("run", "s.toml", "--csv", "--quiet", "--out", "out", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    # 4 a - b = 1, -4 a + 2 b = 2
    last = list(csv.DictReader((tmp_path / "out/variables.csv").open()))[-1]
    assert float(last["one.y"]) == pytest.approx(1.0, abs=1e-8) and float(last["two.y"]) == pytest.approx(3.0, abs=1e-8)


def test_a_loop_without_a_solution_says_so(tmp_path):
    build(tmp_path, "flips", [("u", "input", 1.0, ""), ("y", "output", 0.5, "")], "r[1] = r[0] > 0 ? -1.0 : 1.0;", depends="1")
    text = '[time]\nstep_s = 0.1\nduration_s = 0.3\n[a]\nfmu = "flips.fmu"\n[[connect]]\nfrom = "a.y"\nto = "a.u"\norder = "iterate"\n'
    (tmp_path / "s.toml").write_text(text)
    done = terraglue("run", "s.toml", "--out", "out", cwd=tmp_path)
    assert done.returncode == 1 and "the loop of a was not solved" in done.stderr, done.stderr


def test_what_cannot_repeat_a_step_is_refused(tmp_path):
    fmu = build(tmp_path, "forgets", [("u", "input", 1.0, ""), ("y", "output", 0.5, "")], "r[1] = r[0];", depends="1")
    entries = {i.filename: zipfile.ZipFile(fmu).read(i) for i in zipfile.ZipFile(fmu).infolist()}
    entries["modelDescription.xml"] = entries["modelDescription.xml"].replace(b'canGetAndSetFMUstate="true"', b"")
    with zipfile.ZipFile(fmu, "w") as archive:
        for name, data in entries.items():
            archive.writestr(name, data)
    text = '[time]\nstep_s = 0.1\nduration_s = 0.3\n[a]\nfmu = "forgets.fmu"\n[b]\nfmu = "forgets.fmu"\n[[connect]]\nfrom = "a.y"\nto = "b.u"\norder = "iterate"\n'
    (tmp_path / "s.toml").write_text(text)
    done = terraglue("run", "s.toml", "--out", "out", cwd=tmp_path)
    assert done.returncode == 2 and "cannot save its state" in done.stderr and "iterate" in done.stderr, done.stderr


def extrapolated(parts, folder, step, more="", extrapolate="linear"):
    """Largest error of the position in 2 s relative to the amplitude, where the force on the mass follows a line."""
    return farthest(sprung(parts, folder, step, more, f'extrapolate = "{extrapolate}"'))


def test_a_line_through_the_last_two_values_is_of_second_order(parts, tmp_path):
    # where the spring is stepped in order, and where it is late, too: it takes the value at the end of its step then
    for more in ("", 'order = "jacobi"\nextrapolate = "linear"'):
        errors = [extrapolated(parts, tmp_path, h, more) for h in (0.004, 0.002, 0.001)]
        orders = [math.log2(a / b) for a, b in zip(errors, errors[1:])]
        assert all(order == pytest.approx(2, abs=0.25) for order in orders), errors
        held = extrapolated(parts, tmp_path, 0.001, extrapolate="constant")
        assert errors[-1] < 0.03 * held, (errors, held)
    extrapolated(parts, tmp_path, 0.01)
    notes = json.loads((tmp_path / "out/exchange.json").read_text())["connections"]
    assert "line through the last two values" in next(n["why"] for n in notes if n["to"] == "mass.f")


RAMP = [("y", "output", 0.0, "")]
INTEGRATOR = [("u", "input", 0.0, ""), ("x", "output", 0.0, "")]


@pytest.mark.parametrize(("source", "target"), [(1, 1), (4, 1), (1, 4), (2, 4)])
def test_steps_of_different_lengths_meet_on_a_line(tmp_path, source, target):
    # x is the integral of u = t from the second value of the source on, exactly
    build(tmp_path, "ramp", RAMP, "r[0] = t + h;", depends="")
    build(tmp_path, "integrator", INTEGRATOR, "r[1] += h * r[0];", depends="")
    multiple = lambda n: f"step_multiple = {n}\n" if n > 1 else ""
    (tmp_path / "s.toml").write_text(
        f'[time]\nstep_s = 0.1\nduration_s = 4.0\n[ramp]\nfmu = "ramp.fmu"\n{multiple(source)}'
        f'[sum]\nfmu = "integrator.fmu"\n{multiple(target)}'
        '[[connect]]\nfrom = "ramp.y"\nto = "sum.u"\nextrapolate = "linear"\n'
    )
    done = terraglue("run", "s.toml", "--csv", "--quiet", "--out", "out", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    rows = [(float(r["t_s"]), float(r["sum.x"])) for r in csv.DictReader((tmp_path / "out/variables.csv").open())]
    known = 0.1 * max(source, target)
    for (t, x), (later, more) in zip(rows, rows[1:]):
        long = abs(t / (0.1 * target) - round(t / (0.1 * target))) < 1e-9
        if long and t > known + 1e-9:
            end = t + 0.1 * target
            at_end = next((x for s, x in rows if abs(s - end) < 1e-9), None)
            assert at_end is None or at_end - x == pytest.approx(0.5 * (end**2 - t**2), abs=1e-9), (t, x)


def test_what_cannot_be_extrapolated_is_refused(parts, tmp_path):
    (tmp_path / "s.toml").write_text(
        f'[time]\nduration_s = 0.1\n[mass]\nfmu = "{parts}/mass.fmu"\n[a_spring]\nfmu = "{parts}/spring.fmu"\n'
        '[[connect]]\nfrom = "mass.x"\nto = "a_spring.x"\norder = "iterate"\nextrapolate = "linear"\n'
    )
    done = terraglue("run", "s.toml", "--out", "out", cwd=tmp_path)
    assert done.returncode == 2 and "s.toml:11" in done.stderr and "leave one of them out" in done.stderr, done.stderr


def test_steps_of_a_minute(tmp_path):
    build(tmp_path, "slow", RAMP, "r[0] = h;", variable_step=False)
    with zipfile.ZipFile(tmp_path / "slow.fmu") as archive:
        entries = {i.filename: archive.read(i) for i in archive.infolist()}
    entries["modelDescription.xml"] = entries["modelDescription.xml"].replace(
        b"<ModelVariables>", b'<DefaultExperiment stepSize="60"/><ModelVariables>'
    )
    with zipfile.ZipFile(tmp_path / "slow.fmu", "w") as archive:
        [archive.writestr(name, data) for name, data in entries.items()]
    scenario = "[time]\nstep_s = {}\nduration_s = 600.0\n[slow]\nfmu = \"slow.fmu\"\n{}"
    for step, more in ((60, ""), (1, "step_multiple = 60")):
        (tmp_path / "s.toml").write_text(scenario.format(step, more))
        done = terraglue("run", "s.toml", "--csv", "--out", "out", cwd=tmp_path)
        assert done.returncode == 0 and "steps of one length" not in done.stderr, done.stderr
        rows = list(csv.DictReader((tmp_path / "out/variables.csv").open()))
        assert float(rows[-1]["slow.y"]) == 60.0
    (tmp_path / "s.toml").write_text(scenario.format(1, ""))
    done = terraglue("run", "s.toml", "--out", "out", cwd=tmp_path)
    assert "`step_multiple = 60`" in done.stderr and "60 s" in done.stderr, done.stderr


def test_an_array_of_one_element_and_a_scalar_fit(tmp_path):
    build(tmp_path, "ramp", RAMP, "r[0] = t + h;", depends="")
    build_3(tmp_path, "one", [("u", "input", "0.0", [1]), ("y", "output", "", [1])], "v[2][0] = v[1][0];")
    text = '[time]\nstep_s = 0.1\nduration_s = 0.5\n[ramp]\nfmu = "ramp.fmu"\n[one]\nfmu = "one.fmu"\n[last]\nfmu = "last.fmu"\n'
    build(tmp_path, "last", INTEGRATOR, "r[1] = r[0];", depends="1")
    text += '[[connect]]\nfrom = "ramp.y"\nto = "one.u"\n[[connect]]\nfrom = "one.y"\nto = "last.u"\n'
    (tmp_path / "s.toml").write_text(text)
    done = terraglue("run", "s.toml", "--csv", "--quiet", "--out", "out", cwd=tmp_path)
    assert done.returncode == 0, done.stderr


def squares(folder, version, knows=True):
    """A source with y = t² that provides its derivative, and a sum that holds its input over a step."""
    build(folder, "integrator", INTEGRATOR, "r[1] += h * r[0];", depends="")
    flags = 'maxOutputDerivativeOrder="1"' if knows else ""
    if version == 2:
        more = "int fmi2GetRealOutputDerivatives(Fmu *u, const unsigned *r, size_t n, const int *o, double *x)"
        more += "{ while (n--) x[n] = o[n] == 1 ? 2 * sqrt(u->r[r[n]]) : 0; return 0; }"
        build(folder, "square", [("y", "output", 0.0, "")], "r[0] = (t + h) * (t + h);", more=more, flags=flags, depends="")
    else:
        more = "int fmi3GetOutputDerivatives(Fmu *u, const unsigned *r, size_t n, const int *o, double *x, size_t m)"
        more += "{ while (n--) x[n] = o[n] == 1 ? 2 * sqrt(u->v[r[n]][0]) : 0; return 0; }"
        build_3(folder, "square", [("y", "output", None, [])], "v[1][0] = (t + h) * (t + h);", more=more, flags=flags)


def summed(folder, extrapolate, step=0.1, more=""):
    (folder / "s.toml").write_text(
        f'[time]\nstep_s = {step}\nduration_s = 4.0\n[square]\nfmu = "square.fmu"\n{more}\n[sum]\nfmu = "integrator.fmu"\n'
        f'[[connect]]\nfrom = "square.y"\nto = "sum.u"\nfactor = 3.0\nextrapolate = "{extrapolate}"\n'
    )
    return terraglue("run", "s.toml", "--csv", "--quiet", "--out", "out", cwd=folder)


@pytest.mark.parametrize("version", [2, 3])
def test_an_input_follows_the_derivative_that_an_fmu_tells(tmp_path, version):
    squares(tmp_path, version)
    for step in (0.1, 0.05):
        done = summed(tmp_path, "derivatives", step)
        assert done.returncode == 0, done.stderr
        last = list(csv.DictReader((tmp_path / "out/variables.csv").open()))[-1]
        # of the integral of 3 t² over each step, t² and 2 t are met and h² is not
        assert float(last["sum.x"]) == pytest.approx(64 - 4 * step**2, abs=1e-9)
    notes = json.loads((tmp_path / "out/exchange.json").read_text())["connections"]
    assert "derivative that its source provides" in notes[0]["why"]


def test_a_source_without_derivatives_is_refused(tmp_path):
    squares(tmp_path, 2, knows=False)
    done = summed(tmp_path, "derivatives")
    assert done.returncode == 2 and "maxOutputDerivativeOrder" in done.stderr and "linear" in done.stderr, done.stderr
    squares(tmp_path, 2)
    done = summed(tmp_path, "derivatives", more="isolate = true")
    assert done.returncode == 2 and "isolated" in done.stderr, done.stderr


# makes steps in two halves between 45 and 55 ms: the step of the others is discarded and made again
HALVES = "if (t > 0.045 && t < 0.055 && h > 0.006) return 2; r[1] += 1.0;"


@pytest.mark.parametrize("isolate", [False, True])
@pytest.mark.parametrize(
    "keys, mean", [('order = "jacobi"', 0.0), ('extrapolate = "linear"\norder = "jacobi"', 0.5), ("", 1.0)], ids=["jacobi", "linear", "structure"]
)
def test_a_step_that_another_discards_leaves_no_trace(tmp_path, keys, mean, isolate):
    # y = t; the sum takes its input as it is held, and shows it at once where the order is to be seen
    build(tmp_path, "clock", [("y", "output", 0.0, "")], "r[0] = t + h;", depends="")
    own = "1" if mean == 1.0 else ""
    build(tmp_path, "sum", [("u", "input", 0.0, ""), ("x", "output", 0.0, ""), ("y", "output", 0.0, "")], "r[1] += h * r[0]; r[2] = r[0];", depends={"y": own, "x": ""})
    build(tmp_path, "halves", [("u", "input", 0.0, ""), ("n", "output", 0.0, "")], HALVES, depends="1")
    more = "isolate = true\n" if isolate else ""
    text = "[time]\nstep_s = 0.01\nduration_s = 0.1\n"
    text += "".join(f'[{name}]\nfmu = "{name}.fmu"\n{more}' for name in ("clock", "sum", "halves"))
    text += f'[[connect]]\nfrom = "clock.y"\nto = "sum.u"\n{keys}\n'
    text += '[[connect]]\nfrom = "sum.y"\nto = "halves.u"\n'
    (tmp_path / "s.toml").write_text(text)
    done = terraglue("run", "s.toml", "--csv", "--quiet", "--out", "out", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    last = list(csv.DictReader((tmp_path / "out/variables.csv").open()))[-1]
    assert float(last["halves.n"]) == 11
    ends = [k / 100 for k in range(11)]
    ends.insert(6, 0.055)
    steps = list(zip(ends, ends[1:]))
    # a line needs two values: the first step is held
    held = [a if k == 0 and mean == 0.5 else a + mean * (b - a) for k, (a, b) in enumerate(steps)]
    assert float(last["sum.x"]) == pytest.approx(sum(u * (b - a) for u, (a, b) in zip(held, steps)), abs=1e-14)


def orders(errors):
    return [math.log2(a / b) for a, b in zip(errors, errors[1:])]


ITERATE = 'order = "iterate"\n'
GAIN = [("u", "input", 0.0, ""), ("y", "output", 0.0, "")]


def ended(folder, text, name):
    (folder / "s.toml").write_text(text)
    done = terraglue("run", "s.toml", "--csv", "--quiet", "--no-report", "--out", "out", cwd=folder)
    assert done.returncode == 0, done.stderr
    return float(list(csv.DictReader((folder / "out/variables.csv").open()))[-1][name])


@pytest.mark.parametrize("link", ["", ITERATE])
def test_a_loop_that_is_driven_from_outside_is_of_fourth_order(parts, tmp_path, link):
    # m x'' = -k x + 100 sin 3t, at rest at first: the source is no part of the loop
    build(tmp_path, "source", [("y", "output", 0.0, "")], "r[0] = 100.0 * sin(3.0 * (t + h));", depends="")
    build(tmp_path, "spring", [("x", "input", 0.0, ""), ("p", "input", 0.0, ""), ("f", "output", 0.0, "")], "r[2] = r[1] - 100.0 * r[0];", depends="1 2")
    build(tmp_path, "mass", [("f", "input", 0.0, ""), ("x", "output", 0.0, ""), ("v", "output", 0.0, "")],
          MOTION, depends="")
    exact = 100 / (100 - 9) * (math.sin(3 * 2.0) - 0.3 * math.sin(10 * 2.0))
    errors = []
    for h in (0.04, 0.02, 0.01):
        text = f"[time]\nstep_s = {h}\nduration_s = 2.0\n" + "".join(f'[{n}]\nfmu = "{n}.fmu"\n' for n in ("source", "spring", "mass"))
        text += f'[[connect]]\nfrom = "mass.x"\nto = "spring.x"\n{ITERATE}[[connect]]\nfrom = "spring.f"\nto = "mass.f"\n{ITERATE}'
        text += f'[[connect]]\nfrom = "source.y"\nto = "spring.p"\n{link}'
        errors.append(abs(ended(tmp_path, text, "mass.x") - exact))
    assert all(3.8 < order < 4.2 for order in orders(errors)), errors
    assert "in the middle of the step, too" in json.loads((tmp_path / "out/exchange.json").read_text())["loops"][0]


def test_a_source_without_state_makes_the_loop_whole(parts, tmp_path):
    build(tmp_path, "source", [("y", "output", 0.0, "")], "r[0] = 100.0 * sin(3.0 * (t + h));", depends="", variable_step=False)
    build(tmp_path, "spring", [("x", "input", 0.0, ""), ("p", "input", 0.0, ""), ("f", "output", 0.0, "")], "r[2] = r[1] - 100.0 * r[0];", depends="1 2")
    text = "[time]\nstep_s = 0.01\nduration_s = 0.1\n" + "".join(f'[{n}]\nfmu = "{f}"\n' for n, f in (("source", "source.fmu"), ("spring", "spring.fmu"), ("mass", parts / "mass.fmu")))
    text += f'[[connect]]\nfrom = "mass.x"\nto = "spring.x"\n{ITERATE}[[connect]]\nfrom = "spring.f"\nto = "mass.f"\n{ITERATE}[[connect]]\nfrom = "source.y"\nto = "spring.p"\n'
    ended(tmp_path, text, "mass.x")
    assert "at its end only, as `source` makes steps of one length" in json.loads((tmp_path / "out/exchange.json").read_text())["loops"][0]


@pytest.mark.parametrize("gain, exact", [(-5.0, math.exp(-5.0)), (0.7, math.exp(0.7))])
def test_a_loop_of_one_integrator_is_of_fourth_order(tmp_path, gain, exact):
    build(tmp_path, "sum", [("u", "input", gain, ""), ("x", "output", 1.0, "")], "r[1] += h * r[0];", depends="")
    build(tmp_path, "gain", [("u", "input", 1.0, ""), ("y", "output", gain, "")], f"r[1] = {gain} * r[0];", depends="1")
    errors = []
    for h in (0.1, 0.05, 0.025):
        text = f'[time]\nstep_s = {h}\nduration_s = 1.0\n[sum]\nfmu = "sum.fmu"\n[gain]\nfmu = "gain.fmu"\n'
        text += f'[[connect]]\nfrom = "sum.x"\nto = "gain.u"\n{ITERATE}[[connect]]\nfrom = "gain.y"\nto = "sum.u"\n{ITERATE}'
        errors.append(abs(ended(tmp_path, text, "sum.x") - exact))
    assert all(3.7 < order < 4.3 for order in orders(errors)), errors


@pytest.mark.parametrize("order", ["iterate", "iterate-ends"])
def test_the_unit_of_a_loop_does_not_matter(tmp_path, order):
    """The same motion in m and pm, of masses of kg and Gg."""
    ends = []
    for size, mass in ((1.0, 1.0), (1e-12, 1.0), (1.0, 1e8)):
        build(tmp_path, "mass", [("f", "input", -100.0 * mass * size * 0.1, ""), ("x", "output", 0.1 * size, ""), ("v", "output", 0.0, "")],
              f"r[1] += h * r[2] + 0.5 * h * h * r[0] / {mass!r}; r[2] += h * r[0] / {mass!r};", depends="")
        build(tmp_path, "spring", [("x", "input", 0.1 * size, ""), ("f", "output", -10.0 * mass * size, "")], f"r[1] = -100.0 * {mass!r} * r[0];", depends="1")
        rows = sprung(tmp_path, tmp_path, 0.01, f'order = "{order}"', f'order = "{order}"')
        ends.append([float(r["mass.x"]) / size for r in rows])
    assert ends[1] == pytest.approx(ends[0], abs=1e-10) and ends[2] == pytest.approx(ends[0], abs=1e-10)


def test_what_discards_a_quarter_of_a_step_is_stepped_whole(parts, tmp_path):
    build(tmp_path, "mass", MASS, "if (h < 0.009) return 2; " + MOTION, depends="")
    (tmp_path / "spring.fmu").write_bytes((parts / "spring.fmu").read_bytes())
    ends = iterated(tmp_path, tmp_path, 0.01, "iterate-ends")
    energies, error = iterated(tmp_path, tmp_path, 0.01)
    assert energies == pytest.approx(ends[0], abs=1e-10) and error == pytest.approx(ends[1], abs=1e-8)


def test_a_first_step_that_is_discarded_leaves_no_trace(tmp_path):
    # clock -> gain -> sum, which makes no step longer than 7 ms
    build(tmp_path, "clock", [("y", "output", 0.0, "")], "r[0] = t + h;", depends="")
    build(tmp_path, "gain", GAIN, "r[1] = r[0];", depends="1")
    build(tmp_path, "sum", GAIN, "if (h > 0.007) return 2; r[1] += h * r[0];", depends="")
    text = "[time]\nstep_s = 0.01\nduration_s = 0.02\n" + "".join(f'[{n}]\nfmu = "{n}.fmu"\n' for n in ("clock", "gain", "sum"))
    text += '[[connect]]\nfrom = "clock.y"\nto = "gain.u"\n[[connect]]\nfrom = "gain.y"\nto = "sum.u"\n'
    # each half begins with the value of its start
    assert ended(tmp_path, text, "sum.y") == pytest.approx(0.005 * (0.0 + 0.005 + 0.01 + 0.015), abs=1e-15)


@pytest.mark.parametrize("size", [1.0, 1e-5, 1e-9, 1e6])
def test_start_values_of_mixed_units_are_solved(tmp_path, size):
    build(tmp_path, "a", GAIN, "", depends="1", more=f"int fmi2GetReal(Fmu *u, const unsigned *r, size_t n, double *x) {{ u->r[1] = {size!r} * (1.0 + u->r[0]); while (n--) x[n] = u->r[r[n]]; return 0; }}", instead=("fmi2GetReal",))
    build(tmp_path, "b", GAIN, "", depends="1", more=f"int fmi2GetReal(Fmu *u, const unsigned *r, size_t n, double *x) {{ u->r[1] = 1.0 - 0.5 / {size!r} * u->r[0]; while (n--) x[n] = u->r[r[n]]; return 0; }}", instead=("fmi2GetReal",))
    text = '[time]\nstep_s = 0.1\nduration_s = 0.1\n[a]\nfmu = "a.fmu"\n[b]\nfmu = "b.fmu"\n[[connect]]\nfrom = "a.y"\nto = "b.u"\n[[connect]]\nfrom = "b.y"\nto = "a.u"\n'
    (tmp_path / "s.toml").write_text(text)
    done = terraglue("run", "s.toml", "--csv", "--quiet", "--no-report", "--out", "out", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    first = next(csv.DictReader((tmp_path / "out/variables.csv").open()))
    # a = s (1 + b), b = 1 - a / 2 s
    assert float(first["b.y"]) == pytest.approx(1 / 3, rel=1e-11) and float(first["a.y"]) / size == pytest.approx(4 / 3, rel=1e-11)


def test_an_fmu_alone_and_in_a_scenario_makes_the_same_steps(tmp_path):
    fmu = build(tmp_path, "oscillator", [("x", "output", 1.0, ""), ("v", "output", 0.0, "")], "r[0] += h * r[1]; r[1] -= h * r[0] * 25.0;", depends="")
    for step in (0.001, 0.0007):
        alone = terraglue("fmu", "run", fmu, "--stop", "0.7", "--step", step, "--csv", "alone.csv", cwd=tmp_path)
        assert alone.returncode == 0, alone.stderr
        last = list(csv.DictReader((tmp_path / "alone.csv").open()))[-1]
        assert ended(tmp_path, f'[time]\nstep_s = {step}\nduration_s = 0.7\n[a]\nfmu = "oscillator.fmu"\n', "a.x") == float(last["x"])


def test_an_fmu_that_crashes_alone_is_named(tmp_path):
    fmu = build(tmp_path, "crashes", [("y", "output", 0.0, "")], "if (t > 0.5) *(volatile int *)0 = 1; r[0] = t;", depends="")
    done = terraglue("fmu", "run", fmu, "--stop", "1", "--step", "0.1", "--csv", "rows.csv", cwd=tmp_path)
    assert done.returncode == -11 and "segmentation fault" in done.stderr and "`crashes.fmu`" in done.stderr and "--isolate" in done.stderr, done.stderr
    kept = terraglue("fmu", "run", fmu, "--stop", "1", "--step", "0.1", "--isolate", cwd=tmp_path)
    assert kept.returncode == 1 and "crashed:" not in kept.stderr


DRIVEN = [("x", "input", 0.0, ""), ("p", "input", 0.0, ""), ("f", "output", 0.0, "")]


def driven(folder, source, h, link="", more=""):
    """Place after 2 s of a mass on a spring that a source pushes; `source` is the step of the source."""
    build(folder, "source", [("y", "output", 0.0, ""), ("rest", "local", 0.0, "")], source, depends="")
    build(folder, "driven", DRIVEN, "r[2] = r[1] - 100.0 * r[0];", depends="1 2")
    build(folder, "free", [("f", "input", 0.0, ""), ("x", "output", 0.0, ""), ("v", "output", 0.0, "")], MOTION, depends="")
    text = f"[time]\nstep_s = {h}\nduration_s = 2.0\n" + "".join(f'[{n}]\nfmu = "{n}.fmu"\n' for n in ("source", "driven", "free"))
    text += f'[[connect]]\nfrom = "free.x"\nto = "driven.x"\n{ITERATE}[[connect]]\nfrom = "driven.f"\nto = "free.f"\n{ITERATE}'
    text += f'[[connect]]\nfrom = "source.y"\nto = "driven.p"\n{link}{more}'
    return ended(folder, text, "free.x")


def test_a_source_on_a_grid_of_its_own_makes_the_step_whole(tmp_path):
    # its solver makes steps of 40 ms: its output within a step is not that of the time
    grid = "r[1] += h; if (r[1] < 0.0399) return 0; r[1] = 0; r[0] = 100.0 * sin(3.0 * (t + h));"
    exact = 100 / (100 - 9) * (math.sin(6.0) - 0.3 * math.sin(20.0))
    assert abs(driven(tmp_path, grid, 0.04) - exact) < 0.06, "as whole steps"


def test_a_loop_at_rest_that_feeds_another_keeps_its_time(tmp_path):
    # a constant goes through a filter, which stands in its first trial, to a loop that goes by quarters
    build(tmp_path, "filter", [("u", "input", 1.0, ""), ("z", "output", 1.0, ""), ("clock", "output", 0.0, "")], "r[2] += h;", depends="")
    build(tmp_path, "constant", [("y", "output", 1.0, "")], "", depends="")
    more = '[filter]\nfmu = "filter.fmu"\n[constant]\nfmu = "constant.fmu"\n'
    more += f'[[connect]]\nfrom = "constant.y"\nto = "filter.u"\n{ITERATE}'
    build(tmp_path, "driven", DRIVEN[:2] + [("f", "output", 1.0, "")], "r[2] = r[1] - 100.0 * r[0];", depends="1 2")
    build(tmp_path, "free", [("f", "input", 1.0, ""), ("x", "output", 0.0, ""), ("v", "output", 0.0, "")], MOTION, depends="")
    text = "[time]\nstep_s = 0.02\nduration_s = 2.0\n" + "".join(f'[{n}]\nfmu = "{n}.fmu"\n' for n in ("driven", "free")) + more
    text += f'[[connect]]\nfrom = "free.x"\nto = "driven.x"\n{ITERATE}[[connect]]\nfrom = "driven.f"\nto = "free.f"\n{ITERATE}[[connect]]\nfrom = "filter.z"\nto = "driven.p"\n'
    assert ended(tmp_path, text, "filter.clock") == pytest.approx(2.0, abs=1e-9)
    assert ended(tmp_path, text, "free.x") == pytest.approx(0.01 * (1 - math.cos(20.0)), abs=1e-5)


def test_loops_that_share_a_source_go_alike(tmp_path):
    """A loop in whole steps, fed over a gain, is not delayed by a loop beside it that could go by quarters."""
    build(tmp_path, "gain", GAIN, "r[1] = r[0];", depends="1")
    second = '[gain]\nfmu = "gain.fmu"\n[other]\nfmu = "driven.fmu"\n[mass]\nfmu = "free.fmu"\n[[connect]]\nfrom = "source.y"\nto = "gain.u"\n[[connect]]\nfrom = "gain.y"\nto = "other.p"\n'
    ends = 'order = "iterate-ends"\n'
    second += f'[[connect]]\nfrom = "mass.x"\nto = "other.x"\n{ends}[[connect]]\nfrom = "other.f"\nto = "mass.f"\n{ends}'
    source = "r[0] = 100.0 * sin(3.0 * (t + h));"
    exact = 100 / (100 - 9) * (math.sin(6.0) - 0.3 * math.sin(20.0))
    errors = []
    for h in (0.04, 0.02, 0.01):
        driven(tmp_path, source, h, more=second)
        rows = list(csv.DictReader((tmp_path / "out/variables.csv").open()))
        errors.append(abs(float(rows[-1]["mass.x"]) - exact))
    assert all(1.8 < order < 2.3 for order in orders(errors)), errors


def test_a_loop_may_go_back_to_before_its_fmus_are_initialised(tmp_path):
    # the place is set when the FMU leaves its initialisation: a state from before does not have it
    mass = [("f", "input", -10.0, ""), ("x", "output", 0.1, ""), ("v", "output", 0.0, ""), ("on", "local", 0.0, "")]
    leave = "int fmi2ExitInitializationMode(Fmu *u) { u->r[1] = 0.1; u->r[3] = 1.0; return 0; }"
    build(tmp_path, "mass", mass, "if (r[3] < 0.5) return 3; " + MOTION, depends="", more=leave, instead=("fmi2ExitInitializationMode",))
    build(tmp_path, "spring", SPRING, "r[1] = -100.0 * r[0];", depends="1")
    for order in ("iterate", "iterate-ends"):
        rows = sprung(tmp_path, tmp_path, 0.01, f'order = "{order}"', f'order = "{order}"')
        assert farthest(rows) < 0.02


def test_a_line_of_a_source_is_followed_within_quarters(tmp_path):
    text = "r[0] = 100.0 * sin(3.0 * (t + h));"
    exact = 100 / (100 - 9) * (math.sin(6.0) - 0.3 * math.sin(20.0))
    errors = [abs(driven(tmp_path, text, h, 'order = "jacobi"\nextrapolate = "linear"\n') - exact) for h in (0.02, 0.01, 0.005)]
    assert all(1.8 < order < 2.3 for order in orders(errors)), errors


def test_a_long_step_that_another_discards_is_not_seen_before_its_end(tmp_path):
    build(tmp_path, "long", [("y", "output", 0.0, "")], "r[0] = t + h;", depends="")
    build(tmp_path, "sum", GAIN, "r[1] += h * r[0];", depends="")
    build(tmp_path, "halves", [("n", "output", 0.0, "")], "if (t > 0.045 && t < 0.055 && h > 0.006) return 2; r[0] += 1.0;", depends="")
    text = '[time]\nstep_s = 0.01\nduration_s = 0.1\n[long]\nfmu = "long.fmu"\nstep_multiple = 2\n[sum]\nfmu = "sum.fmu"\n[halves]\nfmu = "halves.fmu"\n[[connect]]\nfrom = "long.y"\nto = "sum.u"\n'
    assert ended(tmp_path, text, "sum.y") == pytest.approx(0.02 * (0.0 + 0.02 + 0.04 + 0.06 + 0.08), abs=1e-15)
    assert ended(tmp_path, text, "halves.n") == 11
