"""Winding numbers of a closed body at points, and at the vertices of a cloth that crosses it."""

from __future__ import annotations

import igl
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from muslin.eval.metrics.triangle_pairs import (
    UNSURE,
    TrianglePairs,
    may_pierce,
    segment_pierces,
    triangle_boxes,
)

FEW = 100
"""Up to so many points a ray from each is faster than building the tree of the fast winding number."""

SURE = 0.2
"""The fast winding number errs by less than 0.01; nearer than this to a half-integer it is not trusted."""


def winding_numbers(points: np.ndarray, vertices: np.ndarray, faces: np.ndarray) -> NDArray[np.int64]:
    """(N,) how often a closed surface winds around each point: 0 outside, 1 inside, 2 where it overlaps
    itself.

        w(p) = 1 / 4 pi sum of the signed solid angles of the faces seen from p

    An integer off the surface; on it the fraction is cut off. points (N, 3), vertices (M, 3), faces (F, 3).

    A few points by the faces that a ray from each crosses, many by the hierarchy of Barill et al. 2018; what
    either leaves in doubt, by the sum itself (Jacobson, Kavan and Sorkine-Hornung 2013).
    """
    p = np.ascontiguousarray(points, dtype=np.float64)
    v, f = np.ascontiguousarray(vertices, dtype=np.float64), np.ascontiguousarray(faces, dtype=np.int64)
    if len(p) > FEW:
        fast = igl.fast_winding_number(v, f, p)
        values = np.round(fast)
        doubtful = np.flatnonzero(abs(fast - values) > 0.5 - SURE)
    else:
        values = _by_rays(p, v[f])
        doubtful = np.flatnonzero(np.isnan(values))
    for k in doubtful:
        values[k] = _solid_angle(p[k], v, f) / (4.0 * np.pi)
    return np.floor(values + 1e-6).astype(np.int64)


def _by_rays(points: np.ndarray, triangles: np.ndarray) -> NDArray[np.float64]:
    """(N,) faces that a ray along +y leaves through, less those it enters through; NaN where one is too close
    to call (the ray meets an edge, or the point lies on the surface)."""
    low, high = triangle_boxes(triangles)
    top = float(high[:, 1].max()) + 1.0
    result = np.empty(len(points))
    for k, p in enumerate(points):
        near = (low[:, 0] <= p[0]) & (high[:, 0] >= p[0]) & (low[:, 2] <= p[2]) & (high[:, 2] >= p[2])
        near &= high[:, 1] >= p[1]
        met = triangles[near]
        ray = np.broadcast_to([p, [p[0], max(top, p[1]), p[2]]], (len(met), 2, 3))
        pierced = segment_pierces(ray, met)
        result[k] = np.nan if (pierced == UNSURE).any() else pierced.sum()
    return result


def _solid_angle(point: np.ndarray, vertices: np.ndarray, faces: np.ndarray) -> float:
    """Sum over the faces of 2 atan2(a . (b x c), |a||b||c| + (a . b)|c| + (b . c)|a| + (c . a)|b|), corners
    a, b, c as seen from the point (van Oosterom and Strackee 1983)."""
    seen = vertices - point
    length = np.sqrt((seen**2).sum(axis=1))
    (a, b, c), (la, lb, lc) = (seen[faces[:, k]].T for k in range(3)), length[faces].T
    volume = (
        a[0] * (b[1] * c[2] - b[2] * c[1])
        + a[1] * (b[2] * c[0] - b[0] * c[2])
        + a[2] * (b[0] * c[1] - b[1] * c[0])
    )
    below = la * lb * lc + (a * b).sum(axis=0) * lc + (b * c).sum(axis=0) * la + (c * a).sum(axis=0) * lb
    return float(2.0 * np.arctan2(volume, below).sum())


def cloth_winding_numbers(
    cloth: np.ndarray, cloth_faces: np.ndarray, body: np.ndarray, body_faces: np.ndarray, pairs: TrianglePairs
) -> NDArray[np.int64]:
    """(V,) winding number of a closed body at each vertex of a cloth, given the pairs that intersect.

    It changes only where a path crosses the body. So all vertices that are joined by edges of the cloth that
    surely miss the body share one number, and it is computed once for each such part of the cloth: for cloth
    that nowhere crosses the body, once for each connected piece.

    cloth (V, 3), cloth_faces (F, 3), body (M, 3), body_faces (N, 3).
    """
    sides = np.stack([cloth_faces, np.roll(cloth_faces, -1, axis=1)], axis=2).astype(np.int64)
    crossed = np.zeros((len(cloth_faces), 3), dtype=bool)
    i, j = pairs.faces.T
    pierced, edge = np.nonzero(may_pierce(cloth[cloth_faces[i]], body[body_faces[j]]))
    crossed[i[pierced], edge] = True
    keys = np.sort(sides, axis=2) @ np.array([len(cloth), 1])
    free = sides[~np.isin(keys, keys[crossed])]
    graph = coo_array((np.ones(len(free), np.int8), (free[:, 0], free[:, 1])), shape=(len(cloth), len(cloth)))
    count, part = connected_components(graph, directed=False)
    member = np.zeros(count, dtype=np.int64)
    member[part] = np.arange(len(cloth))
    return winding_numbers(cloth[member], body, body_faces)[part]
