"""Runs over a dask scheduler that others started: it dies, a worker ends, or the run itself is killed."""

from __future__ import annotations

import signal
import time
from pathlib import Path

import pytest
from distributed import Client
from sheets import environment_of, make, start, stored

from benchmarks.dask_processes import dask_processes
from benchmarks.faults import Contents, contents, send, wait_until
from muslin.garments.errors import InputError
from muslin.sim.dataset import engine
from muslin.sim.dataset.engine import LOST_S, Cluster


def test_without_its_scheduler_a_run_ends_and_says_so(undisturbed: Contents, tmp_path: Path) -> None:
    hold, out = tmp_path / "hold", tmp_path / "data"
    hold.touch()
    with dask_processes(tmp_path / "dask", environment_of({"FAULT_HOLD": str(hold)})) as dask:
        address, scheduler = dask.scheduler()
        dask.worker()
        killed: list[float] = []

        def kill_scheduler(done: float, total: int, message: str) -> None:
            if stored(out) and not killed:
                scheduler.kill()
                killed.append(time.monotonic())

        with pytest.raises(InputError, match=r"the dask scheduler is lost.*start it again"):
            make(out, cluster=Cluster(scheduler=address), progress=kill_scheduler)
        assert time.monotonic() - killed[0] < LOST_S
    assert 0 < stored(out) < 9
    assert len(make(out).made) + stored(out) >= 9
    assert contents(out) == undisturbed


def test_a_killed_run_leaves_the_workers_of_a_scheduler_free(undisturbed: Contents, tmp_path: Path) -> None:
    hold, out = tmp_path / "hold", tmp_path / "data"
    hold.touch()
    with dask_processes(tmp_path / "dask", environment_of({"FAULT_HOLD": str(hold)})) as dask:
        address, _ = dask.scheduler()
        dask.worker()
        run = start(out, scheduler=address)
        wait_until(lambda: stored(out) >= 7, "the samples that are not held")
        run.kill()
        run.communicate()
        # As long as the sample is held, what makes it can only end by being told that nobody wants it.
        with Client(address) as client:
            busy = lambda dask_worker: bool(dask_worker.state.executing)  # noqa: E731
            wait_until(lambda: not any(client.run(busy).values()), "the worker to be free", 60.0)
        hold.unlink()
        before = stored(out)
        report = make(out, cluster=Cluster(scheduler=address))
    assert (len(report.made), len(report.kept)) == (9 - before, before)
    assert contents(out) == undisturbed


def test_a_worker_that_is_asked_to_end_puts_its_samples_back(undisturbed: Contents, tmp_path: Path) -> None:
    hold, out = tmp_path / "hold", tmp_path / "data"
    hold.touch()
    with dask_processes(tmp_path / "dask", environment_of({"FAULT_HOLD": str(hold)})) as dask:
        address, _ = dask.scheduler()
        first = dask.worker()
        left = [first]

        def end_worker(done: float, total: int, message: str) -> None:
            if stored(out) >= 7 and left:
                send(left.pop().pid, signal.SIGTERM)
                dask.worker()
                hold.unlink()

        report = make(out, cluster=Cluster(scheduler=address), progress=end_worker)
        assert first.wait(60.0) is not None
    assert (len(report.made), report.failed) == (9, {})
    assert contents(out) == undisturbed


def test_where_no_scheduler_is_that_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engine, "LOST_S", 1.0)
    with pytest.raises(InputError, match=r"tcp://127\.0\.0\.1:9: no dask scheduler answers"):
        make(tmp_path / "data", cluster=Cluster(scheduler="tcp://127.0.0.1:9"))
