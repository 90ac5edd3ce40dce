"""The operator's view: the replay of a report, a picture of a run, and the page of a run that is going on, in a real browser."""

import base64
import json
import os
import struct

import pytest
from browser import opened, pixels, program, ready
from conftest import MOON_WALK, ROOT, terraglue
from served import served

ASSETS = ROOT / "coordinator" / "page" / "assets"
RENDERER = "math shaders solids batch relief palette gl renderer camera bodies view track replay".split()


@pytest.fixture(scope="module")
def walk(tmp_path_factory):
    """Two seconds of the default walk: the folder of the run."""
    folder = tmp_path_factory.mktemp("walk") / "out"
    process = terraglue("run", MOON_WALK, "--duration", "2", "--out", folder)
    assert process.returncode == 0, process.stderr
    return folder


def different(some, others):
    """Share of pixels that differ visibly."""
    apart = sum(max(abs(a - b) for a, b in zip(one, other)) > 24 for one, other in zip(some, others))
    return apart / len(some)


def test_the_renderer_and_the_page_stay_within_their_limits():
    lines = {path.stem: len(path.read_text().splitlines()) for path in ASSETS.glob("*.js")}
    assert sum(lines[name] for name in RENDERER) <= 1500
    assert sum(lines.values()) <= 6000
    assert sum(path.stat().st_size for path in ASSETS.iterdir()) <= 250_000


def test_every_module_says_what_it_is_for_and_asks_nobody_else():
    for path in ASSETS.glob("*.js"):
        text = path.read_text()
        assert text.startswith("// "), path.name
        assert "http://" not in text.replace("http://www.w3.org/", "") and "https://" not in text, path.name


def test_the_report_shows_the_robot_walking(walk):
    with opened(viewport={"width": 1000, "height": 800}) as page:
        page.goto(f"{(walk / 'report.html').as_uri()}#t=0.1&camera=orbit,-0.95,0.42,2.6")
        ready(page)
        early = pixels(page)
        assert sum(p[3] > 250 for p in early) > 0.4 * len(early), "ground and robot fill the lower half"
        orange = sum(p[0] > 150 and 60 < p[1] < 190 and p[2] < 90 for p in early)
        assert orange > 0.005 * len(early), "the body is in the picture"
        page.evaluate("document.dispatchEvent(new CustomEvent('terraglue:go', { detail: 1.9 }))")
        assert page.locator(".replay-bar .when").inner_text() == "t = 1.900 s"
        late = pixels(page)
        assert different(early, late) > 0.01, "the robot has moved"
        page.evaluate("document.dispatchEvent(new CustomEvent('terraglue:go', { detail: 0.1 }))")
        assert different(early, pixels(page)) < 0.001, "back in time it looks as before"
        assert page.errors == []


def idle(page):
    """Waits until the view has taken all that it has asked for."""
    page.wait_for_function("""() => { let busy; document.dispatchEvent(new CustomEvent("terraglue:busy", { detail: (is) => { busy = is; } })); return busy === false; }""")


def steady(page, read):
    """The value that is read once it does not change any more."""
    last = read()
    for _ in range(60):
        page.wait_for_timeout(500)
        now = read()
        if now == last:
            return now
        last = now
    raise AssertionError(f"it goes on to change: {last}")


def test_the_replay_plays_and_is_told_by_keys(walk):
    with opened(viewport={"width": 900, "height": 700}, reduced_motion="reduce") as page:
        page.goto((walk / "report.html").as_uri())
        ready(page)
        when = page.locator(".replay-bar .when")
        assert when.inner_text() == "t = 0.000 s"
        page.locator(".view3d canvas").focus()
        page.keyboard.press("ArrowRight")
        assert when.inner_text() == "t = 0.050 s"
        page.keyboard.press(" ")
        page.wait_for_function("parseFloat(document.querySelector('.replay-bar .when').textContent.slice(4)) > 0.2")
        page.keyboard.press(" ")
        # it stands long before the end, however late the key arrives
        stands = steady(page, when.inner_text)
        assert float(stands.split()[2]) < 1.9
        assert page.errors == []


