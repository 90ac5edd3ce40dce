"""Descriptions that contradict the standard: a warning with line and variable, which --strict refuses."""

import zipfile

import pytest
from cfmu import build, build_3, described
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
CLOCK = '<Clock name="c" valueReference="8" causality="output" intervalVariability="triggered"/>'


def aliases(one, two):
    """Two variables with one number in calls."""
    return V2.format(*one) + V2.format(*two).replace('name="v"', 'name="w"')


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
    (2, V2.format("local", 'reinit="true"'), ["`v` has `reinit`", "no continuous state"]),
    (3, '<Float64 name="v" valueReference="7" causality="local" reinit="false"/>', ["`v` has `reinit`", "no continuous state"]),
    (2, V2.format("local", 'nominal="0"'), ['nominal = "0"']),
    (3, '<Float32 name="v" valueReference="7" causality="local" nominal="INF"/>', ['nominal = "INF"']),
    (3, '<Int32 name="v" valueReference="7" causality="local" previous="1"/>', ["`v` has `previous`", "no clock"]),
    (3, f'{CLOCK}<Int32 name="v" valueReference="7" causality="local" clocks="8" previous="6"/>', ["valueReference 6", "does not exist"]),
    (3, f'{CLOCK}<Int32 name="v" valueReference="7" causality="local" clocks="8" previous="7"/>', ["`v` is its own previous value"]),
    (3, f'{CLOCK}<Int32 name="v" valueReference="7" causality="local" clocks="8" previous="1"/>', ["previous value in `y`", "same type"]),
    (2, aliases(("local", 'start="1"'), ("local", 'start="2"')), ["`v` and `w`", "valueReference 7", "start values differ"]),
    (2, aliases(("local", 'start="1"'), ("local", 'start="1"')), ["`v` and `w`", "both have a start value"]),
    (2, aliases(("input", 'start="1"'), ("input", 'start="1"')), ["`v` and `w`", "both can be set"]),
    (2, V2.format("local", 'start="1"'), ["`v` has a start value", "no `initial`"]),
    (3, '<Float64 name="v" valueReference="7" causality="input" start="0" min="NaN"/>', ["min = NaN"]),
    (2, aliases(("local", 'unit="m"'), ("local", "")), ["`v` and `w`", "units differ"]),
]


@pytest.mark.parametrize(("version", "xml", "words"), DEFECTS)
def test_a_defect_is_told_with_its_line(tmp_path, version, xml, words):
    fmu, line = with_variable(tmp_path, version, xml)
    done = terraglue("fmu", "check", fmu)
    told = [text for text in done.stdout.splitlines() if f"line {line}" in text]
    assert any(all(word in text for word in words) for text in told), done.stdout + done.stderr
    done = terraglue("fmu", "run", fmu, "--strict", "--stop", "0.1")
    assert done.returncode == 2 and f"line {line}" in done.stderr, done.stderr
    assert f"line {line}" in terraglue("fmu", "run", fmu, "--stop", "0.1").stderr


@pytest.mark.parametrize(
    ("version", "xml"),
    [
        (2, V2.format("local", 'derivative="2"')),
        (2, V2.format('local" initial="exact', 'reinit="true" start="1"') + V2.format("local", 'derivative="3"').replace('"v" valueReference="7"', '"w" valueReference="8"')),
        (2, aliases(('local" initial="exact', 'start="1" nominal="-1e-9"'), ("local", ""))),
        (3, f'{CLOCK}<Int32 name="p" valueReference="9" causality="local"/>'
            '<Int32 name="v" valueReference="7" causality="local" clocks="8" previous="9"/>'),
        (3, '<Float64 name="v" valueReference="7" causality="local" derivative="1"/>'),
        (3, '<Clock name="c" valueReference="8" causality="output" intervalVariability="triggered"/>'
            '<Float64 name="v" valueReference="7" causality="input" variability="discrete" start="0" clocks="8"/>'),
        (3, '<Int32 name="v" valueReference="7" causality="input" start="0" min="-2147483648" max="2147483647"/>'),
        (3, '<UInt64 name="v" valueReference="7" causality="input" start="0" max="18446744073709551615"/>'),
        (3, '<UInt64 name="v" valueReference="7" causality="input" start="0" initial="exact"/>'),
        (3, '<Float32 name="v" valueReference="7" causality="input" start="3.4028235e38"/>'),
    ],
)
def test_what_the_standard_allows_is_not_told(tmp_path, version, xml):
    fmu, line = with_variable(tmp_path, version, xml)
    done = terraglue("fmu", "check", fmu)
    assert f"line {line}" not in done.stdout + done.stderr, done.stdout


