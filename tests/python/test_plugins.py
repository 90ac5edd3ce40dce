"""The newcomer: `terraglue new`, build, run, check, for every kind in every language, from outside the repository."""

import json
import os
import re
import shutil
import subprocess
import sys
import zipfile

import pytest
from conftest import MOON_WALK, PROGRAM, ROOT, terraglue

KINDS = ["soil", "robot", "controller", "law", "sensor"]


def made(folder, kind, language):
    """The folder of a new module, and the commands that its page names."""
    name = f"my-{kind}"
    process = terraglue("new", kind, name, "--lang", language, cwd=folder)
    assert process.returncode == 0, process.stderr
    place = folder / name
    own = [p for p in place.rglob("*") if p.is_file() and p.name != "Cargo.lock" and place / "terraglue" not in p.parents]
    assert len(own) <= 8
    for path in own:
        assert str(ROOT) not in path.read_text(), path
    commands = re.search(r"```sh\n(.*?)```", (place / "README.md").read_text(), re.S).group(1)
    return place, commands.strip().splitlines()


def played(place, commands, **environment):
    """Types the three commands of the page."""
    for command in commands:
        done = subprocess.run(command, shell=True, cwd=place, env={**os.environ, **environment},
                              capture_output=True, text=True, timeout=300)
        assert done.returncode == 0, f"{command}\n{done.stdout[-3000:]}{done.stderr[-3000:]}"
    return done.stdout


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("language", ["c", "cpp"])
def test_a_new_module_builds_runs_and_passes(tmp_path, kind, language):
    place, commands = made(tmp_path, kind, language)
    assert len(commands) == 3
    told = played(place, commands)
    assert " fail" not in told.splitlines()[-1] and " pass" in told.splitlines()[-1]
    assert not re.search(r"^ +warning", told, re.M), told


@pytest.fixture(scope="module")
def rust_target(tmp_path_factory):
    """One folder of compiled crates for the three modules in Rust."""
    return tmp_path_factory.mktemp("target")


@pytest.mark.parametrize("kind", KINDS)
def test_a_new_module_in_rust_builds_runs_and_passes(tmp_path, rust_target, kind):
    place, commands = made(tmp_path, kind, "rust")
    (place / "target").symlink_to(rust_target)
    played(place, commands)


@pytest.mark.parametrize("fault, signal, name", [("*(volatile int *)(size_t)(st->t * 20) = 1", 11, "segmentation fault"),
                                                 ("__builtin_abort()", 6, "abort")])
def test_a_crash_tells_the_module_the_call_and_the_time(tmp_path, fault, signal, name):
    place, _ = made(tmp_path, "controller", "c")
    source, = place.glob("*.c")
    wild = rf"\1    if (st->t > 0.25) {fault};\n"
    text, count = re.subn(r"(static tg_status commit\(.*\{\n)", wild, source.read_text())
    assert count == 1
    source.write_text(text)
    subprocess.run(["make"], cwd=place, check=True, capture_output=True)
    crashed = terraglue("run", "scenario.toml", "--quiet", cwd=place)
    assert crashed.returncode == -signal, crashed.stderr
    for words in (f"signal {signal} ({name})", "`commit` of `controller` (my-controller) at t = 0.25", "`isolate = true` in [controller]"):
        assert words in crashed.stderr, crashed.stderr
    kept = terraglue("run", "scenario.toml", "--quiet", "--set", "controller.isolate=true", cwd=place)
    assert kept.returncode == 1 and f"signal {signal}" in kept.stderr and "crashed:" not in kept.stderr, kept.stderr


@pytest.mark.parametrize("function", ["dlopen", "terraglue_subsystem", "schema", "instantiate"])
def test_a_crash_before_the_first_step_tells_the_file_and_the_call(tmp_path, function):
    place, _ = made(tmp_path, "controller", "c")
    source, = place.glob("*.c")
    text = source.read_text()
    if function == "dlopen":
        text += "\n__attribute__((constructor)) static void at_load(void) {\n    *(volatile int *)8 = 1;\n}\n"
    else:
        text, count = re.subn(rf"(\b{function}\([^;{{]*\)\s*\{{)", r"\1 *(volatile int *)8 = 1;", text)
        assert count == 1
    source.write_text(text)
    built = subprocess.run(["make"], cwd=place, capture_output=True, text=True)
    assert built.returncode == 0, built.stderr
    crashed = terraglue("run", "scenario.toml", "--quiet", cwd=place)
    assert crashed.returncode == -11, crashed.stderr
    library, = place.glob("*.so")
    for words in ("signal 11 (segmentation fault)", f"the last call was `{function}`", library.name, "help: "):
        assert words in crashed.stderr, crashed.stderr
    assert " at t = " not in crashed.stderr, crashed.stderr
    if function == "instantiate":
        assert "`instantiate` of `controller`" in crashed.stderr, crashed.stderr
        kept = terraglue("run", "scenario.toml", "--quiet", "--set", "controller.isolate=true", cwd=place)
        assert kept.returncode in (1, 2) and "segmentation fault" in kept.stderr, kept.stderr
    else:
        assert "terraglue check-module" in crashed.stderr, crashed.stderr


