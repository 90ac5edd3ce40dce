"""Results that FMUs bring with them (FMI-LS-REF) are run again, exports write them, and every call of an FMU can be traced."""

import csv
import io
import zipfile

import pytest
from cfmu import build, build_3, described
from conftest import terraglue

FOLDER = "extra/org.fmi-standard.fmi-ls-ref"
# of three outputs, of which the last is not among the numbers
UNKNOWNS = b'<Output valueReference="3"/>' + b"".join(b'<InitialUnknown valueReference="%d"/>' % k for k in (1, 2, 3)) + b"</ModelStructure>"
DECAY = [("u", "input", 0.0, ""), ("x", "output", 1.0, "")]


def bring(fmu, results, inputs=None, source="out.csv"):
    """Adds results, and inputs, to an FMU as the Modelica Reference FMUs have them."""
    related = f'<Related type="text/csv" source="{source}" role="result"/>'
    if inputs is not None:
        related += '<Related type="text/csv" source="in.csv" role="experiment"/>'
    manifest = (
        '<?xml version="1.0" encoding="UTF-8"?><fmiReferences xmlns:fmi-ls="http://fmi-standard.org/fmi-ls-manifest" '
        f'fmi-ls:fmi-ls-name="org.fmi-standard.fmi-ls-ref" fmi-ls:fmi-ls-version="1.0.0-alpha.1">{related}</fmiReferences>'
    )
    with zipfile.ZipFile(fmu, "a") as archive:
        archive.writestr(f"{FOLDER}/fmi-ls-manifest.xml", manifest)
        archive.writestr(f"{FOLDER}/out.csv", results)
        if inputs is not None:
            archive.writestr(f"{FOLDER}/in.csv", inputs)


@pytest.fixture
def fmu(tmp_path):
    """x follows u to the end of each step."""
    plain = build(tmp_path, "follows", DECAY, "r[1] = 1.0 + r[0];", flags="")
    return described(tmp_path, plain, ("</Outputs>", '</Outputs><InitialUnknowns><Unknown index="2"/></InitialUnknowns>'))


def check(fmu, *more):
    done = terraglue("fmu", "check", "--run", *more, fmu)
    return done.returncode, done.stdout + done.stderr


def test_results_are_run_again_with_their_inputs(fmu):
    rows = "time,x\n0,1\n0.25,1.5\n0.5,2\n1,3\n"
    bring(fmu, rows, "time,u\n0,0\n0.001,0\n0.998,2\n1,2\n")
    code, text = check(fmu, "--within", "0.02")
    assert code == 0 and "4 rows" in text and "| x " in text, text


def test_a_result_that_is_off_is_told_with_its_time(fmu):
    # the last of two rows of one time counts, as after an event
    bring(fmu, "time,x\n0,1\n0.5,9\n0.5,1\n1,1.5\n")
    code, text = check(fmu)
    row = next(line for line in text.splitlines() if line.startswith("| x "))
    assert code == 1 and [c.strip() for c in row.split("|")][2:6] == ["5.000e-1", "1", "1.000e0", "off"], text
    assert check(fmu, "--within", "1.5")[0] == 0


@pytest.mark.parametrize(
    ("results", "source", "words"),
    [
        ("time,y\n0,1\n1,1\n", "out.csv", ["`y`"]),
        ("t,x\n0,1\n", "out.csv", ["out.csv", "first column"]),
        ("time,x\n1,1\n0,1\n", "out.csv", ["out.csv", "line 3", "does not grow"]),
        ("time,x\n0,1\n1,1\n", "../../../x.csv", ["outside the archive"]),
        ("time,x\n0,1\n1,1\n", "none.csv", ["none.csv"]),
    ],
)
def test_results_that_cannot_be_read_are_named(fmu, results, source, words):
    bring(fmu, results, source=source)
    code, text = check(fmu)
    assert code in (1, 2) and all(word in text for word in words) and "panic" not in text, text


def test_a_column_of_another_version_is_not_compared(fmu):
    # the Modelica Reference FMUs bring one file for both versions of FMI
    bring(fmu, "time,Float32_x,x\n0,7,1\n1,7,1\n")
    code, text = check(fmu)
    assert code == 0 and "not compared" in text and "Float32_x" in text and "| x " in text, text


def test_arrays_in_one_cell_and_truth_values_are_compared(tmp_path):
    flag = '<Boolean name="on" valueReference="3" causality="output"/>'
    more = "int fmi3GetBoolean(Fmu *u, const unsigned *r, size_t k, bool *x, size_t m) { *x = u->v[1][0] > 0.5; return 0; }"
    reals = [("y", "output", None, [3]), ("x", "output", None, [])]
    step = "for (int i = 0; i < 3; i++) v[1][i] = (i + 1) * (t + h); v[2][0] = t;"
    for rows, off in (("0,0 0 0,false\n1,1 2 3,true\n", []), ("0,0 0 0,false\n1,1 2 4,false\n", ["on", "y[3]"])):
        one = build_3(tmp_path, "array", reals, step, others=flag, more=more)
        with zipfile.ZipFile(one) as archive:
            entries = {i.filename: archive.read(i) for i in archive.infolist()}
        entries["modelDescription.xml"] = entries["modelDescription.xml"].replace(b"</ModelStructure>", UNKNOWNS)
        with zipfile.ZipFile(one, "w") as archive:
            [archive.writestr(name, data) for name, data in entries.items()]
        bring(one, "time,y,on\n" + rows)
        code, text = check(one)
        lines = [line for line in text.splitlines() if line.startswith("| ") and line.rstrip().endswith("off |")]
        assert code == (1 if off else 0), text
        assert sorted(line.split("|")[1].strip() for line in lines) == off and "| y[2] " in text, text


