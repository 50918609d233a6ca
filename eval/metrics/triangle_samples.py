"""Samples of triangles for integrals: the centroids of equal parts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

MAX_SPLIT = 16


@dataclass(frozen=True)
class TriangleSamples:
    """points (S, 3), metres; weights (S, 3) barycentric in faces (S,); areas (S,) that they stand for,
    m^2."""

    points: NDArray[np.float64]
    weights: NDArray[np.float64]
    faces: NDArray[np.int64]
    areas: NDArray[np.float64]

    def where(self, kept: NDArray[np.bool_]) -> TriangleSamples:
        return TriangleSamples(self.points[kept], self.weights[kept], self.faces[kept], self.areas[kept])


def triangle_samples(
    vertices: np.ndarray, faces: np.ndarray, chosen: NDArray[np.int64], spacing: float, least: int = 1
) -> TriangleSamples:
    """Samples of the triangles faces[chosen], in the order of their number of parts.

    Each triangle is cut into n^2 congruent ones, n the smallest number from `least` to MAX_SPLIT that makes
    their sides no longer than `spacing`, metres; a sample stands at the centroid of each and for its area
    (the midpoint rule: exact for linear functions).

    vertices (V, 3), faces (F, 3).
    """
    corners = vertices[faces[chosen]]
    edges = np.roll(corners, -1, axis=1) - corners
    longest = np.sqrt(np.einsum("fki,fki->fk", edges, edges).max(axis=1, initial=0.0))
    split = np.clip(np.ceil(longest / spacing), least, MAX_SPLIT).astype(np.int64)
    areas = 0.5 * np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    parts = [_empty()]
    for n in np.unique(split):
        rows = np.flatnonzero(split == n)
        weights = centroid_weights(int(n))
        parts.append(
            TriangleSamples(
                points=np.einsum("sk,fki->fsi", weights, corners[rows]).reshape(-1, 3),
                weights=np.tile(weights, (len(rows), 1)),
                faces=np.repeat(chosen[rows], len(weights)),
                areas=np.repeat(areas[rows] / n**2, len(weights)),
            )
        )
    return TriangleSamples(
        np.concatenate([part.points for part in parts]),
        np.concatenate([part.weights for part in parts]),
        np.concatenate([part.faces for part in parts]),
        np.concatenate([part.areas for part in parts]),
    )


def centroid_weights(n: int) -> NDArray[np.float64]:
    """(n^2, 3) barycentric coordinates of the centroids of the n^2 equal parts of a triangle."""
    i, j = np.divmod(np.arange(n * n), n)
    i, j = i.astype(float), j.astype(float)
    upright = i + j < n
    # The other half of the square of cells (i, j) folds onto the parts that stand on their tips.
    u = np.where(upright, i + 1 / 3, n - i - 1 / 3) / n
    v = np.where(upright, j + 1 / 3, n - j - 1 / 3) / n
    return np.stack([1.0 - u - v, u, v], axis=1)


def _empty() -> TriangleSamples:
    return TriangleSamples(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0, np.int64), np.zeros(0))
