"""The Hausdorff distance of two surfaces, with certified bounds."""

from __future__ import annotations

from dataclasses import dataclass

import igl
import numpy as np

from muslin.garments.errors import InputError

RELATIVE_TOLERANCE = 0.01
ABSOLUTE_TOLERANCE = 1e-5  # metres
MAX_TRIANGLES = 1_000_000


@dataclass(frozen=True)
class HausdorffBounds:
    """lower <= H <= upper, metres. `lower` is the distance of a point that was really found.

    upper - lower is at most the tolerance asked for, unless the limit on triangles was hit first; the bounds
    hold either way.
    """

    lower: float
    upper: float


def hausdorff(
    vertices_a: np.ndarray,
    faces_a: np.ndarray,
    vertices_b: np.ndarray,
    faces_b: np.ndarray,
    relative: float = RELATIVE_TOLERANCE,
    absolute: float = ABSOLUTE_TOLERANCE,
) -> HausdorffBounds:
    """H(A, B) = max(h(A, B), h(B, A)), h(A, B) = max_{a in A} min_{b in B} |a - b|, over all surface points.

    vertices (V, 3), metres; faces (F, 3). The interval is no wider than max(absolute, relative x lower).

    Distances at vertices alone miss maxima inside triangles: of the quad z = (0, 0.2, 0, 0.2) split along
    opposite diagonals they see 0 where H is 0.19245.
    """
    ab = one_sided_hausdorff(vertices_a, faces_a, vertices_b, faces_b, relative, absolute)
    ba = one_sided_hausdorff(vertices_b, faces_b, vertices_a, faces_a, relative, absolute, ab.lower)
    return HausdorffBounds(max(ab.lower, ba.lower), max(ab.upper, ba.upper))


def one_sided_hausdorff(
    vertices_a: np.ndarray,
    faces_a: np.ndarray,
    vertices_b: np.ndarray,
    faces_b: np.ndarray,
    relative: float = RELATIVE_TOLERANCE,
    absolute: float = ABSOLUTE_TOLERANCE,
    known_lower: float = 0.0,
) -> HausdorffBounds:
    """Bounds of h(A, B) by branch and bound over the triangles of A.

    For a triangle t of A with corners p_j and centre c, whose nearest triangles in B are T_i:

        lower(t) = max_j d(p_j, B)
        upper(t) = min( min_i max_j d(p_j, T_i),  d(c, B) + max_j |p_j - c| )

    The first upper bound holds because the distance to one (convex) triangle is a convex function, so its
    largest value over t is at a corner; the second because d(., B) is 1-Lipschitz.
    Triangles whose upper bound exceeds the best lower bound by no more than the tolerance are dropped, the
    others split in four.

    `known_lower` is a distance below which nothing is of interest (the other side's, in a two-sided search);
    the bounds then hold for max(h(A, B), known_lower).

    Source: the bounds of Tang, Lee and Kim 2009 ("Interactive Hausdorff distance computation for general
    polygonal models"), with midpoint subdivision.
    """
    tree, target_v, target_f = _tree(vertices_b, faces_b)
    corners = np.ascontiguousarray(vertices_a, dtype=np.float64)[faces_a]
    if len(corners) == 0:
        raise InputError("Hausdorff distance: a mesh has no faces; give two meshes with triangles")
    distance, nearest = _query(tree, target_v, target_f, corners.reshape(-1, 3))
    distance, nearest = distance.reshape(-1, 3), nearest.reshape(-1, 3)
    lower, dropped, examined = known_lower, known_lower, 0
    while True:
        lower = max(lower, float(distance.max()))
        tolerance = max(absolute, relative * lower)
        upper = _convex_bound(corners, target_v[target_f], nearest)
        open_ = np.flatnonzero(upper > lower + tolerance)
        if len(open_):
            centre = corners[open_].mean(axis=1)
            at_centre, below_centre = _query(tree, target_v, target_f, centre)
            reach = np.linalg.norm(corners[open_] - centre[:, None], axis=-1).max(axis=1)
            convex = _convex_bound(corners[open_], target_v[target_f], below_centre[:, None])
            upper[open_] = np.minimum(upper[open_], np.minimum(convex, at_centre + reach))
            lower = max(lower, float(at_centre.max()))
            tolerance = max(absolute, relative * lower)
        split = upper > lower + tolerance
        dropped = max(dropped, float(upper[~split].max(initial=0.0)))
        examined += len(corners)
        if not split.any():
            return HausdorffBounds(lower, max(lower, dropped))
        if examined + 4 * int(split.sum()) > MAX_TRIANGLES:
            return HausdorffBounds(lower, max(lower, float(upper.max()), dropped))
        corners, distance, nearest = _split(
            corners[split], distance[split], nearest[split], (tree, target_v, target_f)
        )


