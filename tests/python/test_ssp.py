"""System structures: run as they are, converted into a scenario, and refused where they cannot be read."""

import csv
import zipfile

import pytest

from cfmu import build
from conftest import ROOT, terraglue
from fmus import export

NAMES = (
    'xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription" '
    'xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon" '
    'xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues" '
    'xmlns:ssm="http://ssp-standard.org/SSP1/SystemStructureParameterMapping" version="1.0"'
)
UNITS = '<Unit name="m"><BaseUnit m="1"/></Unit>'

# a gives 3 m; `inner` takes millimetres and doubles plus one metre; d receives millimetres, although it declares metres
SYSTEM = f"""<?xml version="1.0" encoding="UTF-8"?>
<ssd:SystemStructureDescription {NAMES} name="plant">
<ssd:System name="plant">
 <ssd:ParameterBindings>
  <ssd:ParameterBinding><ssd:ParameterValues><ssv:ParameterSet version="1.0" name="p"><ssv:Parameters>
    <ssv:Parameter name="a.c"><ssv:Real value="300" unit="cm"/></ssv:Parameter>
    <ssv:Parameter name="a.k"><ssv:Integer value="0"/></ssv:Parameter>
    <ssv:Parameter name="inner.k"><ssv:Real value="5"/></ssv:Parameter>
    <ssv:Parameter name="inner.b.n"><ssv:Integer value="4"/></ssv:Parameter>
    <ssv:Parameter name="inner.b.s"><ssv:String value="&quot;b&quot;"/></ssv:Parameter>
  </ssv:Parameters></ssv:ParameterSet></ssd:ParameterValues></ssd:ParameterBinding>
  <ssd:ParameterBinding source="resources/gains.ssv" prefix="of.">
    <ssd:ParameterMapping source="resources/gains.ssm"/></ssd:ParameterBinding>
 </ssd:ParameterBindings>
 <ssd:Elements>
  <ssd:Component name="a" source="resources/line.fmu">
   <ssd:Connectors><ssd:Connector name="y" kind="output"><ssc:Real/></ssd:Connector></ssd:Connectors>
  </ssd:Component>
  <ssd:System name="inner">
   <ssd:Connectors>
    <ssd:Connector name="in" kind="input"><ssc:Real unit="mm"/></ssd:Connector>
    <ssd:Connector name="out" kind="output"><ssc:Real/></ssd:Connector>
    <ssd:Connector name="k" kind="parameter"><ssc:Real/></ssd:Connector>
   </ssd:Connectors>
   <ssd:Elements><ssd:Component name="b" source="resources/line.fmu" type="application/x-fmu-sharedlibrary"/></ssd:Elements>
   <ssd:Connections>
    <ssd:Connection startConnector="in" endElement="b" endConnector="u">
     <ssc:LinearTransformation factor="2" offset="1"/></ssd:Connection>
    <ssd:Connection startElement="b" startConnector="y" endConnector="out"/>
    <ssd:Connection startConnector="k" endElement="b" endConnector="k"/>
   </ssd:Connections>
  </ssd:System>
  <ssd:Component name="d" source="resources/line.fmu">
   <ssd:Connectors><ssd:Connector name="u" kind="input"><ssc:Real unit="mm"/></ssd:Connector></ssd:Connectors>
   <ssd:ParameterBindings><ssd:ParameterBinding><ssd:ParameterValues><ssv:ParameterSet version="1.0" name="own">
     <ssv:Parameters><ssv:Parameter name="k"><ssv:Real value="99"/></ssv:Parameter>
     <ssv:Parameter name="c"><ssv:Real value="0.25"/></ssv:Parameter></ssv:Parameters></ssv:ParameterSet>
     </ssd:ParameterValues></ssd:ParameterBinding></ssd:ParameterBindings>
  </ssd:Component>
 </ssd:Elements>
 <ssd:Connections>
  <ssd:Connection startElement="a" startConnector="y" endElement="inner" endConnector="in"/>
  <ssd:Connection startElement="inner" startConnector="out" endElement="d" endConnector="u"/>
 </ssd:Connections>
</ssd:System>
<ssd:Units><ssc:Unit name="mm"><ssc:BaseUnit m="1" factor="0.001"/></ssc:Unit></ssd:Units>
<ssd:DefaultExperiment startTime="0" stopTime="1"/>
</ssd:SystemStructureDescription>"""

