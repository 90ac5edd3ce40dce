"""One FMU alone: kept apart in a process of its own, ended by itself, and shown without running it."""

import json
import math
import subprocess
import sysconfig
import zipfile
from pathlib import Path

import cfmu
import pytest
from conftest import PROGRAM, terraglue

REALS = [("x", "output", 0.0, "m"), ("rate", "parameter", 1.0, "m/s")]
COUNTS = "r[0] = t + h;"


def run(fmu, *arguments):
    return terraglue("fmu", "run", fmu, "--stop", "1", "--step", "0.1", *arguments)


@pytest.mark.parametrize("call", ["_exit(0)", "_Exit(0)", "exit(0)", "quick_exit(0)"])
def test_an_fmu_that_ends_the_program_is_an_error(tmp_path, call):
    more = "void _exit(int); void _Exit(int); void quick_exit(int);"
    fmu = cfmu.build(tmp_path, "leaves", REALS, f"if (t > 0.45) {call}; {COUNTS}", more=more)
    ended = run(fmu, "--csv", tmp_path / "rows.csv")
    assert ended.returncode == 1 and "ended the program" in ended.stderr, ended.stderr
    assert len((tmp_path / "rows.csv").read_text().splitlines()) >= 6
    apart = run(fmu, "--isolate")
    assert apart.returncode == 1 and "leaves.fmu" in apart.stderr
    assert apart.stdout.splitlines()[-1].startswith("0.5,")


def test_a_module_that_ends_the_program_leaves_a_closed_recording(tmp_path):
    fmu = cfmu.build(tmp_path, "leaves", REALS, f"if (t > 0.45) _exit(0); {COUNTS}", more="void _exit(int);")
    scenario = tmp_path / "one.toml"
    scenario.write_text(f'[time]\nduration_s = 1.0\nstep_s = 0.1\n[one]\nfmu = "{fmu.name}"\n')
    ended = terraglue("run", scenario, "--out", tmp_path / "out")
    assert ended.returncode == 1 and "`one` ended the program" in ended.stderr, ended.stderr
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["status"] == "failed"
    assert (tmp_path / "out" / "report.html").exists()


def test_what_forks_and_ends_its_child_does_no_harm(tmp_path):
    more = "#include <unistd.h>\n#include <sys/wait.h>\n"
    step = f"{{ int p = fork(); if (!p) _exit(0); waitpid(p, 0, 0); }} {COUNTS}"
    fmu = cfmu.build(tmp_path, "forks", REALS, step, more=more)
    ended = run(fmu)
    assert ended.returncode == 0 and ended.stdout.splitlines()[-1].startswith("1,1"), ended.stderr


def test_a_crash_at_the_end_loses_no_row(tmp_path):
    fmu = cfmu.build(tmp_path, "crashes", REALS, COUNTS)
    source = tmp_path / "crashes.c"
    source.write_text(source.read_text().replace("int fmi2Terminate(Fmu *u) { return 0; }", "int fmi2Terminate(Fmu *u) { *(volatile int *)0 = 1; return 0; }"))
    subprocess.run(["cc", "-shared", "-fPIC", "-w", "crashes.c", "-o", "m.so", "-lm"], cwd=tmp_path, check=True)
    description = zipfile.ZipFile(fmu).read("modelDescription.xml")
    with zipfile.ZipFile(fmu, "w") as archive:
        archive.writestr("modelDescription.xml", description)
        archive.write(tmp_path / "m.so", "binaries/linux64/m.so")
    for apart in ([], ["--isolate"]):
        ended = run(fmu, "--csv", tmp_path / "rows.csv", *apart)
        assert ended.returncode != 0
        assert (tmp_path / "rows.csv").read_text().splitlines()[-1].startswith("1,1")


def test_an_fmu_that_crashes_while_it_saves_its_state_runs_without(tmp_path):
    more = "int fmi2GetFMUstate(Fmu *u, void **s) { *(volatile int *)0 = 1; return 0; }"
    fmu = cfmu.build(tmp_path, "crashes", REALS, COUNTS, more=more, instead=["fmi2GetFMUstate"])
    crashed = run(fmu)
    assert crashed.returncode not in (0, 1, 2) and "--no-rollback" in crashed.stderr, crashed.stderr
    ended = run(fmu, "--no-rollback")
    assert ended.returncode == 0 and ended.stdout.splitlines()[-1].startswith("1,1"), ended.stderr
    scenario = tmp_path / "one.toml"
    text = f'[time]\nduration_s = 1.0\nstep_s = 0.1\n[one]\nfmu = "{fmu.name}"\n'
    scenario.write_text(text)
    assert "`rollback = false`" in terraglue("run", scenario, "--quiet").stderr
    scenario.write_text(text + "rollback = false\n")
    ended = terraglue("run", scenario, "--quiet")
    assert ended.returncode == 0, ended.stderr


