"""Work over processes, on this machine or on many: dask.distributed, set up for long single-threaded tasks.

What dask does: to start workers, to replace those that die, to give their tasks to others, to watch memory.
What is added here: tasks are handed over a few at a time, so that neither the scheduler nor this process
holds a plan of 10^6 samples; and workers send news of how far they are.
"""

from __future__ import annotations

import contextlib
import importlib.util
import logging
import os
import queue
import signal
import threading
import time
import uuid
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any, Generic, TypeVar

import dask
from distributed import CancelledError, Client, Future, KilledWorker, LocalCluster, WorkerPlugin, get_worker
from distributed.client import ClosedClientError, FutureCancelledError

from muslin.garments.errors import InputError
from muslin.sim.dataset.processes import leave_interrupts_to_parent, usable_cores

Task = TypeVar("Task")
Found = TypeVar("Found")

RETRIES = 3
"""How often a task is given to another worker after one died over it."""
LOST_S = 30.0
"""How long a scheduler may be out of reach when a run starts."""
NEWS_S, MOST_NEWS = 0.5, 20.0
"""Seconds between two news of one worker, at least; and news of all workers a second, at most."""
_AHEAD, _LEAST_AHEAD = 2, 8
"""Tasks handed over for every worker, and at least."""
_LOG_LINES = 200
_RESULT_S = 10.0
"""In which the result of a finished task comes, unless its worker has died since."""

_CONFIG = {
    # A worker gets its next task when it has done the last.
    "distributed.scheduler.worker-saturation": 1.0,
    # A busy worker is not dead, and a clock that jumps must not make it so; nannies see processes die.
    "distributed.scheduler.worker-ttl": None,
    # Results are small: only ending helps a worker that is full. One that pauses would never go on.
    "distributed.worker.memory.target": False,
    "distributed.worker.memory.spill": False,
    "distributed.worker.memory.pause": False,
    "distributed.worker.profile.enabled": False,
    "distributed.admin.tick.interval": "500ms",
    # glibc's own threshold: dask's returns memory after every array, which costs time and saves none here.
    "distributed.nanny.pre-spawn-environ.MALLOC_TRIM_THRESHOLD_": 1 << 27,
    "distributed.nanny.pre-spawn-environ.NUMEXPR_NUM_THREADS": 1,
}


@dataclass(frozen=True)
class Cluster:
    """Which workers do it.

    workers      processes on this machine; one a usable core unless given, on a GPU one
    scheduler    address of a running dask scheduler, whose workers do it instead
    memory       of a worker on this machine, such as "4GB"; a worker that needs more is replaced, as if it
                 had died. An equal share of the machine's unless given
    retries      after how many deaths more a task is given up (a running scheduler has its own number)
    """

    workers: int | None = None
    scheduler: str | None = None
    memory: str = "auto"
    retries: int = RETRIES

    def __post_init__(self) -> None:
        if self.workers is not None and self.workers < 1:
            raise InputError(f"workers = {self.workers}: must be 1 or more")
        if self.retries < 0:
            raise InputError(f"retries = {self.retries}: must be 0 or more")

    def fitted(self, tasks: int, device: str) -> Cluster:
        """With no more workers than tasks; where no number was given, a usable core each on the CPU, and one
        on a GPU."""
        if self.scheduler is not None:
            return self
        usual = usable_cores() if device == "cpu" else 1
        return replace(self, workers=min(tasks, self.workers or usual))


@dataclass(frozen=True)
class Died:
    """A task that was given up, because every worker that had it died, and what the machines said of it."""

    reason: str
    log: tuple[str, ...] = ()


@dataclass(frozen=True)
class Done(Generic[Found]):
    """`place`: of the task in the list."""

    place: int
    found: Found | Died


@dataclass(frozen=True)
class News:
    """`said` by the worker that has the task at this place."""

    place: int
    said: Any