def test_a_report_without_webgl_says_so_and_shows_all_else(walk):
    with opened(viewport={"width": 900, "height": 700}) as page:
        page.add_init_script("HTMLCanvasElement.prototype.getContext = () => null;")
        page.goto((walk / "report.html").as_uri())
        ready(page)
        assert "no 3-D view" in page.locator("#replay .notice").inner_text()
        assert page.locator(".plots svg").count() > 3
        assert page.errors == []


def test_the_replay_takes_no_more_than_its_share_of_the_file(walk):
    data = (walk / "report.html").read_text().split('id="data">')[1].split("</script>")[0]
    replay = data[data.index('"replay":'):]
    assert len(replay) < 3_000_000


def test_a_shot_is_a_picture_of_the_size_that_was_asked_for(walk, tmp_path):
    os.environ.get("TERRAGLUE_CHROMIUM") or program()
    target = tmp_path / "x.png"
    process = terraglue("shot", walk, "--time", "1.5", "--camera", "side", "--size", "640x400", "-o", target)
    assert process.returncode == 0, process.stderr
    head = target.read_bytes()[:24]
    assert head[:8] == b"\x89PNG\r\n\x1a\n" and struct.unpack(">II", head[16:24]) == (640, 400)
    assert target.stat().st_size > 10_000, "it is not empty"


def test_a_shot_without_a_browser_says_what_to_do(walk, tmp_path, monkeypatch):
    monkeypatch.delenv("TERRAGLUE_CHROMIUM", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))
    process = terraglue("shot", walk, "-o", tmp_path / "x.png")
    assert process.returncode == 2
    assert "no browser" in process.stderr and "TERRAGLUE_CHROMIUM" in process.stderr and "chromium" in process.stderr


# Shows a WebM file at a time, s: length (s), size, and the mean difference of its picture to the one of another time.
WATCH = """async ([base64, t, other]) => {
  const video = Object.assign(document.createElement("video"), { muted: true, src: `data:video/webm;base64,${base64}` });
  await new Promise((done, fail) => { video.onloadeddata = done; video.onerror = () => fail(new Error(video.error.message)); });
  const [w, h] = [video.videoWidth, video.videoHeight];
  const paper = Object.assign(document.createElement("canvas"), { width: w, height: h }).getContext("2d");
  const at = async (time) => {
    // the picture comes after the place is reached
    const shown = new Promise((done) => video.requestVideoFrameCallback(done));
    const reached = new Promise((done) => { video.onseeked = done; });
    video.currentTime = time;
    await Promise.all([reached, shown]);
    paper.drawImage(video, 0, 0);
    return paper.getImageData(0, 0, w, h).data;
  };
  const [a, b] = [await at(t), await at(other)];
  let sum = 0;
  for (let k = 0; k < a.length; k++) sum += Math.abs(a[k] - b[k]);
  return [video.duration, w, h, video.seekable.end(0), sum / a.length];
}"""


def test_a_video_is_as_long_as_the_time_it_shows_and_can_be_gone_to_anywhere(walk, tmp_path):
    program()
    target = tmp_path / "x.webm"
    process = terraglue("video", walk, "--from", 0.5, "--to", 1.7, "--fps", 5, "--size", "320x180", "-o", target)
    assert process.returncode == 0, process.stderr
    # the last picture stands as long as all others
    assert "(7 pictures)" in process.stdout
    data = target.read_bytes()
    assert data[:4] == b"\x1a\x45\xdf\xa3" and b"webm" in data[:80]
    with opened() as page:
        length, width, height, seekable, moved = page.evaluate(WATCH, [base64.b64encode(data).decode(), 0.1, 1.1])
    assert (width, height) == (320, 180)
    assert abs(length - 1.4) < 0.21 and seekable == length
    assert moved > 0.5, "the robot has moved"


def test_a_video_without_an_encoder_says_what_to_do(walk, tmp_path, monkeypatch):
    monkeypatch.setenv("TERRAGLUE_CHROMIUM", program())
    monkeypatch.setenv("PATH", str(tmp_path))
    process = terraglue("video", walk, "-o", tmp_path / "x.mp4")
    assert process.returncode == 2 and "ffmpeg" in process.stderr and ".webm" in process.stderr
    process = terraglue("video", walk, "-o", tmp_path / "x.webm", "--encoder", "ffmpeg")
    assert process.returncode == 2 and "ffmpeg" in process.stderr and "--encoder browser" in process.stderr
    for arguments, word in [(["--from", 9], "--to"), (["--size", "321x180"], "even"), (["--speed", 0], "0.001")]:
        process = terraglue("video", walk, "-o", tmp_path / "x.webm", *arguments)
        assert process.returncode == 2 and word in process.stderr, arguments
    assert not (tmp_path / "x.webm").exists()


