"""Sensors in whole runs: the same bytes for any number of threads, isolated and not, and a cloud that one module in Python reads of
another."""

import csv

from conftest import terraglue
from mcap.reader import make_reader

SENSORS = """
[imu]
module = "sensor"
kind = "imu"
mount = "robot.body"
rate_hz = 200
noise = 0.02
turn_noise = 0.001
isolate = {isolate}

[lidar]
module = "sensor"
kind = "range-finder"
mount = "robot.body"
mount_offset = [0.3, 0.0, 0.1, 0.9238795325112867, 0.0, 0.3826834323650898, 0.0]
noise = 0.003
delay_s = 0.01
isolate = {isolate}

[report]
"""


def messages(path):
    """All messages, without those about the scenario."""
    with open(path, "rb") as file:
        return [(c.topic, m.log_time, m.data) for _, c, m in make_reader(file).iter_messages()]


def test_recordings_with_two_sensors_are_the_same_bytes_for_any_threads_isolated_and_not(edited, tmp_path):
    scenario = edited("[report]", SENSORS.format(isolate="false"))
    isolated = scenario.with_name("isolated.toml")
    isolated.write_text(scenario.read_text().replace("isolate = false", "isolate = true"))
    assert isolated.read_text() != scenario.read_text()
    found = {}
    for path in (scenario, isolated):
        for threads in (1, 2, 5):
            out = tmp_path / f"{path.stem}-{threads}"
            done = terraglue("run", path, "--duration", "0.25", "--threads", threads, "--out", out, "--quiet", "--no-report")
            assert done.returncode == 0, done.stderr
            found[path.stem, threads] = (out / "recording.mcap").read_bytes()
    for path in (scenario, isolated):
        assert found[path.stem, 1] == found[path.stem, 2] == found[path.stem, 5], path.stem
    one, other = (messages(tmp_path / f"{path.stem}-1" / "recording.mcap") for path in (scenario, isolated))
    assert one == other
    seen = {data for topic, _, data in one if topic == "/lidar"}
    assert len(seen) > 10, "the sensor sees nothing that changes"


SCANNER = '''"""A scanner: a cloud of nine points of the ground below a body, ten times a second.

[module]
name = "scanner"
kind = "sensor"
can = "retry state serialize sees"

[parameters]
mount = { type = "text", help = "Body that it sits on" }
"""
import struct

import terraglue as tg


class Scanner(tg.Subsystem):
    can = tg.RETRY | tg.SEES
    streams = [tg.Stream("cloud", "test.Cloud", "raw", rate_hz=10.0, most_bytes=216)]

    def __init__(self, host, config):
        self.mount = config["mount"].split(".", 1)
        self.state = {"time": None, "cloud": b""}

    def advance(self, step, input, out):
        pass

    def observe(self, step, world):
        (x, y, _), *_ = world.pose(world.body(*self.mount), world.time)
        places = [(x + 0.1 * a, y + 0.1 * b) for a in (-1, 0, 1) for b in (-1, 0, 1)]
        points = [(*p, z) for p, z in zip(places, world.ground_heights(places))]
        cloud = b"".join(struct.pack("<3d", *p) for p in points)
        self.state = {"time": world.time, "cloud": cloud.hex()}

    def stream(self, k):
        return None if self.state["time"] is None else (self.state["time"], bytes.fromhex(self.state["cloud"]))
'''

MAPPER = '''"""Tells how many clouds came, and the mean place and height of the last one.

[module]
name = "mapper"
kind = "controller"
can = "retry state serialize"

[variables]
cloud = "input binary"
count = "output f64"
x = "output f64 m"
height = "output f64 m"
"""
import struct

import terraglue as tg


class Mapper(tg.Subsystem):
    can = tg.RETRY
    variables = [
        tg.Variable("cloud", "", tg.INPUT, "Points", type=tg.BINARY),
        tg.Variable("count", "", tg.OUTPUT, "Clouds so far"),
        tg.Variable("x", "m", tg.OUTPUT, "Mean x"),
        tg.Variable("height", "m", tg.OUTPUT, "Mean height"),
    ]

    def __init__(self, host, config):
        self.state = {"count": 0.0, "x": 0.0, "height": 0.0}

    def advance(self, step, input, out):
        pass

    def set_value(self, variable, value):
        points = list(struct.iter_unpack("<3d", value))
        x, height = (sum(p[k] for p in points) / len(points) for k in (0, 2))
        self.state = {"count": self.state["count"] + 1.0, "x": x, "height": height}

    def get_value(self, variable):
        return b"" if variable.name == "cloud" else self.state[variable.name]
'''

