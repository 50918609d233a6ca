"""Commands in processes of their own, each held to one core and to one thread in the libraries that ask."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

LAUNCHER = """
import os, subprocess, sys
child = subprocess.Popen(sys.argv[2:])
_, status, used = os.wait4(child.pid, 0)
with open(sys.argv[1], "w") as out:
    out.write(f"{used.ru_utime + used.ru_stime} {used.ru_maxrss}")
sys.exit(abs(os.waitstatus_to_exitcode(status)))
"""
"""Starts a command from a small process: Linux counts in a command's peak memory, in KiB, what its parent
held when it was started."""

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
    told = log.with_name(log.name + ".usage")
    start = time.perf_counter()
    with log.open("wb") as output, held_to(cores):
        ended = subprocess.run(
            [sys.executable, "-S", "-c", LAUNCHER, str(told), *(str(part) for part in command)],
            stdout=output,
            stderr=subprocess.STDOUT,
            stdin=subprocess.DEVNULL,
            env={**os.environ, **ONE_THREAD},
        )
    seconds = time.perf_counter() - start
    if ended.returncode != 0:
        end = log.read_text(encoding="utf-8", errors="replace")[-2000:]
        raise RuntimeError(f"{' '.join(map(str, command))} ended with {ended.returncode}; {log} ends:\n{end}")
    cpu, kibibytes = told.read_text(encoding="utf-8").split()
    told.unlink()
    return Usage(float(cpu), seconds, 1024 * int(kibibytes))


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