def test_a_video_without_a_browser_says_what_to_do(walk, tmp_path, monkeypatch):
    monkeypatch.delenv("TERRAGLUE_CHROMIUM", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))
    process = terraglue("video", walk, "-o", tmp_path / "x.webm")
    assert process.returncode == 2 and "no browser" in process.stderr and "TERRAGLUE_CHROMIUM" in process.stderr


@pytest.fixture(scope="module")
def live(tmp_path_factory):
    """The page of a run that has just begun: (page, address)."""
    folder = tmp_path_factory.mktemp("live") / "out"
    with served(MOON_WALK, "--out", folder, "--duration", 300, "--set", "terrain.size_m=[20.0, 6.0]", "--pace", 0.5) as address, opened(viewport={"width": 1400, "height": 900}) as page:
        page.goto(address)
        ready(page)
        yield page, address
        assert page.errors == []


def seconds(page):
    return float(page.locator(".topbar .time").inner_text().split()[2])


def select(page, words, which=0):
    page.locator(".search").fill(words)
    page.locator(".tree .row").nth(which).click()
    page.locator(".search").fill("")


def test_the_first_screen_shows_the_run_without_being_asked(live):
    page, _ = live
    assert page.locator("dialog[open]").count() == 0
    page.wait_for_function("parseFloat(document.querySelector('.topbar .time').textContent.slice(4)) > 0.3")
    drawn = pixels(page)
    assert sum(p[3] > 250 for p in drawn) > 0.2 * len(drawn)
    assert page.locator(".scope-plot path.curve").count() >= 1
    assert "live" in page.locator(".topbar .pill").inner_text()


def test_three_variables_of_the_joint_are_plotted_and_its_motor_loses_its_torque(live):
    page, _ = live
    select(page, "RF_j2 max_torque")
    assert page.locator(".props-head h2").inner_text() == "robot.RF_j2"
    for name in ("torque", "velocity", "angle"):
        page.locator(f'.prop[data-id="robot.RF_j2.{name}"] .plot-it').click()
    page.wait_for_function("document.querySelectorAll('.scope-plot path.curve').length >= 3")
    field = page.locator('[id="prop-robot.RF_j2.max_torque"]')
    page.wait_for_function("""document.getElementById('prop-robot.RF_j2.max_torque').value === '60'""")
    for value in ("3", "0"):
        field.fill(value)
        field.press("Enter")
        page.wait_for_function("""(value) => [...document.querySelectorAll('.event .what')].some((e) =>
            new RegExp(`robot.RF_j2.max_torque = ${value}(\\.0)?( |$)`).test(e.textContent))""", arg=value)
    assert field.input_value() == "0"
    assert page.locator('.prop[data-id="robot.RF_j2.max_torque"]').evaluate("e => e.classList.contains('changed')")
    page.locator("#tab-Changed").click()
    assert "robot.RF_j2.max_torque" in page.locator(".changes").inner_text()
    page.locator("#tab-Model").click()


def test_a_refused_write_is_visible_and_the_true_value_comes_back(live):
    page, _ = live
    select(page, "LF_j3 max_torque")
    field = page.locator('[id="prop-robot.LF_j3.max_torque"]')
    page.wait_for_function("document.getElementById('prop-robot.LF_j3.max_torque').value === '60'")
    field.fill("-1")
    field.press("Enter")
    refusal = page.locator('.prop[data-id="robot.LF_j3.max_torque"] .refusal')
    page.wait_for_function("""document.querySelector('.prop[data-id="robot.LF_j3.max_torque"] .refusal').textContent !== ''""")
    assert "Refused" in refusal.inner_text() and "-1" in refusal.inner_text()
    assert field.input_value() == "60"
    field.fill("many")
    field.press("Enter")
    assert "no number" in refusal.inner_text() and field.input_value() == "60"
    assert page.locator('[id="prop-robot.LF_j3.torque"]').get_attribute("readonly") is not None


