"""New code in a run that goes on: exchanged at a given step, refused with the reason, and never the end of the run."""

import csv
import json
import pathlib
import re
import shutil
import subprocess
import tempfile
import time

import pytest

from conftest import PROGRAM, ROOT, terraglue
from test_plugins import made

PAGE = ROOT / "docs" / "plugins" / "reload.md"


def rows(folder):
    return (folder / "variables.csv").read_bytes()


def column(folder, name):
    with open(folder / "variables.csv", newline="") as file:
        table = list(csv.DictReader(file))
    key = next(k for k in table[0] if k.split(" ")[0] == name)
    return [float(r[key]) for r in table]


def events(folder):
    return [e["what"] for e in json.loads((folder / "summary.json").read_text())["events"]]


def run(place, out, *arguments):
    return terraglue("run", "scenario.toml", "--csv", "--quiet", "--out", out, *arguments, cwd=place)


def complaints(process):
    """The messages on standard error, except for events that a short run does not reach."""
    return [line for line in process.stderr.splitlines() if "never happens: the run ends" not in line]


def built(folder, kind, language):
    place, _ = made(folder, kind, language)
    if language in ("c", "cpp"):
        subprocess.run(["make"], cwd=place, check=True, capture_output=True)
    return place


@pytest.mark.parametrize("kind, language", [("soil", "c"), ("controller", "cpp"), ("robot", "python"), ("law", "c"), ("law", "python")])
def test_the_same_code_in_mid_run_changes_no_number(tmp_path, kind, language):
    place = built(tmp_path, kind, language)
    kind = "soil.law" if kind == "law" else kind
    assert run(place, tmp_path / "a", "--duration", "0.2").returncode == 0
    process = run(place, tmp_path / "b", "--duration", "0.2", "--watch", "--reload-at", f"{kind}=90", "--reload-at",
                  f"{kind}=133")
    assert process.returncode == 0 and not complaints(process), process.stderr
    assert rows(tmp_path / "a") == rows(tmp_path / "b")
    told = [e for e in events(tmp_path / "b") if e.startswith(f"reload {kind}: ")]
    assert len(told) == 2
    old, new = re.search(r": (\w{16}) to (\w{16}), state of \d+ bytes carried over", told[0]).groups()
    assert old == new
    assert events(tmp_path / "a") == []


def test_new_code_takes_over_the_state_at_its_step(tmp_path):
    place = built(tmp_path, "controller", "c")
    source, scenario = place / "my_controller.c", place / "scenario.toml"
    text = source.read_text()
    assert text.count("s.target = s.set_point + (away + slope * h) * left;") == 1
    changed = text.replace("+ (away + slope * h) * left;", "+ (away + slope * h) * left + 0.1 * h;")
    (place / "new.c").write_text(changed)
    build = 'build = "cp new.c my_controller.c && make"'
    scenario.write_text(re.sub(r"^build = .*$", build, scenario.read_text(), flags=re.M))
    assert run(place, tmp_path / "a", "--duration", "0.3").returncode == 0
    process = run(place, tmp_path / "b", "--duration", "0.3", "--watch", "--reload-at", "controller=200")
    assert process.returncode == 0, process.stderr
    a, b = (column(tmp_path / f, "controller.angle_target") for f in "ab")
    times = column(tmp_path / "a", "t_s")
    before = [k for k, t in enumerate(times) if t < 0.2005]
    assert a[:len(before)] == b[:len(before)] and a[len(before)] != b[len(before)]
    assert abs(a[len(before)] - b[len(before)]) < 0.02, "it went on from where the old code was"
    # Afresh: the target starts from nothing again.
    shutil.copy(place / "my_controller.c", place / "new.c")
    process = run(place, tmp_path / "c", "--duration", "0.3", "--watch", "--reload-at", "controller=200", "--reload-reset")
    assert process.returncode == 0 and "started afresh" in events(tmp_path / "c")[0]
    c = column(tmp_path / "c", "controller.angle_target")
    assert c[len(before)] < 0.5 * c[len(before) - 1]


BROKEN = {
    "does not compile": ("return s;\n}", "return nothing;\n}", "error"),
    "crashes when loaded": ("static char failure[160];",
                            "static char failure[160];\n__attribute__((constructor)) static void no(void) { __builtin_trap(); }",
                            "quick tests found: loads"),
    "breaks a promise": ("s.speed = (slope", "s.speed = 0.0 / 0.0 * (slope", "quick tests found"),
    "has another state": ('#define MARK "state 1"', '#define MARK "state 2"', "no state of this code"),
    "has other variables": ('"angle_target"', '"target_of_angle"', "variables changed"),
}