def test_the_check_is_a_target_of_the_makefile_and_writes_what_ci_reads(tmp_path):
    place, commands = made(tmp_path, "soil", "c")
    subprocess.run(["make", "check"], cwd=place, check=True, capture_output=True)
    process = terraglue("check-module", place, "--level", "quick", "--json", tmp_path / "o.json",
                        "--junit", tmp_path / "o.xml")
    assert process.returncode == 0, process.stdout
    rows = json.loads((tmp_path / "o.json").read_text())["rows"]
    assert len(rows) >= 50 and {"library", "physics", "numbers"} <= {r["area"] for r in rows}
    assert len([r for r in rows if r["area"] == "physics"]) >= 12
    assert (tmp_path / "o.xml").read_text().count("<testcase ") == len(rows)


def test_a_mistake_is_named_with_call_values_and_the_command_that_repeats_it(tmp_path):
    place, commands = made(tmp_path, "soil", "c")
    source = place / "my_soil.c"
    text = source.read_text()
    assert text.count("return z > 0.0 ? s->k * z : 0.0;") == 1
    source.write_text(text.replace("return z > 0.0 ? s->k * z : 0.0;", "return s->k * z;"))
    subprocess.run(["make"], cwd=place, check=True, capture_output=True)
    process = terraglue("check-module", place)
    assert process.returncode == 1
    found = process.stdout[process.stdout.index("fail     no-tension"):]
    for part in ["call      advance", "given", "got       a normal force of -", "expected  >= 0", "--only no-tension"]:
        assert part in found, found[:800]
    repeat = re.search(r"repeat +(.*)", found).group(1)
    again = subprocess.run(repeat, shell=True, cwd=tmp_path, capture_output=True, text=True)
    assert again.returncode == 1 and "no-tension: fail" in again.stdout


def test_a_file_beside_the_module_switches_a_test_off_with_its_reason(tmp_path):
    place, commands = made(tmp_path, "soil", "c")
    subprocess.run(["make"], cwd=place, check=True, capture_output=True)
    (place / "libmy_soil_plugin.check.toml").write_text('[off]\nany-turn = "the lattice is hexagonal"\n')
    process = terraglue("check-module", place, "--level", "quick")
    assert process.returncode == 0 and "switched off: the lattice is hexagonal" in process.stdout
    (place / "libmy_soil_plugin.check.toml").write_text('[off]\nany-trun = "x"\n')
    process = terraglue("check-module", place, "--level", "quick")
    assert process.returncode == 2 and "any-turn" in process.stderr


MODULES = [("soil-bekker", []), ("soil-cellular-automaton", []), ("gait", []), ("soil-column", []),
           ("rigid-body", ["--set", f"model={ROOT / 'tests/models/ball.urdf'}"])]


@pytest.mark.parametrize("module, sets", MODULES)
def test_the_modules_of_the_project_pass(module, sets):
    folders = [os.path.join(os.path.dirname(PROGRAM), sub) for sub in ("deps", "../lib/terraglue", ".")]
    paths = [os.path.join(f, f"lib{module.replace('-', '_')}_plugin.so") for f in folders]
    path = next((p for p in paths if os.path.isfile(p)), None)
    if path is None:
        pytest.skip(f"{module} was not built")
    process = terraglue("check-module", path, *sets)
    assert process.returncode == 0, process.stdout


def test_the_page_of_a_folder_that_exists_is_left_alone(tmp_path):
    made(tmp_path, "controller", "c")
    process = terraglue("new", "controller", "my-controller", cwd=tmp_path)
    assert process.returncode == 2 and "exists already" in process.stderr
    shutil.rmtree(tmp_path / "my-controller")


