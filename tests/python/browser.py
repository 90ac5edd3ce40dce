"""A browser for tests of pages: Chromium of the system, drawing without a graphics card."""

import atexit
import functools
import os
import shutil
from contextlib import contextmanager

import pytest

ARGUMENTS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
# messages of the driver itself when a picture is taken
KNOWN = ("GPU stall due to ReadPixels", "GL Driver Message")


def program():
    """The path of the browser; the test is skipped where there is none."""
    found = os.environ.get("TERRAGLUE_CHROMIUM") or next(filter(None, map(shutil.which, NAMES)), None)
    if not found:
        pytest.skip("no browser: apt-get install chromium, or name one in TERRAGLUE_CHROMIUM")
    return found


@functools.cache
def browser():
    """The browser of all tests of this process: its driver can be started only once."""
    sync_api = pytest.importorskip("playwright.sync_api", reason="drives the browser: pip install playwright")
    path = program()
    playwright = sync_api.sync_playwright().start()
    started = playwright.chromium.launch(executable_path=path, args=ARGUMENTS)
    atexit.register(playwright.stop)
    return started


@contextmanager
def opened(**context):
    """A new page; an error on its console fails the test."""
    room = browser().new_context(**context)
    page = room.new_page()
    # a machine may be busy with other tests
    page.set_default_timeout(300_000)
    errors = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.on("console", lambda m: errors.append(m.text) if m.type == "error" and not any(k in m.text for k in KNOWN) else None)
    page.errors = errors
    try:
        yield page
    finally:
        room.close()


def ready(page):
    """Waits until the page shows its content."""
    page.wait_for_function("document.documentElement.dataset.ready")


# Colours of the view in a grid of places, as the canvas holds them.
PIXELS = """() => {
  const canvas = document.querySelector(".view3d canvas");
  const gl = canvas.getContext("webgl2");
  const out = new Uint8Array(4 * canvas.width * canvas.height);
  gl.readPixels(0, 0, canvas.width, canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, out);
  const some = [];
  for (let k = 0; k < out.length; k += 4 * 97) some.push([out[k], out[k + 1], out[k + 2], out[k + 3]]);
  return some;
}"""


def pixels(page):
    """Some pixels of the 3-D view as [red, green, blue, alpha], once it stands still and is drawn finely."""
    page.wait_for_timeout(900)
    page.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
    return page.evaluate(PIXELS)