def point_triangle_distance(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Exact distance of points (..., 3) to triangles (..., 3 corners, 3); (...), the unit of the input.

    The smallest distance to the three edges, or the distance to the plane where the foot of the
    perpendicular is inside the triangle.
    """
    a, b, c = triangles[..., 0, :], triangles[..., 1, :], triangles[..., 2, :]
    normal = np.cross(b - a, c - a)
    square = np.einsum("...i,...i", normal, normal)
    edges = np.stack([_segment_squared(points, s, e) for s, e in ((a, b), (b, c), (c, a))])
    squared = edges.min(axis=0)
    sides = [np.einsum("...i,...i", np.cross(e - s, points - s), normal) for s, e in ((a, b), (b, c), (c, a))]
    inside = (sides[0] >= 0) & (sides[1] >= 0) & (sides[2] >= 0) & (square > 0)
    height = np.einsum("...i,...i", points - a, normal) ** 2 / np.where(square > 0, square, 1.0)
    return np.sqrt(np.where(inside, np.minimum(height, squared), squared))


def _segment_squared(points: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    along = end - start
    length = np.einsum("...i,...i", along, along)
    t = np.einsum("...i,...i", points - start, along) / np.where(length > 0, length, 1.0)
    offset = points - start - np.clip(t, 0.0, 1.0)[..., None] * along
    return np.einsum("...i,...i", offset, offset)


def _convex_bound(corners: np.ndarray, targets: np.ndarray, nearest: np.ndarray) -> np.ndarray:
    """min_i max_j d(p_j, T_i); (N,). nearest (N, k): the triangles T_i."""
    bounds = []
    for i in range(nearest.shape[1]):
        triangles = targets[nearest[:, i]]
        bounds.append(np.max([point_triangle_distance(corners[:, j], triangles) for j in range(3)], axis=0))
    return np.min(bounds, axis=0)


def _tree(vertices: np.ndarray, faces: np.ndarray) -> tuple[igl.AABB, np.ndarray, np.ndarray]:
    v = np.ascontiguousarray(vertices, dtype=np.float64)
    f = np.ascontiguousarray(faces, dtype=np.int64)
    tree = igl.AABB()
    tree.init(v, f)
    return tree, v, f


def _query(
    tree: igl.AABB, vertices: np.ndarray, faces: np.ndarray, points: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    squared, nearest, _ = tree.squared_distance(vertices, faces, np.ascontiguousarray(points))
    return np.sqrt(np.maximum(squared, 0.0)), nearest


def _split(
    corners: np.ndarray,
    distance: np.ndarray,
    nearest: np.ndarray,
    target: tuple[igl.AABB, np.ndarray, np.ndarray],
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Each triangle in four by its edge midpoints; only the midpoints are new queries."""
    middles = 0.5 * (corners + np.roll(corners, -1, axis=1))
    d_middle, n_middle = _query(*target, middles.reshape(-1, 3))
    parts = []
    for old, middle in (
        (corners, middles),
        (distance, d_middle.reshape(-1, 3)),
        (nearest, n_middle.reshape(-1, 3)),
    ):
        o0, o1, o2 = old[:, 0], old[:, 1], old[:, 2]
        m0, m1, m2 = middle[:, 0], middle[:, 1], middle[:, 2]
        quarters = [(o0, m0, m2), (m0, o1, m1), (m2, m1, o2), (m0, m1, m2)]
        parts.append(np.concatenate([np.stack(quarter, axis=1) for quarter in quarters]))
    return parts[0], parts[1], parts[2]
