"""The part of a cloth's surface that lies inside a closed body: exact where the body does not overlap
itself."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from muslin.eval.metrics.contours import segments
from muslin.eval.metrics.triangle_pairs import TrianglePairs

CLOSED = 1e-9
"""Rounding, relative to areas and lengths, of what lies in a triangle's plane."""


@dataclass(frozen=True)
class CrossedTriangles:
    """Triangles of a cloth that intersect a body, in a plane frame each, with the curves along which they do.

    faces      (C,) indices of the cloth's faces
    corners    (C, 3, 2) metres, counter-clockwise, in the triangle's own plane
    winding    (C, 3) the body's winding number at the corners
    coplanar   (C,) whether a triangle of the body lies in the same plane and meets it
    row        (S,) which of the triangles each segment belongs to
    ends       (S, 2, 2) the segments; on their left the winding number is one more than on their right
    by_edge    (S, 2) whether that end lies on the triangle's boundary, on the edge `edge` (S, 2)
    """

    faces: NDArray[np.int64]
    corners: NDArray[np.float64]
    winding: NDArray[np.int64]
    coplanar: NDArray[np.bool_]
    row: NDArray[np.int64]
    ends: NDArray[np.float64]
    by_edge: NDArray[np.bool_]
    edge: NDArray[np.int64]


def crossed_triangles(
    cloth: np.ndarray,
    cloth_faces: np.ndarray,
    body: np.ndarray,
    body_faces: np.ndarray,
    pairs: TrianglePairs,
    winding: NDArray[np.int64],
) -> CrossedTriangles:
    """The triangles of `pairs` (all pairs that intersect), given the winding number at each vertex (V,)."""
    faces, row = np.unique(pairs.faces[:, 0], return_inverse=True)
    coplanar = np.bincount(row[pairs.coplanar], minlength=len(faces)) > 0
    crossing = ~pairs.coplanar
    row = row[crossing]
    triangles = cloth[cloth_faces[faces]]
    found = segments(triangles[row], body[body_faces[pairs.faces[crossing, 1]]])
    some = found.length > 0.0
    row, ends = row[some], found.ends[some]
    origin = triangles[:, 0]
    u = triangles[:, 1] - origin
    normal = np.cross(u, triangles[:, 2] - origin)
    u /= np.maximum(np.linalg.norm(u, axis=1, keepdims=True), np.finfo(float).tiny)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), np.finfo(float).tiny)
    frame = np.stack([u, np.cross(normal, u)], axis=1)
    return CrossedTriangles(
        faces=faces,
        corners=np.einsum("cjx,ckx->cjk", triangles - origin[:, None], frame),
        winding=winding[cloth_faces[faces]],
        coplanar=coplanar,
        row=row,
        ends=np.einsum("sjx,skx->sjk", ends - origin[row][:, None], frame[row]),
        by_edge=found.by_a[some],
        edge=found.edge[some],
    )


def inside_areas(crossed: CrossedTriangles) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Area (C,) inside the body of each crossed triangle, m^2, and whether (C,) it is that.

    The winding number w is 0 or 1 on the triangle, so its integral is the area inside. By Green's theorem,
    with the jumps of w along the segments s and the jumps s_k where they meet the triangle's edges,

        integral w dA = 1/2 sum_edges (p x q) integral_0^1 w(t) dt + 1/2 sum_segments (a x b),
        integral_0^1 w(t) dt = w(p) + sum_k s_k (1 - t_k).

    False where that does not hold: where a face of the body lies in the plane, where it overlaps itself (w is
    not 0 or 1 at a corner, or the integral is not between 0 and the area), or where rounding lost or doubled
    a crossing, so that w(q) is not w(p) + sum_k s_k, or may have, at a corner. Such triangles are to be
    sampled.
    """
    count = len(crossed.faces)
    p = crossed.corners
    q = np.roll(p, -1, axis=1)
    a, b = crossed.ends[:, 0], crossed.ends[:, 1]
    total = np.bincount(crossed.row, weights=0.5 * _cross(a, b), minlength=count).astype(np.float64)
    jump, late, at_corner = np.zeros((count, 3)), np.zeros((count, 3)), np.zeros(count, dtype=bool)
    for end, step in ((0, -1.0), (1, 1.0)):
        # Below the plane of the body's face lies on the left: a boundary run counter-clockwise enters the
        # body where a segment ends and leaves it where one starts.
        on = crossed.by_edge[:, end]
        row, edge = crossed.row[on], crossed.edge[on, end]
        start, along = p[row, edge], q[row, edge] - p[row, edge]
        square = np.maximum(np.einsum("ki,ki->k", along, along), np.finfo(float).tiny)
        t = np.einsum("ki,ki->k", crossed.ends[on, end] - start, along) / square
        at_corner[row[(t < CLOSED) | (t > 1.0 - CLOSED)]] = True
        np.add.at(jump, (row, edge), step)
        np.add.at(late, (row, edge), step * (1.0 - t))
    total += (0.5 * _cross(p, q) * (crossed.winding + late)).sum(axis=1)
    area = 0.5 * _cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    simple = ((crossed.winding == 0) | (crossed.winding == 1)).all(axis=1)
    closed = (crossed.winding + jump == np.roll(crossed.winding, -1, axis=1)).all(axis=1)
    bounded = (total >= -CLOSED * area) & (total <= (1.0 + CLOSED) * area)
    return np.clip(total, 0.0, area), simple & closed & bounded & ~crossed.coplanar & ~at_corner


def winding_at(crossed: CrossedTriangles, row: NDArray[np.int64], points: np.ndarray) -> NDArray[np.int64]:
    """(N,) the winding number at points (N, 2) of crossed triangles `row` (N,).

    That of the first corner, and one more or less for each segment between the corner and the point.
    """
    order = np.argsort(crossed.row, kind="stable")
    first = np.searchsorted(crossed.row[order], row, side="left")
    number = np.searchsorted(crossed.row[order], row, side="right") - first
    point = np.repeat(np.arange(len(row)), number)
    within = np.arange(number.sum()) - np.repeat(np.cumsum(number) - number, number)
    a, b = crossed.ends[order[np.repeat(first, number) + within]].swapaxes(0, 1)
    start, end = crossed.corners[row[point], 0], points[point]
    # Half-open tests, so that a path through the common end of two segments crosses one of them.
    before, after = _cross(end - start, a - start) >= 0.0, _cross(end - start, b - start) >= 0.0
    from_left, to_left = _cross(b - a, start - a) > 0.0, _cross(b - a, end - a) > 0.0
    step = np.where((before != after) & (from_left != to_left), np.where(to_left, 1, -1), 0)
    return crossed.winding[row, 0] + np.bincount(point, weights=step, minlength=len(row)).astype(np.int64)


def _cross(a: np.ndarray, b: np.ndarray) -> NDArray[np.float64]:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
