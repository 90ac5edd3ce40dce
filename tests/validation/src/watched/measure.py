"""Measures the promises of the page of a run: `measure.py PART FOLDER`. Prints `name<TAB>value<TAB>what` for each figure; `skip` in place of
the value where a program or a package is missing."""

import json
import pathlib
import random
import struct
import subprocess
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[3] / "python"))

import pytest
from conftest import MOON_WALK, PROGRAM
from served import Client, asked, served

LONG = ["--set", "terrain.size_m=[20.0, 6.0]"]
VIEW = {"width": 1400, "height": 900}


def told(name, value, what):
    print(f"{name}\t{value}\t{what}", flush=True)


def run(folder, *arguments):
    subprocess.run([PROGRAM, "run", MOON_WALK, "--out", folder, "--quiet", *map(str, arguments)], check=True)


def apart(a, b):
    """Bytes in which two recordings differ."""
    a, b = ((folder / "recording.mcap").read_bytes() for folder in (a, b))
    return abs(len(a) - len(b)) + sum(x != y for x, y in zip(a, b)) if a != b else 0


def noise(seeded, client):
    """A frame that means nothing: cut off, of a wrong kind, of unknown channels, or with wrong values."""
    kind, bytes_ = seeded.randrange(6), seeded.randbytes(seeded.randrange(60))
    if kind == 0:
        client.socket.send(bytes_)
    elif kind == 1:
        client.socket.send(bytes_.decode("latin-1"))
    elif kind == 2:
        op = seeded.choice(["subscribe", "unsubscribe", "getParameters", "fetchAsset", "advertise", "nothing"])
        number = seeded.randrange(1 << 40)
        client.say(op=op, subscriptions=[{"id": 1, "channelId": number}], subscriptionIds=[number % 99], parameterNames=["a", "robot.."], uri="x", requestId=1)
    elif kind == 3:
        client.socket.send(struct.pack("<BIII", 2, seeded.randrange(1 << 32), 1, seeded.randrange(1 << 32)) + bytes_)
    elif kind == 4:
        client.say(op="setParameters", parameters=[{"name": bytes_.decode("latin-1"), "value": 3}, {"name": "robot.LF_j2.max_torque", "value": "x"}])
    else:
        client.socket.send(json.dumps({"op": "subscribe", "subscriptions": [{"id": k, "channelId": k} for k in range(seeded.randrange(400))]})[: seeded.randrange(4000)])


def untouched(folder):
    plain = folder / "plain"
    run(plain, "--duration", 0.4)
    walk = lambda name: served(MOON_WALK, "--duration", 0.4, "--out", folder / name, "--pace", "free", "--paused")
    ended = lambda state: state["state"] == "ended"
    with walk("watched") as address, Client(address) as one, Client(address) as two, Client(address) as three:
        for client in (one, two, three):
            client.subscribe(*client.channels)
        one.call("run.play")
        for client in (one, two, three):
            client.state(ended)
    told("watched_bytes", apart(plain, folder / "watched"), "bytes of the recording that differ while three clients watch every topic")
    with walk("stopped") as address, Client(address) as still, Client(address) as watching:
        still.subscribe(*still.channels)
        watching.call("run.play")
        watching.state(ended)
    told("stopped_bytes", apart(plain, folder / "stopped"), "bytes of the recording that differ while a client has stopped to read")
    seeded = random.Random(5)
    with walk("noise") as address, Client(address) as watching:
        for _ in range(40):
            with Client(address) as client:
                for _ in range(250):
                    try:
                        noise(seeded, client)
                    except OSError:
                        break
        watching.state(lambda s: s["may_write"])
        watching.call("run.play")
        watching.state(ended)
    told("noise_bytes", apart(plain, folder / "noise"), "bytes of the recording that differ after 10,000 random frames")


def free(folder):
    import psutil

    with served(MOON_WALK, "--duration", 600, *LONG, "--out", folder / "out", "--pace", "free", "--paused", "--rewind-memory", 16) as address:
        own = next(p for p in psutil.process_iter() if p.name() == "terraglue" and str(folder / "out") in p.cmdline())
        with Client(address) as client:
            client.subscribe("/tf", "/ground/tiles")
            client.call("run.play")
            memory = lambda: own.memory_info().rss / 1e6
            most = {}
            for share, until in (("early", 60), ("late", 590)):
                state = client.state()
                while state["t_s"] < until and state["state"] == "playing":
                    state = client.state()
                most[share] = (memory(), state["t_s"])
    told("memory_mb", most["late"][0] - most["early"][0], f"growth of memory from t = {most['early'][1]:.0f} s to {most['late'][1]:.0f} s of free running, MB; 16 MB of states to go back to are kept")


