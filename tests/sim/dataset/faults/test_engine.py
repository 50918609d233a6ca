"""What the engine does with tasks over which workers die."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import psutil

from muslin.sim.dataset.engine import Cluster, Died, Done, News, open_engine


def test_only_the_task_that_kills_is_given_up() -> None:
    found, waiting = {}, []
    with open_engine(Cluster(workers=1, retries=1)) as engine:
        for event in engine.run(deadly_one, range(3)):
            if isinstance(event, Done):
                found[event.place] = event.found
            elif isinstance(event, News):
                # What waits at a worker dies with it, as if it had killed it.
                waiting += [len(keys) - 1 for keys in engine.client.processing().values()]
    assert waiting
    assert not any(waiting)
    assert isinstance(found.pop(0), Died)
    assert found == {1: 1, 2: 2}


def deadly_one(task: int, tell: Callable[[Any], None]) -> int:
    time.sleep(0.3)  # until the others have come
    tell(task)
    time.sleep(0.3)
    if task == 0:
        os._exit(9)
    return task


def test_a_worker_that_is_nearly_full_goes_on() -> None:
    with open_engine(Cluster(workers=1, memory="600MB")) as engine:
        ended = [event.found for event in engine.run(hoard, range(2)) if isinstance(event, Done)]
    assert len(set(ended)) == 1  # one process did both


HOARD: list[np.ndarray] = []


def hoard(task: int, tell: Callable[[Any], None]) -> int:
    """Fill the process to seven eighths of what it may have, and keep that; its id."""
    missing = 525_000_000 - psutil.Process().memory_info().rss
    HOARD.append(np.ones(max(0, missing) // 8))
    time.sleep(1.0)  # until the memory is looked at
    return os.getpid()