def test_a_click_on_the_robot_selects_it(live):
    page, _ = live
    page.locator(".topbar .play").click()
    page.wait_for_function("document.querySelector('.topbar .pill').textContent.includes('paused')")
    page.wait_for_timeout(500)
    box = page.locator("#stage canvas").bounding_box()
    page.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    page.wait_for_function("document.querySelector('.props-head h2')?.textContent === 'robot.body'")
    page.locator(".topbar .play").click()
    page.wait_for_function("document.querySelector('.topbar .pill').textContent.includes('playing')")


def test_the_past_is_shown_and_left_again(live):
    page, _ = live
    page.wait_for_function("parseFloat(document.querySelector('.topbar .time').textContent.slice(4)) > 1.2")
    page.keyboard.press("Escape")
    page.locator(".line-track").focus()
    page.keyboard.press("Home")
    page.wait_for_function("document.querySelector('.topbar .pill').textContent === 'past'")
    assert seconds(page) == 0
    page.keyboard.press("End")
    page.wait_for_function("document.querySelector('.topbar .pill').textContent !== 'past'")
    assert seconds(page) > 1


def test_a_reload_brings_everything_back(live):
    page, _ = live
    select(page, "LM_j2 torque")
    page.wait_for_function("location.hash.includes('LM_j2')")
    plots = page.locator(".scope-plot").count()
    page.wait_for_function("document.getElementById('prop-robot.LM_j2.max_torque')?.value === '60'")
    page.locator('[id="prop-robot.LM_j2.max_torque"]').fill("50")
    page.locator('[id="prop-robot.LM_j2.max_torque"]').press("Enter")
    page.wait_for_function("document.querySelectorAll('.changes li:not(.empty)').length >= 1")
    page.reload()
    ready(page)
    page.wait_for_function("(n) => document.querySelectorAll('.scope-plot path.curve').length >= n", arg=plots)
    assert page.locator(".props-head h2").inner_text() == "robot.LM_j2"
    page.wait_for_function("document.querySelectorAll('.changes li:not(.empty)').length >= 1")


def test_nothing_of_the_page_is_wider_than_a_phone(live):
    page, _ = live
    page.set_viewport_size({"width": 390, "height": 844})
    page.wait_for_timeout(500)
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    page.set_viewport_size({"width": 1400, "height": 900})


def test_contrast_names_and_roles_are_as_readers_need_them(live):
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="pip install axe-playwright-python").Axe()
    page, _ = live
    found = [v for v in axe.run(page).response["violations"] if v["impact"] in ("serious", "critical")]
    assert found == [], [(v["id"], v["nodes"][0]["target"]) for v in found]


def test_a_lost_connection_is_told(tmp_path):
    with opened(viewport={"width": 1200, "height": 800}) as page:
        with served(MOON_WALK, "--out", tmp_path / "out") as address:
            page.goto(address)
            ready(page)
        page.locator("#banner").wait_for(state="visible")
        assert "Connection lost" in page.locator("#banner").inner_text()
        assert "not connected" in page.locator(".topbar .pill").inner_text()


def test_a_page_that_was_busy_itself_has_not_lost_the_connection(tmp_path):
    with served(MOON_WALK, "--out", tmp_path / "out", "--pace", 0.1) as address, opened(viewport={"width": 1200, "height": 800}) as page:
        page.goto(address)
        ready(page)
        page.evaluate("new MutationObserver(() => { document.body.dataset.lost = 'yes'; }).observe(document.getElementById('banner'), { childList: true })")
        for _ in range(2):
            page.evaluate("{ const from = performance.now(); while (performance.now() - from < 6500); }")
            page.wait_for_timeout(1500)
        assert page.evaluate("document.body.dataset.lost") is None
        assert page.errors == []


