"""How far points are inside a body: exact distances, with a sign."""

from __future__ import annotations

from dataclasses import dataclass

import igl
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from muslin.eval.metrics.triangle_pairs import triangle_boxes
from muslin.eval.metrics.winding import winding_numbers
from muslin.garments.errors import InputError

WINDING_NUMBER = "winding number"
PSEUDONORMAL = "pseudonormal"


@dataclass(frozen=True)
class Penetration:
    """Of all cloth vertices in all frames seen.

    ratio        share of vertices inside the body, 0 to 1
    depth_mean   mean depth of the vertices inside, metres; 0 if none is inside
    depth_max    largest depth, metres; 0 if none is inside
    """

    ratio: float
    depth_mean: float
    depth_max: float


@dataclass(frozen=True)
class BodyDistances:
    """values (N,), metres, negative inside; method: WINDING_NUMBER, or PSEUDONORMAL of a body that is not
    closed."""

    values: NDArray[np.float64]
    method: str


def is_closed(faces: np.ndarray) -> bool:
    """Whether every edge has exactly two triangles, in opposite directions: then inside is well defined."""
    directed = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).astype(np.int64)
    n = int(directed.max(initial=0)) + 1
    forward = np.sort(directed[:, 0] * n + directed[:, 1])
    backward = np.sort(directed[:, 1] * n + directed[:, 0])
    return len(faces) > 0 and bool((np.diff(forward) > 0).all()) and np.array_equal(forward, backward)


def distances_to_body(points: np.ndarray, vertices: np.ndarray, faces: np.ndarray) -> BodyDistances:
    """`signed_distances` of a closed body, `pseudonormal_distances` of any other; which of them is said."""
    if is_closed(faces):
        return BodyDistances(signed_distances(points, vertices, faces), WINDING_NUMBER)
    return BodyDistances(pseudonormal_distances(points, vertices, faces), PSEUDONORMAL)


def signed_distances(points: np.ndarray, vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Distance of each point to a closed surface, negative inside.

    s(p) = +-min_{x in surface} |p - x|, minus where the winding number is at least 1. A body that overlaps
    itself (armpit, crotch) has winding number 2 there, so such a point counts as inside and its depth is the
    distance to the nearest sheet, also to one that lies inside the body.

    points (N, 3), vertices (M, 3), metres; faces (F, 3), counter-clockwise from outside; returns (N,), m.
    Raises InputError if the surface has a boundary or a non-manifold edge.
    """
    if not is_closed(faces):
        raise InputError(
            "signed distance: the surface is not closed and oriented, so it has no inside; "
            "fill its holes, or leave the penetration out"
        )
    # igl.signed_distance scales the distance by 1 - 2 w with an approximate w: wrong by some 0.1%, so
    # only the sign is taken from the winding number here.
    inside = winding_numbers(points, vertices, faces) > 0
    return np.where(inside, -1.0, 1.0) * nearest_distances(points, vertices, faces)


def pseudonormal_distances(points: np.ndarray, vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Distance of each point to any surface, negative behind it: (p - c) . n < 0.

    c is the nearest point of the surface and n the normal of its triangle, on edges and corners the mean of
    the triangles' around by angle (Baerentzen and Aanaes 2005). On a closed surface that does not intersect
    itself the sign is the winding number's. On one with a hole a point may count as behind that is far in
    front of the hole's other side, and the more the farther it is from the surface.

    points (N, 3), vertices (M, 3), metres; faces (F, 3), counter-clockwise from outside; returns (N,), m.
    """
    if not len(points):
        return np.zeros(0)
    values, *_ = igl.signed_distance(
        np.ascontiguousarray(points, dtype=np.float64),
        np.ascontiguousarray(vertices, dtype=np.float64),
        np.ascontiguousarray(faces, dtype=np.int64),
        igl.SIGNED_DISTANCE_TYPE_PSEUDONORMAL,
    )
    return np.atleast_1d(values)


def nearest_distances(points: np.ndarray, vertices: np.ndarray, faces: np.ndarray) -> NDArray[np.float64]:
    """Exact distance of each point (N, 3) to the nearest point of a surface; (N,), metres.

    Only faces enter the search whose box comes as near to the box around the points as the farthest nearest
    vertex is: no other can be the nearest of any point.
    """
    if not len(points):
        return np.zeros(0)
    p = np.ascontiguousarray(points, dtype=np.float64)
    v = np.ascontiguousarray(vertices, dtype=np.float64)
    used = np.zeros(len(v), dtype=bool)
    used[faces] = True
    reach = float(cKDTree(v[used], balanced_tree=False, compact_nodes=False).query(p)[0].max()) * (1.0 + 1e-9)
    low, high = triangle_boxes(v[faces])
    near = np.ones(len(faces), dtype=bool)
    for axis in range(3):
        near &= low[:, axis] <= p[:, axis].max() + reach
        near &= high[:, axis] >= p[:, axis].min() - reach
    kept = np.ascontiguousarray(faces[near], dtype=np.int64)
    squared, _, _ = igl.point_mesh_squared_distance(p, v, kept)
    return np.sqrt(np.maximum(np.atleast_1d(squared), 0.0))


def penetration(distances: np.ndarray) -> Penetration:
    """Ratio and depths from signed distances of any shape, metres, negative inside."""
    if distances.size == 0:
        raise InputError("penetration of no vertices: give at least one vertex and one frame")
    depth = np.maximum(-distances, 0.0)
    inside = distances < 0.0
    mean = float(depth[inside].mean()) if inside.any() else 0.0
    return Penetration(ratio=float(inside.mean()), depth_mean=mean, depth_max=float(depth.max()))
