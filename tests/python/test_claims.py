"""The figures quoted in sentences are those that are measured (`claims.py`)."""

import re

import pytest

import claims
from claims import CLAIMS, Claim
from conftest import ROOT


@pytest.mark.parametrize("claim", CLAIMS, ids=lambda c: f"{c.file}: {c.words[:60]}")
def test_what_is_said_is_measured(claim):
    found = claims.wrong(claim, (ROOT / claim.file).read_text())
    assert not found, "\n".join(found)


@pytest.mark.parametrize(("file", "name"), claims.BLOCKS)
def test_blocks_are_those_that_are_made(file, name):
    text = (ROOT / file).read_text()
    begin, end = claims.block(file, name, text)
    told = claims.block_differs(text[begin:end], claims.BLOCKS[file, name]())
    assert told is None, f"{file}, {name}: {told}: run `cargo xtask docs`"


def test_a_block_that_has_changed_is_found():
    shown = "| a | 2.0 / 31 mm |\n"
    assert claims.block_differs(shown, "| a | 2.05 / 32 mm |\n") is None
    for made in ("| a | 2.3 / 31 mm |\n", "| b | 2.0 / 31 mm |\n", "", "| a | – / 31 mm |\n"):
        assert claims.block_differs(shown, made)


def test_a_figure_that_has_changed_is_found_and_written():
    claim = Claim("page.md", "it sinks by {} mm, and by {} mm on sand", (lambda: 12.34, lambda: 0.051))
    text = "# Here it sinks by 9.9 mm,\n# and by 0.05 mm on sand; 7 mm."
    (told,) = claims.wrong(claim, text)
    assert "9.9" in told and "12.34" in told
    new = claims.rewritten(claim, text)
    assert new == "# Here it sinks by 12.3 mm,\n# and by 0.05 mm on sand; 7 mm."
    assert not claims.wrong(claim, new)
    for bad in ("it sinks", text + text):
        with pytest.raises(AssertionError, match="times, not once"):
            claim.found(bad)
    assert claims.agrees("0.02", 0.0157) and not claims.agrees("0.02", 0.026) and claims.agrees("100", 104.0)
    assert not claims.agrees("1290", 1500.0)
    assert claims.agrees("3e-9", 2.75e-9) and not claims.agrees("3e-9", 3.6e-9)
    assert [claims.printed(shown, 5.691e-4) for shown in ("5.7e-4", "1e-9", "0.02")] == ["5.7e-4", "6e-4", "0.00"]


def test_scenarios_say_no_figure_that_nobody_measures():
    """Headers of scenarios: a number with a unit that is a result is a claim, or it is a number of the file or of its models."""
    loose = []
    for path in sorted((ROOT / "scenarios").glob("*.toml")):
        text = path.read_text()
        header = re.match(r"(?:#.*\n)+", text)[0]
        keys = text[len(header):]
        measured = [c.found(text)[0] for c in CLAIMS if c.file == f"scenarios/{path.name}"]
        for found in re.finditer(r"(?<![\w.])(\d+(?:\.\d+)?) (N|J|mm|m/s|rad/s)\b", header):
            inside = any(found[0] in re.sub(r"\s|#", " ", words) or found[0] in words for words in measured)
            if not inside and not given(found[1], keys):
                loose.append(f"{path.name}: {found[0]}")
    assert loose == ALLOWED


def given(figure, keys):
    """Whether a number occurs in the keys and their comments."""
    return re.search(rf"(?<![\d.]){re.escape(figure)}0*(?![\d])", keys) is not None


# Numbers of the set-up that follow from others by arithmetic.
ALLOWED = [
    "plate_sinkage.toml: 10 mm",  # 0.01 m/s, in a second
    "wheel_rig.toml: 100 N",  # the weight and the press of the command before
]