def test_a_recording_is_replayed_by_the_same_page(walk):
    with served(walk) as address, opened(viewport={"width": 1200, "height": 800}) as page:
        page.goto(address)
        ready(page)
        assert "replay" in page.locator(".topbar .pill").inner_text()
        page.locator(".line-track").focus()
        page.keyboard.press("Home")
        page.wait_for_function("parseFloat(document.querySelector('.topbar .time').textContent.slice(4)) < 0.1")
        early = pixels(page)
        page.locator(".line-track").click(position={"x": page.locator(".line-track").bounding_box()["width"] * 0.9, "y": 15})
        page.wait_for_function("parseFloat(document.querySelector('.topbar .time').textContent.slice(4)) > 1.5")
        assert different(early, steady(page, lambda: pixels(page))) > 0.002
        assert page.errors == []


def shapes_late(page):
    """Lets the page have the shapes of a run only after it has had the poses."""
    scene, held, asked = [], [], []

    def without_shapes(route):
        url = route.request.url
        route.fulfill(response=route.fetch(url=url.replace("%2Fscene%2C", "").replace("%2C%2Fscene", "")))
        asked.append(url)

    def filtered(socket):
        server = socket.connect_to_server()

        def take(message):
            if isinstance(message, str):
                found = json.loads(message)
                scene.extend(c["id"] for c in found.get("channels", []) if c["topic"] == "/scene")
            elif message[0] == 1 and struct.unpack_from("<I", message, 1)[0] in scene:
                held.append(message)
                return
            socket.send(message)
            if asked and held:
                socket.send(held.pop())

        server.on_message(take)

    page.route("**/at?*", without_shapes)
    page.route_web_socket("**/ws?*", filtered)
    return asked


def test_a_recording_whose_shapes_arrive_after_its_poses_is_shown(walk):
    with served(walk) as address, opened(viewport={"width": 600, "height": 400}) as page:
        asked = shapes_late(page)
        page.goto(address)
        ready(page)
        assert asked, "the poses were asked for"
        assert page.errors == []


def test_from_a_time_in_the_past_the_run_takes_another_way_and_shows_both(tmp_path):
    with served(MOON_WALK, "--out", tmp_path / "out", "--duration", 60, "--pace", 0.2) as address, opened(viewport={"width": 1400, "height": 900}) as page:
        page.goto(address)
        ready(page)
        page.wait_for_function("parseFloat(document.querySelector('.topbar .time').textContent.slice(4)) > 1.5")
        page.locator(".topbar .play").click()
        page.wait_for_function("document.querySelector('.topbar .pill').textContent.includes('paused')")
        stood = seconds(page)
        for _ in range(5):
            page.keyboard.press("ArrowLeft")
        page.wait_for_function("document.querySelector('.topbar .pill').textContent === 'past'")
        page.locator(".from-here").click()
        page.wait_for_function("document.querySelector('.topbar .pill').textContent.includes('paused')")
        page.wait_for_function("(t) => parseFloat(document.querySelector('.topbar .time').textContent.slice(4)) < t", arg=stood - 0.3)
        assert seconds(page) > stood - 0.6
        page.wait_for_function("document.querySelectorAll('.scope-plot path.curve.dashed').length >= 1")
        select(page, "LM_j2 max_torque")
        field = page.locator('[id="prop-robot.LM_j2.max_torque"]')
        page.wait_for_function("document.getElementById('prop-robot.LM_j2.max_torque').value === '60'")
        field.fill("0.5")
        field.press("Enter")
        page.wait_for_function("""document.querySelector('.prop[data-id="robot.LM_j2.max_torque"]').classList.contains('changed')""")
        page.locator("#stage canvas").focus()
        before = seconds(page)
        page.keyboard.press("ArrowRight")
        page.wait_for_function("(t) => parseFloat(document.querySelector('.topbar .time').textContent.slice(4)) > t", arg=before)
        page.keyboard.press("Control+z")
        page.wait_for_function("document.getElementById('prop-robot.LM_j2.max_torque').value === '60'")
        page.locator(".topbar button", has_text="reset").click()
        page.wait_for_function("document.querySelector('.topbar .time').textContent === 't = 0.000 s'")
        assert page.errors == []
    assert (tmp_path / "out-2" / "recording.mcap").exists() and (tmp_path / "out-3" / "recording.mcap").exists()