def ground(folder):
    # 2048² nodes under the six feet of the robot
    size = ["--set", "terrain.size_m=[20.47, 20.47]", "--set", "terrain.spacing_m=0.01", "--duration", 14]
    with served(MOON_WALK, *size, "--out", folder / "out", "--paused") as address, Client(address) as client:
        client.subscribe("/tf")
        client.call("run.step", steps=1)
        client.state(lambda s: s["state"] == "paused" and s["t_s"] > 0)
        client.subscribe("/ground/tiles")
        client.until(lambda m: m.get("topic") == "/ground/tiles")
        client.call("run.play")
        sizes, ages, now, begin = [], [], 0.0, None
        while now < 12:
            message = client.take()
            if message.get("op") == "time" or message.get("topic") == "/tf":
                now = max(now, message["t"])
            if now > 2 and begin is None:
                begin = (time.monotonic(), now)
            if message.get("topic") == "/ground/tiles" and begin:
                sizes.append(len(message["data"]))
                ages.append(now - message["t"])
        wall, simulated = time.monotonic() - begin[0], now - begin[1]
    told("rate_mb_s", sum(sizes) / simulated / 1e6, f"MB of ground a second, 2048² nodes, six feet, {len(sizes)} messages")
    told("age_p95_s", sorted(ages)[int(0.95 * len(ages))], "age of the ground when it arrives, 95th percentile, s of simulation in real time")
    told("pace", simulated / wall, "simulated over wall time meanwhile; 1 is wanted")


def past(folder):
    recording = folder / "long"
    run(recording, "--duration", 600, "--no-report", *LONG)
    begin = time.monotonic()
    with served(recording) as address, Client(address) as client:
        client.subscribe("/tf", "/ground/tiles")
        client.until(lambda m: m.get("topic") == "/tf")
        told("open_s", time.monotonic() - begin, f"from the command to the first poses of a recording of ten minutes ({(recording / 'recording.mcap').stat().st_size / 1e6:.0f} MB), s")
        took, seeded = [], random.Random(3)
        for _ in range(60):
            t, begin = seeded.uniform(0, 600), time.monotonic()
            asked(address, f"/at?t={t}&topics=/tf,/contact_forces,/robot,/ground/tiles")
            took.append(time.monotonic() - begin)
    told("scrub_p95_s", sorted(took)[int(0.95 * len(took))], f"time to everything that is shown at a random moment of it, 95th percentile, s; median {sorted(took)[30]:.3f}")


def frames(page):
    return page.evaluate("new Promise((done) => document.dispatchEvent(new CustomEvent('terraglue:frames', { detail: done })))")


def similar(a, b):
    """Structural similarity of two pictures (Wang et al. 2004) over squares of 8 pixels."""
    import numpy
    from PIL import Image

    a, b = (numpy.asarray(Image.open(x).convert("L"), dtype=float) for x in (a, b))
    assert a.shape == b.shape, (a.shape, b.shape)

    def mean(x):
        sums = numpy.pad(x.cumsum(0).cumsum(1), ((1, 0), (1, 0)))
        return (sums[8:, 8:] - sums[:-8, 8:] - sums[8:, :-8] + sums[:-8, :-8]) / 64

    ma, mb = mean(a), mean(b)
    va, vb, both = mean(a * a) - ma**2, mean(b * b) - mb**2, mean(a * b) - ma * mb
    c1, c2 = (0.01 * 255) ** 2, (0.03 * 255) ** 2
    return float((((2 * ma * mb + c1) * (2 * both + c2)) / ((ma**2 + mb**2 + c1) * (va + vb + c2))).mean())