GAINS = f"""<?xml version="1.0"?><ssv:ParameterSet {NAMES} name="gains"><ssv:Parameters>
<ssv:Parameter name="d"><ssv:Real value="2"/></ssv:Parameter>
<ssv:Parameter name="unused"><ssv:Real value="2"/></ssv:Parameter></ssv:Parameters></ssv:ParameterSet>"""
MAPPING = f"""<?xml version="1.0"?><ssm:ParameterMapping {NAMES}>
<ssm:MappingEntry source="of.d" target="d.k"><ssc:LinearTransformation factor="10" offset="0.5"/></ssm:MappingEntry>
</ssm:ParameterMapping>"""


@pytest.fixture(scope="session")
def files(tmp_path_factory):
    """The files of the structure: y = k·u + c in metres."""
    folder = tmp_path_factory.mktemp("structure")
    (folder / "resources").mkdir()
    reals = [("u", "input", 0, "m"), ("y", "output", 0, "m"), ("k", "parameter", 1, ""), ("c", "parameter", 0, "m")]
    reals.append(("n_seen", "output", 0, ""))
    others = (
        '<ScalarVariable name="n" valueReference="0" causality="parameter"><Integer start="1"/></ScalarVariable>'
        '<ScalarVariable name="s" valueReference="0" causality="parameter"><String start="none"/></ScalarVariable>'
    )
    others += "".join(
        f'<ScalarVariable name="{name}" valueReference="{k}" causality="{role}" variability="{change}"><{kind}/></ScalarVariable>'
        for name, k, role, change, kind in (
            ("i_out", 1, "output", "discrete", "Integer"),
            ("i_in", 2, "input", "discrete", 'Integer start="0"'),
            ("e", 3, "parameter", "fixed", 'Enumeration declaredType="E" start="1"'),
            ("p", 0, "parameter", "fixed", 'Boolean start="true"'),
        )
    )
    types = '<SimpleType name="E"><Enumeration><Item name="off" value="1"/><Item name="on" value="2"/></Enumeration></SimpleType>'
    step = 'r[1] = r[2] * r[0] + r[3]; r[4] = i[0] + (strcmp(u->text, "\\"b\\"") ? 0 : 0.5) + 100 * i[3] + 1000 * b[0];'
    build(folder / "resources", "line", reals, step + " i[1] = 5;", others, UNITS, types=types)
    (folder / "resources" / "gains.ssv").write_text(GAINS)
    (folder / "resources" / "gains.ssm").write_text(MAPPING)
    return folder


def pack(files, path, text=SYSTEM, more=()):
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("SystemStructure.ssd", text)
        for name in ("line.fmu", "gains.ssv", "gains.ssm"):
            archive.write(files / "resources" / name, f"resources/{name}")
        for name, content in more:
            archive.writestr(name, content)
    return path


def run(path, out):
    done = terraglue("run", path, "--csv", "--quiet", "--out", out)
    assert done.returncode == 0, done.stderr
    return list(csv.DictReader((out / "variables.csv").open()))


def test_a_structure_runs_and_its_scenario_gives_the_same(files, tmp_path):
    rows = run(pack(files, tmp_path / "plant.ssp"), tmp_path / "archive")
    last = {name: float(value) for name, value in rows[-1].items() if name[:1] in "aid" and "." in name}
    assert last["a.y"] == 3.0
    assert last["inner_b.u"] == pytest.approx(7.0, rel=1e-15), "3000 mm are 3 m, doubled plus 1"
    assert last["inner_b.y"] == pytest.approx(35.0, rel=1e-15) and last["inner_b.n_seen"] == 4.5
    assert last["d.u"] == pytest.approx(35_000.0, rel=1e-15), "the unit of the structure goes before that of the FMU"
    assert last["d.y"] == pytest.approx(20.5 * 35_000.0 + 0.25, rel=1e-15)
    ssd = files / "plant.ssd"
    ssd.write_text(SYSTEM)
    assert run(ssd, tmp_path / "plain") == rows
    for source in (tmp_path / "plant.ssp", ssd):
        made = tmp_path / source.suffix[1:] / "scenario.toml"
        made.parent.mkdir()
        done = terraglue("convert", source, "-o", made)
        assert done.returncode == 0 and "3 FMUs, 2 connections" in done.stdout, done.stderr
        assert run(made, tmp_path / f"out-{source.suffix[1:]}") == rows
    done = terraglue("run", ssd, "--set", "d.start.k=1.0", "--set", "time.step_s=0.5", "--quiet", "--out", tmp_path / "x")
    assert done.returncode == 0, done.stderr


