"""A range finder: the distance to the first surface along its axis x.

[module]
name = "my-range-finder"
kind = "sensor"
can = "sees"

[parameters]
mount = { type = "text", help = "Body that it sits on: SUBSYSTEM.BODY" }
range_m = { default = 10.0, unit = "m", help = "Farthest surface that it meets", above_min = true, min = 0.0 }

[variables]
distance = "output f64 m"
"""
import terraglue as tg


class RangeFinder(tg.Subsystem):
    can = tg.SEES
    variables = [tg.Variable("distance", "m", tg.OUTPUT, "Distance of the first surface")]
    streams = [tg.Stream("scan", "foxglove.LaserScan", "json", help="The same as a scan of one ray")]

    def __init__(self, host, config):
        self.subsystem, self.body = config["mount"].split(".", 1)
        self.range = config["range_m"]
        self.distance, self.time = self.range, None

    def advance(self, step, input, out):
        pass

    def observe(self, step, world):
        body = world.body(self.subsystem, self.body)
        position, (w, x, y, z), _, _ = world.pose(body, world.time)
        along = (1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y))
        hits = world.cast_rays([(*position, *along, world.time, self.range)], skip=body)
        self.distance, self.time = min(hits[0][0], self.range), world.time

    def stream(self, k):
        if self.time is None:
            return None
        text = '{"frame_id": "%s/%s", "start_angle": 0, "end_angle": 0, "ranges": [%r], "intensities": []}'
        return self.time, (text % (self.subsystem, self.body, self.distance)).encode()