LANGUAGES = {"rust": ("In Rust", "src/lib.rs"), "c": ("In C:", "my_{}.c"), "cpp": ("In C++", "my_{}.cpp"),
             "python": ("In Python", "my_{}.py")}
# The tests that each tutorial mentions.
SPOKEN = {"soil": ["jacobian-soil", "jacobian-force", "force-and-motion", "passive", "cycles-dissipate",
                   "energy-balance", "heat-stays"],
          "robot": ["falls", "no-gravity", "force-moves", "jacobian-robot", "estimate-holds", "velocity", "described"],
          "controller": ["time-not-calls", "bounded", "bounded-power", "described", "same-again"]}


def changed(text, page, heading):
    """The text after the changes of a page: lines with - become the lines with + that follow."""
    steps = re.search(rf"^{re.escape(heading)}.*?```diff\n(.*?)```", page, re.S | re.M).group(1)
    for old, new in re.findall(r"((?:^-.*\n)+)((?:^\+.*\n)+)", steps, re.M):
        old, new = (re.sub(r"^.", "", part, flags=re.M) for part in (old, new))
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    return text


@pytest.mark.parametrize("kind", SPOKEN)
@pytest.mark.parametrize("language", LANGUAGES)
def test_the_tutorial_of_a_kind_passes_in_every_language(tmp_path, rust_target, kind, language):
    page = (ROOT / "docs" / "plugins" / f"{kind}.md").read_text()
    place, commands = made(tmp_path, kind, language)
    heading, file = LANGUAGES[language]
    source = place / file.format(kind)
    source.write_text(changed(source.read_text(), page, heading))
    (place / "target").symlink_to(rust_target)
    subprocess.run(commands[0], shell=True, cwd=place, check=True, capture_output=True)
    module = place / commands[-1].split()[-1]
    only = [word for test in SPOKEN[kind] for word in ("--only", test)]
    process = terraglue("check-module", module, *only)
    off = re.search(r"```toml\n(.*?)```", page, re.S)
    if off is not None:
        expected = set(re.findall(r"^(\S+) =", off.group(1), re.M))
        assert set(re.findall(r"^ +fail +(\S+)", process.stdout, re.M)) == expected, process.stdout
        module.with_suffix(".check.toml").write_text(off.group(1))
        process = terraglue("check-module", module, *only)
    assert process.returncode == 0, process.stdout


def test_a_mistake_in_the_tutorial_is_found(tmp_path):
    page = (ROOT / "docs" / "plugins" / "soil.md").read_text()
    place, commands = made(tmp_path, "soil", "c")
    source = place / "my_soil.c"
    text = changed(source.read_text(), page, "In C:")
    assert text.count("1.2 * s->k * pow(z, 0.2)") == 1
    source.write_text(text.replace("1.2 * s->k * pow(z, 0.2)", "s->k * pow(z, 0.2)"))
    subprocess.run(["make"], cwd=place, check=True, capture_output=True)
    process = terraglue("check-module", place)
    assert process.returncode == 1 and "fail     jacobian-soil" in process.stdout


def test_modules_are_listed_without_running_them(tmp_path):
    place, commands = made(tmp_path, "soil", "c")
    source = place / "my_soil.c"
    source.write_text(source.read_text() + "\n__attribute__((constructor)) static void run(void) { abort(); }\n")
    subprocess.run(["make"], cwd=place, check=True, capture_output=True)
    other = tmp_path / "other"
    other.mkdir()
    shutil.copy(place / "libmy_soil_plugin.so", other)
    (other / "libcut_plugin.so").write_bytes((place / "libmy_soil_plugin.so").read_bytes()[:900])
    process = terraglue("modules", "--module-path", place, "--module-path", other, cwd=tmp_path)
    assert process.returncode == 0, process.stderr
    told = " ".join(process.stdout.replace("│", " ").replace("┆", " ").split())
    assert "my-soil" in told and "soil" in told and "hidden by" in told and "cut off after 900 bytes" in told.replace("- ", "-")
    process = terraglue("modules", "my-soil", "--module-path", place)
    assert process.returncode == 0, process.stderr
    assert "my-soil (soil)" in process.stdout and "ABI: 3." in process.stdout
    assert "can: force, motion, derivatives, retry, state, serialize" in process.stdout
    assert "its parameters cannot be asked for: it was ended by signal 6" in process.stdout
    process = terraglue("modules", "soil-bekkr")
    assert process.returncode == 2 and "did you mean" in process.stderr and "soil-bekker" in process.stderr
    process = terraglue("modules", "soil-bekker")
    assert process.returncode == 0 and "elastic_stiffness_pa_m" in process.stdout
    assert "licence: MIT OR Apache-2.0" in process.stdout and "max_sinkage" in process.stdout


