"""A run that is served: changes by clients take effect and are recorded, changes that are not allowed are refused with the reason,
and watching changes nothing."""

import base64
import json
import random
import shutil
import struct
import subprocess
import urllib.error
import urllib.request

import cfmu
import pytest
from conftest import MOON_WALK, ROOT, terraglue
from mcap.reader import make_reader
from mcap.records import Schema
from served import Client, Refused, asked, served

TORQUE = "robot.RF_j2.max_torque"


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    """The folder of 0.6 s of the walk that nobody watches."""
    folder = tmp_path_factory.mktemp("plain") / "out"
    process = terraglue("run", MOON_WALK, "--duration", "0.6", "--out", folder)
    assert process.returncode == 0, process.stderr
    return folder


def messages(folder):
    """All messages of a recording but the text of its scenario."""
    with open(folder / "recording.mcap", "rb") as file:
        return [(c.topic, m.log_time, m.data) for _, c, m in make_reader(file).iter_messages()]


def walk(folder, *arguments):
    return served(MOON_WALK, "--duration", "0.6", "--out", folder, "--pace", "free", *arguments)


def test_a_run_with_three_watching_clients_gives_the_bytes_of_one_without(plain, tmp_path):
    with walk(tmp_path / "out", "--paused") as address, Client(address) as first, Client(address) as second, Client(address) as third:
        for client in (first, second, third):
            client.subscribe(*client.channels)
        first.call("run.play")
        first.state(lambda s: s["state"] == "ended")
        assert (tmp_path / "out" / "recording.mcap").read_bytes() == (plain / "recording.mcap").read_bytes()
        for client in (second, third):
            client.state(lambda s: s["state"] == "ended")
            assert client.latest["/tf"] and client.latest["/scene"]


def test_every_topic_of_the_recording_arrives_as_it_is_recorded(plain, tmp_path):
    with walk(tmp_path / "out", "--paused") as address, Client(address) as client:
        client.subscribe(*client.channels)
        received = []
        client.call("run.step", steps=200)
        while True:
            message = client.take()
            if message.get("topic") in ("/tf", "/robot") and message["t"] > 0:
                received.append((message["topic"], round(message["t"] * 1e9), message["data"]))
            if message.get("topic") == "/run" and json.loads(message["data"])["t_s"] > 0.1999:
                break
        recorded = [m for m in messages(plain) if m[0] in ("/tf", "/robot") and 0 < m[1] <= 200_000_000]
        assert received == recorded


def test_a_change_takes_effect_is_listed_and_can_be_undone(tmp_path):
    with walk(tmp_path / "out", "--paused") as address, Client(address) as client:
        client.subscribe("/changed", "/events")
        client.run_to(0.1)
        # a client of JavaScript writes 3 for 3.0
        assert client.set(TORQUE, 3) == 3.0
        assert client.get(TORQUE) == {TORQUE: 3.0}
        client.run_to(0.2)
        (change,) = json.loads(client.latest["/changed"])
        assert (change["id"], change["value"], change["was"]) == (TORQUE, 3.0, 60.0) and abs(change["t_s"] - 0.1) < 1e-9
        client.call("run.undo", id=TORQUE)
        assert client.get(TORQUE) == {TORQUE: 60.0}
        client.run_to(0.3)
        assert json.loads(client.latest["/changed"]) == []
        client.call("robot.LF_j2.block")
        client.call("run.play")
        client.state(lambda s: s["state"] == "ended")
    events = [data for topic, _, data in messages(tmp_path / "out") if topic == "/events"]
    assert len(events) == 3 and b"max_torque = 3.0 (was 60.0)" in events[0].replace(b"(was 60)", b"(was 60.0)")


