"""Commands in processes of their own, each held to one core and to one thread in the libraries that ask."""

from __future__ import annotations

import os
import subprocess
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")


@dataclass(frozen=True)
class Usage:
    """Of one process that has ended: seconds of CPU and of the clock, and the most memory it held, bytes."""

    cpu_seconds: float
    wall_seconds: float
    peak_bytes: int


def run(command: Sequence[str | Path], cores: set[int], log: Path) -> Usage:
    """Run a command on some cores; RuntimeError with the end of its output if it fails.

    Peak memory is that of the command's first process, so give several workers a run each to measure them.
    """
    log.parent.mkdir(parents=True, exist_ok=True)
    start = time.perf_counter()
    with log.open("wb") as output, held_to(cores):
        child = subprocess.Popen(
            [str(part) for part in command],
            stdout=output,
            stderr=subprocess.STDOUT,
            stdin=subprocess.DEVNULL,
            env={**os.environ, **ONE_THREAD},
        )
        _, status, used = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode != 0:
        end = log.read_text(encoding="utf-8", errors="replace")[-2000:]
        raise RuntimeError(f"{' '.join(map(str, command))} ended with {child.returncode}; {log} ends:\n{end}")
    # Linux counts in kibibytes.
    return Usage(used.ru_utime + used.ru_stime, time.perf_counter() - start, 1024 * used.ru_maxrss)


@contextmanager
def held_to(cores: set[int]) -> Iterator[None]:
    """This process, and those that it starts meanwhile, on these cores only."""
    allowed = os.sched_getaffinity(0)
    if not cores <= allowed:
        raise ValueError(f"cores {sorted(cores)}: this process may use {sorted(allowed)}")
    os.sched_setaffinity(0, cores)
    try:
        yield
    finally:
        os.sched_setaffinity(0, allowed)