def pictures(folder):
    """The same moment live, replayed, and headless."""
    from browser import opened, ready

    camera, t = "follow,-0.95,0.42,2.6", 1.5

    def photo(page, name):
        # whole pixels: a panel of the page ends anywhere
        page.add_style_tag(content=".view-bar, .labels { display: none !important; } .view3d { width: 800px !important; height: 400px !important; flex: none !important; }")
        page.wait_for_timeout(2500)
        box = page.locator(".view3d")
        box.screenshot(path=folder / name)
        size = box.bounding_box()
        return f"{round(size['width'])}x{round(size['height'])}"

    at = "Math.abs(parseFloat(document.querySelector('.topbar .time').textContent.slice(4)) - 1.5) < 1e-6"
    with served(MOON_WALK, "--out", folder / "out", "--duration", 2, "--pace", "free") as address, opened(viewport=VIEW) as page:
        page.goto(f"{address}#camera={camera}&t={t}")
        ready(page)
        page.wait_for_function("document.querySelector('.topbar .pill').textContent === 'past'")
        size = photo(page, "live.png")
    with served(folder / "out") as address, Client(address) as client, opened(viewport=VIEW) as page:
        page.goto(f"{address}#camera={camera}")
        ready(page)
        client.call("run.seek", t_s=t)
        page.wait_for_function(at)
        photo(page, "replayed.png")
    subprocess.run([PROGRAM, "shot", folder / "out", "--time", str(t), "--camera", camera, "--size", size, "-o", folder / "headless.png"], check=True)
    for name in ("replayed", "headless"):
        told(f"ssim_{name}", similar(folder / "live.png", folder / f"{name}.png"), f"structural similarity of the live and the {name} picture of a moment")


def browser(folder):
    from browser import opened, program, ready

    import psutil

    program()
    pictures(folder)
    with served(MOON_WALK, "--duration", 300, *LONG, "--out", folder / "frames") as address, opened(viewport=VIEW) as page:
        page.goto(address)
        ready(page)
        page.wait_for_timeout(4000)
        first, begin = frames(page), time.monotonic()
        page.wait_for_timeout(10_000)
        rate = (frames(page) - first) / (time.monotonic() - begin)
        told("frames_per_s", rate, "pictures a second of the page of a run, drawn by the processor at 1400 × 900")
        begin = time.monotonic()
        page.reload()
        ready(page)
        page.wait_for_function("document.querySelectorAll('.scope-plot path.curve').length > 0")
        told("reload_s", time.monotonic() - begin, "reload in the middle of a run until view, variables and plots are back, s")
    with served(MOON_WALK, "--duration", 300, *LONG, "--out", folder / "plots", "--set", "recording.every_steps=1") as address, opened(viewport=VIEW) as page:
        with Client(address) as client:
            names = [n for n in client.get() if n.startswith("robot.") and n.rsplit(".", 1)[1] in ("angle", "velocity", "torque")]
            names += [n for n in client.get() if n.startswith("gait.")]
        assert len(names) >= 64, len(names)
        page.goto(f"{address}#plots={';'.join(names[:64])}")
        ready(page)
        page.wait_for_function("document.querySelectorAll('.scope-plot').length === 64")
        # the process that the page lives in is the one that works most
        renderers = [p for p in psutil.process_iter() if any("--type=renderer" in c for c in p.cmdline())]
        cpu = lambda: {p.pid: sum(p.cpu_times()[:2]) for p in renderers if p.is_running()}
        page.wait_for_timeout(3000)
        before, begin = cpu(), time.monotonic()
        page.wait_for_timeout(60_000)
        share = max(after - before[pid] for pid, after in cpu().items()) / (time.monotonic() - begin)
        told("plots_core", share, "share of a core that the page takes with 64 plots at 1 kHz over 60 s")


PARTS = {"untouched": untouched, "free": free, "ground": ground, "past": past, "browser": browser}
FIGURES = {
    "untouched": ["watched_bytes", "stopped_bytes", "noise_bytes"], "free": ["memory_mb"], "ground": ["rate_mb_s", "age_p95_s", "pace"],
    "past": ["open_s", "scrub_p95_s"], "browser": ["frames_per_s", "reload_s", "plots_core", "ssim_replayed", "ssim_headless"],
}


def main():
    part, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    folder.mkdir(parents=True, exist_ok=True)
    try:
        PARTS[part](folder)
    except (pytest.skip.Exception, ImportError) as missing:
        for name in FIGURES[part]:
            told(name, "skip", str(missing).splitlines()[0])


main()
