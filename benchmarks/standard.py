"""What `muslin eval` costs with all its standard metrics, and what each family of them costs alone."""

from __future__ import annotations

import multiprocessing
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.ndimage import uniform_filter1d

from benchmarks.spread import Spread, spread
from muslin.eval.compare import compare
from muslin.eval.score.families import STANDARD
from muslin.sim.dataset.processes import one_thread_each
from muslin.sim.dataset.reader import open_dataset, write_dataset
from muslin.sim.dataset.sample import Sample

SMOOTHED = 5  # frames over which the prediction is the mean of the truth
WAVES = 5e-3  # m, of the prediction: some of the cloth comes to lie inside the body
WAVENUMBER = 20.0  # rad/m


@dataclass(frozen=True)
class Costs:
    """CPU seconds of the whole standard set, and of each family when it is chosen alone, opening included."""

    sample: str
    frames: int
    vertices: int
    body_vertices: int
    together: Spread
    alone: dict[str, Spread]

    def table(self) -> str:
        rows = [f"| {name} | {cost.text(1)} |" for name, cost in self.alone.items()]
        head = (
            f"{self.sample}: {self.frames} frames of {self.vertices} vertices, "
            f"body of {self.body_vertices}\n\n"
            "| | CPU s |\n| --- | --- |\n"
        )
        return head + "\n".join([f"| standard | {self.together.text(1)} |", *rows]) + "\n"


def costs(root: Path, frames: int, rounds: int) -> Costs:
    """Of the first sequence of a dataset with so many frames, against itself smoothed and bent.

    Raises ValueError if there is none.
    """
    truth = _cut(_first(root, frames), frames)
    with tempfile.TemporaryDirectory() as folder:
        sides = Path(folder) / "prediction", Path(folder) / "truth"
        for side, sample in zip(sides, (_bent(truth), truth), strict=True):
            write_dataset(side, [sample])
        taken: dict[str, list[float]] = {name: [] for name in ("standard", *STANDARD)}
        # A process each: eigenfunctions that are kept from the last round would cost nothing.
        spawn = multiprocessing.get_context("spawn")
        with one_thread_each(), ProcessPoolExecutor(1, mp_context=spawn, max_tasks_per_child=1) as pool:
            for _ in range(rounds):
                for name, values in taken.items():
                    values.append(pool.submit(_seconds, *sides, name).result())
    measured = {name: spread(values) for name, values in taken.items()}
    return Costs(
        truth.id,
        frames,
        truth.positions.shape[1],
        len(truth.body_vertices(0)),
        measured.pop("standard"),
        measured,
    )


def _seconds(prediction: Path, truth: Path, metrics: str) -> float:
    begun = time.process_time()
    compare(prediction, truth, metrics=[metrics])
    return time.process_time() - begun


def _first(root: Path, frames: int) -> Sample:
    dataset = open_dataset(root)
    for name in dataset.ids:
        sample = dataset[name]
        if isinstance(sample, Sample) and sample.num_frames >= frames:
            return sample
    raise ValueError(f"{root}: no sequence of {frames} frames of one topology; give another dataset")


def _cut(sample: Sample, frames: int) -> Sample:
    body = sample.body
    if body is not None:
        body = replace(body, poses=body.poses[:frames], translations=body.translations[:frames])
    return replace(
        sample, positions=sample.positions[:frames], masked_faces=sample.masked_faces[:frames], body=body
    )


def _bent(truth: Sample) -> Sample:
    x = truth.positions.astype(np.float64)
    bent = uniform_filter1d(x, SMOOTHED, axis=0) + WAVES * np.sin(WAVENUMBER * np.roll(x, -1, axis=-1))
    return replace(truth, positions=bent.astype(np.float32))
