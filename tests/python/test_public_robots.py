"""Public robots against an oracle, where the packages are there; docs/robots.md explains how to get them."""

import importlib.util

import pytest

import public_robots


@pytest.mark.skipif(importlib.util.find_spec("pinocchio") is None, reason="pin is not installed: docs/robots.md has the command")
@pytest.mark.skipif(importlib.util.find_spec("mujoco") is None, reason="mujoco is not installed: docs/robots.md has the command")
def test_robots_of_example_robot_data_have_the_oracles_numbers():
    robots = list(public_robots.all_robots(["example-robot-data"]))
    if not robots:
        pytest.skip("example-robot-data is not installed: docs/robots.md has the command")
    verdicts = {path: public_robots.tried(path, kind) for _, path, kind in robots}
    wrong = {str(path): said for path, (verdict, said, _) in verdicts.items() if verdict == "WRONG"}
    assert not wrong
    assert sum(verdict == "agrees" for verdict, _, _ in verdicts.values()) >= 30
