"""What all process pools of this package share."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager

from muslin.garments.errors import InputError


def usable_cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def leave_interrupts_to_parent() -> None:
    """Ctrl-C reaches every process of a terminal; only the parent shall answer."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def worker_died(workers: int) -> InputError:
    """The error for a pool of which a process ended by itself."""
    return InputError(
        "a worker process died, most often because memory ran out; what was finished is kept: "
        f"run again with fewer --workers than {workers}"
    )


_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMEXPR_NUM_THREADS")


@contextmanager
def one_thread_each() -> Iterator[None]:
    """One thread a process: faster with a process a core, and sums no longer depend on the number of
    threads."""
    before = {name: os.environ.get(name) for name in _THREADS}
    os.environ.update(dict.fromkeys(_THREADS, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
