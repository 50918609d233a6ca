"""Half-edges of triangles: which is opposite which, and which lie on a boundary."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def half_edges(faces: NDArray[np.int32]) -> NDArray[np.int32]:
    """(3 F, 2) tail and head of the sides of faces (F, 3): all first sides, then all second, all third ones.

    Half-edge h belongs to face h % F.
    """
    return np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])


def opposite(tail: NDArray[np.integer], head: NDArray[np.integer], size: int) -> NDArray[np.int64]:
    """(N,) which of the half-edges from tail to head, vertices below `size`, runs the other way; -1 for none.

    Sorts numbers, not rows: many times faster.
    """
    if len(tail) == 0:
        return np.zeros(0, dtype=np.int64)
    key, back = tail.astype(np.int64) * size + head, head.astype(np.int64) * size + tail
    order = np.argsort(key, kind="stable")
    slot = np.minimum(np.searchsorted(key, back, sorter=order), len(order) - 1)
    return np.where(key[order[slot]] == back, order[slot], -1)


def on_boundary(faces: NDArray[np.int32]) -> NDArray[np.int64]:
    """Half-edges, rising, whose edge has one face, whichever way it runs."""
    half = half_edges(faces)
    key = half.min(axis=1).astype(np.int64) * (int(faces.max(initial=-1)) + 1) + half.max(axis=1)
    _, inverse, counts = np.unique(key, return_inverse=True, return_counts=True)
    return np.flatnonzero(counts[inverse] == 1)