def test_a_drag_with_ctrl_pushes_the_body(tmp_path):
    with served(MOON_WALK, "--out", tmp_path / "out", "--pace", 0.1) as address, opened(viewport={"width": 1200, "height": 800}) as page:
        page.goto(address)
        ready(page)
        page.wait_for_timeout(800)
        box = page.locator("#stage canvas").bounding_box()
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        page.keyboard.down("Control")
        page.mouse.move(x, y)
        page.mouse.down()
        page.mouse.move(x + 150, y - 20, steps=5)
        page.wait_for_function("""[...document.querySelectorAll('.event .what')].some((e) => /robot\\.\\w+\\.force_x = -?[0-9.]*[1-9]/.test(e.textContent))""")
        page.mouse.up()
        page.keyboard.up("Control")
        page.wait_for_function("""/robot\\.\\w+\\.force_\\w = 0/.test(document.querySelector('.event .what').textContent)""")
        assert page.errors == []


def test_faults_of_a_joint_are_one_click_away(tmp_path):
    with served(MOON_WALK, "--out", tmp_path / "out", "--pace", 0.1) as address, opened(viewport={"width": 1200, "height": 800}) as page:
        page.goto(f"{address}#select=robot.LF_j2.max_torque")
        ready(page)
        page.wait_for_function("document.getElementById('prop-robot.LF_j2.max_torque')?.value === '60'")
        for button, event in [("half torque", "max_torque = 30"), ("no torque", "max_torque = 0"), ("block", "act robot.LF_j2.block"), ("break", "act robot.LF_j2.break")]:
            page.locator(".props-head button", has_text=button).first.click()
            page.wait_for_function("(text) => [...document.querySelectorAll('.event .what')].some((e) => e.textContent.includes(text))", arg=event)
        assert page.errors == []


def test_a_moment_looks_the_same_live_and_replayed(walk, tmp_path):
    camera = "camera=follow,-0.95,0.42,2.6"
    with served(MOON_WALK, "--out", tmp_path / "out", "--duration", 2, "--pace", "free") as address, opened(viewport={"width": 1200, "height": 800}) as page:
        # an address with a time that the run has not reached yet shows the run
        page.goto(f"{address}#{camera}&t=1000")
        ready(page)
        page.wait_for_function("document.querySelector('.topbar .pill').textContent === 'live · ended'")
        page.goto("about:blank")
        page.goto(f"{address}#{camera}&t=1.5")
        ready(page)
        page.wait_for_function("document.querySelector('.topbar .pill').textContent === 'past'")
        idle(page)
        live = steady(page, lambda: pixels(page))
        with served(walk) as recorded:
            page.goto("about:blank")
            page.goto(f"{recorded}#{camera}")
            ready(page)
            box = page.locator(".line-track").bounding_box()
            page.mouse.click(box["x"] + 0.75 * box["width"], box["y"] + box["height"] / 2)
            page.wait_for_function("Math.abs(parseFloat(document.querySelector('.topbar .time').textContent.slice(4)) - 1.5) < 0.02")
            for _ in range(60):
                idle(page)
                apart = different(live, pixels(page))
                if apart < 0.01:
                    break
            assert apart < 0.01


def test_another_run_is_a_ghost_beside_the_run_and_its_curves_are_dashed(walk, tmp_path):
    camera, faster = "camera=orbit,-0.95,0.42,2.6", tmp_path / "faster"
    process = terraglue("run", MOON_WALK, "--duration", "2", "--set", "gait.speed_m_s=0.3", "--out", faster)
    assert process.returncode == 0, process.stderr
    with served(walk, "--with", faster) as address, opened(viewport={"width": 1200, "height": 800}) as page:
        page.goto(f"{address}#{camera}")
        ready(page)
        # by the end the two are apart
        page.locator(".line-track").click(position={"x": page.locator(".line-track").bounding_box()["width"] - 1, "y": 15})
        page.wait_for_function("parseFloat(document.querySelector('.topbar .time').textContent.slice(4)) > 1.9")
        page.locator("details.layers summary").click()
        row = page.locator("[data-layer=ghost]")
        row.wait_for()
        assert "ghost of faster" in page.locator(".layer", has=row).inner_text()
        page.wait_for_function("""[...document.querySelectorAll('.scope-plot .key.dashed')].some((k) => k.textContent.includes('in faster'))""")
        both = steady(page, lambda: pixels(page))
        row.uncheck()
        alone = steady(page, lambda: pixels(page))
        assert different(both, alone) > 0.002, "the ghost can be put away"
        blue = lambda all: sum(b > r + 40 and b > 120 for r, g, b, _ in all)
        assert blue(both) > blue(alone)
        assert page.errors == []