@pytest.mark.parametrize(
    "name, value, words",
    [
        (TORQUE, -1, ["max_torque", "0", "-1"]), (TORQUE, "many", ["a number", "many"]), (TORQUE, None, ["a number"]),
        (TORQUE, [1, 2], ["a number"]), ("robot.RF_j2.torque", 1, ["read-only"]), ("robot.RF_j2.max_torqe", 1, ["did you mean", TORQUE]),
        ("robot.RF_j2.blocked", 3, ["true or false", "3"]), ("robot.RF_j2.angle", "far", ["a number", "far"]),
    ],
)
def test_a_wrong_write_is_refused_with_the_reason(refusing, name, value, words):
    before = refusing.get(TORQUE)
    with pytest.raises(Refused) as refused:
        refusing.set(name, value)
    for word in words:
        assert word in str(refused.value)
    assert refusing.get(TORQUE) == before


@pytest.fixture(scope="module")
def refusing(tmp_path_factory):
    with walk(tmp_path_factory.mktemp("refusing") / "out", "--paused") as address, Client(address) as client:
        client.run_to(0.01)
        yield client


def test_a_wrong_call_is_refused_with_the_reason(refusing):
    for name, request, word in [
        ("run.rewind", {"t_s": 5.0}, "not past yet"), ("run.step", {"steps": -1}, "steps"), ("run.pace", {"factor": 0}, "factor"),
        ("run.undo", {"id": "robot.body.x"}, "was not changed"), ("world.cast_ray", {"origin": [0, 0, 1], "direction": [0, 0, 0]}, "direction"),
        ("body.push", {"body": "robot.nobody", "force": [1, 0, 0], "moment": [0, 0, 0]}, "nobody"),
    ]:
        with pytest.raises(Refused, match=word):
            refusing.call(name, **request)


def test_a_ray_hits_the_robot_and_the_ground_below_it(refusing):
    x, y = (refusing.get(f"robot.body.{c}")[f"robot.body.{c}"] for c in "xy")
    hit = refusing.call("world.cast_ray", origin=[x, y, 3.0], direction=[0, 0, -2])["hit"]
    assert (hit["subsystem"], hit["body"]) == ("robot", "body") and 2 < hit["distance"] < 3
    hit = refusing.call("world.cast_ray", origin=[2.0, 1.5, 3.0], direction=[0, 0, -1])["hit"]
    assert (hit["subsystem"], hit["body"]) == ("soil", None)
    assert refusing.call("world.cast_ray", origin=[0, 0, 3.0], direction=[0, 0, 1]) == {"hit": None}


def test_what_was_changed_is_a_scenario_that_gives_the_same_bytes(tmp_path):
    with walk(tmp_path / "out", "--paused") as address, Client(address) as client:
        client.set("robot.LM_j2.max_torque", 20)
        client.run_to(0.123)
        client.set(TORQUE, 2.5)
        client.call("robot.LF_j3.block")
        client.call("body.push", body="robot.body", force=[5, 0, 2.5], moment=[0, 0.5, 0])
        client.run_to(0.2)
        client.call("body.push", body="robot.body", force=[0, 0, 0], moment=[0, 0, 0])
        text = client.call("run.changes")["scenario"]
        client.call("run.play")
        client.state(lambda s: s["state"] == "ended")
    (tmp_path / "models").symlink_to(MOON_WALK.parents[1] / "models")
    (tmp_path / "scenarios").mkdir()
    path = tmp_path / "scenarios" / "again.toml"
    path.write_text(text)
    process = terraglue("run", path, "--out", tmp_path / "again")
    assert process.returncode == 0, process.stderr
    assert messages(tmp_path / "again") == messages(tmp_path / "out")


def test_back_before_a_fault_and_on_without_it_is_a_run_that_never_had_it(plain, tmp_path):
    with walk(tmp_path / "out", "--paused") as address, Client(address) as client:
        client.run_to(0.2)
        client.set(TORQUE, 0)
        client.run_to(0.45)
        client.call("run.rewind", t_s=0.15)
        state = client.state(lambda s: s["branch"] == 1)
        assert state["state"] == "paused" and abs(state["t_s"] - 0.15) < 1e-9
        assert client.get(TORQUE) == {TORQUE: 60.0}
        client.call("run.play")
        client.state(lambda s: s["state"] == "ended")
    assert (tmp_path / "out-2" / "recording.mcap").read_bytes() == (plain / "recording.mcap").read_bytes()
    faulty = messages(tmp_path / "out")
    assert faulty[-1][1] == 450_000_000, "the way that was left keeps its recording"


