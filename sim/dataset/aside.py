"""Where samples go that are to be made again: nothing is deleted."""

from __future__ import annotations

import os
from itertools import count
from pathlib import Path

from muslin.sim.dataset import durable, store
from muslin.sim.dataset.schema import FAILED


def set_aside(root: Path, sample_id: str) -> Path | None:
    """Move what lies in the place of a sample to `failed/ID.zarr-N`, N the first number that is free.

    Returns the new place, or None if nothing lay there. The caller holds the lock of the dataset.
    """
    path = store.sample_path(root, sample_id)
    if not os.path.lexists(path):
        return None
    durable.make_folder(root / FAILED)
    places = (root / FAILED / f"{path.name}-{n}" for n in count(1))
    place = next(free for free in places if not os.path.lexists(free))
    durable.move(path, place)
    return place
