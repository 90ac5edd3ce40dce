"""Sweeps from Python: the table of the program, whichever executor runs the cases and whatever was killed between."""

import hashlib
import os
import signal
import threading
from concurrent.futures import Future, ProcessPoolExecutor, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool

import pytest
from conftest import ROOT

PLAN = {
    "scenario": ROOT / "scenarios/plate_sinkage.toml",
    "sweep": {
        "seeds": 2,
        "collect": ["max_sinkage_m"],
        "vary": {"soil.parameters": ["LETE_sand", "dry_sand_LLL_K010"], "time.duration_s": {"from": 0.55, "to": 0.6, "count": 2}},
    },
}


def hashes(sweep):
    """Of the recordings and the table."""
    files = [*sorted(sweep.folder.glob("cases/*/recording.mcap")), sweep.folder / "sweep.csv"]
    return [hashlib.sha256(file.read_bytes()).hexdigest() for file in files]


@pytest.fixture(scope="module")
def whole(tg, tmp_path_factory):
    return tg.sweep(PLAN, tmp_path_factory.mktemp("whole") / "sweep", jobs=1)


def test_a_plan_is_a_dictionary_and_the_table_has_numbers(tg, whole):
    rows = whole.rows()
    assert len(whole) == len(rows) == 8 and whole.missing == [] and "8 cases, 0 missing" in repr(whole)
    assert [row["case"] for row in rows] == list(range(1, 9)) and {row["status"] for row in rows} == {"done"}
    assert rows[0]["soil.parameters"] == "LETE_sand" and rows[0]["time.duration_s"] == 0.55 and rows[0]["reason"] is None
    assert rows[2]["max_sinkage_m"] > rows[0]["max_sinkage_m"] > 0
    assert whole.collect() == {"done": 8, "failed": 0, "refused": 0, "crashed": 0, "missing": 0}
    assert tg.Sweep(whole.folder).rows() == rows


def test_the_table_as_a_data_frame(whole):
    pytest.importorskip("pandas", reason="pandas is not installed: pip install pandas")
    frame = whole.to_pandas()
    assert frame.index.name == "case" and frame["max_sinkage_m"].dtype == float
    assert frame.groupby("soil.parameters")["max_sinkage_m"].mean().shape == (2,)


@pytest.mark.parametrize("kind", ["threads", "processes", "dask"])
def test_every_executor_gives_the_same_bytes(tg, whole, tmp_path, kind):
    if kind == "dask":
        distributed = pytest.importorskip("distributed", reason="distributed is not installed: pip install distributed")
        with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster, distributed.Client(cluster) as client:
            own = tg.sweep(PLAN, tmp_path / "sweep", executor=client.get_executor())
    else:
        with (ThreadPoolExecutor if kind == "threads" else ProcessPoolExecutor)(2) as executor:
            own = tg.sweep(PLAN, tmp_path / "sweep", executor=executor)
    assert hashes(own) == hashes(whole)


class Killed(ProcessPoolExecutor):
    """Its worker is killed in the place of its second task."""

    submitted = 0

    def submit(self, *arguments, **options):
        self.submitted += 1
        return super().submit(_die) if self.submitted == 2 else super().submit(*arguments, **options)


def _die():
    os.kill(os.getpid(), signal.SIGKILL)


def test_a_worker_that_is_killed_leaves_what_is_missing_for_the_next(tg, whole, tmp_path):
    own = tg.Sweep.create(PLAN, tmp_path / "sweep")
    with Killed(1) as executor, pytest.raises(BrokenProcessPool):
        own.run(executor=executor)
    assert 7 <= len(own.missing) < 9
    done = {path: path.stat().st_mtime_ns for path in own.folder.glob("cases/*/case.json")}
    with ThreadPoolExecutor(2) as executor:
        tg.Sweep(own.folder).run(executor=executor)
    assert all(path.stat().st_mtime_ns == when for path, when in done.items())
    assert hashes(own) == hashes(whole)


def test_cases_that_fail_are_rows_and_run_again_on_demand(tg, tmp_path):
    plan = {"scenario": PLAN["scenario"], "sweep": {"vary": {"time.duration_s": [0.01 * k for k in range(1, 21)] + [0.0105]}}}
    with ThreadPoolExecutor(2) as executor:
        own = tg.sweep(plan, tmp_path / "sweep", executor=executor)
        last = own.rows()[-1]
        assert last["status"] == "refused" and "no multiple of `step_s`" in last["reason"] and last["steps"] is None
        before = (own.folder / "cases/0021/case.json").stat().st_mtime_ns
        own.run(executor=executor)
        assert (own.folder / "cases/0021/case.json").stat().st_mtime_ns == before
        assert own.run(executor=executor, again=True).collect()["refused"] == 1
        assert (own.folder / "cases/0021/case.json").stat().st_mtime_ns > before


class Stopped:
    """An executor that is interrupted while its second task runs."""

    def __init__(self):
        self.futures = []

    def submit(self, function, *arguments, **options):
        future = Future()
        self.futures.append(future)
        if len(self.futures) == 1:
            future.set_result(function(*arguments, **options))
        if len(self.futures) == 2:
            future.set_running_or_notify_cancel()
            threading.Timer(0.1, future.set_exception, [KeyboardInterrupt()]).start()
        return future


def test_ctrl_c_cancels_what_has_not_begun(tg, tmp_path):
    own, executor = tg.Sweep.create(PLAN, tmp_path / "sweep"), Stopped()
    with pytest.raises(KeyboardInterrupt):
        own.run(executor=executor)
    assert len(own.missing) == 7 and all(future.cancelled() for future in executor.futures[2:])


def test_what_is_no_sweep_says_what_makes_one(tg, whole, tmp_path):
    with pytest.raises(tg.InputError, match="terraglue.sweep"):
        tg.Sweep(tmp_path)
    with pytest.raises(tg.InputError, match="is there and not empty"):
        tg.sweep(PLAN, whole.folder)
    with pytest.raises(tg.InputError, match="soil.modul"):
        tg.sweep({**PLAN, "sweep": {"vary": {"soil.modul": ["soil-bekker"]}}}, tmp_path / "own")
    with pytest.raises(tg.InputError, match="scenario"):
        tg.sweep({"sweep": {"seeds": 2}}, tmp_path / "own")
