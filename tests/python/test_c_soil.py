"""The soil in C: built with the system's compiler, it walks; when it breaks mid-run, the run reports it."""

import json
import os
import subprocess

import pytest
from conftest import MOON_WALK, ROOT, terraglue
from mcap.records import Message
from mcap.stream_reader import StreamReader

SOURCE = ROOT / "tests" / "modules" / "soil-elastic-c" / "soil_elastic.c"
INCLUDE = ROOT / "interfaces" / "plugin" / "include"


def build(folder, text):
    source, library = folder / "soil.c", folder / "libsoil_elastic_plugin.so"
    source.write_text(text)
    compiler = os.environ.get("CC", "cc")
    command = [compiler, "-std=c11", "-O2", "-fPIC", "-shared", f"-I{INCLUDE}", source, "-o", library, "-lm"]
    subprocess.run(command, check=True)
    return library


def broken(old, new):
    text = SOURCE.read_text()
    assert text.count(old) == 1
    return text.replace(old, new)


@pytest.mark.parametrize("strategy", ["cooperative", "iterative"])
def test_moon_walk_runs_on_the_soil_in_c_by_changing_one_word(tmp_path, strategy):
    build(tmp_path, SOURCE.read_text())
    process = terraglue("run", MOON_WALK, "--set", "soil.module=soil-elastic", "--module-path", tmp_path,
                        "--set", f"gluing.strategy={strategy}", "--duration", "1", "--out", tmp_path / "o", "--json")
    assert process.returncode == 0, process.stderr
    summary = json.loads(process.stdout)
    assert summary["soil_module"] == "soil-elastic"
    # A single pass has nothing to converge to, and this soil keeps no energy ledger.
    assert summary["steps_not_converged"] == (None if strategy == "cooperative" else 0)
    assert summary["energy_balance_j"] is None and summary["interface_work_error_j"] is None
    assert summary["energies"]["without_book"] == ["soil"] and summary["energies"]["soil_heat_j"] is None
    assert summary["soil_mass_error_relative"] is None
    assert summary["max_sinkage_m"] is None, "elastic ground keeps no prints"
    assert 0 < summary["max_roll_rad"] < 0.26 and 0 < summary["max_pitch_rad"] < 0.26
    if strategy == "iterative":
        assert summary["max_action_reaction_gap_n"] < 1e-4


FAULTS = {
    "commit": ("    (void)t; /*", "    if (st->t > 0.2) return fail(s->error, \"worn out\");\n    (void)t; /*", "worn out"),
    "advance": ("    a->force = in->kind == TG_FORCE", "    if (st->t > 0.2 && st->n) { out->t[0] = NAN; return TG_OK; }\n"
                "    a->force = in->kind == TG_FORCE", "NaN"),
}


@pytest.mark.parametrize("function", FAULTS)
def test_a_module_that_breaks_ends_the_run_and_keeps_the_recording(tmp_path, function):
    old, new, message = FAULTS[function]
    build(tmp_path, broken(old, new))
    folder = tmp_path / "out"
    process = terraglue("run", MOON_WALK, "--set", "soil.module=soil-elastic", "--module-path", tmp_path,
                        "--set", "gluing.strategy=iterative", "--duration", "1", "--out", folder)
    assert process.returncode == 1, process.stderr
    for text in ("soil-elastic", function, "t = 0.2", message):
        assert text in process.stderr, process.stderr
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["status"] == "failed"
    assert (summary["error"]["module"], summary["error"]["function"]) == ("soil-elastic", function)
    assert summary["error"]["time_s"] == pytest.approx(summary["simulated_s"]) and message in summary["error"]["message"]
    with open(folder / "recording.mcap", "rb") as file:
        last = max(r.log_time for r in StreamReader(file).records if isinstance(r, Message))
    assert last == pytest.approx(summary["simulated_s"] * 1e9)
    assert (folder / "report.html").is_file()
