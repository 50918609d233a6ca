"""The segments in which triangles intersect: length of the contour along which two surfaces cross."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from muslin.eval.metrics.triangle_pairs import TrianglePairs, heights


@dataclass(frozen=True)
class Segments:
    """Intersections of triangles a with triangles b, one segment a pair; (K, ...).

    ends      (K, 2, 3) from start to end, metres; b's back (the side its normal points away from) is on the
              left, seen with a's normal pointing at the eye
    by_a      (K, 2) whether that end lies on an edge of a (else the segment leaves b there)
    edge      (K, 2) which edge of a it is, from corner `edge` to `edge + 1`
    length    (K,) metres; 0 of a pair that only touches, or that overlaps in a plane
    """

    ends: NDArray[np.float64]
    by_a: NDArray[np.bool_]
    edge: NDArray[np.int64]
    length: NDArray[np.float64]


def contour_length(
    pairs: TrianglePairs,
    vertices_a: np.ndarray,
    faces_a: np.ndarray,
    vertices_b: np.ndarray,
    faces_b: np.ndarray,
) -> float:
    """L = sum over intersecting pairs of triangles of the length of their common segment; metres.

    The length of the curve in which the surfaces cross: it does not depend on how either is cut into
    triangles. Coplanar pairs overlap in an area and add nothing (`TrianglePairs.coplanar` counts them).
    Where a surface touches another one along edges without crossing it, the length is 0 on one side of it and
    doubled on the other: there is no curve of crossing then.
    """
    crossing = pairs.faces[~pairs.coplanar]
    a, b = vertices_a[faces_a[crossing[:, 0]]], vertices_b[faces_b[crossing[:, 1]]]
    return float(segments(a.astype(np.float64), b.astype(np.float64)).length.sum())


def segments(a: NDArray[np.float64], b: NDArray[np.float64]) -> Segments:
    """The common segment of each pair of triangles a, b (K, 3 corners, 3) that intersect.

    The plane of b cuts a in a segment and the plane of a cuts b in one; both lie on the planes' common line,
    and the triangles' intersection is what they have in common (Moller 1997). A corner in the other plane
    counts as above it, so that a contour along an edge belongs to one of the two triangles there, not to
    both.
    """
    on_a, edge = _cut(a, heights(a, b)[0])
    on_b, _ = _cut(b, heights(b, a)[0])
    along_a, along_b = on_a[:, 1] - on_a[:, 0], on_b[:, 1] - on_b[:, 0]
    size_a, size_b = np.linalg.norm(along_a, axis=1), np.linalg.norm(along_b, axis=1)
    # Either segment gives the line's direction, the longer one with less rounding.
    sense = np.where(np.einsum("ki,ki->k", along_a, along_b) < 0.0, -1.0, 1.0)[:, None]
    direction = np.where((size_a >= size_b)[:, None], along_a, sense * along_b)
    direction /= np.maximum(np.maximum(size_a, size_b), np.finfo(float).tiny)[:, None]
    at_a = np.einsum("ksi,ki->ks", on_a - on_a[:, :1], direction)
    at_b = np.sort(np.einsum("ksi,ki->ks", on_b - on_a[:, :1], direction), axis=1)
    start, end = np.maximum(at_a[:, 0], at_b[:, 0]), np.minimum(at_a[:, 1], at_b[:, 1])
    length = np.where(_straddles(a, b), np.maximum(end - start, 0.0), 0.0)
    ends = on_a[:, :1] + np.stack([start, start + length], axis=1)[:, :, None] * direction[:, None]
    by_a = np.stack([at_a[:, 0] >= at_b[:, 0], at_a[:, 1] <= at_b[:, 1]], axis=1)
    return Segments(ends, by_a, edge, length)


def _straddles(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(K,) whether either triangle has corners on both sides of the other's plane; in it counts as above."""
    result = np.ones(len(a), dtype=bool)
    for first, second in ((a, b), (b, a)):
        below = heights(first, second)[0] < 0.0
        result &= below.any(axis=1) & ~below.all(axis=1)
    return result


def _cut(triangles: NDArray[np.float64], height: NDArray[np.float64]) -> tuple[np.ndarray, np.ndarray]:
    """Where the plane at height 0 cuts each triangle: two points (K, 2, 3) on the edges (K, 2).

    Going from the first to the second, what is below lies on the left.
    """
    below = height < 0.0
    lone = np.where(below.sum(axis=1) == 1, below.argmax(axis=1), (~below).argmax(axis=1))
    rows = np.arange(len(triangles))
    points, edges = [], []
    for other in ((lone + 1) % 3, (lone + 2) % 3):
        rise = height[rows, other] - height[rows, lone]
        share = np.clip(-height[rows, lone] / np.where(rise == 0.0, 1.0, rise), 0.0, 1.0)[:, None]
        points.append((1.0 - share) * triangles[rows, lone] + share * triangles[rows, other])
        edges.append(np.where(other == (lone + 1) % 3, lone, other))
    lone_below = below[rows, lone]
    ends, edge = np.stack(points, axis=1), np.stack(edges, axis=1)
    return (
        np.where(lone_below[:, None, None], ends, ends[:, ::-1]),
        np.where(lone_below[:, None], edge, edge[:, ::-1]),
    )
