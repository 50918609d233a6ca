"""Exactly which triangles of two meshes, or of one, intersect."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from muslin.eval.metrics.box_pairs import box_tree, overlapping, overlapping_within
from muslin.eval.metrics.rational_triangles import APART, COPLANAR, triangles_meet

ROUNDING = 16.0 * 2.0**-53
"""Bound of the relative rounding error of a 3 x 3 determinant of differences, of its permanent (Shewchuk 1997
has 7 half-units in the last place for one order of operations; twice that and the bound's own rounding)."""

NEXT = np.array([1, 2, 0])
UNSURE = 2

AT_A_TIME = 250_000
"""Pairs decided together: some 500 bytes each."""


@dataclass(frozen=True)
class TrianglePairs:
    """Triangles that have a common point.

    faces      (K, 2) indices of the first and the second mesh's triangle
    coplanar   (K,) whether both lie in one plane: such a pair overlaps in an area, not along a segment
    """

    faces: NDArray[np.int64]
    coplanar: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.faces)


def intersecting_triangles(
    vertices_a: np.ndarray, faces_a: np.ndarray, vertices_b: np.ndarray, faces_b: np.ndarray
) -> TrianglePairs:
    """All pairs of a triangle of A and a triangle of B with a common point; touching ones have one.

    Exact for the given float64 coordinates: pairs are parted by separating axes or joined by orientation
    predicates where these are beyond their rounding error, and decided in whole numbers else.
    Two triangles of no area never pair with one another.

    vertices (V, 3), faces (F, 3). Source: the filtered predicates of Shewchuk 1997; separating axes as
    Gottschalk, Lin and Manocha 1996.
    """
    a, b = _corners(vertices_a, faces_a), _corners(vertices_b, faces_b)
    if not len(a) or not len(b):
        return _exactly(a, b, np.zeros((0, 2), dtype=np.int64))
    boxes_a, boxes_b = triangle_boxes(a), triangle_boxes(b)
    of_a, of_b = _near(boxes_a, boxes_b), _near(boxes_b, boxes_a)
    if not len(of_a) or not len(of_b):
        return _exactly(a, b, np.zeros((0, 2), dtype=np.int64))
    trees = [box_tree(low[near], high[near]) for (low, high), near in ((boxes_a, of_a), (boxes_b, of_b))]
    pairs = overlapping(*trees)
    return _exactly(a, b, np.stack([of_a[pairs[:, 0]], of_b[pairs[:, 1]]], axis=1))


def self_intersecting_triangles(vertices: np.ndarray, faces: np.ndarray) -> TrianglePairs:
    """All pairs i < j of triangles of one mesh with a common point, and no common vertex.

    Pairs that share a vertex meet there in any case and are left out, by index and by position: vertices with
    the very same coordinates, as along seams that a file keeps apart, count as one. So a fold so sharp that a
    triangle crosses another one at its own vertex is not seen, but the next ring of triangles of it is.

    Exact as `intersecting_triangles`. vertices (V, 3), faces (F, 3).
    """
    corners = _corners(vertices, faces)
    if len(corners) < 2:
        return _exactly(corners, corners, np.zeros((0, 2), dtype=np.int64))
    pairs = overlapping_within(box_tree(*triangle_boxes(corners)))
    ids = _same_positions(np.asarray(vertices, dtype=np.float64))[np.asarray(faces)]
    i, j = ids[pairs[:, 0]], ids[pairs[:, 1]]
    shared = np.zeros(len(pairs), dtype=bool)
    for k in range(3):
        for m in range(3):
            shared |= i[:, k] == j[:, m]
    return _exactly(corners, corners, pairs[~shared])


def may_pierce(a: np.ndarray, b: np.ndarray) -> NDArray[np.bool_]:
    """(K, 3) False only where the edge from corner i to i + 1 of triangle a certainly misses triangle b.

    a, b (K, 3 corners, 3).
    """
    return _pierces(a, b, _signs(a, b)) != 0