@dataclass
class Engine:
    """An open cluster. dashboard: address of dask's page, or empty."""

    client: Client
    dashboard: str = ""
    _log: deque[str] = field(default_factory=lambda: deque(maxlen=_LOG_LINES))

    def run(
        self, function: Callable[[Task, Callable[[Any], None]], Found], tasks: Sequence[Task]
    ) -> Iterator[Done[Found] | News | None]:
        """function(task, tell) for every task, in any order; what it `tell`s (plain values) comes as `News`.

        Yields None when nothing happened for a while, so that the caller can do something else.
        Raises the error of a task, and InputError if the scheduler is lost.
        """
        topic = f"muslin-{uuid.uuid4().hex}"
        events: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self.client.subscribe_topic(topic, lambda event: events.put(News(*event[1])))
        waiting = iter(enumerate(tasks))
        begun: dict[Future, int] = {}
        try:
            threads, looked = self._threads(), time.monotonic()
            while True:
                while (
                    len(begun) < max(_LEAST_AHEAD, _AHEAD * threads)
                    and (item := next(waiting, None)) is not None
                ):
                    begun[self._submit(function, *item, topic, events, threads)] = item[0]
                if not begun:
                    return
                try:
                    event = events.get(timeout=0.2)
                except queue.Empty:
                    self._check()
                    yield None
                    continue
                if isinstance(event, News):
                    yield event
                    continue
                found = self._result(event)
                if found is None:
                    event.add_done_callback(events.put)
                    continue
                yield Done(begun.pop(event), found)
                if time.monotonic() - looked > 10.0:
                    threads, looked = self._threads(), time.monotonic()
        finally:
            with contextlib.suppress(OSError, RuntimeError, ClosedClientError):  # of a scheduler that is gone
                self.client.cancel(list(begun))
                self.client.unsubscribe_topic(topic)

    def _submit(self, function: Any, place: int, task: Any, topic: str, events: Any, threads: int) -> Future:
        # As a producer of data it waits at the scheduler. What waits at a worker is suspected when that dies.
        more: dict[str, Any] = {"_data_producer": True}
        key = f"{topic}-{place}"
        call = (_run, function, task, place, topic, max(NEWS_S, threads / MOST_NEWS))
        future = self.client.submit(*call, pure=False, key=key, **more)
        future.add_done_callback(events.put)
        return future

    def _threads(self) -> int:
        try:
            return sum(self.client.nthreads().values())
        except (OSError, ClosedClientError) as error:
            raise _lost(str(error)) from error

    def _check(self) -> None:
        """Raise InputError if the scheduler has been out of reach for too long."""
        if self.client.status in ("closed", "closing"):
            raise _lost(str(self.client.scheduler.address if self.client.scheduler else "the scheduler"))

    def _result(self, future: Future) -> Any:
        """What came of a task; None if it went down with its worker, and is being made again."""
        try:
            found = future.result(timeout=_RESULT_S)
        except KilledWorker as error:
            deaths = error.allowed_failures + 1
            reason = f"the worker process died, {deaths} times: most often because memory ran out"
            found = Died(reason, tuple(self._log))
        except (CancelledError, FutureCancelledError) as error:
            raise _lost(str(error)) from error
        except (OSError, TimeoutError):
            if future.status == "error":  # of the task itself
                raise
            return None
        future.release()
        return found


@contextmanager
def open_engine(cluster: Cluster) -> Iterator[Engine]:
    """Start workers on this machine, or join a scheduler; end, or leave, them with the block."""
    with _joined(cluster.scheduler) if cluster.scheduler is not None else _started(cluster) as engine:
        yield engine


@contextmanager
def _joined(address: str) -> Iterator[Engine]:
    try:
        client = Client(address, timeout=LOST_S)
    except (OSError, TimeoutError, ValueError) as error:
        raise InputError(
            f"--scheduler {address}: no dask scheduler answers there ({error}); start one with "
            "`dask scheduler`, and workers with `dask worker ADDRESS --nthreads 1`"
        ) from error
    with client:
        yield Engine(client, client.dashboard_link or "")


@contextmanager
def _started(cluster: Cluster) -> Iterator[Engine]:
    settings = {**_CONFIG, "distributed.scheduler.allowed-failures": cluster.retries}
    page = importlib.util.find_spec("bokeh") is not None
    with dask.config.set(settings), _heard() as log:
        local = LocalCluster(
            n_workers=cluster.workers or usable_cores(),
            threads_per_worker=1,
            processes=True,
            memory_limit=cluster.memory,
            dashboard_address="127.0.0.1:0" if page else None,
            silence_logs=logging.CRITICAL,
        )
        with local, Client(local) as client:
            client.register_plugin(_Interrupts())
            try:
                yield Engine(client, client.dashboard_link if page else "", _log=log)
            except BaseException:
                _kill(local)
                raise


def _kill(local: LocalCluster) -> None:
    """End the workers at once, whatever they are at: nobody waits for what they would still find."""
    for nanny in local.workers.values():
        nanny.auto_restart = False
        if nanny.process is not None and nanny.process.pid is not None:
            with contextlib.suppress(ProcessLookupError):
                os.kill(nanny.process.pid, signal.SIGKILL)


def _lost(reason: str) -> InputError:
    return InputError(
        f"the dask scheduler is lost ({' '.join(reason.split())}); start it again, and then this command: "
        "what was finished is kept"
    )


class _Interrupts(WorkerPlugin):
    """Plugin of workers: Ctrl-C reaches every process of a terminal, and only the parent shall answer."""

    name = "muslin-interrupts"

    def setup(self, worker: Any) -> None:
        leave_interrupts_to_parent()


@contextmanager
def _heard() -> Iterator[deque[str]]:
    """The last lines that dask logged in this process, where nannies tell why workers end."""
    lines: deque[str] = deque(maxlen=_LOG_LINES)

    class Handler(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            lines.append(f"{record.name}: {record.getMessage()}")

    logger, handler = logging.getLogger("distributed"), Handler(logging.WARNING)
    logger.addHandler(handler)
    try:
        yield lines
    finally:
        logger.removeHandler(handler)


class _Unwanted(BaseException):
    """Ends a task from within; tasks that catch their exceptions let it pass."""


def _run(function: Any, task: Any, place: int, topic: str, every: float) -> Any:
    """In a worker: the task, with a way to tell news, of which one in `every` seconds is sent.

    It ends there if nobody waits for it any more: the process that sent it was killed, say.
    """
    worker, lock, last = get_worker(), threading.Lock(), [0.0]
    state = worker.state.tasks[worker.get_current_task()]

    def tell(said: Any) -> None:
        if state.state == "cancelled":
            raise _Unwanted
        with lock:
            now = time.monotonic()
            if now - last[0] >= every:
                last[0] = now
                worker.log_event(topic, [place, said])

    return function(task, tell)