@pytest.mark.parametrize("fault", BROKEN)
def test_what_cannot_be_taken_over_is_refused_and_the_old_code_goes_on(tmp_path, fault):
    old, new, told = BROKEN[fault]
    place = built(tmp_path, "controller", "c")
    text = (place / "my_controller.c").read_text()
    assert text.count(old) >= 1
    (place / "new.c").write_text(text.replace(old, new))
    scenario = place / "scenario.toml"
    build = 'build = "cp new.c my_controller.c && make"'
    text = re.sub(r"^build = .*$", build, scenario.read_text(), flags=re.M)
    # Nothing in the scenario names the variable, so that only its exchange is refused.
    text = re.sub(r'\[\[connect\]\]\nfrom.*\nto.*\n', "", text)
    scenario.write_text(text)
    before = set(pathlib.Path(tempfile.gettempdir()).glob("terraglue-reload-*"))
    assert run(place, tmp_path / "a", "--duration", "0.1").returncode == 0
    process = run(place, tmp_path / "b", "--duration", "0.1", "--watch", "--reload-at", "controller=40")
    assert process.returncode == 0 and told in process.stderr, process.stderr
    assert rows(tmp_path / "a") == rows(tmp_path / "b")
    assert "refused, the old code goes on" in events(tmp_path / "b")[0]
    assert set(pathlib.Path(tempfile.gettempdir()).glob("terraglue-reload-*")) <= before


def test_after_a_refusal_good_code_is_taken_over(tmp_path):
    place = built(tmp_path, "controller", "c")
    source, scenario = (place / "my_controller.c").read_text(), place / "scenario.toml"
    mark, rule = '#define MARK "state 1"', "+ (away + slope * h) * left;"
    assert source.count(mark) == 1 and source.count(rule) == 1
    (place / "1.c").write_text(source.replace(mark, '#define MARK "state 2"'))
    (place / "2.c").write_text(source.replace(rule, rule.replace(";", " + 0.1 * h;")))
    build = "build = 'if [ -e once ]; then cp 2.c my_controller.c; else touch once; cp 1.c my_controller.c; fi; make'"
    scenario.write_text(re.sub(r"^build = .*$", build, scenario.read_text(), flags=re.M))
    process = run(place, tmp_path / "a", "--duration", "0.1", "--watch", "--reload-at", "controller=40", "--reload-at",
                  "controller=60")
    told = events(tmp_path / "a")
    assert process.returncode == 0 and "no state of this code" in process.stderr and len(told) == 2, process.stderr
    assert "refused, the old code goes on" in told[0] and "carried over" in told[1], told


def test_variables_may_be_added_behind_the_others(tmp_path):
    place = built(tmp_path, "controller", "python")
    text = (place / "my_controller.py").read_text()
    last = re.search(r'\n( +tg.Variable\("time_constant".*\n)', text).group(1)
    added = text.replace(last, last + '            tg.Variable("limit", "rad", tg.LOCAL, "A new one"),\n')
    added = added.replace("        self.variables = [", "        self.limit = 7.0\n        self.variables = [")
    (place / "new.py").write_text(added)
    scenario = place / "scenario.toml"
    scenario.write_text(scenario.read_text().replace('module = "./my_controller.py"',
                                                     'module = "./my_controller.py"\nbuild = "cp new.py my_controller.py"'))
    process = run(place, tmp_path / "a", "--duration", "0.1", "--watch", "--reload-at", "controller=40", "--reload-reset")
    assert process.returncode == 0 and "started afresh" in events(tmp_path / "a")[0], process.stderr


