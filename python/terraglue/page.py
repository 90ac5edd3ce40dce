"""The operator's page of a run or a recording, from Python: served by a process of its own, shown in the cell of a notebook."""

import html
import re
import subprocess
import threading
import weakref

from .commands import _option, _sets
from .errors import Error, InputError
from .paths import PROGRAM
from .paths import scenario as _file


class Page:
    """A page that is being served; `url` is its address. It ends with `close()`, with a `with` block, or with the last reference to it."""

    def __init__(self, url, process):
        self.url = url
        self._end = weakref.finalize(self, _stop, process)

    @property
    def is_open(self):
        """Whether `close()` was not called yet."""
        return self._end.alive

    def close(self):
        """Ends the run and closes its recording; a second call does nothing."""
        self._end()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def __repr__(self):
        return f"Page({self.url!r})" if self.is_open else "Page(closed)"

    def _repr_html_(self, height_px=640):
        """For notebooks: the page itself in a frame."""
        if not self.is_open:
            return "<p>The page is closed.</p>"
        return f'<iframe src="{html.escape(self.url)}" title="Terraglue" style="width: 100%; height: {height_px}px; border: 0"></iframe>'


def _stop(process):
    process.terminate()
    process.wait()


def serve(what, *, set=None, out=None, duration_s=None, pace=None, paused=False, beside=None, port=0):
    """Serves the page of a run of a scenario, or of the folder of a recorded one, and returns it; a run goes on in a process of its own.

    `pace`: times real time, or "free"; `beside`: folder of another run, shown as a ghost; `port` 0: any that is free.

        page = terraglue.serve("moon_walk", set={"soil.module": "soil-bekker"}, duration_s=5.0)
        print(page.url)
        page.close()
    """
    options = [*_option("--out", out), *_option("--duration", duration_s), *_option("--pace", pace), *_option("--with", beside), *_sets(set)]
    command = [PROGRAM, "serve", _file(what), "--no-open", "--port", port, *options, *(["--paused"] if paused else [])]
    # Ctrl-C in a notebook is for its kernel
    process = subprocess.Popen([*map(str, command)], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, start_new_session=True)
    said = []
    for line in process.stdout:
        said.append(line)
        if address := re.search(r"http://\S+", line):
            # nobody reads the rest, and a full pipe would hold the run up
            threading.Thread(target=process.stdout.read, daemon=True).start()
            return Page(address[0], process)
    kind = InputError if process.wait() == 2 else Error
    raise kind("".join(said).strip() or f"`terraglue serve` ended with {process.returncode}")
