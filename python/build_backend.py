"""Builds the wheel: first the program with its modules, models and scenarios, which the wheel holds, then the extension by maturin.

`TERRAGLUE_PROFILE=debug` takes what `cargo build --workspace` has made instead of building the release profile.
"""

import os
import pathlib
import shutil
import subprocess

import maturin
from maturin import *  # noqa: F401,F403 - the hooks that are not changed

HERE = pathlib.Path(__file__).resolve().parent
DATA = HERE / "terraglue" / "data"


def profile():
    chosen = os.environ.get("TERRAGLUE_PROFILE", "release")
    if chosen not in ("debug", "release"):
        raise SystemExit(f"TERRAGLUE_PROFILE = {chosen!r}: write debug or release")
    return chosen


def lay_out():
    shutil.rmtree(DATA, ignore_errors=True)
    built = ["--built", "debug"] if profile() == "debug" else []
    cargo = os.environ.get("CARGO", "cargo")
    # as `cargo xtask`, whose alias is not known in the folder of an unpacked source
    command = [cargo, "run", "--quiet", "--package", "xtask-start", "--", "install", str(DATA), *built]
    subprocess.run(command, cwd=HERE.parent, check=True)


def settings(config):
    config = dict(config or {})
    chosen = "dev" if profile() == "debug" else "release"
    config.setdefault("build-args", f"--profile {chosen}")
    return config


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    lay_out()
    return maturin.build_wheel(wheel_directory, settings(config_settings), metadata_directory)


def build_editable(wheel_directory, config_settings=None, metadata_directory=None):
    lay_out()
    return maturin.build_editable(wheel_directory, settings(config_settings), metadata_directory)


def build_sdist(sdist_directory, config_settings=None):
    raise SystemExit("there is no source distribution: the wheel is built in a checkout, `pip install ./python`")