def test_a_structure_of_exported_fmus_runs(tmp_path):
    press = f"robot.model={ROOT}/models/bevameter.urdf"
    sets = ("robot.fixed_base=true", "robot.motor=velocity", press)
    fmu = export("rigid-body", tmp_path / "press.fmu", *(word for edit in sets for word in ("--set", edit)))
    text = f"""<ssd:SystemStructureDescription {NAMES} name="press"><ssd:System name="press"><ssd:Elements>
<ssd:Component name="one" source="press.fmu"><ssd:ParameterBindings><ssd:ParameterBinding><ssd:ParameterValues>
<ssv:ParameterSet version="1.0" name="p"><ssv:Parameters><ssv:Parameter name="small_press.velocity_target">
<ssv:Real value="0.02"/></ssv:Parameter></ssv:Parameters></ssv:ParameterSet></ssd:ParameterValues></ssd:ParameterBinding>
</ssd:ParameterBindings></ssd:Component><ssd:Component name="two" source="press.fmu"/></ssd:Elements>
<ssd:Connections><ssd:Connection startElement="one" startConnector="small_press.velocity" endElement="two"
endConnector="small_press.velocity_target"/></ssd:Connections></ssd:System>
<ssd:DefaultExperiment stopTime="0.1"/></ssd:SystemStructureDescription>"""
    with zipfile.ZipFile(tmp_path / "press.ssp", "w") as archive:
        archive.writestr("SystemStructure.ssd", text)
        archive.write(fmu, "press.fmu")
    rows = run(tmp_path / "press.ssp", tmp_path / "out")
    moved = [float(rows[-1][f"{name}.small_press.angle"]) for name in ("one", "two")]
    assert moved[0] == pytest.approx(0.002, rel=0.05) and moved[1] == pytest.approx(moved[0], rel=0.1)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('source="resources/line.fmu"', 'source="../line.fmu"', ["leads out of the folder", "SystemStructure.ssd:"]),
        ('source="resources/line.fmu"', 'source="resources/lime.fmu"', ["lime.fmu"]),
        ('endConnector="in"', 'endConnector="inn"', ["inner.inn"]),
        ('startElement="inner"', 'startElement="outer"', ["outer"]),
        ('m="1" factor="0.001"', 's="1" factor="0.001"', ["different dimensions", "a.y"]),
        ('startTime="0"', 'startTime="3"', ["does not start at 0"]),
        ("<ssc:LinearTransformation", "<ssc:BooleanMappingTransformation", ["has no <MapEntry>"]),
        ("<ssc:LinearTransformation", "<ssc:OtherTransformation", ["transformation is not read"]),
        ('name="inner"', 'name="a"', ["occurs twice"]),
        ('endElement="d" endConnector="u"', 'endElement="inner" endConnector="in"', ["is fed by"]),
        ('name="plant">\n<ssd:System', 'name="plant"><ssd:Sistem', ["SystemStructure.ssd:"]),
    ],
)
def test_a_structure_that_is_wrong_is_refused_by_place(files, tmp_path, old, new, says):
    assert old in SYSTEM
    path = pack(files, tmp_path / "wrong.ssp", SYSTEM.replace(old, new))
    done = terraglue("run", path, "--quiet", "--out", tmp_path / "out")
    assert done.returncode == 2 and not (tmp_path / "out").exists(), done.stderr
    flat = " ".join(done.stderr.replace("│", " ").replace("|", " ").split())
    assert all(word in flat for word in says), done.stderr


