"""Every command in a page, in the header of a scenario or in `--help` is typed as it is, shortened by
`documented.shortened`, one after the other in a copy of the repository's scenarios and models. Commands that are not run are in
`documented.NOT_RUN` with their reasons; their options are held against `--help`, as those of forms with placeholders."""

import functools
import os
import pathlib
import subprocess

import pytest

import documented
from conftest import PROGRAM, ROOT, terraglue


@functools.cache
def helps(program, path):
    """The `--help` of a subcommand; none: there is no such."""
    command = [PROGRAM if program == "terraglue" else documented.xtask(path), *path.split(), "--help"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300)
    return done.stdout if done.returncode == 0 else None


def told(program, words):
    return helps(program, " ".join(words))


def page(name):
    if not name.startswith("terraglue"):
        return documented.commands_of(name, (ROOT / name).read_text())
    return documented.commands_of(name, terraglue(*name.split()[1:]).stdout)


PAGES = documented.PAGES + [f"terraglue {path} --help".replace("  ", " ") for path in documented.HELPS]


ALONE = ("terraglue run scenarios/", "terraglue compare scenarios/", "terraglue export ")
passed = set()


def typed(commands, folder):
    """Failures of the commands of a page, each with its place."""
    place, wrong = documented.copy_of_the_repository(folder), []
    environment = {**os.environ, "HOME": str(folder / "home"), "XDG_CACHE_HOME": str(folder / "home/.cache")}
    for command in commands:
        if command.form or documented.reason_not_run(command):
            missing = documented.form_is_wrong(command, told)
            wrong += [f"{command.place}\n  {missing}"] if missing else []
            continue
        line = documented.shortened(command.text)
        # a command that only reads files of the repository and has passed on another page passes here
        if line in passed:
            continue
        documented.brought(place, line)
        done = subprocess.run(["bash", "-c", f"{line} && pwd > '{folder}/.place'"], cwd=place, env=environment,
                              capture_output=True, text=True, timeout=300)
        if done.returncode:
            wrong.append(f"{command.place}\n  {(done.stdout[-400:] + done.stderr[-800:]).strip()}")
        else:
            passed.update([line] if line.startswith(ALONE) else [])
            # where `cd` has led
            place = pathlib.Path((folder / ".place").read_text().strip())
    return wrong


@pytest.mark.parametrize("name", PAGES)
def test_what_a_page_says_to_type_works(name, tmp_path):
    wrong = typed(page(name), tmp_path)
    assert not wrong, "\n".join(wrong)


def test_the_table_of_what_is_not_run_holds_nothing_idle():
    all_of_them = [command for name in PAGES for command in page(name)]
    used = {documented.reason_not_run(command) for command in all_of_them}
    assert not documented.NOT_RUN.keys() - used
    run = [c for c in all_of_them if not c.form and not documented.reason_not_run(c)]
    assert len(run) > 60 and len([c for c in all_of_them if c.form]) > 30


def test_commands_that_are_wrong_are_found(tmp_path):
    text = """
```sh
terraglue soils          # fine
cargo run --release -- soils \\
    --fiel models/soils.csv
make-believe
```
One may `terraglue chekc FILE`, and `terraglue check FILE` with `terraglue run
SCENARIO --dry-run`; `cargo bench -p terraglue --bench none`, `cargo xtask validate --quik`. `terraglue` and `check` are words."""
    found = documented.commands_of("page.md", text)
    assert [(c.line, c.form) for c in found] == [(3, False), (4, False), (6, False), (8, True), (8, True), (8, True), (9, False), (9, False)]
    wrong = [line.split(": ")[0] for line in typed(found, tmp_path)]
    assert wrong == ["page.md:4", "page.md:6", "page.md:8", "page.md:8", "page.md:9", "page.md:9"]
