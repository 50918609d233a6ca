"""Where samples go that are to be made again: nothing is deleted."""

from __future__ import annotations

from itertools import count

from muslin.sim.dataset import store
from muslin.sim.dataset.root import Root
from muslin.sim.dataset.schema import FAILED, SUFFIX


def set_aside(root: Root, sample_id: str) -> str | None:
    """Move the file of a sample to `failed/ID.zarr.zip-N`, N the first number that is free.

    Returns the new place, or None if nothing lay there. The caller holds the lock of the dataset.
    """
    name = store.sample_name(sample_id)
    if not root.exists(name):
        return None
    taken = set(root.names(FAILED))
    free = next(place for n in count(1) if (place := f"{sample_id}{SUFFIX}-{n}") not in taken)
    root.move(name, f"{FAILED}/{free}")
    return root.place(f"{FAILED}/{free}")
