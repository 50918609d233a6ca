"""Point location in planar triangulations."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

_CANDIDATES = 16


def locate(
    points: NDArray[np.float64], faces: NDArray[np.int32], queries: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Triangle (Q,) and barycentric coordinates (Q, 3) of each query point (Q, 2).

    points: (N, 2), faces: (F, 3), counter-clockwise. A query outside the triangulation gets the triangle in
    which its least barycentric coordinate is greatest, and extrapolating (negative) coordinates.
    """
    corners = points[faces]
    face = np.zeros(len(queries), dtype=np.int64)
    weights = np.full((len(queries), 3), -np.inf)
    if len(queries) == 0:
        return face, weights
    count = min(_CANDIDATES, len(faces))
    _, nearest = cKDTree(corners.mean(axis=1)).query(queries, k=count)
    candidates = nearest.reshape(len(queries), count)
    face, weights = _best(corners, candidates, queries)
    outside = np.flatnonzero(weights.min(axis=1) < 0.0)
    everything = np.arange(len(faces))
    for start in range(0, len(outside), 64):
        chunk = outside[start : start + 64]
        face[chunk], weights[chunk] = _best(
            corners, np.broadcast_to(everything, (len(chunk), len(faces))), queries[chunk]
        )
    return face, weights


def barycentric(corners: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.float64]:
    """(..., 3) barycentric coordinates of points (..., 2) in triangles (..., 3, 2); negative ones outside."""
    a, b, c = (corners[..., k, :] for k in range(3))
    u, v, w = b - a, c - a, points - a
    area = u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]
    second = (w[..., 0] * v[..., 1] - w[..., 1] * v[..., 0]) / area
    third = (u[..., 0] * w[..., 1] - u[..., 1] * w[..., 0]) / area
    return np.stack([1.0 - second - third, second, third], axis=-1)


def _best(
    corners: NDArray[np.float64], candidates: NDArray[np.int64], queries: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    weights = barycentric(corners[candidates], queries[:, None])
    best = weights.min(axis=-1).argmax(axis=1)
    rows = np.arange(len(queries))
    return candidates[rows, best], weights[rows, best]