def test_a_law_takes_the_place_of_another_with_the_state_of_the_soil(tmp_path):
    place = built(tmp_path, "law", "c")
    source = (place / "my_law.c").read_text()
    assert source.count("k = p[K_C] / at->b + p[K_PHI];") == 1
    (place / "new.c").write_text(source.replace("k = p[K_C] / at->b + p[K_PHI];", "k = 0.25 * (p[K_C] / at->b + p[K_PHI]);"))
    scenario = place / "scenario.toml"
    scenario.write_text(re.sub(r"^build = .*$", 'build = "cp new.c my_law.c && make"', scenario.read_text(), flags=re.M))
    assert run(place, tmp_path / "a", "--duration", "0.3").returncode == 0
    process = run(place, tmp_path / "b", "--duration", "0.3", "--watch", "--reload-at", "soil.law=150")
    assert process.returncode == 0, process.stderr
    told = events(tmp_path / "b")
    assert re.match(r"reload soil.law: \w{16} to \w{16}, state of \d+ bytes carried over", told[0]), told
    a, b = (column(tmp_path / f, "soil.max_sinkage") for f in "ab")
    assert a[:30] == b[:30] and b[-1] > 1.2 * a[-1] > 0.0


def test_a_law_on_the_module_path_stays_where_its_soil_is_exchanged(tmp_path):
    place = built(tmp_path, "law", "c")
    scenario = place / "scenario.toml"
    (tmp_path / "elsewhere").mkdir()
    (place / "libmy_law_plugin.so").rename(tmp_path / "elsewhere" / "libmy_law_plugin.so")
    text = scenario.read_text()
    assert text.count('"./libmy_law_plugin.so"') == 1
    scenario.write_text(re.sub(r"^build = .*\n", "", text.replace('"./libmy_law_plugin.so"', '"my-law"'), flags=re.M))
    path = ["--duration", "0.1", "--module-path", tmp_path / "elsewhere"]
    assert run(place, tmp_path / "a", *path).returncode == 0
    process = run(place, tmp_path / "b", *path, "--watch", "--reload-at", "soil=60", "--reload-at", "soil.law=70")
    assert process.returncode == 0 and not complaints(process), process.stderr
    assert [e.split(":")[0] for e in events(tmp_path / "b")] == ["reload soil", "reload soil.law"]
    assert rows(tmp_path / "a") == rows(tmp_path / "b")


def test_python_hands_its_state_to_other_code_by_migrate(tmp_path):
    place = built(tmp_path, "controller", "python")
    source, scenario = place / "my_controller.py", place / "scenario.toml"
    text = source.read_text()
    other = text.replace('"time_constant": config["time_constant_s"]}', '"time_constant": config["time_constant_s"], "age": 0}')
    assert other != text
    scenario.write_text(scenario.read_text().replace('module = "./my_controller.py"',
                                                     'module = "./my_controller.py"\nbuild = "cp new.py my_controller.py"'))
    (place / "new.py").write_text(other)
    process = run(place, tmp_path / "a", "--duration", "0.1", "--watch", "--reload-at", "controller=40")
    assert process.returncode == 0 and "age" in process.stderr and "migrate" in process.stderr
    source.write_text(text)
    (place / "new.py").write_text(other + '\n    def migrate(self, state):\n        return {**state, "age": 1}\n')
    process = run(place, tmp_path / "b", "--duration", "0.1", "--watch", "--reload-at", "controller=40")
    assert process.returncode == 0 and not complaints(process), process.stderr
    assert rows(tmp_path / "a") == rows(tmp_path / "b")


def test_a_change_is_noticed_while_the_run_goes_on(tmp_path):
    place = built(tmp_path, "controller", "c")
    source, out = place / "my_controller.c", tmp_path / "out"
    # The new code ends the run where no test comes: it would go on for hours.
    changed = source.read_text().replace("    c->next = control(c->now, st->h);",
                                         "    if (st->t > 5.0 && st->t < 3000.0) return fail(c->error, \"new code runs\");\n"
                                         "    c->next = control(c->now, st->h);")
    assert changed != source.read_text()
    command = [PROGRAM, "run", "scenario.toml", "--quiet", "--out", str(out), "--duration", "10000", "--watch"]
    process = subprocess.Popen(command, cwd=place, stderr=subprocess.PIPE, text=True)
    while not (out / "recording.mcap").exists():
        assert process.poll() is None
        time.sleep(0.01)
    source.write_text(changed.replace("new code runs\")", "new code runs\"))"))
    source.write_text(changed)
    _, told = process.communicate(timeout=300)
    assert process.returncode == 1 and "new code runs" in told, told
    assert any(e.startswith("reload controller: ") and "carried over" in e for e in events(out))


def test_the_page_says_what_happens():
    text = PAGE.read_text()
    for word in ["--watch", "--reload-reset", "build", "sources", "migrate", "MARK"]:
        assert word in text
