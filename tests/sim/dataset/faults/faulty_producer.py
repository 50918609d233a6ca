"""The sheets of `sheet_producer`, by a simulator that what happens in a test can slow, hold or make greedy.

FAULT_DELAY   seconds a sample takes
FAULT_HOLD    a file: as long as it is there, shapes whose beta is above 0.5 are not done
FAULT_EAT     a file: as long as it is there, shapes whose beta is above 0.5 take all the memory they get
FAULT_SPARE   with FAULT_EAT: the first who eats removes that file first
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
import sheet_producer

from muslin.sim.dataset.sample import Sample

MOST_BYTES = 3 << 30


def simulate(
    scenes: list[dict[str, Any]], device: str, progress: Callable[[int, int], None] | None
) -> Iterator[Sample]:
    """The samples of a chain of sheets; what was decided about each is told every twentieth of a second."""
    samples = sheet_producer.simulate(scenes, device, progress)
    for done, scene in enumerate(scenes):
        time.sleep(float(os.environ.get("FAULT_DELAY", "0")))
        if scene.get("body", {}).get("beta", [0.0])[0] > 0.5:
            while _there("FAULT_HOLD"):
                time.sleep(0.05)
                if progress is not None:
                    progress(done, len(scenes))
            if _there("FAULT_EAT"):
                _eat()
        yield next(samples)


def _there(variable: str) -> bool:
    return variable in os.environ and os.path.exists(os.environ[variable])


def _eat() -> None:
    if "FAULT_SPARE" in os.environ:
        Path(os.environ["FAULT_EAT"]).unlink()
    eaten: list[np.ndarray] = []
    for total in count(0, 40 << 20):
        if total > MOST_BYTES:
            raise AssertionError("nobody minds how much memory is used")
        eaten.append(np.ones(5 << 20))
        time.sleep(0.02)
