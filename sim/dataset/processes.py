"""What all process pools of this package share."""

from __future__ import annotations

import multiprocessing
import multiprocessing.process
import os
import signal
import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from itertools import islice
from typing import TypeVar

from muslin.garments.errors import InputError

Work = TypeVar("Work")
Found = TypeVar("Found")

AHEAD = 16
"""Parts of the tasks that wait for each process: a slow one does not stop the others soon."""


def usable_cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def leave_interrupts_to_parent() -> None:
    """Ctrl-C reaches every process of a terminal; only the parent shall answer."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _begin(start: Callable[[], None]) -> None:
    """In a process of a pool: end with the parent, whose death a pool's processes do not see."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_end_with, args=(parent,), daemon=True).start()
    start()


def _end_with(parent: multiprocessing.process.BaseProcess) -> None:
    parent.join()
    os._exit(1)


def worker_died(workers: int, note: str = "") -> InputError:
    """The error for a pool of which a process ended by itself."""
    return InputError(
        f"a worker process died, most often because memory ran out{note}: "
        f"run again with fewer --workers than {workers}"
    )


def _each(run: Callable[[Work], Found], part: Sequence[Work]) -> list[Found]:
    return [run(task) for task in part]


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


def in_processes(
    run: Callable[[Work], Found],
    tasks: Sequence[Work],
    workers: int,
    start: Callable[[], None] = leave_interrupts_to_parent,
    chunk: int = 1,
) -> Iterator[Found]:
    """run(task) in the order of the tasks, by so many processes of one thread each; with one, by this one.

    run, start   importable by name; `start` is called once in each process
    chunk        tasks that a process gets at a time

    Raises InputError if a process dies.
    """
    if workers <= 1 or len(tasks) <= 1:
        yield from map(run, tasks)
        return
    context, count = multiprocessing.get_context("spawn"), min(workers, len(tasks))
    with (
        one_thread_each(),
        ProcessPoolExecutor(count, mp_context=context, initializer=_begin, initargs=(start,)) as pool,
    ):
        parts = (tasks[first : first + chunk] for first in range(0, len(tasks), chunk))
        try:
            # A few at a time: the pool's thread, when it tells all futures that a process died, must not find
            # that others join them meanwhile. It may die of that (Python 3.11), and then nothing ends.
            waiting = deque(pool.submit(_each, run, part) for part in islice(parts, AHEAD * count))
            while waiting:
                yield from waiting.popleft().result()
                waiting.extend(pool.submit(_each, run, part) for part in islice(parts, 1))
        except BrokenProcessPool as error:
            # Not `pool.map`, which cancels what is left while the pool tells the same futures that it is
            # broken: its thread may die of that too.
            raise worker_died(workers) from error
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