@pytest.mark.parametrize("kind, language", [("controller", "c"), ("robot", "cpp"), ("law", "rust"), ("controller", "python")])
def test_a_description_that_is_wrong_or_missing_is_told(tmp_path, rust_target, kind, language):
    place, commands = made(tmp_path, kind, language)
    (place / "target").symlink_to(rust_target)
    source = place / LANGUAGES[language][1].format(kind)
    text = source.read_text()
    wrong = {"controller": ("time_constant", "time_constants"), "robot": ("force estimate", "force"), "law": ("SHEAR", "SHEAR")}
    test = "law-described" if kind == "law" else "described"

    def told(text):
        source.write_text(text)
        subprocess.run(commands[0], shell=True, cwd=place, check=True, capture_output=True)
        return terraglue("check-module", place / commands[-1].split()[-1], "--only", test).stdout

    assert f"pass     {test}" in told(text)
    if language == "rust":
        return
    old, new = wrong[kind]
    line = next(part for part in text.split("\n") if old in part and ("TG_" in part or "parameter f64" in part))
    assert f"fail     {test}" in told(text.replace(line, line.replace(old, new), 1))
    if language == "c":
        bare = re.sub(r'(TG_DESCRIBE\("my-controller", "1.0.0").*?\);', r"\1);", text, count=1, flags=re.S)
        assert "warning  described" in told(bare) and "variable=set_point input f64 rad" in told(bare)