def test_an_archive_that_leads_out_of_its_folder_is_refused(files, tmp_path):
    path = pack(files, tmp_path / "evil.ssp", more=[("../evil", "x")])
    done = terraglue("convert", path)
    assert done.returncode == 2 and "leads out" in done.stderr and not (tmp_path / "evil.toml").exists()
    with zipfile.ZipFile(tmp_path / "empty.ssp", "w") as archive:
        archive.writestr("other.ssd", SYSTEM)
    done = terraglue("run", tmp_path / "empty.ssp")
    assert done.returncode == 2 and "it is no SSP" in " ".join(done.stderr.split())


# a provides a signal in millimetres and a state; the nested b and d read both, d by another table
SHARED = f"""<?xml version="1.0"?><ssd:SystemStructureDescription {NAMES} xmlns:ssb="http://ssp-standard.org/SSP1/SystemStructureSignalDictionary"
 name="shared"><ssd:System name="shared">
 <ssd:ParameterBindings><ssd:ParameterBinding><ssd:ParameterValues><ssv:ParameterSet version="1.0" name="p"><ssv:Parameters>
   <ssv:Parameter name="c"><ssv:Real value="3"/></ssv:Parameter><ssv:Parameter name="go"><ssv:Boolean value="true"/></ssv:Parameter>
   <ssv:Parameter name="level"><ssv:Integer value="7"/></ssv:Parameter><ssv:Parameter name="kind"><ssv:Enumeration value="dry"/></ssv:Parameter>
  </ssv:Parameters></ssv:ParameterSet></ssd:ParameterValues>
  <ssd:ParameterMapping><ssm:ParameterMapping version="1.0">
   <ssm:MappingEntry source="c" target="a.c"/>
   <ssm:MappingEntry source="go" target="a.p"><ssc:BooleanMappingTransformation><ssc:MapEntry source="true" target="false"/>
    <ssc:MapEntry source="false" target="true"/></ssc:BooleanMappingTransformation></ssm:MappingEntry>
   <ssm:MappingEntry source="level" target="a.n"><ssc:IntegerMappingTransformation><ssc:MapEntry source="7" target="4"/>
    </ssc:IntegerMappingTransformation></ssm:MappingEntry>
   <ssm:MappingEntry source="kind" target="a.e"><ssc:EnumerationMappingTransformation><ssc:MapEntry source="dry" target="on"/>
    <ssc:MapEntry source="wet" target="off"/></ssc:EnumerationMappingTransformation></ssm:MappingEntry>
  </ssm:ParameterMapping></ssd:ParameterMapping></ssd:ParameterBinding></ssd:ParameterBindings>
 <ssd:Elements>
  <ssd:Component name="a" source="resources/line.fmu"/>
  <ssd:SignalDictionaryReference name="bus" dictionary="signals"/>
  <ssd:System name="inner"><ssd:Elements><ssd:Component name="b" source="resources/line.fmu"/>
   <ssd:SignalDictionaryReference name="here" dictionary="signals"/></ssd:Elements><ssd:Connections>
   <ssd:Connection startElement="here" startConnector="way" endElement="b" endConnector="u"/>
   <ssd:Connection startElement="here" startConnector="state" endElement="b" endConnector="i_in"/></ssd:Connections></ssd:System>
  <ssd:Component name="d" source="resources/line.fmu"/>
 </ssd:Elements>
 <ssd:Connections>
  <ssd:Connection startElement="a" startConnector="y" endElement="bus" endConnector="way"/>
  <ssd:Connection startElement="a" startConnector="i_out" endElement="bus" endConnector="state"><ssc:IntegerMappingTransformation>
   <ssc:MapEntry source="0" target="10"/><ssc:MapEntry source="5" target="20"/></ssc:IntegerMappingTransformation></ssd:Connection>
  <ssd:Connection startElement="bus" startConnector="state" endElement="d" endConnector="i_in"><ssc:IntegerMappingTransformation>
   <ssc:MapEntry source="10" target="-1"/><ssc:MapEntry source="20" target="-2"/><ssc:MapEntry source="30" target="-3"/>
  </ssc:IntegerMappingTransformation></ssd:Connection>
 </ssd:Connections>
 <ssd:SignalDictionaries><ssd:SignalDictionary name="signals" source="resources/signals.ssb"/></ssd:SignalDictionaries>
</ssd:System><ssd:DefaultExperiment stopTime="1"/></ssd:SystemStructureDescription>"""