def segment_pierces(segments: np.ndarray, triangles: np.ndarray) -> NDArray[np.int8]:
    """(K,) 1 where a segment surely passes through a triangle the way its normal points, -1 the other way,
    0 where it surely misses it, UNSURE where rounding leaves that open.

    segments (K, 2 ends, 3), triangles (K, 3 corners, 3). It passes if its ends are on both sides of the plane
    and it turns, as a line, the same way around all three sides.
    """
    above = _signs(segments, triangles)
    return _passes(segments[:, 0], segments[:, 1], triangles, above[:, 0], above[:, 1])


def triangle_boxes(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Smallest and largest corner of the box of each triangle; (K, 3) each."""
    x, y, z = corners[:, 0], corners[:, 1], corners[:, 2]
    return np.minimum(np.minimum(x, y), z), np.maximum(np.maximum(x, y), z)


def heights(a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """n . (a_i - b_0) of the corners i of a, n = (b_1 - b_0) x (b_2 - b_0), and bounds of their error; (K,
    3).

    Component by component, so that a corner and a plane give the same number in whatever pair they occur.
    """
    u, v = (b[:, 1] - b[:, 0]).T, (b[:, 2] - b[:, 0]).T
    p = (u[1] * v[2], u[2] * v[0], u[0] * v[1])
    q = (u[2] * v[1], u[0] * v[2], u[1] * v[0])
    n, size = [p[k] - q[k] for k in range(3)], [abs(p[k]) + abs(q[k]) for k in range(3)]
    value, bound = np.empty((len(a), a.shape[1])), np.empty((len(a), a.shape[1]))
    for corner in range(a.shape[1]):
        d = (a[:, corner] - b[:, 0]).T
        value[:, corner] = n[0] * d[0] + n[1] * d[1] + n[2] * d[2]
        bound[:, corner] = size[0] * abs(d[0]) + size[1] * abs(d[1]) + size[2] * abs(d[2])
    return value, ROUNDING * bound


def _corners(vertices: np.ndarray, faces: np.ndarray) -> NDArray[np.float64]:
    return np.asarray(vertices, dtype=np.float64)[np.asarray(faces).reshape(-1, 3)]


def _near(boxes: tuple[np.ndarray, np.ndarray], others: tuple[np.ndarray, np.ndarray]) -> NDArray[np.int64]:
    """The boxes that meet the box around all the others."""
    meets = np.ones(len(boxes[0]), dtype=bool)
    for axis in range(3):
        low, high = others[0][:, axis].min(), others[1][:, axis].max()
        meets &= (boxes[0][:, axis] <= high) & (boxes[1][:, axis] >= low)
    return np.flatnonzero(meets)


def _same_positions(vertices: np.ndarray) -> NDArray[np.int64]:
    """(V,) a number for each distinct position."""
    order = np.lexsort(vertices.T)
    new = np.concatenate([[False], (np.diff(vertices[order], axis=0) != 0.0).any(axis=1)])
    ids = np.empty(len(vertices), dtype=np.int64)
    ids[order] = np.cumsum(new)
    return ids


def _exactly(a: np.ndarray, b: np.ndarray, pairs: NDArray[np.int64]) -> TrianglePairs:
    """Those of the pairs (K, 2) of triangles a[i], b[j] that intersect; a part of them at a time."""
    parts = [_part_exactly(a, b, pairs[at : at + AT_A_TIME]) for at in range(0, len(pairs) or 1, AT_A_TIME)]
    return TrianglePairs(
        np.concatenate([part.faces for part in parts]), np.concatenate([part.coplanar for part in parts])
    )


def _part_exactly(a: np.ndarray, b: np.ndarray, pairs: NDArray[np.int64]) -> TrianglePairs:
    above = _signs(a[pairs[:, 0]], b[pairs[:, 1]])
    open_ = abs(above.sum(axis=1)) < 3
    pairs, above = pairs[open_], above[open_]
    beyond = _signs(b[pairs[:, 1]], a[pairs[:, 0]])
    open_ = abs(beyond.sum(axis=1)) < 3
    pairs, above, beyond = pairs[open_], above[open_], beyond[open_]
    first, second = a[pairs[:, 0]], b[pairs[:, 1]]
    pierces = np.concatenate([_pierces(first, second, above), _pierces(second, first, beyond)], axis=1)
    meet = (abs(pierces) == 1).any(axis=1)
    unsure = np.flatnonzero(~meet & (pierces == UNSURE).any(axis=1))
    unsure = unsure[~_separated(first[unsure], second[unsure])]
    coplanar = np.zeros(len(pairs), dtype=bool)
    for k in unsure:
        found = triangles_meet(first[k].tolist(), second[k].tolist())
        meet[k], coplanar[k] = found != APART, found == COPLANAR
    return TrianglePairs(pairs[meet], coplanar[meet])


def _signs(a: np.ndarray, b: np.ndarray) -> NDArray[np.int8]:
    """(K, 3) sign of `heights`, 0 where rounding leaves it open."""
    value, bound = heights(a, b)
    return np.where(abs(value) > bound, np.sign(value), 0.0).astype(np.int8)


def _pierces(a: np.ndarray, b: np.ndarray, above: NDArray[np.int8]) -> NDArray[np.int8]:
    """(K, 3) `segment_pierces` of the edges i, i + 1 of a with b; above (K, 3): `_signs` of a's corners over
    b."""
    return np.stack(
        [_passes(a[:, i], a[:, NEXT[i]], b, above[:, i], above[:, NEXT[i]]) for i in range(3)], axis=1
    )


def _passes(
    p: np.ndarray, q: np.ndarray, triangles: np.ndarray, above_p: NDArray[np.int8], above_q: NDArray[np.int8]
) -> NDArray[np.int8]:
    """`segment_pierces` of the segments p q, given on which side of the plane their ends are."""
    outcome = np.zeros(len(p), dtype=np.int8)
    rows = np.flatnonzero(above_p * above_q <= 0)
    start, end, target = p[rows], q[rows, None], triangles[rows]
    turns = np.concatenate(
        [_signs(end, np.stack([start, target[:, k], target[:, NEXT[k]]], axis=1)) for k in range(3)], axis=1
    )
    missed = (turns.max(axis=1, initial=-1) == 1) & (turns.min(axis=1, initial=1) == -1)
    sure = (abs(turns.sum(axis=1)) == 3) & (above_p[rows] * above_q[rows] < 0)
    outcome[rows] = np.where(sure, above_q[rows], np.where(missed, 0, UNSURE))
    return outcome


def _separated(a: np.ndarray, b: np.ndarray) -> NDArray[np.bool_]:
    """(K,) whether a plane surely parts the triangles: one along an edge of each, or across one's plane."""
    x, y = a - a[:, :1], b - a[:, :1]
    edges_a, edges_b = x[:, NEXT] - x, y[:, NEXT] - y
    normal_a, normal_b = np.cross(edges_a[:, 0], edges_a[:, 1]), np.cross(edges_b[:, 0], edges_b[:, 1])
    axes = [np.cross(normal_a, edges_a[:, k]) for k in range(3)]
    axes += [np.cross(normal_b, edges_b[:, k]) for k in range(3)]
    axes += [np.cross(edges_a[:, k], edges_b[:, m]) for k in range(3) for m in range(3)]
    parted = np.zeros(len(a), dtype=bool)
    extent = np.maximum(abs(x).max(axis=(1, 2)), abs(y).max(axis=(1, 2)))
    for axis in axes:
        # Any vector parts them if the projections on it do, so only those have rounding errors.
        on_a, on_b = np.einsum("kij,kj->ki", x, axis), np.einsum("kij,kj->ki", y, axis)
        margin = ROUNDING * abs(axis).sum(axis=1) * extent
        parted |= on_a.min(axis=1) > on_b.max(axis=1) + margin
        parted |= on_b.min(axis=1) > on_a.max(axis=1) + margin
    return parted