def test_back_to_a_time_after_a_change_keeps_the_change(tmp_path):
    with walk(tmp_path / "out", "--paused") as address, Client(address) as client:
        client.run_to(0.1)
        client.set(TORQUE, 2)
        client.run_to(0.3)
        client.call("run.rewind", t_s=0.2)
        assert client.get(TORQUE) == {TORQUE: 2.0}
        client.run_to(0.3)
    before = [m for m in messages(tmp_path / "out") if m[1] <= 300_000_000 and m[0] != "/ground"]
    assert [m for m in messages(tmp_path / "out-2") if m[0] != "/ground"] == before


def test_the_start_again_is_the_run_as_it_was(plain, tmp_path):
    with walk(tmp_path / "out", "--paused") as address, Client(address) as client:
        client.run_to(0.1)
        client.set(TORQUE, 2)
        client.call("run.reset")
        client.state(lambda s: s["branch"] == 1 and s["t_s"] == 0)
        client.call("run.play")
        client.state(lambda s: s["state"] == "ended")
    assert (tmp_path / "out-2" / "recording.mcap").read_bytes() == (plain / "recording.mcap").read_bytes()


def test_what_can_be_written_before_the_start_only_waits_for_it(tmp_path):
    name = "robot.RF_j2.angle"
    with walk(tmp_path / "out", "--paused") as address, Client(address) as client:
        client.subscribe("/changed")
        client.run_to(0.05)
        now = client.get(name)[name]
        assert client.set(name, 0.25) == now, "until then it is what it is"
        client.set("robot.RM_j2.angle", 0.3)
        client.until(lambda m: b"RM_j2.angle" in client.latest.get("/changed", b""))
        pending = {c["id"]: c["value"] for c in json.loads(client.latest["/changed"]) if c.get("pending")}
        assert pending == {name: 0.25, "robot.RM_j2.angle": 0.3}
        client.call("run.undo", id="robot.RM_j2.angle")
        client.call("run.reset")
        client.state(lambda s: s["branch"] == 1)
        assert client.get(name)[name] == 0.25
        fits = lambda c: (c["id"], c["value"], c.get("pending")) == (name, 0.25, None)
        client.until(lambda m: [fits(c) for c in json.loads(client.latest["/changed"])] == [True])
        text = client.call("run.changes")["scenario"]
        assert f'set = {{ "{name}" = 0.25 }}' in text


def test_other_viewers_get_the_ground_as_triangles(tmp_path):
    decoder = pytest.importorskip("mcap_protobuf.decoder").DecoderFactory()
    with walk(tmp_path / "out", "--paused") as address, Client(address) as client:
        channel = client.channels["/ground/mesh"]
        assert (channel["encoding"], channel["schemaName"], channel["schemaEncoding"]) == ("protobuf", "foxglove.SceneUpdate", "protobuf")
        schema = Schema(id=1, name=channel["schemaName"], encoding="protobuf", data=base64.b64decode(channel["schema"]))
        read = decoder.decoder_for("protobuf", schema)
        client.run_to(0.01)
        client.subscribe("/ground/mesh")
        first = client.until(lambda m: m.get("topic") == "/ground/mesh")["data"]
        whole = read(first)
        ids = {e.id for e in whole.entities}
        assert len(ids) == len(whole.entities) > 0
        for entity in whole.entities:
            (triangles,) = entity.triangles
            assert max(triangles.indices) < len(triangles.points) == len(triangles.colors)
        xs = [p.x for e in whole.entities for p in e.triangles[0].points]
        assert max(xs) - min(xs) > 3
        # then what has changed alone
        client.run_to(0.3)
        while client.latest["/ground/mesh"] == first:
            client.take()
        some = read(client.latest["/ground/mesh"])
        assert set() < {e.id for e in some.entities} < ids


