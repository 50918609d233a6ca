"""Peak memory of this process and its children while something runs."""

from __future__ import annotations

import os
import threading
from pathlib import Path
from types import TracebackType

INTERVAL = 0.01  # seconds

PROC = Path("/proc")


class PeakMemory:
    """Context in which resident memory is sampled every INTERVAL from /proc; `peak` is the most, bytes.

    Resident memory of the process and of all its descendants, each page that they share counted for each of
    them. What is allocated and freed between two samples is missed, unless the process itself had never had
    as much: the kernel's high-water mark (VmHWM) covers that. Linux only.
    """

    def __init__(self) -> None:
        self.peak = 0
        self._done = threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)

    def __enter__(self) -> PeakMemory:
        self._mark = _high_water()
        self._sample()
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._done.set()
        self._thread.join()
        self._sample()
        mark = _high_water()
        if mark > self._mark:
            self.peak = max(self.peak, mark)

    def _watch(self) -> None:
        while not self._done.wait(INTERVAL):
            self._sample()

    def _sample(self) -> None:
        self.peak = max(self.peak, sum(resident_bytes(pid) for pid in family(os.getpid())))


def resident_bytes(pid: int) -> int:
    """Resident memory of a process, bytes; 0 of one that has ended."""
    try:
        pages = int((PROC / str(pid) / "statm").read_text().split()[1])
    except (FileNotFoundError, ProcessLookupError):
        return 0
    return pages * os.sysconf("SC_PAGE_SIZE")


def family(pid: int) -> list[int]:
    """A process and all its descendants."""
    found, at = [pid], 0
    while at < len(found):
        for task in (PROC / str(found[at]) / "task").glob("*/children"):
            try:
                found += [int(child) for child in task.read_text().split()]
            except (FileNotFoundError, ProcessLookupError):
                continue
        at += 1
    return found


def _high_water() -> int:
    for line in (PROC / "self" / "status").read_text().splitlines():
        if line.startswith("VmHWM:"):
            return 1024 * int(line.split()[1])
    return 0
