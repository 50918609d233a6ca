"""What a contender writes: its frames, the CPU seconds of each, peak memory, versions."""

from __future__ import annotations

import argparse
import json
import resource
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from benchmarks.setting import Setting, load_setting

FRAMES_FILE = "frames.npy"
RECORD_FILE = "record.json"


@dataclass
class Record:
    """`positions` (T, V, 3) of the frames after the first, metres, and `seconds` (T,) of CPU time for each.

    `setup_seconds`: CPU time before the first frame, imports and compilation included. `options`: the
    quality that was asked for and how the fabric was translated, for the reader of the report.
    """

    packages: tuple[str, ...]
    positions: list[NDArray[np.float64]] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)
    setup_seconds: float = 0.0
    options: dict[str, object] = field(default_factory=dict)

    @contextmanager
    def frame(self) -> Iterator[None]:
        """Time one frame: all threads of this process, user and system."""
        if not self.seconds:
            self.setup_seconds = time.process_time()
        start = time.process_time()
        yield
        self.seconds.append(time.process_time() - start)

    def add(self, positions: ArrayLike) -> None:
        """Keep the positions (V, 3) that the frame just timed ended with."""
        self.positions.append(np.array(positions, dtype=np.float64).reshape(-1, 3))

    def save(self, folder: Path) -> None:
        """Write frames and record into a folder."""
        folder.mkdir(parents=True, exist_ok=True)
        np.save(folder / FRAMES_FILE, np.array(self.positions))
        summary = {
            "seconds": self.seconds,
            "setup_seconds": self.setup_seconds,
            "peak_bytes": 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss,
            "versions": {name: version(name) for name in self.packages},
            "options": self.options,
        }
        (folder / RECORD_FILE).write_text(json.dumps(summary, indent=1), encoding="utf-8")


def contend(simulate: Callable[[Setting], Record]) -> None:
    """The command line of a contender."""
    parser = argparse.ArgumentParser()
    parser.add_argument("setting", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--frames", type=int)
    given = parser.parse_args()
    simulate(load_setting(given.setting, given.frames)).save(given.out)
