"""Bodies of FMUs that are glued by a terminal of FMI 3: of exported FMUs, and of one made here with arrays."""

import csv
import subprocess
import xml.etree.ElementTree as ET
import zipfile

import pytest
from fmpy.validation import validate_fmu

from cfmu import build
from conftest import terraglue
from fmus import Fmu, export

H, STEPS = 0.001, 200
GRAVITY = -9.81
HEAVY, LIGHT = 3.0, 1.0

URDF = """<robot name="free"><link name="hull"><inertial><mass value="{mass}"/>
<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>"""

DESCRIPTION = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="mass" instantiationToken="g">
<CoSimulation modelIdentifier="m" canGetAndSetFMUState="true" canHandleVariableCommunicationStepSize="true"/>
<ModelVariables>
<Float64 name="time" valueReference="0" causality="independent" variability="continuous"/>
<Float64 name="p" valueReference="1" causality="output" initial="calculated"><Dimension start="3"/></Float64>
<Float64 name="v" valueReference="2" causality="output" initial="calculated"><Dimension start="3"/></Float64>
<Float64 name="f" valueReference="3" causality="input" start="0 0 0"><Dimension start="3"/></Float64>
</ModelVariables>
<ModelStructure><Output valueReference="1"/><Output valueReference="2"/></ModelStructure></fmiModelDescription>
"""

TERMINALS = """<?xml version="1.0" encoding="UTF-8"?>
<fmiTerminalsAndIcons fmiVersion="3.0"><Terminals><Terminal name="flange" matchingRule="bus" terminalKind="t">
<TerminalMemberVariable variableName="p" memberName="position" variableKind="signal"/>
<TerminalMemberVariable variableName="v" memberName="velocity" variableKind="signal"/>
<TerminalMemberVariable variableName="f" memberName="force" variableKind="signal"/>
</Terminal></Terminals></fmiTerminalsAndIcons>
"""

# A mass of 1 kg without gravity: semi-implicit Euler.
CODE = r"""
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
typedef struct { double x[3][3]; } Fmu;
void *fmi3InstantiateCoSimulation(const char *n, const char *t, const char *r, bool v, bool l, bool e, bool a,
    const unsigned *q, size_t k, void *env, void *log, void *up) { return calloc(1, sizeof(Fmu)); }
void fmi3FreeInstance(Fmu *u) { free(u); }
int fmi3EnterInitializationMode(Fmu *u, bool a, double b, double c, bool d, double e) { return 0; }
int fmi3ExitInitializationMode(Fmu *u) { return 0; }
int fmi3Terminate(Fmu *u) { return 0; }
int fmi3GetFloat64(Fmu *u, const unsigned *r, size_t n, double *x, size_t m) {
    for (size_t i = 0; i < n; i++) memcpy(x + 3 * i, u->x[r[i] - 1], 24);
    return m == 3 * n ? 0 : 3; }
int fmi3SetFloat64(Fmu *u, const unsigned *r, size_t n, const double *x, size_t m) {
    for (size_t i = 0; i < n; i++) memcpy(u->x[r[i] - 1], x + 3 * i, 24);
    return m == 3 * n ? 0 : 3; }
int fmi3DoStep(Fmu *u, double t, double h, bool g, bool *e, bool *d, bool *early, double *last) {
    for (int k = 0; k < 3; k++) { u->x[1][k] += h * u->x[2][k]; u->x[0][k] += h * u->x[1][k]; }
    *e = *d = *early = false; *last = t + h; return 0; }
int fmi3GetFMUState(Fmu *u, void **s) { if (!*s) *s = malloc(sizeof *u); memcpy(*s, u, sizeof *u); return 0; }
int fmi3SetFMUState(Fmu *u, void *s) { memcpy(u, s, sizeof *u); return 0; }
int fmi3FreeFMUState(Fmu *u, void **s) { free(*s); *s = 0; return 0; }
"""


@pytest.fixture(scope="session")
def folder(tmp_path_factory):
    """Two robots of one body as modules and as FMUs, and a mass with arrays."""
    folder = tmp_path_factory.mktemp("terminals")
    for name, mass, gravity in (("heavy", HEAVY, GRAVITY), ("light", LIGHT, 0.0)):
        model = folder / f"{name}.urdf"
        model.write_text(URDF.format(mass=mass))
        sets = (f"robot.model={model}", f"world.gravity_m_s2=[0.0,0.0,{gravity}]")
        export("rigid-body", folder / f"{name}.fmu", *(word for edit in sets for word in ("--set", edit)))
    (folder / "m.c").write_text(CODE)
    subprocess.run(["cc", "-shared", "-fPIC", "-w", "m.c", "-o", "m.so"], cwd=folder, check=True, capture_output=True)
    with zipfile.ZipFile(folder / "arrays.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", DESCRIPTION)
        archive.writestr("terminalsAndIcons/terminalsAndIcons.xml", TERMINALS)
        archive.write(folder / "m.so", "binaries/x86_64-linux/m.so")
    return folder


def glued(folder, out, side_2):
    """Heights over time of a falling body that is glued to `side_2`."""
    path = folder / "glued.toml"
    path.write_text(f"""
