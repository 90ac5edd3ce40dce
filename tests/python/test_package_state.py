"""States as bytes, values over time, actions, and numbers to their last bit."""

import os
import random
import subprocess
import sys

import numpy as np
import pytest
from conftest import PLATE

WALK = {"soil.module": "soil-cellular-automaton"}


def test_a_state_as_bytes_goes_on_to_the_same_bits_in_another_process(tg, site, tmp_path):
    testbed = tg.Testbed("moon_walk", set=WALK, seed=4)
    testbed.run_until(0.1)
    testbed["robot.LF_j2.max_torque"] = 12.5
    state = testbed.serialize()
    assert testbed.serialize() == state
    testbed.run_until(0.2)
    names, once = testbed.names, testbed.read(testbed.names)
    (tmp_path / "state").write_bytes(state)
    code = f"""
import numpy as np, terraglue
testbed = terraglue.Testbed("moon_walk", set={WALK!r}, seed=4)
testbed.deserialize(open("state", "rb").read())
assert testbed.serialize() == open("state", "rb").read()
testbed.run_until(0.2)
np.save("values.npy", testbed.read(testbed.names))
"""
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, env={**os.environ, "PYTHONPATH": str(site)}, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    there = np.load(tmp_path / "values.npy")
    assert np.array_equal(there, once, equal_nan=True), [n for n, a, b in zip(names, once, there) if a != b]
    # back in place, also where it has gone on
    testbed.deserialize(state)
    assert testbed.t == pytest.approx(0.1)
    testbed.run_until(0.2)
    assert np.array_equal(testbed.read(names), once, equal_nan=True)


