"""Polygons of formats that allow more than triangles."""

from __future__ import annotations

import numpy as np

from muslin.garments.errors import InputError


def fans(counts: np.ndarray, corners: np.ndarray, name: str, flip: bool = False) -> np.ndarray:
    """(F, 3) triangles (c_0, c_k, c_k+1) of polygons with corners c_0 … c_n-1.

    counts    (P,) corners of each polygon, 3 or more
    corners   (sum of counts,) vertex indices, polygon after polygon
    flip      whether the file lists corners clockwise seen from outside

    Raises InputError if the two do not fit.
    """
    counts, corners = np.asarray(counts, dtype=np.int64), np.asarray(corners, dtype=np.int64)
    if len(counts) and (counts.min() < 3 or counts.sum() != len(corners)):
        raise InputError(
            f"{name}: polygons of {counts.min()} corners or more, {counts.sum()} in all, but {len(corners)} "
            "corners are listed; each polygon needs 3 or more"
        )
    starts = np.cumsum(counts) - counts
    triangles = counts - 2
    polygon = np.repeat(np.arange(len(counts)), triangles)
    k = np.arange(triangles.sum()) - np.repeat(np.cumsum(triangles) - triangles, triangles)
    first = starts[polygon]
    faces = np.stack([corners[first], corners[first + k + 1], corners[first + k + 2]], axis=1)
    return faces[:, [0, 2, 1]] if flip else faces
