"""One picture of a dataset: samples from all over it, side by side."""

from __future__ import annotations

import io
from collections.abc import Callable

import numpy as np
from PIL import Image

from muslin.sim.dataset.processes import in_processes, usable_cores
from muslin.sim.dataset.reader import Dataset
from muslin.sim.dataset.root import Root
from muslin.sim.dataset.store import read_sample
from muslin.sim.view.picture import AZIMUTH, picture
from muslin.sim.view.sheet import contact_sheet

SIZE = (240, 320)
"""Pixels of one sample, (width, height)."""
MOST = 24
COLUMNS = 6

_Shot = tuple[Root, str, int, float]


def overview(
    dataset: Dataset,
    azimuth: float = AZIMUTH,
    workers: int | None = None,
    progress: Callable[[float, int, str], None] | None = None,
) -> bytes:
    """PNG of at most `MOST` samples, evenly spread over the dataset; of a sequence the frame in its middle.

    azimuth   of the camera around the vertical, radians
    Raises InputError for a damaged sample, and if there is none.
    """
    count = min(MOST, len(dataset))
    chosen = [dataset.rows[round(k * (len(dataset) - 1) / max(1, count - 1))] for k in range(count)]
    shots = [(dataset.root, row["id"], row["frames"] // 2, azimuth) for row in chosen]
    pictures = []
    # A process takes seconds to start, a picture takes one.
    processes = min(workers or usable_cores(), max(1, count // 4))
    for done, image in enumerate(in_processes(_draw, shots, processes), start=1):
        pictures.append(image)
        if progress is not None:
            progress(done, count, chosen[done - 1]["id"])
    captions = [" ".join(filter(None, (row["design"], row["shape"], row["sequence"]))) for row in chosen]
    stream = io.BytesIO()
    Image.fromarray(contact_sheet(pictures, COLUMNS, captions)).save(stream, "PNG")
    return stream.getvalue()


def _draw(shot: _Shot) -> np.ndarray:
    root, sample_id, frame, azimuth = shot
    return picture(read_sample(root, sample_id), frame, SIZE, azimuth)
