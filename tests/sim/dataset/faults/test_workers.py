"""Workers that die: of signals, and of the memory they take."""

from __future__ import annotations

import os
import random
import signal
import time
from pathlib import Path

import pytest
from sheets import make

from benchmarks.faults import Contents, contents, send, workers_of
from muslin.sim.dataset.engine import Cluster
from muslin.sim.dataset.quarantine import quarantined_ids, read_quarantined
from muslin.sim.dataset.root import open_root

SIGNALS = [signal.SIGKILL, signal.SIGTERM, signal.SIGKILL, signal.SIGKILL]


class Killer:
    """Sends the signals to workers of this process, one a second, then lets the held samples be made."""

    def __init__(self, hold: Path) -> None:
        self.hold, self.left = hold, list(SIGNALS)
        self.draw, self.last = random.Random(6), time.monotonic()

    def __call__(self, done: float, total: int, message: str) -> None:
        found = workers_of(os.getpid())
        if not self.left:
            self.hold.unlink(missing_ok=True)
        elif done and found and time.monotonic() - self.last > 1.0:
            if send(self.draw.choice(found), self.left[0]):
                self.left.pop(0)
            self.last = time.monotonic()


def test_workers_that_are_killed_are_replaced(
    undisturbed: Contents, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    hold = tmp_path / "hold"
    hold.touch()
    monkeypatch.setenv("FAULT_HOLD", str(hold))
    killer = Killer(hold)
    report = make(tmp_path / "data", cluster=Cluster(workers=2, retries=9), progress=killer)
    assert not killer.left
    assert (len(report.made), report.failed) == (9, {})
    assert contents(tmp_path / "data") == undisturbed


def test_a_worker_that_runs_out_of_memory_is_replaced(
    undisturbed: Contents, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    greedy = tmp_path / "greedy"
    greedy.touch()
    monkeypatch.setenv("FAULT_EAT", str(greedy))
    monkeypatch.setenv("FAULT_SPARE", "1")
    report = make(tmp_path / "data", cluster=Cluster(workers=1, memory="600MB"))
    assert not greedy.exists()
    assert (len(report.made), report.failed) == (9, {})
    assert contents(tmp_path / "data") == undisturbed


def test_what_always_runs_out_of_memory_is_given_up_until_asked_for(
    undisturbed: Contents, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out, greedy = tmp_path / "data", tmp_path / "greedy"
    greedy.touch()
    monkeypatch.setenv("FAULT_EAT", str(greedy))
    cluster = Cluster(workers=1, memory="600MB", retries=1)
    report = make(out, cluster=cluster)
    assert len(report.failed) == 2
    (sample_id,) = quarantined_ids(open_root(out))
    assert sample_id == next(iter(report.failed))
    entry = read_quarantined(open_root(out), sample_id)
    assert "2 times: most often because memory ran out" in entry.reason
    assert any("exceeded 95% memory budget" in line for line in entry.log)
    assert (len(report.made), len(contents(out))) == (7, 7)
    greedy.unlink()
    assert len(make(out, cluster=cluster, retry=True).made) == 2
    assert contents(out) == undisturbed
