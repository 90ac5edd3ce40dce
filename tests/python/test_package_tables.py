"""Recordings as tables, the ground over time, commands as functions, and the stubs against the package."""

import os
import subprocess
import sys

import numpy as np
import pytest
from conftest import PLATE, ROOT


@pytest.fixture(scope="module")
def pressed(tg, tmp_path_factory):
    """A recording with a ground that changes, and the ground as the testbed showed it."""
    folder = tmp_path_factory.mktemp("pressed") / "run"
    shown = {}
    with tg.Testbed(PLATE, set={"recording.ground_every_steps": 20}, out=folder) as testbed:
        testbed["bevameter.large_press.velocity_target"] = 0.05
        for _ in range(10):
            testbed.step(20)
            shown[round(testbed.t, 9)] = testbed.heights(-0.5, 0.5, -0.3, 0.3)[2]
    return tg.Recording(folder), shown


def test_the_ground_over_time_is_put_together_where_it_is_asked_for(tg, pressed):
    recording, shown = pressed
    ground = recording.ground_series()
    assert ground.shape == (len(ground.t), len(ground.y), len(ground.x)) and ground.t[0] == 0.0 and len(ground) > 3
    assert np.array_equal(ground[0], recording.ground("start")[2].astype(np.float32))
    for k, t in enumerate(ground.t[1:], 1):
        # recorded in whole parts of 1/8192 m
        assert ground[k] == pytest.approx(shown[round(t, 9)], abs=6.2e-5), t
    assert ground[-1].min() < ground[0].min() - 1e-3
    everything = np.asarray(ground)
    assert everything.shape == ground.shape and np.array_equal(ground[1:3], everything[1:3])
    assert np.array_equal(ground[::-1, 2], everything[::-1, 2]) and np.array_equal(ground[[3, 1], :, 4], everything[[3, 1], :, 4])
    assert np.array_equal(ground[..., 0], everything[..., 0]) and ground[5:5].shape == (0, *ground.shape[1:])
    assert np.array_equal(ground.at(0.5 * (ground.t[1] + ground.t[2])), everything[1]) and np.array_equal(ground.at(-1.0), everything[0])
    with pytest.raises(IndexError):
        ground[len(ground)]
    t, names, values = recording.energies()
    assert values.shape == (len(t), len(names)) and "kinetic" in names


def test_a_recording_is_a_table_of_pandas(tg, pressed):
    pytest.importorskip("pandas", reason="pandas is not installed: pip install pandas")
    recording, _ = pressed
    frame = recording.to_pandas(["bevameter.*_press.angle"])
    assert list(frame.columns) == [name for name in recording.names if name.endswith("_press.angle")] and frame.index.name == "t"
    t, angle = recording.series("bevameter.large_press.angle")
    assert np.array_equal(frame.index, t) and np.array_equal(frame["bevameter.large_press.angle"], angle)
    assert frame.attrs["units"]["bevameter.large_press.angle"] == "m" and frame.attrs["units"]["t"] == "s"
    assert len(recording.to_pandas().columns) == len(recording.names)
    with pytest.raises(KeyError, match="no variable matches"):
        recording.to_pandas(["bevameter.*_pres.angle"])


def test_a_recording_is_a_data_set_of_xarray(tg, pressed):
    pytest.importorskip("xarray", reason="xarray is not installed: pip install xarray")
    recording, _ = pressed
    data = recording.to_xarray(["bevameter.large_press.angle"])
    assert data["bevameter.large_press.angle"].attrs["units"] == "m" and data["t"].attrs["units"] == "s"
    ground = data["ground"]
    assert ground.dims == ("ground_t", "y", "x") and ground.attrs["units"] == "m"
    assert np.array_equal(ground.isel(ground_t=-1), recording.ground_series()[-1])
    place = ground.sel(x=0.0, y=0.0, method="nearest")
    assert place.shape == (len(ground.ground_t),)


def test_a_package_that_is_missing_is_named(tg, pressed, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(tg.Error, match="pip install pandas"):
        pressed[0].to_pandas()


def test_commands_are_functions(tg, tmp_path):
    plates = ROOT / "tests/reference/terramechanics/cmu_plate_pressure_sinkage_d60_d100.csv"
    found = tg.fit_soil(plates, soil="CMU_Direct90_s0")
    n = found["parameters"]["n"]
    assert n["low"] < n["value"] < n["high"]
    sheet = tg.compare("moon_walk", strategies=["cooperative", "iterative"], duration_s=0.02, set={"terrain.size_m": [2.0, 1.6]}, out=tmp_path / "out")
    assert "iterative" in str(sheet) and (tmp_path / "out/compare.html").is_file()
    fmu = tg.export_fmu("soil-bekker", tmp_path / "soil.fmu", set={"soil.parameters": "LETE_sand", "terrain.size_m": [0.6, 0.4]})
    assert fmu.read_bytes()[:2] == b"PK"
    rows = tg.check_module("soil-bekker", level="quick", only=["schema"])["rows"]
    assert [(row["test"], row["outcome"]) for row in rows] == [("schema", "pass")]
    with pytest.raises(tg.InputError, match="LETE_sandd"):
        tg.export_fmu("soil-bekker", tmp_path / "no.fmu", set={"soil.parameters": "LETE_sandd"})
    with pytest.raises(tg.Error, match="nowhere"):
        tg.check_module("nowhere")


def test_stubs_are_those_of_the_package(site):
    pytest.importorskip("mypy", reason="mypy is not installed: pip install mypy")
    environment = {**os.environ, "PYTHONPATH": str(site), "MYPYPATH": str(site)}
    done = subprocess.run([sys.executable, "-m", "mypy.stubtest", "terraglue._terraglue"], cwd=site, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