def test_another_recording_is_asked_beside_the_run(plain, tmp_path):
    with walk(tmp_path / "out", "--paused", "--with", plain) as address, Client(address) as client:
        client.run_to(0.2)
        about = json.loads(asked(address, "/beside/about"))
        assert about["name"] == "out" and abs(about["to_s"] - 0.6) < 1e-6
        topics = {c["id"]: c["topic"] for c in about["channels"]}
        frames = asked(address, "/beside/at?t=0.5&topics=/tf")
        number, time_ns, size = struct.unpack_from("<IQI", frames)
        last = [m for m in messages(plain) if m[0] == "/tf" and m[1] <= 500_000_000][-1]
        assert topics[number] == "/tf" and (time_ns, frames[16 : 16 + size]) == last[1:]
        history = json.loads(asked(address, "/beside/history?names=robot.LF_j2.torque"))
        assert history["t"][-1] > 0.59
    with walk(tmp_path / "other", "--paused") as address, pytest.raises(urllib.error.HTTPError):
        asked(address, "/beside/about")
    process = terraglue("serve", MOON_WALK, "--with", ROOT / "docs", "--no-open", "--out", tmp_path / "none")
    assert process.returncode == 2 and "recording.mcap" in process.stderr


@pytest.mark.parametrize(
    "key, value, words",
    [
        ("camera", '"sid"', ["camera", "did you mean", "side"]), ("camera", '"side,1,2"', ["side,1,2", "distance"]), ("ground", '"mud"', ["mud", "sinkage"]),
        ("layers", '["fources"]', ["fources", "forces"]), ("plots", '["robot.LF_j2.torqe"]', ["robot.LF_j2.torqe", "robot.LF_j2.torque"]),
        ("plots", '["rob.x"]', ["rob", "robot"]), ("select", '"robot.LF_j22"', ["robot.LF_j22"]),
    ],
)
def test_a_wrong_layout_is_refused_by_its_key(key, value, words):
    process = terraglue("check", MOON_WALK, "--set", f"page.{key}={value}")
    assert process.returncode == 2
    for word in words:
        assert word in process.stderr


def test_the_past_is_that_of_the_recording(plain, tmp_path):
    recorded = messages(plain)
    with walk(tmp_path / "out") as address, Client(address) as client:
        client.state(lambda s: s["state"] == "ended")
        channel = {c["id"]: topic for topic, c in client.channels.items()}
        for t in (0.0, 0.1, 0.234, 0.6):
            frames = asked(address, f"/at?t={t}&topics=/tf,/contact_forces,/robot")
            at, found = 0, {}
            while at < len(frames):
                number, time_ns, size = struct.unpack_from("<IQI", frames, at)
                found[channel[number]] = (time_ns, frames[at + 16 : at + 16 + size])
                at += 16 + size
            for topic in ("/tf", "/contact_forces", "/robot"):
                last = [m for m in recorded if m[0] == topic and m[1] <= round(t * 1e9)][-1]
                assert found[topic] == last[1:], (topic, t)
        history = json.loads(asked(address, "/history?names=robot.LF_j2.torque,robot.nothing&points=100000"))
        assert len(history["t"]) == len([m for m in recorded if m[0] == "/robot"])
        assert all(v is None for v in history["values"][1]) and all(isinstance(v, float) for v in history["values"][0])


def test_a_recording_is_replayed_and_cannot_be_changed(plain):
    with served(plain) as address, Client(address) as client:
        client.subscribe("/tf")
        assert client.state()["mode"] == "replay"
        client.call("run.seek", t_s=0.3)
        last = [m for m in messages(plain) if m[0] == "/tf" and m[1] <= 300_000_000][-1]
        client.until(lambda m: m.get("topic") == "/tf" and m["data"] == last[2])
        with pytest.raises(Refused, match="recording cannot be changed"):
            client.set(TORQUE, 1)
        assert client.get(TORQUE)[TORQUE] == 60.0
        client.call("run.pace", factor=5)
        client.call("run.play")
        assert abs(client.state(lambda s: s["state"] == "paused" and s["t_s"] > 0.5)["t_s"] - 0.6) < 1e-6


