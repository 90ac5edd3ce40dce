"""Faults of single numbers: on a connection or an input, between two times or on a condition; and the faults of legs."""

import csv
import re
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from cfmu import build
from claims import agrees
from conftest import ROOT, terraglue

H = 0.1


@pytest.fixture(scope="session")
def folder(tmp_path_factory):
    """An FMU whose output is the time, and one that keeps and integrates its input."""
    folder = tmp_path_factory.mktemp("faults")
    build(folder, "time", [("y", "output", 0, "")], "r[0] = t + h;")
    sink = [("u", "input", 0, ""), ("seen", "output", 0, ""), ("sum", "output", 0, ""), ("free", "input", 2, "")]
    sink += [("free_seen", "output", 0, "")]
    build(folder, "sink", sink, "r[1] = r[0]; r[2] += h * r[0]; r[4] = r[3];")
    build(folder, "stiff", [("y", "output", 0, "")], "r[0] = t + h;", variable_step=False)
    return folder


def run(folder, tmp_path, faults, more="", source="time", seed=1):
    path = folder / "scenario.toml"
    path.write_text(f"""
[time]
step_s = {H}
duration_s = 2.0
[world]
seed = {seed}
[recording]
every_steps = 1
[source]
fmu = "{source}.fmu"
[sink]
fmu = "sink.fmu"
[[connect]]
from = "source.y"
to = "sink.u"
{more}
{faults}
""")
    done = terraglue("run", path, "--csv", "--quiet", "--out", tmp_path / "out")
    if done.returncode:
        return done.stderr
    rows = list(csv.DictReader((tmp_path / "out" / "variables.csv").open()))
    return {name: np.array([float(row[name]) for row in rows]) for name in rows[0] if name != ""}


def time_of(rows):
    return rows[next(name for name in rows if name.startswith("t"))]


@pytest.mark.parametrize(
    ("keys", "told"),
    [
        ('kind = "override"\nvalue = -3.0', lambda t: -3.0),
        ('kind = "offset"\nvalue = 0.5', lambda t: t + 0.5),
        ('kind = "gain"\nvalue = -2.0', lambda t: -2 * t),
        ('kind = "ramp"\nrate_per_s = 10.0', lambda t: t + 10 * (t - 0.5)),
        ('kind = "freeze"', lambda t: 0.5),
        ('kind = "delay"\ndelay_s = 0.3', lambda t: t - 0.3),
        ('kind = "drop-out"\nprobability = 1.0', lambda t: 0.5),
        ('kind = "noise"\ndeviation = 0.0', lambda t: t),
    ],
)
@pytest.mark.parametrize("variable", ["sink.u", "source.y"])
def test_a_fault_changes_what_is_told_while_it_lasts(folder, tmp_path, keys, told, variable):
    rows = run(folder, tmp_path, f'[[fault]]\nvariable = "{variable}"\n{keys}\nat_s = 0.5\nuntil_s = 1.2\n')
    assert isinstance(rows, dict), rows
    t = time_of(rows)
    for k in range(1, len(t)):
        before = t[k - 1]
        faulty = 0.5 - 1e-9 < before < 1.2 - 1e-9
        assert rows["sink.seen"][k] == pytest.approx(told(before) if faulty else before, abs=1e-12), before
    assert rows["source.y"] == pytest.approx(t, abs=1e-12), "the output itself stays true"


def test_begin_and_end_are_met_exactly_between_communication_points(folder, tmp_path):
    fault = '[[fault]]\nvariable = "sink.u"\nkind = "override"\nvalue = 100.0\nat_s = 0.537\nuntil_s = 0.7881\n'
    rows = run(folder, tmp_path, fault)
    points = sorted([k * H for k in range(21)] + [0.537, 0.7881])
    told = [100.0 if 0.537 <= t < 0.7881 else t for t in points]
    wanted = sum(x * (b - a) for x, a, b in zip(told, points, points[1:]))
    assert rows["sink.sum"][-1] == pytest.approx(wanted, rel=1e-12)


def test_an_event_is_met_exactly_too_unless_an_fmu_makes_steps_of_one_length_only(folder, tmp_path):
    event = '[[event]]\nat_s = 0.537\nset = { "sink.free" = 7.0 }\n'
    more = '[watch]\nfmu = "sink.fmu"\n[[connect]]\nfrom = "sink.free_seen"\nto = "watch.u"\n'
    exact = run(folder, tmp_path / "a", event, more)
    late = run(folder, tmp_path / "b", event, more, source="stiff")
    # `watch` is stepped after `sink`, with its output at the end of the part: no value is late, and the event holds from its time on,
    # or from the next communication point
    assert exact["watch.sum"][-1] == pytest.approx(2 * 0.537 + 7 * (2.0 - 0.537), rel=1e-12)
    assert late["watch.sum"][-1] == pytest.approx(2 * 0.6 + 7 * (2.0 - 0.6), rel=1e-12)


