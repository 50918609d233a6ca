"""What contact metrics ask of a mesh."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from muslin.eval.metrics.checks import check_faces, checked_points
from muslin.garments.errors import InputError


def check_triangles(
    what: str, vertices: np.ndarray, faces: np.ndarray
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """The mesh as (V, 3) float64 and (F, 3) int64. Raises InputError unless it has a triangle, all its
    indices exist and all its coordinates are finite; `what` begins the message."""
    v, f = np.asarray(vertices), np.asarray(faces)
    if v.ndim != 2:
        raise InputError(f"{what}: points of shape {v.shape} are not allowed; give one frame, (V, 3)")
    points = checked_points(v, what)
    check_faces(f, len(v), what)
    if not np.issubdtype(f.dtype, np.integer):
        raise InputError(f"{what}: faces of type {f.dtype} are not allowed; give whole numbers")
    return points, f.astype(np.int64)