def test_only_one_client_is_at_the_controls(tmp_path):
    with walk(tmp_path / "out", "--paused") as address, Client(address) as first, Client(address) as second:
        first.set(TORQUE, 3)
        assert second.state()["may_write"] is False
        with pytest.raises(Refused, match="another client"):
            second.set(TORQUE, 4)
        with pytest.raises(Refused, match="another client"):
            second.call("run.play")
        first.socket.close()
        second.state(lambda s: s["may_write"])
        assert second.set(TORQUE, 4) == 4.0


def test_foreign_pages_get_nothing(tmp_path):
    with walk(tmp_path / "out", "--paused", "--allow-origin", "https://viewer.example") as address:
        for headers, status in [
            ({"Origin": "https://evil.example"}, 403), ({"Origin": "null"}, 403), ({"Host": "evil.example"}, 403),
            ({"Origin": "https://viewer.example"}, 200), ({"Origin": address.rstrip("/")}, 200), ({}, 200),
        ]:
            for path in ("", "at?t=0&topics=/tf"):
                request = urllib.request.Request(address + path, headers=headers)
                opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
                try:
                    got = opener.open(request).status
                except urllib.error.HTTPError as error:
                    got = error.code
                assert got == status, headers
        with pytest.raises(Exception, match="403"):
            Client(address, origin="https://evil.example")


def test_noise_leaves_the_run_untouched(plain, tmp_path):
    seeded = random.Random(7)
    with walk(tmp_path / "out", "--paused") as address, Client(address) as watching:
        for _ in range(20):
            with Client(address) as client:
                for _ in range(100):
                    kind = seeded.randrange(5)
                    size = seeded.randrange(40)
                    noise = bytes(seeded.randrange(256) for _ in range(size))
                    if kind == 0:
                        client.socket.send(noise)
                    elif kind == 1:
                        client.socket.send(noise.decode("latin-1"))
                    elif kind == 2:
                        client.say(op=seeded.choice(["subscribe", "unsubscribe", "getParameters", "fetchAsset", "nothing"]), subscriptions=[{"id": 1, "channelId": seeded.randrange(1 << 40)}], subscriptionIds=[seeded.randrange(99)], parameterNames=["a", "robot.."], uri="x", requestId=1)
                    elif kind == 3:
                        client.socket.send(struct.pack("<BIII", 2, seeded.randrange(1 << 32), 1, seeded.randrange(1 << 32)) + noise)
                    else:
                        client.say(op="setParameters", parameters=[{"name": noise.decode("latin-1"), "value": size}, {"name": TORQUE, "value": "x"}])
        # whoever wrote first is gone once the server has seen it
        watching.state(lambda s: s["may_write"])
        watching.call("run.play")
        watching.state(lambda s: s["state"] == "ended")
    assert (tmp_path / "out" / "recording.mcap").read_bytes() == (plain / "recording.mcap").read_bytes()


def test_a_client_that_stops_reading_holds_nobody_up(plain, tmp_path):
    with walk(tmp_path / "out", "--paused") as address, Client(address) as still, Client(address) as watching:
        still.subscribe(*still.channels)
        watching.call("run.play")
        watching.state(lambda s: s["state"] == "ended")
    assert (tmp_path / "out" / "recording.mcap").read_bytes() == (plain / "recording.mcap").read_bytes()


def test_a_run_that_fails_says_so_and_keeps_what_it_has(tmp_path):
    # the ground ends where the robot walks
    small = ["--set", "terrain.size_m=[1.2, 2.0]", "--set", "soil.tile_nodes=16"]
    with served(MOON_WALK, "--duration", "30", "--out", tmp_path / "out", "--pace", "free", *small[:2]) as address, Client(address) as client:
        state = client.state(lambda s: s["state"] in ("failed", "ended"))
        assert state["state"] == "failed" and "ground" in state["error"]
        with pytest.raises(Refused, match="over"):
            client.call("run.play")
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["status"] == "failed"


