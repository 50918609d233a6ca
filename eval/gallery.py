"""Pictures of a dataset's samples, drawn by several processes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from muslin.sim.dataset import store
from muslin.sim.dataset.processes import in_processes, usable_cores
from muslin.sim.dataset.root import Root
from muslin.sim.dataset.sample import Sample
from muslin.sim.view.camera import Camera
from muslin.sim.view.lighting import DRAFT, FINE
from muslin.sim.view.picture import picture, sample_cameras

DRAPE_SIZE = (390, 520)
MOVIE_SIZE = (300, 400)

Progress = Callable[[float, int, str], None]


@dataclass(frozen=True)
class Shot:
    """One picture to draw: a frame of a sample; with `frames` as one of that movie."""

    root: Root
    sample_id: str
    frame: int = 0
    frames: tuple[int, ...] = ()


def draw(
    shots: Sequence[Shot], workers: int | None = None, progress: Progress | None = None
) -> list[np.ndarray]:
    """Pictures in the order of the shots; by default one process a usable core."""
    count = min(workers or usable_cores(), max(1, len(shots) // 4))
    pictures: list[np.ndarray] = []
    for done, image in enumerate(in_processes(_draw, shots, count, chunk=2), start=1):
        pictures.append(image)
        if progress is not None:
            progress(done, len(shots), shots[done - 1].sample_id)
    return pictures


def _draw(shot: Shot) -> np.ndarray:
    sample = _sample(shot.root, shot.sample_id)
    if not shot.frames:
        return picture(sample, shot.frame, DRAPE_SIZE, quality=FINE)
    cameras, ground = _cameras(shot.root, shot.sample_id, shot.frames)
    camera = cameras[shot.frames.index(shot.frame)]
    return picture(sample, shot.frame, MOVIE_SIZE, quality=DRAFT, camera=camera, ground=ground)


@lru_cache(maxsize=2)
def _cameras(root: Root, sample_id: str, frames: tuple[int, ...]) -> tuple[list[Camera], float]:
    return sample_cameras(_sample(root, sample_id), frames, MOVIE_SIZE)


@lru_cache(maxsize=2)
def _sample(root: Root, sample_id: str) -> Sample:
    return store.read_sample(root, sample_id)