def test_without_results_it_says_so(fmu):
    code, text = check(fmu)
    assert code == 2 and "FMI-LS-REF" in text, text
    assert terraglue("fmu", "check", fmu).returncode == 0


def test_an_exported_soil_proves_itself(tmp_path):
    soil = tmp_path / "soil.fmu"
    options = ["--set", "soil.parameters=LETE_sand", "--set", "foot.count=2", "--author", "A. Writer", "--model-version", "1.2"]
    done = terraglue("export", "soil-bekker", "-o", soil, *options, "--date", "2026-11-27T12:00:00+01:00")
    assert done.returncode == 0 and done.stderr == "", done.stderr
    with zipfile.ZipFile(soil) as archive:
        rows = list(csv.DictReader(io.StringIO(archive.read(f"{FOLDER}/result.csv").decode())))
        description = archive.read("modelDescription.xml").decode()
    # pressed in, then dragged: it was run, and with loads that matter
    assert len(rows) == 21 and max(float(r["foot.force[2,3]"]) for r in rows) > 50
    assert min(float(r["foot.force[1,1]"]) for r in rows) < -5
    assert all(word in description for word in ('author="A. Writer"', 'version="1.2"', '"2026-11-27T11:00:00Z"'))
    code, text = check(soil)
    assert code == 0 and "off" not in text and "no problem found" in text, text
    plain = tmp_path / "plain.fmu"
    assert terraglue("export", "soil-bekker", "-o", plain, *options[:4], "--no-reference").returncode == 0
    assert "glibc 2." in done.stdout
    assert not any(FOLDER in name for name in zipfile.ZipFile(plain).namelist())
    assert terraglue("export", "soil-bekker", "-o", plain, "--date", "yesterday").returncode == 2


def test_an_export_is_the_same_bytes_again(tmp_path, monkeypatch):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1780000000")
    made = []
    for name in "ab":
        (tmp_path / name).mkdir()
        out = tmp_path / name / "soil.fmu"
        done = terraglue("export", "soil-bekker", "-o", out, "--set", "soil.parameters=LETE_sand")
        assert done.returncode == 0, done.stderr
        made.append(out.read_bytes())
    assert made[0] == made[1] and b"PK" == made[0][:2]
    assert 'generationDateAndTime="2026-05-28T' in zipfile.ZipFile(io.BytesIO(made[0])).read("modelDescription.xml").decode()


def test_every_call_is_traced_before_it_is_made(tmp_path):
    crash = build(tmp_path, "crash", DECAY, "if (t > 0.4) __builtin_trap(); r[1] = 1.0 + r[0];")
    trace = tmp_path / "calls.txt"
    done = terraglue("fmu", "run", crash, "--step", "0.25", "--start", "u=2", "--isolate", "--trace", trace)
    lines = trace.read_text().splitlines()
    assert done.returncode == 1
    # the call that crashed is the last one, with its times
    assert lines[-2:] == ["from 0.5 s by 0.25 s", "fmi2DoStep"], lines[-4:]
    assert "[0] = [2.0]" in lines and "fmi2SetupExperiment" in lines and lines.count("fmi2DoStep") == 3
    assert "  [1]: [1.0]" in lines or "  [1]: [3.0]" in lines


def test_a_scenario_traces_too(tmp_path):
    build(tmp_path, "follows", DECAY, "r[1] = 1.0 + r[0];")
    (tmp_path / "s.toml").write_text('[time]\nstep_s = 0.1\nduration_s = 0.3\n[a]\nfmu = "follows.fmu"\ntrace = "calls.txt"\n')
    done = terraglue("run", "s.toml", "--quiet", "--out", "out", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "calls.txt").read_text().count("fmi2DoStep\n  ok") == 3
    (tmp_path / "s.toml").write_text('[time]\nduration_s = 0.3\n[a]\nfmu = "follows.fmu"\ntrace = "none/calls.txt"\n')
    done = terraglue("run", "s.toml", "--quiet", "--out", "out", cwd=tmp_path)
    assert done.returncode == 2 and "none/calls.txt" in done.stderr, done.stderr


def test_a_result_without_any_output_is_no_proof(fmu):
    bring(fmu, "time\n0\n1\n")
    code, text = check(fmu)
    assert code == 1 and "nothing was compared" in text and "without a reference: x" in text, text