def test_a_module_that_ends_the_program_leaves_a_closed_recording(tmp_path):
    real = [("x", "output", 0.0, "m"), ("rate", "parameter", 1.0, "m/s")]
    fmu = cfmu.build(tmp_path, "leaves", real, "if (t > 0.45) _exit(0); r[0] = t + h;", more="void _exit(int);")
    scenario = tmp_path / "one.toml"
    scenario.write_text(f'[time]\nduration_s = 1.0\nstep_s = 0.1\n[one]\nfmu = "{fmu.name}"\n')
    ended = terraglue("serve", scenario, "--out", tmp_path / "out", "--pace", "free", "--no-open", "--port", 0)
    assert ended.returncode == 1 and "`one` ended the program" in ended.stderr, ended.stderr
    times = [time for topic, time, _ in messages(tmp_path / "out") if topic == "/one"]
    assert times[-1] >= 300_000_000
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["status"] == "failed"


def test_run_with_serve_is_the_same_run(plain, tmp_path):
    process = terraglue("run", MOON_WALK, "--duration", "0.6", "--out", tmp_path / "out", "--serve")
    assert process.returncode == 0, process.stderr
    assert "http://127.0.0.1:" in process.stdout
    assert (tmp_path / "out" / "recording.mcap").read_bytes() == (plain / "recording.mcap").read_bytes()
    assert (tmp_path / "out" / "report.html").exists()


@pytest.mark.parametrize(
    "arguments, words",
    [
        (["nothing.toml"], ["nothing.toml"]), (["{docs}"], ["recording.mcap"]), (["{walk}", "--pace", "fast"], ["--pace", "free"]),
        (["{walk}", "--host", "192.0.2.1", "--port", "1"], ["192.0.2.1", "--host"]), (["{walk}", "--port", "70000"], ["--port"]),
    ],
)
def test_wrong_input_is_named(tmp_path, arguments, words):
    places = {"docs": MOON_WALK.parents[1] / "docs", "walk": MOON_WALK}
    process = terraglue("serve", *(a.format(**places) for a in arguments), "--no-open", "--out", tmp_path / "out")
    assert process.returncode == 2
    for word in words:
        assert word in process.stderr


def test_the_client_of_foxglove_and_lichtblick_lists_sets_is_refused_and_receives_all(tmp_path):
    node, npm = shutil.which("node"), shutil.which("npm")
    if not (node and npm):
        pytest.skip("needs node and npm")
    packages = ["@foxglove/ws-protocol@0.8.0", "ws@8"]
    installed = subprocess.run([npm, "install", "--no-audit", "--no-fund", "--prefix", tmp_path, *packages], capture_output=True, text=True)
    if installed.returncode:
        pytest.skip(f"the packages cannot be installed: {installed.stderr[-200:]}")
    script = tmp_path / "client.cjs"
    script.write_text((ROOT / "tests" / "python" / "foxglove_client.cjs").read_text())
    listed = json.loads(terraglue("variables", MOON_WALK, "--json").stdout)
    with walk(tmp_path / "out", "--paused") as address:
        process = subprocess.run([node, script, address.replace("http", "ws")], capture_output=True, text=True, timeout=120)
    assert process.returncode == 0, process.stderr
    found = json.loads(process.stdout)
    scalars = {v["name"] for v in listed["variables"]} if isinstance(listed, dict) else {v["name"] for v in listed}
    assert scalars <= set(found["parameters"])
    assert found["taken"] == [{"name": TORQUE, "value": 0, "type": "float64"}] == found["refused"]
    assert len(found["statuses"]) == 1 and "-1" in found["statuses"][0] and found["acted"] and found["silent"] == []
