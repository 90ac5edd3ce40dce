"""`terraglue serve` and a client of the Foxglove WebSocket protocol (`foxglove.websocket.v1`), as any other program is one."""

import json
import re
import struct
import subprocess
import time
import urllib.request
from contextlib import contextmanager

import pytest
from conftest import PROGRAM

# that it takes longer means that it hangs; how long work takes is up to the machine
WAIT_S = 300


@contextmanager
def served(what, *arguments):
    """The address of `terraglue serve`, which ends with the block."""
    command = [PROGRAM, "serve", str(what), "--no-open", "--port", "0", *map(str, arguments)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        found = next(filter(None, (re.search(r"http://\S+", line) for line in process.stdout)), None)
        assert found, process.stderr.read()
        yield found[0]
    finally:
        process.terminate()
        process.communicate(timeout=WAIT_S)


class Refused(Exception):
    """The run refused the request."""


class Client:
    """Speaks with a run; everything that comes in between is kept."""

    def __init__(self, address, **options):
        sync = pytest.importorskip("websockets.sync.client", reason="pip install websockets")
        url = address.replace("http://", "ws://")
        self.socket = sync.connect(url, subprotocols=["foxglove.websocket.v1"], max_size=None, proxy=None, ping_interval=None, close_timeout=0.2, **options)
        self.channels, self.services, self.latest, self.statuses, self.numbers = {}, {}, {}, [], 0
        self.until(lambda m: m.get("op") == "advertiseServices")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.close()

    def take(self, timeout=WAIT_S):
        """The next message: a text as it is, a binary one as a dictionary."""
        raw = self.socket.recv(timeout)
        if isinstance(raw, bytes):
            return self.binary(raw)
        message = json.loads(raw)
        if message["op"] == "advertise":
            self.channels.update({c["topic"]: c for c in message["channels"]})
        elif message["op"] == "advertiseServices":
            self.services = {s["name"]: s["id"] for s in message["services"]}
        elif message["op"] == "status":
            self.statuses.append(message)
        return message

    def binary(self, raw):
        kind = raw[0]
        if kind == 1:
            channel, time_ns = struct.unpack_from("<IQ", raw, 1)
            topic = next((t for t, c in self.channels.items() if c["id"] == channel), None)
            self.latest[topic] = raw[13:]
            return {"op": "message", "topic": topic, "t": time_ns / 1e9, "data": raw[13:]}
        if kind == 3:
            _, call, size = struct.unpack_from("<III", raw, 1)
            return {"op": "response", "call": call, "body": json.loads(raw[13 + size :])}
        return {"op": "time", "t": struct.unpack_from("<Q", raw, 1)[0] / 1e9}

    def until(self, wanted):
        """The first message for which `wanted` holds."""
        end = time.monotonic() + WAIT_S
        while time.monotonic() < end:
            message = self.take()
            if wanted(message):
                return message
        raise AssertionError("it did not come")

    def say(self, **message):
        self.socket.send(json.dumps(message))

    def subscribe(self, *topics):
        ids = [self.channels[topic]["id"] for topic in topics]
        self.say(op="subscribe", subscriptions=[{"id": k, "channelId": k} for k in ids])

    def set(self, name, value):
        """Writes a variable; its true value then. Raises where it is refused."""
        self.numbers += 1
        number, before = f"set{self.numbers}", len(self.statuses)
        self.say(op="setParameters", parameters=[{"name": name, "value": value}], id=number)
        answer = self.until(lambda m: m.get("op") == "parameterValues" and m.get("id") == number)
        if len(self.statuses) > before:
            raise Refused(self.statuses[-1]["message"])
        return next(p["value"] for p in answer["parameters"] if p["name"] == name)

    def get(self, *names):
        self.numbers += 1
        number = f"get{self.numbers}"
        self.say(op="getParameters", parameterNames=names, id=number)
        answer = self.until(lambda m: m.get("op") == "parameterValues" and m.get("id") == number)
        return {p["name"]: p["value"] for p in answer["parameters"]}

    def call(self, name, **request):
        """Calls a service; its answer. Raises where it is refused."""
        self.numbers += 1
        body = json.dumps(request).encode()
        self.socket.send(struct.pack("<BIII", 2, self.services[name], self.numbers, 4) + b"json" + body)
        own = lambda m: m.get("op") == "response" and m["call"] == self.numbers or m.get("op") == "serviceCallFailure"
        answer = self.until(own)
        if answer["op"] == "serviceCallFailure":
            raise Refused(answer["message"])
        return answer["body"]

    def state(self, wanted=lambda state: True):
        """State of the run, once it is as wanted."""
        if "/run" not in self.latest:
            self.subscribe("/run")
        fits = lambda m: m.get("topic") == "/run" and wanted(json.loads(m["data"]))
        return json.loads(self.until(fits)["data"])

    def run_to(self, t_s):
        """Goes on to a time, s, and stands there; steps are of 1 ms."""
        now = self.call("run.pause")["t_s"]
        self.call("run.step", steps=round((t_s - now) / 1e-3))
        return self.state(lambda s: s["state"] == "paused" and abs(s["t_s"] - t_s) < 1e-6)


def asked(address, path):
    """Status and body of a question about the past."""
    with urllib.request.build_opener(urllib.request.ProxyHandler({})).open(address.rstrip("/") + path) as answer:
        return answer.read()