@pytest.mark.parametrize(
    ("version", "before", "after", "message"),
    [
        (2, 'causality="input"', 'causalty="input"', "<ScalarVariable> has the attribute `causalty`"),
        (2, '<Real start="0.0"', '<Real start="0.0" intermediateUpdate="true"', "<Real> has the attribute `intermediateUpdate`"),
        (2, "<CoSimulation ", '<CoSimulation canGetAndSetFMUState="true" ', "<CoSimulation> has the attribute `canGetAndSetFMUState`"),
        (3, "<CoSimulation ", '<CoSimulation canGetAndSetFMUstate="true" ', "<CoSimulation> has the attribute `canGetAndSetFMUstate`"),
        (3, "instantiationToken=", 'guid="g" instantiationToken=', "<fmiModelDescription> has the attribute `guid`"),
        (3, "<Output ", '<Output dependencyKind="" ', "<Output> has the attribute `dependencyKind`"),
    ],
)
def test_an_attribute_that_the_standard_does_not_know_is_reported(tmp_path, version, before, after, message):
    plain = build(tmp_path, "m", GAIN, "r[1] = r[0];") if version == 2 else build_3(tmp_path, "m", [("y", "output", None, [])], "v[1][0] = t;")
    assert "has the attribute" not in terraglue("fmu", "check", plain).stdout
    fmu = described(tmp_path, plain, (before, after))
    assert message in terraglue("fmu", "check", fmu).stdout
    done = terraglue("fmu", "run", fmu, "--strict", "--stop", "0.1")
    assert done.returncode == 2 and message in done.stderr, done.stderr


def test_attributes_and_elements_of_tools_are_their_own(tmp_path):
    notes = '<VendorAnnotations><Tool name="t" own="1"><other x="2"/></Tool></VendorAnnotations><ModelVariables>'
    root = '<fmiModelDescription xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" xsi:noNamespaceSchemaLocation="x" '
    fmu = described(tmp_path, build(tmp_path, "m", GAIN, ""), ("<ModelVariables>", notes), ("<fmiModelDescription ", root))
    assert "has the attribute" not in terraglue("fmu", "check", fmu).stdout


@pytest.mark.parametrize(
    ("listed", "expected"),
    [
        ("", ["`y`, `z` are not listed"]),
        ('<Unknown index="2"/>', ["`z` is not listed"]),
        ('<Unknown index="2"/><Unknown index="3"/>', []),
        ('<Unknown index="1"/><Unknown index="2"/><Unknown index="3"/>', ["`u` does not belong there"]),
    ],
)
def test_the_initial_unknowns_are_those_of_the_standard(tmp_path, listed, expected):
    fmu = build(tmp_path, "m", [*GAIN, ("z", "output", 0.0, "")], "")
    fmu = described(tmp_path, fmu, ("</Outputs>", f"</Outputs><InitialUnknowns>{listed}</InitialUnknowns>"))
    done = terraglue("fmu", "check", fmu)
    found = [line for line in done.stdout.splitlines() if "initial unknowns" in line]
    assert len(found) == len(expected) and all(words in line for words, line in zip(expected, found)), done.stdout
    assert (done.returncode == 0) == (not expected)
    # a run does not need them
    done = terraglue("fmu", "run", fmu, "--strict", "--stop", "0.1")
    assert done.returncode == 0 and "initial unknowns" not in done.stderr, done.stderr