def test_a_condition_begins_a_fault_of_an_input_without_connection(folder, tmp_path):
    fault = '[[fault]]\nvariable = "sink.free"\nkind = "gain"\nvalue = 3.0\nwhen = "source.y > 0.45"\nfor_s = 0.3\n'
    rows = run(folder, tmp_path, fault + '[[event]]\nat_s = 0.7\nset = { "sink.free" = 5.0 }\n')
    t, seen = time_of(rows), rows["sink.free_seen"]
    for k in range(1, len(t)):
        before = round(t[k - 1], 9)
        sound = 5.0 if before >= 0.7 else 2.0
        assert seen[k] == (3 * sound if 0.5 <= before < 0.8 else sound), before


def test_noise_and_drop_outs_follow_their_seed(folder, tmp_path):
    noise = '[[fault]]\nvariable = "sink.u"\nkind = "noise"\ndeviation = 0.1\nat_s = 0.0\n'
    first, again = (run(folder, tmp_path / name, noise)["sink.seen"] for name in "ab")
    other = run(folder, tmp_path / "c", noise, seed=2)["sink.seen"]
    own = run(folder, tmp_path / "d", noise + "seed = 5\n", seed=2)["sink.seen"]
    same = run(folder, tmp_path / "e", noise + "seed = 5\n", seed=3)["sink.seen"]
    assert (first == again).all() and (own == same).all() and (first != other)[1:].all()
    off = first[1:] - np.arange(len(first) - 1) * H
    assert 0.03 < off.std() < 0.2
    drop = run(folder, tmp_path / "f", noise.replace("noise", "drop-out").replace("deviation = 0.1", "probability = 0.5"))
    kept = np.diff(drop["sink.seen"]) == 0
    assert 2 < kept.sum() < 18


@pytest.mark.parametrize(
    ("fault", "says"),
    [
        ('variable = "sink.w"\nkind = "freeze"\nat_s = 1.0', "does not exist"),
        ('variable = "sink.seen"\nkind = "freeze"\nat_s = 1.0', "feeds no number"),
        ('variable = "sink.u"\nkind = "freeze"', "`at_s` or `when`"),
        ('variable = "sink.u"\nkind = "offset"\nat_s = 1.0', "lacks `value`"),
        ('variable = "sink.u"\nkind = "ofset"\nat_s = 1.0', "offset"),
        ('variable = "sink.u"\nkind = "freeze"\nat_s = 1.0\nuntil_s = 2.0\nfor_s = 1.0', "one of"),
    ],
)
def test_a_fault_that_cannot_be_is_refused(folder, tmp_path, fault, says):
    assert says in run(folder, tmp_path, f"[[fault]]\n{fault}\n")


ROWS = {"torque": "torque of LF_j2 and LF_j3 lost", "loss": "LF_j2 breaks", "block": "LF_j3 blocked"}
# name, scenario, edits
LEGS = [("undisturbed", "torque", ["--set", "event=[]"]), ("torque", "torque", []), ("loss", "loss", []), ("block", "block", [])]


@pytest.fixture(scope="module")
def legs(tmp_path_factory):
    """x, y and heading of the four walks every 10 ms, and of those with a fault at half the step."""
    folder = tmp_path_factory.mktemp("legs")

    def walk(case, step):
        name, scenario, edits = case
        out = folder / f"{name}-{step}"
        step = ["--set", f"time.step_s={step}", "--set", f"recording.every_steps={round(0.01 / step)}"]
        done = terraglue("run", f"scenarios/leg_faults_{scenario}.toml", *edits, *step, "--csv", "--quiet", "--out", out, timeout=900)
        assert done.returncode == 0, done.stderr
        rows = csv.DictReader((out / "variables.csv").open())
        return np.array([[float(row[f"robot.body.{c}"]) for c in ("x", "y", "yaw")] for row in rows])

    with ThreadPoolExecutor(2) as pool:
        # the long ones first
        wanted = [(case, 2.5e-4) for case in LEGS[1:]] + [(case, 5e-4) for case in LEGS]
        walks = {(case[0], step): pool.submit(walk, case, step) for case, step in wanted}
        return {key: walk.result() for key, walk in walks.items()}


def apart(one, other):
    """Largest distance of two paths, m, and of two headings, rad."""
    assert one.shape == other.shape
    return np.hypot(*(one - other)[:, :2].T).max(), abs(one - other)[:, 2].max()


@pytest.mark.parametrize("fault", ["torque", "loss", "block"])
def test_the_fault_of_a_leg_shows_and_not_the_step(legs, fault):
    path, heading = apart(legs[fault, 5e-4], legs["undisturbed", 5e-4])
    half_path, half_heading = apart(legs[fault, 5e-4], legs[fault, 2.5e-4])
    assert path > 0.01 and heading > 0.01, "there is something to be seen"
    assert path >= 5 * half_path, f"path {1e3 * path:.1f} mm by the fault, {1e3 * half_path:.1f} mm by half the step"
    assert heading >= 5 * half_heading, f"heading {heading:.4f} rad by the fault, {half_heading:.4f} rad by half the step"
    shown = re.search(rf"^\| {ROWS[fault]} \| (.*)$", (ROOT / "docs" / "faults.md").read_text(), re.M)[1].split(" | ")
    measured = (1e3 * path, np.degrees(heading), 1e3 * half_path, np.degrees(half_heading))
    for cell, figure in zip(shown, measured):
        assert agrees(re.match(r"[\d.]+", cell)[0], figure), f"docs/faults.md shows {cell}, measured {figure:.4g}: run `cargo xtask docs`"