SIGNALS = f"""<?xml version="1.0"?><ssb:SignalDictionary {NAMES} xmlns:ssb="http://ssp-standard.org/SSP1/SystemStructureSignalDictionary">
<ssb:DictionaryEntry name="way"><ssc:Real unit="mm"/></ssb:DictionaryEntry><ssb:DictionaryEntry name="state"><ssc:Integer/></ssb:DictionaryEntry>
<ssc:Units><ssc:Unit name="mm"><ssc:BaseUnit m="1" factor="0.001"/></ssc:Unit></ssc:Units></ssb:SignalDictionary>"""


def test_dictionaries_and_tables(files, tmp_path):
    path = pack(files, tmp_path / "shared.ssp", SHARED, [("resources/signals.ssb", SIGNALS)])
    rows = run(path, tmp_path / "out")
    last = {name: float(value) for name, value in rows[-1].items() if name[:1] in "aid" and "." in name}
    assert last["a.y"] == 3.0 and last["inner_b.u"] == 3.0 and last["inner_b.y"] == 3.0
    assert last["a.n_seen"] == 4 + 100 * 2 + 1000 * 0, "level 7 is 4, dry is on (2), go is no"
    assert last["a.i_out"] == 5 and last["inner_b.i_in"] == 20 and last["d.i_in"] == -2
    done = terraglue("convert", path, "-o", tmp_path / "shared.toml")
    text = (tmp_path / "shared.toml").read_text()
    assert done.returncode == 0 and 'map = { "0" = -1, "5" = -2 }' in text and 'map = { "0" = 10, "5" = 20 }' in text, text
    assert run(tmp_path / "shared.toml", tmp_path / "again") == rows
    inside = SHARED.replace(' source="resources/signals.ssb"/>', f'>{SIGNALS.split("?>")[1]}</ssd:SignalDictionary>')
    assert run(pack(files, tmp_path / "inside.ssp", inside), tmp_path / "inside") == rows


LINEAR = '<ssc:LinearTransformation factor="{}" offset="{}"/></ssd:Connection>'
PLAIN_END = 'startConnector="state" endElement="b" endConnector="i_in"/>'


def test_a_table_follows_a_conversion_and_the_reverse(files, tmp_path):
    # a gives 5: 2 * 5 + 10 = 20 on the bus, which d makes -2 by its table; behind a table it is 3 * 20 - 1 for b
    at = SHARED.index('<ssc:IntegerMappingTransformation>\n   <ssc:MapEntry source="0"')
    end = SHARED.index("</ssd:Connection>", at) + len("</ssd:Connection>")
    first = SHARED[:at] + LINEAR.format(2, 10) + SHARED[end:]
    rows = run(pack(files, tmp_path / "first.ssp", first, [("resources/signals.ssb", SIGNALS)]), tmp_path / "first")
    assert [float(rows[-1][name]) for name in ("a.i_out", "inner_b.i_in", "d.i_in")] == [5, 20, -2]
    then = SHARED.replace(PLAIN_END, PLAIN_END[:-2] + ">" + LINEAR.format(3, -1))
    assert then != SHARED
    rows = run(pack(files, tmp_path / "then.ssp", then, [("resources/signals.ssb", SIGNALS)]), tmp_path / "then")
    assert float(rows[-1]["inner_b.i_in"]) == 59 and float(rows[-1]["d.i_in"]) == -2
    odd = then.replace('factor="3"', 'factor="0.125"')
    path = pack(files, tmp_path / "odd.ssp", odd, [("resources/signals.ssb", SIGNALS)])
    done = terraglue("run", path, "--quiet", "--out", tmp_path / "odd")
    assert done.returncode == 2 and "`0` of `map` becomes true, false, a whole number" in done.stderr, done.stderr


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('dictionary="signals"/>\n  <ssd:System', 'dictionary="signs"/>\n  <ssd:System', ["no signal dictionary `signs`"]),
        ('startConnector="way"', 'startConnector="weigh"', ["signals.weigh"]),
        ('source="7" target="4"', 'source="8" target="4"', ["a.n", "no entry"]),
        ('source="7" target="4"', 'source="x" target="4"', ['source = "x"', "whole number"]),
        ('source="5" target="20"', 'source="0" target="20"', ["occurs twice"]),
        ('startElement="a" startConnector="i_out"', 'startElement="d" startConnector="i_out"', None),
        ('endElement="bus" endConnector="state">', 'endElement="bus" endConnector="way">', ["is fed by"]),
        ('unit="mm"/>', 'unit="kg"/>', ["different dimensions", "signals.way"]),
        ("signals.ssb", "sings.ssb", ["sings.ssb"]),
    ],
)
def test_a_dictionary_or_table_that_is_wrong_is_refused(files, tmp_path, old, new, says):
    text, signals = (t.replace(old, new) for t in (SHARED, SIGNALS))
    assert (text, signals) != (SHARED, SIGNALS)
    path = pack(files, tmp_path / "wrong.ssp", text, [("resources/signals.ssb", signals)])
    done = terraglue("run", path, "--quiet", "--out", tmp_path / "out")
    if says is None:
        assert done.returncode == 0, "a signal may come from anywhere"
        return
    flat = " ".join(done.stderr.replace("│", " ").split())
    assert done.returncode == 2 and all(word in flat for word in says), done.stderr