def test_rows_are_the_same_apart_and_each_is_written_once(tmp_path):
    fmu = cfmu.build(tmp_path, "counts", REALS, COUNTS)
    whole = terraglue("fmu", "run", fmu, "--stop", "10", "--step", "0.001")
    apart = terraglue("fmu", "run", fmu, "--stop", "10", "--step", "0.001", "--isolate")
    assert apart.returncode == 0, apart.stderr
    assert apart.stdout == whole.stdout and len(whole.stdout.splitlines()) == 10_002


def test_output_of_an_fmu_stands_apart_from_its_rows_and_has_a_bound(tmp_path):
    flood = 'for (int k = 0; k < 20000; k++) { puts("floods the output of whoever runs it"); fputs("and its errors, too\\n", stderr); }'
    fmu = cfmu.build(tmp_path, "floods", REALS, f"{flood} {COUNTS}", more="#include <stdio.h>\n")
    ended = run(fmu, "--isolate")
    assert ended.returncode == 0
    assert len(ended.stdout.splitlines()) == 12 and "floods" not in ended.stdout
    assert len(ended.stderr) < 3 << 20 and "the rest is left out" in ended.stderr


def isolated(fmu, folder):
    (folder / "one.toml").write_text(f'[time]\nduration_s = 1.0\nstep_s = 0.1\n[one]\nfmu = "{fmu}"\nisolate = true\n')
    return terraglue("run", folder / "one.toml", "--out", folder / "out")


def test_lines_that_an_isolated_fmu_of_a_scenario_prints_are_logged(tmp_path, monkeypatch):
    monkeypatch.setenv("TERRAGLUE_LOG", "info")
    step = f'printf("from %g", t); puts(" s"); fputs("aside\\n", stderr); {COUNTS}'
    ended = isolated(cfmu.build(tmp_path, "tells", REALS, step, more="#include <stdio.h>\n"), tmp_path)
    assert ended.returncode == 0, ended.stderr
    told = [line for line in ended.stderr.splitlines() if "one: " in line]
    assert sum("one: aside" in line for line in told) == 10
    assert [f"one: from {t:g} s" in "\n".join(told) for t in (0.0, 0.1, 0.9)] == [True] * 3, ended.stderr
    assert "from" not in ended.stdout
    flood = f'for (int k = 0; k < 20000; k++) puts("floods the output of whoever runs it"); {COUNTS}'
    ended = isolated(cfmu.build(tmp_path, "floods", REALS, flood, more="#include <stdio.h>\n"), tmp_path)
    assert ended.returncode == 0 and ended.stderr.count("the rest is left out") == 1 and len(ended.stderr) < 3 << 20


def test_an_isolated_fmu_that_crashes_has_last_words(tmp_path):
    step = f'if (t > 0.45) {{ puts("no valve is open"); *(volatile int *)0 = 1; }} {COUNTS}'
    ended = isolated(cfmu.build(tmp_path, "crashes", REALS, step, more="#include <stdio.h>\n"), tmp_path)
    assert ended.returncode == 1 and "segmentation fault" in ended.stderr and "no valve is open" in ended.stderr, ended.stderr


def test_a_step_that_hangs_is_ended_and_the_way_out_named(tmp_path):
    fmu = cfmu.build(tmp_path, "hangs", REALS, f"if (t > 0.45) for (;;) {{}} {COUNTS}")
    ended = run(fmu, "--isolate", "--timeout", "5")
    assert ended.returncode == 1
    for words in ("after t = 0.5 s", "within 5 s", "--timeout"):
        assert words in ended.stderr
    assert "[default: 30]" in terraglue("fmu", "run", "--help").stdout


@pytest.mark.parametrize("apart", [[], ["--isolate"]])
@pytest.mark.parametrize("value", ["z / z", "1 / z"])
def test_a_value_that_is_no_number_stops_the_run_or_is_written(tmp_path, apart, value):
    fmu = cfmu.build(tmp_path, "vague", REALS, f"double z = 0; r[0] = t > 0.45 ? {value} : t + h;")
    ended = run(fmu, *apart)
    assert ended.returncode == 1 and "`x` is" in ended.stderr and "--on-nan warn" in ended.stderr
    assert len(ended.stdout.splitlines()) == 7
    ended = run(fmu, "--on-nan", "warn", *apart)
    assert ended.returncode == 0 and ended.stderr.count("`x` is") == 1 and "t = 0.6" in ended.stderr, ended.stderr
    rows = [line.split(",") for line in ended.stdout.splitlines()[1:]]
    assert [math.isfinite(float(x)) for _, x in rows] == [True] * 6 + [False] * 5
    assert terraglue("fmu", "run", fmu, "--on-nan", "log").returncode == 2


