"""The commands of pages, of headers of scenarios and of `--help`, and the files needed to run them as they are.

A *command* is a line of a ```sh block (or of one without a language that begins with `terraglue` or `cargo`), or a code span that
begins with one of the two. With a placeholder in it (`terraglue check FILE`, `terraglue fmu run | info | check`) or alone (`terraglue
report`) it is a *form*: not to be typed, but its subcommand and options exist.
"""

import pathlib
import re
import shlex
import shutil
import subprocess
import zipfile
from typing import NamedTuple

from cfmu import build, described
from conftest import PROGRAM, ROOT, terraglue
from test_new_scenario import quadruped

PAGES = ["README.md", "CONTRIBUTING.md", "models/soils.md"]
PAGES += sorted(str(p.relative_to(ROOT)) for folder in ("docs", "docs/plugins") for p in (ROOT / folder).glob("*.md"))
PAGES += sorted(str(p.relative_to(ROOT)) for p in (ROOT / "docs/examples").glob("*.py"))
PAGES += sorted(str(p.relative_to(ROOT)) for p in (ROOT / "scenarios").glob("*.toml"))
# subcommands whose help has examples are found by their help
HELPS = ["", "run", "compare", "sweep", "report", "check", "check-module", "modules", "variables", "fmu run", "fmu info", "fmu check", "export",
         "convert", "new", "fit-soil", "robot", "soils"]

# Commands that are not run, by their beginning, and why. An entry that no page has is an error, too.
NOT_RUN = {
    "cargo xtask test": "is what runs this test",
    "cargo xtask ci": "runs this test, too",
    "cargo xtask lint": "is the first part of `cargo xtask ci`",
    "cargo xtask validate": "`cargo xtask test` ends with its quick form; the long one takes hours",
    "cargo xtask install": "builds the release profile; test_dist.py unpacks and runs what it lays out",
    "cargo xtask dist": "builds the release profile; test_dist.py packs the development profile",
    "cargo xtask faults": "takes minutes; tests/acceptance/tests/suite/faults.rs and test_faults.py hold what it writes",
    "cargo xtask docs": "takes minutes; the tests hold what it writes",
    "cargo xtask pictures": "draws pictures of docs/",
    "cargo xtask freeze": "takes minutes, and numbers are those of one kind of processor",
    "cargo xtask architecture": "a test of xtask holds what it writes",
    "cargo xtask schema": "tests/acceptance/tests/suite/generated_files.rs holds what it writes",
    "cargo xtask header": "tests of the header hold what it writes",
    "cargo bench": "builds the release profile",
    "cargo fmt": "changes nothing that runs; CI checks it",
    "cargo test": "is a part of `cargo xtask test`",
    "terraglue serve": "goes on until Ctrl-C; test_serve.py and test_page.py run it",
    "terraglue shot": "needs a browser; test_page.py takes pictures where there is one",
    "terraglue video": "needs a browser; test_page.py makes videos where there is one",
    "terraglue run --resume": "needs a run that was broken off; test_checkpoints.py breaks runs off and resumes them",
    "pip install": "needs a network",
    "pip wheel": "needs a network; test_package.py builds the wheel where there is one",
    "python3 -m venv": "needs a network",
    "target/robots/bin/python": "needs a network",
    "python mujoco_on_soil.py": "needs MuJoCo and matplotlib",
}

STARTS = r"(?:[A-Z_]+=\S+ )*(?:terraglue|cargo)\b"
SHELL = rf"(?:{STARTS}|pip|python3?|cd|target/)\b"
# `FILE`, `S`, `a|b`, `[AREA]`, `…`; not values of options such as `event=[]`
PLACEHOLDER = re.compile(r"…|\||(?<![=\w])\[[A-Z]|(?:^|[\s=])[A-Z][A-Z_]*(?=$|[\s\]=])")


class Command(NamedTuple):
    """A command of a page."""

    page: str
    line: int
    text: str
    form: bool

    @property
    def place(self):
        return f"{self.page}:{self.line}: {self.text}"


def commands_of(page, text):
    """All commands of a page, in their order."""
    if page.endswith(".md"):
        found = markdown(text)
    elif page.endswith(".toml"):
        found = [(n, m[1]) for n, line in lines(text) if (m := re.match(r"#\s+(terraglue .*)", line))]
    elif page.endswith(".py"):
        docstring = text.split('"""')[1].replace("\\\\\n", "\\\n")
        found = [(n, line.strip()) for n, line in lines(docstring) if re.match(rf"    {SHELL} ", line)]
    else:
        found = [(n, re.split(r"\s{3,}", line.strip())[0]) for n, line in lines(text) if re.match(r"  terraglue ", line)]
    return [Command(page, n, command, is_form(command)) for n, line in found if (command := bare(line))]


