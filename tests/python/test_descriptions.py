"""Descriptions that contradict the standard: a warning with line and variable, which --strict refuses."""

import zipfile

import pytest
from cfmu import build, build_3
from conftest import terraglue

GAIN = [("u", "input", 0.0, ""), ("y", "output", 0.0, "")]


def with_variable(folder, version, xml):
    """An FMU with one more variable, on a line of its own, and that line."""
    if version == 2:
        fmu = build(folder, "m", GAIN, "r[1] = r[0];", others="\n" + xml)
    else:
        fmu = build_3(folder, "m", [("y", "output", None, [])], "v[1][0] = t;", others="\n" + xml)
    with zipfile.ZipFile(fmu) as archive:
        lines = archive.read("modelDescription.xml").decode().splitlines()
    return fmu, next(k for k, line in enumerate(lines, 1) if xml in line)


V2 = '<ScalarVariable name="v" valueReference="7" causality="{}" variability="continuous"><Real {}/></ScalarVariable>'
DEFECTS = [
    (2, V2.format("local", 'derivative="9"'), ["index 9", "does not exist"]),
    (2, V2.format("local", 'derivative="x"'), ["does not exist"]),
    (2, V2.format("independent", "") + V2.format("independent", "").replace('"v"', '"w"'), ["2 independent variables"]),
    (3, '<Float64 name="v" valueReference="7" causality="independent" variability="continuous"/>', ["2 independent variables"]),
    (3, '<Float64 name="v" valueReference="7" causality="local" derivative="9"/>', ["valueReference 9", "does not exist"]),
    (3, '<Float64 name="v" valueReference="7" causality="input" start="0" clocks="55"/>', ["clock", "55", "does not exist"]),
    (3, '<Float64 name="v" valueReference="7" causality="input" start="0" clocks="1"/>', ["clock `y`", "none"]),
    (3, '<Int32 name="v" valueReference="7" causality="input" start="0" max="99999999999"/>', ["99999999999", "Int32 cannot hold"]),
    (3, '<UInt8 name="v" valueReference="7" causality="input" start="0" min="-1"/>', ["min = -1", "UInt8 cannot hold"]),
    (3, '<Float32 name="v" valueReference="7" causality="input" start="1e50"/>', ["1e50", "Float32 cannot hold"]),
]


@pytest.mark.parametrize(("version", "xml", "words"), DEFECTS)
def test_a_defect_is_told_with_its_line(tmp_path, version, xml, words):
    fmu, line = with_variable(tmp_path, version, xml)
    done = terraglue("fmu", "check", fmu)
    told = next((text for text in done.stdout.splitlines() if f"line {line}" in text), done.stdout + done.stderr)
    assert all(word in told for word in words), done.stdout + done.stderr
    done = terraglue("fmu", "run", fmu, "--strict", "--stop", "0.1")
    assert done.returncode == 2 and f"line {line}" in done.stderr, done.stderr
    assert f"line {line}" in terraglue("fmu", "run", fmu, "--stop", "0.1").stderr


@pytest.mark.parametrize(
    ("version", "xml"),
    [
        (2, V2.format("local", 'derivative="2"')),
        (3, '<Float64 name="v" valueReference="7" causality="local" derivative="1"/>'),
        (3, '<Clock name="c" valueReference="8" causality="output" intervalVariability="triggered"/>'
            '<Float64 name="v" valueReference="7" causality="input" variability="discrete" start="0" clocks="8"/>'),
        (3, '<Int32 name="v" valueReference="7" causality="input" start="0" min="-2147483648" max="2147483647"/>'),
        (3, '<UInt64 name="v" valueReference="7" causality="input" start="0" max="18446744073709551615"/>'),
        (3, '<Float32 name="v" valueReference="7" causality="input" start="3.4028235e38"/>'),
    ],
)
def test_what_the_standard_allows_is_not_told(tmp_path, version, xml):
    fmu, line = with_variable(tmp_path, version, xml)
    done = terraglue("fmu", "check", fmu)
    assert f"line {line}" not in done.stdout + done.stderr, done.stdout
