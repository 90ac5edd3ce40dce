"""Points of a scanner as an array, against the plane that it looks at."""

import numpy as np
import pytest
from conftest import PLATE

HEIGHT = 0.5
SCANNER = {
    "module": "laser-scanner", "mount": "bevameter.world", "mount_offset": [0.0, 0.0, HEIGHT], "pattern": "vlp-16",
    "rate_hz": 20.0, "noise_m": 0.0, "drop_out": 0.0, "farthest_m": 5.0,
}


def rotated(quaternion, points):
    w, v = quaternion[0], quaternion[1:]
    return points + 2.0 * np.cross(v, np.cross(v, points) + w * points)


def test_points_of_a_scanner_lie_on_the_ground(tg):
    scenario = {**PLATE, "terrain": {"kind": "flat", "size_m": [8.0, 8.0], "spacing_m": 0.05}, "scanner": SCANNER}
    with tg.Testbed(scenario) as testbed:
        assert testbed.streams == ["scanner.points"]
        assert testbed.points("scanner.points") is None, "the first turn is not over"
        while (cloud := testbed.points("scanner.points")) is None:
            testbed.step()
        t, raw = testbed.message("scanner.points")
    # the frame of a base that is fixed is that of the world
    assert cloud.t == t and cloud.frame == "bevameter/world" and len(cloud.data) > 100
    assert {"x", "y", "z", "intensity", "ring", "body"} <= set(cloud.data.dtype.names)
    assert set(cloud.data["ring"].tolist()) <= set(range(16))
    world = rotated(cloud.orientation, cloud.xyz.astype(float)) + cloud.position
    # numbers of 32 bits, up to 5 m away
    ground = world[np.abs(world[:, 2]) < 1e-5]
    assert len(ground) > 0.9 * len(world)
    assert np.hypot(*ground[:, :2].T).max() < 5.0
    assert cloud.data.tobytes() in raw


def test_streams_without_points_are_named(tg):
    with tg.Testbed({**PLATE, "scanner": SCANNER}) as testbed:
        with pytest.raises(KeyError, match="scanner.points"):
            testbed.points("scanner.point")
    stand = {**PLATE, "stand": {"module": "forest"}}
    with tg.Testbed(stand) as testbed:
        with pytest.raises(tg.InputError, match="terraglue.TreeMap"):
            testbed.points("stand.map")


def test_a_message_that_contradicts_itself_is_an_error(tg):
    head = (0.5, "robot/body", [0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0])
    assert len(tg.PointCloud._of(head, [("x", "<f4", 0)], 8, b"").data) == 0
    for fields, stride, data in [([("x", "<f4", 0)], 8, b"1234567"), ([("x", "<f4", 6)], 8, b"12345678"), ([("x", "<f4", 0), ("x", "<f4", 4)], 8, b"12345678")]:
        with pytest.raises(tg.InputError, match="t = 0.5 s"):
            tg.PointCloud._of(head, fields, stride, data)