def lines(text):
    """Numbered lines; those that end in a backslash are joined with the next."""
    numbered, begun = [], None
    for number, line in enumerate(text.splitlines(), 1):
        begun = (begun[0], begun[1] + line.lstrip()) if begun else (number, line)
        if line.rstrip().endswith("\\"):
            begun = (begun[0], begun[1].rstrip().removesuffix("\\"))
        else:
            numbered.append(begun)
            begun = None
    return numbered


def markdown(text):
    found, block, prose = [], None, []
    for number, line in lines(text):
        fence = re.match(r"\s*```(\w*)", line)
        if fence:
            block = None if block is not None else fence[1]
        elif block == "sh" or block == "" and re.match(STARTS, line):
            found.append((number, line.strip()))
        elif block is None:
            prose.append((number, line))
    # spans may go over the end of a line
    whole = "\n".join(line for _, line in prose)
    for span in re.finditer(r"`([^`]+)`", whole):
        command = " ".join(span[1].split())
        if re.match(rf"{STARTS} ", command):
            found.append((prose[whole[: span.start()].count("\n")][0], command))
    return sorted(found)


def bare(line):
    """Without the comment behind it."""
    return re.sub(r"\s+#.*", "", line) if not line.startswith("#") else ""


def is_form(command):
    words = [word for word in command.split() if not re.match(r"[A-Z_]+=", word)]
    name_only = words[0] == "terraglue" and len(words) == 2 and words[1] not in ("soils", "modules") and words[1][0] != "-"
    return name_only or bool(PLACEHOLDER.search(command))


def reason_not_run(command):
    """Why it is not run; none: it is."""
    words = command.text.split()
    while re.match(r"[A-Z_]+=", words[0]):
        words = words[1:]
    text = " ".join(words) + " "
    return next((key for key in NOT_RUN if text.startswith(key + " ")), None)


def form_is_wrong(command, helps):
    """The missing part of a form, or of a command that is not run."""
    text = re.sub(r"^(?:[A-Z_]+=\S+ )+", "", command.text)
    text = text.split(" -- ")[0] if text.startswith("cargo test") else text
    if text.startswith("cargo xtask"):
        program, words = "xtask", text.split()[2:]
    elif text.startswith("terraglue"):
        program, words = "terraglue", text.split()[1:]
    else:
        return cargo_is_wrong(text)
    path = words[:1] if words[:1] != ["fmu"] or len(words) < 2 else words[:2]
    told = helps(program, path)
    if told is None:
        return f"`{program} {' '.join(path)}` does not exist"
    options = re.findall(r"(?<=[\s\[])--[a-z][a-z-]*", text)
    missing = [option for option in options if not re.search(rf"{option}\b(?!-)", told)]
    return f"no option {missing[0]}" if missing else None


def cargo_is_wrong(text):
    """Targets that `cargo bench` and `cargo test` name and the workspace does not have."""
    manifests = {p: p.read_text() for p in ROOT.glob("**/Cargo.toml") if "target" not in p.relative_to(ROOT).parts}
    for package in re.findall(r"(?:-p|--package) (\S+)", text):
        if not any(f'name = "{package}"' in manifest for manifest in manifests.values()):
            return f"no package {package}"
    for kind, name in re.findall(r"--(bench|test) (\S+)", text):
        folder = {"bench": "benches", "test": "tests"}[kind]
        if not any((manifest.parent / folder / f"{name}.rs").is_file() for manifest in manifests):
            return f"no {kind} {name}"
    return None


def shortened(line):
    """The command typed for a line: runs are short and do not settle, a comparison of all strategies is one of two, modules get the quick
    tests, `cargo run` is the program."""
    parts = [short(re.sub(r"^cargo run (?:--release )?-- ", "terraglue ", part.strip())) for part in line.split("&&")]
    return " && ".join(parts)


def short(part):
    words = part.split()
    if words[:2] in (["terraglue", "run"], ["terraglue", "compare"]):
        length = "0.05" if words[1] == "run" else "0.01"
        part = re.sub(r" --duration \S+", "", part) + f" --duration {length}"
        if not re.search(r"\.ss[pd]\b", part):
            part += " --set time.settle_s=0"
        if words[1] == "compare" and "--strategies" not in words:
            part += " --strategies cooperative,iterative"
    if words[:2] == ["terraglue", "sweep"] and words[2] not in ("run", "collect"):
        part += " --set time.duration_s=0.02"
    if words[:2] == ["terraglue", "check-module"] and "--list" not in words and "--level" not in words:
        part += " --level quick"
    return part.replace("--set event=[] ", "--set 'event=[]' ")