def test_a_state_of_something_else_is_refused(tg, tmp_path):
    testbed = tg.Testbed(PLATE)
    testbed.step(5)
    state = testbed.serialize()
    others = (
        ({"soil.parameters": "dry_sand_LLL_K010"}, None, "parameters"),
        ({"world.gravity_m_s2": [0.0, 0.0, -1.62]}, None, "gravity"),
        (None, 5, "seed"),
    )
    for edit, seed, words in others:
        other = tg.Testbed(PLATE, set=edit, seed=seed)
        before = other.read(other.names)
        with pytest.raises(tg.InputError, match=f"another scenario: `.*{words}"):
            other.deserialize(state)
        assert np.array_equal(other.read(other.names), before, equal_nan=True) and other.t == 0.0
    changed = bytearray(state)
    changed[len(changed) // 2] ^= 1
    for wrong in (b"", b"TGS1", state[:-1], state + b"x", bytes(changed)):
        with pytest.raises(tg.InputError, match=f"these {len(wrong)} bytes are no state"):
            testbed.deserialize(wrong)
    with tg.Testbed(PLATE, out=tmp_path / "run") as recorded:
        assert recorded.serialize()
        with pytest.raises(tg.InputError, match="recorded"):
            recorded.deserialize(state)


def test_values_are_observed_at_every_communication_point(tg):
    names = ["bevameter.small_press.angle", "bevameter.small_press.torque"]
    testbed, by_hand = tg.Testbed(PLATE), tg.Testbed(PLATE)
    for one in (testbed, by_hand):
        one["bevameter.small_press.velocity_target"] = 0.03
    seen, seldom = testbed.observe(names), testbed.observe(names[:1], every=10)
    testbed.step(40)
    rows = []
    for _ in range(40):
        by_hand.step()
        rows.append([by_hand.t, *by_hand.read(names)])
    rows = np.array(rows)
    assert np.array_equal(seen.t, rows[:, 0]) and np.array_equal(seen.values, rows[:, 1:])
    assert np.array_equal(seldom.values[:, 0], rows[9::10, 1]) and len(seldom) == 4
    assert seen.names == names and seen.units == testbed.units(names) == ["m", "N"]
    seen.clear()
    assert len(seen) == 0 and seen.values.shape == (0, 2)
    del seldom
    testbed.run_until(0.05)
    assert len(seen) == 10
    for wrong, error in ((lambda: testbed.observe(["bevameter.nothing"]), KeyError), (lambda: testbed.observe(names, every=0), ValueError)):
        with pytest.raises(error):
            wrong()


def test_actions_are_listed_and_unknown_ones_have_a_neighbour(tg):
    testbed = tg.Testbed("moon_walk")
    assert testbed.actions["robot.LF_j2.break"] == "Remove the joint for ever"
    testbed.act("robot.LF_j2.block")
    before = testbed["robot.LF_j2.angle"]
    testbed.step(30)
    assert testbed["robot.LF_j2.angle"] == pytest.approx(before, abs=1e-6)
    testbed.act("robot.LF_j2.release")
    for wrong in ("robot.LF_j2.brake", "robott.LF_j2.break", "robot"):
        with pytest.raises(KeyError, match="there is no action"):
            testbed.act(wrong)
    with pytest.raises(KeyError, match="robot.LF_j2.break"):
        testbed.act("robot.LF_j2.brek")


def test_a_number_arrives_to_its_last_bit(tg):
    rng = random.Random(3)
    numbers = [rng.uniform(0.001, 0.3) for _ in range(60)] + [0.1 + 0.2 - 0.1, float(np.nextafter(0.1, 1.0)), 5e-324]
    testbed, name = tg.Testbed("moon_walk"), "gait.speed"
    for number in numbers:
        testbed[name] = number
        assert testbed[name] == number
        testbed.write([name], np.array([number]))
        assert testbed.read([name])[0] == number
    testbed[name] = np.float32(0.1)
    assert testbed[name] == float(np.float32(0.1))
    # in a scenario: by its text and by an edit, into a module behind the interface in C
    for number in numbers[:6]:
        assert tg.Testbed("moon_walk", set={"gait.speed_m_s": number})[name] == number
    for number in numbers[:3]:
        # by a table, and by an edit
        table = {**PLATE, "bevameter": {**PLATE["bevameter"], "max_torque": 1000.0 * number}}
        edited = {"bevameter.max_torque": 1000.0 * number}
        for testbed in (tg.Testbed(table), tg.Testbed(PLATE, set=edited)):
            assert testbed["bevameter.small_press.max_torque"] == 1000.0 * number


def test_values_that_are_none_of_a_scenario_are_refused(tg):
    testbed, name = tg.Testbed(PLATE), "bevameter.small_press.velocity_target"
    endless = []
    endless.append(endless)
    wrong = [(float("nan"), "finite"), (float("inf"), "finite"), (2**70, "64 bits"), (object(), "type object"), ({1: 2}, "no key"), (endless, "levels")]
    for value, words in wrong:
        with pytest.raises(tg.InputError, match=words):
            testbed[name] = value
        with pytest.raises(tg.InputError, match=words):
            tg.Testbed(PLATE, set={"bevameter.max_torque": value})
    with pytest.raises(tg.InputError, match="finite"):
        testbed.write([name], np.array([np.inf]))
    with pytest.raises(tg.InputError, match="key path"):
        tg.Testbed(PLATE, set={3: 1})
    assert testbed[name] == 0.0


def test_inputs_are_driven_row_by_row(tg):
    name, seen = "bevameter.small_press.velocity_target", ["bevameter.small_press.angle"]
    testbed, by_hand = tg.Testbed(PLATE), tg.Testbed(PLATE)
    speeds = np.linspace(0.0, 0.05, 30)[:, None]
    rows = testbed.drive([name], speeds, seen)
    single = []
    for speed in speeds:
        by_hand.write([name], speed)
        by_hand.step()
        single.append(by_hand.read(seen))
    assert np.array_equal(rows, np.array(single)) and testbed.t == by_hand.t
    with pytest.raises(ValueError, match="1 numbers in each row"):
        testbed.drive([name], np.zeros((2, 2)), seen)
    with pytest.raises(KeyError):
        testbed.drive([name], speeds, ["bevameter.nothing"])
