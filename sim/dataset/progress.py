"""How far a run of `generate` is: for who watches it, and in a file for who asks from elsewhere."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass

from muslin.sim.dataset.root import Root
from muslin.sim.dataset.schema import PROGRESS

FILE_S = 15.0
"""Between two writings of the file."""


Progress = Callable[[float, int, str], None]
"""Called with (done, total, message) while long work runs: items finished, with the begun ones in parts;
items there are, 0 while that is not known; what else there is to say."""


@dataclass(frozen=True)
class Status:
    """A run, seen at one moment.

    stage            "starting workers", "simulating", "finished", …
    done, total      samples of this run, begun ones in parts; without those that were there before
    failed           samples given up
    rate             samples an hour, since the workers started; 0 while there is no telling
    left_s           seconds left at that rate, or None
    at               id of a sample that is being made
    dashboard        address of dask's page, or empty
    updated          seconds since 1970, by the clock of the machine that writes
    """

    stage: str
    done: float = 0.0
    total: int = 0
    failed: int = 0
    rate: float = 0.0
    left_s: float | None = None
    at: str = ""
    dashboard: str = ""
    updated: float = 0.0

    @property
    def text(self) -> str:
        """What a line has room for beside a bar."""
        parts = [self.stage if self.stage != "simulating" else self.at]
        if self.rate:
            parts.append(f"{self.rate:.3g} samples/h")
        if self.failed:
            parts.append(f"{self.failed} failed")
        return ", ".join(part for part in parts if part)


def read_status(root: Root) -> Status | None:
    """The last status of the last run over a dataset; None if none was written, or it is not readable."""
    try:
        return Status(**json.loads(root.read(PROGRESS)))
    except (FileNotFoundError, ValueError, TypeError):
        return None


class Tally:
    """Adds up the news of all chains of a run."""

    def __init__(self, root: Root, total: int, progress: Progress | None) -> None:
        self._root, self._total, self._progress = root, total, progress
        self._stage, self._dashboard, self._at = "", "", ""
        self._made = self._failed = 0
        self._shares: dict[int, float] = {}
        self._begun = time.monotonic()
        self._written = -FILE_S

    def stage(self, name: str) -> None:
        """What is being done now."""
        self._stage = name
        self._tell()

    def open(self, dashboard: str) -> None:
        """The workers are there."""
        self._dashboard, self._begun = dashboard, time.monotonic()
        self.stage("simulating")

    def news(self, place: int, share: float, at: str, weight: int) -> None:
        """Of a chain of `weight` samples this share is done; `at` is being made."""
        self._shares[place] = share * weight
        self._at = at
        self._tell()

    def finished(self, place: int, made: int, failed: int) -> None:
        """A chain has ended."""
        self._shares.pop(place, None)
        self._made += made
        self._failed += failed
        self._tell()

    def end(self, stage: str) -> None:
        """The run is over, and how: written whatever the time."""
        self._stage, self._written = stage, -FILE_S
        self._shares.clear()
        self._tell()

    def tick(self) -> None:
        """Nothing happened."""
        self._tell()

    def status(self) -> Status:
        done = self._made + sum(self._shares.values())
        hours = (time.monotonic() - self._begun) / 3600.0
        rate = done / hours if done and hours else 0.0
        left = (self._total - self._failed - done) / rate * 3600.0 if rate else None
        fixed = (self._stage, done, self._total, self._failed, rate, left, self._at, self._dashboard)
        return Status(*fixed, updated=time.time())

    def _tell(self) -> None:
        status = self.status()
        if self._progress is not None:
            self._progress(status.done, status.total, status.text)
        if time.monotonic() - self._written >= FILE_S:
            self._written = time.monotonic()
            self._root.write(PROGRESS, (json.dumps(asdict(status), indent=1) + "\n").encode())