# Files that a reader brings along, by the names that the pages give them: each is put where a command needs it.
def copied(source):
    return lambda place, name: shutil.copy(ROOT / source, place / name)


def pump(place, name):
    plain = build(place, "pump", [("y", "output", 0, ""), ("k", "parameter", 1, "")], "r[0] += r[1] * h;")
    unknowns = '</Outputs><InitialUnknowns><Unknown index="1"/></InitialUnknowns>'
    described(place, plain, ("</Outputs>", unknowns)).replace(plain)


def plant(place, name):
    build(place, "part", [("u", "input", 0, ""), ("y", "output", 0, "")], "r[1] = r[0] + 1;")
    space = 'xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription" xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon"'
    connectors = "".join(
        f'<ssd:Connector name="{own}" kind="{kind}put"><ssc:Real/></ssd:Connector>' for own, kind in (("u", "in"), ("y", "out"))
    )
    parts = "".join(
        f'<ssd:Component name="{own}" source="resources/part.fmu"><ssd:Connectors>{connectors}</ssd:Connectors></ssd:Component>' for own in "ab"
    )
    with zipfile.ZipFile(place / name, "w") as archive:
        archive.writestr("SystemStructure.ssd", f"""<?xml version="1.0"?><ssd:SystemStructureDescription {space} name="plant" version="1.0">
<ssd:System name="plant"><ssd:Elements>{parts}</ssd:Elements><ssd:Connections>
<ssd:Connection startElement="a" startConnector="y" endElement="b" endConnector="u"/></ssd:Connections></ssd:System>
<ssd:DefaultExperiment startTime="0" stopTime="0.1"/></ssd:SystemStructureDescription>""")
        archive.write(place / "part.fmu", "resources/part.fmu")


def module_folder(place, name):
    """The folder after `terraglue new soil my-soil --lang c` and `make`."""
    made = place / ".made"
    made.mkdir()
    assert terraglue("new", "soil", "my-soil", "--lang", "c", cwd=made).returncode == 0
    subprocess.run(["make"], cwd=made / "my-soil", check=True, capture_output=True)
    shutil.copytree(made / "my-soil", place, dirs_exist_ok=True)


def module_alone(place, name):
    library = "libmy_soil_plugin.so"
    (place / library).exists() or module_folder(place, library)
    (place / name).mkdir(parents=True)
    shutil.copy(place / library, place / name / library)


STOCK = {
    "my.urdf": copied("models/hexapod.urdf"),
    "husky.urdf": copied("models/rover.urdf"),
    "go1.urdf": lambda place, name: (place / name).write_text(quadruped()),
    "go2.urdf": lambda place, name: (place / name).write_text(quadruped()),
    "plates.csv": copied("tests/reference/terramechanics/cmu_plate_pressure_sinkage_d60_d100.csv"),
    "wheel.csv": copied("tests/reference/terramechanics/cmu_smooth_beta0_mean.csv"),
    "pump.fmu": pump,
    "plant.ssp": plant,
    "scenario.toml": module_folder,
    "./libmy_soil_plugin.so": module_folder,
    "./target/debug": module_alone,
}


def brought(place, line):
    """Provides the files that the line needs and no earlier command has made."""
    words = shlex.split(line)
    # tests that a fit has not seen are of the kind that it has
    other = STOCK["wheel.csv" if "--wheel" in words else "plates.csv"]
    for name, make in {**STOCK, "other.csv": other}.items():
        if name in words and (name == "other.csv" or not (place / name).exists()):
            make(place, name)


def copy_of_the_repository(folder):
    """Scenarios and models, and a home in which they are installed."""
    for name in ("scenarios", "models"):
        shutil.copytree(ROOT / name, folder / name)
        shutil.copytree(ROOT / name, folder / "home/.local/share/terraglue" / name)
    return folder


def beside(name):
    """A program of the workspace that is built next to `terraglue`."""
    program = pathlib.Path(PROGRAM).resolve().parent / name
    assert program.is_file(), f"{program} is not there: `cargo build --workspace` makes it"
    return program


def xtask(command=""):
    """The program behind `cargo xtask COMMAND`."""
    return beside("terraglue-validation" if command in ("validate", "faults", "pictures") else "xtask")