SCENARIO = """
[time]
step_s = 0.01
duration_s = 1.0

[terrain]
kind = "slope"
angle_rad = 0.1
size_m = [6.0, 2.0]
spacing_m = 0.05

[recording]
every_steps = 1

[cart]
module = "rigid-body"
model = "cart.urdf"
position_m = [0.0, 0.0, 1.0]
place_on_ground = false

[scanner]
module = "./scanner.py"
mount = "cart.cart"
step_multiple = 10

[mapper]
module = "./mapper.py"

[soil]
module = "soil-bekker"
n = 1.0
k_c = 1400.0
k_phi = 820000.0
c_pa = 170.0
phi_rad = 0.61
K_m = 0.018

[[connect]]
from = "scanner.cloud"
to = "mapper.cloud"
"""

CART = """<robot name="cart"><link name="cart"><inertial><mass value="1"/>
<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>"""


def mapped(folder, *arguments):
    """Rows of the mapper over time."""
    (folder / "scanner.py").write_text(SCANNER)
    (folder / "mapper.py").write_text(MAPPER)
    (folder / "cart.urdf").write_text(CART)
    (folder / "mapping.toml").write_text(SCENARIO)
    done = terraglue("run", folder / "mapping.toml", "--csv", "--quiet", "--no-report", "--out", folder / "out", *arguments)
    assert done.returncode == 0, done.stderr
    with open(folder / "out" / "variables.csv", newline="") as file:
        return list(csv.DictReader(file))


def test_a_module_in_python_maps_the_cloud_of_another(tmp_path):
    table = mapped(tmp_path)
    counts = [float(row["mapper.count"]) for row in table]
    # the cloud of the start arrives in the first step, and each other one in the step after it was made
    assert counts == [0.0] + [1.0 + (k - 1) // 10 for k in range(1, 101)]
    lattice = {round(float(row["mapper.height"]), 6) for row in table[1:]}
    assert len(lattice) >= 1 and all(abs(height) < 0.3 for height in lattice)


def test_faults_cut_and_freeze_the_cloud(tmp_path):
    cut = """fault=[{ variable = "scanner.cloud", kind = "drop-out", probability = 1.0, at_s = 0.25, until_s = 0.55 }]"""
    counts = [float(row["mapper.count"]) for row in mapped(tmp_path, "--set", cut)]
    # those of 0.3, 0.4 and 0.5 s are lost
    assert counts[-1] == 7.0 and counts[30] == counts[55] == 3.0
    frozen = cut.replace("drop-out", "freeze").replace("probability = 1.0, ", "")
    table = mapped(tmp_path, "--set", frozen)
    assert [float(row["mapper.count"]) for row in table][-1] == 10.0
    for what in ("x", "height"):
        values = [float(row[f"mapper.{what}"]) for row in table]
        assert len(set(values[22:56])) == 1, what


def test_a_fault_that_a_stream_cannot_have_is_refused(tmp_path):
    mapped(tmp_path)
    fault = 'fault=[{ variable = "scanner.cloud", kind = "gain", value = 2.0, at_s = 0.1 }]'
    done = terraglue("check", tmp_path / "mapping.toml", "--set", fault)
    assert done.returncode == 2
    assert "`freeze` and `drop-out`" in done.stderr, done.stderr


def scanned(folder, stream):
    """A short run of the scanner with another `stream`, and with two streams of up to 100 MB."""
    text = SCANNER.replace('rate_hz=10.0, most_bytes=216)]', 'rate_hz=0.0, most_bytes=100_000_000), tg.Stream("other", "test.Cloud", "raw", '
                           'rate_hz=0.0, most_bytes=100_000_000)]')
    start = text.index("        return None if self.state")
    (folder / "scanner.py").write_text(text[:start] + f"        {stream}\n")
    (folder / "mapper.py").write_text(MAPPER)
    (folder / "cart.urdf").write_text(CART)
    (folder / "mapping.toml").write_text(SCENARIO)
    return terraglue("run", folder / "mapping.toml", "--duration", "0.03", "--quiet", "--no-report", "--out", folder / "out")


def test_messages_that_are_too_long_together_are_left_out_and_stop_no_step(tmp_path):
    done = scanned(tmp_path, "return (self.state['time'], bytes(24 if k == 0 else 80_000_000)) if self.state['time'] == 0.0 else None")
    assert done.returncode == 0, done.stderr
    assert done.stderr.count("is left out") == 1 and "stream `other`" in done.stderr, done.stderr


def test_a_message_that_is_none_is_told_with_its_stream(tmp_path):
    for wrong in ("'text'", "5", "(0.0, 5)"):
        done = scanned(tmp_path, f"return {wrong}")
        said = " ".join(done.stderr.replace("│", " ").split())
        assert done.returncode == 1 and "stream `cloud`" in said and "(time, bytes)" in said, said