def test_a_scenario_says_how_its_page_looks_at_first(tmp_path):
    sets = ["--set", 'page.camera="side,-1.5,0.3,3"', "--set", 'page.ground="height"', "--set", 'page.layers=["torques","support"]',
            "--set", 'page.plots=["robot.LM_j2.torque,robot.RM_j2.torque","robot.body.z"]', "--set", 'page.select="robot.LM_j2"']
    out = tmp_path / "out"
    with served(MOON_WALK, "--out", out, "--duration", 0.2, "--pace", "free", *sets) as address, opened(viewport={"width": 1200, "height": 800}) as page:
        for _ in range(2):
            page.goto("about:blank")
            page.goto(address)
            ready(page)
            page.wait_for_function("document.querySelectorAll('.scope-plot').length === 2")
            assert page.locator(".props-head h2").inner_text() == "robot.LM_j2"
            menus = page.locator(".view-bar select")
            page.wait_for_function("document.querySelector('.view-bar select').value === 'side'")
            assert [menus.nth(k).input_value() for k in (0, 1)] == ["side", "height"]
            assert [b.get_attribute("data-layer") for b in page.locator("[data-layer]").all() if b.is_checked()] == ["torques", "support"]
            page.wait_for_function("document.querySelector('.topbar .pill').textContent.includes('ended')")
            page.wait_for_function("location.hash.includes('select=robot.LM_j2')")
        assert page.errors == []
    with opened(viewport={"width": 900, "height": 700}) as page:
        page.goto(f"{(out / 'report.html').as_uri()}#t=0.1")
        ready(page)
        menus = page.locator(".view-bar select")
        assert [menus.nth(k).input_value() for k in (0, 1)] == ["side", "height"]


def test_what_needs_a_reset_waits_for_it_and_is_listed(tmp_path):
    with served(MOON_WALK, "--out", tmp_path / "out", "--pace", 0.1) as address, opened(viewport={"width": 1200, "height": 800}) as page:
        page.goto(f"{address}#select=robot.LF_j2.angle")
        ready(page)
        page.wait_for_function("parseFloat(document.querySelector('.topbar .time').textContent.slice(4)) > 0")
        field = page.locator('[id="prop-robot.LF_j2.angle"]')
        # the value of the running joint does not disturb who is about to type
        field.focus()
        still, begun = field.input_value(), seconds(page)
        page.wait_for_function("(t) => parseFloat(document.querySelector('.topbar .time').textContent.slice(4)) > t + 0.1", arg=begun)
        assert field.input_value() == still
        page.locator("#stage canvas").focus()
        page.wait_for_function("(still) => document.getElementById('prop-robot.LF_j2.angle').value !== still", arg=still)
        field.fill("0.4")
        field.press("Enter")
        page.wait_for_function("document.querySelector('.prop[data-id=\"robot.LF_j2.angle\"] .undo')?.textContent.includes('0.4 at the next reset')")
        page.locator("#tab-Changed").click()
        assert "when the run starts again" in page.locator(".changes").inner_text()
        page.locator(".topbar button", has_text="reset").click()
        page.wait_for_function("document.getElementById('prop-robot.LF_j2.angle').value === '0.4'")
        assert page.errors == []


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_contrast_names_and_roles_are_those_that_readers_of_screens_need(walk, scheme):
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="checks pages: pip install axe-playwright-python")

    def found(page):
        return [(v["id"], [n["html"][:120] for n in v["nodes"]]) for v in axe.Axe().run(page).response["violations"]]

    with opened(viewport={"width": 1400, "height": 900}, color_scheme=scheme, reduced_motion="reduce") as page:
        page.goto((walk / "report.html").as_uri())
        ready(page)
        assert found(page) == []
    with served(walk, "--with", walk) as address, opened(viewport={"width": 1400, "height": 900}, color_scheme=scheme) as page:
        page.goto(f"{address}#select=robot.LF_j2")
        ready(page)
        page.locator("details.layers summary").click()
        page.wait_for_function("document.querySelectorAll('.scope-plot path.curve').length > 0")
        assert found(page) == []