def test_the_last_check_is_shown_by_the_bytes_of_the_file(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    place, commands = made(tmp_path, "law", "c")

    def shown():
        process = terraglue("modules", "my-law", "--module-path", place)
        assert process.returncode == 0, process.stderr
        return process.stdout

    subprocess.run(["make"], cwd=place, check=True, capture_output=True)
    assert "not checked since it was built" in shown()
    assert terraglue("check-module", place, "--level", "quick").returncode == 0
    assert "last check: passed (quick)" in shown() and "seed 1" in shown()
    table = " ".join(terraglue("modules", "--module-path", place).stdout.split())
    assert "last check" in table and "passed" in table
    law_with(place, ("p[N] * out->pressure[i] / z + bekker / p[Z_1]", "out->pressure[i] / z"))
    assert "not checked since it was built" in shown()
    assert terraglue("check-module", place, "--level", "quick").returncode == 1
    assert "last check: failed" in shown() and " fail" in shown()
    # one test alone is no verdict on the module
    law_with(place, ("out->pressure[i] / z;", "p[N] * out->pressure[i] / z + bekker / p[Z_1];"))
    assert terraglue("check-module", place, "--only", "loads").returncode == 0
    assert "failed" not in shown()


HEADERS = sorted((ROOT / "tests" / "abi").glob("terraglue-*.h"))


def built_with(folder, header):
    """The soil of the scaffold, built with another header."""
    place, commands = made(folder, "soil", "c")
    (place / "terraglue.h").write_text(header)
    if "define TG_IS" not in header:
        source = place / "my_soil.c"
        source.write_text(re.sub(r'(TG_DESCRIBE\("my-soil", "1.0.0").*?\);', r"\1);", source.read_text(), count=1, flags=re.S))
    subprocess.run(["make"], cwd=place, check=True, capture_output=True)
    return place


def major(header):
    return int(re.search(r"#define TG_ABI_MAJOR (\d+)", header.read_text()).group(1))


MAJOR = max(map(major, HEADERS))


@pytest.mark.parametrize("header", [h for h in HEADERS if major(h) < MAJOR], ids=lambda h: h.stem)
def test_modules_of_earlier_majors_are_refused(tmp_path, header):
    place = built_with(tmp_path, header.read_text())
    process = terraglue("run", "scenario.toml", "--quiet", cwd=place)
    told = " ".join(process.stderr.replace("│", " ").split())
    version = header.stem.removeprefix("terraglue-")
    assert process.returncode == 2 and f"built for ABI {version}" in told and "build the module again" in told, told


@pytest.mark.parametrize("header", [h for h in HEADERS if major(h) == MAJOR], ids=lambda h: h.stem)
def test_modules_of_every_released_minor_run(tmp_path, header):
    place = built_with(tmp_path, header.read_text())
    process = terraglue("run", "scenario.toml", "--quiet", cwd=place)
    assert process.returncode == 0, process.stderr
    assert terraglue("check-module", place, "--level", "quick").returncode == 0


def test_a_later_minor_runs_and_a_later_major_is_refused(tmp_path):
    text = (ROOT / "interfaces" / "plugin" / "include" / "terraglue.h").read_text()
    minor = int(re.search(r"#define TG_ABI_MINOR (\d+)", text).group(1))
    assert text.count("} tg_subsystem;") == 1
    later = text.replace(f"#define TG_ABI_MINOR {minor}", f"#define TG_ABI_MINOR {minor + 1}")
    later = later.replace("} tg_subsystem;", "    void (*made_up)(void *instance);\n} tg_subsystem;")
    (tmp_path / "minor").mkdir()
    place = built_with(tmp_path / "minor", later)
    process = terraglue("run", "scenario.toml", "--quiet", cwd=place)
    assert process.returncode == 0, process.stderr
    process = terraglue("check-module", place, "--level", "quick")
    assert process.returncode == 0 and f"ABI {MAJOR}.{minor + 1}" in process.stdout
    (tmp_path / "major").mkdir()
    place = built_with(tmp_path / "major", text.replace(f"#define TG_ABI_MAJOR {MAJOR}", f"#define TG_ABI_MAJOR {MAJOR + 1}"))
    process = terraglue("run", "scenario.toml", "--quiet", cwd=place)
    told = " ".join(process.stderr.replace("│", " ").split())
    assert process.returncode == 2 and f"built for ABI {MAJOR + 1}.{minor}" in told and "build the module again" in told, told


def test_a_module_for_another_machine_is_refused(tmp_path):
    place, commands = made(tmp_path, "soil", "c")
    subprocess.run(["make"], cwd=place, check=True, capture_output=True)
    library = place / "libmy_soil_plugin.so"
    bytes_ = bytearray(library.read_bytes())
    bytes_[0x12] = 0x28
    library.write_bytes(bytes_)
    process = terraglue("run", "scenario.toml", "--quiet", cwd=place)
    assert process.returncode == 2 and "another kind of machine" in " ".join(process.stderr.replace("│", " ").split())


def test_a_new_law_is_five_lines_of_a_scenario(tmp_path):
    process = terraglue("new", "law", "my-law", cwd=tmp_path)
    assert process.returncode == 0, process.stderr
    place = tmp_path / "my-law"
    commands = re.search(r"```sh\n(.*?)```", (place / "README.md").read_text(), re.S).group(1)
    played(place, commands.strip().splitlines())
    law = (place / "scenario.toml").read_text().split("[soil.law]")[1].split("\n\n")[0]
    assert 2 <= len(law.strip().splitlines()) <= 5
    text = (place / "scenario.toml").read_text()
    (place / "scenario.toml").write_text(text.replace("z/z_1", "z/z_2"))
    process = terraglue("check", "scenario.toml", cwd=place)
    assert process.returncode == 2 and "z_2" in process.stderr
    process = terraglue("new", "soil", "another", "--lang", "scenario", cwd=tmp_path)
    assert process.returncode == 2 and "is not offered" in " ".join(process.stderr.split())


def law_with(place, *edits):
    """The law of the scaffold in C, edited and built."""
    source = place / "my_law.c"
    text = source.read_text()
    for old, new in edits:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    source.write_text(text)
    subprocess.run(["make"], cwd=place, check=True, capture_output=True)


def test_a_law_is_at_most_forty_lines_and_its_mistakes_are_named(tmp_path):
    place, commands = made(tmp_path, "law", "c")
    assert len((place / "my_law.c").read_text().splitlines()) <= 40
    law_with(place, ("p[N] * out->pressure[i] / z + bekker / p[Z_1]", "out->pressure[i] / z"))
    process = terraglue("check-module", place)
    assert process.returncode == 1 and "fail     law-slope" in process.stdout, process.stdout
    scenario = place / "scenario.toml"
    text = scenario.read_text()
    for old, new, told in [("z_1 = 0.1", "z_2 = 0.1", "has no parameter `z_2`"),
                           ('plugin = "./libmy_law_plugin.so"', 'plugin = "soil-bekker"', "is no law but a soil"),
                           ('plugin = "./libmy_law_plugin.so"', 'plugin = "my-lwa"', "[TG01]")]:
        assert old in text
        scenario.write_text(text.replace(old, new))
        process = terraglue("check", "scenario.toml", cwd=place)
        said = " ".join(process.stderr.replace("│", " ").split())
        assert process.returncode == 2 and told in said, said


REMEMBERS = {
    "c": ("my_law.c", r"static tg_status pressure\(.*?\n}\n", ("SCHEMA, 0, pressure", "SCHEMA, 1, pressure")),
    "cpp": ("my_law.cpp", r"static tg_status pressure\(.*?\n}\n", ("schema, 0, pressure", "schema, 1, pressure")),
    "rust": ("src/lib.rs", r"    fn pressure\(.*?\n    }\n", ("", "")),
}


@pytest.mark.parametrize("language", REMEMBERS)
def test_the_law_of_the_page_that_remembers_passes(tmp_path, rust_target, language):
    file, old, (without, keeps) = REMEMBERS[language]
    place, commands = made(tmp_path, "law", language)
    page = (ROOT / "docs" / "plugins" / "law-as-a-module.md").read_text()
    code = re.search(rf"```{language}\n(.*?)```", page, re.S).group(1)
    text = (place / file).read_text()
    first = re.search(old, text, re.S).group(0)
    text = text.replace(first, code)
    assert without in text
    (place / file).write_text(text.replace(without, keeps, 1))
    if language == "rust":
        (place / "target").symlink_to(rust_target)
    told = played(place, commands)
    assert "pass     law-unloads" in told and " fail" not in told.splitlines()[-1]


def test_a_soil_with_a_law_runs_isolated_and_is_exported(tmp_path):
    place, commands = made(tmp_path, "law", "c")
    subprocess.run(["make"], cwd=place, check=True, capture_output=True)
    for soil in ["soil-bekker", "soil-cellular-automaton"]:
        process = terraglue("run", "scenario.toml", "--quiet", "--duration", "0.2", "--set", f"soil.module={soil}",
                            "--set", "soil.isolate=true", "--out", tmp_path / soil, cwd=place)
        assert process.returncode == 0, process.stderr
    process = terraglue("export", "scenario.toml", "-o", tmp_path / "unit.fmu", cwd=place)
    assert process.returncode == 0, process.stderr
    with zipfile.ZipFile(tmp_path / "unit.fmu") as fmu:
        assert any(name.endswith("law/libmy_law_plugin.so") for name in fmu.namelist())


def test_a_module_that_would_abort_does_not_compile(tmp_path, rust_target):
    place, commands = made(tmp_path, "law", "rust")
    (place / "target").symlink_to(rust_target)
    manifest = place / "Cargo.toml"
    manifest.write_text(manifest.read_text().replace("[profile.dev]", '[profile.dev]\npanic = "abort"'))
    done = subprocess.run(["cargo", "check"], cwd=place, capture_output=True, text=True)
    assert done.returncode != 0 and "[TG13]" in done.stderr and "out of the profile" in done.stderr, done.stderr


def test_the_checker_is_called_from_c_and_pytest_as_the_page_shows(tmp_path):
    place, commands = made(tmp_path, "law", "c")
    subprocess.run(["make"], cwd=place, check=True, capture_output=True)
    page = (ROOT / "docs" / "plugins" / "check-module.md").read_text()
    (place / "check.c").write_text(re.search(r"```c\n(.*?)```", page, re.S).group(1))
    (place / "test_my_law.py").write_text(re.search(r"```python\n(.*?)```", page, re.S).group(1))
    environment = {**os.environ, "PATH": f"{os.path.dirname(PROGRAM)}:{os.environ['PATH']}"}
    for command in ["cc check.c -o check && ./check", f"{sys.executable} -m pytest -q test_my_law.py"]:
        done = subprocess.run(command, shell=True, cwd=place, env=environment, capture_output=True, text=True)
        assert done.returncode == 0, f"{command}\n{done.stdout}{done.stderr}"


def test_plugins_can_be_isolated(tmp_path):
    """A walk over an isolated soil is the walk, bit by bit."""
    rows = []
    for isolate in ("false", "true"):
        out = tmp_path / isolate
        sets = ["--set", f"soil.isolate={isolate}", "--set", "recording.every_steps=1"]
        done = terraglue("run", MOON_WALK, "--duration", "0.05", "--csv", "--quiet", "--out", out, *sets)
        assert done.returncode == 0, done.stderr
        rows.append((out / "variables.csv").read_bytes())
    assert rows[0] == rows[1]