MASS = [("f", "input", 0.0, ""), ("x", "output", 0.1, ""), ("k", "parameter", 1.0, "")]
SPRING = [("x", "input", 100.0, "mm"), ("f", "output", -10.0, "")]
TWO = """[time]
step_s = 0.01
duration_s = 0.5
[recording]
every_steps = 1
[mass]
fmu = "mass.fmu"
k = 2
[spring]
fmu = "spring.fmu"
[[connect]]
from = "mass.x"
to = "spring.x"
factor = 1000.0
convert = false
[[connect]]
from = "spring.f"
to = "mass.f"
"""


def two(folder):
    build(folder, "mass", MASS, "r[1] += r[2] * h * h * r[0];", units=UNITS, depends="")
    build(folder, "spring", SPRING, "r[1] = -0.1 * r[0];", units=UNITS + '<Unit name="mm"><BaseUnit m="1" factor="0.001"/></Unit>', depends="1")
    (folder / "two.toml").write_text(TWO)
    return folder / "two.toml"


def test_a_scenario_of_fmus_becomes_a_structure_that_runs_alike(tmp_path):
    scenario = two(tmp_path)
    done = terraglue("convert", scenario, "-o", tmp_path / "two.ssp")
    assert done.returncode == 0 and "2 FMUs, 2 connections" in done.stdout and "0.01 s is left to the master" in done.stderr
    numbers = {}
    for name in ("two.toml", "two.ssp"):
        out = tmp_path / f"out_{name}"
        done = terraglue("run", tmp_path / name, "--set", "time.step_s=0.01", "--csv", "--quiet", "--out", out)
        assert done.returncode == 0, done.stderr
        numbers[name] = (out / "variables.csv").read_text()
    assert numbers["two.toml"] == numbers["two.ssp"] and len(numbers["two.ssp"].splitlines()) == 52


def test_another_program_reads_the_structure(tmp_path):
    from fmpy.ssp.ssd import read_ssd

    assert terraglue("convert", two(tmp_path), "-o", tmp_path / "two.ssp").returncode == 0
    structure = read_ssd(tmp_path / "two.ssp")
    assert {e.name for e in structure.system.elements} == {"mass", "spring"} and len(structure.system.connections) == 2


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('fmu = "spring.fmu"', 'module = "gait"', ["`spring` is a module", "terraglue export"]),
        ('from = "spring.f"', 'from = "spring.*"', ["two.toml:17", "no variable", "no pattern"]),
        ("k = 2", '[[event]]\nat_s = 0.1\nset = { "mass.k" = 1.0 }\n[mass.start]\nk = 2', ["`[[event]]`", "no such thing"]),
    ],
)
def test_what_a_structure_cannot_say_is_refused(tmp_path, old, new, words):
    scenario = two(tmp_path)
    scenario.write_text(TWO.replace(old, new))
    done = terraglue("convert", scenario, "-o", tmp_path / "two.ssp")
    assert done.returncode == 2 and all(word in done.stderr for word in words), done.stderr
    assert not (tmp_path / "two.ssp").exists()