def test_exact_outputs_are_no_initial_unknowns_and_states_are(tmp_path):
    fmu = build(tmp_path, "m", GAIN, "", others='<ScalarVariable name="v" valueReference="7"><Real derivative="4"/></ScalarVariable>'
                '<ScalarVariable name="x" valueReference="8" initial="exact"><Real start="1"/></ScalarVariable>')
    lists = '</Outputs><Derivatives><Unknown index="3"/></Derivatives><InitialUnknowns>%s</InitialUnknowns>'
    exact = ('causality="output"', 'causality="output" initial="exact"'), ("<Real/>", '<Real start="0"/>')
    for listed, words in [('<Unknown index="3"/>', None), ("", "`v` is not listed"), ('<Unknown index="3"/><Unknown index="4"/>', "`x` does not belong")]:
        done = terraglue("fmu", "check", described(tmp_path, fmu, *exact, ("</Outputs>", lists % listed)))
        assert ("initial unknowns" in done.stdout) == bool(words) and (words or "") in done.stdout, done.stdout


@pytest.mark.parametrize(
    ("version", "before", "after", "message"),
    [
        (2, 'causality="input"', 'causality="input" initial="exact"', "`u` is Input and has `initial`"),
        (2, 'causality="input"', 'causality="parameter"', "`u` is a parameter without variability"),
        (2, 'guid="g"', 'guid="g" numberOfEventIndicators="-1"', "numberOfEventIndicators"),
        (2, "<CoSimulation ", '<CoSimulation maxOutputDerivativeOrder="-3" ', "maxOutputDerivativeOrder"),
        (3, "<CoSimulation ", '<CoSimulation fixedInternalStepSize="-1" ', "fixedInternalStepSize"),
        (3, 'causality="output"', 'causality="output" clocks="8"', "`y` belongs to clocks and is continuous"),
        (3, "</ModelStructure>", '<EventIndicator valueReference="99"/></ModelStructure>', "<EventIndicator> of ModelStructure: no variable has the valueReference `99`"),
        (2, "</Outputs>", '</Outputs><Derivatives><Unknown index="9"/></Derivatives>', "<Unknown> of ModelStructure: no variable has the index `9`"),
        (2, "<CoSimulation ", '<DefaultExperiment stopTime="1"/><CoSimulation ', "<CoSimulation> stands behind <DefaultExperiment>"),
        (3, "</ModelStructure>", '</ModelStructure><LogCategories/>', "<LogCategories> stands behind <ModelStructure>"),
        (3, "</ModelStructure>", '</ModelStructure><Other/>', "<Other> is no element of the standard"),
    ],
)
def test_further_faults_are_reported(tmp_path, version, before, after, message):
    clock = '<Clock name="c" valueReference="8" causality="output" intervalVariability="triggered"/>'
    plain = build(tmp_path, "m", GAIN, "r[1] = r[0];") if version == 2 else build_3(tmp_path, "m", [("y", "output", None, [])], "v[1][0] = t;", others=clock)
    assert message not in terraglue("fmu", "check", plain).stdout
    assert message in terraglue("fmu", "check", described(tmp_path, plain, (before, after))).stdout


def test_items_of_one_value_are_reported(tmp_path):
    types = '<SimpleType name="T"><Enumeration><Item name="a" value="1"/><Item name="b" value="1"/></Enumeration></SimpleType>'
    more = '<ScalarVariable name="e" valueReference="0" causality="parameter" variability="tunable"><Enumeration declaredType="T" start="1"/></ScalarVariable>'
    assert "two items of the value 1" in terraglue("fmu", "check", build(tmp_path, "m", GAIN, "", others=more, types=types)).stdout
