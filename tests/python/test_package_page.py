"""The operator's page from Python: served by a process of its own, shown in the cell of a notebook, ended with it."""

import gc
import urllib.error

import pytest
from served import asked

SMALL = {"terrain.size_m": [2.0, 1.6]}


def is_served(url):
    try:
        return b"<title>" in asked(url, "/")
    except urllib.error.URLError:
        return False


def test_a_run_is_served_shown_in_a_notebook_and_closed(tg, tmp_path):
    with tg.serve("moon_walk", set=SMALL, duration_s=0.02, pace="free", out=tmp_path / "out") as page:
        assert is_served(page.url) and page.is_open
        assert page.url in page._repr_html_() and page.url in repr(page)
    assert not is_served(page.url) and not page.is_open
    assert page.url not in page._repr_html_()
    page.close()
    with tg.serve(tmp_path / "out") as replay:
        assert is_served(replay.url)


def test_a_page_that_nobody_holds_is_closed(tg, tmp_path):
    page = tg.serve("moon_walk", set=SMALL, paused=True, out=tmp_path / "out")
    url = page.url
    assert is_served(url)
    del page
    gc.collect()
    assert not is_served(url)


def test_what_cannot_be_served_is_an_error_with_its_reason(tg, tmp_path):
    with pytest.raises(tg.InputError, match="soil.modul"):
        tg.serve("moon_walk", set={"soil.modul": "soil-bekker"}, out=tmp_path / "out")
    with pytest.raises(tg.Error, match="no_such_walk"):
        tg.serve(tmp_path / "no_such_walk.toml")