[time]
step_s = {H}
duration_s = {H * STEPS}
[gluing]
strategy = "iterative"
[recording]
every_steps = 1
[a]
fmu = "heavy.fmu"
[a.bodies.hull]
terminal = "hull"
{side_2}
[[glue]]
side_1 = "a.hull"
side_2 = "b.hull"
components = ["x", "y", "z"]
""")
    done = terraglue("run", path, "--csv", "--quiet", "--out", out)
    assert done.returncode == 0, done.stderr
    return list(csv.DictReader((out / "variables.csv").open()))


@pytest.mark.parametrize(
    ("side_2", "height"),
    [
        ('[b]\nfmu = "light.fmu"\n[b.bodies.hull]\nterminal = "hull"', "b.hull.z"),
        ('[b]\nfmu = "arrays.fmu"\n[b.bodies.hull]\nterminal = "flange"', "b.p[3]"),
    ],
)
def test_two_fmus_that_are_plugged_together_fall_as_one(folder, tmp_path, side_2, height):
    rows = glued(folder, tmp_path / "out", side_2)
    assert len(rows) == STEPS + 1
    share = GRAVITY * HEAVY / (HEAVY + LIGHT)
    v = z = 0.0
    for row in rows[1:]:
        v += H * share
        z += H * v
        fallen = [float(row[name]) - float(rows[0][name]) for name in ("a.hull.z", height)]
        assert fallen == pytest.approx([z, z], rel=1e-8, abs=1e-12)


def test_an_exported_fmu_has_a_terminal_for_each_body_and_stays_valid(folder):
    fmu = Fmu(folder / "heavy.fmu")
    assert validate_fmu(fmu.path) == []
    with zipfile.ZipFile(fmu.path) as archive:
        root = ET.fromstring(archive.read("terminalsAndIcons/terminalsAndIcons.xml"))
    (hull,) = root.findall("Terminals/Terminal")
    assert hull.get("name") == "hull"
    for member in hull.findall("TerminalMemberVariable"):
        variable = fmu.variables[member.get("variableName")]
        assert variable.name == f"hull.{member.get('memberName')}"
    fmu.remove()


ARM = """<robot name="arm"><link name="base"><inertial><mass value="5"/>
<inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="elbow"><inertial><mass value="1"/>
<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="elbow" type="revolute"><parent link="base"/><child link="elbow"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="1" effort="9" velocity="3"/></joint></robot>"""


def test_an_exported_fmu_has_a_terminal_for_each_joint(tmp_path):
    (tmp_path / "arm.urdf").write_text(ARM)
    export("rigid-body", tmp_path / "arm.fmu", "--set", f"robot.model={tmp_path / 'arm.urdf'}")
    fmu = Fmu(tmp_path / "arm.fmu")
    assert validate_fmu(fmu.path) == []
    with zipfile.ZipFile(fmu.path) as archive:
        root = ET.fromstring(archive.read("terminalsAndIcons/terminalsAndIcons.xml"))
    found = {t.get("name"): t for t in root.findall("Terminals/Terminal")}
    # the body has the name of the joint that carries it
    assert set(found) == {"base", "elbow", "elbow_joint"}
    joint = found["elbow_joint"]
    assert joint.get("terminalKind") == "org.terraglue.joint"
    members = {m.get("memberName"): m.get("variableName") for m in joint.findall("TerminalMemberVariable")}
    assert members == {"position": "elbow.angle", "velocity": "elbow.velocity", "torque": "elbow.torque",
                       "torque_limit": "elbow.max_torque", "blocked": "elbow.blocked"}
    assert set(members.values()) <= set(fmu.variables)
    fmu.remove()


@pytest.mark.parametrize(
    ("terminal", "says"),
    [('"hill"', "did you mean `hull`"), ("3", "takes a name in quotes"), ('"hull"\nforce = ["f"]', "stands for")],
)
def test_a_terminal_that_does_not_fit_is_refused(folder, tmp_path, terminal, says):
    path = folder / "wrong.toml"
    path.write_text(
        f'[time]\nstep_s = 0.001\nduration_s = 0.001\n[a]\nfmu = "heavy.fmu"\n[a.bodies.hull]\nterminal = {terminal}\n'
    )
    done = terraglue("run", path, "--quiet", "--out", tmp_path / "out")
    assert done.returncode == 2 and says in done.stderr, done.stderr


def test_an_fmu_that_does_not_come_back_to_its_saved_state_is_refused(tmp_path):
    reals = [("x", "output", 0, ""), ("v", "output", 0, ""), ("f", "input", 0, "")]
    honest = "r[1] += h * r[2]; r[0] += h * r[1];"
    build(tmp_path, "honest", reals, honest)
    build(tmp_path, "forgetful", reals, "static double hidden = 0; hidden += 1e-3; " + honest + " r[0] += hidden;")
    body = 'position = ["x"]\nvelocity = ["v"]\nforce = ["f"]\n'
    path = tmp_path / "pair.toml"
    path.write_text(
        '[time]\nstep_s = 0.01\nduration_s = 0.1\n[gluing]\nstrategy = "iterative"\n'
        f'[a]\nfmu = "honest.fmu"\n[a.bodies.m]\n{body}[b]\nfmu = "forgetful.fmu"\n[b.bodies.m]\n{body}'
        '[[glue]]\nside_1 = "a.m"\nside_2 = "b.m"\ncomponents = ["x"]\n'
    )
    done = terraglue("run", path, "--quiet", "--out", tmp_path / "out")
    assert done.returncode == 1, done.stderr
    for words in ("forgetful.fmu", "come back to the state", "`x` is", "deviation 1.0e-3"):
        assert words in done.stderr, done.stderr
    path.write_text(path.read_text().replace("forgetful.fmu", "honest.fmu"))
    assert terraglue("run", path, "--quiet", "--out", tmp_path / "out").returncode == 0
