"""Adjoint derivatives of FMI 3 stand for directional ones: in the interface Jacobian of glued FMUs and in loops at the start."""

import csv
import json

import pytest

from cfmu import build_3
from conftest import terraglue

H = 0.01
# two coordinates with a coupled and unsymmetric mobility, so that rows and columns cannot be mistaken for each other
VARIABLES = [("x", "output", "", (2,)), ("v", "output", "", (2,)), ("a1", "output", "", ()), ("a2", "output", "", ())]
VARIABLES += [("f1", "input", "0", ()), ("f2", "input", "0", ()), ("asked", "output", "", ()), ("pull", "parameter", "0", ())]
MORE = r"""static const double W[2][2] = {{1, 0.6}, {0.1, 0.5}};
static int asked;
int fmi3GetDirectionalDerivative(Fmu *u, const unsigned *z, size_t n, const unsigned *k, size_t m, const double *s, size_t p, double *x, size_t q) {
    if (p != m || q != n) return 3; asked++;
    for (size_t i = 0; i < n; i++) { x[i] = 0; for (size_t j = 0; j < m; j++) x[i] += W[z[i] - 3][k[j] - 5] * s[j]; } return 0; }
int fmi3GetAdjointDerivative(Fmu *u, const unsigned *z, size_t n, const unsigned *k, size_t m, const double *s, size_t p, double *x, size_t q) {
    if (p != n || q != m) return 3; asked++;
    for (size_t j = 0; j < m; j++) { x[j] = 0; for (size_t i = 0; i < n; i++) x[j] += W[z[i] - 3][k[j] - 5] * s[i]; } return 0; }"""
CALC = r"""static const double w[2][2] = {{1, 0.6}, {0.1, 0.5}}; extern int times_asked(void); v[7][0] = times_asked();
for (int i = 0; i < 2; i++) v[3 + i][0] = w[i][0] * (v[5][0] + v[8][0]) + w[i][1] * v[6][0] - 4 * v[1][i];"""
STEP = r"""calc(u, v); for (int i = 0; i < 2; i++) { v[2][i] += h * v[3 + i][0]; v[1][i] += h * v[2][i]; }"""
KINDS = {"none": "", "directional": 'providesDirectionalDerivatives="true"', "adjoint": 'providesAdjointDerivatives="true"'}


@pytest.fixture(scope="session")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("adjoint")
    for kind, flags in KINDS.items():
        for side in "ab":
            more = MORE + "\nint times_asked(void) { return asked; }"
            build_3(folder, f"{kind}_{side}", VARIABLES, STEP, "", more, flags, calc=CALC)
    return folder


def glued(folder, kind, out):
    body = 'position = ["x[1]", "x[2]"]\nvelocity = ["v[1]", "v[2]"]\nacceleration = ["a1", "a2"]\nforce = ["f1", "f2"]\n'
    path = out.with_suffix(".toml")
    path.write_text(
        f'[time]\nstep_s = {H}\nduration_s = 1.0\n[gluing]\nstrategy = "iterative"\n[recording]\nevery_steps = 1\n'
        f'[a]\nfmu = "{folder}/{kind}_a.fmu"\npull = 3.0\n[a.bodies.m]\n{body}[b]\nfmu = "{folder}/{kind}_b.fmu"\n[b.bodies.m]\n{body}'
        '[[glue]]\nside_1 = "a.m"\nside_2 = "b.m"\ncomponents = ["x", "y"]\n'
    )
    done = terraglue("run", path, "--csv", "--quiet", "--out", out)
    assert done.returncode == 0, done.stderr
    summary = json.loads((out / "summary.json").read_text())
    return list(csv.DictReader((out / "variables.csv").open())), summary


def test_two_fmus_are_glued_by_adjoint_derivatives(folder, tmp_path):
    told = {kind: glued(folder, kind, tmp_path / kind) for kind in KINDS}
    rows, summary = told["directional"]
    assert max(abs(float(row["a.x[1]"])) for row in rows) > 0.3
    for kind in ("none", "adjoint"):
        for own, other in zip(told[kind][0], rows, strict=True):
            for name in ("a.x[1]", "a.x[2]", "b.x[1]", "b.x[2]"):
                assert float(own[name]) == pytest.approx(float(other[name]), abs=1e-9)
    asked = {kind: [float(told[kind][0][-1][f"{side}.asked"]) for side in "ab"] for kind in KINDS}
    assert asked["none"] == [0, 0] and min(asked["adjoint"]) > 0 and asked["adjoint"] == asked["directional"]
    assert told["adjoint"][1]["evaluations_mean"] == summary["evaluations_mean"]


# y = k·u + 1; the loop y1 → u2, y2 → u1
LOOP = [("u", "input", "0", ()), ("y", "output", "", ()), ("k", "parameter", "1", ()), ("asked", "output", "", ())]
SLOPE = r"""static int asked; int times_asked(void) { return asked; }
int fmi3GetAdjointDerivative(Fmu *u, const unsigned *z, size_t n, const unsigned *k, size_t m, const double *s, size_t p, double *x, size_t q) {
    asked++; *x = n == 1 && z[0] == 2 && k[0] == 1 ? u->v[3][0] * s[0] : 0; return 0; }"""


def test_a_loop_at_the_start_is_solved_by_adjoint_derivatives(tmp_path):
    for name in ("one", "two"):
        calc = "extern int times_asked(void); v[2][0] = v[3][0] * v[1][0] + 1; v[4][0] = times_asked();"
        build_3(tmp_path, name, LOOP, "", "v[3][0] = 1;", SLOPE, KINDS["adjoint"], calc=calc)
    path = tmp_path / "loop.toml"
    path.write_text(
        '[time]\nstep_s = 0.1\nduration_s = 0.1\n[recording]\nevery_steps = 1\n[one]\nfmu = "one.fmu"\nk = 0.5\n[two]\nfmu = "two.fmu"\nk = -3.0\n'
        '[[connect]]\nfrom = "one.y"\nto = "two.u"\n[[connect]]\nfrom = "two.y"\nto = "one.u"\n'
    )
    done = terraglue("run", path, "--csv", "--quiet", "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    first = next(csv.DictReader((tmp_path / "out" / "variables.csv").open()))
    # y1 = y2/2 + 1, y2 = 1 - 3·y1
    assert [float(first["one.y"]), float(first["two.y"])] == pytest.approx([0.6, -0.8], abs=1e-12)
    assert float(first["one.asked"]) > 0 and float(first["two.asked"]) > 0