def test_a_long_run_of_short_steps_is_not_ended(tmp_path):
    fmu = cfmu.build(tmp_path, "slow", REALS, f"usleep(500000); {COUNTS}", more="#include <unistd.h>\n")
    ended = run(fmu, "--isolate", "--timeout", "3")
    assert ended.returncode == 0, ended.stderr


def test_a_reader_that_leaves_ends_the_run(tmp_path):
    fmu = cfmu.build(tmp_path, "slow", REALS, f"usleep(1000); {COUNTS}", more="#include <unistd.h>\n")
    command = f"'{PROGRAM}' fmu run '{fmu}' --stop 1000 --step 0.1 --isolate | head -3"
    ended = subprocess.run(["bash", "-o", "pipefail", "-c", command], capture_output=True, text=True, timeout=300)
    assert ended.returncode == 0 and len(ended.stdout.splitlines()) == 3, ended.stderr


def packed(folder, name, description, **entries):
    with zipfile.ZipFile(folder / f"{name}.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", description)
        for path, text in entries.items():
            archive.writestr(path.replace("__", "/").replace("_dot_", "."), text)
    return folder / f"{name}.fmu"


def test_an_fmu_of_any_version_and_kind_is_shown(tmp_path):
    old = packed(
        tmp_path, "old",
        '<fmiModelDescription fmiVersion="1.0" modelName="old" modelIdentifier="old" guid="{1}" author="A. Person"><DefaultExperiment stopTime="3"/>'
        '<ModelVariables><ScalarVariable name="h" valueReference="0" causality="output"><Real start="1" unit="m"/></ScalarVariable></ModelVariables></fmiModelDescription>',
        binaries__linux64__old_dot_so="",
    )
    shown = terraglue("fmu", "info", old)
    assert shown.returncode == 0, shown.stderr
    for words in ("FMI 1.0, model exchange", "not run here", "A. Person", "linux64", "stopTime = 3", "output"):
        assert words in shown.stdout
    found = json.loads(terraglue("fmu", "info", old, "--json").stdout)
    assert found["interfaces"][0]["kind"] == "model exchange" and found["variables"][0]["unit"] == "m" and "FMI 1.0" in found["not_run_because"]

    scheduled = packed(
        tmp_path, "scheduled",
        '<fmiModelDescription fmiVersion="3.0" modelName="s" instantiationToken="t"><ScheduledExecution modelIdentifier="s"/>'
        '<LogCategories><Category name="logEvents"/></LogCategories><ModelVariables><Float64 name="x" valueReference="1" start="1 2"><Dimension start="2"/></Float64>'
        "</ModelVariables></fmiModelDescription>",
        **{"extra__org_dot_fmi-standard_dot_fmi-ls-bus__fmi-ls-manifest_dot_xml": '<fmiLayeredStandardManifest xmlns:fmi-ls="http://fmi-standard.org/fmi-ls-manifest" '
           'fmi-ls:fmi-ls-name="org.fmi-standard.fmi-ls-bus" fmi-ls:fmi-ls-version="1.0.0" fmi-ls:fmi-ls-description="buses"/>'},
    )
    shown = terraglue("fmu", "info", scheduled)
    for words in ("scheduled execution", "fmi-ls-bus 1.0.0", "logEvents", "Float64[2]"):
        assert words in shown.stdout
    both = terraglue("fmu", "info", cfmu.build(tmp_path, "counts", REALS, COUNTS), "--json")
    found = json.loads(both.stdout)
    assert found["not_run_because"] is None and [v["name"] for v in found["variables"]] == ["x", "rate"]


def test_an_fmu_that_forgets_the_library_of_python_gets_it(tmp_path):
    fmu = cfmu.build(tmp_path, "snake", REALS, COUNTS, more="int Py_IsInitialized(void);\nint snake(void) { return Py_IsInitialized(); }\n")
    library = Path(sysconfig.get_config_var("LIBDIR") or "") / (sysconfig.get_config_var("INSTSONAME") or "none")
    if ".so" not in library.name or not library.exists():
        pytest.skip("this Python has no shared library")
    ended = run(fmu)
    assert ended.returncode == 0, ended.stderr


def test_an_fmu_for_a_bus_says_what_is_not_simulated(tmp_path):
    fmu = cfmu.build(tmp_path, "node", REALS, COUNTS)
    with zipfile.ZipFile(fmu, "a") as archive:
        archive.writestr("extra/org.fmi-standard.fmi-ls-bus/fmi-ls-manifest.xml", "<fmiLayeredStandardManifest/>")
    (tmp_path / "s.toml").write_text('[time]\nstep_s = 0.1\nduration_s = 0.3\n[node]\nfmu = "node.fmu"\n')
    ended = terraglue("run", "s.toml", "--out", "out", cwd=tmp_path)
    assert ended.returncode == 0 and "FMI-LS-BUS" in ended.stderr and "one step late" in ended.stderr, ended.stderr
